"""Triangulations at random vertices within a target."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from bcut.bounds.root import RootLimits, root_bound
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.instance import load_instance
from bcut.objectives.objective import make_objective
from bcut.separation.resolve import resolve
from bcut.solving.sampling import sample_vertices
from bcut.solving.search import Part, Search
from bcut.verification.triangulation import check_triangulation


def search_for(
    instance: str, sense: str, *, spanning: bool, separators: tuple[str, ...] = ("link",)
) -> Search:
    configuration = load_instance(instance)
    formulation = cocircuit_formulation(configuration, spanning=spanning)
    objective = make_objective("cardinality", formulation, sense=sense)
    return Search(
        whole=Part.whole(formulation, objective),
        make_separators=lambda: [resolve(name) for name in separators],
    )


CASES = [
    ("random:14,3,seed=1000", "min", True, 21),
    ("random:16,3,seed=1000", "min", True, 25),
    ("dodecahedron", "min", False, 23),
    ("sphere:11,3,seed=8", "max", False, 25),
]


@pytest.mark.parametrize(("instance", "sense", "spanning", "optimum"), CASES)
def test_a_triangulation_within_the_target_is_found(
    instance: str, sense: str, spanning: bool, optimum: int
) -> None:
    search = search_for(instance, sense, spanning=spanning)
    part = search.whole
    root = root_bound(part.formulation, part.objective)
    assert root.status == "dry", "the relaxation is fractional, or there would be nothing to look for"
    sample_vertices(search, part, root, Fraction(search.sign * optimum))
    assert search.columns is not None
    assert search.value == optimum
    check_triangulation(
        part.formulation.configuration.scalars(), part.formulation.simplices[search.columns].tolist()
    )


@pytest.mark.parametrize(("instance", "sense", "spanning", "optimum"), CASES)
def test_nothing_is_found_beyond_the_optimum(instance: str, sense: str, spanning: bool, optimum: int) -> None:
    search = search_for(instance, sense, spanning=spanning)
    root = root_bound(search.whole.formulation, search.whole.objective)
    sample_vertices(search, search.whole, root, Fraction(search.sign * optimum) - 1)
    assert search.columns is None


def test_columns_and_cuts_of_the_root_are_taken_over() -> None:
    search = search_for("random:16,3,seed=1000", "min", spanning=True)
    part = search.whole
    target = Fraction(25)
    root = root_bound(
        part.formulation, part.objective, search.separation(part), limits=RootLimits(target=target)
    )
    assert root.cuts
    sample_vertices(search, part, root, target)
    assert search.columns is not None
    assert search.value == 25
    assert np.isin(search.columns, root.columns).all()


def test_sampling_ends_at_the_deadline() -> None:
    search = search_for("random:14,3,seed=1000", "min", spanning=True)
    root = root_bound(search.whole.formulation, search.whole.objective)
    search.deadline = 0.0
    sample_vertices(search, search.whole, root, Fraction(21))
    assert search.columns is None

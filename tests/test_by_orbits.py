"""Solving and bounding over orbits of simplices gives what listing all simplices gives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import bcut
from bcut.errors import InputError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.placing import placing_triangulation
from bcut.instance import load_instance
from bcut.objectives.objective import make_objective
from bcut.solving import by_orbits, methods
from bcut.solving.search import Part, Search

CASES = [
    ("cube:3", False),
    ("cube:4", False),
    ("grid:3,3", False),
    ("grid:3,3", True),
    ("prism:6", False),
    ("cuboctahedron", False),
    ("icosahedron", False),
    ("dodecahedron", False),
    ("cross-polytope:4", False),
    ("cyclic:8,4", False),
    ("simplex-product:2,1,1", False),
    ("moae", True),
    ("random:8,3,seed=1", True),
]


@pytest.mark.parametrize(("name", "spanning"), CASES)
@pytest.mark.parametrize("sense", ["min", "max"])
def test_orbits_and_listing_agree(name: str, spanning: bool, sense: str) -> None:
    listed = bcut.solve(name, sense=sense, spanning=spanning, method="listing")
    averaged = bcut.solve(name, sense=sense, spanning=spanning, method="orbits")
    assert (averaged.status, averaged.value, averaged.bound) == ("optimal", listed.value, listed.value)
    assert averaged.root.lp == pytest.approx(listed.root.lp, abs=1e-6)
    assert averaged.size.columns == listed.size.columns
    assert averaged.problem.method == "orbits"
    assert bcut.verify(averaged).value == listed.value


@pytest.mark.parametrize("name", ["24-cell", "hypersimplex:6,3"])
def test_minimum_of_a_large_symmetric_polytope_meets_its_orbit_bound(name: str) -> None:
    result = bcut.solve(name, method="orbits")
    assert result.optimal
    assert result.root.lp == pytest.approx(result.value, abs=1e-6)


def test_the_five_cube_is_bounded_over_orbits_by_itself() -> None:
    result = bcut.bound("cube:5")
    assert result.problem.method == "orbits"
    assert (result.status, result.bound) == ("bound", 67)
    assert result.size.columns == 556_192


def test_averaged_link_cuts_close_the_gap_of_the_dodecahedron() -> None:
    without = bcut.bound("dodecahedron", method="orbits", separators=[])
    assert without.root.lp_after_cuts == pytest.approx(22.5, abs=1e-6)
    assert bcut.bound("dodecahedron", method="orbits").root.lp_after_cuts == pytest.approx(23, abs=1e-6)


def test_a_time_limit_leaves_a_triangulation_and_a_bound(
    monkeypatch: pytest.MonkeyPatch, time_is_up: Callable[[], None]
) -> None:
    reach = by_orbits._reach

    def too_late(*arguments: Any) -> str:
        time_is_up()
        return reach(*arguments)

    monkeypatch.setattr(by_orbits, "_reach", too_late)
    result = bcut.solve("icosidodecahedron", sense="max", method="orbits", time_limit=3600)
    assert result.status == "limit"
    assert result.triangulation is not None
    assert result.value <= result.bound


def test_an_interrupt_leaves_the_triangulation_that_took_no_search(monkeypatch: pytest.MonkeyPatch) -> None:
    def press(*_: object) -> str:
        raise KeyboardInterrupt

    monkeypatch.setattr(by_orbits, "_reach", press)
    result = bcut.solve("dodecahedron", method="orbits")
    assert result.status == "interrupted"
    assert result.triangulation is not None
    assert result.value >= result.bound == 23


def test_other_families_than_link_get_the_listing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(methods, "_ORBITS_FROM", 10)
    assert bcut.bound("cube:3", separators=["link"]).problem.method == "orbits"
    assert bcut.bound("cube:3", separators=[]).problem.method == "orbits"
    assert bcut.bound("cube:3", separators=["link", "clique"]).problem.method == "listing"


@pytest.mark.parametrize("name", ["clique", "convex-polygon", "face-crossing", "odd-cycle", "parity"])
def test_every_family_works_in_the_tree_over_orbits(name: str) -> None:
    """Programs over orbits have no table of signs, which some families would take if they could."""
    points = [[1, 0], [2, 0], [2, 1], [2, 3], [0, 0], [0, 1]]
    result = bcut.solve(points, sense="max", method="orbits", separators=[name])
    assert result.separators[name]
    assert (result.status, result.value) == ("optimal", bcut.solve(points, sense="max").value)


def test_orbits_refuse_what_is_not_known_to_be_invariant() -> None:
    with pytest.raises(InputError, match=r"random-costs:1.*cardinality"):
        bcut.solve("cube:3", objective="random-costs:1", method="orbits")
    with pytest.raises(InputError, match="solve only"):
        bcut.bound("cube:3", method="scip")


def test_the_tree_search_after_vain_attempts_starts_from_its_own_program(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    everything = cocircuit_formulation(load_instance("dodecahedron"))
    known = everything.columns_of(placing_triangulation(everything.configuration, everything.chirotope))

    def improve_in_another_program(search: Search, *_: object) -> None:
        search.whole = Part.whole(everything, make_objective("cardinality", everything))
        search.columns = known
        assert known.max() > search.columns_after_fixing, "no column of the program that comes next"

    monkeypatch.setattr(by_orbits, "_SMALL", 0)
    monkeypatch.setattr(by_orbits, "_search_invariant", lambda search, stage, **limits: None)
    monkeypatch.setattr(by_orbits, "_improve", improve_in_another_program)
    result = bcut.solve("dodecahedron", method="orbits")
    assert (result.status, result.value, result.bound) == ("optimal", 23, 23)

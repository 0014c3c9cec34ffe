"""Certificates over orbits: what `verify` proves from them, and what it refuses."""

from __future__ import annotations

import copy
from collections.abc import Callable
from fractions import Fraction
from functools import cache
from math import ceil, comb, floor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bcut
from bcut.errors import VerificationError
from bcut.geometry.canonical import CanonicalForms
from bcut.geometry.numbers import parse_coordinate
from bcut.geometry.orbits import subset_orbits
from bcut.geometry.symmetry import symmetry_group
from bcut.verification.exact_points import ExactPoints
from bcut.verification.symmetries import SetOrbits, check_symmetries

Data = dict[str, Any]


@cache
def solved(name: str, sense: str = "min") -> bcut.Result:
    return bcut.solve(name, sense=sense, method="orbits")


def result_of(name: str, sense: str = "min") -> Data:
    return copy.deepcopy(solved(name, sense).to_dict())


@pytest.mark.parametrize(
    ("name", "sense", "value"),
    [
        ("cube:3", "max", 6),
        ("cube:4", "min", 16),
        ("icosahedron", "max", 20),
        ("hypersimplex:6,2", "min", 25),
        ("24-cell", "min", 56),
        ("moae", "min", 1),
        ("random:8,3,seed=1", "max", None),  # has no symmetries: the group is trivial
        # Root LPs of 22.5 and 44.67: the bound takes averaged link cuts.
        ("dodecahedron", "min", 23),
    ],
)
def test_optimality_is_proven_from_the_file_alone(
    name: str, sense: str, value: int | None, tmp_path: Path
) -> None:
    result = solved(name, sense)
    assert value is None or result.value == value
    result.save(tmp_path / "result.json")
    verification = bcut.verify(tmp_path / "result.json")
    assert verification.proven_optimal
    assert verification.statement.startswith("optimal, proven exactly")


@pytest.mark.parametrize(
    ("name", "spanning"),
    [
        ("polygon:5,center", False),
        ("grid:3,3", True),
        ("grid:3,2,2", True),
        ("grid:3,3,3", True),
        ("cross-polytope:5", False),
        ("prism:5", False),
        ("antiprism:6", False),
        ("cuboctahedron", False),
        ("dodecahedron", False),
        ("simplex-product:2,1,1", False),
        ("hypersimplex:5,2", False),
        ("cyclic:8,5", False),
    ],
)
@pytest.mark.parametrize("sense", ["min", "max"])
def test_the_exact_bound_is_the_root_bound_after_rounding(name: str, spanning: bool, sense: str) -> None:
    listed = bcut.bound(name, sense=sense, spanning=spanning, separators=[], method="listing")
    result = bcut.bound(name, sense=sense, spanning=spanning, separators=[], method="orbits")
    verification = bcut.verify(result)
    assert verification.exact_bound is not None
    assert listed.root.lp is not None
    assert float(verification.exact_bound) == pytest.approx(listed.root.lp, abs=1e-6)
    # Rounding away from the optimum never helps a bound: a margin for the solver's tolerance is enough.
    rounded = ceil(listed.root.lp - 1e-6) if sense == "min" else floor(listed.root.lp + 1e-6)
    assert verification.rounded_bound == rounded


def swap_two_images(data: Data) -> None:
    images = data["certificate"]["symmetries"][0]
    images[0], images[1] = images[1], images[0]


def repeat_an_image(data: Data) -> None:
    data["certificate"]["symmetries"][0][0] = data["certificate"]["symmetries"][0][1]


def change_a_multiplier(data: Data) -> None:
    row = data["certificate"]["multipliers"][1]
    row[1] = str(Fraction(row[1]) + 1)


def leave_an_orbit_out(data: Data) -> None:
    del data["certificate"]["multipliers"][1]


def claim_more(data: Data) -> None:
    data["certificate"]["bound"] = str(Fraction(data["certificate"]["bound"]) + Fraction(1, 1000))


def give_an_image_a_multiplier_too(data: Data) -> None:
    certificate = data["certificate"]
    row, multiplier = certificate["multipliers"][1]
    images = (sorted(symmetry[v] for v in row) for symmetry in certificate["symmetries"])
    certificate["multipliers"].append([next(image for image in images if image != row), multiplier])


def take_another_coefficient(data: Data) -> None:
    data["certificate"]["volume_coefficient"] = 1


def forget_a_symmetry(data: Data) -> None:
    # Fewer symmetries make more orbits, whose rows then have no multipliers.
    del data["certificate"]["symmetries"][0]


def drop_a_simplex(data: Data) -> None:
    data["triangulation"].pop()


def exchange_a_vertex(data: Data) -> None:
    simplex = data["triangulation"][0]
    simplex[0] = next(v for v in range(len(data["instance"]["points"])) if v not in simplex)
    simplex.sort()


@pytest.mark.parametrize(
    ("tamper", "reason"),
    [
        (swap_two_images, "symmetry 0 of the certificate is no affine symmetry"),
        (repeat_an_image, "symmetry 0 of the certificate is no permutation"),
        (change_a_multiplier, "its multipliers prove .* only"),
        (leave_an_orbit_out, "its multipliers prove .* only"),
        (claim_more, "its multipliers prove .* only"),
        (forget_a_symmetry, "its multipliers prove .* only"),
        (give_an_image_a_multiplier_too, "belongs to an orbit that has a multiplier already"),
        (take_another_coefficient, "coefficient 1"),
        (drop_a_simplex, "belong.* to one simplex only"),
        (exchange_a_vertex, "simplices overlap|belong.* to one simplex only|is flat"),
    ],
)
@pytest.mark.parametrize("name", ["cube:4", "hypersimplex:6,2"])
def test_tampering_is_refused(name: str, tamper: Callable[[Data], None], reason: str) -> None:
    data = result_of(name)
    tamper(data)
    with pytest.raises(VerificationError, match=reason):
        bcut.verify(data)


def turned_around(cut: Data) -> None:
    cut["multiplier"] = str(-Fraction(cut["multiplier"]))


def tighter(cut: Data) -> None:
    cut["rhs"] = -1


def another_simplex(cut: Data) -> None:
    cut["coefficients"][0] += 1


@pytest.mark.parametrize("tamper", [turned_around, tighter, another_simplex])
def test_tampering_with_an_averaged_cut_is_refused(tamper: Callable[[Data], None]) -> None:
    data = result_of("dodecahedron")
    assert data["certificate"]["cuts"]
    tamper(data["certificate"]["cuts"][0])
    with pytest.raises(VerificationError, match="cut 0 of the certificate"):
        bcut.verify(data)


def test_rows_whose_sides_a_symmetry_exchanges_are_refused() -> None:
    data = result_of("cube:3")
    # The plane through two opposite edges: reflections in it exchange its sides.
    data["certificate"]["multipliers"].append([[0, 1, 6], "1/3"])
    with pytest.raises(VerificationError, match="a symmetry exchanges its sides"):
        bcut.verify(data)


def test_a_table_that_would_be_too_large_is_not_made() -> None:
    verification = bcut.verify(result_of("cube:4"), max_subsets=1000)
    assert not verification.proven_optimal
    assert f"a table of {comb(16, 4):,} sets" in verification.statement


def test_costs_that_a_symmetry_changes_prove_nothing() -> None:
    data = result_of("cube:3")
    data["problem"]["objective"] = "costs:mine.json"
    data["problem"]["costs"] = {"default": "1", "costs": [[[0, 1, 2, 4], "1"], [[1, 2, 4, 7], "1/2"]]}
    data["value"] = data["bound"] = None
    data["triangulation"], data["status"], data["gap"] = None, "limit", None
    assert "not known to be invariant" in bcut.verify(data).statement


def test_costs_of_points_that_there_are_not_prove_nothing() -> None:
    data = result_of("cube:3")
    data["problem"]["objective"] = "costs:mine.json"
    data["problem"]["costs"] = {"default": "1", "costs": [[[0, 1, 2, 99], "3"]]}
    assert "not known to be invariant" in bcut.verify(data).statement


@pytest.mark.parametrize("objective", ["random-costs:7", "weight", "volume"])
def test_a_table_that_the_objective_does_not_use_makes_nothing_invariant(objective: str) -> None:
    """The bound over orbits would be one on the costs of a few simplices, and more than a triangulation has."""
    data = bcut.solve("cube:3", objective=objective, method="listing").to_dict()
    data["problem"]["costs"] = {"default": "1", "costs": []}
    claim = Fraction(21, 20) * Fraction(data["value"])
    orbits = result_of("cube:3")["certificate"]
    data["certificate"] = {**orbits, "bound": "-1000", "cuts": [], "multipliers": [["volume", str(claim)]]}
    verification = bcut.verify(data)
    assert "not known to be invariant" in verification.statement
    assert not verification.proven_optimal


@pytest.mark.parametrize("name", ["cube:3", "dodecahedron", "simplex-product:2,1,1", "prism:5"])
def test_orbits_of_sets_agree_with_the_geometry_of_the_model(name: str) -> None:
    configuration = bcut.load_instance(name)
    points = ExactPoints([[parse_coordinate(x) for x in point] for point in configuration.exact_points()])
    group = symmetry_group(configuration)
    n, d = configuration.n, configuration.dimension
    basis = tuple(bcut.solve(configuration, method="orbits").triangulation[0])  # type: ignore[index]
    symmetries = check_symmetries(points, group.generators.tolist(), basis)
    forms = CanonicalForms(group)
    for size in range(1, d + 1):
        orbits = SetOrbits(symmetries, n, size)
        orbits.add_all()
        assert sum(orbits.sizes) == comb(n, size)
        assert set(np.bincount(np.abs(orbits.labels))[1:].tolist()) == set(orbits.sizes)
        least = forms.of(np.array(orbits.representatives)).images
        independent = {tuple(row) for row in subset_orbits(configuration, forms, size).tolist()}
        assert independent <= {tuple(row) for row in least.tolist()}
        assert len(np.unique(least, axis=0)) == len(orbits.sizes)
        for representative, length in zip(orbits.representatives, orbits.sizes, strict=True):
            assert len(group.orbit(representative)) == length

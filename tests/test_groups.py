"""Symmetries that a user gives, and triangulations that have to be invariant under some."""

from __future__ import annotations

import copy
import json
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import bcut
from bcut.errors import InputError, VerificationError
from bcut.files.permutations import read_permutations
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.triangulations import triangulations

# Of the 3-cube, whose points are numbered by their binary digits.
REFLECTION = [1, 0, 3, 2, 5, 4, 7, 6]
EXCHANGE = [0, 2, 1, 3, 4, 6, 5, 7]


def invariant_sizes(name: str, generators: list[list[int]]) -> list[int]:
    """Return the sizes of all triangulations that some permutations leave invariant."""
    configuration = bcut.load_instance(name)
    chirotope = Chirotope.of(configuration)
    sizes = []
    for chosen in triangulations(chirotope):
        simplices = {tuple(row) for row in chirotope.bases[list(chosen)].tolist()}
        images = [{tuple(sorted(g[v] for v in simplex)) for simplex in simplices} for g in generators]
        if all(image == simplices for image in images):
            sizes.append(len(simplices))
    return sizes


@pytest.mark.parametrize(
    ("name", "generators"),
    [
        ("cube:3", [EXCHANGE]),
        ("cube:3", [[7 - v for v in range(8)]]),
        ("cube:3", [[0, 2, 4, 6, 1, 3, 5, 7]]),
        ("polygon:6", [[1, 2, 3, 4, 5, 0]]),
        ("polygon:6", [[3, 4, 5, 0, 1, 2]]),
        ("grid:3,3", [[8 - v for v in range(9)]]),
        ("prism:3", [[1, 2, 0, 4, 5, 3]]),
    ],
)
@pytest.mark.parametrize("sense", ["min", "max"])
def test_invariant_optima_are_those_of_all_invariant_triangulations(
    name: str, generators: list[list[int]], sense: str
) -> None:
    result = bcut.solve(name, sense=sense, invariant_under=generators)
    sizes = invariant_sizes(name, generators)
    if not sizes:
        assert (result.status, result.triangulation) == ("infeasible", None)
        bcut.verify(result)
        return
    assert (result.status, result.value) == ("optimal", min(sizes) if sense == "min" else max(sizes))
    assert any("invariant" in check for check in bcut.verify(result).checks)


def test_there_may_be_no_invariant_triangulation() -> None:
    # The reflection exchanges the diagonals of four faces.
    result = bcut.solve("cube:3", invariant_under=[REFLECTION])
    assert (result.status, result.triangulation) == ("infeasible", None)
    assert not invariant_sizes("cube:3", [REFLECTION])


def test_an_order_is_enough() -> None:
    result = bcut.solve("cube:3", invariant_under=4)
    assert result.status == "optimal"
    assert result.value == 5
    assert result.problem.invariant_under


def test_a_triangulation_that_is_not_invariant_is_refused() -> None:
    data = copy.deepcopy(bcut.solve("cube:3", invariant_under=[EXCHANGE]).to_dict())
    data["problem"]["invariant_under"] = [[REFLECTION]]
    with pytest.raises(VerificationError, match="is not invariant under the symmetries"):
        bcut.verify(data)


def test_given_symmetries_give_the_same_bound() -> None:
    few = bcut.bound("cube:4", symmetries=[[15 - v for v in range(16)]])
    assert few.bound == bcut.bound("cube:4", method="orbits").bound == 16
    assert few.certificate.symmetries == [[15 - v for v in range(16)]]
    assert few.size.rows > bcut.bound("cube:4", method="orbits").size.rows
    assert bcut.verify(few).rounded_bound == 16


def test_symmetries_of_a_table_of_costs_are_those_that_fix_it(tmp_path: Path) -> None:
    # All tetrahedra at one vertex of the cube cost more: the symmetries that are left fix the vertex.
    costs = [[list(s), 3] for s in combinations(range(8), 4) if 0 in s]
    file = tmp_path / "costs.json"
    file.write_text(json.dumps({"default": 1, "costs": costs}))
    objective = f"costs:{file}"
    listed = bcut.solve("cube:3", objective=objective, method="listing")
    result = bcut.solve("cube:3", objective=objective, method="orbits")
    assert (result.value, result.status) == (listed.value, "optimal")
    assert result.certificate.symmetries
    assert all(images[0] == 0 for images in result.certificate.symmetries)
    assert bcut.verify(result).proven_optimal


def test_files_of_permutations(tmp_path: Path) -> None:
    file = tmp_path / "square.dat"
    file.write_text("# a square\n[[0,0,1],[1,0,1],[1,1,1],[0,1,1]]\n# a quarter turn\n[[1,2,3,0]]\n")
    assert read_permutations(file, 4) == [[1, 2, 3, 0]]
    result = bcut.solve(str(file), symmetries=str(file), invariant_under=str(file))
    assert result.status == "infeasible"
    alone = tmp_path / "half.json"
    alone.write_text("[[2, 3, 0, 1]]")
    assert bcut.solve(str(file), invariant_under=alone).value == 2


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("a.json", "[[1, 0, 3, 2]", "no list of permutations"),
        ("a.json", '{"a": 1}', "no list of permutations"),
        ("a.json", "[[1, 0, 3, 3]]", "permutation 0 .* does not have each of the 4 points"),
        ("a.json", "[[1, 0, 3, 2], [0, 1, 2]]", "permutation 1 .* does not have each of the 4 points"),
        ("a.json", "[[1, 0, true, 2]]", "does not have each"),
        ("a.json", "[[1, 0, 2, 3]]", "permutation 0 .* is no affine symmetry"),
        ("a.dat", "[[0,0,1],[1,0,1],[1,1,1],[0,1,1]]", "no symmetry generators behind the points"),
    ],
)
def test_bad_files_are_refused(name: str, text: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    square = bcut.PointConfiguration.from_values([[0, 0], [1, 0], [1, 1], [0, 1]])
    with pytest.raises(InputError, match=reason):
        bcut.solve(square, symmetries=tmp_path / name)


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"invariant_under": 1}, "order of at least 2"),
        ({"invariant_under": 5}, "no subgroup of order 5"),
        ({"invariant_under": 2, "method": "listing"}, "method 'listing' does not work with symmetries"),
    ],
)
def test_what_cannot_be_is_said(options: dict[str, object], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        bcut.solve("cube:3", **options)  # type: ignore[arg-type]


def test_arrays_do_as_well() -> None:
    assert bcut.solve("cube:3", invariant_under=np.array([EXCHANGE])).status == "optimal"


@pytest.mark.parametrize("sense", ["min", "max"])
@pytest.mark.parametrize("unit", [1.0, 0.1, 1e-12])
def test_invariant_optima_of_costs_without_a_common_unit(unit: float, sense: str, tmp_path: Path) -> None:
    """The least invariant value may be billions of units of doubles above the bound."""
    configuration = bcut.load_instance("grid:3,3")
    rotation = [6, 3, 0, 7, 4, 1, 8, 5, 2]
    half = [rotation[image] for image in rotation]
    chirotope = Chirotope.of(configuration)
    costs: dict[tuple[int, ...], float] = {}
    rng = np.random.default_rng(1)
    for simplex in map(tuple, chirotope.bases.tolist()):
        image = tuple(sorted(half[v] for v in simplex))
        costs[simplex] = costs.get(image, unit * float(rng.random()))
    file = tmp_path / "costs.json"
    file.write_text(json.dumps({"costs": [[simplex, cost] for simplex, cost in costs.items()]}))
    values = []
    for chosen in triangulations(chirotope):
        simplices = {tuple(row) for row in chirotope.bases[list(chosen)].tolist()}
        if {tuple(sorted(half[v] for v in simplex)) for simplex in simplices} == simplices:
            values.append(sum(costs[simplex] for simplex in simplices))
    best = min(values) if sense == "min" else max(values)
    # The limit only ends what would not come to an end.
    result = bcut.solve(
        configuration, objective=f"costs:{file}", sense=sense, invariant_under=[half], time_limit=300
    )
    assert (result.status, result.value) == ("optimal", pytest.approx(best, rel=1e-9))
    assert bcut.verify(result).value == pytest.approx(best, rel=1e-9)

"""Dissections by formulations: all of them are there, none is cut off, and results say what they are."""

from __future__ import annotations

from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import BUILDERS, DEGENERATE, GENERAL
from oracles import at_work, costs_of

import bcut
from bcut.errors import InputError, ResultError, VerificationError
from bcut.formulations.chambers import chamber_formulation
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.crossings import crossing_matrix
from bcut.geometry.overlaps import overlap_matrix
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.scip.host import branch_and_cut
from bcut.separation.resolve import built_in_names, resolve
from bcut.verification.dissection import check_dissection
from bcut.verification.triangulation import check_triangulation
from bcut.verification.verify import verify


def covered_by(configuration: PointConfiguration, simplices: np.ndarray) -> np.ndarray:
    """Which simplices contain which of many random points, by floating-point barycentric coordinates."""
    points, (count, size) = configuration.floats, simplices.shape
    corners = np.concatenate((points[simplices].transpose(0, 2, 1), np.ones((count, 1, size))), axis=1)
    found = set()
    for weights in np.random.default_rng(0).dirichlet(np.full(configuration.n, 0.6), size=4000):
        target = np.append(weights @ points, 1.0)
        coordinates = np.linalg.solve(corners, np.tile(target[:, None], (count, 1, 1)))[..., 0]
        if np.abs(coordinates).min() > 1e-9:
            found.add(tuple((coordinates > 0).all(axis=1).tolist()))
    return np.array(sorted(found))


@lru_cache
def dissections(configuration: PointConfiguration) -> list[tuple[int, ...]]:
    """All dissections, by brute force over exact covers of random points."""
    rows = covered_by(configuration, Chirotope.of(configuration).bases)
    found: list[tuple[int, ...]] = []

    def search(chosen: list[int], covered: np.ndarray) -> None:
        if covered.all():
            found.append(tuple(sorted(chosen)))
            return
        for column in np.flatnonzero(rows[int(np.flatnonzero(~covered)[0])]).tolist():
            if not (rows[:, column] & covered).any():
                search([*chosen, column], covered | rows[:, column])

    search([], np.zeros(len(rows), dtype=bool))
    return found


@pytest.mark.parametrize(
    "instance", ["grid:3,2", "cube:3", "prism:3", "cross-polytope:3", "polygon:5,center", "grid:4,2"]
)
@pytest.mark.parametrize("name", ["0", "chambers"])
def test_dissections_are_all_there(instance: str, name: str) -> None:
    configuration = load_instance(instance)
    chirotope = Chirotope.of(configuration)
    every = dissections(configuration)
    assert set(triangulations(chirotope)) <= set(every)
    for seed in range(3):
        costs = np.random.default_rng(seed).integers(1, 20, len(chirotope.bases))
        formulation = BUILDERS[name](configuration, dissection=True)
        for sense in ("min", "max"):
            tree = branch_and_cut(formulation, costs_of(formulation, costs, sense))
            assert tree.columns is not None
            assert tuple(sorted(tree.columns.tolist())) in every
            values = [costs[list(columns)].sum() for columns in every]
            assert costs[tree.columns].sum() == (min(values) if sense == "min" else max(values))


@pytest.mark.parametrize("family", [name for name in built_in_names() if resolve(name).dissections])
@pytest.mark.parametrize("instance", ["cube:3", "grid:3,3", "grid:4,2", "polygon:5,center"])
def test_cuts_for_dissections_cut_none_off(instance: str, family: str) -> None:
    """What a family claims: at points far outside the relaxation, every cut is satisfied by every dissection."""
    configuration = load_instance(instance)
    chirotope = Chirotope.of(configuration)
    every = np.zeros((0, len(chirotope.bases)), dtype=np.int64)
    for columns in islice(dissections(configuration), 400):
        every = np.vstack((every, np.isin(np.arange(len(chirotope.bases)), columns)))
    formulation = chamber_formulation(configuration, dissection=True)
    separation = at_work(formulation, resolve(family))
    random = np.random.default_rng(0)
    found = 0
    for share in (0.2, 0.4, 0.7):
        x = np.where(
            random.random(len(chirotope.bases)) < share,
            random.choice([0.4, 0.5, 0.6], len(chirotope.bases)),
            0,
        )
        for cut in separation.round(x):
            found += 1
            assert (every[:, cut.columns] @ cut.coefficients <= cut.rhs).all()
    if family != "convex-polygon" or configuration.dimension == 2:
        assert found


def test_a_dissection_that_is_no_triangulation() -> None:
    """Above the long edge 0 2 lies one triangle, below it two that meet in the point 1 between: not face to face."""
    points = PointConfiguration.from_values([[0, 0], [2, 0], [4, 0], [2, 3], [2, -3]])
    costs = {(0, 2, 3): 0, (0, 1, 4): 0, (1, 2, 4): 0}
    for name in ("0", "chambers"):
        formulation = BUILDERS[name](points, dissection=True)
        values = np.array([costs.get(tuple(simplex), 9) for simplex in formulation.simplices.tolist()])
        tree = branch_and_cut(formulation, costs_of(formulation, values))
        assert tree.columns is not None
        chosen = formulation.simplices[tree.columns].tolist()
        assert sorted(map(tuple, chosen)) == sorted(costs)
        report = check_dissection(points.scalars(), chosen)
        assert report.volume == 12
        with pytest.raises(VerificationError, match="facet"):
            check_triangulation(points.scalars(), chosen)
        with pytest.raises(VerificationError, match="contains the point 1"):
            check_dissection(points.scalars(), chosen, spanning=True)
        with pytest.raises(VerificationError, match="do not add up"):
            check_dissection(points.scalars(), chosen[:2])
        with pytest.raises(VerificationError, match="common interior point"):
            check_dissection(points.scalars(), [*chosen, [0, 3, 4]])


def test_results_say_that_they_are_dissections(tmp_path: Path) -> None:
    costs = tmp_path / "costs.json"
    costs.write_text('{"default": 9, "costs": [[[0, 2, 3], 0], [[0, 1, 4], 0], [[1, 2, 4], 0]]}')
    points = PointConfiguration.from_values([[0, 0], [2, 0], [4, 0], [2, 3], [2, -3]])
    result = bcut.solve(points, objective=f"costs:{costs}", dissection=True)
    assert (result.status, result.value) == ("optimal", 0)
    assert result.problem.dissection
    assert result.problem.formulation == "chambers"
    assert verify(result).statement.startswith("optimal, proven exactly: the dissection is verified")
    data = result.to_dict()
    data["problem"]["dissection"] = False
    with pytest.raises(VerificationError, match="inside the hull"):
        verify(data)
    assert bcut.solve(points, objective=f"costs:{costs}").value == 9


@pytest.mark.parametrize("spanning", [False, True])
@pytest.mark.parametrize("instance", ["grid:3,3", "icosahedron", "random:8,3,seed=1"])
def test_certificates_of_chambers_prove_optimality(instance: str, spanning: bool) -> None:
    for options in ({"sense": "min"}, {"sense": "max"}, {"objective": "weight"}):
        result = bcut.solve(instance, dissection=True, spanning=spanning, **options)
        found = verify(result)
        assert found.exact_bound is not None
        assert found.value is not None
        assert float(found.exact_bound) == pytest.approx(float(found.value), rel=1e-9)
        lp = result.root.lp
        assert lp is not None
        assert float(found.exact_bound) == pytest.approx(lp, rel=1e-9)


def test_certificates_of_chambers_are_re_checked() -> None:
    data = bcut.solve("cube:3", dissection=True).to_dict()
    assert verify(data).proven_optimal
    rows = data["certificate"]["multipliers"]

    def changed(multipliers: list[Any]) -> dict[str, Any]:
        return {**data, "certificate": {**data["certificate"], "multipliers": multipliers}}

    (row, value), *rest = rows
    for wrong in ([[row, f"{value}1"], *rest], rest):
        with pytest.raises(VerificationError, match="multipliers prove"):
            verify(changed(wrong))
    with pytest.raises(VerificationError, match="lies in a hyperplane"):
        verify(changed([[{"flag": [0, 1, 2, 3]}, value], *rest]))
    with pytest.raises(ResultError, match="each row has one multiplier"):
        verify(changed([[row, value], *rows]))
    # Rows of triangulations prove nothing about dissections.
    other = bcut.solve("cube:3").to_dict()
    with pytest.raises(VerificationError, match="rows that triangulations satisfy"):
        verify({**data, "certificate": other["certificate"]})
    assert verify({**other, "certificate": data["certificate"]}).proven_optimal


def test_overlapping_is_crossing_in_general_position_and_rarer_elsewhere() -> None:
    for instance in GENERAL:
        chirotope = Chirotope.of(load_instance(instance))
        crossing = crossing_matrix(chirotope, chirotope.bases)
        assert np.array_equal(overlap_matrix(chirotope, chirotope.bases), crossing)
    for instance in DEGENERATE[:4]:
        chirotope = Chirotope.of(load_instance(instance))
        overlapping = overlap_matrix(chirotope, chirotope.bases)
        crossing = crossing_matrix(chirotope, chirotope.bases)
        assert not (overlapping & ~crossing).any()
        assert (crossing & ~overlapping).any()


def test_formulations_for_triangulations_refuse_dissections() -> None:
    for name in ("1", "2"):
        with pytest.raises(InputError, match="take one of 0, chambers"):
            bcut.solve("cube:3", formulation=name, dissection=True)
    with pytest.raises(InputError, match="separator 'link' makes cuts"):
        bcut.solve("cube:3", dissection=True, separators=["link"])
    # In general position there is no difference.
    assert bcut.solve("random:7,2,seed=1", dissection=True, separators=["link"]).status == "optimal"

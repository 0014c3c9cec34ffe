"""Volumes in rows: enclosed exactly, and none so small that it misleads a solver."""

from __future__ import annotations

import json
from fractions import Fraction
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import BUILDERS
from oracles import costs_of
from oracles import incidence as all_triangulations

import bcut
from bcut.bounds.root import root_bound
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.formulation import UNBOUNDED
from bcut.formulations.lazy_rows import CoverageRows
from bcut.formulations.volume_rows import volume_rows
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.scip.host import branch_and_cut
from bcut.verification.verify import verify


@pytest.mark.parametrize(
    "instance", ["grid:3,3", "random:7,3,seed=3", "polygon:5,center", "prism:5", "icosahedron"]
)
def test_volume_rows_enclose_the_exact_volumes(instance: str) -> None:
    configuration = load_instance(instance)
    chirotope = Chirotope.of(configuration)
    rows = volume_rows(configuration, chirotope, chirotope.bases)
    assert rows.exact == (instance in ("grid:3,3",))
    shares = np.abs(np.linalg.det(np.diff(configuration.floats[chirotope.bases], axis=1)))
    for chosen in islice(triangulations(chirotope), 50):
        for row, low, high in zip(rows.coefficients.tolist(), rows.lower, rows.upper, strict=True):
            activity = sum(row[column] for column in chosen)
            assert low == -UNBOUNDED or activity >= low
            assert high == UNBOUNDED or activity <= high
            # Nothing but roundings separates a triangulation from equality.
            assert min(abs(activity - int(side)) for side in (low, high)) <= len(chosen)
    for row in rows.coefficients:
        relative = row / row.max() / (shares / shares.max())
        assert relative == pytest.approx(np.ones(len(relative)), rel=1e-6)


def sliver() -> PointConfiguration:
    """A square with a point so close to an edge that the triangle between them is less than any tolerance."""
    return PointConfiguration.from_values([[0, 0], [1, 0], [0, 1], [1, 1], ["1/2", "1/1000000000"]])


@pytest.mark.parametrize("name", ["0", "1"])
def test_tiny_simplices_are_not_left_out(name: str) -> None:
    """Without the triangle under the point, the volume row holds up to 5e-10: only exact coverage tells."""
    configuration = sliver()
    formulation = BUILDERS[name](configuration)
    assert any(isinstance(rows, CoverageRows) for rows in formulation.lazy)
    costs = np.array([100 if simplex == [0, 1, 4] else 1 for simplex in formulation.simplices.tolist()])
    table = all_triangulations(formulation)
    with_sliver = formulation.columns_of(np.array([[0, 1, 4]]))[0]
    cheap = np.flatnonzero([4 in simplex for simplex in formulation.simplices.tolist()])
    part = formulation.restricted_to(cheap)
    tree = branch_and_cut(part, costs_of(part, costs[cheap]))
    assert tree.columns is not None
    assert with_sliver in cheap[tree.columns]
    best = min(row @ costs for row in table if row[with_sliver])
    assert costs[cheap[tree.columns]].sum() == best == 103
    root = root_bound(part, costs_of(part, costs[cheap]))
    assert root.status == "integral"
    assert root.lp == pytest.approx(103)


@pytest.mark.parametrize("name", ["0", "1"])
def test_volumes_far_below_tolerances_mislead_no_solver(name: str, tmp_path: Path) -> None:
    """Shares of the hull between 10^-12 and 1: SCIP's own cuts from such rows cut off all optima."""
    points = [
        [2 * 10**9, 10**20, 2],
        [0, 0, 2 * 10**20],
        [0, 2, 0],
        [0, 2 * 10**20, 10**9],
        [1, 0, 10**20],
        [10**9, 10**20, 10**9],
    ]
    table: list[Any] = [[[0, 1, 3, 5], -4], [[0, 2, 4, 5], -1]]
    table += [[simplex, 0] for simplex in ([1, 2, 3, 4], [1, 2, 3, 5], [1, 2, 4, 5], [2, 3, 4, 5])]
    file = tmp_path / "costs.json"
    file.write_text(json.dumps({"default": -5, "costs": table}))
    asked: dict[str, Any] = {"objective": f"costs:{file}", "sense": "max", "spanning": True, "separators": []}
    for method in ("scip", "listing"):
        result = bcut.solve(points, formulation=name, method=method, **asked)
        assert (result.status, result.value) == ("optimal", -15)
    assert verify(bcut.solve(points, **asked)).proven_optimal


def test_shares_of_the_hull_are_0_or_not_too_small_for_solvers() -> None:
    configuration = sliver()
    chirotope = Chirotope.of(configuration)
    rows = volume_rows(configuration, chirotope, chirotope.bases)
    lower, upper = (row / 2.0**shift for row, shift in zip(rows.coefficients, rows.shifts, strict=True))
    assert set(lower[lower < 2.0**-28]) == {0.0}
    assert upper.min() == 2.0**-28
    assert (lower <= upper).all()


@pytest.mark.parametrize(
    ("name", "sense", "seed"), [("1", "max", 5592), ("0", "max", 5226), ("0", "max", 5174)]
)
def test_what_encloses_a_row_is_left_alone_by_scip(name: str, sense: Any, seed: int, tmp_path: Path) -> None:
    """Most costs are large: with its own presolve and cuts SCIP called other triangulations optimal, or none."""
    configuration = load_instance("random:8,2,seed=1")
    simplices = cocircuit_formulation(configuration).simplices.tolist()
    rng = np.random.default_rng(seed)
    rng.choice(3)
    small = zip(rng.integers(-3, 8, len(simplices)), rng.choice([1, 2, 3, 101], len(simplices)), strict=True)
    share, size, sign = rng.random(), 10 ** int(rng.integers(2, 16)), int(rng.choice([1, -1]))
    costs = [Fraction(int(a), int(b)) for a, b in small]
    costs = [
        sign * Fraction(size + int(rng.integers(5)), int(rng.choice([1, 3])))
        if rng.random() < share
        else cost
        for cost in costs
    ]
    table = [[simplex, str(cost)] for simplex, cost in zip(simplices, costs, strict=True)]
    file = tmp_path / "costs.json"
    file.write_text(json.dumps({"costs": table}))
    values = [
        sum(costs[column] for column in chosen) for chosen in triangulations(Chirotope.of(configuration))
    ]
    result = bcut.solve(
        configuration, objective=f"costs:{file}", sense=sense, formulation=name, method="scip"
    )
    assert (result.status, result.value) == ("optimal", pytest.approx(float(max(values)), rel=1e-9))

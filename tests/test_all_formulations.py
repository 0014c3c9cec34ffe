"""All formulations have the same optima, relaxations ordered as in the paper, and dissections where they are wanted."""

from __future__ import annotations

import json
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from oracles import HullCuts, at_work, costs_of
from reference import assert_triangulation
from scipy.optimize import linprog

import bcut
from bcut.bounds.relaxation import Relaxation
from bcut.bounds.root import root_bound
from bcut.errors import InputError, ResultError, TooLargeError, VerificationError
from bcut.formulations.chambers import chamber_formulation
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.face_sets import face_set_formulation
from bcut.formulations.formulation import UNBOUNDED, Formulation
from bcut.formulations.lazy_rows import CoverageRows, PairRows, violated_rows
from bcut.formulations.stable_sets import stable_set_formulation
from bcut.formulations.volume_rows import volume_rows
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.crossings import crossing_matrix
from bcut.geometry.overlaps import overlap_matrix
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.objectives.objective import make_objective
from bcut.scip.host import TreeOptions, branch_and_cut
from bcut.separation.resolve import built_in_names, resolve
from bcut.verification.dissection import check_dissection
from bcut.verification.triangulation import check_triangulation
from bcut.verification.verify import verify

BUILDERS: dict[str, Any] = {
    "0": stable_set_formulation,
    "1": face_set_formulation,
    "2": cocircuit_formulation,
    "chambers": chamber_formulation,
}
GENERAL = ["random:8,2,seed=1", "random:7,3,seed=1", "random:7,4,seed=2", "polygon:7", "cyclic:7,3"]
DEGENERATE = ["grid:3,3", "cube:3", "prism:4", "cross-polytope:4", "moae", "polygon:5,center"]


def built(name: str, instance: str, **options: Any) -> Formulation:
    return BUILDERS[name](load_instance(instance), **options)


def all_triangulations(formulation: Formulation) -> np.ndarray:
    found = list(triangulations(formulation.chirotope, spanning=formulation.spanning))
    table = np.zeros((len(found), len(formulation.simplices)), dtype=np.int64)
    for row, columns in enumerate(found):
        table[row, list(columns)] = 1
    return table


def lp_value(formulation: Formulation, costs: np.ndarray) -> float:
    """Minimise over the relaxation by another solver and another route: all rows that are written."""
    assert not any(isinstance(rows, PairRows) for rows in formulation.lazy)
    entries, lower, upper = formulation.scaled
    matrix = formulation.matrix.copy().astype(float)
    matrix.data = entries
    above, below = np.isfinite(upper), np.isfinite(lower)
    rows = np.concatenate((matrix[above].toarray(), -matrix[below].toarray()))
    sides = np.concatenate((upper[above], -lower[below]))
    padded = np.concatenate((costs, np.zeros(len(formulation.faces))))
    solution = linprog(padded, A_ub=rows, b_ub=sides, bounds=(0, 1), method="highs-ds")
    assert solution.status == 0
    return float(solution.fun)


@pytest.mark.parametrize("spanning", [False, True])
@pytest.mark.parametrize("objective", ["cardinality", "random-costs:3", "weight"])
@pytest.mark.parametrize("instance", [*GENERAL, *DEGENERATE])
def test_all_agree_with_brute_force(instance: str, objective: str, spanning: bool) -> None:
    reference = built("2", instance, spanning=spanning)
    table = all_triangulations(reference)
    senses = ("min", "max") if objective == "cardinality" else ("min",)
    for sense in senses:
        measure = make_objective(objective, reference, sense=sense)
        values = [measure.value(np.flatnonzero(row)) for row in table]
        optimum = min(values) if sense == "min" else max(values)
        for name in BUILDERS:
            result = bcut.solve(
                instance, formulation=name, objective=objective, sense=sense, spanning=spanning
            )
            assert result.status == "optimal"
            assert result.problem.formulation == name
            assert result.value == pytest.approx(float(optimum), rel=1e-9, abs=1e-12)
            assert verify(result).value is not None
            assert result.triangulation is not None
            assert_triangulation(load_instance(instance).scalars(), result.triangulation, spanning=spanning)


@pytest.mark.parametrize("instance", [*GENERAL, *DEGENERATE])
def test_relaxations_are_ordered(instance: str) -> None:
    """Propositions 2 and 3 in many directions: P0 = P1, and P2 within; chambers lie between P2 and dissections' P0."""
    configuration = load_instance(instance)
    chirotope = Chirotope.of(configuration)
    programs = {
        "0": stable_set_formulation(configuration, chirotope=chirotope, lazy=False),
        "1": face_set_formulation(configuration, chirotope=chirotope, lazy=False),
        "2": cocircuit_formulation(configuration, chirotope=chirotope),
        "overlaps": stable_set_formulation(configuration, chirotope=chirotope, dissection=True, lazy=False),
        "chambers": chamber_formulation(configuration, chirotope=chirotope, dissection=True),
    }
    random = np.random.default_rng(5)
    strict = 0
    for trial in range(12):
        costs = random.random(len(chirotope.bases)) - (0.3 if trial % 2 else 0.0)
        values = {name: lp_value(program, costs) for name, program in programs.items()}
        assert values["0"] == pytest.approx(values["1"], abs=1e-6)
        assert values["0"] <= values["2"] + 1e-7
        assert values["overlaps"] <= values["chambers"] + 1e-7
        assert values["chambers"] <= values["2"] + 1e-7
        if chirotope.is_general:
            assert values["chambers"] == pytest.approx(values["2"], abs=1e-7)
        strict += values["2"] > values["0"] + 1e-3
    assert strict


def test_chambers_alone_may_be_weaker_than_cocircuits() -> None:
    """In degenerate position dissections satisfy the chambers' rows, and cocircuit rows cut them off."""
    chambers = built("chambers", "cross-polytope:4", dissection=True)
    cocircuits = built("2", "cross-polytope:4")
    random = np.random.default_rng(0)
    gaps = [
        lp_value(cocircuits, costs) - lp_value(chambers, costs)
        for costs in random.random((30, len(chambers.simplices)))
    ]
    assert min(gaps) >= -1e-7
    assert max(gaps) > 1e-3


def test_the_strict_inclusion_at_a_point() -> None:
    """A point of P0 that no combination of triangulations comes near: half of everything around a heptagon."""
    stable, cocircuit = built("0", "polygon:7", lazy=False), built("2", "polygon:7")
    ones = np.ones(len(stable.simplices))
    assert lp_value(stable, ones) == pytest.approx(2.295897, abs=1e-5)
    assert lp_value(stable, -ones) == pytest.approx(-6.079417, abs=1e-5)
    assert lp_value(cocircuit, ones) == pytest.approx(5)
    assert lp_value(cocircuit, -ones) == pytest.approx(-5)


@pytest.mark.parametrize("name", ["0", "1"])
@pytest.mark.parametrize(
    "instance", ["random:7,2,seed=1", "grid:3,3", "random:7,3,seed=2", "polygon:5,center"]
)
def test_rows_on_demand_are_the_full_model(name: str, instance: str) -> None:
    full, lazy = built(name, instance, lazy=False), built(name, instance, lazy=True)
    assert lazy.size[1] < full.size[1]
    assert lazy.size[0] == full.size[0]
    for seed in range(2):
        costs = np.random.default_rng(seed).integers(1, 50, len(full.simplices))
        for sense in ("min", "max"):
            bounds = [root_bound(program, costs_of(program, costs, sense)) for program in (full, lazy)]
            assert bounds[0].lp == pytest.approx(bounds[1].lp, abs=1e-4)
            sign = 1 if sense == "min" else -1
            for bound in bounds:
                assert bound.first is not None
                assert bound.lp is not None
                assert float(bound.first.value) <= sign * bound.lp + 1e-7
                assert float(bound.first.value) == pytest.approx(sign * bound.lp, abs=1e-3)
        trees = [branch_and_cut(program, costs_of(program, costs)) for program in (full, lazy)]
        assert [tree.status for tree in trees] == ["optimal", "optimal"]
        assert costs[trees[0].columns].sum() == costs[trees[1].columns].sum()


@pytest.mark.parametrize("presolve", [False, True])
def test_the_constraint_handler_without_presolve_and_heuristics(presolve: bool) -> None:
    lazy = built("0", "random:8,2,seed=4", lazy=True)
    costs = np.random.default_rng(1).integers(1, 9, len(lazy.simplices))
    options = TreeOptions(presolve=presolve, heuristics=presolve, scip_separators=presolve)
    tree = branch_and_cut(lazy, costs_of(lazy, costs), options=options)
    table = all_triangulations(lazy)
    assert tree.columns is not None
    assert costs[tree.columns].sum() == (table @ costs).min()


def test_an_error_in_an_oracle_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    lazy = built("0", "random:8,2,seed=4", lazy=True)

    def fail(*_: Any) -> None:
        raise RuntimeError("broken oracle")

    monkeypatch.setattr(PairRows, "violated", fail)
    with pytest.raises(RuntimeError, match="broken oracle"):
        branch_and_cut(lazy, make_objective("cardinality", lazy))


@pytest.mark.parametrize("name", ["0", "1", "chambers"])
def test_separators_see_the_simplices_only(name: str) -> None:
    formulation = built(name, "polygon:7")
    costs = np.random.default_rng(3).integers(0, 3, len(formulation.simplices))
    separation = at_work(formulation, HullCuts())
    found = root_bound(formulation, costs_of(formulation, costs), separation)
    best = (all_triangulations(formulation) @ costs).min()
    assert found.lp_after_cuts == pytest.approx(best, abs=1e-4)
    tree = branch_and_cut(formulation, costs_of(formulation, costs), at_work(formulation, HullCuts()))
    assert tree.columns is not None
    assert tree.columns.max() < len(formulation.simplices)
    assert costs[tree.columns].sum() == best


@pytest.mark.parametrize("name", ["0", "1"])
def test_polygon_cuts_fire_where_rows_are_weaker_than_chambers(name: str) -> None:
    found = bcut.bound("polygon:7", formulation=name, sense="max", separators=["convex-polygon"])
    assert found.root.lp == pytest.approx(6.079417, abs=1e-5)
    assert found.root.lp_after_cuts == pytest.approx(5, abs=1e-5)
    assert found.separators["convex-polygon"]["added"] >= 1


@pytest.mark.parametrize("seed", range(3))
def test_polygon_cuts_never_fire_in_formulation_2(seed: int) -> None:
    options: dict[str, Any] = {"objective": f"random-costs:{seed}", "separators": ["convex-polygon"]}
    for sense in ("min", "max"):
        found = bcut.bound(f"random:9,2,seed={seed}", sense=sense, **options)
        assert found.separators["convex-polygon"]["found"] == 0


@pytest.mark.parametrize("name", ["0", "1", "chambers"])
def test_restrictions_keep_what_the_simplices_need(name: str) -> None:
    options = {} if name == "chambers" else {"lazy": True}
    formulation = built(name, "grid:3,3", **options)
    table = all_triangulations(formulation)
    columns = np.flatnonzero(table[::40].any(axis=0))
    part = formulation.restricted_to(columns)
    assert part.simplices.tolist() == formulation.simplices[columns].tolist()
    assert all(any(set(face) <= set(s) for s in part.simplices.tolist()) for face in part.faces)
    left = np.delete(table, columns, axis=1).any(axis=1)
    costs = np.random.default_rng(0).integers(1, 30, len(columns))
    tree = branch_and_cut(part, costs_of(part, costs))
    assert tree.columns is not None
    assert costs[tree.columns].sum() == (table[~left][:, columns] @ costs).min()


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


def test_the_oracles_are_exact_at_0_1_points() -> None:
    formulation = built("0", "random:7,2,seed=2", lazy=True)
    table = {tuple(row) for row in all_triangulations(formulation).tolist()}
    random = np.random.default_rng(0)
    rows = sorted(table)
    asked = 0
    for _ in range(400):
        x = np.array(rows[random.integers(len(rows))])
        flips = random.integers(len(x), size=random.integers(0, 4))
        x[flips] = 1 - x[flips]
        violated = violated_rows(formulation.lazy, x.astype(float), 1e-6)
        assert bool(violated) == (tuple(x.tolist()) not in table)
        for row in violated:
            assert row.coefficients @ x[row.columns] > row.rhs
            assert all(row.coefficients @ np.array(t)[row.columns] <= row.rhs for t in rows)
        asked += bool(violated)
    assert 50 < asked < 400


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


def test_files_of_models_lack_no_rows(tmp_path: Any) -> None:
    bcut.export("grid:3,2", tmp_path / "all.lp", formulation="1")
    text = (tmp_path / "all.lp").read_text()
    assert "volume" in text
    assert "pair_" in text
    assert "x_0_1" in text
    with pytest.raises(TooLargeError, match="would lack them"):
        bcut.export("random:7,2,seed=1", tmp_path / "some.lp", formulation="0")


def test_a_relaxation_without_simplices_is_infeasible() -> None:
    part = built("1", "cube:3").restricted_to(np.array([], dtype=np.int64))
    assert part.size[0] == 0
    assert part.faces == ()
    assert root_bound(part, make_objective("cardinality", part)).status == "infeasible"
    assert Relaxation(part, make_objective("cardinality", part)).cuts == []

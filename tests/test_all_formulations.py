"""All formulations have the same optima, relaxations ordered as in the paper, and separators that fit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from builders import BUILDERS, DEGENERATE, GENERAL, built
from oracles import HullCuts, at_work, costs_of
from oracles import incidence as all_triangulations
from reference import assert_triangulation
from scipy.optimize import linprog

import bcut
from bcut.bounds.relaxation import Relaxation
from bcut.bounds.root import root_bound
from bcut.errors import TooLargeError
from bcut.formulations.chambers import chamber_formulation
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.face_sets import face_set_formulation
from bcut.formulations.formulation import Formulation
from bcut.formulations.lazy_rows import PairRows, violated_rows
from bcut.formulations.stable_sets import stable_set_formulation
from bcut.geometry.chirotope import Chirotope
from bcut.instance import load_instance
from bcut.objectives.objective import make_objective
from bcut.scip.host import TreeOptions, branch_and_cut
from bcut.verification.verify import verify


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

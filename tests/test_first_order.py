"""First-order bounds: never above the optimum, close to it in the end, the same in every run, and never lost."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from compact_programs import as_program, listed, solution_of
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

import bcut
from bcut.bounds.columns import Columns
from bcut.bounds.first_order import Progress, first_order_bound
from bcut.bounds.large_program import solve_large_program
from bcut.bounds.linear_program import LinearProgram, solve_linear_program
from bcut.bounds.repair import Program
from bcut.bounds.safe import safe_bound
from bcut.bounds.sifting import sift
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.compact import compact_program
from bcut.objectives.objective import make_objective


def optimum(matrix: Any, costs: np.ndarray, right: np.ndarray) -> float:
    solution = linprog(costs, A_eq=matrix, b_eq=right, method="highs")
    assert solution.status == 0
    return float(solution.fun)


def costs_of(kind: str, count: int, seed: int) -> np.ndarray:
    generator = np.random.default_rng(seed)
    return {
        "unit": np.ones(count),
        "maximum": -np.ones(count),
        "weights": generator.uniform(0.05, 1.0, count),
        "wide": 10.0 ** generator.uniform(-4, 2, count),
        "signed": generator.uniform(-1.0, 1.0, count),
    }[kind]


# Bounds ------------------------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    dimension=st.integers(2, 4),
    extra=st.integers(1, 7),
    seed=st.integers(0, 10**6),
    kind=st.sampled_from(["unit", "maximum", "weights", "wide", "signed"]),
    points=st.sampled_from([0, 1, 9]),
    iterations=st.sampled_from([3, 80, 1000]),
)
def test_bounds_never_exceed_the_optimum(
    dimension: int, extra: int, seed: int, kind: str, points: int, iterations: int
) -> None:
    program = listed(f"random:{dimension + 1 + extra},{dimension},seed={seed}")
    costs = costs_of(kind, len(program.simplices), seed)
    linear = as_program(program, costs, points=points)
    found = first_order_bound(linear, iterations=iterations, tolerance=1e-6)
    matrix = program.matrix()
    right = np.zeros(matrix.shape[0])
    right[0] = 1
    best = optimum(matrix, costs, right)
    scale = max(1.0, np.abs(costs).max())
    assert found.bound <= best + 1e-7 * scale
    # The multipliers prove what is claimed.
    reduced = costs - matrix.T @ found.duals
    np.testing.assert_allclose(found.reduced_costs, reduced, atol=1e-8 * scale)
    assert found.duals[0] + np.minimum(reduced, 0).sum() >= found.bound - 1e-7 * scale
    assert [bound for _, bound, _ in found.history] == sorted(bound for _, bound, _ in found.history)


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("random:60,2,seed=3", "weights"),
        ("random:20,3,seed=1", "unit"),
        ("random:20,3,seed=1", "weights"),
        ("random:20,3,seed=2", "maximum"),
        ("random:13,4,seed=4", "unit"),
        ("random:13,4,seed=5", "wide"),
        ("random:18,3,seed=6", "signed"),
        ("grid:3,3,2", "unit"),
    ],
)
def test_bounds_converge(name: str, kind: str) -> None:
    program = listed(name)
    costs = costs_of(kind, len(program.simplices), 1)
    found = first_order_bound(as_program(program, costs), tolerance=5e-5, iterations=40_000)
    matrix = program.matrix()
    right = np.zeros(matrix.shape[0])
    right[0] = 1
    best = optimum(matrix, costs, right)
    assert found.status == "converged"
    assert best - 1e-4 * abs(best) <= found.bound <= best + 1e-9 * abs(best)
    assert found.x @ costs == pytest.approx(best, rel=1e-3)


def test_the_exact_bound_of_repaired_multipliers_is_as_good() -> None:
    """Rounding the multipliers costs nothing, where no reduced cost is negative."""
    configuration = bcut.load_instance("random:22,3,seed=9")
    formulation = cocircuit_formulation(configuration, spanning=True)
    objective = make_objective("cardinality", formulation)
    program = compact_program(configuration, spanning=True)
    found = first_order_bound(as_program(program, objective.costs), tolerance=1e-3)
    proven = safe_bound(formulation.matrix, formulation.lower, formulation.upper, objective, found.duals)
    assert float(proven.value) == pytest.approx(found.bound, abs=1e-8)


def test_combinations_of_rows_save_iterations() -> None:
    program = listed("random:100,2,seed=1")
    costs = costs_of("weights", len(program.simplices), 2)
    plain = first_order_bound(as_program(program, costs, points=0), tolerance=1e-3)
    helped = first_order_bound(as_program(program, costs, points=32), tolerance=1e-3)
    assert plain.status == helped.status == "converged"
    assert 2 * helped.iterations < plain.iterations


@pytest.mark.parametrize("kind", ["unit", "weights"])
def test_inequalities(kind: str) -> None:
    """With cuts of both directions, as the averaged link cuts are, and multipliers of the right signs."""
    program = listed("random:16,3,seed=3")
    costs = costs_of(kind, len(program.simplices), 4)
    matrix = program.matrix().astype(float)
    plain = solution_of(program.formulation())
    generator = np.random.default_rng(5)
    # Two cuts that the relaxation's optimum violates, and one that it does not.
    used = plain > 1e-6
    cuts = np.vstack(
        (used, used & (generator.random(len(used)) < 0.5), generator.random(len(used)) < 0.3)
    ).astype(float)
    most = np.array([0.9 * plain.sum(), np.inf, np.inf])
    least = np.array([-np.inf, 0.5, 0.0])
    whole = sp.csr_array(sp.vstack((matrix, sp.csr_array(cuts))))
    right = np.zeros(matrix.shape[0])
    right[0] = 1
    lower, upper = np.concatenate((right, least)), np.concatenate((right, most))
    best = linprog(
        costs,
        A_eq=matrix,
        b_eq=right,
        A_ub=np.vstack((cuts[:1], -cuts[1:])),
        b_ub=np.concatenate((most[:1], -least[1:])),
        method="highs",
    )
    assert best.status == 0
    linear = Program(Columns.of_matrix(whole), costs, lower, upper, 1.0)
    found = first_order_bound(linear, tolerance=1e-5, iterations=60_000)
    assert found.status == "converged"
    assert best.fun * (1 - 2e-5) <= found.bound <= best.fun * (1 + 1e-9)
    assert found.duals[-3] <= 0 <= found.duals[-2:].min()
    solved = solve_large_program(LinearProgram(costs, whole.tocsr(), lower, upper))
    assert solved.status == "optimal"
    assert solved.value == pytest.approx(best.fun, rel=1e-8)
    assert solved.duals[-3] <= 1e-9
    assert solved.duals[-2:].min() >= -1e-9


def test_an_anchor_makes_up_for_costs_that_are_not_positive() -> None:
    program = listed("random:12,3,seed=7")
    corners = program.configuration.floats[program.simplices]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    matrix = sp.vstack((program.matrix().astype(float), sp.csr_array(volumes[None] / volumes.max()))).tocsr()
    right = np.zeros(matrix.shape[0])
    right[0], right[-1] = 1, volumes @ solution_of(program.formulation()) / volumes.max()
    costs = -np.ones(len(volumes))
    anchor = np.zeros(len(right))
    anchor[-1] = -2 * (volumes.max() / volumes).max()
    linear = Program(Columns.of_matrix(matrix), costs, right, right)
    assert first_order_bound(linear, iterations=10).bound == -np.inf
    found = first_order_bound(linear, anchor=anchor, tolerance=1e-4, iterations=60_000)
    best = optimum(matrix, costs, right)
    assert best - 1e-3 * abs(best) <= found.bound <= best + 1e-6
    assert found.reduced_costs.min() >= 0


# Running -----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def linear() -> Program:
    program = listed("random:24,3,seed=2")
    return as_program(program, np.ones(len(program.simplices)))


def test_runs_are_reproducible(linear: Program) -> None:
    first, second = (first_order_bound(linear, iterations=400, tolerance=0.0) for _ in range(2))
    np.testing.assert_array_equal(first.duals, second.duals)
    np.testing.assert_array_equal(first.x, second.x)
    assert first.bound == second.bound
    assert [row[:2] for row in first.history] == [row[:2] for row in second.history]


def test_limits(linear: Program) -> None:
    few = first_order_bound(linear, iterations=100, tolerance=0.0)
    assert (few.status, few.iterations) == ("iterations", 100)
    late = first_order_bound(linear, seconds=0.0, tolerance=0.0)
    assert (late.status, late.iterations) == ("time", 1)
    none = first_order_bound(linear, iterations=0)
    assert (none.status, none.bound, none.iterations) == ("iterations", 0.0, 0)


def test_the_caller_stops_when_enough_columns_are_out(linear: Program) -> None:
    best = first_order_bound(linear, tolerance=1e-6)
    seen: list[Progress] = []

    def enough(progress: Progress) -> bool:
        seen.append(progress)
        return progress.within is not None and progress.within < 0.5 * linear.columns.count

    found = first_order_bound(linear, incumbent=best.bound + 0.5, stop=enough)
    assert found.status == "stopped"
    assert found.iterations < best.iterations
    within = int((found.reduced_costs <= best.bound + 0.5 - found.bound).sum())
    assert seen[-1].within == within < 0.5 * linear.columns.count


@pytest.mark.parametrize("when", [1, 3])
def test_an_interrupt_leaves_the_best_bound(linear: Program, when: int) -> None:
    calls = 0
    last = -np.inf

    def interrupt(progress: Progress) -> None:
        nonlocal calls, last
        calls, last = calls + 1, progress.bound
        if calls == when:
            raise KeyboardInterrupt

    found = first_order_bound(linear, tolerance=0.0, on_progress=interrupt)
    assert found.status == "interrupted"
    assert found.bound == last
    assert found.iterations == 40 * when
    assert found.duals @ linear.lower[: len(found.duals)] == pytest.approx(found.bound)


def test_a_start_near_the_optimum_saves_iterations(linear: Program) -> None:
    first = first_order_bound(linear, tolerance=1e-4)
    again = first_order_bound(linear, tolerance=1e-4, start=(first.x, first.duals))
    assert again.status == "converged"
    assert again.iterations < first.iterations / 2


def test_sifting_brings_in_what_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    """From multipliers that are not good enough, in several rounds."""
    sizes = []

    def counted(program: LinearProgram, **options: Any) -> Any:
        sizes.append(len(program.costs))
        return solve_linear_program(program, **options)

    monkeypatch.setattr("bcut.bounds.sifting.solve_linear_program", counted)
    program = listed("random:18,3,seed=11")
    costs = costs_of("weights", len(program.simplices), 3)
    linear = as_program(program, costs, points=0)
    rough = first_order_bound(linear, iterations=680, tolerance=0.0)
    sifted = sift(linear, rough.duals, rough.x)
    best = optimum(program.matrix(), costs, linear.lower)
    assert rough.bound < best * (1 - 1e-3)
    assert sifted is not None
    assert sifted.value == pytest.approx(best, rel=1e-9)
    assert sifted.x @ costs == pytest.approx(best, rel=1e-9)
    assert linear.columns.reduced(costs, sifted.duals).min() >= -1e-8
    assert sifted.duals[0] == pytest.approx(best, rel=1e-8)
    assert len(sizes) > 1
    assert max(sizes) < 0.7 * len(costs)


def test_sifting_gives_up_when_time_is_over(linear: Program) -> None:
    rough = first_order_bound(linear, iterations=40)
    y = np.zeros(linear.columns.rows)
    y[: len(rough.duals)] = rough.duals
    assert sift(linear, y, rough.x, seconds=0.0) is None

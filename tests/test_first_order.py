"""First-order bounds: never above the optimum, close to it in the end, the same in every run, and never lost."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

import bcut
from bcut.bounds import large_program
from bcut.bounds.columns import Columns
from bcut.bounds.coverage_points import coverage_points, spread_points
from bcut.bounds.first_order import Progress, first_order_bound
from bcut.bounds.large_program import solve_large_program
from bcut.bounds.linear_program import LinearProgram, solve_linear_program
from bcut.bounds.orbit_root import orbit_root
from bcut.bounds.repair import Program, Repair
from bcut.bounds.safe import safe_bound
from bcut.bounds.sifting import sift
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.compact import CompactProgram, compact_program
from bcut.formulations.formulation import Formulation
from bcut.formulations.orbit_cocircuits import orbit_formulation
from bcut.geometry.orbits import simplex_orbits
from bcut.geometry.symmetry import symmetry_group
from bcut.objectives.objective import Objective, make_objective


def listed(name: str, *, spanning: bool = True) -> CompactProgram:
    return compact_program(bcut.load_instance(name), spanning=spanning)


def as_program(program: CompactProgram, costs: np.ndarray, *, points: int | None = 8) -> Program:
    columns = Columns.of_facets(
        program.facet_rows, program.facet_signs, program.coverage, len(program.row_faces)
    )
    sides = np.zeros(columns.rows)
    sides[0] = 1.0
    result = Program(columns, costs, sides, sides.copy(), 1.0)
    return result.with_combinations(coverage_points(program, points=points)) if points != 0 else result


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


# Columns -----------------------------------------------------------------------------------------------------------


def random_matrix(seed: int) -> sp.csr_array:
    """Return a matrix with mostly 1 and -1, some larger entries, and empty rows and columns."""
    generator = np.random.default_rng(seed)
    shape = (int(generator.integers(1, 9)), int(generator.integers(1, 40)))
    dense = generator.choice([0, 0, 0, 1, 1, -1, 3], size=shape).astype(float)
    dense[generator.random(shape) < 0.05] = 0.25
    return sp.csr_array(dense)


@pytest.mark.parametrize("seed", range(20))
def test_columns_are_the_matrix(seed: int) -> None:
    matrix = random_matrix(seed)
    columns = Columns.of_matrix(matrix)
    generator = np.random.default_rng(seed)
    x, y, costs = (generator.normal(size=size) for size in (matrix.shape[1], *matrix.shape))
    np.testing.assert_array_equal(columns.sparse().toarray(), matrix.toarray())
    np.testing.assert_allclose(columns.times(x), matrix @ x, atol=1e-12)
    np.testing.assert_allclose(columns.reduced(costs, y), costs - matrix.T @ y, atol=1e-12)
    some = generator.permutation(matrix.shape[1])[: matrix.shape[1] // 2]
    np.testing.assert_array_equal(columns.restricted_to(some).sparse().toarray(), matrix.toarray()[:, some])
    factors = sp.csr_array(generator.integers(-2, 3, (3, matrix.shape[0])))
    np.testing.assert_array_equal(
        columns.with_combinations(factors).sparse().toarray(),
        np.vstack((matrix.toarray(), factors.toarray() @ matrix.toarray())),
    )


def test_facets_are_laid_out_as_the_formulation_has_them() -> None:
    program = listed("random:12,3,seed=4")
    columns = Columns.of_facets(
        program.facet_rows, program.facet_signs, program.coverage, len(program.row_faces)
    )
    np.testing.assert_array_equal(columns.sparse().toarray(), program.matrix().toarray())


def test_rows_are_scaled_to_mean_entries_of_one() -> None:
    matrix = sp.csr_array(np.array([[1.0, -1, 0, 1], [2, 4, 6, 0], [0, 0, 0, 0]]))
    np.testing.assert_allclose(Columns.of_matrix(matrix).row_scale(), [1, 1 / 4, 1])


# Coverage points ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name",
    ["random:14,2,seed=1", "random:12,3,seed=2", "random:10,4,seed=3", "sphere:14,3,seed=5", "grid:4,4"],
)
def test_coverage_points_mark_simplices_that_contain_a_point(
    monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    configuration = bcut.load_instance(name)
    formulation = cocircuit_formulation(configuration, spanning=True)
    drawn: list[np.ndarray] = []

    def drawing(*arguments: Any) -> np.ndarray:
        drawn.append(spread_points(*arguments))
        return drawn[-1]

    monkeypatch.setattr("bcut.bounds.coverage_points.spread_points", drawing)
    rows = (coverage_points(formulation, points=12) @ formulation.matrix.astype(np.int64)).toarray()
    (targets,) = drawn
    corners = configuration.floats[formulation.simplices]
    inverse = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
    for row, target in zip(rows, targets, strict=True):
        weights = np.einsum("tij,tj->ti", inverse, target - corners[:, 0])
        inside = (weights > 0).all(axis=1) & (weights.sum(axis=1) < 1)
        np.testing.assert_array_equal(row, inside)
    assert len(np.unique(rows, axis=0)) > 6


@pytest.mark.parametrize("exponent", [-330, 330])
def test_coverage_points_do_not_depend_on_the_size_of_coordinates(exponent: int) -> None:
    """Volumes of four dimensions would be beyond the range of doubles there."""
    configuration = bcut.load_instance("random:10,4,seed=3")
    scaled = bcut.PointConfiguration.from_values(np.ldexp(configuration.floats, exponent))
    plain, far = (
        coverage_points(cocircuit_formulation(points, spanning=True)).toarray()
        for points in (configuration, scaled)
    )
    np.testing.assert_array_equal(plain, far)


def solution_of(formulation: Formulation) -> np.ndarray:
    """Return a point of the relaxation."""
    return linprog(
        np.ones(len(formulation.simplices)), A_eq=formulation.matrix, b_eq=formulation.lower, method="highs"
    ).x


def test_coverage_points_of_arrays_are_those_of_the_formulation() -> None:
    configuration = bcut.load_instance("random:14,3,seed=6")
    program = compact_program(configuration, spanning=True)
    ordinary = cocircuit_formulation(configuration, spanning=True)
    first, second = coverage_points(program, points=5), coverage_points(ordinary, points=5)
    np.testing.assert_array_equal(first.toarray(), second.toarray())


def test_the_number_of_points_follows_the_columns() -> None:
    """The further rows lengthen the columns by less than one entry on the average."""
    few, many = listed("random:16,3,seed=1"), listed("random:160,2,seed=1")
    assert coverage_points(few).shape[0] < coverage_points(many).shape[0]
    for program in (few, many):
        further = coverage_points(program) @ program.matrix().astype(np.int32)
        assert 0.2 < further.nnz / len(program.simplices) < 0.8


def test_multipliers_of_combinations_become_those_of_rows() -> None:
    program = listed("random:12,2,seed=8")
    costs = np.ones(len(program.simplices))
    plain, further = as_program(program, costs, points=0), as_program(program, costs, points=7)
    y = np.random.default_rng(0).normal(size=further.columns.rows)
    np.testing.assert_allclose(
        plain.columns.reduced(costs, further.without_combinations(y)),
        further.columns.reduced(costs, y),
        atol=1e-9,
    )
    assert Repair(plain).value(further.without_combinations(y)) == pytest.approx(Repair(further).value(y))


def test_only_equations_are_combined() -> None:
    columns = Columns.of_matrix(sp.csr_array(np.ones((2, 3))))
    program = Program(columns, np.ones(3), np.array([1.0, -np.inf]), np.array([1.0, 2.0]))
    with pytest.raises(ValueError, match="equations"):
        program.with_combinations(sp.csr_array(np.ones((1, 2))))


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


# Sifting and large programs ----------------------------------------------------------------------------------------


def orbit_program(name: str, sense: str) -> tuple[Any, Objective]:
    configuration = bcut.load_instance(name)
    formulation = orbit_formulation(simplex_orbits(configuration, symmetry_group(configuration)))
    return formulation, make_objective("cardinality", formulation, sense=sense)


@pytest.mark.parametrize("method", ["simplex", "interior"])
@pytest.mark.parametrize(
    ("name", "sense", "lp"),
    [
        ("cube:4", "min", 16),
        ("cube:4", "max", 24),
        ("cube:5", "min", 67),
        ("cube:5", "max", 120),
        ("dodecahedron", "min", Fraction(45, 2)),
        ("24-cell", "min", None),
        ("hypersimplex:5,2", "max", 11),
    ],
)
def test_orbit_programs_by_the_large_way(
    monkeypatch: pytest.MonkeyPatch, name: str, sense: str, lp: Fraction | int | None, method: Any
) -> None:
    formulation, objective = orbit_program(name, sense)
    direct = orbit_root(formulation, objective, method=method)
    monkeypatch.setattr("bcut.bounds.orbit_root.LARGE", 1)
    large = orbit_root(formulation, objective, method=method)
    assert large.status == "optimal"
    assert large.lp == pytest.approx(direct.lp, abs=1e-7)
    assert lp is None or large.lp == pytest.approx(float(lp), abs=1e-7)
    assert large.bound is not None
    assert large.lp is not None
    assert large.point is not None
    assert abs(float(large.bound.value) - objective.sign * large.lp) < 1e-6
    np.testing.assert_allclose(formulation.matrix @ large.point, 0.0, atol=1e-6)


@pytest.mark.parametrize(("name", "lp", "orbits"), [("cube:4", 16, None), ("cube:5", 67, 14)])
def test_the_middle_of_the_optimal_multipliers_fixes_the_most(
    monkeypatch: pytest.MonkeyPatch, name: str, lp: int, orbits: int | None
) -> None:
    formulation, objective = orbit_program(name, "min")
    direct = orbit_root(formulation, objective, method="interior")
    monkeypatch.setattr("bcut.bounds.orbit_root.LARGE", 1)
    vertex, middle = (orbit_root(formulation, objective, method=m) for m in ("simplex", "interior"))
    left = [len(root.bound.orbits_within(Fraction(lp))) for root in (direct, middle, vertex) if root.bound]
    assert left[1] <= left[0]
    assert left[1] <= left[2]
    assert orbits is None or left[1] == orbits


def test_a_limit_of_time_leaves_a_proven_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    formulation, objective = orbit_program("cube:5", "min")
    monkeypatch.setattr("bcut.bounds.orbit_root.LARGE", 1)
    root = orbit_root(formulation, objective, seconds=0.0)
    assert root.status == "limit"
    assert root.bound is not None
    assert 0 <= root.bound.value <= 67


def test_large_programs_without_a_point() -> None:
    """One orbit of simplices alone covers the cube, or it does not."""
    formulation, objective = orbit_program("cube:3", "min")
    matrix = sp.vstack((formulation.volumes[None] / 6, formulation.matrix)).tocsc()
    lower = np.zeros(matrix.shape[0])
    lower[0] = 1.0
    seen = set()
    for alone in range(matrix.shape[1]):
        part = matrix[:, [alone]].tocsr()
        program = LinearProgram(objective.costs[[alone]], part, lower, lower)
        status = solve_large_program(program).status
        assert status == solve_linear_program(program).status
        seen.add(status)
    assert seen == {"optimal", "infeasible"}


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


def test_an_interrupt_ends_a_large_program(monkeypatch: pytest.MonkeyPatch) -> None:
    formulation, objective = orbit_program("cube:4", "min")
    monkeypatch.setattr("bcut.bounds.orbit_root.LARGE", 1)

    def interrupted(*arguments: Any, **options: Any) -> Any:
        def tell(progress: Progress) -> None:
            raise KeyboardInterrupt

        return first_order_bound(*arguments, **options, on_progress=tell)

    monkeypatch.setattr(large_program, "first_order_bound", interrupted)
    with pytest.raises(KeyboardInterrupt):
        orbit_root(formulation, objective)

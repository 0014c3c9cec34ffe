"""Any multipliers whatsoever give a bound, in exact arithmetic, at any magnitude."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from bcut.bounds.relaxation import Relaxation
from bcut.bounds.safe import UNBOUNDED, safe_bound
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.objectives.objective import Objective, from_fractions, make_objective

FORMULATION = cocircuit_formulation(load_instance("polygon:5,center"))
SOLUTIONS = [list(columns) for columns in triangulations(FORMULATION.chirotope)]
ROWS, COLUMNS = FORMULATION.size[1], FORMULATION.size[0]

MAGNITUDES = [Fraction(1), Fraction(10) ** -30, Fraction(10) ** -9, Fraction(10) ** 9, Fraction(10) ** 30]
MAGNITUDES += [Fraction(2) ** 40, Fraction(2) ** 62, Fraction(10) ** 290, Fraction(10) ** -290]


def bound_of(objective: Objective, duals: Any) -> Any:
    return safe_bound(FORMULATION.matrix, FORMULATION.lower, FORMULATION.upper, objective, np.asarray(duals))


def optimum(objective: Objective) -> Fraction:
    """The least value of ``sign * objective``."""
    return min(objective.sign * objective.value(columns) for columns in SOLUTIONS)


def exact_bound(objective: Objective, multipliers: list[Fraction]) -> Fraction:
    """The formula, in rationals."""
    matrix = FORMULATION.matrix.toarray().astype(int).tolist()
    total = sum((y * int(b) for y, b in zip(multipliers, FORMULATION.lower, strict=True)), Fraction(0))
    for j in range(COLUMNS):
        cost = objective.sign * objective.value([j])
        total += min(Fraction(0), cost - sum(y * row[j] for y, row in zip(multipliers, matrix, strict=True)))
    return total


costs_lists = st.lists(st.integers(-50, 50), min_size=COLUMNS, max_size=COLUMNS)
duals_lists = st.lists(
    st.floats(-100, 100, allow_nan=False, allow_subnormal=False), min_size=ROWS, max_size=ROWS
)


@pytest.mark.parametrize("magnitude", MAGNITUDES, ids=lambda m: f"{float(m):.0e}")
@pytest.mark.parametrize("dual_magnitude", [1e-300, 1.0, 1e200])
@pytest.mark.parametrize("sense", ["min", "max"])
def test_random_multipliers_give_a_bound(sense: Any, magnitude: Fraction, dual_magnitude: float) -> None:
    @settings(max_examples=6, deadline=None)
    @given(costs_lists, duals_lists)
    def check(costs: list[int], duals: list[float]) -> None:
        objective = from_fractions("x", sense, [cost * magnitude for cost in costs])
        found = bound_of(objective, np.array(duals) * dual_magnitude)
        assert found.value <= optimum(objective)
        multipliers = [int(y) * found.unit for y in found.multipliers]
        # Costs are rounded down to multiples of the unit, so the bound may be that much below the formula.
        exact = exact_bound(objective, multipliers)
        assert exact - COLUMNS * found.unit <= found.value <= exact
        if objective.denominator == 1 and found.shift >= 0:
            assert found.value == exact

    check()


@settings(max_examples=60, deadline=None)
@given(costs_lists, st.sampled_from(["min", "max"]), st.sampled_from(MAGNITUDES))
def test_the_duals_of_the_relaxation_give_nearly_its_value(
    costs: list[int], sense: Any, magnitude: Fraction
) -> None:
    objective = from_fractions("x", sense, [Fraction(cost) for cost in costs])
    relaxation = Relaxation(FORMULATION, objective)
    point = relaxation.solve()
    assert point is not None
    scaled = from_fractions("x", sense, [cost * magnitude for cost in costs])
    found = bound_of(scaled, point.duals * float(magnitude))
    value = objective.sign * Fraction(point.value) * magnitude
    assert value - Fraction(1, 10**5) * magnitude <= found.value <= optimum(scaled)


@settings(max_examples=60, deadline=None)
@given(costs_lists, duals_lists, st.integers(-40, 40), st.sampled_from(["min", "max"]))
def test_reduced_cost_fixing_keeps_every_solution_within_the_target(
    costs: list[int], duals: list[float], slack: int, sense: Any
) -> None:
    objective = from_fractions("x", sense, [Fraction(cost, 3) for cost in costs])
    found = bound_of(objective, duals)
    target = optimum(objective) + Fraction(slack, 4)
    kept = set(found.columns_within(target).tolist())
    for columns in SOLUTIONS:
        if objective.sign * objective.value(columns) <= target:
            assert kept.issuperset(columns)
    restricted = found.restricted_to(np.array(sorted(kept), dtype=np.int64))
    assert len(restricted.columns_within(target)) == len(kept)


@pytest.mark.parametrize("target", [Fraction(-(10**400)), Fraction(10**400)])
def test_targets_beyond_64_bits(target: Fraction) -> None:
    found = bound_of(make_objective("cardinality", FORMULATION), np.zeros(ROWS))
    assert len(found.columns_within(target)) == (COLUMNS if target > 0 else 0)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_multipliers_that_are_no_numbers_count_as_zero(bad: float) -> None:
    objective = make_objective("cardinality", FORMULATION)
    duals = np.zeros(ROWS)
    duals[0] = 1.0
    expected = bound_of(objective, duals)
    duals[1:] = bad
    found = bound_of(objective, duals)
    assert found.value == expected.value
    assert not found.multipliers[1:].any()


def test_costs_and_multipliers_of_zero() -> None:
    objective = from_fractions("x", "min", [Fraction(0)] * COLUMNS)
    assert bound_of(objective, np.zeros(ROWS)).value == 0


@pytest.mark.parametrize(("dual", "value"), [(-1.0, -1), (1.0, -2)])
def test_an_upper_side_takes_negative_multipliers_only(dual: float, value: int) -> None:
    # min -x0 - x1 over x0 + x1 <= 1; the box alone proves -2.
    objective = from_fractions("x", "min", [Fraction(-1)] * 2)
    row = sp.csr_matrix(np.array([[1, 1]]))
    found = safe_bound(row, np.array([-UNBOUNDED]), np.array([1]), objective, np.array([dual]))
    assert found.value == value
    assert (found.multipliers[0] == 0) == (dual > 0)


@pytest.mark.parametrize(("dual", "value"), [(1.0, 1), (-1.0, 0)])
def test_a_lower_side_takes_positive_multipliers_only(dual: float, value: int) -> None:
    # min x0 + x1 over x0 + x1 >= 1; the box alone proves 0.
    objective = from_fractions("x", "min", [Fraction(1)] * 2)
    row = sp.csr_matrix(np.array([[1, 1]]))
    found = safe_bound(row, np.array([1]), np.array([UNBOUNDED]), objective, np.array([dual]))
    assert found.value == value
    assert (found.multipliers[0] == 0) == (dual < 0)


def test_sums_over_many_columns_do_not_overflow() -> None:
    columns = 200_000
    costs = np.full(columns, -(2**40), dtype=np.int64)
    objective = Objective("x", "min", costs)
    row = sp.csr_matrix(np.ones((1, columns), dtype=np.int8))
    found = safe_bound(row, np.array([1]), np.array([1]), objective, np.array([1e12]))
    exact = 10**12 + columns * (-(2**40) - 10**12)
    assert found.value == exact

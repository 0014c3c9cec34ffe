"""Exact bounds from inexact dual multipliers.

For ``min c x`` over ``lower <= A x <= upper``, 0 <= x <= 1, *any* multipliers y give the bound

    sum_i (y_i lower_i if y_i > 0 else y_i upper_i) + sum_j min(0, c_j - y A_j),

so the duals of a floating-point solver, rounded to dyadic rationals, prove a bound in integer arithmetic,
whatever tolerances the solver worked with.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil, floor, frexp
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bcut.formulations.formulation import UNBOUNDED
from bcut.objectives.objective import Objective

if TYPE_CHECKING:
    import scipy.sparse as sp

# Multipliers of ordinary size are rounded to multiples of 2**-SHIFT where that keeps all sums within 64 bits.
SHIFT = 45


@dataclass(frozen=True, eq=False)
class SafeBound:
    """A bound on ``sign * objective``, proven in integer arithmetic.

    Attributes
    ----------
    value : Fraction
        No feasible 0/1 point has ``sign * objective`` below it.
    multipliers : ndarray of int64, shape (rows,)
        Times ``2**-shift``.
    reduced_costs : ndarray of int64, shape (m,)
        Times ``2**-shift``, rounded towards minus infinity where costs had to be: x_j = 1 costs at least this
        much above `value` (or nothing, where negative).
    shift : int
        Negative where costs or multipliers are huge.
    """

    value: Fraction
    multipliers: NDArray[np.int64]
    reduced_costs: NDArray[np.int64]
    shift: int

    @property
    def unit(self) -> Fraction:
        """What the integers count: ``2**-shift``."""
        return unit_of(self.shift)

    def restricted_to(self, columns: NDArray[np.integer]) -> SafeBound:
        """Return the same bound with the reduced costs of some columns only."""
        return replace(self, reduced_costs=self.reduced_costs[columns])

    def columns_within(self, target: Fraction) -> NDArray[np.intp]:
        """List the columns that a solution with ``sign * objective <= target`` may use (reduced-cost fixing)."""
        slack = floor((target - self.value) / self.unit)
        # Reduced costs are below 2**62 in size.
        return np.flatnonzero(self.reduced_costs <= max(-(2**62), min(slack, 2**62)))


def safe_bound(
    matrix: sp.csr_matrix,
    lower: NDArray[np.int64],
    upper: NDArray[np.int64],
    objective: Objective,
    duals: NDArray[np.floating],
    row_shifts: NDArray[np.int64] | None = None,
) -> SafeBound:
    """Turn floating-point duals into an exact bound.

    Parameters
    ----------
    matrix : sparse matrix of integers, shape (rows, m)
        Rows of a formulation, then cuts.
    lower, upper : ndarray of int64, shape (rows,)
        Sides of the rows; `UNBOUNDED` below or above for rows with one side, such as cuts.
    objective : Objective
    duals : ndarray of float, shape (rows,)
        Any numbers; good ones give good bounds. For the minimisation of ``sign * objective``.
    row_shifts : ndarray of int64, shape (rows,), optional
        Multipliers belong to the rows divided by two to these powers, whose entries are about 1 in size.

    Returns
    -------
    SafeBound
    """
    duals = np.where(np.isfinite(duals), duals, 0.0)
    if row_shifts is not None and row_shifts.any():
        return _safe_bound_with_large_rows(matrix, lower, upper, objective, duals, row_shifts)
    shift = _shift(matrix, objective, duals)
    costs = scaled_costs(objective, shift)
    multipliers = _multipliers(duals, shift, lower, upper)
    reduced = costs - matrix.T.astype(np.int64) @ multipliers
    sides = np.where(multipliers > 0, lower, upper)
    active = multipliers != 0
    scaled = sum(int(y) * int(b) for y, b in zip(multipliers[active], sides[active], strict=True) if b)
    scaled += int(np.minimum(reduced, 0).sum())
    return SafeBound(scaled * unit_of(shift), multipliers, reduced, shift)


def _multipliers(
    duals: NDArray[np.floating], shift: int, lower: NDArray[np.int64], upper: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Round duals to multiples of ``2**-shift`` that their rows allow."""
    multipliers = np.rint(np.ldexp(duals, shift)).astype(np.int64)
    # A row without a lower side cannot be pushed up, one without an upper side cannot be pushed down.
    multipliers[(multipliers > 0) & (lower == -UNBOUNDED)] = 0
    multipliers[(multipliers < 0) & (upper == UNBOUNDED)] = 0
    return multipliers


def _safe_bound_with_large_rows(
    matrix: sp.csr_matrix,
    lower: NDArray[np.int64],
    upper: NDArray[np.int64],
    objective: Objective,
    duals: NDArray[np.floating],
    row_shifts: NDArray[np.int64],
) -> SafeBound:
    """Treat the few rows with large entries one by one, in integers of any size.

    A product with such a row, divided by its power of two, is rounded so that reduced costs and the bound only become
    smaller.
    """
    large = np.flatnonzero(row_shifts)
    shown = matrix.astype(float)
    shown.data = np.ldexp(np.abs(shown.data), -np.repeat(row_shifts, np.diff(matrix.indptr)))
    shift = _shift(shown, objective, duals)
    multipliers = _multipliers(duals, shift, lower, upper)
    small = np.where(row_shifts > 0, 0, multipliers)
    reduced = scaled_costs(objective, shift) - matrix.T.astype(np.int64) @ small
    sides = np.where(multipliers > 0, lower, upper)
    scaled = sum(int(y) * int(b) for y, b in zip(small, sides, strict=True) if y)
    for row in large.tolist():
        y, bits = int(multipliers[row]), int(row_shifts[row])
        if y:
            part = slice(matrix.indptr[row], matrix.indptr[row + 1])
            products = [-(-(y * int(entry)) >> bits) for entry in matrix.data[part]]
            reduced[matrix.indices[part]] -= np.array(products, dtype=np.int64)
            scaled += y * int(sides[row]) >> bits
    scaled += int(np.minimum(reduced, 0).sum())
    return SafeBound(scaled * unit_of(shift), multipliers, reduced, shift)


def unit_of(shift: int) -> Fraction:
    """Return ``2**-shift``."""
    return Fraction(1, 1 << shift) if shift >= 0 else Fraction(1 << -shift)


def scaled_costs(objective: Objective, shift: int) -> NDArray[np.int64]:
    """Return ``floor(sign * cost * 2**shift)``, exactly."""
    if objective.are_doubles:
        signed = objective.sign * objective.numerators
        # Scaling by a power of two is exact, except that it may lose what is far below 1.
        scaled = np.floor(np.ldexp(signed, shift))
        return np.where((scaled == 0) & (signed < 0), -1.0, scaled).astype(np.int64)
    if shift >= 0 and objective.fits_64_bits and objective.denominator == 1:
        return objective.sign * (objective.numerators.astype(np.int64) << shift)
    numerator, denominator = objective.sign << max(0, shift), objective.denominator << max(0, -shift)
    return np.array([int(v) * numerator // denominator for v in objective.numerators], dtype=np.int64)


def _shift(matrix: sp.csr_matrix, objective: Objective, duals: NDArray[np.floating]) -> int:
    """Return the largest shift for which every sum stays below 2**62, but no more than numbers of this size need."""
    columns = max(1, matrix.shape[1])
    entries = ceil(abs(matrix).sum(axis=0).max()) if matrix.nnz else 0
    largest_cost = float(np.abs(objective.costs).max(initial=0.0))
    largest_dual = float(np.abs(duals).max(initial=0.0))
    if largest_cost == largest_dual == 0.0:
        return SHIFT
    # Exponents of two, rounded up, so that nothing overflows on the way.
    size = max(exponent_of(largest_cost), exponent_of(largest_dual) + entries.bit_length()) + 1
    return min(SHIFT - min(0, size), 61 - columns.bit_length() - size)


def exponent_of(value: float) -> int:
    """Return the least k with ``value < 2**k``."""
    return frexp(value)[1] if value else -1074

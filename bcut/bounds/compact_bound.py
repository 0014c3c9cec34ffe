"""Exact bounds for a program that exists as flat arrays only: no Python object is made for any column.

Two arguments turn multipliers y with reduced costs r into a bound on every triangulation:

- Each simplex is used at most once, so ``y_0 + sum_j min(0, r_j)``. Where all costs are positive, y is shrunk
  first until no reduced cost is negative, which is cheap when y is nearly feasible (y = 0 is strictly so).
- A triangulation has at most N simplices, so ``y_0 + N min(0, min_j r_j)``: better where many reduced costs are
  slightly negative and costs are not positive. Reduced-cost fixing then compares with ``r_j - min_k r_k``.

Only the coverage row is inhomogeneous; its right-hand side is 1, and y_0 is its multiplier.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.relaxation import Relaxation, RelaxationPoint
from bcut.bounds.safe import SHIFT, SafeBound, exponent_of, scaled_costs, unit_of
from bcut.formulations.compact import CompactProgram
from bcut.objectives.objective import Objective

# Multipliers are shrunk by this much more than floating-point numbers say.
_MARGIN = 2.0**-36
# Columns that are worked on at once: temporary arrays stay small beside the program.
_PIECE = 1 << 20


@dataclass(frozen=True, eq=False)
class CompactBound:
    """A proven bound on all columns.

    Attributes
    ----------
    bound : SafeBound
        Its reduced costs serve for fixing.
    plain : bool
        Whether the first of the two arguments proves it, which certificates know.
    """

    bound: SafeBound
    plain: bool


def most_simplices(n: int, dimension: int) -> int:
    """Return an upper bound on the number of simplices of a triangulation of n points.

    Coning its boundary makes it a sphere of dimension d with n + 1 vertices, which has at most as many facets as the
    cyclic polytope of dimension d + 1 with these (Stanley, 1975).
    """
    size, vertices = dimension + 1, n + 1
    half = size // 2
    if size % 2 == 0:
        return vertices * comb(vertices - half, half) // (vertices - half)
    return 2 * comb(vertices - half - 1, half)


def compact_bound(
    program: CompactProgram, objective: Objective, duals: NDArray[np.float64], *, repair: bool = True
) -> CompactBound:
    """Turn floating-point multipliers into an exact bound.

    Parameters
    ----------
    program : CompactProgram
    objective : Objective
        On all its columns.
    duals : ndarray of float, shape (r + 1,)
        Of the coverage row, then of the cocircuit rows, for the minimisation of ``sign * costs``. Any numbers.
    repair : bool
        Shrink the multipliers where all costs are positive.
    """
    duals = np.where(np.isfinite(duals), duals, 0.0)
    if repair:
        duals = duals * _share_to_keep(program, objective, duals)
    shift = _shift(program, objective, duals)
    multipliers = np.rint(np.ldexp(duals, shift)).astype(np.int64)
    reduced = scaled_costs(objective, shift)
    subtract_products(program, multipliers, reduced)
    least = min(0, int(reduced.min(initial=0)))
    plain = int(np.minimum(reduced, 0).sum())
    counted = most_simplices(program.configuration.n, program.configuration.dimension) * least
    start = int(multipliers[0])
    if counted > plain:
        reduced -= least
        value = (start + counted) * unit_of(shift)
        return CompactBound(SafeBound(value, multipliers, reduced, shift), False)
    return CompactBound(SafeBound((start + plain) * unit_of(shift), multipliers, reduced, shift), True)


def subtract_products(program: CompactProgram, multipliers: NDArray[Any], reduced: NDArray[Any]) -> None:
    """Subtract the products of multipliers with all columns, in place.

    Parameters
    ----------
    program : CompactProgram
    multipliers : ndarray of int64 or float64, shape (r + 1,)
    reduced : ndarray of the same type, shape (m,)
    """
    behind = multipliers[1:] if len(multipliers) > 1 else np.zeros(1, dtype=multipliers.dtype)
    for start in range(0, len(reduced), _PIECE):
        part = slice(start, start + _PIECE)
        rows, signs = program.facet_rows[part], program.facet_signs[part]
        total = reduced[part]
        total -= np.where(program.coverage[part], multipliers[0], 0)
        for position in range(rows.shape[1]):
            # Facets without a row have -1 there, which reads the last multiplier, and the sign 0.
            total -= behind[rows[:, position]] * signs[:, position]


def _share_to_keep(program: CompactProgram, objective: Objective, duals: NDArray[np.float64]) -> float:
    """Return what multipliers are to be multiplied with so that no reduced cost is negative; 1 if nothing does it."""
    costs = objective.sign * objective.costs
    if not len(costs) or costs.min() <= 0:
        return 1.0
    reduced = costs.copy()
    subtract_products(program, duals, reduced)
    worst = float(np.max(-reduced / costs, initial=0.0))
    return 1.0 / (1.0 + worst + _MARGIN)


def _shift(program: CompactProgram, objective: Objective, duals: NDArray[np.float64]) -> int:
    """Return a shift for which no sum reaches 2**62, as in `bcut.bounds.safe`."""
    width = program.facet_rows.shape[1] + 1
    largest_cost = float(np.abs(objective.costs).max(initial=0.0))
    largest_dual = float(np.abs(duals).max(initial=0.0))
    if largest_cost == largest_dual == 0.0:
        return SHIFT
    size = max(exponent_of(largest_cost), exponent_of(largest_dual) + width.bit_length()) + 1
    return min(SHIFT - min(0, size), 61 - len(program.simplices).bit_length() - size)


@dataclass(frozen=True, eq=False)
class Residual:
    """The relaxation on some columns of a compact program, in HiGHS.

    Attributes
    ----------
    columns : ndarray of int, shape (k,)
        Ascending.
    rows : ndarray of int, shape (s,)
        The cocircuit rows that they meet, ascending.
    relaxation : Relaxation
    """

    columns: NDArray[np.int64]
    rows: NDArray[np.int64]
    relaxation: Relaxation

    @classmethod
    def of(
        cls,
        program: CompactProgram,
        objective: Objective,
        columns: NDArray[np.int64],
        deadline: float | None = None,
    ) -> Residual:
        """Load the relaxation.

        Parameters
        ----------
        program : CompactProgram
        objective : Objective
            On all its columns.
        columns : ndarray of int
            Ascending.
        deadline : float, optional
            Value of `time.monotonic`.
        """
        met = np.unique(program.facet_rows[columns])
        relaxation = Relaxation(
            program.formulation(columns), objective.restricted_to(columns), deadline=deadline
        )
        return cls(columns, met[met >= 0].astype(np.int64), relaxation)

    def extended(self, point: RelaxationPoint, duals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the multipliers of a solved relaxation for its own rows, and others for the rest.

        Parameters
        ----------
        point : RelaxationPoint
        duals : ndarray of float, shape (r + 1,)
            Of all rows.
        """
        result = duals.copy()
        result[0] = point.duals[0]
        result[1 + self.rows] = point.duals[1 : len(self.rows) + 1]
        return result


def within(bounds: list[CompactBound], target: Fraction, allowed: NDArray[np.bool_]) -> NDArray[np.int64]:
    """List the columns that no bound excludes from a solution with ``sign * objective <= target``."""
    alive = allowed.copy()
    for found in bounds:
        kept = np.zeros(len(alive), dtype=bool)
        kept[found.bound.columns_within(target)] = True
        alive &= kept
    return np.flatnonzero(alive)


def restricted_program(program: CompactProgram, columns: NDArray[np.integer]) -> CompactProgram:
    """Return the program on some columns, ascending; rows stay."""
    return replace(
        program,
        simplices=program.simplices[columns],
        facet_rows=program.facet_rows[columns],
        facet_signs=program.facet_signs[columns],
        coverage=program.coverage[columns],
    )

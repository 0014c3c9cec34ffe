"""Bounds from multipliers that are not quite right, in floating-point arithmetic.

A bound needs multipliers with reduced costs that are not negative. Multipliers y with such reduced costs r only
nearly become ``(1 - t) y + t a``, t as small as possible, for an `anchor` a whose reduced costs are all positive:
with positive costs that is a = 0, and the repaired multipliers are y divided by ``1 + max(-r_j / c_j)``.
`bcut.bounds.safe` and `bcut.bounds.orbit_root` prove what the repaired multipliers are worth.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.columns import Columns

if TYPE_CHECKING:
    import scipy.sparse as sp

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Program:
    """Minimise ``costs @ x`` over ``lower <= A x <= upper`` and x >= 0.

    Attributes
    ----------
    columns : Columns
        A. Rows ``columns.rows - combinations.shape[0]`` onwards are `combinations` of those before.
    costs : ndarray of float, shape (m,)
    lower, upper : ndarray of float, shape (rows,)
        Infinite where a row has no such side.
    column_upper : float or ndarray of float, shape (m,)
        Upper bounds on x that the rows imply; infinite if unknown. They serve to turn multipliers into bounds
        where costs are not positive, and to nothing else.
    combinations : sparse matrix, or None
    """

    columns: Columns
    costs: Floats
    lower: Floats
    upper: Floats
    column_upper: float | Floats = inf
    combinations: sp.sparray | None = None

    @property
    def largest_side(self) -> float:
        """The largest side of a row in size; 1 if all are zero."""
        sides = np.abs(np.concatenate((self.lower, self.upper)))
        return float(sides[np.isfinite(sides)].max(initial=0.0)) or 1.0

    def with_combinations(self, combinations: sp.sparray) -> Program:
        """Append combinations of rows that are equations; the first that this is done to has none.

        Parameters
        ----------
        combinations : sparse matrix, shape (k, rows)
        """
        used = np.zeros(self.columns.rows, dtype=bool)
        used[combinations.tocsr().indices] = True
        if np.any(self.lower[used] != self.upper[used]):
            raise ValueError("only equations can be combined")
        sides = combinations @ np.where(self.lower == self.upper, self.lower, 0.0)
        return Program(
            self.columns.with_combinations(combinations),
            self.costs,
            np.concatenate((self.lower, sides)),
            np.concatenate((self.upper, sides)),
            self.column_upper,
            combinations,
        )

    def without_combinations(self, y: Floats) -> Floats:
        """Return the multipliers of the rows themselves."""
        if self.combinations is None:
            return y
        rows = self.combinations.shape[1]
        own: Floats = y[:rows] + self.combinations.T @ y[rows:]
        return own


class Repair:
    """Turns multipliers into bounds.

    Parameters
    ----------
    program : Program
    anchor : ndarray of float, shape (rows,), optional
        Multipliers with positive reduced costs; zeros will do where all costs are positive. If there is none, negative
        reduced costs are paid for with the upper bounds of their columns.
    """

    def __init__(self, program: Program, anchor: Floats | None = None) -> None:
        self.program = program
        self.anchor = np.zeros(program.columns.rows)
        self.slack = program.costs
        if anchor is not None:
            self.anchor[: len(anchor)] = anchor
            self.slack = program.columns.reduced(program.costs, self.anchor)
        self.scales = bool(self.slack.min(initial=inf) > 0)

    def value(self, y: Floats) -> float:
        """Return what the sides of the rows are worth."""
        program = self.program
        sides = np.where(y > 0, program.lower, program.upper)
        active = y != 0
        return float((y[active] * sides[active]).sum())

    def share(self, reduced: Floats) -> float:
        """Return how much of the anchor is needed until no reduced cost is negative."""
        worst = float(np.max(-reduced / self.slack, initial=0.0))
        # A little more, for the sake of rounding.
        return worst * (1 + 1e-9) / (1 + worst) if worst > 0 else 0.0

    def repaired(self, y: Floats, reduced: Floats | None = None) -> tuple[float, Floats]:
        """Return a bound and the multipliers that prove it.

        Parameters
        ----------
        y : ndarray of float, shape (rows,)
            Of signs that the rows allow.
        reduced : ndarray of float, shape (m,), optional
            Its reduced costs, where they are known.
        """
        if reduced is None:
            reduced = self.program.columns.reduced(self.program.costs, y)
        candidates = [(self.value(y) + self._loss(reduced), y.copy())]
        if self.scales:
            share = self.share(reduced)
            mixed = (1 - share) * y + share * self.anchor
            candidates.append((self.value(mixed), mixed))
        return max(candidates, key=lambda pair: pair[0])

    def _loss(self, reduced: Floats) -> float:
        if np.all(np.isinf(self.program.column_upper)) and reduced.min(initial=0.0) < 0:
            return -inf
        return float((np.minimum(reduced, 0.0) * np.minimum(self.program.column_upper, 1e300)).sum())

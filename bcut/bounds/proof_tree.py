"""Branch and bound that ends with a proof: a tree whose leaves carry exact multipliers of rows.

Each leaf fixes some columns to 0 and some to 1, which sets those that cross them to 0. With multipliers y of the rows,

    costs @ x  >=  y @ right + sum over columns at 1 of (c - y A) + sum over free columns of min(0, c - y A)

holds for every x of the leaf; it is computed again in rational arithmetic, from duals that are rounded to rationals.
Where rounding leaves a bound short, branching goes on: once everything is fixed the bound is exact. For small programs,
which regions of space lead to.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.linear_program import LinearProgram, solve_linear_program

if TYPE_CHECKING:
    import scipy.sparse as sp

_INTEGRAL = 1e-6
# What counts as zero, or as rounding alone, relative to the largest number of its kind.
_CLOSE = 1e-7


@dataclass(frozen=True)
class Leaf:
    """A part of the tree that multipliers settle: pairs of a row and what it is multiplied with."""

    multipliers: tuple[tuple[int, Fraction], ...]


@dataclass(frozen=True)
class Branch:
    """A column that is 1 in one half of what is left, and 0 in the other."""

    column: int
    chosen: ProofTree
    excluded: ProofTree


ProofTree = Leaf | Branch


class OutOfTimeError(Exception):
    """The deadline came before the proof."""


@dataclass(eq=False)
class ExactProgram:
    """Minimise ``costs @ x`` over 0/1 points x of some rows of which no two columns cross.

    Attributes
    ----------
    matrix : scipy.sparse.csr_matrix of int64, shape (rows, m)
    right : ndarray of int64, shape (rows,)
    equations : bool
        Whether rows hold with equality; otherwise ``<=``, and with ones as entries.
    crossing : ndarray of bool, shape (m, m)
        Pairs of which at most one is chosen. The rows must imply this at 0/1 points.
    costs : sequence of int
    """

    matrix: sp.csr_matrix
    right: NDArray[np.int64]
    equations: bool
    crossing: NDArray[np.bool_]
    costs: Sequence[int]
    nodes: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        self._columns = self.matrix.tocsc()
        self._scale = float(max([abs(cost) for cost in self.costs], default=1)) or 1.0

    @property
    def width(self) -> int:
        """Number of columns."""
        return int(self.matrix.shape[1])


def least(
    program: ExactProgram,
    *,
    best: list[int] | None = None,
    offer: Callable[[list[int]], None] | None = None,
    deadline: float | None = None,
) -> tuple[list[int] | None, ProofTree]:
    """Find a 0/1 point of least cost, and prove that there is no better one.

    Parameters
    ----------
    program : ExactProgram
    best : list of int, optional
        Columns of a 0/1 point that is known.
    offer : callable, optional
        Told of every better point at once.
    deadline : float, optional
        Value of `time.monotonic`.

    Returns
    -------
    list of int or None
        The columns that are 1; None where there is no 0/1 point.
    ProofTree
        Every leaf's bound exceeds ``value - 1`` (costs are integers), or, without a point, 0 with all costs being 0.

    Raises
    ------
    OutOfTimeError
    """
    while True:
        search = _Search(program, best, deadline)
        try:
            return best, search.tree(np.zeros(program.width, dtype=np.int8))
        except _Better as found:
            best = found.columns
            if offer is not None:
                offer(best)


class _Better(Exception):  # noqa: N818 - not an error, but what the search is for
    def __init__(self, columns: list[int]) -> None:
        super().__init__()
        self.columns = columns


class _Search:
    """One pass for a known best point: proves it best, or raises a better one."""

    def __init__(self, program: ExactProgram, best: list[int] | None, deadline: float | None) -> None:
        self.program, self.deadline = program, deadline
        self.costs = list(program.costs) if best is not None or not program.equations else [0] * program.width
        # Bounds above this settle a leaf. Without a point, that there is none is what has to be shown.
        self.floor = 0 if best is None else sum(program.costs[column] for column in best) - 1

    def tree(self, fixed: NDArray[np.int8]) -> ProofTree:
        """Settle the points with these columns at 1 (entry 1) and 0 (entry -1)."""
        if self.deadline is not None and time.monotonic() > self.deadline:
            raise OutOfTimeError
        self.program.nodes += 1
        x, candidates = self._relaxed(fixed)
        for duals in candidates:
            multipliers = self._settling(fixed, duals)
            if multipliers is not None:
                return Leaf(tuple((row, value) for row, value in enumerate(multipliers) if value))
        if x is None:
            # Multipliers that do not come out exactly; with everything fixed they do.
            column = int(np.flatnonzero(fixed == 0)[0])
        else:
            self._look_at(x)
            free = np.flatnonzero(fixed == 0)
            column = int(free[np.abs(x[free] - 0.6).argmin()])
        chosen, excluded = fixed.copy(), fixed.copy()
        chosen[self.program.crossing[column]] = -1
        chosen[column] = 1
        excluded[column] = -1
        return Branch(column, self.tree(chosen), self.tree(excluded))

    def _look_at(self, x: NDArray[np.float64]) -> None:
        """Raise a point that is integral and better than what is known."""
        if np.abs(x - np.rint(x)).max(initial=0.0) > _INTEGRAL:
            return
        columns: list[int] = np.flatnonzero(x > 0.5).tolist()
        program = self.program
        rows = program.matrix @ np.rint(x).astype(np.int64)
        fits = (rows == program.right).all() if program.equations else (rows <= program.right).all()
        is_better = sum(self.costs[column] for column in columns) <= self.floor
        if fits and is_better and not program.crossing[np.ix_(columns, columns)].any():
            raise _Better(columns)

    def _relaxed(
        self, fixed: NDArray[np.int8]
    ) -> tuple[NDArray[np.float64] | None, list[NDArray[np.float64]]]:
        """Return a point of the relaxation (None without one), and duals that may settle the leaf."""
        program = self.program
        free, ones = np.flatnonzero(fixed == 0), np.flatnonzero(fixed == 1)
        rest = program.right - np.asarray(program.matrix[:, ones].sum(axis=1)).reshape(-1)
        matrix = program.matrix[:, free].tocsr()
        missing, point, duals = self._violation(matrix, rest) if program.equations else (0.0, None, None)
        if missing > _INTEGRAL:
            assert duals is not None
            # Any multiple of a proof that there is no point is one; large enough, it outweighs all costs.
            large = 2 * (abs(self.floor) + sum(map(abs, self.costs)) + 1) / missing
            return None, [duals, large * duals]
        x = np.where(fixed == 1, 1.0, 0.0)
        costs = np.array([self.costs[column] / program._scale for column in free.tolist()])
        if not costs.any() or not len(free):
            if point is not None:
                x[free] = point
            return x, [np.zeros(len(program.right))]
        lower = rest.astype(float) if program.equations else np.full(len(rest), -np.inf)
        solution = solve_linear_program(LinearProgram(costs, matrix, lower, rest.astype(float)))
        if solution.status != "optimal":
            return x, [np.zeros(len(program.right))]
        x[free] = solution.x
        return x, [solution.duals * program._scale]

    def _violation(self, matrix: sp.csr_matrix, rest: NDArray[np.int64]) -> Any:
        """Return by how much equations must be violated in total, with a point that does so and duals."""
        import scipy.sparse as sp

        rows, columns = matrix.shape
        unit = sp.identity(rows, format="csr")
        costs = np.concatenate((np.zeros(columns), np.ones(2 * rows)))
        both = sp.hstack((matrix, unit, -unit), format="csr")
        solution = solve_linear_program(LinearProgram(costs, both, rest.astype(float), rest.astype(float)))
        return solution.value, solution.x[:columns], solution.duals

    def _settling(self, fixed: NDArray[np.int8], duals: NDArray[np.float64]) -> list[Fraction] | None:
        """Return rational multipliers near some duals that settle a leaf; None where there seem to be none."""
        nearest = -np.inf
        for multipliers in self._roundings(duals):
            bound = self._bound(fixed, multipliers)
            if bound > self.floor:
                return multipliers
            nearest = max(nearest, float(bound - self.floor))
        if nearest > -_CLOSE * self.program._scale:
            exact = self._on_basis(fixed, duals)
            if exact is not None and self._bound(fixed, exact) > self.floor:
                return exact
        return None

    def _on_basis(self, fixed: NDArray[np.int8], duals: NDArray[np.float64]) -> list[Fraction] | None:
        """Solve exactly for the duals that are not 0, with the columns whose reduced costs are.

        What a bound lacks because of rounding alone, it has then.
        """
        import flint

        program, size = self.program, np.abs(duals).max(initial=0.0)
        if not size:
            return None
        rows = np.flatnonzero(np.abs(duals) > _CLOSE * size)
        costs = np.array([float(cost) for cost in self.costs])
        reduced = costs - duals @ program.matrix
        tight = np.flatnonzero((fixed == 0) & (np.abs(reduced) <= _CLOSE * program._scale))
        part = program._columns[:, tight].T.tocsr()[:, rows].toarray().tolist()
        entries = [[*row, self.costs[column]] for row, column in zip(part, tight.tolist(), strict=True)]
        if not entries:
            return None
        echelon, rank = flint.fmpq_mat(flint.fmpz_mat(entries)).rref()
        values = [Fraction(round(value)) for value in duals[rows].tolist()]
        table = [[Fraction(int(x.p), int(x.q)) for x in row] for row in echelon.tolist()[:rank]]
        for row in reversed(table):
            pivot = next(place for place, entry in enumerate(row) if entry)
            if pivot == len(rows):
                return None
            rest = sum((row[k] * values[k] for k in range(pivot + 1, len(rows))), Fraction(0))
            values[pivot] = row[-1] - rest
        if not program.equations and any(value > 0 for value in values):
            return None
        result = [Fraction(0)] * len(duals)
        for place, value in zip(rows.tolist(), values, strict=True):
            result[place] = value
        return result

    def _roundings(self, duals: NDArray[np.float64]) -> list[list[Fraction]]:
        """Return multipliers near some duals, the ones with the smallest denominators first."""
        values = duals.tolist() if self.program.equations else np.minimum(duals, 0.0).tolist()
        largest = max(map(abs, values), default=0.0)
        found = [[Fraction(round(12 * value), 12) for value in values]]
        if largest < 1e6:
            found.append([Fraction(value).limit_denominator(10_000) for value in values])
        found.append([Fraction(value) for value in values])
        return found

    def _bound(self, fixed: NDArray[np.int8], multipliers: Sequence[Fraction]) -> Fraction:
        """Return the bound of the module's formula."""
        program, columns = self.program, self.program._columns
        total = sum(
            (value * int(side) for value, side in zip(multipliers, program.right.tolist(), strict=True)),
            Fraction(0),
        )
        for column in np.flatnonzero(fixed >= 0).tolist():
            part = slice(columns.indptr[column], columns.indptr[column + 1])
            pairs = zip(columns.indices[part].tolist(), columns.data[part].tolist(), strict=True)
            reduced = self.costs[column] - sum(
                (multipliers[row] * entry for row, entry in pairs), Fraction(0)
            )
            total += reduced if fixed[column] == 1 else min(reduced, Fraction(0))
        return total

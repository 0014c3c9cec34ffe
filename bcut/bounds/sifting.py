"""From nearly optimal multipliers to an optimum of a large linear program: sifting.

First-order methods come near, never quite there. But then few columns have reduced costs near zero. A linear program
over these alone, with the reduced costs as costs, tells how the multipliers of the rows that they meet are to be
*changed*; the others keep theirs, so that no row is ever without a price. If no other column then has a
negative reduced cost, the optimum is that of the whole program; else such columns come in, and again.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.columns import Columns
from bcut.bounds.linear_program import LinearProgram, solve_linear_program

# Columns to begin with, for each column that the first-order point uses and at least, and how their number grows where
# they do not suffice.
_FOR_EACH, _FEWEST, _GROWTH, _MOST = 3, 1000, 4, 200_000
_ROUNDS = 12
# Reduced costs below this, relative to the costs, are negative.
_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class Sifted:
    """An optimum of the program, as far as floating-point arithmetic tells.

    Attributes
    ----------
    value : float
    x : ndarray of float, shape (m,)
    duals : ndarray of float, shape (rows,)
    """

    value: float
    x: NDArray[np.float64]
    duals: NDArray[np.float64]


def sift(
    columns: Columns,
    costs: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    duals: NDArray[np.float64],
    x: NDArray[np.float64],
    *,
    method: Literal["simplex", "interior"] = "simplex",
    seconds: float | None = None,
) -> Sifted | None:
    """Minimise ``costs @ x`` over ``lower <= A x <= upper``, x >= 0, starting from nearly optimal multipliers.

    Parameters
    ----------
    columns : Columns
        A.
    costs : ndarray of float, shape (m,)
    lower, upper : ndarray of float, shape (rows,)
        Rows are equations, or have one side.
    duals : ndarray of float, shape (rows,)
        Of signs that the rows allow.
    x : ndarray of float, shape (m,)
        Tells by its largest entries which columns to begin with, besides those with the least reduced costs.
    method : {"simplex", "interior"}
        How the small programs are solved.
    seconds : float, optional

    Returns
    -------
    Sifted or None
        None where the time, the rounds or the columns did not suffice.
    """
    deadline = None if seconds is None else time.monotonic() + seconds
    y = np.array(duals, dtype=float)
    reduced = columns.reduced(costs, y)
    used = np.flatnonzero(x > 1e-4 * np.max(x, initial=0.0))
    size = min(columns.count, max(_FEWEST, _FOR_EACH * len(used)))
    chosen = np.union1d(used, np.argpartition(reduced, size - 1)[:size])
    tolerance = _TOLERANCE * max(float(np.abs(costs).max(initial=0.0)), 1e-300)
    for _ in range(_ROUNDS):
        left = None if deadline is None else deadline - time.monotonic()
        if left is not None and left <= 0:
            return None
        step = _change(columns.restricted_to(chosen), reduced[chosen], (lower, upper), y, method, left)
        if step == "limit":
            return None
        if step == "infeasible":
            size = min(columns.count, _GROWTH * size)
            if size > _MOST:
                return None
            chosen = np.union1d(chosen, np.argpartition(reduced, size - 1)[:size])
            continue
        weights, change = step
        trial = y + change
        priced = columns.reduced(costs, trial)
        entering = np.flatnonzero(priced < -tolerance)
        if not len(np.setdiff1d(entering, chosen)):
            point = np.zeros(columns.count)
            point[chosen] = weights
            return Sifted(float((costs[chosen] * weights).sum()), point, trial)
        if len(entering) > size:
            entering = entering[np.argpartition(priced[entering], size - 1)[:size]]
        chosen = np.union1d(chosen, entering)
    return None


def _change(
    columns: Columns,
    costs: NDArray[np.float64],
    sides: tuple[NDArray[np.float64], NDArray[np.float64]],
    y: NDArray[np.float64],
    method: Literal["simplex", "interior"],
    seconds: float | None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | Literal["infeasible", "limit"]:
    """Solve the program on some columns, with their reduced costs for y; return x and the change of y.

    An inequality becomes an equation with a slack variable, whose reduced cost is that of any column.
    """
    import scipy.sparse as sp

    lower, upper = sides
    matrix = columns.sparse().tocsr().astype(float)
    met = np.flatnonzero((np.diff(matrix.indptr) > 0) | (lower > 0) | (upper < 0))
    loose = np.flatnonzero(lower[met] != upper[met])
    right = np.where(np.isfinite(lower), lower, upper)[met]
    signs = np.where(np.isfinite(lower), -1.0, 1.0)[met[loose]]
    slacks = sp.csr_array((signs, (loose, np.arange(len(loose)))), shape=(len(met), len(loose)))
    program = LinearProgram(
        np.concatenate((costs, -signs * y[met[loose]])),
        sp.hstack((matrix[met], slacks), format="csr"),
        right,
        right,
    )
    solution = solve_linear_program(program, method=method, seconds=seconds)
    if solution.status != "optimal":
        return solution.status
    change = np.zeros(len(y))
    change[met] = solution.duals
    return solution.x[: columns.count], change

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

from bcut.bounds.linear_program import LinearProgram, solve_linear_program
from bcut.bounds.repair import Floats, Program

# Columns to begin with, for each column that the first-order point uses and at least, and how their number grows where
# they do not suffice.
_FOR_EACH, _FEWEST, _GROWTH, _MOST = 2, 16, 4, 200_000
_ROUNDS = 12
# Columns, at least, between whose multipliers the middle is sought; how far to go of the way that is possible.
_CENTRE, _SHARE, _ZERO = 1000, 0.9, 1e-7
# Entries of x below this, relative to the largest, are not meant.
_USED = 1e-4
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
    x: Floats
    duals: Floats


def sift(
    program: Program,
    duals: Floats,
    x: Floats,
    *,
    method: Literal["simplex", "interior"] = "simplex",
    seconds: float | None = None,
) -> Sifted | None:
    """Solve a program to optimality, starting from nearly optimal multipliers.

    Parameters
    ----------
    program : Program
        Its rows are equations, or have one side.
    duals : ndarray of float, shape (rows,)
        Of signs that the rows allow.
    x : ndarray of float, shape (m,)
        Tells by its largest entries which columns to begin with, besides those with the least reduced costs.
    method : {"simplex", "interior"}
        "interior" moves the multipliers away from the boundary of the set of optimal ones.
    seconds : float, optional

    Returns
    -------
    Sifted or None
        None where the time, the rounds or the columns did not suffice.
    """
    deadline = None if seconds is None else time.monotonic() + seconds
    columns, costs = program.columns, program.costs
    reduced = columns.reduced(costs, duals)
    used = np.flatnonzero(x > _USED * np.max(x, initial=0.0))
    size = min(columns.count, max(_FEWEST, _FOR_EACH * len(used)))
    chosen = np.union1d(used, _least(reduced, size))
    tolerance = _TOLERANCE * max(float(np.abs(costs).max(initial=0.0)), 1e-300)
    for _ in range(_ROUNDS):
        step = _change(program, chosen, reduced[chosen], duals, "simplex", deadline)
        if step == "limit" or (step == "infeasible" and len(chosen) == columns.count):
            return None
        if step == "infeasible":
            size = min(columns.count, _GROWTH * size)
            if size > _MOST:
                return None
            chosen = np.union1d(chosen, _least(reduced, size))
            continue
        weights, change = step
        priced = columns.reduced(costs, duals + change)
        entering = np.flatnonzero(priced < -tolerance)
        if not len(np.setdiff1d(entering, chosen)):
            point = np.zeros(columns.count)
            point[chosen] = weights
            found = duals + change
            if method == "interior":
                found += _towards_the_middle(program, priced, found, tolerance, deadline)
            return Sifted(float((costs[chosen] * weights).sum()), point, found)
        chosen = np.union1d(chosen, entering[_least(priced[entering], min(size, len(entering)))])
        size = min(columns.count, 2 * size)
    return None


def _least(values: Floats, count: int) -> NDArray[np.intp]:
    """Return the places of the least values."""
    return np.argpartition(values, count - 1)[:count]


def _towards_the_middle(
    program: Program, reduced: Floats, duals: Floats, tolerance: float, deadline: float | None
) -> Floats:
    """Return a change of optimal multipliers, with these reduced costs, that leaves fewer of them zero.

    Multipliers in the middle of the set that is optimal for the columns with the least reduced costs have the same
    value, and so has all between them and these; how far one may go, the other columns tell.
    """
    columns = program.columns
    size = min(columns.count, max(_CENTRE, 2 * int((reduced < _ZERO).sum())))
    if size > _MOST:
        return np.zeros(len(duals))
    least = np.sort(_least(reduced, size))
    step = _change(program, least, np.maximum(reduced[least], 0.0), duals, "interior", deadline)
    if isinstance(step, str):
        return np.zeros(len(duals))
    _, change = step
    loss = -columns.reduced(np.zeros(columns.count), change)
    losing = np.flatnonzero(loss > 0)
    rates = (np.maximum(reduced[losing], 0.0) + tolerance) / loss[losing]
    return min(1.0, _SHARE * float(rates.min(initial=np.inf))) * change


def _change(
    program: Program,
    chosen: NDArray[np.intp],
    costs: Floats,
    y: Floats,
    method: Literal["simplex", "interior"],
    deadline: float | None,
) -> tuple[Floats, Floats] | Literal["infeasible", "limit"]:
    """Solve the program on some columns, with their reduced costs for y; return x and the change of y.

    An inequality becomes an equation with a slack variable, whose reduced cost is that of any column.
    """
    import scipy.sparse as sp

    seconds = None if deadline is None else deadline - time.monotonic()
    if seconds is not None and seconds <= 0:
        return "limit"
    lower, upper = program.lower, program.upper
    matrix = program.columns.restricted_to(chosen).sparse().tocsr().astype(float)
    met = np.flatnonzero((np.diff(matrix.indptr) > 0) | (lower > 0) | (upper < 0))
    loose = np.flatnonzero(lower[met] != upper[met])
    right = np.where(np.isfinite(lower), lower, upper)[met]
    signs = np.where(np.isfinite(lower), -1.0, 1.0)[met[loose]]
    slacks = sp.csr_array((signs, (loose, np.arange(len(loose)))), shape=(len(met), len(loose)))
    small = LinearProgram(
        np.concatenate((costs, -signs * y[met[loose]])),
        sp.hstack((matrix[met], slacks), format="csr"),
        right,
        right,
    )
    solution = solve_linear_program(small, method=method, seconds=seconds)
    if solution.status != "optimal":
        return solution.status
    change = np.zeros(len(y))
    change[met] = solution.duals
    return solution.x[: len(chosen)], change

"""Linear programs with more columns than HiGHS can cope with: a first-order method, then sifting."""

from __future__ import annotations

import time
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.columns import Columns
from bcut.bounds.first_order import FirstOrder, Program, Progress, first_order_bound
from bcut.bounds.linear_program import LinearProgram, LpSolution
from bcut.bounds.sifting import sift

# From this many columns on this is the faster way.
LARGE = 20_000
# How close to go before sifting, first and where that did not do.
_TOLERANCES = (1e-4, 1e-6)
_ITERATIONS = 200_000


def solve_large_program(
    program: LinearProgram,
    *,
    method: Literal["simplex", "interior"] = "simplex",
    seconds: float | None = None,
) -> LpSolution:
    """Solve a linear program, as `bcut.bounds.linear_program.solve_linear_program` does.

    Parameters
    ----------
    program : LinearProgram
        Its rows are equations, or have one side.
    method : {"simplex", "interior"}
        "interior" gives multipliers in the middle of the optimal ones.
    seconds : float, optional
        Time limit.

    Returns
    -------
    LpSolution
        Where the status is "limit", `x` is not quite feasible, and `duals` are the best multipliers found, with
        reduced costs that are not negative.
    """
    deadline = None if seconds is None else time.monotonic() + seconds
    columns = Columns.of_matrix(program.matrix)
    large = Program(columns, program.costs, program.lower, program.upper)
    anchor, most = _positive_row(program)
    start: tuple[NDArray[np.float64] | None, NDArray[np.float64] | None] = (None, None)

    def beyond(progress: Progress) -> bool:
        return progress.bound > most

    found: FirstOrder | None = None
    for tolerance in _TOLERANCES:
        found = first_order_bound(
            large,
            anchor=anchor,
            start=start,
            tolerance=tolerance,
            iterations=_ITERATIONS,
            seconds=_left(deadline),
            stop=beyond,
        )
        if found.status == "interrupted":
            raise KeyboardInterrupt
        if found.status == "stopped":
            return LpSolution("infeasible", found.x, found.duals, found.bound)
        if found.status != "converged":
            break
        sifted = sift(large, found.duals, found.x, method=method, seconds=_left(deadline))
        if sifted is not None:
            return LpSolution("optimal", sifted.x, sifted.duals, sifted.value)
        start = (found.x, found.duals)
    assert found is not None
    return LpSolution("limit", np.maximum(found.x, 0.0), found.duals, found.bound)


def _left(deadline: float | None) -> float | None:
    return None if deadline is None else max(0.0, deadline - time.monotonic())


def _positive_row(program: LinearProgram) -> tuple[NDArray[np.float64] | None, float]:
    """Return multipliers with positive reduced costs, and what no feasible point costs more than.

    Both come from an equation with positive entries only, such as that of the volumes.
    """
    matrix = program.matrix.tocsr()
    columns = matrix.shape[1]
    for row in np.flatnonzero((np.diff(matrix.indptr) == columns) & (program.lower == program.upper)):
        part = slice(matrix.indptr[row], matrix.indptr[row + 1])
        entries = np.empty(columns)
        entries[matrix.indices[part]] = matrix.data[part]
        if entries.min() > 0:
            rates = program.costs / entries
            most = float(rates.max() * program.upper[row])
            if program.costs.min() > 0:
                return None, most * (1 + 1e-6)
            anchor = np.zeros(matrix.shape[0])
            # Twice as much as makes reduced costs zero, so that the other columns keep some distance too.
            anchor[row] = 2 * rates.min() if rates.min() < 0 else -float(np.abs(rates).mean() or 1.0)
            return anchor, most + 1e-6 * abs(most)
    return None, np.inf

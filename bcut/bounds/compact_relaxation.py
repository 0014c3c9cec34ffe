"""Multipliers for the relaxation of all columns of a compact program: a first-order method, or interior point."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.columns import Columns
from bcut.bounds.coverage_points import coverage_points
from bcut.bounds.first_order import Program, Progress, first_order_bound
from bcut.formulations.compact import CompactProgram
from bcut.objectives.objective import Objective

# A small program is what fixing is for: once the incumbent leaves so few columns, better multipliers cost more
# than they save.
_FEW, _FEW_OF = 1500, 10


@dataclass(frozen=True, eq=False)
class CompactDuals:
    """Multipliers, not yet proven to be worth anything.

    Attributes
    ----------
    status : {"accurate", "limit", "interrupted"}
    y : ndarray of float, shape (r + 1,)
        Of the coverage row, then of the cocircuit rows.
    x : ndarray of float, shape (m,)
        A nearly feasible point.
    primal : float
        Its value, for the minimisation of ``sign * costs``.
    """

    status: Literal["accurate", "limit", "interrupted"]
    y: NDArray[np.float64]
    x: NDArray[np.float64]
    primal: float


def bound_relaxation(
    program: CompactProgram,
    objective: Objective,
    *,
    tolerance: float,
    incumbent: float | None = None,
    start: CompactDuals | None = None,
    everything: CompactProgram | None = None,
    seconds: float | None = None,
    on_progress: Callable[[dict[str, Any]], None] | None = None,
) -> CompactDuals:
    """Find multipliers for all rows.

    Parameters
    ----------
    program : CompactProgram
    objective : Objective
    tolerance : float
        Relative accuracy.
    incumbent : float, optional
        The value of a known triangulation: the work ends as soon as it leaves few columns.
    start : CompactDuals, optional
        To start from.
    everything : CompactProgram, optional
        The program before it was restricted to some columns, where it was: with the same rows.
    seconds : float, optional
    on_progress : callable, optional
        Told of ``{"lp": value, "first_order": bound}``.
    """
    unit = float(objective.solver_unit)
    costs = objective.sign * objective.solver_costs
    columns = Columns.of_facets(
        program.facet_rows, program.facet_signs, program.coverage, len(program.row_faces)
    )
    sides = np.zeros(columns.rows)
    sides[0] = 1.0
    linear = Program(columns, costs, sides, sides.copy(), column_upper=1.0)
    linear = _with_coverage_points(linear, program if everything is None else everything)

    def tell(progress: Progress) -> None:
        if on_progress is not None:
            facts = {"first_order": objective.sign * progress.bound * unit, "iterations": progress.iterations}
            if progress.within is not None:
                facts["columns"] = progress.within
            on_progress(facts)

    def stop(progress: Progress) -> bool:
        return progress.within is not None and progress.within <= min(_FEW, columns.count // _FEW_OF)

    found = first_order_bound(
        linear,
        start=(None, None) if start is None else (start.x, start.y / unit),
        incumbent=None if incumbent is None else incumbent / unit,
        tolerance=tolerance,
        seconds=seconds,
        on_progress=tell,
        stop=stop,
    )
    status: Literal["accurate", "limit", "interrupted"] = "accurate"
    if found.status == "interrupted":
        status = "interrupted"
    elif found.status == "time":
        status = "limit"
    return CompactDuals(status, found.duals * unit, found.x, float(costs @ found.x) * unit)


def _with_coverage_points(linear: Program, program: CompactProgram) -> Program:
    """Append coverage rows of further points, as far as floating point finds such points."""
    from scipy.spatial import QhullError

    if not len(program.row_faces):
        return linear
    try:
        return linear.with_combinations(coverage_points(program))
    except (ArithmeticError, ValueError, np.linalg.LinAlgError, QhullError):
        return linear

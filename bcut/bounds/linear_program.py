"""Plain linear programs in HiGHS: solved once, without warm starts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from bcut.errors import SolverError

if TYPE_CHECKING:
    import scipy.sparse as sp

# A dual that is off by this much changes no bound that matters, and HiGHS still gets there.
_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class LinearProgram:
    """Minimise ``costs @ x`` over ``lower <= matrix @ x <= upper``, x >= 0.

    Attributes
    ----------
    costs : ndarray of float, shape (m,)
    matrix : scipy.sparse.csr_matrix, shape (rows, m)
    lower, upper : ndarray of float, shape (rows,)
        Infinite where a row has no such side.
    """

    costs: NDArray[np.float64]
    matrix: sp.csr_matrix
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LpSolution:
    """What HiGHS returned.

    Attributes
    ----------
    status : {"optimal", "infeasible", "limit"}
    x : ndarray of float, shape (m,)
    duals : ndarray of float, shape (rows,)
    value : float
    """

    status: Literal["optimal", "infeasible", "limit"]
    x: NDArray[np.float64]
    duals: NDArray[np.float64]
    value: float


def solve_linear_program(
    program: LinearProgram,
    *,
    method: Literal["simplex", "interior"] = "simplex",
    seconds: float | None = None,
) -> LpSolution:
    """Solve a linear program.

    Parameters
    ----------
    program : LinearProgram
    method : {"simplex", "interior"}
        A vertex, or an interior point method without crossover: its duals lie inside the set of optimal ones,
        and so prove as many columns as possible to be useless.
    seconds : float, optional
        Time limit.

    Raises
    ------
    SolverError
        If HiGHS fails.
    """
    import highspy

    rows, columns = program.matrix.shape
    model = highspy.HighsLp()
    model.num_col_, model.num_row_ = columns, rows
    model.col_cost_ = program.costs
    model.col_lower_, model.col_upper_ = np.zeros(columns), np.full(columns, np.inf)
    model.row_lower_, model.row_upper_ = program.lower, program.upper
    matrix = program.matrix.tocsr()
    model.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
    model.a_matrix_.start_ = matrix.indptr
    model.a_matrix_.index_ = matrix.indices
    model.a_matrix_.value_ = matrix.data.astype(float)
    solver = highspy.Highs()
    options = {
        "output_flag": False,
        "threads": 1,
        "primal_feasibility_tolerance": _TOLERANCE,
        "dual_feasibility_tolerance": _TOLERANCE,
        "ipm_optimality_tolerance": _TOLERANCE,
        "solver": "ipm" if method == "interior" else "simplex",
        "run_crossover": "off" if method == "interior" else "on",
    }
    if seconds is not None:
        options["time_limit"] = max(0.0, seconds)
    for name, value in options.items():
        solver.setOptionValue(name, value)
    if solver.passModel(model) == highspy.HighsStatus.kError:
        raise SolverError("HiGHS refused the model of a linear program")
    solver.run()
    solution = solver.getSolution()
    x, duals = np.array(solution.col_value), np.array(solution.row_dual)
    value = float(program.costs @ x) if len(x) == columns else np.nan
    status = solver.getModelStatus()
    # Without crossover, HiGHS calls a point that is optimal but not basic "unknown" at times; any duals give
    # a bound.
    if (
        status in (highspy.HighsModelStatus.kOptimal, highspy.HighsModelStatus.kUnknown)
        and len(duals) == rows
    ):
        return LpSolution("optimal", x, duals, value)
    if status == highspy.HighsModelStatus.kInfeasible:
        return LpSolution("infeasible", x, duals, value)
    if status == highspy.HighsModelStatus.kTimeLimit:
        return LpSolution("limit", x, duals, value)
    raise SolverError(f"HiGHS ended with status {solver.modelStatusToString(status)} on a linear program")

"""Many tiny linear programs, one after the other: for separators whose separation problem is one."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray


class SmallLps:
    """Solves ``max c x`` over ``A x <= b`` rows and ``A x = 0`` rows, x >= 0, for many small data.

    One solver object is kept, because starting one costs more than such a program.
    """

    @cached_property
    def _solver(self) -> Any:
        import highspy

        solver = highspy.Highs()
        solver.setOptionValue("output_flag", False)
        solver.setOptionValue("presolve", "off")
        solver.setOptionValue("threads", 1)
        return solver

    def maximise(
        self,
        costs: NDArray[np.floating],
        starts: NDArray[np.integer],
        rows: NDArray[np.integer],
        values: NDArray[np.floating],
        capacities: NDArray[np.floating],
        equations: int,
    ) -> tuple[float, NDArray[np.float64]]:
        """Solve one program.

        Parameters
        ----------
        costs : ndarray of float, shape (columns,)
        starts, rows, values : ndarrays
            The matrix by columns, in compressed form; starts has one entry more than there are columns.
        capacities : ndarray of float, shape (k,)
            Right-hand sides of the first k rows.
        equations : int
            Number of further rows, with right-hand side 0.

        Returns
        -------
        value : float
        prices : ndarray of float, shape (k,)
            Dual multipliers of the first k rows, not negative.

        Raises
        ------
        ArithmeticError
            If the program has no optimum.
        """
        import highspy

        k, columns = len(capacities), len(costs)
        model = highspy.HighsLp()
        model.num_col_, model.num_row_ = columns, k + equations
        model.sense_ = highspy.ObjSense.kMaximize
        model.col_cost_ = np.asarray(costs, dtype=float)
        model.col_lower_, model.col_upper_ = np.zeros(columns), np.full(columns, np.inf)
        model.row_lower_ = np.concatenate((np.full(k, -np.inf), np.zeros(equations)))
        model.row_upper_ = np.concatenate((capacities, np.zeros(equations)))
        model.a_matrix_.format_ = highspy.MatrixFormat.kColwise
        model.a_matrix_.start_ = np.asarray(starts, dtype=np.int32)
        model.a_matrix_.index_ = np.asarray(rows, dtype=np.int32)
        model.a_matrix_.value_ = np.asarray(values, dtype=float)
        solver = self._solver
        solver.passModel(model)
        solver.run()
        if solver.getModelStatus() != highspy.HighsModelStatus.kOptimal:
            raise ArithmeticError(
                f"small linear program: {solver.modelStatusToString(solver.getModelStatus())}"
            )
        prices = np.array(solver.getSolution().row_dual)[:k]
        return float(solver.getInfo().objective_function_value), np.maximum(prices, 0.0)

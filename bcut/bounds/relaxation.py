"""The linear relaxation of a formulation in HiGHS, with cuts that come and go. The only place that imports highspy."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.safe import UNBOUNDED, SafeBound, safe_bound
from bcut.errors import SolverError
from bcut.formulations.formulation import Formulation
from bcut.objectives.objective import Objective
from bcut.separation.driver import IntegerCut

# From this many columns on, interior point with crossover beats the dual simplex by far on the first
# relaxation: these programs are massively degenerate. Afterwards the dual simplex starts from the last basis;
# where it takes more than this share of the number of rows in iterations, starting over with interior point
# is faster again.
_INTERIOR_POINT_FROM = 1500
_SIMPLEX_ITERATIONS = 0.4


@dataclass(frozen=True, eq=False)
class RelaxationPoint:
    """An optimal point of the relaxation.

    Attributes
    ----------
    x : ndarray of float, shape (m,)
    value : float
        ``costs @ x``, unrounded, in the sense of the objective.
    duals : ndarray of float, shape (rows + cuts,)
        For the minimisation of ``sign * costs``.
    slack : ndarray of float, shape (cuts,)
        ``rhs - coefficients @ x`` of the cuts that are in.
    """

    x: NDArray[np.float64]
    value: float
    duals: NDArray[np.float64]
    slack: NDArray[np.float64]


class Relaxation:
    """A linear program that is re-solved warm after cuts are added or dropped.

    Parameters
    ----------
    formulation : Formulation
    objective : Objective
    deadline : float, optional
        Value of `time.monotonic` after which solving stops.
    """

    def __init__(
        self, formulation: Formulation, objective: Objective, *, deadline: float | None = None
    ) -> None:
        self.formulation = formulation
        self.objective = objective
        self.deadline = deadline
        self.cuts: list[IntegerCut] = []
        self._unit = float(objective.solver_unit)
        self._costs = objective.sign * objective.solver_costs
        self._solver = self._load()

    def _load(self) -> Any:
        import highspy

        matrix = self.formulation.matrix.tocsr()
        rows, columns = matrix.shape
        model = highspy.HighsLp()
        model.num_col_, model.num_row_ = columns, rows
        model.col_cost_ = self._costs
        model.col_lower_, model.col_upper_ = np.zeros(columns), np.ones(columns)
        model.row_lower_ = _with_infinities(self.formulation.lower)
        model.row_upper_ = _with_infinities(self.formulation.upper)
        model.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
        model.a_matrix_.start_ = matrix.indptr
        model.a_matrix_.index_ = matrix.indices
        model.a_matrix_.value_ = matrix.data.astype(float)
        solver = highspy.Highs()
        solver.setOptionValue("output_flag", False)
        solver.setOptionValue("threads", 1)
        # Presolve finds nothing to remove here and makes the rest slower.
        solver.setOptionValue("presolve", "off")
        self._interior_point = columns >= _INTERIOR_POINT_FROM
        if solver.passModel(model) == highspy.HighsStatus.kError:
            raise SolverError("HiGHS refused the model of the relaxation")
        return solver

    def restricted_to(self, columns: NDArray[np.integer]) -> Relaxation:
        """Return the relaxation on some of its columns, with its cuts; it is solved from scratch."""
        place = np.full(len(self.formulation.simplices), -1)
        place[columns] = np.arange(len(columns))
        smaller = Relaxation(
            self.formulation.restricted_to(columns),
            self.objective.restricted_to(columns),
            deadline=self.deadline,
        )
        # Cuts may coincide on what is left, or have nothing left.
        cuts = {cut.key: cut for cut in (cut.restricted_to(place) for cut in self.cuts)}
        smaller.add([cut for cut in cuts.values() if len(cut.columns) or cut.rhs < 0])
        return smaller

    def add(self, cuts: Sequence[IntegerCut]) -> None:
        """Add cuts as rows."""
        if not cuts:
            return
        starts = np.cumsum([0, *(len(cut.columns) for cut in cuts[:-1])])
        indices = np.concatenate([cut.columns for cut in cuts])
        values = np.concatenate([cut.coefficients for cut in cuts]).astype(float)
        upper = np.array([float(cut.rhs) for cut in cuts])
        lower = np.full(len(cuts), -np.inf)
        self._solver.addRows(
            len(cuts), lower, upper, len(indices), starts.astype(np.int32), indices.astype(np.int32), values
        )
        self.cuts.extend(cuts)

    def drop(self, positions: Sequence[int]) -> list[IntegerCut]:
        """Take cuts out again, by their positions in `cuts`; returns them."""
        if not positions:
            return []
        base = self.formulation.matrix.shape[0]
        rows = np.array([base + position for position in sorted(positions)], dtype=np.int32)
        self._solver.deleteRows(len(rows), rows)
        gone = set(positions)
        dropped = [cut for position, cut in enumerate(self.cuts) if position in gone]
        self.cuts = [cut for position, cut in enumerate(self.cuts) if position not in gone]
        return dropped

    def solve(self) -> RelaxationPoint | None:
        """Solve to optimality.

        Returns
        -------
        RelaxationPoint or None
            None when the deadline came first.

        Raises
        ------
        InfeasibleRelaxation
            If no point satisfies all rows and cuts.
        SolverError
            If HiGHS fails.
        """
        import highspy

        solver = self._solver
        if not len(self._costs):
            raise InfeasibleRelaxationError  # the coverage row asks for a simplex; HiGHS calls this "empty"
        if not self._interior_point and len(self._costs) >= _INTERIOR_POINT_FROM:
            limit = int(_SIMPLEX_ITERATIONS * self.formulation.matrix.shape[0])
            solver.setOptionValue("simplex_iteration_limit", limit)
        status = self._run()
        if status == highspy.HighsModelStatus.kIterationLimit:
            solver.setOptionValue("simplex_iteration_limit", 2**31 - 1)
            self._interior_point = True
            status = self._run()
        elif not self.cuts:
            self._interior_point = False
        if status not in _answers(highspy.HighsModelStatus):
            # Interior point may end without an answer; the simplex method from scratch is slow, but sure.
            solver.clearSolver()
            self._interior_point = False
            status = self._run()
        if status == highspy.HighsModelStatus.kTimeLimit:
            return None
        if status == highspy.HighsModelStatus.kInfeasible:
            raise InfeasibleRelaxationError
        if status != highspy.HighsModelStatus.kOptimal:
            raise SolverError(
                f"HiGHS ended with status {solver.modelStatusToString(status)} on the relaxation"
            )
        solution = solver.getSolution()
        x = np.array(solution.col_value)
        base = self.formulation.matrix.shape[0]
        activity = np.array(solution.row_value)[base:]
        slack = np.array([cut.rhs for cut in self.cuts]) - activity
        value = self.objective.sign * float(self._costs @ x) * self._unit
        return RelaxationPoint(x, value, np.array(solution.row_dual) * self._unit, slack)

    def _run(self) -> Any:
        """Run HiGHS within the deadline; return the model status."""
        import highspy

        solver = self._solver
        if self.deadline is not None:
            remaining = self.deadline - time.monotonic()
            if remaining <= 0:
                return highspy.HighsModelStatus.kTimeLimit
            solver.setOptionValue("time_limit", solver.getRunTime() + remaining)
        solver.setOptionValue("solver", "ipm" if self._interior_point else "simplex")
        _run_interruptibly(solver)
        return solver.getModelStatus()

    def safe_bound(self, duals: NDArray[np.float64]) -> SafeBound:
        """Turn multipliers of all rows and cuts into an exact bound."""
        import scipy.sparse as sp

        formulation = self.formulation
        matrix, lower, upper = formulation.matrix, formulation.lower, formulation.upper
        if self.cuts:
            starts = np.cumsum([0, *(len(cut.columns) for cut in self.cuts)])
            data = np.concatenate([cut.coefficients for cut in self.cuts])
            columns = np.concatenate([cut.columns for cut in self.cuts])
            rows = sp.csr_matrix((data, columns, starts), shape=(len(self.cuts), matrix.shape[1]))
            matrix = sp.vstack((matrix.astype(np.int64), rows), format="csr")
            lower = np.concatenate((lower, np.full(len(self.cuts), -UNBOUNDED)))
            upper = np.concatenate((upper, np.array([cut.rhs for cut in self.cuts], dtype=np.int64)))
        return safe_bound(matrix, lower, upper, self.objective, duals)


class InfeasibleRelaxationError(Exception):
    """The relaxation has no point: with the columns at hand there is no triangulation."""


def _answers(statuses: Any) -> tuple[Any, ...]:
    return statuses.kOptimal, statuses.kInfeasible, statuses.kTimeLimit


def _with_infinities(sides: NDArray[np.int64]) -> NDArray[np.float64]:
    values = sides.astype(float)
    values[sides == UNBOUNDED] = np.inf
    values[sides == -UNBOUNDED] = -np.inf
    return values


def _run_interruptibly(solver: Any) -> None:
    """Run HiGHS in its own thread, so that Ctrl-C is heard at once and not when the program is solved.

    Raises
    ------
    KeyboardInterrupt
        After HiGHS has stopped.
    """
    solver.HandleUserInterrupt = True
    solver.startSolve()
    try:
        finished = False
        while not finished:
            finished, _ = solver.wait(0.1)
    except KeyboardInterrupt:
        solver.cancelSolve()
        solver.wait()
        raise

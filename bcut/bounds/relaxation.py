"""The linear relaxation of a formulation in HiGHS, with cuts that come and go."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.safe import SafeBound, safe_bound
from bcut.errors import SolverError
from bcut.formulations.formulation import UNBOUNDED, Formulation
from bcut.formulations.lazy_rows import LazyRow, violated_rows
from bcut.objectives.objective import Objective
from bcut.separation.driver import IntegerCut

# From this many columns on, interior point with crossover beats the dual simplex by far on the first
# relaxation: these programs are massively degenerate. Afterwards the dual simplex starts from the last basis;
# where it takes more than this share of the number of rows in iterations, starting over with interior point
# is faster again.
_INTERIOR_POINT_FROM = 1500
_SIMPLEX_ITERATIONS = 0.4
# Up to this many columns HiGHS is done before anybody would interrupt it, often sooner than a thread for that starts.
_AT_ONCE = 1000
# Rows of the formulation that are left to be asked for count as violated from this much on.
_LAZY_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class RelaxationPoint:
    """An optimal point of the relaxation.

    Attributes
    ----------
    x : ndarray of float, shape (m,)
        Values of the d-simplices.
    value : float
        ``costs @ x``, unrounded, in the sense of the objective.
    duals : ndarray of float, shape (rows + cuts,)
        For the minimisation of ``sign * costs``.
    slack : ndarray of float, shape (cuts,)
        ``rhs - coefficients @ x`` of the cuts that are in.
    everything : ndarray of float, shape (width,)
        Values of all columns of the formulation.
    """

    x: NDArray[np.float64]
    value: float
    duals: NDArray[np.float64]
    slack: NDArray[np.float64]
    everything: NDArray[np.float64]


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
        self._costs = np.zeros(formulation.width)
        self._costs[: len(formulation.simplices)] = objective.sign * objective.solver_costs
        self._solver = self._load()

    def _load(self) -> Any:
        import highspy

        matrix = self.formulation.matrix.tocsr()
        rows, columns = matrix.shape
        model = highspy.HighsLp()
        model.num_col_, model.num_row_ = columns, rows
        model.col_cost_ = self._costs
        model.col_lower_, model.col_upper_ = np.zeros(columns), np.ones(columns)
        entries, model.row_lower_, model.row_upper_ = self.formulation.scaled
        model.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
        model.a_matrix_.start_ = matrix.indptr
        model.a_matrix_.index_ = matrix.indices
        model.a_matrix_.value_ = entries
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
        kept = self.formulation.completed(columns)
        place = np.full(self.formulation.width, -1)
        place[kept] = np.arange(len(kept))
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
        """Add cuts as rows.

        Raises
        ------
        SolverError
            If HiGHS takes them for no rows; then none of them is added.
        """
        if not cuts:
            return
        import highspy

        starts = np.cumsum([0, *(len(cut.columns) for cut in cuts[:-1])])
        indices = np.concatenate([cut.columns for cut in cuts])
        values = np.concatenate([cut.coefficients for cut in cuts]).astype(float)
        upper = np.array([float(cut.rhs) for cut in cuts])
        lower = np.full(len(cuts), -np.inf)
        status = self._solver.addRows(
            len(cuts), lower, upper, len(indices), starts.astype(np.int32), indices.astype(np.int32), values
        )
        if status == highspy.HighsStatus.kError:
            raise SolverError(
                "HiGHS refused the cuts: one of them has a column twice, or entries beyond its range"
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
        InfeasibleRelaxationError
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
        duals = np.array(solution.row_dual) * self._unit
        return RelaxationPoint(x[: len(self.formulation.simplices)], value, duals, slack, x)

    def missing_rows(self, point: RelaxationPoint) -> list[IntegerCut]:
        """Return rows of the formulation that are not written down and that a point violates, as cuts."""
        rows = violated_rows(self.formulation.lazy, point.everything, _LAZY_TOLERANCE)
        return [as_cut(row) for row in rows]

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
        if len(self._costs) <= _AT_ONCE:
            solver.run()
        else:
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
        shifts = formulation.row_shifts
        if shifts is not None:
            shifts = np.concatenate((shifts, np.zeros(len(self.cuts), dtype=np.int64)))
        count = len(formulation.simplices)
        objective = self.objective
        if formulation.faces:
            # Other faces have columns, but cost nothing.
            free = np.zeros(len(formulation.faces), dtype=objective.numerators.dtype)
            objective = replace(objective, numerators=np.concatenate((objective.numerators, free)))
        return safe_bound(matrix, lower, upper, objective, duals, shifts).restricted_to(np.arange(count))


def as_cut(row: LazyRow) -> IntegerCut:
    """Return a row of the formulation in the form in which solvers take rows one by one."""
    return IntegerCut(row.kind, row.columns, row.coefficients, row.rhs, {})


class InfeasibleRelaxationError(Exception):
    """The relaxation has no point: with the columns at hand there is no triangulation."""


def _answers(statuses: Any) -> tuple[Any, ...]:
    return statuses.kOptimal, statuses.kInfeasible, statuses.kTimeLimit


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

"""Rows of a formulation that are written when they are needed, as a SCIP constraint handler."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyscipopt import SCIP_LPSOLSTAT, SCIP_RESULT, SCIP_STAGE, Conshdlr, Model, Variable
from pyscipopt.scip import Expr, ExprCons, Term

from bcut.formulations.lazy_rows import LazyRow, LazyRows, violated_rows

# Above SCIP's own tolerance, so that what SCIP takes for satisfied is not found again and again.
_TOLERANCE = 1e-5


class LazyRowsHandler(Conshdlr):
    """Asks the oracles of a formulation about every point that SCIP takes for a solution, and about relaxations.

    What an oracle raises would be swallowed by SCIP, so it is kept in `error`, and the solve is interrupted.

    Parameters
    ----------
    lazy : sequence of LazyRows
    variables : list of Variable
        One for each column of the formulation.
    """

    def __init__(self, lazy: Sequence[LazyRows], variables: list[Variable]) -> None:
        self.lazy, self.variables = lazy, variables
        self.terms = [Term(variable) for variable in variables]
        self.error: BaseException | None = None

    def include_in(self, model: Model) -> None:
        """Put the handler to work in a model."""
        model.includeConshdlr(
            self,
            "bcut-lazy",
            "rows of the formulation that are written when they are needed",
            sepapriority=1_000_000,
            # Integral points only: below the handler of integrality.
            enfopriority=-1_000_000,
            chckpriority=-1_000_000,
            sepafreq=1,
            propfreq=-1,
            eagerfreq=-1,
            maxprerounds=0,
            needscons=False,
        )
        # Symmetries of the rows that are written are not those of the whole formulation.
        model.setParam("misc/usesymmetry", 0)

    def conslock(self, constraint: Any, locktype: Any, nlockspos: int, nlocksneg: int) -> None:
        """Tell SCIP that any change of any variable may violate a row."""
        for variable in self.variables:
            self.model.addVarLocks(variable, nlockspos + nlocksneg, nlockspos + nlocksneg)

    def conscheck(
        self,
        constraints: Any,
        solution: Any,
        checkintegrality: bool,
        checklprows: bool,
        printreason: bool,
        completely: bool,
    ) -> dict[str, Any]:
        """Tell whether a solution satisfies all rows."""
        found = self._violated(solution)
        return {"result": SCIP_RESULT.INFEASIBLE if found else SCIP_RESULT.FEASIBLE}

    def consenfolp(self, constraints: Any, nusefulconss: int, solinfeasible: bool) -> dict[str, Any]:
        """Add the rows that the relaxation's integral solution violates."""
        return self._enforce()

    def consenfops(
        self, constraints: Any, nusefulconss: int, solinfeasible: bool, objinfeasible: bool
    ) -> dict[str, Any]:
        """Add the rows that a solution without relaxation violates."""
        return self._enforce()

    def conssepalp(self, constraints: Any, nusefulconss: int) -> dict[str, Any]:
        """Add the rows that a fractional solution of the relaxation violates."""
        model = self.model
        if model.getStage() != SCIP_STAGE.SOLVING or model.getLPSolstat() != SCIP_LPSOLSTAT.OPTIMAL:
            return {"result": SCIP_RESULT.DIDNOTRUN}
        added = self._add(self._violated(None))
        return {"result": added if added is not None else SCIP_RESULT.DIDNOTFIND}

    def _enforce(self) -> dict[str, Any]:
        added = self._add(self._violated(None))
        return {"result": added if added is not None else SCIP_RESULT.FEASIBLE}

    def _violated(self, solution: Any) -> list[LazyRow]:
        """Return rows that a solution violates, or the current one; an error counts as none, and ends the solve."""
        if self.error is None:
            try:
                return violated_rows(self.lazy, self._values(solution), _TOLERANCE)
            except BaseException as error:
                self.error = error
                self.model.interruptSolve()
        return []

    def _values(self, solution: Any) -> NDArray[np.float64]:
        return np.array([self.model.getSolVal(solution, variable) for variable in self.variables])

    def _add(self, rows: Sequence[LazyRow]) -> Any:
        """Add globally valid rows; returns the result that SCIP wants to hear, None if there are none."""
        if any(not len(row.columns) for row in rows):
            return SCIP_RESULT.CUTOFF
        for row in rows:
            entries = zip(row.columns.tolist(), row.coefficients.tolist(), strict=True)
            expression = Expr({self.terms[column]: float(value) for column, value in entries})
            self.model.addCons(ExprCons(expression, None, float(row.rhs)), name=row.kind, removable=True)
        return SCIP_RESULT.CONSADDED if rows else None

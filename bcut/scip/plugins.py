"""Callbacks inside SCIP: the adapter that runs separators, and the observer that records bounds."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyscipopt import SCIP_EVENTTYPE, SCIP_LPSOLSTAT, SCIP_RESULT, SCIP_STAGE, Eventhdlr, Sepa, Variable

from bcut.bounds.root import Round
from bcut.objectives.objective import Objective
from bcut.separation.driver import IntegerCut, Separation


def _lp_is_optimal(model: Any) -> bool:
    """Tell whether there is an LP solution to read; outside the solving stage even asking for its status is an error."""
    return model.getStage() == SCIP_STAGE.SOLVING and model.getLPSolstat() == SCIP_LPSOLSTAT.OPTIMAL


class LpValues:
    """Reads the current LP solution at the original variables.

    Transformed variables are looked up again after every restart, which replaces them.
    """

    def __init__(self, variables: list[Variable]) -> None:
        self.originals = variables
        self.transformed: list[Variable] = []

    def refresh(self, model: Any) -> None:
        """Look the transformed variables up."""
        self.transformed = [model.getTransformedVar(variable) for variable in self.originals]

    def read(self, model: Any) -> NDArray[np.float64]:
        """Return the LP value of every original variable."""
        return np.array([model.getSolVal(None, variable) for variable in self.originals])


class SeparatorAdapter(Sepa):
    """One SCIP separator that runs all of ours, one after the other.

    What a separator raises would be swallowed by SCIP, so it is kept in `error`, the solve is interrupted, and
    the host raises it afterwards.
    """

    def __init__(self, separation: Separation, values: LpValues, max_root_rounds: int, max_tree_rounds: int) -> None:
        self.separation = separation
        self.values = values
        self.max_root_rounds, self.max_tree_rounds = max_root_rounds, max_tree_rounds
        self.error: BaseException | None = None
        self.added_by_family: dict[str, int] = {}
        self._node, self._rounds = -1, 0

    def sepainitsol(self) -> None:
        """Look up the transformed variables: they change with every restart."""
        self.values.refresh(self.model)

    def sepaexeclp(self) -> dict[str, Any]:
        """Separate the LP solution of the current node."""
        try:
            return {"result": self._execute()}
        except BaseException as error:
            self.error = error
            self.model.interruptSolve()
            return {"result": SCIP_RESULT.DIDNOTRUN}

    def _execute(self) -> Any:
        model = self.model
        if not _lp_is_optimal(model) or not self._within_rounds():
            return SCIP_RESULT.DIDNOTRUN
        cuts = self.separation.round(self.values.read(model))
        added = False
        for cut in cuts:
            infeasible = self._add(cut)
            self.separation.confirm(cut)
            self.added_by_family[cut.family] = self.added_by_family.get(cut.family, 0) + 1
            if infeasible:
                return SCIP_RESULT.CUTOFF
            added = True
        return SCIP_RESULT.SEPARATED if added else SCIP_RESULT.DIDNOTFIND

    def _within_rounds(self) -> bool:
        node = self.model.getCurrentNode().getNumber()
        self._rounds = self._rounds + 1 if node == self._node else 1
        self._node = node
        at_root = self.model.getDepth() == 0
        return self._rounds <= (self.max_root_rounds if at_root else self.max_tree_rounds)

    def _add(self, cut: IntegerCut) -> bool:
        """Add one globally valid row; tell whether SCIP found the node infeasible by it."""
        model = self.model
        row = model.createEmptyRowSepa(self, cut.family, lhs=None, rhs=float(cut.rhs), local=False, removable=True)
        model.cacheRowExtensions(row)
        for column, coefficient in zip(cut.columns.tolist(), cut.coefficients.tolist(), strict=True):
            model.addVarToRow(row, self.values.transformed[column], float(coefficient))
        model.flushRowExtensions(row)
        infeasible = model.addCut(row, forcecut=True)
        model.addPoolCut(row)
        model.releaseRow(row)
        return bool(infeasible)


class Observer(Eventhdlr):
    """Records the root LP per round, unrounded, and reports progress."""

    def __init__(
        self,
        objective: Objective,
        values: LpValues,
        adapter: SeparatorAdapter | None,
        on_progress: Callable[[dict[str, Any]], None] | None,
    ) -> None:
        self.costs = objective.costs
        self.values, self.adapter, self.on_progress = values, adapter, on_progress
        self.rounds: list[Round] = []
        self.error: BaseException | None = None
        self._started = time.perf_counter()
        self._counted: dict[str, int] = {}

    def eventinit(self) -> None:
        """Subscribe."""
        self.model.catchEvent(SCIP_EVENTTYPE.LPSOLVED, self)
        self.model.catchEvent(SCIP_EVENTTYPE.GAPUPDATED, self)

    def eventexit(self) -> None:
        """Unsubscribe."""
        self.model.dropEvent(SCIP_EVENTTYPE.LPSOLVED, self)
        self.model.dropEvent(SCIP_EVENTTYPE.GAPUPDATED, self)

    def eventexec(self, event: Any) -> None:
        """Record a root relaxation, or report a new bound or incumbent."""
        try:
            if event.getType() == SCIP_EVENTTYPE.GAPUPDATED:
                self._report()
            elif self.model.getDepth() == 0 and self.model.getNNodes() <= 1:
                self._record()
        except BaseException as error:
            self.error = error
            self.model.interruptSolve()

    def _record(self) -> None:
        model = self.model
        if not _lp_is_optimal(model):
            return
        self._attribute_cuts()
        value = float(self.costs @ self.values.read(model))
        self.rounds.append(Round(value, {}, time.perf_counter() - self._started))
        self._started = time.perf_counter()

    def _attribute_cuts(self) -> None:
        """Credit the cuts added since the last relaxation to that round."""
        if self.adapter is None or not self.rounds:
            return
        now = dict(self.adapter.added_by_family)
        new = {name: count - self._counted.get(name, 0) for name, count in now.items()}
        self._counted = now
        self.rounds[-1].cuts.update({name: count for name, count in new.items() if count})

    def _report(self) -> None:
        if self.on_progress is None:
            return
        model = self.model
        primal, dual = model.getPrimalbound(), model.getDualbound()
        infinity = model.infinity()
        self.on_progress(
            {
                "stage": "tree",
                "value": None if abs(primal) >= infinity else primal,
                "bound": None if abs(dual) >= infinity else dual,
                "nodes": model.getNTotalNodes(),
            }
        )

"""Callbacks inside SCIP: the adapter that runs separators, and the observer that records bounds."""

from __future__ import annotations

import time
from collections.abc import Callable
from math import isclose
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyscipopt import SCIP_EVENTTYPE, SCIP_LPSOLSTAT, SCIP_RESULT, SCIP_STAGE, Eventhdlr, Sepa, Variable

from bcut.bounds.root import Round
from bcut.objectives.objective import Objective
from bcut.scip.root_lp import RootLpWatcher, read_root_lp
from bcut.separation.driver import IntegerCut, Separation

# The first relaxation of a node, and the last one after separation. GAPUPDATED is a mask over other types of
# events.
_LP_EVENTS = (SCIP_EVENTTYPE.FIRSTLPSOLVED, SCIP_EVENTTYPE.LPSOLVED)


def _lp_is_optimal(model: Any) -> bool:
    """Tell whether there is an LP solution to read; outside the solving stage even asking for it is an error."""
    return model.getStage() == SCIP_STAGE.SOLVING and model.getLPSolstat() == SCIP_LPSOLSTAT.OPTIMAL


def _at_root(model: Any) -> bool:
    return model.getDepth() == 0 and model.getNNodes() <= 1


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


class RootRecord:
    """The relaxations of the root, one after the other, unrounded.

    Parameters
    ----------
    objective : Objective
    watch : callable, optional
        Is shown every relaxation of the root as it was solved.
    families : set of str
        Names of our families.
    """

    def __init__(
        self, objective: Objective, watch: RootLpWatcher | None = None, families: set[str] | None = None
    ) -> None:
        self.watch, self.families = watch, families or set()
        self.watching, self.watching_processor = 0.0, 0.0
        self.costs = objective.costs
        self.tolerance = 1e-9 * objective.largest_cost
        self.rounds: list[Round] = []
        self._started = time.perf_counter()

    def add(self, x: NDArray[np.float64], cuts: dict[str, int]) -> None:
        """Record the values of the d-simplices in a relaxation, and the cuts then added, by family.

        SCIP shows the same relaxation more than once; where nothing happened in between, it stays one round.
        """
        value = float(self.costs @ x)
        seconds = time.perf_counter() - self._started
        if (
            self.rounds
            and not self.rounds[-1].cuts
            and isclose(self.rounds[-1].lp, value, abs_tol=self.tolerance)
        ):
            seconds += self.rounds.pop().seconds
        self.rounds.append(Round(value, cuts, seconds))
        self._started = time.perf_counter()

    def show(self, model: Any, values: LpValues, x: NDArray[np.float64]) -> None:
        """Show a relaxation of the root to whoever watches, before anything is added to it."""
        if self.watch is not None:
            started, processor = time.perf_counter(), time.process_time()
            self.watch(read_root_lp(model, values.transformed, x, float(self.costs @ x), self.families))
            # The time that watching takes is no round's.
            spent = time.perf_counter() - started
            self.watching += spent
            self.watching_processor += time.process_time() - processor
            self._started += spent


class SeparatorAdapter(Sepa):
    """One SCIP separator that runs all of ours, one after the other, and records the rounds of the root.

    What a separator raises would be swallowed by SCIP, so it is kept in `error`, the solve is interrupted,
    and the host raises it afterwards.

    Parameters
    ----------
    separation : Separation or None
        None only records.
    values : LpValues
    record : RootRecord
    max_root_rounds, max_tree_rounds : int
        Rounds per node.
    """

    def __init__(
        self,
        separation: Separation | None,
        values: LpValues,
        record: RootRecord,
        max_root_rounds: int,
        max_tree_rounds: int,
    ) -> None:
        self.separation = separation
        self.values, self.record = values, record
        self.max_root_rounds, self.max_tree_rounds = max_root_rounds, max_tree_rounds
        self.error: BaseException | None = None
        self._node, self._rounds = -1, 0

    def sepainitsol(self) -> None:
        """Look up the transformed variables: they change with every restart."""
        self.values.refresh(self.model)

    def sepaexeclp(self) -> dict[str, Any]:
        """Separate the LP solution of the current node."""
        # After an error SCIP may ask once more before it notices the interrupt; the first error is the one to
        # report.
        if self.error is None:
            try:
                return {"result": self._execute()}
            except BaseException as error:
                self.error = error
                self.model.interruptSolve()
        return {"result": SCIP_RESULT.DIDNOTRUN}

    def _execute(self) -> Any:
        model = self.model
        if not _lp_is_optimal(model):
            return SCIP_RESULT.DIDNOTRUN
        x = self.values.read(model)
        if _at_root(model):
            self.record.show(model, self.values, x)
        counts: dict[str, int] = {}
        result = self._separate(x, counts) if self._within_rounds() else SCIP_RESULT.DIDNOTRUN
        if _at_root(model):
            self.record.add(x, counts)
        return result

    def _separate(self, x: NDArray[np.float64], counts: dict[str, int]) -> Any:
        """Add the cuts for a point; counts them by family."""
        assert self.separation is not None
        self.separation.relaxed(float(self.record.costs @ x), node=self._node)
        for cut in self.separation.round(x):
            infeasible = self._add(cut)
            self.separation.confirm(cut)
            counts[cut.family] = counts.get(cut.family, 0) + 1
            if infeasible:
                return SCIP_RESULT.CUTOFF
        return SCIP_RESULT.SEPARATED if counts else SCIP_RESULT.DIDNOTFIND

    def _within_rounds(self) -> bool:
        if self.separation is None:
            return False
        node = self.model.getCurrentNode().getNumber()
        self._rounds = self._rounds + 1 if node == self._node else 1
        self._node = node
        return self._rounds <= (self.max_root_rounds if self.model.getDepth() == 0 else self.max_tree_rounds)

    def _add(self, cut: IntegerCut) -> bool:
        """Add one globally valid row; tell whether SCIP found the node infeasible by it."""
        model = self.model
        row = model.createEmptyRowSepa(
            self, cut.family, lhs=None, rhs=float(cut.rhs), local=False, removable=True
        )
        model.cacheRowExtensions(row)
        for column, coefficient in zip(cut.columns.tolist(), cut.coefficients.tolist(), strict=True):
            model.addVarToRow(row, self.values.transformed[column], float(coefficient))
        model.flushRowExtensions(row)
        infeasible = model.addCut(row, forcecut=True)
        model.addPoolCut(row)
        model.releaseRow(row)
        return bool(infeasible)


class Observer(Eventhdlr):
    """Records the first and the last relaxation of the root, and reports progress."""

    def __init__(
        self,
        values: LpValues,
        record: RootRecord,
        on_progress: Callable[[dict[str, Any]], None] | None,
        unit: float,
        separation: Separation | None = None,
    ) -> None:
        self.values, self.record, self.on_progress, self.unit = values, record, on_progress, unit
        self.separation = separation
        self.error: BaseException | None = None

    def eventinit(self) -> None:
        """Subscribe."""
        for kind in (*_LP_EVENTS, SCIP_EVENTTYPE.GAPUPDATED):
            self.model.catchEvent(kind, self)

    def eventexit(self) -> None:
        """Unsubscribe."""
        for kind in (*_LP_EVENTS, SCIP_EVENTTYPE.GAPUPDATED):
            self.model.dropEvent(kind, self)

    def eventexec(self, event: Any) -> None:
        """Record a root relaxation, or report a new bound or incumbent."""
        if self.error is not None:
            return
        try:
            if event.getType() not in _LP_EVENTS:
                self._report()
            elif _lp_is_optimal(self.model):
                self._relaxed()
        except BaseException as error:
            self.error = error
            self.model.interruptSolve()

    def _relaxed(self) -> None:
        model = self.model
        if _at_root(model):
            x = self.values.read(model)
            self.record.show(model, self.values, x)
            self.record.add(x, {})
            value = float(self.record.costs @ x)
        else:
            value = model.getLPObjVal() * self.unit
        if self.separation is not None:
            self.separation.relaxed(value, node=model.getCurrentNode().getNumber())

    def _report(self) -> None:
        if self.on_progress is None:
            return
        model = self.model
        dual = model.getDualbound()
        # The primal bound would be a cutoff's, where no solution is known yet.
        best = model.getBestSol() if model.getNSols() else None
        self.on_progress(
            {
                "stage": "tree",
                "value": None if best is None else model.getSolObjVal(best) * self.unit,
                "bound": None if abs(dual) >= model.infinity() else dual * self.unit,
                "nodes": model.getNTotalNodes(),
            }
        )

"""The plain cutting-plane loop: linear relaxation, separators, and again; no branching, none of a solver's own cuts."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.infeasibility import bound_beyond
from bcut.bounds.relaxation import InfeasibleRelaxationError, Relaxation, RelaxationPoint
from bcut.bounds.safe import SafeBound
from bcut.formulations.formulation import Formulation
from bcut.objectives.objective import Objective
from bcut.separation.driver import IntegerCut, Separation

# With a target, fixed columns leave the relaxation when no more than this share remains.
_SHRINK = 0.75
# Cuts that have been slack for this many rounds leave the relaxation.
_ROUNDS_SLACK = 4
_SLACK = 1e-7


@dataclass(frozen=True)
class Round:
    """One solved relaxation: its value, and the cuts that were then added, by family."""

    lp: float
    cuts: dict[str, int]
    seconds: float = 0.0


@dataclass(frozen=True)
class RootLimits:
    """When the loop stops before the separators run dry.

    Attributes
    ----------
    rounds : int
        Relaxations with cuts, at most.
    stall_rounds : int
        Stop after this many rounds in a row that moved the bound by less than `stall`, relative to the bound
        or to the largest cost, whichever is larger.
    stall : float
    deadline : float, optional
        Value of `time.monotonic`.
    target : Fraction, optional
        Only solutions with ``sign * objective <= target`` matter: columns that no such solution can use leave
        the relaxation, and the loop stops as soon as the bound is proven to exceed it.
    goal : Fraction, optional
        The loop stops as soon as the bound is proven to reach this, as good a bound as is of use.
    """

    rounds: int = 1000
    stall_rounds: int = 30
    stall: float = 1e-6
    deadline: float | None = None
    target: Fraction | None = None
    goal: Fraction | None = None

    def are_met_by(self, bound: Fraction) -> bool:
        """Tell whether a better bound would be of no use."""
        beyond = self.target is not None and bound > self.target
        return beyond or (self.goal is not None and bound >= self.goal)


@dataclass(frozen=True, eq=False)
class Stage:
    """One step of a proof that nothing reaches a target: a bound on some columns, with cuts.

    Of these columns, only those whose reduced costs the bound leaves within the target matter in the next step. The
    last step's bound exceeds the target.

    Attributes
    ----------
    formulation : Formulation
        On the columns of the step.
    bound : SafeBound
        Multipliers of its rows, then of the cuts.
    cuts : tuple of IntegerCut
    """

    formulation: Formulation
    bound: SafeBound
    cuts: tuple[IntegerCut, ...]


@dataclass
class RootBound:
    """What the loop found.

    Attributes
    ----------
    status : {"integral", "dry", "stalled", "limit", "target", "infeasible", "interrupted"}
        Why it ended: an integral point, no more violated cuts, no progress, a limit, a bound beyond the
        target or at the goal, or no point at all. "interrupted" stands for what is known at a relaxation while the
        loop goes on, and remains should anything interrupt it.
    lp, lp_after_cuts : float or None
        LP values before and after cuts, unrounded; None where none was found in time.
    rounds : list of Round
    first, last : SafeBound or None
        Exact bounds proven by the duals of the first and of the best relaxation (the latter with its cuts).
    point : ndarray of float or None
        The last relaxation point.
    columns : ndarray of int
        The columns of the given formulation that the last relaxation still had; fewer than all only with a
        target.
    cuts : list of IntegerCut
        The cuts in the last relaxation, over `columns`.
    separation : Separation or None
        The separators, at work on `columns`.
    stages : list of Stage
        With a target that turned out to be out of reach: the proof, if the relaxations make one.
    """

    columns: NDArray[np.intp]
    separation: Separation | None = None

    status: Literal["integral", "dry", "stalled", "limit", "target", "infeasible", "interrupted"] = "limit"
    lp: float | None = None
    lp_after_cuts: float | None = None
    rounds: list[Round] = field(default_factory=list)
    first: SafeBound | None = None
    last: SafeBound | None = None
    point: NDArray[np.float64] | None = None
    cuts: list[IntegerCut] = field(default_factory=list)
    stages: list[Stage] = field(default_factory=list)


class _Loop:
    def __init__(
        self,
        formulation: Formulation,
        objective: Objective,
        separation: Separation | None,
        limits: RootLimits,
        on_round: Callable[[Round], None] | None,
        on_relaxed: Callable[[RootBound], None] | None,
        cuts: Sequence[IntegerCut],
    ) -> None:
        self.relaxation = Relaxation(formulation, objective, deadline=limits.deadline)
        self.relaxation.add(cuts)
        self.limits, self.on_round, self.on_relaxed = limits, on_round, on_relaxed
        self.result = RootBound(np.arange(len(formulation.simplices)), separation)
        self.slack_for: dict[tuple[bytes, bytes, int], int] = {}
        self.stalled = 0
        self.best: Stage | None = None

    def run(self) -> RootBound:
        result = self.result
        try:
            while self._step():
                pass
        except InfeasibleRelaxationError:
            result.status = "infeasible"
            self.best = self._infeasible_stage()
        self._finish_proof()
        result.cuts = list(self.relaxation.cuts)
        return result

    def _step(self) -> bool:
        """Solve, record, separate; tell whether to go on."""
        started = time.perf_counter()
        point = self._solve()
        if point is None:
            self.result.status = "limit"
            return False
        self._record(point, started)
        cuts = self._separate(point)
        counts: dict[str, int] = {}
        for cut in cuts:
            counts[cut.family] = counts.get(cut.family, 0) + 1
        self._finish_round(Round(point.value, counts, time.perf_counter() - started))
        if not cuts:
            return False
        self._drop_slack(point)
        self.relaxation.add(cuts)
        self._shrink()
        return True

    def _solve(self) -> RelaxationPoint | None:
        """Solve the relaxation with all rows of the formulation, also those that are written when they are needed."""
        while True:
            point = self.relaxation.solve()
            rows = [] if point is None else self.relaxation.missing_rows(point)
            if not rows:
                return point
            self.relaxation.add(rows)

    def _record(self, point: RelaxationPoint, started: float) -> None:
        result = self.result
        previous = result.lp_after_cuts
        result.point, result.lp_after_cuts = point.x, point.value
        if result.separation is not None:
            result.separation.relaxed(point.value)
        bound = self.relaxation.safe_bound(point.duals)
        if result.first is None:
            result.first, result.lp = bound, point.value
        if result.last is None or bound.value >= result.last.value:
            result.last = bound
            self.best = Stage(self.relaxation.formulation, bound, tuple(self.relaxation.cuts))
        if self.on_relaxed is not None:
            self.on_relaxed(self._known(Round(point.value, {}, time.perf_counter() - started)))
        size = self.relaxation.objective.largest_cost
        moved = previous is None or abs(point.value - previous) > self.limits.stall * max(size, abs(previous))
        self.stalled = 0 if moved else self.stalled + 1

    def _known(self, last: Round) -> RootBound:
        """Return what is known at a relaxation, apart from what the loop goes on to change."""
        result = self.result
        return replace(
            result,
            status="interrupted",
            rounds=[*result.rounds, last],
            cuts=list(self.relaxation.cuts),
            stages=[],
        )

    def _separate(self, point: RelaxationPoint) -> list[IntegerCut]:
        """Return new cuts; none when the loop should end, with the reason in the result's status."""
        result, limits = self.result, self.limits
        if np.minimum(point.x, 1 - point.x).max(initial=0.0) <= 1e-6:
            result.status = "integral"
        elif result.last is not None and limits.are_met_by(result.last.value):
            result.status = "target"
        elif self.stalled >= limits.stall_rounds:
            result.status = "stalled"
        elif result.separation is None or not result.separation.separators:
            result.status = "dry"
        elif len(result.rounds) >= limits.rounds:
            result.status = "limit"
        else:
            cuts = result.separation.round(point.x)
            for cut in cuts:
                result.separation.confirm(cut)
            if not cuts:
                result.status = "limit" if result.separation.cut_short else "dry"
            return cuts
        return []

    def _finish_round(self, finished: Round) -> None:
        self.result.rounds.append(finished)
        if self.on_round is not None:
            self.on_round(finished)

    def _drop_slack(self, point: RelaxationPoint) -> None:
        """Drop cuts that have been slack for some rounds: they only slow the relaxation down."""
        separation = self.result.separation
        assert separation is not None
        leaving = []
        for position, (cut, slack) in enumerate(zip(self.relaxation.cuts, point.slack, strict=True)):
            age = self.slack_for.get(cut.key, 0) + 1 if slack > _SLACK else 0
            self.slack_for[cut.key] = age
            if age >= _ROUNDS_SLACK:
                leaving.append(position)
        for cut in self.relaxation.drop(leaving):
            if cut.family in separation.statistics:
                separation.forget(cut)
            del self.slack_for[cut.key]

    def _shrink(self) -> None:
        """Fix the columns that no solution within the target can use, once enough of them have come together."""
        result = self.result
        if self.limits.target is None or result.last is None or result.separation is None:
            return
        keep = result.last.columns_within(self.limits.target)
        if len(keep) > _SHRINK * len(result.columns):
            return
        assert self.best is not None
        result.stages.append(self.best)
        self.relaxation = self.relaxation.restricted_to(keep)
        self.slack_for = {}
        result.separation = result.separation.restricted_to(keep)
        result.columns = result.columns[keep]
        result.point = None if result.point is None else result.point[keep]
        result.last = result.last.restricted_to(keep)

    def _infeasible_stage(self) -> Stage | None:
        """Return multipliers that prove an infeasible relaxation to be beyond the target."""
        target = self.limits.target
        if target is None:
            return None
        bound = bound_beyond(self.relaxation, target)
        return (
            None if bound is None else Stage(self.relaxation.formulation, bound, tuple(self.relaxation.cuts))
        )

    def _finish_proof(self) -> None:
        """Keep the stages only where the last one proves the target to be out of reach."""
        target, stages = self.limits.target, self.result.stages
        if target is not None and self.best is not None and self.best.bound.value > target:
            stages.append(self.best)
        else:
            stages.clear()


def root_bound(
    formulation: Formulation,
    objective: Objective,
    separation: Separation | None = None,
    *,
    limits: RootLimits | None = None,
    on_round: Callable[[Round], None] | None = None,
    on_relaxed: Callable[[RootBound], None] | None = None,
    cuts: Sequence[IntegerCut] = (),
) -> RootBound:
    """Bound the optimum by the linear relaxation and cuts.

    Parameters
    ----------
    formulation : Formulation
    objective : Objective
    separation : Separation, optional
        Separators at work; none gives the LP bound.
    limits : RootLimits, optional
    on_round : callable, optional
        Told of every finished round.
    on_relaxed : callable, optional
        Handed what is known when a relaxation is solved, before it is separated: separators may take long, fail, or
        be interrupted. It is about this relaxation, with its cuts, and what follows does not change it: whoever keeps
        the last one has what is to be had when the loop is ended from outside.
    cuts : sequence of IntegerCut
        Known already: they are in the relaxation from the start.

    Returns
    -------
    RootBound
        Never "interrupted".

    Raises
    ------
    KeyboardInterrupt
        After Ctrl-C, or at a limit on the whole process: see `on_relaxed`.
    """
    return _Loop(formulation, objective, separation, limits or RootLimits(), on_round, on_relaxed, cuts).run()

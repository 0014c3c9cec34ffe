"""What a run does: the presets of plans, each a way to work on one problem.

Each imports the solver that it uses; before any of them, PySCIPOpt has been loaded to tell SCIP's version.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from fractions import Fraction
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from bcut.errors import InputError
from bcut.experiments.interruption import RootWatcher
from bcut.experiments.ledger import LedgerWriter
from bcut.experiments.measuring import delaunay, measured_at
from bcut.experiments.outcome import RunOutcome
from bcut.experiments.recording import Recorder
from bcut.experiments.scip_names import DEFAULT, named
from bcut.solving.memory import Watch, watched

if TYPE_CHECKING:
    from bcut.bounds.root import RootBound

Found = TypeVar("Found")


class Run:
    """One run: the problem, and the ways to work on it.

    Parameters
    ----------
    task : mapping
        `bcut.experiments.tasks.Task.data`.

    Attributes
    ----------
    recorder : Recorder or None
        Of the cuts, where a ledger is kept.
    ledger : bytes or None
        The file of the cuts, when the run has ended.
    """

    def __init__(self, task: Mapping[str, Any]) -> None:
        from bcut.geometry.configuration import PointConfiguration

        self.task, self.problem, self.settings = task, task["problem"], task["settings"]
        self.configuration = PointConfiguration.from_values(
            task["instance"]["points"], name=task["instance"]["name"]
        )
        self.started, self.processor = time.perf_counter(), time.process_time()
        self.recorder: Recorder | None = None
        self.ledger: bytes | None = None
        self.triangulation: list[list[int]] | None = None
        limit = self.settings["time_limit"]
        self.deadline = None if limit is None else time.monotonic() + limit
        self.formulation: Any = None
        self.separation: Any = None
        self.bounded: RootBound | None = None
        self.solving = 0.0
        self.watch = Watch()

    def outcome(self) -> RunOutcome:
        """Do what the preset asks for."""
        presets = {
            "loop": self.loop, "root": self.root, "solve": self.solve, "plain": self.plain, "sizes": self.sizes,
            "delaunay": self.delaunay,
        }  # fmt: skip
        outcome = presets[self.settings["preset"]]()
        if self.formulation is not None:
            matrix = self.formulation.matrix
            outcome.columns = len(self.formulation.simplices)
            outcome.rows, outcome.nonzeros = matrix.shape[0], int(matrix.nnz)
        return outcome

    def loop(self) -> RunOutcome:
        """Run the cutting-plane loop in HiGHS."""
        from bcut.bounds.root import RootBound, RootLimits, root_bound

        if self.settings["method"] != "listing":
            return self._by_bound()

        def keep(found: RootBound) -> None:
            spent = sum(finished.seconds for finished in found.rounds)
            self.bounded, self.solving = found, spent - _separating(self._families())

        def work() -> None:
            objective = self._begin()
            target = None
            if self.problem["cutoff"] is not None:
                target = objective.sign * Fraction(self.problem["cutoff"])
            limits = RootLimits(deadline=self.deadline, target=target)
            keep(root_bound(self.formulation, objective, self.separation, limits=limits, on_relaxed=keep))

        self._within_limit(work)
        written = self.formulation is not None
        found = self.bounded or RootBound(np.arange(len(self.formulation.simplices) if written else 0))
        own = self._families()
        self._finish_ledger(lambda recorder: recorder.finish_loop(found))
        return RunOutcome(
            status="limit" if found.status == "interrupted" else found.status,
            lp=found.lp,
            lp_after_cuts=found.lp_after_cuts,
            integral=found.status == "integral",
            bound=found.lp_after_cuts,
            rounds=[(finished.lp, finished.cuts) for finished in found.rounds],
            columns_after_fixing=len(found.columns) if written else None,
            separators=own,
            seconds=self._seconds(lp=self.solving - self._recording, own=own),
        )

    def root(self) -> RunOutcome:
        """Run SCIP's root node under clean conditions."""
        from bcut.scip.host import TreeOptions, branch_and_cut

        limited, unlimited = named(tuple(self.settings["scip"]))

        def work() -> Any:
            objective = self._begin(watcher)
            options = TreeOptions(
                seconds=self._seconds_left(),
                nodes=1,
                seed=self.settings["seed"],
                cutoff=self._cutoff(objective),
                scip_separators=DEFAULT in self.settings["scip"],
                named=limited,
                unlimited=unlimited,
                presolve=False,
                heuristics=False,
                statistics=True,
            )
            show = None if self.recorder is None else self.recorder.root_lp
            tree = branch_and_cut(
                self.formulation, objective, self.separation, options=options, on_root_lp=show
            )
            return tree, objective

        watcher = RootWatcher(self.watch)
        with watcher.at_work():
            found = self._within_limit(work)
        self._finish_ledger(lambda recorder: recorder.finish_scip())
        if found is None:
            return self._unfinished(watcher)
        tree, objective = found
        outcome = self._of_tree(tree, objective, self._families())
        # By its point, or by rounding: see `RunOutcome`. The point itself is not at hand.
        outcome.integral = tree.status == "optimal"
        return outcome

    def plain(self) -> RunOutcome:
        """Leave the exported model to SCIP and its defaults."""
        from bcut.scip.host import TreeOptions, branch_and_cut

        def work() -> Any:
            self.formulation, objective = self._program()
            options = TreeOptions(
                seconds=self._seconds_left(), seed=self.settings["seed"], plain=True, statistics=True
            )
            return branch_and_cut(self.formulation, objective, None, options=options), objective

        found = self._within_limit(work)
        if found is None:
            return self._unfinished(RootWatcher(self.watch))
        tree, objective = found
        return self._of_tree(tree, objective, {})

    def solve(self) -> RunOutcome:
        """Solve as ``bcut solve`` does."""
        from bcut.solving.api import solve

        self._record(None)
        result = solve(
            self.configuration,
            objective=self.problem["objective"],
            sense=self.problem["sense"],
            formulation=self.problem["formulation"],
            spanning=self.problem["spanning"],
            separators=self.settings["separators"],
            time_limit=self.settings["time_limit"],
            seed=self.settings["seed"],
            method=self.settings["method"],
            cut_observer=self.recorder,
        )
        if self.recorder is not None:
            self.ledger = self.recorder.finish()
        self.triangulation = result.triangulation
        return self._of_result(result)

    def delaunay(self) -> RunOutcome:
        """Take the Delaunay triangulation, which has a value and no bound."""
        self.triangulation, value = delaunay(
            self.configuration, self.problem["objective"], self.problem["sense"]
        )
        return RunOutcome(status="verified", value=value, seconds=self._seconds())

    def measured(self) -> dict[str, Any]:
        """Return the triangulation and its measures, where measures are asked for."""
        wanted, found = self.task["measures"], self.triangulation
        if not wanted:
            return {}
        values = {} if found is None else measured_at(self.configuration, found, wanted)
        return {"triangulation": found, "measures": values}

    def sizes(self) -> RunOutcome:
        """Count columns, rows and nonzeros, and solve nothing."""
        from bcut.experiments.sizes import full_size

        found = full_size(
            self._formulation_name(),
            self.configuration,
            spanning=self.problem["spanning"],
            deadline=self.deadline,
        )
        seconds = self._seconds()
        if found is None:
            return RunOutcome(status="limit", seconds=seconds)
        return RunOutcome(
            status="counted",
            columns=found.columns,
            rows=found.rows,
            nonzeros=found.nonzeros,
            kinds=found.kinds,
            seconds=seconds,
        )

    def _by_bound(self) -> RunOutcome:
        """Run the loop over orbits, or over the columns that multipliers leave."""
        from bcut.solving.api import bound

        result = bound(
            self.configuration,
            objective=self.problem["objective"],
            sense=self.problem["sense"],
            spanning=self.problem["spanning"],
            separators=self.settings["separators"],
            time_limit=self.settings["time_limit"],
            method=self.settings["method"],
        )
        return self._of_result(result)

    # What several of them share.

    def _within_limit(self, work: Callable[[], Found]) -> Found | None:
        """Do the work; None where the time limit comes in the midst of what does not look at it, as a separator."""
        try:
            with watched(self.watch, memory=None, deadline=self.deadline):
                return work()
        except KeyboardInterrupt:
            if not self.watch.reached:
                raise
            return None

    def _begin(self, watcher: RootWatcher | None = None) -> Any:
        """Write the program, and put recorder and separators to work on it; returns the objective."""
        self.formulation, objective = self._program()
        self._record(self.formulation)
        observer: Any = self.recorder
        if watcher is not None:
            watcher.recorder, observer = self.recorder, watcher
        self.separation = self._separation(self.formulation, observer)
        return objective

    def _finish_ledger(self, finish: Callable[[Recorder], bytes]) -> None:
        if self.recorder is not None and not self.recorder.torn:
            self.ledger = finish(self.recorder)

    def _unfinished(self, watcher: RootWatcher) -> RunOutcome:
        """Return what is known of SCIP's root where SCIP could not be heard."""
        lps = [lp for lp, _ in watcher.rounds]
        own = self._families()
        return RunOutcome(
            status="limit",
            lp=lps[0] if lps else None,
            lp_after_cuts=lps[-1] if lps else None,
            integral=False if self.settings["preset"] == "root" else None,
            bound=lps[-1] if lps else None,
            nodes=1 if lps else 0,
            rounds=list(watcher.rounds),
            separators=own,
            seconds=self._seconds(own=own),
        )

    def _program(self) -> tuple[Any, Any]:
        from bcut.objectives.objective import Bottleneck, make_objective
        from bcut.solving.programs import make_formulation

        name = self._formulation_name()
        formulation = make_formulation(name, self.configuration, spanning=self.problem["spanning"])
        objective = make_objective(self.problem["objective"], formulation, sense=self.problem["sense"])
        if isinstance(objective, Bottleneck):
            raise InputError(
                f"objective '{self.problem['objective']}' has no root relaxation of its own: it is settled by a row of "
                "them; take preset 'solve'"
            )
        return formulation, objective

    def _formulation_name(self) -> str:
        from bcut.solving.programs import formulation_name

        return formulation_name(self.problem["formulation"], dissection=False)

    def _record(self, formulation: Any) -> None:
        # In other formulations cuts may speak of more than d-simplices.
        if self.settings["ledger"] and self.problem["formulation"] == "2":
            header = {"instance": self.task["instance"], "problem": self.problem, "settings": self.settings}
            self.recorder = Recorder(LedgerWriter(header), formulation)

    def _separation(self, formulation: Any, observer: Any) -> Any:
        from bcut.separation.driver import Separation
        from bcut.separation.resolve import resolve
        from bcut.separation.seam import Problem

        separators = [resolve(text) for text in self.settings["separators"]]
        # Without separators too: the observer hears of relaxations through it.
        return Separation(separators, Problem(formulation), observer=observer)

    def _families(self) -> dict[str, Any]:
        if self.separation is None:
            return {}
        return {name: asdict(family) for name, family in self.separation.statistics.items()}

    def _seconds_left(self) -> float | None:
        return None if self.deadline is None else max(0.0, self.deadline - time.monotonic())

    def _cutoff(self, objective: Any) -> float | None:
        """Return a cutoff that optimal solutions stay below, and no worse ones where values are multiples of a unit."""
        if self.problem["cutoff"] is None:
            return None
        optimum = Fraction(self.problem["cutoff"])
        room = objective.unit / 2 if objective.counts_units else max(Fraction(1), abs(optimum)) / 10**6
        return float(optimum + objective.sign * room)

    @property
    def _recording(self) -> float:
        """Seconds that recording took, which are no part of the time of the run."""
        return 0.0 if self.recorder is None else self.recorder.seconds

    def _seconds(
        self,
        *,
        lp: float = 0.0,
        own: Mapping[str, Any] | None = None,
        aside: tuple[float, float] = (0.0, 0.0),
    ) -> dict[str, float]:
        # Recording is no part of the run, nor is what was set aside, as wall and as processor time.
        recording = 0.0 if self.recorder is None else self.recorder.processor
        return {
            "total": max(0.0, time.perf_counter() - self.started - self._recording - aside[0]),
            "processor": max(0.0, time.process_time() - self.processor - recording - aside[1]),
            "lp": max(0.0, lp),
            "separation": _separating(own or {}),
        }

    def _of_tree(self, tree: Any, objective: Any, own: dict[str, Any]) -> RunOutcome:
        assert tree.solver is not None
        if tree.columns is not None:
            self.triangulation = self.formulation.simplices[sorted(tree.columns)].tolist()
        theirs = {f"scip:{name}": asdict(entry) for name, entry in tree.solver.separators.items()}
        every = {**own, **theirs}
        lps = [finished.lp for finished in tree.rounds]
        return RunOutcome(
            status="limit" if self.watch.reached and tree.status == "interrupted" else tree.status,
            lp=lps[0] if lps else None,
            lp_after_cuts=lps[-1] if lps else None,
            value=None if tree.columns is None else float(objective.value(tree.columns)),
            bound=tree.bound,
            nodes=tree.nodes,
            rounds=[(finished.lp, finished.cuts) for finished in tree.rounds],
            separators=every,
            seconds=self._seconds(
                lp=tree.solver.lp_seconds, own=every, aside=(tree.watching, tree.watching_processor)
            ),
        )

    def _of_result(self, result: Any) -> RunOutcome:
        own = result.separators
        lp = result.seconds.get("root", 0.0) - _separating(own)
        return RunOutcome.of_result(result, self._seconds(lp=lp, own=own))


def _separating(families: Mapping[str, Any]) -> float:
    return sum(entry["seconds"] for entry in families.values())

"""What a run does: the presets of plans, each a way to work on one problem.

Each imports the solver that it uses; before any of them, PySCIPOpt has been loaded to tell SCIP's version.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict
from fractions import Fraction
from typing import Any

from bcut.errors import InputError
from bcut.experiments.ledger import LedgerWriter
from bcut.experiments.measuring import delaunay, measured_at
from bcut.experiments.recording import Recorder
from bcut.experiments.scip_names import DEFAULT, named


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

    def outcome(self) -> dict[str, Any]:
        """Do what the preset asks for; returns what came out, as plain data.

        In it, ``integral`` says whether the root settled the problem, as the preset can tell. Our loop, and ``bcut
        solve``: the point of the last relaxation at the root is a triangulation. SCIP's root: SCIP proved optimality
        there, which it may do by rounding its bound, while the last relaxation's point is still fractional. None
        where the root is not looked at.
        """
        presets = {
            "loop": self.loop, "root": self.root, "solve": self.solve, "plain": self.plain, "sizes": self.sizes,
            "delaunay": self.delaunay,
        }  # fmt: skip
        return presets[self.settings["preset"]]()

    def loop(self) -> dict[str, Any]:
        """Run the cutting-plane loop in HiGHS."""
        from bcut.bounds.root import RootLimits, root_bound

        if self.settings["method"] != "listing":
            return self._by_bound()
        formulation, objective = self._program()
        self._record(formulation)
        separation = self._separation(formulation)
        target = None
        if self.problem["cutoff"] is not None:
            target = objective.sign * Fraction(self.problem["cutoff"])
        limits = RootLimits(deadline=self._deadline(), target=target)
        found = root_bound(formulation, objective, separation, limits=limits)
        if self.recorder is not None:
            self.ledger = self.recorder.finish_loop(found)
        own = self._families(separation)
        spent = sum(finished.seconds for finished in found.rounds)
        return {
            "status": found.status,
            "lp": found.lp,
            "lp_after_cuts": found.lp_after_cuts,
            "integral": found.status == "integral",
            "value": None,
            "bound": found.lp_after_cuts,
            "nodes": 0,
            "rounds": [[finished.lp, finished.cuts] for finished in found.rounds],
            **self._size(formulation),
            "columns_after_fixing": len(found.columns),
            "separators": own,
            "seconds": self._seconds(
                lp=spent - self._recording - sum(entry["seconds"] for entry in own.values()), own=own
            ),
        }

    def root(self) -> dict[str, Any]:
        """Run SCIP's root node under clean conditions."""
        from bcut.scip.host import TreeOptions, branch_and_cut

        formulation, objective = self._program()
        self._record(formulation)
        separation = self._separation(formulation)
        limited, unlimited = named(tuple(self.settings["scip"]))
        options = TreeOptions(
            seconds=self.settings["time_limit"],
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
        watch = None if self.recorder is None else self.recorder.root_lp
        tree = branch_and_cut(formulation, objective, separation, options=options, on_root_lp=watch)
        if self.recorder is not None:
            self.ledger = self.recorder.finish_scip()
        lps = [finished.lp for finished in tree.rounds]
        return {
            "lp": lps[0] if lps else None,
            "lp_after_cuts": lps[-1] if lps else None,
            # By its point, or by rounding: see `outcome`. The point itself is not at hand.
            "integral": tree.status == "optimal",
            **self._of_tree(tree, objective, formulation, self._families(separation)),
        }

    def plain(self) -> dict[str, Any]:
        """Leave the exported model to SCIP and its defaults."""
        from bcut.scip.host import TreeOptions, branch_and_cut

        formulation, objective = self._program()
        options = TreeOptions(
            seconds=self.settings["time_limit"], seed=self.settings["seed"], plain=True, statistics=True
        )
        tree = branch_and_cut(formulation, objective, None, options=options)
        lps = [finished.lp for finished in tree.rounds]
        return {
            "lp": lps[0] if lps else None,
            "lp_after_cuts": lps[-1] if lps else None,
            "integral": None,
            **self._of_tree(tree, objective, formulation, {}),
        }

    def solve(self) -> dict[str, Any]:
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

    def delaunay(self) -> dict[str, Any]:
        """Take the Delaunay triangulation, which has a value and no bound."""
        self.triangulation, found = delaunay(
            self.configuration, self.problem["objective"], self.problem["sense"]
        )
        return {**found, "seconds": self._seconds(lp=0.0, own={})}

    def measured(self) -> dict[str, Any]:
        """Return the triangulation and its measures, where measures are asked for."""
        wanted, found = self.task["measures"], self.triangulation
        if not wanted:
            return {}
        values = {} if found is None else measured_at(self.configuration, found, wanted)
        return {"triangulation": found, "measures": values}

    def sizes(self) -> dict[str, Any]:
        """Count columns, rows and nonzeros, and solve nothing."""
        from bcut.experiments.sizes import count

        counted = count(
            self._formulation_name(), self.configuration, self.problem["spanning"], self._deadline()
        )
        return {**counted, "seconds": self._seconds(lp=0.0, own={})}

    def _by_bound(self) -> dict[str, Any]:
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

    def _size(self, formulation: Any) -> dict[str, int]:
        """Return the size of the program as it was written: without rows that are added where they are violated."""
        return {
            "columns": len(formulation.simplices),
            "rows": formulation.matrix.shape[0],
            "nonzeros": int(formulation.matrix.nnz),
        }

    def _record(self, formulation: Any) -> None:
        # In other formulations cuts may speak of more than d-simplices.
        if self.settings["ledger"] and self.problem["formulation"] == "2":
            header = {"instance": self.task["instance"], "problem": self.problem, "settings": self.settings}
            self.recorder = Recorder(LedgerWriter(header), formulation)

    def _separation(self, formulation: Any) -> Any:
        from bcut.separation.driver import Separation
        from bcut.separation.resolve import resolve
        from bcut.separation.seam import Problem

        separators = [resolve(text) for text in self.settings["separators"]]
        # Without separators too: the observer hears of relaxations through it.
        return Separation(separators, Problem(formulation), observer=self.recorder)

    def _families(self, separation: Any) -> dict[str, Any]:
        return {name: asdict(family) for name, family in separation.statistics.items()}

    def _deadline(self) -> float | None:
        limit = self.settings["time_limit"]
        return None if limit is None else time.monotonic() + limit

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
        self, *, lp: float, own: Mapping[str, Any], aside: tuple[float, float] = (0.0, 0.0)
    ) -> dict[str, float]:
        # Recording is no part of the run, nor is what was set aside, as wall and as processor time.
        recording = 0.0 if self.recorder is None else self.recorder.processor
        return {
            "total": time.perf_counter() - self.started - self._recording - aside[0],
            "processor": time.process_time() - self.processor - recording - aside[1],
            "lp": max(0.0, lp),
            "separation": sum(entry["seconds"] for entry in own.values()),
        }

    def _of_tree(self, tree: Any, objective: Any, formulation: Any, own: dict[str, Any]) -> dict[str, Any]:
        assert tree.solver is not None
        if tree.columns is not None:
            self.triangulation = formulation.simplices[sorted(tree.columns)].tolist()
        theirs = {f"scip:{name}": asdict(entry) for name, entry in tree.solver.separators.items()}
        return {
            "status": tree.status,
            "value": None if tree.columns is None else float(objective.value(tree.columns)),
            "bound": tree.bound,
            "nodes": tree.nodes,
            "rounds": [[finished.lp, finished.cuts] for finished in tree.rounds],
            **self._size(formulation),
            "columns_after_fixing": None,
            "separators": {**own, **theirs},
            "seconds": self._seconds(
                lp=tree.solver.lp_seconds,
                own={**own, **theirs},
                aside=(tree.watching, tree.watching_processor),
            ),
        }

    def _of_result(self, result: Any) -> dict[str, Any]:
        own = result.separators
        in_root = result.seconds.get("root", 0.0)
        return {
            "status": result.status,
            "lp": result.root.lp,
            "lp_after_cuts": result.root.lp_after_cuts,
            "integral": result.root.integral,
            "value": result.value,
            "bound": result.bound,
            "nodes": result.nodes,
            "rounds": [[entry.lp, entry.cuts] for entry in result.root.rounds],
            "columns": result.size.columns,
            "rows": result.size.rows,
            "nonzeros": None,
            "columns_after_fixing": result.size.columns_after_fixing,
            "separators": own,
            "seconds": self._seconds(lp=in_root - sum(entry["seconds"] for entry in own.values()), own=own),
            "stages": result.seconds,
        }

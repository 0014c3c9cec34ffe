"""Running a plan: what is stored is skipped, what ends is stored at once, and what fails fails alone.

Runs that contradict each other about an optimum have failed too, though they are stored.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Set
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from bcut.experiments.plan import Plan, read_plan
from bcut.experiments.pools import make_pool
from bcut.experiments.process import Outcome
from bcut.experiments.reporting.runs import load_experiment
from bcut.experiments.store import Store, default_workers
from bcut.experiments.tasks import SCHEMA, Task, tasks_of
from bcut.experiments.versions import code_version, machine

Watcher = Callable[["Progress"], None]


@dataclass
class Progress:
    """How far an experiment is.

    Attributes
    ----------
    total : int
        Different runs that the plan asks for.
    stored : int
        Those that were stored before, and that no other run contradicts.
    done : int
        Those that ended well since.
    failures : list of (str, str, str)
        Instance, variant and message of those that failed, and of those that contradict each other or the plan.
    interrupted : bool
    last : str
        What ended last.
    """

    total: int = 0
    stored: int = 0
    done: int = 0
    failures: list[tuple[str, str, str]] = field(default_factory=list)
    interrupted: bool = False
    last: str = ""


def run_experiment(
    plan: Plan | Path | str,
    folder: Path | str,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    on_progress: Watcher | None = None,
) -> Progress:
    """Carry out the runs of a plan that are not stored yet.

    Parameters
    ----------
    plan : Plan or path
    folder : path
        Made where it does not exist.
    scheduler : str, optional
        Address of a dask scheduler.
    workers : int, optional
        Runs at once on this machine; as many as it has cores when omitted.
    on_progress : callable, optional
        Told whenever a run ends.

    Returns
    -------
    Progress
        Ctrl-C ends it early, with everything stored that had ended.

    Raises
    ------
    InputError
        Bad plan or folder.
    """
    plan = plan if isinstance(plan, Plan) else read_plan(plan)
    store, progress = Store(Path(folder)), Progress()
    tasks = list(tasks_of(plan))
    store.prepare()
    with store.locked():
        store.save_manifest(manifest_of(plan, tasks))
        distinct = {task.fingerprint: task for task in tasks}
        store.forget_errors(distinct)
        open_tasks = {name: task for name, task in distinct.items() if not store.has(name)}
        progress.total, progress.stored = len(distinct), len(distinct) - len(open_tasks)
        _tell(progress, on_progress)
        if open_tasks:
            try:
                with make_pool(scheduler, workers or default_workers()) as pool:
                    for name, outcome in pool.carry_out([(n, t.data) for n, t in open_tasks.items()]):
                        _store(store, open_tasks[name], outcome, progress)
                        _tell(progress, on_progress)
            except KeyboardInterrupt:
                progress.interrupted = True
        if not progress.interrupted:
            _count_contradictions(store, progress, before=distinct.keys() - open_tasks.keys())
    return progress


def _count_contradictions(store: Store, progress: Progress, *, before: Set[str]) -> None:
    """Count runs as failed that contradict another one, or the plan, about an optimum; `before` were stored before."""
    counted: set[str] = set()
    for found in load_experiment(store.folder).contradictions:
        for claim in found.claims:
            if claim.fingerprint and claim.fingerprint not in counted:
                counted.add(claim.fingerprint)
                if claim.fingerprint in before:
                    progress.stored -= 1
                else:
                    progress.done -= 1
                progress.failures.append((found.instance, claim.who, found.told_of(claim)))


def _tell(progress: Progress, on_progress: Watcher | None) -> None:
    if on_progress is not None:
        on_progress(progress)


def _store(store: Store, task: Task, outcome: Outcome, progress: Progress) -> None:
    progress.last = f"{task.case.instance}, {task.variant.name}"
    if outcome.record is not None:
        store.save(task.fingerprint, outcome.record, outcome.ledger)
        progress.done += 1
    elif outcome.error is not None:
        about = {
            "instance": task.case.instance,
            "variant": task.variant.name,
            "settings": task.data["settings"],
        }
        store.save_error(task.fingerprint, about, outcome.error)
        progress.failures.append((task.case.instance, task.variant.name, outcome.error["message"]))


def manifest_of(plan: Plan, tasks: list[Task]) -> dict[str, Any]:
    """Return what a report needs to know of the plan, in the plan's order."""
    return {
        "schema": SCHEMA,
        "name": plan.name,
        "description": plan.description,
        "protocol": plan.protocol,
        "plan": plan.text,
        "written": time.time(),
        "code": code_version(),
        "machine": machine(),
        "variants": [
            {"name": v.name, "role": v.role, "family": v.family, **v.settings()} for v in plan.variants
        ],
        "measures": list(plan.measures),
        "figures": [asdict(drawing) for drawing in plan.drawings],
        "runs": [
            {
                "fingerprint": task.fingerprint,
                "instance": task.case.instance,
                "class": task.case.label,
                "objective": task.case.objective,
                "sense": task.case.sense,
                "spanning": task.case.spanning,
                "formulation": task.case.formulation,
                "optimum": None if task.case.optimum is None else str(task.case.optimum),
                "orders": task.case.orders,
                "variant": task.variant.name,
            }
            for task in tasks
        ],
    }

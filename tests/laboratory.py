"""What the tests of experiments share: plans carried out within this process, which is fast."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bcut.errors import BcutError
from bcut.experiments.engine import manifest_of
from bcut.experiments.execute import carry_out
from bcut.experiments.plan import read_plan
from bcut.experiments.store import Store
from bcut.experiments.tasks import Task, tasks_of


def plan_file(folder: Path, text: str) -> Path:
    path = folder / "plan.toml"
    path.write_text(text, encoding="utf-8")
    return path


def tasks_from(folder: Path, text: str) -> list[Task]:
    return list(tasks_of(read_plan(plan_file(folder, text))))


def carried_out(folder: Path, text: str) -> Store:
    """Carry out a plan as the engine does, but in this process; returns its folder, `folder`/results."""
    plan = read_plan(plan_file(folder, text))
    tasks = list(tasks_of(plan))
    store = Store(folder / "results")
    store.prepare()
    store.save_manifest(manifest_of(plan, tasks))
    for task in tasks:
        if not store.has(task.fingerprint):
            try:
                store.save(task.fingerprint, *carry_out(task.data))
            except BcutError as error:
                found = {"kind": type(error).__name__, "message": str(error), "trace": ""}
                store.save_error(task.fingerprint, {}, found)
    return store


def ledger_file(folder: Path, text: str) -> tuple[Path, dict[str, Any]]:
    """Carry out the one run of a plan; returns its ledger and its record."""
    (task,) = tasks_from(folder, text)
    record, ledger = carry_out(task.data)
    assert ledger is not None
    path = folder / "run.cuts.jsonl.gz"
    path.write_bytes(ledger)
    return path, record


def edited(path: Path, change: Callable[[list[dict[str, Any]]], None]) -> Path:
    """Write a ledger again after a change of its entries."""
    entries = [json.loads(line) for line in gzip.decompress(path.read_bytes()).splitlines()]
    change(entries)
    other = path.with_name("edited.cuts.jsonl.gz")
    other.write_bytes(gzip.compress("".join(json.dumps(entry) + "\n" for entry in entries).encode()))
    return other

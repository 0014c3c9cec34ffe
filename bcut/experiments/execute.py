"""Carrying out one run, in a process of its own.

``python -m bcut.experiments.execute FOLDER`` reads the task from standard input, and writes the record and the
ledger, or the error, into the folder. The process ends when its standard input does: with the process that
started it, however that one ends; nobody but itself removes the folder then.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import sys
import threading
import time
import traceback
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from bcut.errors import BcutError, InputError
from bcut.experiments.presets import Run
from bcut.experiments.versions import code_version, digest_of, machine

RECORD, LEDGER, ERROR = "record.json", "ledger.gz", "error.json"


def carry_out(task: Mapping[str, Any]) -> tuple[dict[str, Any], bytes | None]:
    """Carry out a run.

    Parameters
    ----------
    task : mapping
        `bcut.experiments.tasks.Task.data`.

    Returns
    -------
    record : dict
        What was asked, and what came out.
    ledger : bytes or None
        The file of its cuts.

    Raises
    ------
    BcutError
        Bad input, a separator or a solver that failed, or other code or files than the task was made for.
    """
    _check_version(task)
    started = time.time()
    run = Run(task)
    outcome = run.outcome()
    counts = {} if run.recorder is None else {name: asdict(c) for name, c in run.recorder.counts.items()}
    instance = {key: task["instance"][key] for key in ("name", "dimension", "digest")}
    record = {
        "schema": task["schema"],
        "instance": {**instance, "points": len(task["instance"]["points"])},
        "problem": task["problem"],
        "settings": task["settings"],
        "outcome": outcome.stored(task["settings"]["preset"]),
        "cuts": counts,
        **run.measured(),
        "code": task["code"],
        "machine": machine(),
        "started": started,
    }
    return record, run.ledger


def _check_version(task: Mapping[str, Any]) -> None:
    """Refuse to run with other sources or files than those that the fingerprint speaks of."""
    here = code_version()
    if here != task["code"]:
        differing = ", ".join(key for key in here if here[key] != task["code"].get(key))
        raise InputError(
            f"the run was planned with another version ({differing}) than it would be run with; "
            "install the same version everywhere, and start the experiment again after changing the code"
        )
    for path, digest in task["files"].items():
        if digest_of(Path(path)) != digest:
            raise InputError(
                f"{path}: has changed since the experiment was started, or differs on this machine"
            )


def main(folder: Path) -> int:
    """Read a task from standard input, and write what comes of it; returns the exit status."""
    task = json.loads(sys.stdin.readline())
    _end_with_standard_input(folder)
    # Limits interrupt what they end. Whoever started this may have done so in the background of a script, where
    # interrupts are ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    _limit_memory(task["settings"]["memory_limit"])
    try:
        record, ledger = carry_out(task)
        if ledger is not None:
            (folder / LEDGER).write_bytes(ledger)
        (folder / RECORD).write_text(json.dumps(record, allow_nan=False), encoding="utf-8")
    except Exception as error:
        trace = getattr(error, "trace", "") if isinstance(error, BcutError) else traceback.format_exc()
        message = str(error) or type(error).__name__
        found = {"kind": type(error).__name__, "message": message, "trace": trace}
        (folder / ERROR).write_text(json.dumps(found), encoding="utf-8")
        return 1
    return 0


def _end_with_standard_input(folder: Path) -> None:
    """End this process, and remove its folder, when nobody is left who could want its result."""

    def wait() -> None:
        # Not through sys.stdin, whose lock a thread must not hold when the interpreter ends.
        while os.read(0, 4096):
            pass
        shutil.rmtree(folder, ignore_errors=True)
        os._exit(3)

    threading.Thread(target=wait, daemon=True).start()


def _limit_memory(gibibytes: float | None) -> None:
    if gibibytes is None:
        return
    try:
        import resource
    except ImportError:  # not on this system
        return
    size = int(gibibytes * 2**30)
    resource.setrlimit(resource.RLIMIT_AS, (size, size))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))

"""One run as a process: started, watched, and ended where nobody wants it any more.

Whatever happens to the process, a crash, a kill, too much memory, is the outcome of this run and of no other.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

from bcut.experiments.execute import ERROR, LEDGER, RECORD

# A run that goes on for so long after its time limit hangs: factor and seconds on top.
_PATIENCE, _GRACE = 2.0, 120.0
_POLL = 0.2
_TAIL = 4000


@dataclass(frozen=True)
class Outcome:
    """What came of a run: a record, perhaps with a ledger, or an error; neither where it was stopped.

    Attributes
    ----------
    record : dict or None
    ledger : bytes or None
    error : dict or None
        kind, message, trace.
    """

    record: dict[str, Any] | None = None
    ledger: bytes | None = None
    error: dict[str, str] | None = None

    @staticmethod
    def of_exception(error: BaseException, message: str = "") -> Outcome:
        """Return the outcome of a run that could not be started or read: no disk space, no memory for a process."""
        trace = "".join(traceback.format_exception(error))
        said = message or f"the run could not be carried out: {str(error) or type(error).__name__}"
        return Outcome(error={"kind": type(error).__name__, "message": said, "trace": trace})


def run_in_process(task: Mapping[str, Any], stop: Callable[[], bool] = lambda: False) -> Outcome:
    """Carry out a run in a process of its own, and wait for it.

    Parameters
    ----------
    task : mapping
    stop : callable
        Asked again and again; once it says true, the process is ended.

    Raises
    ------
    OSError
        This machine has no room for another process or its files.
    """
    with tempfile.TemporaryDirectory(prefix="bcut-run-") as folder:
        place = Path(folder)
        with (place / "messages").open("wb") as messages:
            process = subprocess.Popen(
                # Without the current folder among the places of modules: whatever lies there is not meant.
                [sys.executable, "-P", "-m", "bcut.experiments.execute", folder],
                stdin=subprocess.PIPE,
                stdout=messages,
                stderr=messages,
                env=_environment(),
                # Ctrl-C at a terminal is for the program that started the run.
                start_new_session=True,
            )
            # The pipe stays open until the end: the process ends with it.
            assert process.stdin is not None
            try:
                with contextlib.suppress(BrokenPipeError):  # a process that failed to start tells why below
                    process.stdin.write(json.dumps(task).encode() + b"\n")
                    process.stdin.flush()
                reason = _wait(process, task["settings"]["time_limit"], stop)
            finally:
                _end(process)
        if reason == "stopped":
            return Outcome()
        if reason:
            return Outcome(error={"kind": "Timeout", "message": reason, "trace": ""})
        return _outcome(place, process.returncode)


def _environment() -> dict[str, str]:
    """One thread for each run: several runs share the machine."""
    return {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def _wait(process: subprocess.Popen[bytes], time_limit: float | None, stop: Callable[[], bool]) -> str:
    """Wait for a process; returns why it is to be ended, or nothing when it ended by itself."""
    deadline = inf if time_limit is None else time.monotonic() + _PATIENCE * time_limit + _GRACE
    while True:
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_POLL)
            return ""
        if stop():
            return "stopped"
        if time.monotonic() > deadline:
            return f"the run went on long after its time limit of {time_limit:g} seconds, and was ended"


def _end(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        process.kill()
        process.wait()
    assert process.stdin is not None
    with contextlib.suppress(BrokenPipeError):
        process.stdin.close()


def _outcome(place: Path, status: int) -> Outcome:
    if status == 0 and (place / RECORD).exists():
        record = json.loads((place / RECORD).read_text(encoding="utf-8"))
        ledger = (place / LEDGER).read_bytes() if (place / LEDGER).exists() else None
        return Outcome(record, ledger)
    if (place / ERROR).exists():
        return Outcome(error=json.loads((place / ERROR).read_text(encoding="utf-8")))
    messages = (place / "messages").read_text(encoding="utf-8", errors="replace")[-_TAIL:]
    return Outcome(error={"kind": "Crash", "message": _how_it_ended(status), "trace": messages})


def _how_it_ended(status: int) -> str:
    if status >= 0:
        return f"the process ended with status {status}"
    try:
        name = signal.Signals(-status).name
    except ValueError:
        name = f"signal {-status}"
    memory = "; perhaps it ran out of memory" if name == "SIGKILL" else ""
    return f"the process was ended by {name}{memory}"

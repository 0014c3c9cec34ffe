"""Programs that tests start: none outlives its test, none fills a pipe that nobody reads, none is awaited for ever."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, NamedTuple

BCUT = (sys.executable, "-P", "-m", "bcut")

# In seconds. Far more than anything here takes, on the slowest machine too.
PATIENCE = 240.0

# Code for a separator of a test: deadlines have passed, however much time there was and however fast the machine is.
# A test whose own process carries that out takes the fixture `time_is_up`, which puts the clock right again.
TIME_IS_UP = "import time; clock = time.monotonic; time.monotonic = lambda: clock() + 1e6"


class Ended(NamedTuple):
    """How a program ended, and what it printed."""

    status: int
    out: str
    err: str


class Started:
    """A program at work."""

    def __init__(self, process: subprocess.Popen[bytes], out: IO[bytes], err: IO[bytes]) -> None:
        self._process, self._out, self._err = process, out, err

    def until(self, condition: Callable[[], object]) -> None:
        """Wait for what the program is to do before it ends."""
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert self._process.poll() is None, f"it has ended: {self.end()}"
            assert time.monotonic() < deadline, "nothing happened"
            time.sleep(0.05)

    def signal(self, number: int) -> None:
        self._process.send_signal(number)

    def end(self) -> Ended:
        """Wait for the program's end."""
        status = self._process.wait(PATIENCE)
        texts = []
        for file in (self._out, self._err):
            file.seek(0)
            texts.append(file.read().decode())
        return Ended(status, *texts)


@contextmanager
def started(command: Sequence[str | Path], **options: Any) -> Iterator[Started]:
    """Start a program; kill it in the end if it has not ended then."""
    with (
        tempfile.TemporaryFile() as out,
        tempfile.TemporaryFile() as err,
        subprocess.Popen(command, **{"stdout": out, "stderr": err, **options}) as process,
    ):
        try:
            yield Started(process, out, err)
        finally:
            process.kill()


def finished(command: Sequence[str | Path], **options: Any) -> Ended:
    """Carry out a program."""
    with started(command, **options) as program:
        return program.end()


def on_terminal(command: Sequence[str | Path], *, columns: int) -> Ended:
    """Carry out a program whose standard error is a terminal."""
    import pty

    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": str(columns)}
    with started(command, env=environment, stderr=theirs) as program:
        os.close(theirs)
        shown = bytearray()
        while True:
            try:
                part = os.read(ours, 4096)
            except OSError:  # the other side was closed
                break
            if not part:
                break
            shown += part
        os.close(ours)
        return program.end()._replace(err=shown.decode())

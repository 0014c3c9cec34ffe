"""The exit statuses of the program: a contract with scripts."""

from __future__ import annotations

from enum import IntEnum


class ExitStatus(IntEnum):
    """What a finished command reports to the shell."""

    DONE = 0
    BAD_INPUT = 2
    LIMIT = 3
    FAILED = 5
    INTERRUPTED = 130


_OF_STATUS = {"limit": ExitStatus.LIMIT, "interrupted": ExitStatus.INTERRUPTED}


def exit_status(status: str) -> ExitStatus:
    """Return the exit status for the status of a result."""
    return _OF_STATUS.get(status, ExitStatus.DONE)

"""Standard output carries data, but SCIP's Ctrl-C handler prints there: C code writes to standard error meanwhile."""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

_OUT, _ERR = 1, 2

_lock = threading.Lock()
_users = 0
_saved: int | None = None


@contextmanager
def native_output_to_stderr() -> Iterator[None]:
    """Point the process's file descriptor 1 to standard error, for as long as anyone is inside.

    Does nothing where there is no such descriptor, or no C library to flush.
    """
    _enter()
    try:
        yield
    finally:
        _leave()


def _enter() -> None:
    global _users, _saved
    with _lock:
        _users += 1
        if _users > 1 or os.name != "posix":
            return
        _flush()
        try:
            _saved = os.dup(_OUT)
            os.dup2(_ERR, _OUT)
        except OSError:  # one of the two is closed
            if _saved is not None:
                os.close(_saved)
            _saved = None


def _leave() -> None:
    global _users, _saved
    with _lock:
        _users -= 1
        if _users == 0 and _saved is not None:
            _flush()
            os.dup2(_saved, _OUT)
            os.close(_saved)
            _saved = None


def _flush() -> None:
    """Write out what Python and C have buffered, so that it goes where it was meant to go."""
    with suppress(OSError, ValueError):  # nobody reads, or it is closed
        if sys.stdout is not None:
            sys.stdout.flush()
    ctypes.CDLL(None).fflush(None)

"""Keeping solver libraries off standard output."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def native_output_hidden() -> Iterator[None]:
    """Send what C code prints during the block nowhere.

    SCIP announces a Ctrl-C on standard output, whatever its verbosity, where the result alone belongs. Python's own
    `sys.stdout` is not affected once the block has ended; nothing should be written to it inside.
    """
    sys.stdout.flush()
    try:
        kept = os.dup(1)
    except OSError:  # closed by the caller
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.close(nowhere)
    try:
        yield
    finally:
        _flush_c_streams()
        os.dup2(kept, 1)
        os.close(kept)


def _flush_c_streams() -> None:
    """Empty C's buffers while they still lead nowhere: on a pipe they are only written when the program ends."""
    if os.name == "posix":
        ctypes.CDLL(None).fflush(None)

"""A request to end, as batch systems send it before they kill, is taken for Ctrl-C."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def terminable() -> Iterator[None]:
    """End the block by SIGTERM as Ctrl-C would: what was found is kept, and what it started ends with it.

    Outside the main thread, where signals do not arrive, nothing is changed.
    """

    def end(*_: object) -> None:
        from bcut.solving.memory import interrupt

        # Jobs in the background of a script ignore Ctrl-C, and would ignore this as well.
        if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        interrupt()

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)

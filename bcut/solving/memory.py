"""How much memory the process uses, and a limit on it and on its time that reaches every stage of a solve."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

GIB = 1 << 30

# Whether an interrupt is on its way that comes from this process itself.
_MEANT = threading.Event()

# Seconds between two looks, those that a stage has after the deadline to end by itself, and those that an import has.
_PERIOD, _GRACE, _IMPORT = 0.05, 1.0, 10.0


@dataclass
class Watch:
    """What a watched block ran into.

    Attributes
    ----------
    reached : {"", "memory", "time"}
        The limit that ended it.
    """

    reached: str = ""


def used_memory() -> int:
    """Return the bytes of memory that the process has in use now; its peak where the system tells no more."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, IndexError):
        return peak_memory()


def peak_memory() -> int:
    """Return the most memory that the process has used, in bytes; 0 where the system does not tell."""
    try:
        import resource
    except ImportError:
        return 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    # Bytes on macOS, kibibytes elsewhere.
    return int(peak) if sys.platform == "darwin" else int(peak) * 1024


def interrupt() -> None:
    """Interrupt the main thread as Ctrl-C does; a block that is `watched` hears it even where Ctrl-C is ignored."""
    _MEANT.set()
    os.kill(os.getpid(), signal.SIGINT)


def _imports(thread: int) -> int:
    """Return how many frames of the import system are on a thread's stack: more of them, further inside an import."""
    count, frame = 0, sys._current_frames().get(thread)
    while frame is not None:
        count += frame.f_code.co_filename == "<frozen importlib._bootstrap>"
        frame = frame.f_back
    return count


@contextmanager
def watched(watch: Watch, *, memory: float | None, deadline: float | None) -> Iterator[None]:
    """Interrupt the block, as Ctrl-C would, when the process uses too much memory or has no more time.

    Solvers and loops hear an interrupt within a moment and keep what they have found, and so one mechanism serves all
    stages; those that watch the deadline themselves end before this does. An interrupt, also one by Ctrl-C, that
    arrives where Python cannot raise it, in a callback of compiled code for one, is sent again. Limits wait for a
    library that is being imported, for ten seconds at most: a process can do nothing with what an interrupt leaves of
    it, and has no other.

    Nothing is watched outside the main thread, where interrupts do not arrive.

    Parameters
    ----------
    watch : Watch
        Told of the limit when it is reached.
    memory : float or None
        In GiB.
    deadline : float or None
        Value of `time.monotonic`.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    ended, unheard = threading.Event(), threading.Event()
    main = threading.get_ident()
    before = _imports(main)

    def await_imports() -> None:
        until = time.monotonic() + _IMPORT
        while _imports(main) > before and time.monotonic() < until and not ended.wait(_PERIOD):
            pass

    def look() -> None:
        while not ended.wait(_PERIOD):
            if unheard.is_set():
                unheard.clear()
            elif watch.reached:
                continue
            elif memory is not None and used_memory() > memory * GIB:
                watch.reached = "memory"
            elif deadline is not None and time.monotonic() > deadline + _GRACE:
                watch.reached = "time"
            else:
                continue
            await_imports()
            if not ended.is_set():
                interrupt()

    def heed(*_: object) -> None:
        if _MEANT.is_set():
            _MEANT.clear()
            raise KeyboardInterrupt

    # Jobs that a script starts in the background ignore Ctrl-C, which is for others; limits are for them.
    _MEANT.clear()
    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    if ignored:
        signal.signal(signal.SIGINT, heed)
    previous = sys.unraisablehook

    def hook(unraisable: sys.UnraisableHookArgs) -> None:
        if unraisable.exc_type is KeyboardInterrupt:
            unheard.set()
            if watcher.ident is None:
                watcher.start()
        else:
            previous(unraisable)

    watcher = threading.Thread(target=look, name="bcut-limits", daemon=True)
    # Without limits there is nothing to look at until an interrupt goes unheard.
    if memory is not None or deadline is not None:
        watcher.start()
    sys.unraisablehook = hook
    try:
        yield
    finally:
        ended.set()
        if watcher.ident is not None:
            watcher.join()
        sys.unraisablehook = previous
        if ignored:
            signal.signal(signal.SIGINT, signal.SIG_IGN)

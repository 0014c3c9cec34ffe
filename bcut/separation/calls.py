"""Calls into a plug-in: whatever it raises or hands back, it is the one that is named, and it comes to an end."""

from __future__ import annotations

import reprlib
import time
import traceback
from collections.abc import Generator, Sized
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from bcut.errors import SeparatorError
from bcut.separation.seam import Cut, FractionalPoint, Separator

#: A separator that yields more cuts than this for one point, or more coefficients in all of them, is taken to be
#: endless. The first number is two hundred times what a host hands to a solver; with both, a round's cuts take a
#: gigabyte at most.
MAX_CUTS = 100_000
MAX_COEFFICIENTS = 50_000_000

_HERE = Path(__file__).parent


class EndlessSeparatorError(SeparatorError):
    """A separator that goes on and on yielding cuts for one point."""


class Timed(Protocol):
    """What the seconds of a call are added to."""

    seconds: float


@dataclass
class guard:  # noqa: N801 - used like a function
    """Time a call into a plug-in; whatever it raises becomes a `SeparatorError` with its own traceback.

    Also ``sys.exit()``, which is no way for a plug-in to end a run; Ctrl-C alone is nobody's fault.
    """

    separator: Separator
    call: str
    statistics: Timed | None = None
    started: float = field(default=0.0, init=False)

    def __enter__(self) -> None:
        self.started = time.perf_counter()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: Any) -> None:
        if self.statistics is not None:
            self.statistics.seconds += time.perf_counter() - self.started
        if error is None or isinstance(error, SeparatorError | KeyboardInterrupt):
            return
        message = f"{self.call}() raised {type(error).__name__}: {error}"
        if isinstance(error, SystemExit):
            message += "; it must return, not exit"
        raise SeparatorError(self.separator.name, message, _own_trace(error)) from error


def _own_trace(error: BaseException) -> str:
    """Write a traceback without the frames of the host that lead to the plug-in."""
    trace = error.__traceback__
    while trace is not None and Path(trace.tb_frame.f_code.co_filename).parent == _HERE:
        trace = trace.tb_next
    return "".join(traceback.format_exception(type(error), error, trace))


def cuts_of(separator: Separator, point: FractionalPoint) -> Generator[Cut, None, None]:
    """Yield what `Separator.separate` does, as long as that is cuts.

    Within a `guard`: what the separator raises comes through as it is.

    Raises
    ------
    SeparatorError
        If it returns nothing to go through, or yields something that is no `Cut`.
    EndlessSeparatorError
        If there are more than `MAX_CUTS`, or they have more than `MAX_COEFFICIENTS`.
    """
    # Plug-ins are not type-checked: what comes back may be anything.
    returned: Any = separator.separate(point)
    if not (hasattr(type(returned), "__iter__") or hasattr(type(returned), "__getitem__")):
        found = "None" if returned is None else shown(returned)
        raise SeparatorError(
            separator.name, f"separate() returned {found}; yield Cuts or return a list of them"
        )
    coefficients = 0
    items = iter(returned)
    try:
        for number, cut in enumerate(items, 1):
            if not isinstance(cut, Cut):
                found = "None" if cut is None else shown(cut)
                raise SeparatorError(
                    separator.name,
                    f"separate() must yield Cut objects, not {found}; write Cut(simplices, rhs)",
                )
            coefficients += len(cut.simplices) if isinstance(cut.simplices, Sized) else 1
            if number > MAX_CUTS or coefficients > MAX_COEFFICIENTS:
                what = f"{MAX_CUTS:,} cuts" if number > MAX_CUTS else f"{MAX_COEFFICIENTS:,} coefficients"
                raise EndlessSeparatorError(
                    separator.name,
                    f"separate() yielded more than {what} for one point and was stopped; "
                    "end its loop, or yield the most useful cuts and return",
                )
            yield cut
    finally:
        if isinstance(items, Generator):
            items.close()


def shown(value: Any) -> str:
    """Write a value of a plug-in for a message: its type, and the beginning of what it is."""
    return f"{type(value).__name__} {reprlib.repr(value)}"

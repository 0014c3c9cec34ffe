"""What is known of SCIP's root while it is worked on, for runs whose time limit comes in the midst of separating."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import isclose
from types import FrameType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bcut.experiments.recording import SCIP_ROOT, Recorder
from bcut.separation.driver import Separation
from bcut.solving.memory import Watch

if TYPE_CHECKING:
    from bcut.separation.driver import IntegerCut
    from bcut.separation.seam import Problem


class RootWatcher:
    """Notes the relaxations of SCIP's root, and hands everything on to a recorder; an observer of separation.

    It also has the end of the time reach separators at work within SCIP: SCIP's own handler of interrupts, which is
    set for as long as it solves, only makes a note of them for when the separator is done.

    Parameters
    ----------
    watch : Watch
        Of the time limit.

    Attributes
    ----------
    recorder : Recorder or None
    rounds : list of (float, dict of str to int)
        Values, and the cuts of ours that SCIP then took, by family.
    """

    def __init__(self, watch: Watch) -> None:
        self.watch = watch
        self.recorder: Recorder | None = None
        self.rounds: list[tuple[float, dict[str, int]]] = []

    def relaxed(self, value: float, node: int) -> None:
        """Note a relaxation; SCIP shows the same one more than once."""
        self._hear()
        again = self.rounds and not self.rounds[-1][1] and isclose(self.rounds[-1][0], value, rel_tol=1e-9)
        if node <= SCIP_ROOT and not again:
            self.rounds.append((value, {}))
        if self.recorder is not None:
            self.recorder.relaxed(value, node)

    @contextmanager
    def at_work(self) -> Iterator[None]:
        """Set the handler of before again after the block."""
        before = signal.getsignal(signal.SIGINT)
        try:
            yield
        finally:
            if before is not None and _in_main_thread():
                signal.signal(signal.SIGINT, before)

    def _hear(self) -> None:
        if _in_main_thread():
            signal.signal(signal.SIGINT, self._interrupted)

    def _interrupted(self, number: int, frame: FrameType | None) -> None:
        """End a separator; SCIP itself ends by its own limit, and then tells more than is known here."""
        while frame is not None and frame.f_code is not Separation.round.__code__:
            frame = frame.f_back
        if frame is not None or not self.watch.reached:
            raise KeyboardInterrupt

    def separated(
        self,
        problem: Problem,
        x: NDArray[np.floating],
        found: Sequence[IntegerCut],
        chosen: Sequence[IntegerCut],
    ) -> None:
        """Hand it on."""
        if self.recorder is not None:
            self.recorder.separated(problem, x, found, chosen)

    def took(self, cut: IntegerCut) -> None:
        """Note that SCIP took a cut of the last round."""
        if self.rounds:
            counts = self.rounds[-1][1]
            counts[cut.family] = counts.get(cut.family, 0) + 1
        if self.recorder is not None:
            self.recorder.took(cut)


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()

"""What holds for the whole run of the tests."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable

import pytest
from processes import TIME_IS_UP

# A run that was put into the background ignores Ctrl-C, and so would every program that a test starts and interrupts.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def time_is_up(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Makes deadlines pass when it is called; the clock is right again after the test in any case."""
    monkeypatch.setattr(time, "monotonic", time.monotonic)
    return lambda: exec(TIME_IS_UP, {})

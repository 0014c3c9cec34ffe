"""What holds for the whole run of the tests."""

from __future__ import annotations

import signal

# A run that was put into the background ignores Ctrl-C, and so would every program that a test starts and interrupts.
signal.signal(signal.SIGINT, signal.default_int_handler)

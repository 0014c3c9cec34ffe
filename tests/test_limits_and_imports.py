"""Limits do not break libraries that are being imported, which a process would then have to do without."""

from __future__ import annotations

import sys
import time
from importlib import import_module
from pathlib import Path

import pytest

from bcut.solving import memory
from bcut.solving.memory import Watch, watched


@pytest.fixture
def slow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package whose import waits until the limit has been reached for a while."""
    folder = tmp_path / "slow_to_import"
    folder.mkdir()
    (folder / "__init__.py").write_text(
        "import time\n"
        "from slow_to_import import part\n"
        "from bcut.solving import memory\n"
        "ends = time.monotonic() + 300\n"
        "while not memory.reached() and time.monotonic() < ends:\n"
        "    time.sleep(0.01)\n"
        "time.sleep(0.5)\n"
        "whole = part.value\n"
    )
    (folder / "part.py").write_text("value = 1\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    return folder


def test_a_time_limit_waits_for_an_import(slow: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "_GRACE", 0.0)
    watch = Watch()
    monkeypatch.setattr(memory, "reached", lambda: watch.reached, raising=False)

    def work() -> None:
        import_module("slow_to_import")
        ends = time.monotonic() + 300
        while time.monotonic() < ends:
            time.sleep(0.01)

    try:
        with pytest.raises(KeyboardInterrupt), watched(watch, memory=None, deadline=time.monotonic()):
            work()
        assert watch.reached == "time"
        assert sys.modules["slow_to_import"].whole == 1
    finally:
        for name in ("slow_to_import", "slow_to_import.part"):
            sys.modules.pop(name, None)


def test_an_import_that_does_not_end_is_interrupted(slow: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "_GRACE", 0.0)
    monkeypatch.setattr(memory, "_IMPORT", 0.1)
    (slow / "__init__.py").write_text(
        "import time\nends = time.monotonic() + 300\nwhile time.monotonic() < ends:\n    time.sleep(0.01)\n"
    )
    watch = Watch()
    with pytest.raises(KeyboardInterrupt), watched(watch, memory=None, deadline=time.monotonic()):
        import_module("slow_to_import")
    assert watch.reached == "time"

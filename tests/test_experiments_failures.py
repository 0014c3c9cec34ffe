"""What goes wrong around one run is the matter of this run alone: the others go on, and what ended is stored."""

from __future__ import annotations

import errno
import importlib.util
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from laboratory import plan_file

from bcut.cli.main import run
from bcut.experiments.engine import run_experiment
from bcut.experiments.pools import LocalPool
from bcut.experiments.process import Outcome, run_in_process

PLAN = """
[[instances]]
instance = "random:8,3,seed={s}"
for = { s = "1..3" }
[[variants]]
name = "count"
preset = "sizes"
"""

Stop = Callable[[], bool]


def carried_out_but_one(task: Mapping[str, Any], stop: Stop) -> Outcome:
    """Carry out a run, but for that of one instance, which finds no space for its files."""
    if task["instance"]["name"] == "random:8,3,seed=2":
        raise OSError(errno.ENOSPC, "No space left on device")
    return run_in_process(task, stop)


def without_dask(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "bcut.experiments.cluster", None)
    monkeypatch.setattr("bcut.experiments.pools.run_in_process", carried_out_but_one)


def within_dask(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bcut.experiments.cluster.run_in_process", carried_out_but_one)


WAYS = [without_dask] + ([within_dask] if importlib.util.find_spec("distributed") else [])


@pytest.mark.parametrize("way", WAYS)
def test_a_run_without_room_for_its_files_fails_alone(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    way: Callable[[pytest.MonkeyPatch], None],
) -> None:
    way(monkeypatch)
    out = tmp_path / "out"
    assert (
        run(["experiment", "run", str(plan_file(tmp_path, PLAN)), "--output", str(out), "--workers", "1"])
        == 5
    )
    printed = capsys.readouterr()
    assert "3 runs, 0 stored before, 2 done, 1 failed" in printed.out
    assert "failed: random:8,3,seed=2, count: the run could not be carried out: " in printed.err
    assert "No space left on device" in printed.err
    stored = {json.loads(path.read_text())["instance"]["name"] for path in (out / "runs").glob("*.json")}
    assert stored == {"random:8,3,seed=1", "random:8,3,seed=3"}
    (failed,) = (out / "failed").iterdir()
    error = json.loads(failed.read_text())["error"]
    assert error["kind"] == "OSError"
    assert "in carried_out_but_one" in error["trace"]


def test_a_run_whose_process_cannot_be_started_fails_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[str] = []
    popen = subprocess.Popen

    def without_memory_once(*args: Any, **options: Any) -> Any:
        started.append("")
        if len(started) == 1:
            raise OSError(errno.ENOMEM, "Cannot allocate memory")
        return popen(*args, **options)

    monkeypatch.setitem(sys.modules, "bcut.experiments.cluster", None)
    monkeypatch.setattr("bcut.experiments.process.subprocess.Popen", without_memory_once)
    path, out = plan_file(tmp_path, PLAN), tmp_path / "out"
    progress = run_experiment(path, out, workers=1)
    assert (progress.done, [failure[2] for failure in progress.failures]) == (
        2,
        ["the run could not be carried out: [Errno 12] Cannot allocate memory"],
    )
    # There is memory again.
    progress = run_experiment(path, out, workers=1)
    assert (progress.stored, progress.done, progress.failures) == (2, 1, [])
    assert not list((out / "failed").iterdir())


def test_a_missing_folder_for_temporary_files_fails_each_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "bcut.experiments.cluster", None)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "gone"))
    progress = run_experiment(plan_file(tmp_path, PLAN), tmp_path / "out", workers=2)
    assert (progress.done, len(progress.failures)) == (0, 3)


def test_an_interruption_is_no_failure_of_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(task: Mapping[str, Any], stop: Stop) -> Outcome:
        raise KeyboardInterrupt

    monkeypatch.setattr("bcut.experiments.pools.run_in_process", interrupted)
    with LocalPool(1) as pool, pytest.raises(KeyboardInterrupt):
        list(pool.carry_out([("a", {})]))

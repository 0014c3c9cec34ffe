"""Experiments on several workers, for real: a scheduler and workers on loopback, one of them killed in the middle."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from laboratory import plan_file

from bcut.cli.main import run
from bcut.experiments.engine import Progress, run_experiment
from bcut.experiments.store import Store

pytest.importorskip("distributed")

PLAN = """
name = "several"
spanning = true
[[instances]]
instance = "random:10,3,seed={s}"
for = { s = "1..4" }
[[variants]]
name = "none"
[[variants]]
name = "link"
separators = ["link"]
"""

Start = Callable[..., "subprocess.Popen[bytes]"]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Start a part of dask by hand; ends everything that was started."""
    started: list[subprocess.Popen[bytes]] = []

    def begin(part: str, *arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{part}", *arguments, "--no-dashboard"]
        with (tmp_path / f"{part}-{len(started)}.log").open("wb") as log:
            process = subprocess.Popen(command, stdout=log, stderr=log, cwd=tmp_path)
        started.append(process)
        return process

    yield begin
    for process in started:
        process.kill()
        process.wait()


def address_in(file: Path) -> str:
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline:
        try:
            return str(json.loads(file.read_text())["address"])
        except (FileNotFoundError, ValueError):
            time.sleep(0.05)
    raise AssertionError("the scheduler did not start")


def test_a_killed_worker_loses_nothing_and_nothing_is_stored_twice(
    tmp_path: Path, start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "scheduler.json"
    start("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))
    address = address_in(file)
    worker = ("--nthreads", "1", "--no-nanny", "--host", "127.0.0.1", "--local-directory", str(tmp_path))
    first, second = (start("worker", address, *worker) for _ in range(2))
    stored: list[str] = []
    save = Store.save

    def counted(self: Store, fingerprint: str, *rest: object) -> None:
        stored.append(fingerprint)
        save(self, fingerprint, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(Store, "save", counted)

    def watch(progress: Progress) -> None:
        # More runs than workers are left: both are at work.
        if progress.done == 2 and first.poll() is None:
            first.kill()

    path, out = plan_file(tmp_path, PLAN), tmp_path / "out"
    progress = run_experiment(path, out, scheduler=address, on_progress=watch)
    assert first.poll() is not None
    assert second.poll() is None
    assert not progress.failures
    assert (progress.total, progress.done, progress.interrupted) == (8, 8, False)
    assert len(stored) == len(set(stored)) == 8
    assert sorted(f"{name}.json" for name in stored) == sorted(p.name for p in (out / "runs").glob("*.json"))
    # The same again, on this machine: all is there.
    assert run_experiment(path, out).stored == 8
    results = {p.name: json.loads(p.read_text())["outcome"] for p in (out / "runs").glob("*.json")}
    here = tmp_path / "here"
    assert run_experiment(path, here).done == 8
    for name, outcome in results.items():
        same = json.loads((here / "runs" / name).read_text())["outcome"]
        assert (same["status"], same["rounds"]) == (outcome["status"], outcome["rounds"])


def test_an_address_without_scheduler_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bcut.experiments.cluster._CONNECT_SECONDS", 1)
    path = str(plan_file(tmp_path, PLAN))
    command = ["experiment", "run", path, "--output", str(tmp_path / "out")]
    assert run([*command, "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert "no dask scheduler answers at tcp://127.0.0.1:9" in capsys.readouterr().err
    assert run([*command, "--scheduler", "nonsense://1"]) == 2

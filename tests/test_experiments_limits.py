"""Time limits reach separators at work, and a request to end reaches everything that an experiment has started."""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from laboratory import plan_file, tasks_from
from processes import BCUT, PATIENCE, TIME_IS_UP, started

from bcut.cli.termination import terminable
from bcut.experiments.execute import carry_out
from bcut.experiments.ledger import LedgerWriter, read_ledger
from bcut.experiments.process import run_in_process
from bcut.experiments.replay import check_ledger, replay

pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="there are no such signals"),
    pytest.mark.usefixtures("time_is_up"),
]

SLOW = """
import pathlib
import time

from bcut import Separator


class Slow(Separator):
    name = "slow"
    calls = 0

    def separate(self, point):
        self.calls += 1
        if self.calls >= {first}:
            pathlib.Path({asked!r}).touch()
            {act}
        return []
"""
PLAN = """
time_limit = {limit}
spanning = true
[[instances]]
instance = "random:16,3,seed={seed}"
optimum = {optimum}
[[variants]]
name = "slow"
separators = ["link", "./slow.py"]
{more}
"""


def separator_in(folder: Path, *, first: int = 1, act: str = f"{TIME_IS_UP}; time.sleep(300)") -> Path:
    """Write a separator that does something from some call on; returns the file that tells that it does.

    Unless told, it goes on when the time is up.
    """
    asked = folder / "asked"
    (folder / "slow.py").write_text(SLOW.format(first=first, asked=str(asked), act=act))
    return asked


def carried_out_slowly(folder: Path, **values: Any) -> tuple[dict[str, Any], bytes | None]:
    """Carry out the one run of the plan within this process; returns its record and its ledger."""
    text = PLAN.format(**{"limit": 900, "seed": 22, "optimum": 26, "more": "", **values})
    (task,) = tasks_from(folder, text)
    return carry_out(task.data)


@pytest.mark.parametrize(
    ("values", "act"),
    [
        ({"seed": 22}, "time.sleep(300)"),
        ({"seed": 9, "optimum": 28, "more": "cutoff = true"}, "exec('while True: pass')"),
        ({"seed": 22, "more": 'preset = "root"'}, "time.sleep(300)"),
    ],
    ids=["loop", "loop with cutoff", "root"],
)
def test_a_separator_that_does_not_end_is_ended_by_the_limit(
    tmp_path: Path, values: dict[str, Any], act: str
) -> None:
    asked = separator_in(tmp_path, first=2, act=f"{TIME_IS_UP}; {act}")
    before = signal.getsignal(signal.SIGINT)
    record, ledger = carried_out_slowly(tmp_path, **values)
    assert asked.exists()
    assert signal.getsignal(signal.SIGINT) == before
    outcome = record["outcome"]
    assert outcome["status"] == "limit"
    assert not outcome["integral"]
    assert len(outcome["rounds"]) >= 2
    assert outcome["rounds"][0][0] == outcome["lp"]
    assert outcome["rounds"][-1] == [outcome["lp_after_cuts"], {}]
    assert outcome["lp"] <= outcome["lp_after_cuts"] == outcome["bound"]
    assert outcome["separators"]["link"]["added"] > 0
    assert outcome["columns"] == {9: 1447, 22: 1546}[values["seed"]]
    assert 0 <= outcome["seconds"]["lp"] <= outcome["seconds"]["total"]
    # What the ledger says of the last relaxation is true of it.
    assert ledger is not None
    (tmp_path / "it.gz").write_bytes(ledger)
    read = read_ledger(tmp_path / "it.gz")
    assert not check_ledger(read).refused
    fixed = outcome["columns_after_fixing"] not in (None, outcome["columns"])
    assert fixed == ("cutoff" in values.get("more", ""))
    assert sum(cut["final"] for cut in read.cuts) > 0
    assert read.end["lp"] == pytest.approx(outcome["lp_after_cuts"], abs=1e-9)
    assert replay(read).agrees


def test_a_limit_before_the_first_relaxation_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, time_is_up: Callable[[], None]
) -> None:
    def slowly(*args: object, **options: object) -> None:
        time_is_up()
        time.sleep(300)

    monkeypatch.setattr("bcut.solving.programs.make_formulation", slowly)
    separator_in(tmp_path)
    for preset in ("loop", "root"):
        record, ledger = carried_out_slowly(tmp_path, more=f'preset = "{preset}"')
        outcome = record["outcome"]
        assert (outcome["status"], outcome["lp"], outcome["bound"]) == ("limit", None, None)
        assert (outcome["columns"], outcome["rounds"], outcome["columns_after_fixing"]) == (None, [], None)
        assert ledger is None


def test_a_ledger_whose_writing_was_interrupted_is_not_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, time_is_up: Callable[[], None]
) -> None:
    write = LedgerWriter.write

    def slowly(self: LedgerWriter, entry: dict[str, Any]) -> None:
        if entry["record"] == "point":
            time_is_up()
            time.sleep(300)
        write(self, entry)

    monkeypatch.setattr(LedgerWriter, "write", slowly)
    separator_in(tmp_path, first=1000)
    record, ledger = carried_out_slowly(tmp_path)
    assert ledger is None
    assert record["outcome"]["status"] == "limit"
    assert record["outcome"]["lp"] == pytest.approx(25.5)


@pytest.mark.parametrize("preset", ["loop", "root"])
def test_an_interruption_from_outside_is_no_limit(tmp_path: Path, preset: str) -> None:
    separator_in(tmp_path, act="raise KeyboardInterrupt")
    with pytest.raises(KeyboardInterrupt):
        carried_out_slowly(tmp_path, more=f'preset = "{preset}"')


def test_limits_hold_where_interrupts_are_ignored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in the background of a script, whose children inherit that."""
    separator_in(tmp_path)
    (task,) = tasks_from(tmp_path, PLAN.format(limit=900, seed=22, optimum=26, more=""))
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    deadline = time.monotonic() + PATIENCE
    try:
        outcome = run_in_process(task.data, lambda: time.monotonic() > deadline)
    finally:
        signal.signal(signal.SIGINT, before)
    assert outcome.record is not None
    assert outcome.record["outcome"]["status"] == "limit"


def test_a_request_to_end_is_heard_where_interrupts_are_ignored() -> None:
    def work() -> None:
        with terminable():
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(60)

    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with pytest.raises(KeyboardInterrupt):
            work()
    finally:
        signal.signal(signal.SIGINT, before)
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL], ids=["asked to end", "killed"])
def test_nothing_is_left_behind_by_an_experiment_that_ends(tmp_path: Path, number: signal.Signals) -> None:
    asked = separator_in(tmp_path, act="time.sleep(300)")
    more = '[[variants]]\nname = "count"\npreset = "sizes"'
    plan = plan_file(tmp_path, PLAN.format(limit=600, seed=22, optimum=26, more=more))
    out, temporary = tmp_path / "out", tmp_path / "temporary"
    temporary.mkdir()
    command = [*BCUT, "experiment", "run", str(plan), "--output", str(out), "--workers", "2"]
    with started(command, env={**os.environ, "TMPDIR": str(temporary)}) as program:
        program.until(lambda: asked.exists() and list((out / "runs").glob("*.json")))
        assert list(temporary.glob("bcut-run-*"))
        program.signal(number)
        status, said, _ = program.end()
    deadline = time.monotonic() + PATIENCE
    while list(temporary.glob("bcut-run-*")) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not list(temporary.glob("bcut-run-*"))
    (stored,) = (out / "runs").glob("*.json")
    assert json.loads(stored.read_text())["settings"]["preset"] == "sizes"
    if number == signal.SIGTERM:
        assert status == 130
        assert "2 runs, 0 stored before, 1 done, 0 failed, 1 not run" in said

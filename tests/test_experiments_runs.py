"""Runs of experiments: known by what they depend on, and nothing stored is lost or run again."""

from __future__ import annotations

import json
import os
import signal
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from laboratory import plan_file, tasks_from
from processes import BCUT, on_terminal, started

from bcut.cli.main import run
from bcut.errors import ExperimentError, InputError
from bcut.experiments.engine import run_experiment
from bcut.experiments.execute import carry_out
from bcut.experiments.plan import Plan, read_plan
from bcut.experiments.process import Outcome, run_in_process
from bcut.experiments.store import Store
from bcut.experiments.tasks import tasks_of
from bcut.instance import load_instance
from bcut.separation.resolve import built_in_names

Captured = pytest.CaptureFixture[str]
COMMAND = [*BCUT, "experiment", "run"]

ONE = """
[[instances]]
instance = "random:12,3,seed=1000"
spanning = true

[[variants]]
name = "link"
separators = ["link"]
"""

SEVERAL = """
name = "several"
spanning = true
[[instances]]
instance = "random:10,3,seed={s}"
for = { s = "1..3" }
[[variants]]
name = "none"
[[variants]]
name = "link"
separators = ["link"]
"""

# Asks for more memory than it may have.
GREEDY = """
import numpy as np
from bcut import Separator

class Greedy(Separator):
    \"\"\"Has a large table.\"\"\"
    name = "greedy"

    def separate(self, point):
        np.empty(1 << 32, dtype=np.uint8)
        return []
"""

# The run of this separator is killed from outside, as by a kernel that is out of memory.
KILLED = """
import os, signal
from bcut import Separator

class Killed(Separator):
    \"\"\"Is killed.\"\"\"
    name = "killed"

    def separate(self, point):
        os.kill(os.getpid(), signal.SIGKILL)
        return []
"""

RAISING = """
from bcut import Separator

class Raising(Separator):
    \"\"\"Raises.\"\"\"
    name = "raising"

    def separate(self, point):
        raise RuntimeError("out of ideas")
"""


# Fingerprints.


def test_a_run_is_known_by_what_it_depends_on(tmp_path: Path) -> None:
    def fingerprint(text: str) -> str:
        (task,) = tasks_from(tmp_path, text)
        return task.fingerprint

    first = fingerprint(ONE)
    # What something is called makes no difference, what it is does.
    points = load_instance("random:12,3,seed=1000").exact_points()
    (tmp_path / "same.json").write_text(json.dumps({"points": points}))
    assert fingerprint(ONE.replace('"link"\nsep', '"other name"\nsep')) == first
    assert fingerprint(ONE.replace('instance = "random:12,3,seed=1000"', 'file = "same.json"')) == first
    changes = [
        ONE.replace("seed=1000", "seed=1001"),
        ONE.replace("spanning = true", ""),
        ONE.replace("spanning = true", 'spanning = true\nsense = "max"'),
        ONE.replace("spanning = true", 'spanning = true\nobjective = "random-costs:1"'),
        ONE.replace('["link"]', '["link:max_cuts=1"]'),
        ONE.replace('["link"]', "[]"),
        ONE + "time_limit = 5\n",
        ONE + "seed = 1\n",
        ONE + 'preset = "root"\n',
        ONE + 'preset = "root"\nscip = ["zerohalf"]\n',
        ONE + "ledger = false\n",
    ]
    found = [fingerprint(text) for text in changes]
    assert len({first, *found}) == len(changes) + 1


def test_a_run_depends_on_the_text_of_its_files(tmp_path: Path) -> None:
    text = ONE.replace('"link"]', '"./mine.py"]')
    (tmp_path / "mine.py").write_text(RAISING)
    (first,) = tasks_from(tmp_path, text)
    (tmp_path / "mine.py").write_text(RAISING + "\n# better\n")
    (second,) = tasks_from(tmp_path, text)
    assert first.fingerprint != second.fingerprint
    with pytest.raises(InputError, match=r"mine\.py: has changed since the experiment was started"):
        carry_out(first.data)


def test_a_run_depends_on_the_sources_and_refuses_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (task,) = tasks_from(tmp_path, ONE)
    with pytest.raises(InputError, match=r"planned with another version \(sources\)"):
        carry_out({**task.data, "code": {**task.data["code"], "sources": "other"}})
    monkeypatch.setattr("bcut.experiments.versions.sources_digest", lambda: "other")
    (other,) = tasks_from(tmp_path, ONE)
    assert other.fingerprint != task.fingerprint


# The engine.


def records(folder: Path) -> dict[str, Any]:
    return {path.name: json.loads(path.read_text()) for path in (folder / "runs").glob("*.json")}


def test_runs_are_stored_once_and_a_failing_one_loses_only_itself(tmp_path: Path, capsys: Captured) -> None:
    (tmp_path / "killed.py").write_text(KILLED)
    (tmp_path / "raising.py").write_text(RAISING)
    path = plan_file(
        tmp_path,
        ONE
        + '[[variants]]\nname = "none"\n[[variants]]\nname = "none again"\n'
        + '[[variants]]\nname = "raising"\nseparators = ["./raising.py"]\n'
        + '[[variants]]\nname = "killed"\nseparators = ["./killed.py"]\n',
    )
    out = tmp_path / "out"
    assert run(["experiment", "run", str(path), "--output", str(out)]) == 5
    captured = capsys.readouterr()
    assert "4 runs, 0 stored before, 2 done, 2 failed" in captured.out
    assert "raising: separator 'raising': separate() raised RuntimeError: out of ideas" in captured.err
    assert "killed: the process was ended by SIGKILL" in captured.err
    stored = records(out)
    assert {tuple(record["settings"]["separators"]) for record in stored.values()} == {(), ("link",)}
    # The separator is mended: its run has another fingerprint, and the others are not run again.
    times = {p: p.stat().st_mtime_ns for p in (out / "runs").iterdir()}
    for name in ("raising", "killed"):
        (tmp_path / f"{name}.py").write_text(
            RAISING.replace('raise RuntimeError("out of ideas")', "return []")
        )
    assert run(["experiment", "run", str(path), "--output", str(out)]) == 0
    assert "4 runs, 2 stored before, 2 done, 0 failed" in capsys.readouterr().out
    assert {p: p.stat().st_mtime_ns for p in times} == times
    assert not list((out / "failed").iterdir())
    assert run_experiment(path, out).done == 0


def test_a_record_says_what_was_asked_and_what_came_out(tmp_path: Path) -> None:
    (task,) = tasks_from(tmp_path, ONE)
    record, ledger = carry_out(task.data)
    assert ledger is not None
    outcome = record["outcome"]
    assert (outcome["status"], outcome["integral"]) == ("integral", True)
    assert outcome["lp"] == pytest.approx(16.5)
    assert outcome["lp_after_cuts"] == pytest.approx(17)
    assert outcome["separators"]["link"]["added"] == record["cuts"]["link"]["taken"] > 0
    assert record["cuts"]["link"]["active"] > 0
    assert outcome["seconds"]["total"] >= outcome["seconds"]["lp"] + outcome["seconds"]["separation"] > 0
    assert outcome["seconds"]["processor"] > 0
    assert record["instance"]["points"] == 12
    json.dumps(record)


def test_a_whole_solve_and_plain_scip_agree(tmp_path: Path) -> None:
    text = ONE + 'preset = "solve"\n[[variants]]\nname = "plain"\npreset = "plain"\n'
    solve, plain = (carry_out(task.data)[0]["outcome"] for task in tasks_from(tmp_path, text))
    assert solve["status"] == plain["status"] == "optimal"
    assert solve["value"] == plain["value"] == 17
    assert plain["seconds"]["lp"] > 0


def test_a_cutoff_keeps_the_optimum(tmp_path: Path) -> None:
    text = ONE.replace("spanning = true", "spanning = true\noptimum = 17")
    text += (
        'cutoff = true\n[[variants]]\nname = "root"\npreset = "root"\ncutoff = true\nseparators = ["link"]\n'
    )
    loop, root = (carry_out(task.data)[0]["outcome"] for task in tasks_from(tmp_path, text))
    assert loop["columns_after_fixing"] < loop["columns"]
    assert loop["lp_after_cuts"] == pytest.approx(17)
    assert (root["status"], root["value"]) == ("optimal", 17)


def test_orbits_bound_symmetric_instances(tmp_path: Path) -> None:
    text = ONE.replace("random:12,3,seed=1000", "dodecahedron").replace("spanning = true", "")
    (task,) = tasks_from(tmp_path, text + 'method = "orbits"\n')
    record, ledger = carry_out(task.data)
    assert ledger is None
    assert record["outcome"]["lp"] == pytest.approx(22.5)
    assert record["outcome"]["lp_after_cuts"] == pytest.approx(23)


def test_memory_is_limited_for_each_run(tmp_path: Path) -> None:
    (tmp_path / "greedy.py").write_text(GREEDY)
    plan = read_plan(plan_file(tmp_path, ONE.replace('"link"]', '"./greedy.py"]')))
    for limit, ended in ((None, (1, 0)), (2.0, (0, 1))):
        limited = replace(plan, variants=(replace(plan.variants[0], memory_limit=limit),))
        progress = run_experiment(limited, tmp_path / f"out-{limit}")
        assert (progress.done, len(progress.failures)) == ended
    assert "MemoryError" in progress.failures[0][2]


SLEEPING = """
import pathlib
import signal
import time
from bcut import Separator

class Sleeping(Separator):
    \"\"\"Sleeps, and is not to be woken.\"\"\"
    name = "sleeping"

    def separate(self, point):
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        pathlib.Path(__file__).with_suffix(".asleep").touch()
        time.sleep(600)
        return []
"""

# Its runs do not end before somebody removes a file.
HOLDING = """
import pathlib
import time
from bcut import Separator

class Holding(Separator):
    \"\"\"Waits until it is released.\"\"\"
    name = "holding"

    def separate(self, point):
        while pathlib.Path(__file__).with_suffix(".hold").exists():
            time.sleep(0.05)
        return []
"""


def test_a_run_that_hangs_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bcut.experiments.process._PATIENCE", 1.0)
    monkeypatch.setattr("bcut.experiments.process._GRACE", 2.0)
    (tmp_path / "sleeping.py").write_text(SLEEPING)
    (task,) = tasks_from(tmp_path, ONE.replace('"link"]', '"./sleeping.py"]') + "time_limit = 0.5\n")
    outcome = run_in_process(task.data)
    assert outcome.error is not None
    assert "long after its time limit of 0.5 seconds" in outcome.error["message"]
    assert run_in_process(task.data, stop=lambda: True) == Outcome()


def test_a_run_ends_with_the_program_that_started_it(tmp_path: Path) -> None:
    (tmp_path / "sleeping.py").write_text(SLEEPING)
    (task,) = tasks_from(tmp_path, ONE.replace('"link"]', '"./sleeping.py"]'))
    command = [sys.executable, "-m", "bcut.experiments.execute", str(tmp_path)]
    reading, writing = os.pipe()
    with open(writing, "wb") as pipe, open(reading, "rb") as end, started(command, stdin=end) as program:
        pipe.write(json.dumps(task.data).encode() + b"\n")
        pipe.flush()
        program.until((tmp_path / "sleeping.asleep").exists)
        pipe.close()
        assert program.end().status == 3


def test_without_distributed_the_runs_go_through_threads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "bcut.experiments.cluster", None)
    path = plan_file(tmp_path, ONE)
    with pytest.raises(ExperimentError, match=r"pip install 'bcut\[experiments\]'"):
        run_experiment(path, tmp_path / "out", scheduler="tcp://127.0.0.1:1")
    assert run_experiment(path, tmp_path / "out").done == 1


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_what_is_interrupted_or_killed_goes_on_where_it_was(tmp_path: Path, how: signal.Signals) -> None:
    (tmp_path / "holding.py").write_text(HOLDING)
    (tmp_path / "holding.hold").touch()
    path, out = plan_file(tmp_path, SEVERAL.replace('"link"]', '"./holding.py"]')), tmp_path / "out"
    with started([*COMMAND, str(path), "--output", str(out), "--workers", "1"]) as program:
        program.until(lambda: list((out / "runs").glob("*.json")))
        program.signal(how)
        ended = program.end()
    if how == signal.SIGINT:
        assert ended.status == 130
        assert "not run" in ended.out
    (tmp_path / "holding.hold").unlink()
    before = {p: p.stat().st_mtime_ns for p in (out / "runs").glob("*.json")}
    assert 1 <= len(before) < 6
    progress = run_experiment(path, out)
    assert (progress.total, progress.stored, progress.done) == (6, len(before), 6 - len(before))
    assert not progress.failures
    assert {p: p.stat().st_mtime_ns for p in before} == before
    assert len(records(out)) == 6


def test_two_processes_do_not_run_one_experiment(tmp_path: Path) -> None:
    store = Store(tmp_path / "out")
    store.prepare()
    with store.locked(), pytest.raises(ExperimentError, match="another process is running"):
        run_experiment(plan_file(tmp_path, ONE), tmp_path / "out")


def test_a_terminal_shows_a_bar_with_the_time_left(tmp_path: Path) -> None:
    path = plan_file(tmp_path, ONE)
    status, out, shown = on_terminal([*COMMAND, str(path), "--output", str(tmp_path / "out")], columns=140)
    assert status == 0
    assert out.endswith("1 runs, 0 stored before, 1 done, 0 failed\n")
    assert "0/1" in shown
    assert "left" in shown


def test_an_empty_folder_has_no_report(tmp_path: Path, capsys: Captured) -> None:
    assert run(["experiment", "report", str(tmp_path)]) == 2
    assert "holds no experiment" in capsys.readouterr().err


def test_a_plan_can_be_a_value_too(tmp_path: Path) -> None:
    plan = read_plan(plan_file(tmp_path, SEVERAL))
    assert isinstance(plan, Plan)
    assert len(list(tasks_of(plan))) == 6


def test_every_family_of_this_program_has_a_checker_of_its_cuts() -> None:
    from bcut.verification.cuts import CUT_CHECKERS

    assert set(built_in_names()) <= set(CUT_CHECKERS)

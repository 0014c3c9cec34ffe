"""Experiments: plans are read strictly, runs are known by what they depend on, nothing stored is lost or run again."""

from __future__ import annotations

import json
import os
import signal
import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from laboratory import plan_file, tasks_from
from processes import BCUT, on_terminal, started

from bcut.cli.main import run
from bcut.errors import ExperimentError, InputError, PlanError
from bcut.experiments.cases import collection_names, read_collection
from bcut.experiments.engine import run_experiment
from bcut.experiments.execute import carry_out
from bcut.experiments.plan import Plan, read_plan
from bcut.experiments.process import Outcome, run_in_process
from bcut.experiments.ranges import values_of
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


# Plans.


@pytest.mark.parametrize(
    ("given", "values"),
    [
        ([3, 1], [3, 1]),
        (["a", "b"], ["a", "b"]),
        (7, [7]),
        ("0..3", [0, 1, 2, 3]),
        (" 12 .. 24 : 4 ", [12, 16, 20, 24]),
        ("12..23:4", [12, 16, 20]),
        ("5..5", [5]),
    ],
)
def test_a_range_is_a_list_or_a_text_with_both_ends(given: Any, values: list[Any]) -> None:
    assert values_of(given) == values


def test_a_plan_names_every_combination(tmp_path: Path) -> None:
    (tmp_path / "points.json").write_text('{"points": [[0, 0], [1, 0], [0, 1], [1, 1]]}')
    plan = read_plan(
        plan_file(
            tmp_path,
            """
            objective = "random-costs:1"
            [[instances]]
            instance = "random:{n},3,seed={s}"
            class = "n = {n}"
            objective = "random-costs:{s}"
            sense = "max"
            for = { n = [10, 12], s = "4..5" }
            [[instances]]
            file = "points.json"
            optimum = "7/2"
            [[variants]]
            name = "a"
            """,
        )
    )
    random = plan.cases[:4]
    assert [(c.instance, c.label, c.objective) for c in random] == [
        ("random:10,3,seed=4", "n = 10", "random-costs:4"),
        ("random:10,3,seed=5", "n = 10", "random-costs:5"),
        ("random:12,3,seed=4", "n = 12", "random-costs:4"),
        ("random:12,3,seed=5", "n = 12", "random-costs:5"),
    ]
    assert {c.sense for c in random} == {"max"}
    last = plan.cases[4]
    assert last.instance == str(tmp_path / "points.json")
    assert (last.objective, last.sense, last.optimum) == ("random-costs:1", "min", Fraction(7, 2))
    assert len(plan.cases) == 5


def test_settings_at_the_top_are_for_all_variants_that_they_can_concern(tmp_path: Path) -> None:
    plan = read_plan(
        plan_file(
            tmp_path,
            """
            time_limit = 7
            cutoff = true
            scip = ["zerohalf:unlimited", "gomory"]
            method = "listing"
            [[instances]]
            instance = "cube:3"
            optimum = 5
            [[variants]]
            name = "loop"
            [[variants]]
            name = "root"
            preset = "root"
            [[variants]]
            name = "solve"
            preset = "solve"
            time_limit = 3
            [[variants]]
            name = "plain"
            preset = "plain"
            """,
        )
    )
    loop, root, solve, plain = plan.variants
    assert (loop.cutoff, loop.scip, loop.time_limit, loop.method, loop.ledger) == (
        True,
        (),
        7,
        "listing",
        True,
    )
    assert (root.cutoff, root.scip, root.method) == (True, ("zerohalf:unlimited", "gomory"), "")
    assert (solve.cutoff, solve.scip, solve.time_limit, solve.ledger) == (False, (), 3, False)
    assert (plain.cutoff, plain.separators, plain.time_limit) == (False, (), 7)


def test_an_ablation_is_none_all_each_and_all_but_each(tmp_path: Path) -> None:
    plan = read_plan(
        plan_file(
            tmp_path,
            """
            protocol = "ablation"
            preset = "root"
            separators = ["link", "odd-cycle:max_cuts=40", "./mine.py"]
            [[instances]]
            instance = "cube:3"
            [[variants]]
            name = "zero-half"
            preset = "root"
            scip = ["zerohalf"]
            """.replace('"./mine.py"', '"clique"'),
        )
    )
    cycles = "odd-cycle:max_cuts=40"
    assert {v.name: v.separators for v in plan.variants} == {
        "none": (),
        "all": ("link", cycles, "clique"),
        "only link": ("link",),
        "only odd-cycle": (cycles,),
        "only clique": ("clique",),
        "without link": (cycles, "clique"),
        "without odd-cycle": ("link", "clique"),
        "without clique": ("link", cycles),
        "zero-half": (),
    }
    assert {v.preset for v in plan.variants} == {"root"}
    assert [v.role for v in plan.variants].count("only") == 3
    assert plan.variants[-1].role == ""


GOOD_INSTANCES = '[[instances]]\ninstance = "cube:3"\n'
GOOD_VARIANTS = '[[variants]]\nname = "a"\n'
GOOD = GOOD_INSTANCES + GOOD_VARIANTS


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("name = 3 4", r"plan\.toml: is no TOML: .*line 1"),
        ("", r"'instances' is missing"),
        (GOOD_INSTANCES, r"'variants' is missing"),
        (GOOD + "seperators = []\n", r"plan\.toml, line 5: .*variants.* number 1, 'seperators'.* mean 'separators'"),
        ("objektive = 1\n" + GOOD, r"line 1: 'objektive' is no known key; did you mean 'objective'"),
        (GOOD + 'preset = "rot"\n', r"line 5: .*'preset' is one of loop, root, solve, plain, .*, not 'rot'"),
        (GOOD + 'separators = ["linc"]\n', r"line 5: .*unknown separator 'linc': did you mean 'link'"),
        (GOOD + 'separators = ["clique:size=3"]\n', r"line 5: .*no parameter 'size'"),
        (GOOD + 'separators = ["./none.py"]\n', r"none\.py: there is no such file"),
        (GOOD + 'separators = "link"\n', r"'separators' is a list of texts"),
        (GOOD + 'preset = "root"\nscip = ["zerohlf"]\n', r"line 6: .*'zerohlf', but SCIP's separators are .*zerohalf"),
        (GOOD + 'scip = ["zerohalf"]\n', r"for preset 'root' only, not 'loop'"),
        (GOOD + 'preset = "solve"\ncutoff = true\n', r"'cutoff' is for presets 'loop' and 'root', not 'solve'"),
        (GOOD + 'preset = "plain"\nseparators = ["link"]\n', r"has no meaning with preset 'plain'"),
        (GOOD + "time_limit = -1\n", r"'time_limit' is a number from 0 on, not -1"),
        (GOOD + 'time_limit = "5"\n', r"'time_limit' is a number from 0 on"),
        (GOOD + "seed = 1.5\n", r"'seed' is an integer"),
        (GOOD + "ledger = 1\n", r"'ledger' is true or false, not 1"),
        (GOOD + GOOD_VARIANTS, r"has the name 'a' twice"),
        ('separators = ["link"]\n' + GOOD, r"line 1: .*'separators' is about the protocol 'ablation'; without one"),
        (GOOD_INSTANCES + "[[variants]]\n", r"line 3: .*'name' is missing"),
        ("[[instances]]\n" + GOOD_VARIANTS, r"names one of instance, file and collection"),
        ('[[instances]]\ninstance = "cube:{n}"\n' + GOOD_VARIANTS, r"line 2: .*placeholder \{n\} without a range"),
        ('[[instances]]\ninstance = "cube:{n"\n' + GOOD_VARIANTS, r"braces that do not pair"),
        (
            '[[instances]]\ninstance = "cube:3"\nfor = { n = [3] }\n' + GOOD_VARIANTS,
            r"line 3: .*range to 'n', which no pattern uses",
        ),
        (
            '[[instances]]\ninstance = "cube:{n}"\nfor = { n = "3-4" }\n' + GOOD_VARIANTS,
            r"line 3: .*range such as \"0\.\.29\"",
        ),
        ('[[instances]]\ncollection = "gab-set"\n' + GOOD_VARIANTS, r"'gab-set' is neither bundled"),
        ('[[instances]]\ninstance = "cube:3"\nsense = "least"\n' + GOOD_VARIANTS, r"one of min, max, not 'least'"),
        ('[[instances]]\ninstance = "cube:3"\noptimum = "x"\n' + GOOD_VARIANTS, r"'optimum' is a number or a rational"),
        ('instances = "cube:3"\n' + GOOD_VARIANTS, r"write \[\[instances\]\]"),
        ('protocol = "ablasion"\n' + GOOD, r"'protocol' is one of ablation"),
        ('protocol = "ablation"\n' + GOOD, r"an ablation says which separators"),
    ],
)  # fmt: skip
def test_a_bad_plan_is_refused_with_the_place(tmp_path: Path, text: str, says: str, capsys: Captured) -> None:
    path = plan_file(tmp_path, text)
    with pytest.raises(PlanError, match=says):
        read_plan(path)
    assert run(["experiment", "run", str(path), "--output", str(tmp_path / "out")]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("Error: ")
    assert not captured.out
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('[[instances]]\ninstance = "cub:3"\n' + GOOD_VARIANTS, "did you mean cube"),
        (GOOD_INSTANCES + GOOD_VARIANTS + "cutoff = true\n", "that of cube:3 is not known"),
    ],
)
def test_what_a_plan_asks_for_has_to_exist(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        tasks_from(tmp_path, text)


def test_the_plans_of_the_repository_can_be_read() -> None:
    plans = sorted((Path(__file__).resolve().parent.parent / "experiments").glob("*.toml"))
    assert plans
    for path in plans:
        plan = read_plan(path)
        assert plan.description
        assert plan.cases


def test_the_bundled_collections_can_be_read() -> None:
    import bcut.instances

    assert {"gap-set", "hard-set"} <= set(collection_names())
    assert not set(collection_names()) & set(bcut.instances.names())
    for name in collection_names():
        members = read_collection(bcut.instances.path(name))
        keys = [(m.instance, m.objective, m.sense, m.spanning) for m in members]
        assert len(set(keys)) == len(keys) > 0
    gap_set = read_collection(bcut.instances.path("gap-set"))
    assert all(member.optimum is not None for member in gap_set)
    data = json.loads(bcut.instances.path("gap-set").read_text())
    for member in data["members"]:
        sign = 1 if member["sense"] == "min" else -1
        assert sign * (Fraction(member["optimum"]) - Fraction(member["lp"])) > 1e-7


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

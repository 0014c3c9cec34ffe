"""What several runs say together: the root LP that gaps are measured from, the optimum, and contradictions."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from laboratory import carried_out, plan_file

from bcut.cli.main import run
from bcut.errors import ExperimentError
from bcut.experiments.engine import run_experiment
from bcut.experiments.reporting.known import Stored, contradictions_among, root_lp
from bcut.experiments.reporting.report import write_report
from bcut.experiments.reporting.runs import load_experiment
from bcut.experiments.store import Store

Captured = pytest.CaptureFixture[str]

PLAN = """
spanning = true
[[instances]]
instance = "random:12,3,seed=1000"
[[instances]]
instance = "random:10,3,seed=1"
[[variants]]
name = "none"
[[variants]]
name = "link"
separators = ["link"]
[[variants]]
name = "bcut"
preset = "solve"
[[variants]]
name = "SCIP"
preset = "plain"
"""


def record(preset: str, lp: float | None = None, method: str = "", **outcome: Any) -> dict[str, Any]:
    known = {"lp": lp, "lp_after_cuts": lp, "status": "limit", "value": None, "rounds": [], **outcome}
    return {"settings": {"preset": preset, "method": method, "cutoff": False}, "outcome": known}


def entry(variant: str, **more: Any) -> dict[str, Any]:
    problem = {"instance": "cube:3", "objective": "cardinality", "sense": "min", "spanning": False}
    return {
        **problem,
        "formulation": "2",
        "optimum": None,
        "variant": variant,
        "fingerprint": f"of {variant}",
        **more,
    }


def said(stored: Iterable[Stored]) -> list[tuple[str, str]]:
    return [(found.first.who, found.second.who) for found in contradictions_among(stored)]


# The root LP.

LISTING = record("loop", 16.5, "listing")
ORBITS = record("loop", 16.500001, "orbits")
# Multipliers that prove a bound below the relaxation's.
FIXING = record("loop", 16.2, "fixing")
ROOT = record("root", 16.6)
SOLVE = record("solve", 16.4, "auto")
SOLVE_BY_MULTIPLIERS = record(
    "solve", 16.1, "auto", stages={"multipliers": 1.0, "root": 1.0}, rounds=[[16.5, {}]]
)
SOLVE_OF_A_PART = record("solve", 16.9, "elimination", stages={"diamond": 1.0, "skeleton": 1.0})
PRESOLVED = record("plain", 16.8)


@pytest.mark.parametrize(
    ("records", "lp"),
    [
        # Whatever else is stored, and in which order, the listed relaxation counts.
        ([LISTING, FIXING], 16.5),
        ([FIXING, LISTING], 16.5),
        ([LISTING, record("loop", 16.500002, "listing")], 16.5),
        ([PRESOLVED, SOLVE, ROOT, ORBITS, LISTING, FIXING], 16.5),
        # It did not end in time.
        ([record("loop", None, "listing"), ORBITS], 16.500001),
        ([SOLVE, PRESOLVED, ROOT, ORBITS], 16.500001),
        ([PRESOLVED, SOLVE, ROOT], 16.6),
        ([PRESOLVED, SOLVE], 16.4),
        # None of these is the LP.
        ([FIXING], None),
        ([PRESOLVED, SOLVE_BY_MULTIPLIERS, SOLVE_OF_A_PART, record("solve", 16.7, "scip")], None),
        ([record("delaunay"), record("sizes")], None),
    ],
)  # fmt: skip
def test_gaps_are_measured_from_the_relaxation_with_all_simplices(
    records: list[dict[str, Any]], lp: float | None
) -> None:
    assert root_lp(records) == lp


def test_a_loop_by_multipliers_does_not_move_the_baseline_of_the_others(tmp_path: Path) -> None:
    text = PLAN.partition("[[variants]]")[0] + (
        '[[variants]]\nname = "link"\nseparators = ["link"]\n'
        '[[variants]]\nname = "fixing"\nmethod = "fixing"\n'
        '[[variants]]\nname = "bcut"\npreset = "solve"\n'
    )
    store = carried_out(tmp_path, text)
    change(store, "fixing", lp=12.0)
    runs = load_experiment(store.folder).runs
    own = {run.variant: run for run in runs if run.entry["instance"] == "random:12,3,seed=1000"}
    assert own["fixing"].outcome["lp"] == 12
    assert [run.lp for run in own.values()] == [pytest.approx(16.5)] * 3
    assert own["link"].gap_closed == pytest.approx(1)


# Contradictions.


def test_proofs_that_agree_are_no_contradiction() -> None:
    solved = record("solve", status="optimal", value=17)
    stored = [
        (entry("link"), record("loop", 17.0000001, "listing", status="integral")),
        (entry("solve"), solved),
        (entry("other formulation", formulation="1"), solved),
        (entry("root"), record("root", status="optimal", value=17)),
        (entry("Delaunay"), record("delaunay", status="verified", value=19)),
        (entry("stopped"), record("plain", value=17)),
        (entry("other problem", sense="max"), record("solve", status="optimal", value=23)),
        (entry("not solved"), record("sizes", status="counted")),
    ]
    assert said(stored) == []


@pytest.mark.parametrize(
    "other",
    [
        (entry("other"), record("plain", status="optimal", value=18)),
        (entry("other", formulation="chambers"), record("solve", status="optimal", value=16)),
        (entry("other"), record("root", status="optimal", value=18)),
        (entry("other"), record("loop", 16.9, "listing", status="integral")),
        (entry("other"), record("solve", status="infeasible")),
        # Better than what has been proven to be the best.
        (entry("other"), record("delaunay", status="verified", value=16)),
    ],
)
def test_proofs_that_differ_are_a_contradiction_whatever_comes_first(other: Stored) -> None:
    solved = (entry("solve"), record("solve", status="optimal", value=17))
    assert said([solved, other]) == [("solve", "other")]
    proven = other[1]["outcome"]["status"] != "verified"
    assert said([other, solved]) == ([("other", "solve")] if proven else [("solve", "other")])


def test_a_maximum_is_contradicted_by_more_and_not_by_less() -> None:
    solved = (entry("solve", sense="max"), record("solve", status="optimal", value=17))
    for value, contradicts in ((16, False), (18, True)):
        other = (entry("Delaunay", sense="max"), record("delaunay", status="verified", value=value))
        assert bool(said([solved, other])) is contradicts


def test_a_plan_can_be_contradicted_too() -> None:
    stored = [
        (entry("one", optimum="17"), record("solve", status="optimal", value=17)),
        (entry("two", optimum="17"), record("solve", status="optimal", value=18)),
    ]
    (found,) = contradictions_among(stored)
    assert found.told_of(found.second) == (
        "found the optimum 18, but the plan says the optimum 17: one of them is wrong; see runs/of two.json"
    )


def test_nothing_better_than_a_cutoff_is_not_infeasible() -> None:
    within = record("root", status="infeasible")
    within["settings"]["cutoff"] = True
    assert (
        said([(entry("solve"), record("solve", status="optimal", value=17)), (entry("root"), within)]) == []
    )


def change(store: Store, variant: str, instance: str = "random:12,3,seed=1000", **outcome: Any) -> None:
    """Change what came out of a stored run."""
    for found in store.load_manifest()["runs"]:
        if (found["variant"], found["instance"]) == (variant, instance):
            stored = store.load(found["fingerprint"])
            assert stored is not None
            stored["outcome"] |= outcome
            path = store.runs / f"{found['fingerprint']}.json"
            path.write_text(json.dumps(stored), encoding="utf-8")


@pytest.fixture
def disputed(tmp_path: Path) -> Store:
    """An experiment where SCIP claims another optimum than `bcut solve` and the loop with link cuts."""
    store = carried_out(tmp_path, PLAN)
    assert load_experiment(store.folder).contradictions == []
    change(store, "SCIP", value=18)
    return store


def test_the_report_lists_a_contradiction_and_does_not_end_well(disputed: Store, capsys: Captured) -> None:
    with pytest.raises(ExperimentError, match="runs contradict each other"):
        write_report(disputed.folder)
    assert run(["experiment", "report", str(disputed.folder)]) == 2
    message = capsys.readouterr().err
    assert (
        "random:12,3,seed=1000, SCIP: found the optimum 18, but variant 'link' says the optimum 17" in message
    )
    page = (disputed.folder / "report" / "report.html").read_text(encoding="utf-8")
    section = page.partition('<section id="contradictions"')[2].partition("</section>")[0]
    for word in ("random:12,3,seed=1000", "link", "the optimum 17", "SCIP", "the optimum 18"):
        assert f"<td>{word}</td>" in section
    assert ", 1 contradiction." in page
    with (disputed.folder / "report" / "contradictions.csv").open(newline="") as stream:
        (row,) = csv.DictReader(stream)
    for key in ("fingerprint", "other_fingerprint"):
        assert disputed.has(row[key])
        assert row[key] in message


def test_nothing_is_measured_by_an_optimum_in_dispute(disputed: Store) -> None:
    runs = load_experiment(disputed.folder).runs
    assert {run.settled for run in runs if run.entry["instance"] == "random:12,3,seed=1000"} == {False}
    assert {run.optimum for run in runs if run.entry["instance"] == "random:12,3,seed=1000"} == {None}
    others = [run for run in runs if run.entry["instance"] == "random:10,3,seed=1"]
    assert len({run.optimum for run in others}) == 1
    assert {run.variant for run in others if run.settled} >= {"bcut", "SCIP"}


def test_runs_that_contradict_each_other_have_failed(
    disputed: Store, tmp_path: Path, capsys: Captured
) -> None:
    command = ["experiment", "run", str(plan_file(tmp_path, PLAN)), "--output", str(disputed.folder)]
    for _ in range(2):  # and again: they are stored, which does not make them right
        assert run(command) == 5
        printed = capsys.readouterr()
        assert "8 runs, 6 stored before, 0 done, 2 failed\n" in printed.out
        assert (
            "failed: random:12,3,seed=1000, SCIP: found the optimum 18, but variant 'link' says"
            in printed.err
        )
        assert (
            "failed: random:12,3,seed=1000, link: found the optimum 17, but variant 'SCIP' says"
            in printed.err
        )
    (wrong,) = [
        path
        for path in disputed.runs.glob("*.json")
        if json.loads(path.read_text())["outcome"]["value"] == 18
    ]
    wrong.unlink()
    progress = run_experiment(plan_file(tmp_path, PLAN), disputed.folder)
    assert (progress.stored, progress.done, progress.failures) == (7, 1, [])
    assert write_report(disputed.folder)


def test_a_run_that_contradicts_the_plan_has_failed_as_soon_as_it_ends(tmp_path: Path) -> None:
    text = '[[instances]]\ninstance = "cube:3"\noptimum = 6\n[[variants]]\nname = "bcut"\npreset = "solve"\n'
    progress = run_experiment(plan_file(tmp_path, text), tmp_path / "out")
    assert (progress.total, progress.stored, progress.done) == (1, 0, 0)
    ((instance, variant, message),) = progress.failures
    assert (instance, variant) == ("cube:3", "bcut")
    assert message.startswith("found the optimum 5, but the plan says the optimum 6")


def test_an_integral_root_of_scip_is_a_proof_and_that_of_the_loop_a_point(tmp_path: Path) -> None:
    text = """
    [[instances]]
    instance = "random:14,3,seed=9"
    spanning = true
    [[variants]]
    name = "loop"
    [[variants]]
    name = "SCIP root"
    preset = "root"
    scip = ["zerohalf"]
    """
    loop, root = load_experiment(carried_out(tmp_path, text).folder).runs
    assert (loop.outcome["status"], loop.outcome["integral"], loop.settled) == ("dry", False, False)
    # Proven by rounding: the last relaxation is not at the optimum, so its point is no triangulation.
    assert (root.outcome["status"], root.outcome["integral"], root.settled) == ("optimal", True, True)
    assert root.outcome["lp_after_cuts"] < root.outcome["value"] - 0.01

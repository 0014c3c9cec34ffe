"""The page about experiments: its plan is a plan, its commands run, and its tables name every key there is."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest

from bcut.cli.main import run
from bcut.experiments import cases, drawings, plan, variants

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "docs" / "experiments.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def test_the_first_experiment_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (text,) = blocks("toml")
    Path("first.toml").write_text(text, encoding="utf-8")
    commands, about_cuts = blocks("sh")
    for line in commands.splitlines():
        assert run(shlex.split(line)[1:]) == 0, line
    # Without either of two separators is the other one alone: the same runs.
    assert "15 runs, 0 stored before, 15 done, 0 failed" in capsys.readouterr().out
    page = Path("results/report/report.html").read_text(encoding="utf-8")
    assert "without odd-cycle" in page
    ledger = max(Path("results/runs").glob("*.gz"), key=lambda path: path.stat().st_size)
    for line in about_cuts.splitlines():
        assert run(shlex.split(line.replace("LEDGER.cuts.jsonl.gz", ledger.name))[1:]) == 0, line


@pytest.mark.parametrize(
    ("section", "keys"),
    [
        ("at the top", set(plan._TOP)),
        (r"in `\[\[instances\]\]`", set(cases._KEYS)),
        (r"in `\[\[variants\]\]`", set(variants._KEYS)),
        (r"in `\[\[figures\]\]`", set(drawings._KEYS)),
    ],
)
def test_every_key_of_a_plan_is_explained(section: str, keys: set[str]) -> None:
    found = re.search(rf"\| {section} \| \|\n\|---\|---\|\n((?:\|.*\n)+)", PAGE)
    assert found is not None
    explained: set[str] = set()
    for row in found[1].splitlines():
        explained |= set(re.findall(r"`\[*(\w+)", row.split("|")[1]))
    assert keys <= explained


def test_what_the_page_says_of_the_collections_is_in_them() -> None:
    import bcut.instances

    gap_set, hard_set = (
        json.loads(bcut.instances.path(name).read_text()) for name in ("gap-set", "hard-set")
    )
    chosen = {label: tuple(text.split(" of ")) for label, text in gap_set["chosen"].items()}
    random = [chosen[f"random 3D, n = {n}, spanning, min"] for n in range(12, 25, 2)]
    assert {total for _, total in random} == {"30"}
    assert f"| {', '.join(some for some, _ in random)} of 30 each |" in PAGE
    for label in ("sphere 3D, max", "random costs 2D, spanning, min", "random costs 3D, spanning, min"):
        assert f"| {' of '.join(chosen[label])} |" in PAGE
    assert sum(int(some) for some, _ in chosen.values()) == len(gap_set["members"])
    integral = {
        (member["instance"], str(round(member["lp"])), str(member["optimum"]))
        for member in hard_set["members"]
        if "optimum" in member and abs(member["lp"] - round(member["lp"])) < 1e-6
        if abs(member["lp"] - member["optimum"]) > 0.5
    }
    assert integral == set(re.findall(r"\| `(\S+)`, .* \| (\d+) \| (\d+) \|", PAGE))


def test_every_preset_is_explained() -> None:
    for preset in variants.PRESETS:
        assert f"* `{preset}`: " in PAGE

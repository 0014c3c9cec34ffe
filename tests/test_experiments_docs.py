"""The page about experiments: its plan is a plan, its commands run, and its tables name every key there is."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from bcut.cli.main import run
from bcut.experiments import cases, plan, variants

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
    ],
)
def test_every_key_of_a_plan_is_explained(section: str, keys: set[str]) -> None:
    found = re.search(rf"\| {section} \| \|\n\|---\|---\|\n((?:\|.*\n)+)", PAGE)
    assert found is not None
    explained: set[str] = set()
    for row in found[1].splitlines():
        explained |= set(re.findall(r"`\[*(\w+)", row.split("|")[1]))
    assert keys <= explained


def test_every_preset_is_explained() -> None:
    for preset in variants.PRESETS:
        assert f"* `{preset}`: " in PAGE

"""The page about writing a separator: followed from its first line to its last, every command and every figure."""

from __future__ import annotations

import csv
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from bcut.cli.main import run

PAGE = (Path(__file__).resolve().parent.parent / "docs" / "your-own-separator.md").read_text(encoding="utf-8")
Captured = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def blocks() -> Iterator[re.Match[str]]:
    """Go through the blocks of code in the order of the page."""
    return re.finditer(r"```(\w+)\n(.*?)```", PAGE, re.DOTALL)


def bounds_on_the_page() -> list[str]:
    return re.findall(r"goes from ([\d.]+) to ([\d.]+)|again: ([\d.]+),", PAGE)


def test_the_page_can_be_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured, blocks: Iterator[re.Match[str]]
) -> None:
    monkeypatch.chdir(tmp_path)
    (before, first, _), (_, _, second) = bounds_on_the_page()
    bounds = [(before, first), (before, second)]
    for block in blocks:
        language, text = block.groups()
        if language == "python":
            Path("my_cuts.py").write_text(text, encoding="utf-8")
        elif language == "toml":
            Path("mine.toml").write_text(text, encoding="utf-8")
        else:
            for line in text.splitlines():
                assert run(shlex.split(line)[1:]) == 0, line
                printed = capsys.readouterr().out
                if line.startswith("bcut separators check"):
                    assert "passed" in printed
                if line.startswith("bcut bound"):
                    lp, after = re.findall(r"root LP +([\d.]+), after cuts ([\d.]+)", printed)[0]
                    expected = bounds.pop(0)
                    assert (f"{float(lp):.3f}", f"{float(after):.3f}") == expected
    assert not bounds
    with Path("mine/report/ablation.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert any("my_cuts" in " ".join(map(str, row.values())) for row in rows)
    assert "my_cuts" in Path("mine/report/report.html").read_text(encoding="utf-8")

"""The README and the other documents keep what they promise: commands run, code runs, links lead somewhere."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

import bcut
from bcut.cli.main import run
from bcut.separation.cases import CASES
from bcut.separation.resolve import resolve

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
DOCUMENTS = [path for path in ROOT.rglob("*.md") if not {".venv", ".pytest_cache"} & set(path.parts)]
Captured = pytest.CaptureFixture[str]


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def code_lines(block: str) -> list[str]:
    return [line for line in block.splitlines() if line.strip()]


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "instances").symlink_to(ROOT / "instances")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_first_two_commands_stand_for_themselves() -> None:
    install, tests, *_ = blocks("sh")
    for command in (install, tests):
        assert len(code_lines(command)) == 1
        assert command.startswith("python3 -m venv .venv && .venv/bin/pip install -q -c constraints.txt -e ")
    assert "&& .venv/bin/bcut solve " in install
    assert "pytest" in tests


@pytest.mark.usefixtures("elsewhere")
def test_the_command_lines_run(capsys: Captured) -> None:
    solve, bound, verify = (shlex.split(line)[1:] for line in code_lines(blocks("sh")[2]))
    assert run(solve) == 0
    assert "value       36" in capsys.readouterr().out
    assert run([*bound, "--json"]) == 0
    assert '"lp_after_cuts": 1.0' in re.sub(r"0\.999999\d+|1\.000000\d+", "1.0", capsys.readouterr().out)
    assert run(verify) == 0
    assert "value 36" in capsys.readouterr().out


@pytest.mark.usefixtures("elsewhere")
def test_the_objectives_run(capsys: Captured) -> None:
    (block,) = [block for block in blocks("sh") if "--then" in block]
    (command,) = code_lines(block)
    assert run(shlex.split(command)[1:]) == 0
    assert re.search(r"optimal \(proven (exactly|within a relative gap of 1e-9)\)", capsys.readouterr().out)


@pytest.mark.usefixtures("elsewhere")
def test_the_python_runs_and_prints_what_it_says(capsys: Captured) -> None:
    code = blocks("python")[0]
    assert len(code_lines(code)) <= 10
    exec(compile(code, "README.md", "exec"), {})
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "16 16 optimal"
    assert lines[2].startswith("optimal, proven exactly")
    assert float(lines[3]) >= 22.5 - 1e-6


def test_the_separator_passes_its_check_and_runs(elsewhere: Path, capsys: Captured) -> None:
    code = blocks("python")[1]
    assert len(code_lines(code)) <= 15
    (elsewhere / "triples.py").write_text(code)
    report = bcut.check_separator(lambda: resolve("./triples.py"), CASES[::3])
    assert report.ok, report.summary
    assert report.violated
    (command,) = re.findall(r"`bcut (solve [^`]*--separator [^`]*)`", README)
    assert run(command.split()) == 0
    assert re.search(r"triples: [1-9]\d* calls", capsys.readouterr().out)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    targets = re.findall(r"\]\(([^)#\s]+)[^)]*\)", text) + re.findall(r'src="([^"]+)"', text)
    for target in targets:
        if "://" not in target:
            assert (document.parent / target).exists(), target


def test_pictures_are_small() -> None:
    for picture in (ROOT / "docs").iterdir():
        assert picture.stat().st_size < 300_000

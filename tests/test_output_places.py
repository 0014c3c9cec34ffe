"""Places for output: tried before any work, and none is left with part of a file."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from bcut.cli.main import run

Captured = pytest.CaptureFixture[str]


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is write-protected for the superuser")
def test_write_protected_places_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("old.json").write_text("{}")
    Path("old.json").chmod(0o444)
    assert run(["solve", "cube:3", "--output", "old.json"]) == 2
    assert "write-protected" in capsys.readouterr().err
    tmp_path.chmod(0o555)
    assert run(["solve", "cube:3", "--output", "new.json"]) == 2
    assert "Permission denied" in capsys.readouterr().err


def test_the_place_is_tried_before_any_work(monkeypatch: pytest.MonkeyPatch, capsys: Captured) -> None:
    def fail(*args: object, **options: object) -> None:
        raise AssertionError("the solve began")

    monkeypatch.setattr("bcut.solving.api.solve", fail)
    monkeypatch.setattr("bcut.formulations.cocircuits.cocircuit_formulation", fail)
    assert run(["solve", "cube:3", "--output", "nowhere/out.json"]) == 2
    assert run(["export", "cube:3", "nowhere/out.lp"]) == 2
    assert capsys.readouterr().err.count("no folder") == 2


def test_a_full_disk_leaves_no_partial_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    def fail(self: Path, text: str, **options: object) -> None:
        with self.open("w") as stream:
            stream.write(text[:100])
        raise OSError(28, "No space left on device")

    old = tmp_path / "out.json"
    old.write_text("old")
    monkeypatch.setattr(Path, "write_text", fail)
    assert run(["solve", "cube:3", "--output", str(old)]) == 2
    assert "No space left on device" in capsys.readouterr().err
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("out.json", "old")]


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    link = tmp_path / "latest.json"
    link.symlink_to(Path("data") / "result.json")
    assert run(["solve", "cube:3", "--quiet", "--output", str(link)]) == 0
    assert link.is_symlink()
    assert json.loads((tmp_path / "data" / "result.json").read_text())["value"] == 5

"""The command line at time limits and at Ctrl-C: what was found is kept, in whatever stage."""

from __future__ import annotations

import json
import signal
import sys
import time
from pathlib import Path

import pytest
from processes import BCUT, Ended, finished, started

import bcut
from bcut.cli.main import run

Captured = pytest.CaptureFixture[str]


def test_the_time_limit_is_kept_and_what_was_found_is_written(tmp_path: Path) -> None:
    file = tmp_path / "result.json"
    arguments = ["solve", *OUT_OF_REACH, "--no-separators", "--time-limit", "3"]
    status, out, err = finished([*BCUT, *arguments, "--output", str(file)])
    assert (status, err) == (3, "")
    assert "a limit came first" in out
    data = json.loads(file.read_text())
    assert data["status"] == "limit"
    assert data["problem"]["limits"]["time"] == 3
    assert "triangulation verified" in bcut.verify(file).statement


# The relaxation reaches 61, triangulations no more than 56: no tree search closes that in a time that a test has.
OUT_OF_REACH = ("rhombicuboctahedron", "--sense", "max")

# Presses Ctrl-C as soon as a solve reports from the stage that is asked for.
PRESSING = """
import contextlib, os, signal, sys
import bcut.cli.progress as progress
from bcut.cli.main import run

@contextlib.contextmanager
def line(*, quiet):
    def watch(facts):
        if facts["stage"] == sys.argv[1]:
            os.kill(os.getpid(), signal.SIGINT)
    yield watch

progress.progress_line = line
sys.exit(run(sys.argv[2:]))
"""


def check_interrupted(ended: Ended, file: Path) -> None:
    assert ended.status == 130
    assert "Traceback" not in ended.err
    data = json.loads(ended.out)
    assert data == json.loads(file.read_text())
    assert data["status"] == "interrupted"
    assert "triangulation verified" in bcut.verify(file).statement


@pytest.mark.parametrize(
    ("method", "stage"), [("listing", "root"), ("listing", "vertices"), ("listing", "tree"), ("scip", "tree")]
)
def test_ctrl_c_in_any_stage_keeps_what_was_found(method: str, stage: str, tmp_path: Path) -> None:
    file = tmp_path / "result.json"
    # The first target is out of reach, and without separators only the tree shows that.
    arguments = ["solve", "random:22,3,seed=9", "--spanning", "--no-separators"]
    arguments += ["--method", method, "--json", "--output", str(file)]
    check_interrupted(finished([sys.executable, "-c", PRESSING, stage, *arguments]), file)


def test_ctrl_c_from_outside_keeps_what_was_found(tmp_path: Path) -> None:
    file, asked = tmp_path / "result.json", tmp_path / "asked"
    # It tells that the solve is under way, however slow the machine is, and nothing else.
    (tmp_path / "tells.py").write_text(
        "from pathlib import Path\n"
        "from bcut import Separator\n\n\n"
        "class Tells(Separator):\n"
        "    name = 'tells'\n\n"
        "    def separate(self, point):\n"
        f"        Path({str(asked)!r}).touch()\n"
        "        return []\n"
    )
    arguments = ["solve", *OUT_OF_REACH, "--separator", str(tmp_path / "tells.py")]
    with started([*BCUT, *arguments, "--json", "--output", str(file)]) as program:
        program.until(asked.exists)
        time.sleep(0.5)
        program.signal(signal.SIGINT)
        check_interrupted(program.end(), file)


def test_ctrl_c_before_anything_was_found_leaves_nothing(
    capsys: Captured, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def stop(*args: object, **options: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("bcut.solving.api.solve", stop)
    file = tmp_path / "result.json"
    assert run(["solve", "cube:3", "--output", str(file)]) == 130
    captured = capsys.readouterr()
    assert not captured.out
    assert captured.err.strip() == "Interrupted before anything was found."
    assert not list(tmp_path.iterdir())

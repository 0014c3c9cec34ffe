"""The command line: what goes where, and what `verify`, `info`, `generate` and `export` say."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
from processes import BCUT, PATIENCE, finished, on_terminal

import bcut
from bcut.cli.main import run

Captured = pytest.CaptureFixture[str]

SILENT = """
from bcut import Separator

class Silent(Separator):
    name = "silent"

    def separate(self, point):
        return []
"""


# Standard output, standard error, files.


def test_the_summary_says_what_was_found(capsys: Captured, tmp_path: Path) -> None:
    file = tmp_path / "result.json"
    assert run(["solve", "dodecahedron", "--output", str(file)]) == 0
    captured = capsys.readouterr()
    assert not captured.err
    lines = {line[:12].strip(): line[12:].strip() for line in captured.out.splitlines()[1:]}
    assert captured.out.startswith("dodecahedron: 20 points in dimension 3\n")
    assert lines["root LP"].startswith("22.5, after cuts ")
    assert lines["value"] == "23"
    assert lines["bound"] == "23"
    assert lines["status"] == "optimal (proven exactly)"
    assert lines["separators"].startswith("link: ")
    assert lines["written"] == str(file)
    assert {"problem", "program", "nodes", "time"} <= set(lines)
    assert json.loads(file.read_text())["value"] == 23


def test_the_file_and_the_object_on_standard_output_are_the_same(capsys: Captured, tmp_path: Path) -> None:
    file = tmp_path / "result.json"
    assert run(["solve", "cube:3", "--json", "--output", str(file)]) == 0
    assert capsys.readouterr().out == file.read_text()
    assert [path.name for path in tmp_path.iterdir()] == ["result.json"]


def test_quiet_prints_nothing(capsys: Captured, tmp_path: Path) -> None:
    file, separator = tmp_path / "result.json", tmp_path / "none.py"
    separator.write_text(SILENT)
    assert run(["solve", "cube:3", "--quiet", "--output", str(file)]) == 0
    assert run(["verify", str(file), "--quiet"]) == 0
    assert run(["separators", "check", str(separator), "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_infeasible_is_solved(capsys: Captured, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No configuration has no triangulation, but the summary and the status must be ready for later restrictions."""
    result = bcut.solve("cube:3")
    result.status, result.value, result.bound, result.triangulation = "infeasible", None, None, None
    result.certificate.settles = None
    result.certificate.reason = "that there is no triangulation rests on the solver's tree"
    monkeypatch.setattr("bcut.solving.api.solve", lambda *args, **options: result)
    assert run(["solve", "cube:3"]) == 0
    assert (
        "infeasible: there is no such triangulation (that there is no triangulation rests on the solver's"
        in (capsys.readouterr().out)
    )


def test_nothing_in_a_file_and_a_live_line_on_a_terminal() -> None:
    arguments = [*BCUT, "solve", "prism:6", "--json"]
    written = finished(arguments)
    assert (written.status, written.err) == (0, "")
    live = on_terminal(arguments, columns=120)
    assert live.status == 0
    assert json.loads(live.out)["value"] == 10
    assert " s  " in live.err


def test_a_reader_that_leaves_is_no_error() -> None:
    arguments = [*BCUT, "generate", "--list"]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 0


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full here")
def test_a_full_disk_behind_standard_output_is_said() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [*BCUT, "info", "cube:3"], stdout=full, stderr=subprocess.PIPE, text=True, timeout=PATIENCE
        )
    assert done.returncode == 2
    assert (
        done.stderr
        == "Error: standard output cannot be written (No space left on device); redirect it elsewhere\n"
    )


# Verify.


def test_verify_states_and_refuses(capsys: Captured, tmp_path: Path) -> None:
    file = tmp_path / "result.json"
    bcut.solve("cube:3").save(file)
    assert run(["verify", str(file)]) == 0
    assert capsys.readouterr().out.startswith(f"{file}: optimal, proven exactly")
    assert run(["verify", str(file), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["value"] == "5"
    assert report["proven_optimal"] is True
    data = json.loads(file.read_text())
    del data["triangulation"][2]
    file.write_text(json.dumps(data))
    assert run(["verify", str(file)]) == 2
    captured = capsys.readouterr()
    assert not captured.out
    assert captured.err.startswith(f"Error: result file {file}: ")


# Info, generate, export.


@pytest.mark.parametrize(
    ("instance", "facts"),
    [
        ("cube:3", {"general_position": False, "hull_facets": 6, "hull_vertices": 8}),
        ("grid:3,3", {"general_position": False, "hull_facets": 4, "hull_vertices": 4}),
        ("random:9,3,seed=2", {"general_position": True}),
        ("prism:5", {"general_position": False, "hull_facets": 7, "hull_vertices": 10}),
        ("24-cell", {"general_position": False, "hull_facets": 24, "hull_vertices": 24}),
    ],
)
def test_info_computes_facts(instance: str, facts: dict[str, Any], capsys: Captured) -> None:
    from bcut.formulations.cocircuits import cocircuit_formulation

    assert run(["info", instance, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    configuration = bcut.load_instance(instance)
    known = data["combinatorics"]
    assert (data["points"], data["dimension"]) == (configuration.n, configuration.dimension)
    assert data["digest"] == configuration.digest
    assert {key: known[key] for key in facts} == facts
    for spanning, key in ((False, "all_simplices"), (True, "empty_simplices")):
        size = cocircuit_formulation(configuration, spanning=spanning).size
        assert (known[key]["columns"], known[key]["rows"]) == size
    assert run(["info", instance]) == 0
    assert f"{known['hull_facets']:,} facets" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("instance", "field"),
    [
        ("cube:3", "Q"),
        ("prism:7", "Q(cos(2*pi/7))"),
        ("dodecahedron", "Q(sqrt(5))"),
        ("truncated-cube", "Q(sqrt(2))"),
    ],
)
def test_info_names_the_field(instance: str, field: str, capsys: Captured) -> None:
    assert run(["info", instance]) == 0
    lines = [line.split(None, 1) for line in capsys.readouterr().out.splitlines()]
    assert ["field", field] in lines


def test_info_of_a_configuration_too_large_to_list(capsys: Captured) -> None:
    assert run(["info", "random:900,3,seed=1"]) == 0
    assert "not listed: random:900,3,seed=1" in capsys.readouterr().out


@pytest.mark.parametrize("kind", ["json", "dat", "csv"])
def test_generated_points_are_read_back_exactly(kind: str, tmp_path: Path, capsys: Captured) -> None:
    written, printed = tmp_path / f"a.{kind}", tmp_path / f"b.{kind}"
    assert run(["generate", "random:7,3,seed=4", "--output", str(written)]) == 0
    assert run(["generate", "random:7,3,seed=4", "--format", kind]) == 0
    printed.write_text(capsys.readouterr().out)
    assert written.read_text() == printed.read_text()
    assert bcut.load_instance(str(written)) == bcut.load_instance("random:7,3,seed=4")


def test_generate_converts_files_and_lists_families(tmp_path: Path, capsys: Captured) -> None:
    table = tmp_path / "points.csv"
    table.write_text("0,0\n1,0\n0,1/3\n")
    assert run(["generate", str(table), "--output", str(tmp_path / "points.json")]) == 0
    assert bcut.load_instance(tmp_path / "points.json") == bcut.load_instance(table)
    assert run(["generate", "--list"]) == 0
    assert "cube:D " in capsys.readouterr().out


@pytest.mark.parametrize("suffix", [".lp", ".mps"])
@pytest.mark.parametrize(("sense", "optimum"), [("min", 5), ("max", 6)])
def test_another_solver_finds_the_same_optimum_of_an_exported_model(
    suffix: str, sense: str, optimum: int, tmp_path: Path, capsys: Captured
) -> None:
    import highspy

    file = tmp_path / f"cube{suffix}"
    assert run(["export", "cube:3", str(file), "--sense", sense]) == 0
    assert capsys.readouterr() == ("", "")
    assert [path.name for path in tmp_path.iterdir()] == [file.name]
    solver = highspy.Highs()
    solver.setOptionValue("output_flag", False)
    assert solver.readModel(str(file)) == highspy.HighsStatus.kOk
    solver.run()
    assert solver.getNumCol() == 58
    assert round(solver.getInfo().objective_function_value) == optimum
    assert solver.getColName(0)[1] == "x_0_1_2_4"

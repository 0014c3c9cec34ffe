"""The command line: help everywhere, fast start, agreement with the library, exit statuses, what goes where."""

from __future__ import annotations

import inspect
import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import click
import pytest
from processes import BCUT, PATIENCE, Ended, finished, on_terminal, started

import bcut
from bcut.cli.main import bcut as program
from bcut.cli.main import run
from bcut.solving.methods import METHODS
from bcut.solving.options import DEFAULT_SEPARATORS

Captured = pytest.CaptureFixture[str]

HEAVY = {"scipy", "pyscipopt", "networkx", "highspy", "flint", "trimesh", "matplotlib", "rich", "numba"}
HEAVY |= {"distributed", "dask", "pyarrow", "jinja2"}

RAISING = """
from bcut import Separator

class Raising(Separator):
    \"\"\"Raises.\"\"\"
    name = "raising"

    def separate(self, point):
        raise RuntimeError("out of ideas")
"""

SILENT = """
from bcut import Separator

class Silent(Separator):
    name = "silent"

    def separate(self, point):
        return []
"""

INVALID = """
from bcut import Cut, Separator

class Invalid(Separator):
    \"\"\"Forbids the first fractional simplex.\"\"\"
    name = "invalid"

    def separate(self, point):
        for column in point.fractional[:1]:
            yield Cut([column], 0)
"""


def all_commands(
    group: click.Group, path: tuple[str, ...] = ()
) -> list[tuple[tuple[str, ...], click.Command]]:
    context = click.Context(group)
    found: list[tuple[tuple[str, ...], click.Command]] = []
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None, name
        found.append(((*path, name), command))
        if isinstance(command, click.Group):
            found += all_commands(command, (*path, name))
    return found


COMMANDS = dict(all_commands(program))


def solved(*arguments: str, capsys: Captured, status: int = 0) -> dict[str, Any]:
    """Run `bcut solve ... --json` in this process, and return the object on standard output."""
    assert run(["solve", *arguments, "--json"]) == status
    captured = capsys.readouterr()
    assert not captured.err
    data: dict[str, Any] = json.loads(captured.out)
    return data


# Help.


def test_the_commands_are_those_of_the_design() -> None:
    top = {path[0] for path in COMMANDS}
    assert top == {
        "solve", "bound", "verify", "regular", "region", "separators", "objectives", "experiment", "cuts", "info",
        "generate", "export", "plot",
    }  # fmt: skip
    groups = {"list", "check", "new", "run", "report", "show", "replay", "verify"}
    assert {path[1] for path in COMMANDS if len(path) > 1} == groups


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_every_command_and_every_option_has_help(path: tuple[str, ...], capsys: Captured) -> None:
    command = COMMANDS[path]
    assert command.help
    assert command.help.strip().endswith(".")
    assert command.short_help
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert parameter.help, f"{' '.join(path)} {parameter.name}"
            assert not parameter.hidden
        else:
            # An argument has no help of its own: the text of its command speaks of it.
            name = re.split(r"[|.]", parameter.make_metavar(click.Context(command)).strip("[]"))[0]
            assert name in command.help.upper() or name == "PICTURE", f"{' '.join(path)} {parameter.name}"
    assert run([*path, "--help"]) == 0
    assert capsys.readouterr().out.startswith(f"Usage: bcut {' '.join(path)}")


def test_the_help_names_the_default_separators() -> None:
    (option,) = [p for p in COMMANDS["solve",].params if p.name == "separator"]
    assert isinstance(option, click.Option)
    assert option.help is not None
    assert f"Without this option: {' and '.join(DEFAULT_SEPARATORS)}." in option.help


def test_the_methods_are_those_of_the_library() -> None:
    for name, missing in (("solve", set()), ("bound", {"elimination", "scip"})):
        (option,) = [p for p in COMMANDS[name,].params if p.name == "method"]
        assert isinstance(option.type, click.Choice)
        assert set(option.type.choices) == set(METHODS) - missing


def test_version(capsys: Captured) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"bcut {bcut.__version__}\n"


# Start.


@pytest.mark.parametrize("arguments", [["--help"], ["solve", "--help"], ["separators", "list"]], ids=" ".join)
def test_the_light_commands_load_nothing_heavy(arguments: list[str]) -> None:
    code = (
        "import sys; from bcut.cli.main import run; status = run(sys.argv[1:]);"
        "print(*{name.partition('.')[0] for name in sys.modules}, file=sys.stderr); sys.exit(status)"
    )
    status, out, err = finished([sys.executable, "-c", code, *arguments])
    assert (status, bool(out)) == (0, True)
    assert not HEAVY & set(err.split())


def test_importing_the_package_loads_nothing() -> None:
    code = "import sys, bcut; print(*sys.modules)"
    status, out, _ = finished([sys.executable, "-c", code])
    assert status == 0
    assert not (HEAVY | {"numpy", "click"}) & set(out.split())


# The command line and the library agree.


@pytest.mark.parametrize("name", ["solve", "bound", "export"])
def test_the_library_takes_what_the_command_line_takes(name: str) -> None:
    function = inspect.signature(getattr(bcut, name)).parameters
    names = {"file": "path", "separator": "separators"}
    options = {names.get(str(p.name), str(p.name)): p for p in COMMANDS[name,].params}
    only_here = {"no_separators", "output", "as_json", "quiet", "help"}
    assert set(options) - only_here == set(function) - {"on_progress", "cut_observer"}
    given = ["cube:3", "cube.lp"] if name == "export" else ["cube:3"]
    defaults = COMMANDS[name,].make_context(name, given).params
    for parameter in function.values():
        if parameter.default is not inspect.Parameter.empty and parameter.name in defaults:
            assert defaults[parameter.name] == parameter.default


def test_the_library_offers_every_command() -> None:
    others = {"separators", "objectives", "experiment", "cuts", "generate"}
    assert all(callable(getattr(bcut, path[0])) for path in COMMANDS if path[0] not in others)
    assert callable(bcut.check_separator)
    assert callable(bcut.write_points)


def comparable(data: dict[str, Any]) -> dict[str, Any]:
    """A result without what two equal runs may differ in: times, and libraries that happen to be loaded."""
    separators = {n: {k: v for k, v in f.items() if k != "seconds"} for n, f in data["separators"].items()}
    return {
        **data,
        "seconds": sorted(data["seconds"]),
        "separators": separators,
        "versions": sorted(data["versions"]),
    }


@pytest.mark.parametrize(
    "arguments",
    [
        ["cube:3"],
        ["cube:3", "--sense", "max"],
        ["moae", "--spanning", "--no-separators"],
        [
            "random:9,3,seed=1",
            "--objective",
            "random-costs:5",
            "--seed",
            "3",
            "--separator",
            "clique:max_cuts=7",
        ],
        ["prism:5", "--method", "scip"],
    ],
    ids=" ".join,
)
def test_solve_gives_the_library_s_result(arguments: list[str], capsys: Captured) -> None:
    data = solved(*arguments, capsys=capsys)
    options = COMMANDS["solve",].make_context("solve", list(arguments)).params
    for name in ("instance", "output", "as_json", "quiet"):
        options.pop(name)
    given = options.pop("separator")
    separators = [] if options.pop("no_separators") else list(given) or None
    result = bcut.solve(arguments[0], separators=separators, **options)
    assert comparable(json.loads(result.to_json())) == comparable(data)
    assert data["problem"]["separators"] == (list(DEFAULT_SEPARATORS) if separators is None else separators)


def test_bound_gives_the_library_s_result(capsys: Captured) -> None:
    assert run(["bound", "dodecahedron", "--no-separators", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["status"] == "bound"
    assert data["triangulation"] is None
    assert data["root"]["lp"] == pytest.approx(22.5)
    assert comparable(json.loads(bcut.bound("dodecahedron", separators=[]).to_json())) == comparable(data)


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


# Limits and interrupts.


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


# Separators.


def test_the_list_of_separators(capsys: Captured) -> None:
    assert run(["separators", "list", "--json"]) == 0
    families = {entry["name"]: entry for entry in json.loads(capsys.readouterr().out)}
    assert {"clique", "odd-cycle", "convex-polygon"} <= set(families)
    assert all(entry["origin"] == "built-in" for entry in families.values())
    assert families["odd-cycle"]["parameters"]["backend"] == "scipy"
    assert [name for name, entry in families.items() if entry["default"]] == list(DEFAULT_SEPARATORS)
    assert families["clique"]["dissections"]
    assert families["sphere"]["stage"] > families["parity"]["stage"] > families["link"]["stage"] == 0
    assert run(["separators", "list"]) == 0
    text = capsys.readouterr().out
    for name, entry in families.items():
        assert entry["description"].endswith("."), name
        assert " ".join(text.split()).count(f"{name} {entry['description']}") == 1
        assert text.count("the default") == 1


def test_a_separator_of_a_user_from_another_folder(
    tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["separators", "new", "my-cuts"]) == 0
    path = capsys.readouterr().out.strip()
    assert Path(path) == tmp_path / "my_cuts.py"
    assert run(["separators", "check", path]) == 0
    assert "passed" in capsys.readouterr().out
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    data = solved(
        "random:12,3,seed=1000", "--spanning", "--separator", "../my_cuts.py:max_cuts=3", capsys=capsys
    )
    assert data["value"] == 17
    assert data["problem"]["separators"] == ["../my_cuts.py:max_cuts=3"]
    assert data["separators"]["my-cuts"]["calls"] >= 1


def test_an_invalid_separator_fails_its_check_with_a_triangulation(tmp_path: Path, capsys: Captured) -> None:
    file = tmp_path / "invalid.py"
    file.write_text(INVALID)
    assert run(["separators", "check", str(file)]) == 5
    assert re.search(r"cuts off a triangulation, .*: \[\d+(, \d+)+\] \[", capsys.readouterr().out)


def test_what_a_separator_prints_stays_off_standard_output(tmp_path: Path, capsys: Captured) -> None:
    file = tmp_path / "talking.py"
    file.write_text(RAISING.replace("raise RuntimeError", "return print").replace('ideas")', 'ideas") or ()'))
    assert run(["solve", "random:12,3,seed=1000", "--spanning", "--separator", str(file), "--json"]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)["value"] == 17
    assert captured.err.startswith("out of ideas\n")


@pytest.mark.parametrize("method", ["auto", "scip"])
def test_a_separator_that_raises_is_named_with_its_own_traceback(
    method: str, tmp_path: Path, capsys: Captured
) -> None:
    file, output = tmp_path / "raising.py", tmp_path / "result.json"
    file.write_text(RAISING)
    arguments = ["random:12,3,seed=1000", "--spanning", "--separator", str(file), "--method", method]
    assert run(["solve", *arguments, "--output", str(output)]) == 5
    captured = capsys.readouterr()
    assert not captured.out
    assert 'raise RuntimeError("out of ideas")' in captured.err
    assert str(file) in captured.err
    last = captured.err.strip().splitlines()[-1]
    assert last == "Error: separator 'raising': separate() raised RuntimeError: out of ideas"
    assert not output.exists()


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

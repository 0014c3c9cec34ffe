"""The command line: help everywhere, fast start, agreement with the library, separators of users."""

from __future__ import annotations

import inspect
import json
import re
import sys
from pathlib import Path
from typing import Any

import click
import pytest
from processes import finished

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

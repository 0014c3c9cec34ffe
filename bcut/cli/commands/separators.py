"""`bcut separators`: list, check, new."""

from __future__ import annotations

import inspect
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bcut.cli.exits import ExitStatus
from bcut.cli.options import json_option

if TYPE_CHECKING:
    from bcut.separation.seam import Separator


@click.group(short_help="List the cut families, check one, begin a new one.")
def separators() -> None:
    """List the cut families that can be called by name, check one on small configurations, or begin a new one."""


@separators.command("list", short_help="List the cut families and their parameters.")
@json_option
def list_command(as_json: bool) -> int:
    """List the cut families that can be called by name: the built-in ones and those of installed packages.

    Parameters are written after a colon, as in --separator odd-cycle:max_cuts=40. A family of a later stage is
    asked only about points for which those of earlier ones have nothing to add.
    """
    from bcut.cli.output import emit, emit_json
    from bcut.separation.resolve import available, built_in_names, parameters_of
    from bcut.solving.options import DEFAULT_SEPARATORS

    built_in = set(built_in_names())
    entries = [
        {
            "name": name,
            "description": _description(family),
            "parameters": parameters_of(family),
            "stage": family.stage,
            "dissections": family.dissections,
            "default": name in DEFAULT_SEPARATORS,
            "origin": "built-in" if name in built_in else f"{family.__module__}:{family.__qualname__}",
        }
        for name, family in available().items()
    ]
    if as_json:
        emit_json(entries)
    else:
        emit("".join(map(_described, entries)))
    return 0


@separators.command("check", short_help="Check a cut family against all solutions of small configurations.")
@click.argument("separator", metavar="NAME|FILE")
@click.option("--quiet", is_flag=True, help="Print nothing where the separator passes.")
def check_command(separator: str, quiet: bool) -> int:
    """Check that no cut of a separator cuts off a triangulation, and that it keeps the other rules of the seam.

    The cuts are compared with all triangulations of small configurations; those of a family that declares
    `dissections = True` with all dissections of others, too. NAME|FILE is written as for `bcut solve
    --separator`, with parameters after a colon. Exit status 0: it passes; 5: it does not, and the report names
    the triangulation or dissection that a cut cuts off, or shows the traceback of what it raised. A rule that
    nothing was shown for, such as validity where there was no cut, is "not reached".
    """
    from bcut.cli.output import emit
    from bcut.separation.check import check_separator

    report = check_separator(separator)
    if not (report.ok and quiet):
        emit(report.summary.rstrip("\n") + "\n")
    return ExitStatus.DONE if report.ok else ExitStatus.FAILED


@separators.command("new", short_help="Write a new separator to begin with.")
@click.argument("name")
def new_command(name: str) -> int:
    """Write NAME.py, a small separator that passes `bcut separators check`, to begin with. Never overwrites a file."""
    from bcut.cli.output import emit
    from bcut.separation.template import write_template

    path = write_template(name, Path.cwd())
    emit(f"{path}\n")
    return 0


def _description(family: type[Separator]) -> str:
    """Return the first paragraph of the docstring as one line."""
    return " ".join((inspect.getdoc(family) or "").partition("\n\n")[0].split())


def _described(entry: dict[str, Any]) -> str:
    described = textwrap.wrap(entry["description"], 96)
    lines = [entry["name"], *(f"    {line}" for line in described)]
    if entry["origin"] != "built-in":
        lines.append(f"    from {entry['origin']}")
    traits = [f"stage {entry['stage']}"]
    if entry["default"]:
        traits.append("the default")
    if entry["dissections"]:
        traits.append("for dissections too")
    lines.append(f"    {', '.join(traits)}")
    if entry["parameters"]:
        listed = ", ".join(f"{name}={default}" for name, default in entry["parameters"].items())
        lines.append(f"    parameters: {listed}")
    return "\n".join(lines) + "\n"

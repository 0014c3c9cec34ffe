"""`bcut objectives`: list, new."""

from __future__ import annotations

import inspect
import textwrap
from pathlib import Path
from typing import Any

import click

from bcut.cli.options import json_option


@click.group(short_help="List the measures of simplices, begin a new one.")
def objectives() -> None:
    """List the measures of simplices that objectives are made of, or begin one of your own."""


@objectives.command("list", short_help="List the measures that can be called by name.")
@json_option
def list_command(as_json: bool) -> int:
    """List the measures that can be called by name.

    An objective is a measure, which is summed over the simplices, or the measure of the worst simplex: min-max:MEASURE
    is the smallest maximum, max-min:MEASURE the largest minimum.
    """
    from bcut.cli.output import emit, emit_json
    from bcut.objectives.measures import MEASURES

    entries = [
        {"name": name, "description": _description(function)} for name, function in sorted(MEASURES.items())
    ]
    if as_json:
        emit_json(entries)
    else:
        emit("".join(map(_described, entries)))
    return 0


@objectives.command("new", short_help="Write a new measure to begin with.")
@click.argument("name")
def new_command(name: str) -> int:
    """Write NAME.py, a small measure that works as it is, to begin with. Never overwrites a file."""
    from bcut.cli.output import emit
    from bcut.objectives.template import write_template

    path = write_template(name, Path.cwd())
    emit(f"{path}\n")
    return 0


def _description(function: Any) -> str:
    """Return the first paragraph of the docstring as one line."""
    return " ".join((inspect.getdoc(function) or "").partition("\n\n")[0].split())


def _described(entry: dict[str, str]) -> str:
    lines = textwrap.wrap(entry["description"], 96)
    return "\n".join([entry["name"], *(f"    {line}" for line in lines)]) + "\n"

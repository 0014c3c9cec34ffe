"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])
Decorator = Callable[[Command], Command]


def _together(*decorators: Decorator[Any]) -> Decorator[Any]:
    """Apply decorators so that the help lists the options in the order given here."""

    def apply(command: Command) -> Command:
        for decorator in reversed(decorators):
            command = decorator(command)
        return command

    return apply


def _faces(
    context: click.Context, parameter: click.Parameter, values: tuple[str, ...]
) -> tuple[tuple[int, ...], ...]:
    """Read faces that are written as numbers of points with commas between them."""
    faces = []
    for value in values:
        try:
            faces.append(tuple(int(part) for part in value.split(",")))
        except ValueError:
            raise click.BadParameter(f"'{value}' is no list of points such as 0,1,4") from None
    return tuple(faces)


instance_argument = click.argument("instance")

result_argument = click.argument("result", type=click.Path(path_type=Path))

problem_options = _together(
    instance_argument,
    click.option(
        "--objective",
        default="cardinality",
        show_default=True,
        metavar="NAME|FILE",
        help="What is summed over the simplices: cardinality, weight, aspect-ratio, dihedral-angle, ... "
        "(`bcut objectives list`), costs:FILE, random-costs:SEED, or a function of yours, FILE.py or FILE.py:FUNCTION. "
        "min-max:MEASURE and max-min:MEASURE look at the worst simplex instead.",
    ),
    click.option(
        "--sense",
        type=click.Choice(["min", "max"]),
        help="Whether the sum is to be smallest or largest. Without this option: smallest; min-max and max-min say it "
        "themselves.",
    ),
    click.option(
        "--formulation",
        metavar="NAME",
        help="The integer program: 0, stable sets of simplices; 1, stable sets of faces of all dimensions; 2, the "
        "cocircuit form; chambers, set partitioning. Without this option: 2, or chambers for dissections.",
    ),
    click.option("--spanning", is_flag=True, help="Allow only triangulations that use every point."),
    click.option(
        "--dissection",
        is_flag=True,
        help="Allow simplices that do not meet face to face, as long as they do not overlap; with --spanning, only "
        "simplices without further points in them.",
    ),
    click.option(
        "--require",
        multiple=True,
        metavar="POINTS",
        callback=_faces,
        help="Allow only triangulations with this face, such as 0,1,4; of any dimension, repeatable.",
    ),
    click.option(
        "--forbid",
        multiple=True,
        metavar="POINTS",
        callback=_faces,
        help="Allow only triangulations without this face; of any dimension, repeatable.",
    ),
    click.option(
        "--star",
        type=int,
        metavar="POINT",
        help="Allow only triangulations all of whose simplices have this point as a vertex.",
    ),
)

separator_options = _together(
    click.option(
        "--separator",
        "separator",
        multiple=True,
        metavar="NAME|FILE",
        help="A cut family at work, repeatable: a name, a file, each with :parameter=value,... "
        "(`bcut separators list`). Without this option: link. With formulations 0 and 1: clique and link; for "
        "dissections: clique and odd-cycle.",
    ),
    click.option("--no-separators", is_flag=True, help="Put no cut family to work."),
)

symmetries_option = click.option(
    "--symmetries",
    metavar="FILE",
    help="Work over the orbits of these symmetries instead of all: a file of permutations, [[1,0,2,3],...], or a "
    "TOPCOM file with generators behind its points. They are checked exactly.",
)


def method_option(**explained: str) -> Decorator[Any]:
    """Return the option for the way to work on an instance: the names of the methods, "auto" among them, explained."""
    return click.option(
        "--method",
        type=click.Choice(sorted(explained, key=lambda name: name != "auto")),
        default="auto",
        show_default=True,
        help=" ".join(f"{name}: {text}." for name, text in explained.items()),
    )


time_limit_option = click.option(
    "--time-limit",
    type=float,
    metavar="S",
    help="Stop after S seconds with what was found (exit status 3).",
)

json_option = click.option(
    "--json", "as_json", is_flag=True, help="Print one JSON object instead of the summary."
)

report_options = _together(
    click.option(
        "--output",
        type=click.Path(path_type=Path),
        metavar="FILE",
        help="Write the result to this file, whole or not at all.",
    ),
    json_option,
    click.option(
        "--quiet",
        is_flag=True,
        help="No summary and no progress: only the data that --json or --output asks for.",
    ),
)

run_options = _together(
    time_limit_option,
    click.option(
        "--memory-limit",
        type=float,
        metavar="GIB",
        help="Stop when the process uses more than this, with what was found (exit status 3).",
    ),
    click.option(
        "--seed",
        type=int,
        default=0,
        show_default=True,
        metavar="N",
        help="Seed of the solver's random choices.",
    ),
    report_options,
)

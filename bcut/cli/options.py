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


instance_argument = click.argument("instance")

objective_options = _together(
    click.option(
        "--objective",
        default="cardinality",
        show_default=True,
        metavar="NAME",
        help="What is summed over the simplices: cardinality, costs:FILE, random-costs:SEED.",
    ),
    click.option(
        "--sense",
        type=click.Choice(["min", "max"]),
        default="min",
        show_default=True,
        help="Whether the sum is to be smallest or largest.",
    ),
    click.option(
        "--formulation",
        default="2",
        show_default=True,
        metavar="NAME",
        help="The integer program: 2, the cocircuit form.",
    ),
    click.option("--spanning", is_flag=True, help="Allow only triangulations that use every point."),
)

separator_options = _together(
    click.option(
        "--separator",
        "separator",
        multiple=True,
        metavar="NAME|FILE",
        help="A cut family at work, repeatable: a name, a file, each with :parameter=value,... "
        "(`bcut separators list`). Without this option: link.",
    ),
    click.option("--no-separators", is_flag=True, help="Put no cut family to work."),
)

run_options = _together(
    click.option(
        "--time-limit",
        type=float,
        metavar="S",
        help="Stop after S seconds with what was found (exit status 3).",
    ),
    click.option(
        "--seed",
        type=int,
        default=0,
        show_default=True,
        metavar="N",
        help="Seed of the solver's random choices.",
    ),
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

"""`bcut bound`."""

from __future__ import annotations

from typing import Any

import click

from bcut.cli.options import (
    method_option,
    problem_options,
    run_options,
    separator_options,
    symmetries_option,
)
from bcut.cli.running import carry_out


@click.command(short_help="Bound the optimum at the root, before and after cuts.")
@problem_options
@separator_options
@method_option(
    listing="all simplices",
    orbits="orbits of simplices under the symmetries that keep the costs (cardinality and costs:FILE only; of the "
    "separators only link is at work)",
    fixing="a first-order method for all simplices, cuts for the few that matter",
    auto="orbits for large symmetric configurations, fixing for other large ones, else listing",
)
@symmetries_option
@run_options
def bound(**options: Any) -> int:
    """Bound the optimum of INSTANCE at the root, before and after the cuts of the separators given.

    There is no branching, and none of the solver's own cuts are used, so the difference is what the
    separators did. The result has the same form as that of `bcut solve`, with no triangulation.
    """
    from bcut.solving.api import bound as call

    return carry_out(call, **options)

"""`bcut solve`."""

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


@click.command(short_help="Find an optimal triangulation.")
@problem_options
@click.option(
    "--then",
    multiple=True,
    metavar="[min:|max:]OBJECTIVE",
    help="A further objective, repeatable: it decides among the best by those before it, as in "
    "--objective max-min:dihedral-angle --then cardinality.",
)
@separator_options
@method_option(
    listing="list all simplices, bound and fix at the root, then branch on what is left",
    orbits="the same with orbits of simplices under the symmetries that keep the costs (cardinality and costs:FILE "
    "only)",
    fixing="bound by a first-order method; solvers see the few simplices that the bound leaves",
    elimination="take edges away by theorems (--objective weight --spanning in the plane only)",
    scip="leave everything to SCIP",
    auto="orbits for large symmetric configurations, elimination or fixing for other large ones, else listing",
)
@symmetries_option
@click.option(
    "--invariant-under",
    metavar="ORDER|FILE",
    help="Only triangulations that are invariant under some symmetries: those that the permutations in a file "
    "generate, or some subgroup of this order.",
)
@run_options
def solve(**options: Any) -> int:
    """Find an optimal triangulation of INSTANCE and prove it optimal.

    INSTANCE is a file of points or a member of a family (`bcut generate --list`). The triangulation is
    verified exactly before it is reported. Exit status 0: solved (or proven that there is no such
    triangulation); 3: a limit came first, and what was found is still written; 5: a separator or the solver
    failed; 130: interrupted, with what was found still written.
    """
    from bcut.solving.api import solve as call

    return carry_out(call, **options)

"""Sums whose costs have very different sizes, such as aspect ratios: what is too dear for an optimum is made cheaper.

A sliver's aspect ratio may be 10^12 times that of a good simplex, and tolerances of solvers are relative to the largest
cost. Where no cost is negative (and the sum is minimised), no simplex of an optimum costs more than all of a known
triangulation. So costs above a cap beyond that may be lowered to the cap: the optima and their values stay, and a bound
for the lower costs is a bound for the true ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from math import frexp

import numpy as np

from bcut.objectives.objective import Bottleneck
from bcut.solving.bottleneck import without_bad_simplices
from bcut.solving.search import Part, Search

# Costs that are no larger than so many times the median do no harm.
_SPREAD = 1000.0


@contextmanager
def capped_costs(search: Search) -> Iterator[None]:
    """Cap the costs of a search within the block, where they are too different for solvers."""
    whole = search.whole
    objective = whole.objective
    signed = objective.sign * objective.costs
    if not len(signed) or signed.min() < 0 or signed.max() <= _SPREAD * np.median(signed):
        yield
        return
    worst = Bottleneck(objective.name, objective.sense, objective.numerators, objective.denominator)
    found = without_bad_simplices(
        Search(
            whole=replace(whole, objective=worst),
            make_separators=list,
            deadline=search.deadline,
            on_progress=search.on_progress,
            columns=search.columns,
            restricted=search.restricted,
            seconds=search.seconds,
        )
    )
    if found is not None:
        search.offer(found)
    if search.value is None:
        yield
        return
    # A power of two that is at least twice the value.
    cap = 2.0 ** (frexp(abs(float(search.value)))[1] + 1)
    limit = objective.sign * min(cap, objective.largest_cost)
    lower = np.minimum if objective.sign > 0 else np.maximum
    if objective.are_doubles:
        numerators = lower(objective.numerators, limit)
    else:
        numerators = lower(objective.numerators, int(limit * objective.denominator))
    search.whole = Part(whole.formulation, replace(objective, numerators=numerators), whole.columns)
    try:
        yield
    finally:
        search.whole = whole

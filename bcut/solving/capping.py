"""Sums whose costs have very different sizes, such as aspect ratios: what is too dear for an optimum is made cheaper.

A sliver's aspect ratio may be 10^12 times that of a good simplex, a price that is to keep simplices out may be as high,
and tolerances of solvers are relative to the largest cost. Let the sum be minimised, v be its value for a known
triangulation, and g the sum of the absolute values of all negative costs. A triangulation with a simplex that costs
more than v + g is worse than the known one, since the others cost at least -g together. So costs above a cap beyond
v + g may be lowered to the cap: the optima and their values stay, and a bound for the lower costs is a bound for the
true ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from fractions import Fraction
from math import frexp

import numpy as np

from bcut.bounds.orbit_root import orbit_root
from bcut.objectives.objective import Bottleneck, Objective
from bcut.solving.bottleneck import without_bad_simplices
from bcut.solving.orbit_stage import MAX_COLUMNS, OrbitStage
from bcut.solving.search import Part, Search

# Costs that are no larger than so many times nearly all of them do no harm.
_SPREAD, _NEARLY_ALL = 1000.0, 0.02
# A cap that is so many times lower is worth another search.
_LOWER = 4


@contextmanager
def capped_costs(search: Search) -> Iterator[Fraction | None]:
    """Cap the costs of a search within the block, where they are too different for solvers; yields the cap."""
    whole = search.whole
    limit = _limit_of_costs(search)
    if limit is not None:
        search.whole = Part(whole.formulation, _limited(whole.objective, limit), whole.columns)
    try:
        yield limit
    finally:
        search.whole = whole


def with_capped_costs(search: Search, work: Callable[[Search], None]) -> None:
    """Do a piece of a search with capped costs.

    It is done again, with a lower cap, where it ends because solvers cannot tell values apart, and has found so much
    better a triangulation that they can then.
    """
    while True:
        with capped_costs(search) as limit:
            work(search)
        if limit is None or search.value is None or search.status != "limit" or search.seconds_left == 0.0:
            return
        if _cap(search.whole.objective, search.value) > abs(limit) / _LOWER:
            return


def capped_stage(search: Search, stage: OrbitStage) -> OrbitStage:
    """Return the stage with costs that solvers can compare, where they are too different and all can be listed."""
    if stage.root.bound is None or not _are_too_different(stage.objective):
        return stage
    everything = stage.target_for(MAX_COLUMNS)
    if stage.columns_within(everything) < stage.formulation.sizes.sum():
        return stage
    formulation, costs = stage.residual(everything)
    search.whole, search.columns = Part.whole(formulation, costs), None
    limit = _limit_of_costs(search)
    if limit is None:
        return stage
    objective = _limited(stage.objective, limit)
    root = orbit_root(stage.formulation, objective, method="interior", seconds=search.seconds_left)
    return stage if root.bound is None else replace(stage, objective=objective, root=root)


def _limit_of_costs(search: Search) -> Fraction | None:
    """Return the cost beyond which no simplex is in a better triangulation than one that the search now has.

    Returns
    -------
    Fraction or None
        A cap, with the sign of the costs; None where their sizes do no harm, or no triangulation is found.
    """
    objective = search.whole.objective
    if not _are_too_different(objective):
        return None
    worst = Bottleneck(objective.name, objective.sense, objective.numerators, objective.denominator)
    found = without_bad_simplices(
        Search(
            whole=replace(search.whole, objective=worst),
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
        return None
    cap = _cap(objective, search.value)
    return None if cap >= objective.largest_cost else objective.sign * Fraction(cap)


def _cap(objective: Objective, value: Fraction) -> float:
    """Return a power of two that is at least twice the cost of a simplex in a triangulation as good as a known one."""
    return 2.0 ** (frexp(abs(float(value)) + _gained(objective))[1] + 1)


def _are_too_different(objective: Objective) -> bool:
    """Tell whether some costs are so large that a cap may be needed, and that there may be one."""
    signed = objective.sign * objective.costs
    if objective.counts_units or not len(signed):
        return False
    usual = float(np.quantile(np.abs(signed), _NEARLY_ALL))
    return float(signed.max()) > max(_SPREAD * usual, 2 * _gained(objective))


def _gained(objective: Objective) -> float:
    """Return what all negative costs come to, without their sign."""
    return float(np.abs(np.minimum(objective.sign * objective.costs, 0)).sum())


def _limited(objective: Objective, limit: Fraction) -> Objective:
    """Return an objective without costs beyond a limit."""
    lower = np.minimum if objective.sign > 0 else np.maximum
    bound = float(limit) if objective.are_doubles else int(limit * objective.denominator)
    return replace(objective, numerators=lower(objective.numerators, bound))

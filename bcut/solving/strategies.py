"""The ways to an optimum: target by target, over all columns at once, or SCIP alone."""

from __future__ import annotations

from fractions import Fraction
from typing import Literal

from bcut.bounds.root import RootBound, Stage
from bcut.objectives.objective import Objective
from bcut.solving.sampling import sample_vertices
from bcut.solving.search import Part, Search, bound_at_root, branch, place

# A value within this relative distance of the bound counts as optimal where values are not integral.
RELATIVE_GAP = 1e-9
# The largest cost may be so many times a value that solvers find.
_RESOLVED = 1000.0
# So many targets go up by one step each, before steps grow: on targets that are met exactly, little is left to search.
_STEADY = 3


def solve_by_targets(search: Search) -> None:
    """Solve where costs, and so the values of triangulations, are small multiples of a unit, such as 1.

    The smallest value that the root bound allows is a target. Only columns whose reduced cost is at most
    target - bound can be in a triangulation that reaches it; on those the relaxation is cut, and SCIP
    searches what is left. Either some triangulation reaches the target, and the best of those is optimal, or
    none does, and the target moves up: by one unit at first, then in growing steps, since with large costs there
    may be many values below the optimum.
    """
    root = bound_at_root(search, search.whole, None)
    if root.first is None:
        _note_infeasible(search, root)
        return
    reach_targets(search)


def reach_targets(search: Search) -> None:
    """Solve from target to target, with the exact bound of the whole, ``search.exact``, known."""
    assert search.exact is not None
    objective = search.whole.objective
    unit = objective.unit
    search.raise_bound(objective.rounded_up(search.exact.value))
    refuted = 0
    while not is_optimal(search):
        assert search.bound is not None
        step = max(1, abs(search.bound) // (1000 * unit)) << max(0, refuted - _STEADY)
        target = search.bound + (step - 1) * unit
        if search.value is not None:
            target = min(target, search.sign * search.value - unit)
        columns = search.exact.columns_within(target)
        outcome, stages = _reach(search, search.whole.restricted_to(columns), target)
        if outcome == "refuted":
            refuted += 1
            search.refutation = (target, tuple(stages)) if stages else None
            search.raise_bound(target + unit)
            if search.restricted and search.value is None:
                # There may be no solution at all, and then no target is the last one.
                solve_at_once(search)
                return
            # Cuts that are not valid refute every target; below a triangulation there is a last one.
            place(search)
        elif outcome == "reached":
            assert search.value is not None
            search.raise_bound(search.sign * search.value)
        elif outcome != "improved":
            search.status = outcome
            return
    search.status = "optimal"


def is_optimal(search: Search) -> bool:
    """Tell whether the best triangulation found meets the proven bound."""
    value = search.value
    return value is not None and search.bound is not None and search.sign * value <= search.bound


def _reach(
    search: Search, part: Part, target: Fraction
) -> tuple[Literal["reached", "improved", "refuted", "limit", "interrupted"], list[Stage]]:
    """Find a best triangulation on a part that contains all those with at most the target value (times sign).

    Where the relaxations alone refute the target, the stages are the proof. "improved" says that a better triangulation
    within the target was found, but perhaps no best one.
    """
    root = bound_at_root(search, part, search.separation(part), target=target)
    search.columns_after_fixing = len(root.columns)
    if root.status in ("infeasible", "target"):
        return "refuted", root.stages
    objective = search.whole.objective
    if root.status == "integral" and root.last is not None and search.value is not None:
        # An optimum of the part, up to the accuracy of the relaxation; the exact bound decides whether it is.
        value, proven = search.sign * search.value, objective.rounded_up(root.last.value)
        if value <= min(target, proven):
            return "reached", []
        if proven > target:
            return "refuted", root.stages
    if search.seconds_left == 0.0:
        return "limit", []
    before = search.value
    sample_vertices(search, part, root, target)
    if is_optimal(search):
        return "reached", []
    if search.value != before:
        return "improved", []
    # SCIP keeps solutions strictly better than the cutoff; no other value lies within half a unit of the target.
    status = branch(search, part, root, cutoff=float(search.sign * (target + objective.unit / 2)))
    if status == "infeasible":
        return "refuted", []
    if status == "optimal" or is_optimal(search):
        return "reached", []
    return "interrupted" if status == "interrupted" else "limit", []


def solve_at_once(search: Search) -> None:
    """Cut the relaxation of all columns, then hand it to SCIP with its cuts: any objective."""
    place(search)
    goal = None
    if search.value is not None:
        goal = search.sign * search.value - Fraction(_accuracy(search, search.value))
    root = bound_at_root(search, search.whole, search.separation(search.whole), goal=goal)
    if root.status == "infeasible" or root.first is None:
        _note_infeasible(search, root)
        return
    if _is_close(search):
        search.status = "optimal"
        return
    if search.seconds_left == 0.0:
        return
    _finish(search, branch(search, search.whole, root))


def solve_in_scip(search: Search) -> None:
    """Leave everything to SCIP and the separators inside it: no root loop of ours, no fixing."""
    place(search)
    _finish(search, branch(search, search.whole, None))


def _note_infeasible(search: Search, root: RootBound) -> None:
    if root.status == "infeasible":
        search.status = "infeasible"


def _is_close(search: Search) -> bool:
    value, bound = search.value, search.bound
    if value is None or bound is None:
        return False
    return float(search.sign * value - bound) <= _accuracy(search, value)


def _accuracy(search: Search, value: Fraction) -> float:
    """Return by how much an optimal value may differ from its bound."""
    # No more than the gap that verification accepts, which is relative to the value, or to 1 where that is smaller.
    size = abs(float(value))
    return RELATIVE_GAP * min(max(search.whole.objective.largest_cost, size), max(1.0, size))


def is_resolved(objective: Objective, value: Fraction | None) -> bool:
    """Tell whether a solver can tell the value of a best triangulation from others.

    Its tolerances are relative to the largest cost, so where costs of opposite signs nearly cancel, or a triangulation
    has cheap simplices only, they say next to nothing of the value.
    """
    size = max(abs(float(value or 0)), min(1.0, objective.largest_cost))
    return objective.counts_units or objective.largest_cost <= _RESOLVED * size


def _finish(search: Search, status: str) -> None:
    if status == "optimal":
        if not is_resolved(search.whole.objective, search.value):
            # What SCIP's bound says within its tolerance is all there is.
            value, bound = search.value, search.bound
            reached = (
                value is not None and bound is not None and search.sign * value <= search.rounded_up(bound)
            )
            search.status = "optimal" if reached or _is_close(search) else "limit"
            return
        search.status = "optimal"
        # SCIP stops at its own tolerance; its bound is the value then.
        assert search.value is not None
        search.raise_bound(search.sign * search.value)
    elif status == "interrupted":
        search.status = "interrupted"
    elif status == "infeasible":
        search.status = "infeasible"

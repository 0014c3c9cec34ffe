"""The way to an optimum for many simplices without symmetry: bound first, fix nearly all, solve what is left exactly.

1. A triangulation is improved by flips.
2. Multipliers for all rows come from a first-order method, and their bound B is proven in integers.
3. S are the simplices with the smallest reduced costs r, some per cent of all. The best triangulation within S is found
   in the ordinary way: relaxation, cuts, SCIP. It is often the vertex that the relaxation ends at.
4. A triangulation that uses a simplex outside S is worth at least B + min r there. Where that is no better, the best
   within S is the best of all; else S grows, after better multipliers where it would grow much.

Where values are integral multiples of a unit that is large beside the gap, as for cardinality, S is what a
triangulation with the smallest value that the bound allows may use, and targets rise as in `bcut.solving.strategies`.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.compact_bound import CompactBound, compact_bound, restricted_program
from bcut.bounds.compact_relaxation import CompactDuals, bound_relaxation
from bcut.result import Certificate
from bcut.solving.capping import with_capped_costs
from bcut.solving.compact_part import CompactPart, anneal_incumbent, improve_incumbent
from bcut.solving.fixing_certificate import certify, make_compact_certificate
from bcut.solving.memory import used_memory
from bcut.solving.search import Part, Search, bound_at_root
from bcut.solving.strategies import is_optimal, reach_targets, solve_at_once

# Relative accuracies of the multipliers: the first is what the small program needs to have the optimum in it.
_TOLERANCE, _SHARPER, _SHARPEST = 1e-4, 0.1, 1e-7
# Simplices with reduced costs up to this many times the gap of the multipliers are in the small program, and up to
# this part of the bound, and those of which the multipliers' point has more than this.
_GAPS, _LEAST, _IN_USE = 0.7, 1e-5, 0.01
# Cuts without branching need more columns: the bound cannot rise above what those that are left out would cost.
_ROOM_FOR_CUTS = 10
# A small program that would become larger than this, and this many times larger, waits for better multipliers.
_MOST, _GROWTH = 20_000, 2.0
# So many times more columns are taken where a triangulation that is far from the bound asks for nearly all.
_STEP = 4
# The gap between the smallest two values, relative to the bound, from which on targets are better than a threshold.
_LARGE_UNIT = 1e-3


def solve_by_fixing(search: Search) -> None:
    """Solve a search whose whole is a `CompactPart`.

    Parameters
    ----------
    search : Search
        It may know a triangulation already. At a limit it keeps the best one, and the bound proven so far.
    """
    _Fixing(search).run()


def bound_by_fixing(search: Search) -> None:
    """Bound at the root, with cuts over the columns that matter, and with no branching."""
    _Fixing(search).bound_only()


class _Fixing:
    """One solve: multipliers, what they prove, and the small programs.

    Attributes
    ----------
    everything : CompactPart
        All columns.
    whole : CompactPart
        Those of them that cost no more than a known triangulation, where no cost is negative.
    duals : CompactDuals or None
        The latest multipliers.
    best : ndarray of float, shape (r + 1,), or None
        Those with the best bound.
    bound : CompactBound or None
        What they prove of `whole`.
    """

    def __init__(self, search: Search) -> None:
        whole = search.whole
        assert isinstance(whole, CompactPart)
        self.search, self.everything, self.whole = search, whole, whole
        self.duals: CompactDuals | None = None
        self.best: NDArray[np.float64] | None = None
        self.bound: CompactBound | None = None

    def run(self) -> None:
        """Solve."""
        search = self.search
        try:
            self._start()
            self._solve()
        finally:
            self._end()
        if search.status == "optimal":
            search.certificate = self._certificate(proven=True)

    def bound_only(self) -> None:
        """Bound at the root."""
        search = self.search
        try:
            self._start()
            if not self._sharpen(_TOLERANCE, fixing=False):
                search.status = "limit"
                return
            columns, beyond = self._cheapest(self._threshold_for_cuts())
            child = self._child(columns)
            root = bound_at_root(child, child.whole, child.separation(child.whole))
            self._keep(child, columns, beyond)
            if root.last is not None:
                search.raise_bound(min(root.last.value, beyond))
            if root.status == "limit":
                search.status = "limit"
        finally:
            self._end()

    def _start(self) -> None:
        """Have a triangulation, and drop the columns that cost more than all of it."""
        search = self.search
        self._tell("incumbent")
        improve_incumbent(search)
        self._tell("incumbent")
        objective = self.everything.objective
        signed = objective.sign * objective.costs
        if search.value is None or signed.min() < 0:
            return
        kept = np.flatnonzero(signed <= float(search.sign * search.value) * (1 + 1e-12))
        if len(kept) == len(signed):
            return
        assert search.columns is not None
        program = restricted_program(self.everything.program, kept)
        part, columns = CompactPart.of(program, objective.restricted_to(kept)), np.sort(search.columns)
        self.kept, self.whole = kept, part
        search.whole, search.columns = part, np.searchsorted(kept, columns)

    def _end(self) -> None:
        """Speak of all columns again."""
        search = self.search
        if self.whole is not self.everything:
            if search.columns is not None:
                search.columns = self.kept[search.columns]
            search.whole = self.everything
        search.exact = None
        if search.status != "optimal":
            search.certificate = self._certificate(proven=False)

    def _certificate(self, *, proven: bool) -> Certificate | None:
        search, everything = self.search, self.everything
        if self.best is None:
            return None
        if proven and search.refutation is not None and self.whole is everything:
            assert self.bound is not None
            return make_compact_certificate(
                everything.program, everything.objective, self.bound, search.refutation
            )
        value = search.sign * search.value if proven and search.value is not None else None
        with search.timed("certificate"):
            return certify(everything.program, everything.objective, self.best, value, search.deadline)

    def _solve(self) -> None:
        search = self.search
        if not self._sharpen(_TOLERANCE):
            return
        assert self.bound is not None
        if is_optimal(search):
            search.status = "optimal"
        elif self._unit_is_large():
            # Relaxations of such objectives end at no triangulation, and so are no help in finding one.
            anneal_incumbent(search, self.bound.bound.reduced_costs * float(self.bound.bound.unit))
            if is_optimal(search):
                search.status = "optimal"
                return
            self._tell("targets")
            search.exact = self.bound.bound
            reach_targets(search)
        else:
            self._by_thresholds()

    def _sharpen(self, tolerance: float, *, fixing: bool = True) -> bool:
        """Find multipliers and prove their bound; tell whether there was time for the accuracy asked for.

        With `fixing`, less accuracy will do once the triangulation known leaves few columns.
        """
        search, whole = self.search, self.whole
        with search.timed("multipliers"):
            duals = bound_relaxation(
                whole.program,
                whole.objective,
                tolerance=tolerance,
                incumbent=float(search.sign * search.value) if fixing and search.value is not None else None,
                start=self.duals,
                everything=self.everything.program,
                seconds=search.seconds_left,
                on_progress=lambda facts: self._tell("multipliers", **facts),
            )
            self.duals = duals
            found = compact_bound(whole.program, whole.objective, duals.y)
        if self.bound is None or found.bound.value > self.bound.bound.value:
            self.bound, self.best = found, duals.y
        search.raise_bound(whole.objective.rounded_up(self.bound.bound.value))
        # Until a relaxation is solved to the end: below its value, but proven.
        search.lp = search.lp_after_cuts = float(search.sign * self.bound.bound.value)
        self._tell("multipliers")
        if duals.status == "interrupted":
            raise KeyboardInterrupt
        return duals.status != "limit"

    def _tell(self, stage: str, **facts: Any) -> None:
        """Report the columns alive and the memory used."""
        search = self.search
        if search.on_progress is None:
            return
        count = len(self.whole.columns)
        if self.bound is not None and search.value is not None:
            count = len(self.bound.bound.columns_within(search.sign * search.value))
        search.report(stage, **{"columns": count, "memory": used_memory(), **facts})

    def _unit_is_large(self) -> bool:
        assert self.bound is not None
        objective = self.whole.objective
        return objective.counts_units and objective.unit > _LARGE_UNIT * abs(self.bound.bound.value)

    def _first_threshold(self) -> Fraction:
        """Return up to which reduced cost columns are in the first small program."""
        assert self.duals is not None
        assert self.bound is not None
        search = self.search
        size = abs(float(self.bound.bound.value))
        gap = abs(self.duals.primal - float(self.bound.bound.value))
        threshold = Fraction(max(_GAPS * gap, _LEAST * size))
        if search.value is not None:
            threshold = min(threshold, search.sign * search.value - self.bound.bound.value)
        return threshold

    def _threshold_for_cuts(self) -> Fraction:
        """Return up to which reduced cost columns are in the program whose relaxation is cut."""
        assert self.bound is not None
        objective, value = self.whole.objective, self.bound.bound.value
        if self._unit_is_large():
            # A solution with any other column is worse than the least value that the bound allows.
            return objective.rounded_up(value) - value
        return _ROOM_FOR_CUTS * self._first_threshold()

    def _by_thresholds(self) -> None:
        search, tolerance = self.search, _TOLERANCE
        threshold = self._first_threshold()
        while True:
            columns, beyond = self._cheapest(threshold)
            child = self._solve_on(columns, beyond)
            if child.bound is not None:
                search.raise_bound(min(child.bound, beyond))
            if child.status != "optimal":
                search.status = child.status
                return
            assert search.value is not None
            if search.sign * search.value <= beyond:
                search.raise_bound(search.sign * search.value)
                search.status = "optimal"
                return
            next_threshold, tolerance = self._next(len(columns), tolerance)
            if next_threshold is None:
                return
            threshold = next_threshold

    def _next(self, size: int, tolerance: float) -> tuple[Fraction | None, float]:
        """Return the threshold that will do, after better multipliers where it asks for too many columns.

        None where there is no time for these.
        """
        search = self.search
        while True:
            assert self.bound is not None
            assert search.value is not None
            threshold = search.sign * search.value - self.bound.bound.value
            needed = len(self.bound.bound.columns_within(search.sign * search.value))
            if needed <= max(_MOST, _GROWTH * size):
                return threshold, tolerance
            more = _STEP * size
            if more <= max(_MOST, needed // _STEP):
                # The triangulation is far from the bound: a better one is likely among a few more columns.
                reduced = self.bound.bound.reduced_costs
                return int(np.partition(reduced, more)[more]) * self.bound.bound.unit, tolerance
            if tolerance <= _SHARPEST:
                return threshold, tolerance
            tolerance *= _SHARPER
            if not self._sharpen(tolerance):
                return None, tolerance

    def _cheapest(self, threshold: Fraction) -> tuple[NDArray[np.intp], Fraction]:
        """Return the columns with reduced costs up to a threshold, and what any other one makes a solution cost."""
        assert self.bound is not None
        bound = self.bound.bound
        chosen = np.zeros(len(bound.reduced_costs), dtype=bool)
        chosen[bound.columns_within(bound.value + threshold)] = True
        if self.duals is not None:
            chosen |= self.duals.x > _IN_USE
        if self.search.columns is not None:
            chosen[self.search.columns] = True
        rest = bound.reduced_costs[~chosen]
        # With all columns in, nothing is beyond them.
        least = int(rest.min()) if len(rest) else 2**62
        return np.flatnonzero(chosen), bound.value + least * bound.unit

    def _child(self, columns: NDArray[np.intp]) -> Search:
        """Return a search over some columns, those of the incumbent among them."""
        search = self.search
        part = self.whole.restricted_to(columns)
        search.columns_after_fixing = len(columns)

        def on_progress(facts: dict[str, Any]) -> None:
            # Its bounds are those of these columns only.
            own = {key: facts[key] for key in ("value", "lp", "cuts", "nodes") if facts.get(key) is not None}
            search.report(facts["stage"], columns=len(columns), memory=used_memory(), **own)

        return Search(
            whole=Part.whole(part.formulation, part.objective),
            make_separators=search.make_separators,
            deadline=search.deadline,
            seed=search.seed,
            on_progress=on_progress,
            cut_observer=search.cut_observer,
            columns=None if search.columns is None else np.searchsorted(columns, np.sort(search.columns)),
            statistics=search.statistics,
            seconds=search.seconds,
        )

    def _solve_on(self, columns: NDArray[np.intp], beyond: Fraction) -> Search:
        """Find the best triangulation on some columns."""
        child = self._child(columns)
        try:
            with_capped_costs(child, solve_at_once)
        finally:
            self._keep(child, columns, beyond)
        return child

    def _keep(self, child: Search, columns: NDArray[np.intp], beyond: Fraction) -> None:
        """Take over what the search over some columns has found.

        Its relaxations are those of all columns as long as they stay below what the others would cost.
        """
        search = self.search
        if child.columns is not None:
            search.offer(columns[child.columns])
        search.nodes += child.nodes
        search.rounds.extend(child.rounds)
        search.root_is_integral = child.root_is_integral
        if child.lp is None or child.lp_after_cuts is None or search.sign * child.lp > beyond:
            return
        search.lp = child.lp
        search.lp_after_cuts = search.sign * min(search.sign * child.lp_after_cuts, float(beyond))

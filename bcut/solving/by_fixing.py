"""The way to an optimum for many simplices without symmetry: bound first, fix nearly all, solve what is left exactly.

1. A triangulation is improved by flips.
2. Multipliers for all rows come from a first-order method, and their bound B is proven in integers.
3. S are the simplices with the smallest reduced costs r, some per cent of all. The best triangulation within S is found
   in the ordinary way: relaxation, cuts, SCIP. It is often the vertex that the relaxation ends at.
4. A triangulation that uses a simplex outside S is worth at least B + min r there. Where that is no better, the best
   within S is the best of all; else S grows, after better multipliers where it would grow much.

Where values are integral multiples of a unit that is large beside the gap, as for cardinality, S is what a triangulation
with the smallest value that the bound allows may use, and targets rise as in `bcut.solving.strategies`.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from fractions import Fraction
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.compact_bound import CompactBound, compact_bound
from bcut.bounds.compact_relaxation import CompactDuals, bound_relaxation
from bcut.formulations.compact import CompactProgram
from bcut.formulations.formulation import Formulation
from bcut.geometry.delaunay import first_triangulation
from bcut.geometry.flips import improve_by_flips
from bcut.objectives.objective import Objective
from bcut.solving.memory import used_memory
from bcut.solving.search import Part, Search
from bcut.solving.strategies import is_optimal, reach_targets, solve_at_once

# Relative accuracies of the multipliers: the first is what the small program needs to have the optimum in it.
_TOLERANCE, _SHARPER, _SHARPEST = 1e-4, 0.1, 1e-7
# Simplices with reduced costs up to this many times the gap of the multipliers are in the small program.
_GAPS = 3.0
# A small program that would become larger than this, and this many times larger, waits for better multipliers.
_MOST, _GROWTH = 20_000, 2.0
# The gap between the smallest two values, relative to the bound, from which on targets are better than a threshold.
_LARGE_UNIT = 1e-3
# Seconds of local search, at most, and its share of what is left.
_SECONDS_OF_FLIPS, _SHARE_OF_FLIPS = 20.0, 0.2


@dataclass(frozen=True, eq=False)
class CompactPart(Part):
    """All columns, as flat arrays; its formulation has the simplices, but not the rows.

    Attributes
    ----------
    program : CompactProgram
    """

    program: CompactProgram

    @classmethod
    def of(cls, program: CompactProgram, objective: Objective) -> CompactPart:
        """Return the part that is everything."""
        return cls(_without_rows(program), objective, np.arange(len(program.simplices)), program)

    def restricted_to(self, columns: NDArray[np.intp]) -> Part:
        """Return an ordinary part on some columns, ascending."""
        return Part(self.program.formulation(columns), self.objective.restricted_to(columns), columns)


def _without_rows(program: CompactProgram) -> Formulation:
    import scipy.sparse as sp

    none = np.empty(0, dtype=np.int64)
    return Formulation(
        name="2",
        configuration=program.configuration,
        chirotope=program.chirotope,
        simplices=program.simplices,  # type: ignore[arg-type]
        spanning=program.spanning,
        matrix=sp.csr_matrix((0, len(program.simplices)), dtype=np.int8),
        lower=none,
        upper=none,
        row_faces=(),
    )


def solve_by_fixing(search: Search) -> None:
    """Solve a search whose whole is a `CompactPart`.

    Parameters
    ----------
    search : Search
        It may know a triangulation already. At a limit it keeps the best one, and the bound proven so far.
    """
    _Fixing(search).run()


def bound_by_fixing(search: Search) -> None:
    """Bound only, without cuts."""
    fixing = _Fixing(search)
    fixing.start()
    if fixing.sharpen(_SHARPEST):
        fixing.record_bound()


def improve_incumbent(search: Search) -> None:
    """Find a triangulation and improve it by flips; one that is not made of the columns at hand is not kept."""
    whole = search.whole
    assert isinstance(whole, CompactPart)
    program, objective = whole.program, whole.objective

    def costs_of(simplices: NDArray[np.int64]) -> NDArray[np.float64]:
        columns = program.columns_of(simplices)
        return np.where(columns >= 0, objective.sign * objective.costs[columns], inf)

    with search.timed("incumbent"):
        left = inf if search.seconds_left is None else search.seconds_left
        seconds = min(_SECONDS_OF_FLIPS, _SHARE_OF_FLIPS * left)
        if search.columns is None:
            simplices = first_triangulation(program.configuration, program.chirotope)
            _offer(search, program.columns_of(simplices))
        else:
            simplices = program.simplices[search.columns].astype(np.int64)
        improved = improve_by_flips(
            simplices,
            program.chirotope,
            costs_of,
            spanning=program.spanning,
            deadline=time.monotonic() + seconds,
        )
        _offer(search, program.columns_of(improved))


def _offer(search: Search, columns: NDArray[np.int64]) -> None:
    if (columns >= 0).all():
        search.offer(np.sort(columns))


class _Fixing:
    """One solve: multipliers, what they prove, and the small programs.

    Attributes
    ----------
    duals : CompactDuals or None
        The latest multipliers.
    bound : CompactBound or None
        What they prove of all columns.
    """

    def __init__(self, search: Search) -> None:
        whole = search.whole
        assert isinstance(whole, CompactPart)
        self.search, self.whole = search, whole
        self.program, self.objective = whole.program, whole.objective
        self.duals: CompactDuals | None = None
        self.bound: CompactBound | None = None

    def run(self) -> None:
        search = self.search
        self.start()
        tolerance = _TOLERANCE
        if not self.sharpen(tolerance):
            return
        assert self.bound is not None
        if is_optimal(search):
            search.status = "optimal"
        elif self._unit_is_large():
            self.tell("targets")
            search.exact = self.bound.bound
            reach_targets(search)
        else:
            self._by_thresholds(tolerance)
        if search.status == "optimal" and self.bound.plain:
            search.exact = self.bound.bound

    def start(self) -> None:
        """Have a triangulation."""
        self.tell("incumbent")
        improve_incumbent(self.search)
        self.tell("incumbent")

    def sharpen(self, tolerance: float) -> bool:
        """Find multipliers and prove their bound; tell whether there was time for the accuracy asked for."""
        search = self.search
        with search.timed("multipliers"):
            duals = bound_relaxation(
                self.program,
                self.objective,
                tolerance=tolerance,
                incumbent=None if search.value is None else float(search.sign * search.value),
                start=self.duals,
                seconds=search.seconds_left,
                on_progress=lambda facts: self.tell("multipliers", **facts),
            )
            self.duals = duals
            found = compact_bound(self.program, self.objective, duals.y)
        if self.bound is None or found.bound.value > self.bound.bound.value:
            self.bound = found
        self.record_bound()
        if duals.status == "interrupted":
            raise KeyboardInterrupt
        return duals.status != "limit"

    def record_bound(self) -> None:
        """Keep what is proven."""
        assert self.bound is not None and self.duals is not None
        search = self.search
        search.raise_bound(self.bound.bound.value)
        search.exact = self.bound.bound if self.bound.plain else None
        if search.lp is None:
            search.lp = search.lp_after_cuts = search.sign * self.duals.primal
        self.tell("multipliers")

    def tell(self, stage: str, **facts: Any) -> None:
        """Report the columns alive and the memory used."""
        search = self.search
        count = len(self.program.simplices)
        if self.bound is not None and search.value is not None:
            count = len(self.bound.bound.columns_within(search.sign * search.value))
        search.report(stage, **{"columns": count, "memory": used_memory(), **facts})

    def _unit_is_large(self) -> bool:
        assert self.bound is not None
        unit = self.objective.unit
        return self.objective.counts_units and unit > _LARGE_UNIT * abs(self.bound.bound.value)

    def _by_thresholds(self, tolerance: float) -> None:
        search = self.search
        assert self.duals is not None and self.bound is not None
        size = abs(float(self.bound.bound.value))
        gap = max(abs(self.duals.primal - float(self.bound.bound.value)), tolerance * size / _GAPS)
        threshold = Fraction(_GAPS * gap)
        if search.value is not None:
            threshold = min(threshold, search.sign * search.value - self.bound.bound.value)
        while True:
            columns, beyond = self._cheapest(threshold)
            child = self._solve_on(columns)
            if child.bound is not None:
                search.raise_bound(min(child.bound, beyond))
            if child.status != "optimal":
                search.status = child.status
                return
            assert search.value is not None
            if search.sign * search.value <= beyond:
                search.raise_bound(min(search.sign * search.value, beyond))
                search.status = "optimal"
                search.columns_after_fixing = child.columns_after_fixing or len(columns)
                return
            threshold, tolerance, enough = self._next(len(columns), tolerance)
            if not enough:
                return

    def _next(self, size: int, tolerance: float) -> tuple[Fraction, float, bool]:
        """Return the threshold that will do, after better multipliers where it asks for too many columns."""
        search = self.search
        while True:
            assert self.bound is not None and search.value is not None
            threshold = search.sign * search.value - self.bound.bound.value
            needed = len(self.bound.bound.columns_within(search.sign * search.value))
            if needed <= max(_MOST, _GROWTH * size) or tolerance <= _SHARPEST:
                return threshold, tolerance, True
            tolerance *= _SHARPER
            if not self.sharpen(tolerance):
                return threshold, tolerance, False

    def _cheapest(self, threshold: Fraction) -> tuple[NDArray[np.intp], Fraction]:
        """Return the columns with reduced costs up to a threshold, and what any other one makes a solution cost."""
        assert self.bound is not None
        bound = self.bound.bound
        chosen = np.zeros(len(bound.reduced_costs), dtype=bool)
        chosen[bound.columns_within(bound.value + threshold)] = True
        if self.search.columns is not None:
            chosen[self.search.columns] = True
        rest = bound.reduced_costs[~chosen]
        # With all columns in, nothing is beyond them.
        least = int(rest.min()) if len(rest) else 2**62
        return np.flatnonzero(chosen), bound.value + least * bound.unit

    def _solve_on(self, columns: NDArray[np.intp]) -> Search:
        """Find the best triangulation on some columns, those of the incumbent among them."""
        search = self.search
        part = self.whole.restricted_to(columns)
        search.columns_after_fixing = len(columns)

        def on_progress(facts: dict[str, Any]) -> None:
            # Bounds are those of these columns only.
            known = {key: facts[key] for key in ("lp", "cuts", "nodes") if key in facts}
            value = facts.get("value")
            if search.on_progress is not None:
                bound = None if search.bound is None else float(search.sign * search.bound)
                search.on_progress(
                    {
                        "stage": facts["stage"],
                        "value": value,
                        "bound": bound,
                        "columns": len(columns),
                        "memory": used_memory(),
                        **known,
                    }
                )

        child = Search(
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
        try:
            solve_at_once(child)
        finally:
            if child.columns is not None:
                search.offer(columns[child.columns])
            search.nodes += child.nodes
            search.rounds.extend(child.rounds)
            search.root_is_integral = child.root_is_integral
            if child.lp is not None:
                search.lp, search.lp_after_cuts = child.lp, child.lp_after_cuts
        return child

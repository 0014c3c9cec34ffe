"""The state of a solve, and its two kinds of work: bounding at the root, and branching."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.root import RootBound, RootLimits, Round, Stage, root_bound
from bcut.bounds.safe import SafeBound
from bcut.formulations.formulation import Formulation
from bcut.geometry.placing import placing_triangulation
from bcut.objectives.objective import Objective
from bcut.result import Certificate, Status
from bcut.separation.driver import FamilyStatistics, Separation
from bcut.separation.observer import CutObserver
from bcut.separation.seam import Problem, Separator

if TYPE_CHECKING:
    from bcut.scip.host import TreeStatus

Progress = Callable[[dict[str, Any]], None]


@dataclass(frozen=True, eq=False)
class Part:
    """A formulation and its objective on some columns of the whole.

    Attributes
    ----------
    columns : ndarray of int
        Where its columns stand in the whole formulation.
    """

    formulation: Formulation
    objective: Objective
    columns: NDArray[np.intp]

    @classmethod
    def whole(cls, formulation: Formulation, objective: Objective) -> Part:
        """Return the part that is everything."""
        return cls(formulation, objective, np.arange(len(formulation.simplices)))

    def restricted_to(self, columns: NDArray[np.intp]) -> Part:
        """Return the part on some columns of this one."""
        return Part(
            self.formulation.restricted_to(columns),
            self.objective.restricted_to(columns),
            self.columns[columns],
        )


@dataclass
class Search:
    """What a solve knows so far; every stage reads it and adds to it.

    Attributes
    ----------
    whole : Part
    make_separators : callable
        Returns fresh separators; each part of a solve gets its own.
    status : str
        As in a result.
    columns : ndarray of int or None
        The best triangulation found.
    bound : Fraction or None
        Bound on ``sign * objective``. What of it is proven exactly stands in the certificate; it may go beyond that
        where a solver says that a relaxation has no point, or that its tree is finished.
    unit : Fraction or None
        Every value is an integral multiple of it; None where the costs of the whole tell. Where the whole has a part
        of the candidates only, these may have a larger common divisor.
    restricted : bool
        Whether there may be no solution at all.
    exact : SafeBound or None
        Exact bound of the relaxation of the whole, without cuts.
    refutation : (Fraction, tuple of Stage) or None
        The last target that was refuted, and the proof, where the relaxations alone make one.
    certificate : Certificate or None
        Of a bound over orbits, or of a threshold.
    """

    whole: Part
    make_separators: Callable[[], list[Separator]]
    deadline: float | None = None
    seed: int = 0
    on_progress: Progress | None = None
    cut_observer: CutObserver | None = None
    status: Status = "limit"
    columns: NDArray[np.intp] | None = None
    bound: Fraction | None = None
    unit: Fraction | None = None
    restricted: bool = False
    exact: SafeBound | None = None
    refutation: tuple[Fraction, tuple[Stage, ...]] | None = None
    certificate: Certificate | None = None
    lp: float | None = None
    lp_after_cuts: float | None = None
    root_is_integral: bool | None = None
    rounds: list[tuple[str, Round]] = field(default_factory=list)
    columns_after_fixing: int | None = None
    nodes: int = 0
    statistics: dict[str, FamilyStatistics] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def sign(self) -> int:
        """1 for a minimum, -1 for a maximum."""
        return self.whole.objective.sign

    @property
    def value(self) -> Fraction | None:
        """Exact value of the best triangulation found."""
        return None if self.columns is None else self.whole.objective.value(self.columns)

    @property
    def seconds_left(self) -> float | None:
        """Seconds until the deadline, None without one."""
        return None if self.deadline is None else max(0.0, self.deadline - time.monotonic())

    def offer(self, columns: NDArray[np.intp]) -> None:
        """Keep a triangulation if it is the best so far."""
        found = self.sign * self.whole.objective.value(columns)
        if self.value is None or found < self.sign * self.value:
            self.columns = columns

    def raise_bound(self, bound: Fraction) -> None:
        """Keep a bound on ``sign * objective`` if it is the best so far."""
        if self.bound is None or bound > self.bound:
            self.bound = bound

    @property
    def value_unit(self) -> Fraction:
        """A number of which every value is an integral multiple."""
        return self.whole.objective.unit if self.unit is None else self.unit

    def rounded_up(self, bound: Fraction) -> Fraction:
        """Round a bound on ``sign * objective`` up to the next value that a triangulation can have."""
        if self.unit is None:
            return self.whole.objective.rounded_up(bound)
        return ceil(bound / self.unit) * self.unit

    def report(self, stage: str, **facts: Any) -> None:
        """Tell whoever watches how far the solve is."""
        if self.on_progress is not None:
            value = None if self.value is None else float(self.value)
            bound = None if self.bound is None else float(self.sign * self.bound)
            self.on_progress({"stage": stage, "value": value, "bound": bound, **facts})

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Add the time of the block to a stage."""
        started = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - started

    def separation(self, part: Part) -> Separation | None:
        """Put fresh separators to work on a part; the statistics of all parts add up."""
        separators = self.make_separators()
        if not separators:
            return None
        return Separation(
            separators,
            Problem(part.formulation),
            statistics=self.statistics,
            observer=self.cut_observer,
            deadline=self.deadline,
        )


def place(search: Search) -> None:
    """Find the placing triangulation: it costs next to nothing, and whatever comes, there is one to hand out.

    Where a triangulation is known there is one already, and another one may break what earlier objectives settled.
    """
    if search.columns is not None:
        return
    whole = search.whole.formulation
    columns = whole.columns_of(placing_triangulation(whole.configuration, whole.chirotope))
    if (columns >= 0).all():
        search.offer(columns)


def bound_at_root(
    search: Search,
    part: Part,
    separation: Separation | None,
    *,
    target: Fraction | None = None,
    goal: Fraction | None = None,
) -> RootBound:
    """Run the cutting-plane loop on a part; keep an integral point as a triangulation.

    Without a deadline the loop ends by itself. With a `target` it ends as soon as the bound exceeds it, with a
    `goal` as soon as the bound reaches that. What relaxations of the whole prove is kept at once, as
    ``search.exact`` and in the bound: it stands however the loop ends.
    """

    def on_round(finished: Round) -> None:
        search.rounds.append(("root", finished))
        if search.lp is None:
            search.lp = finished.lp
        search.lp_after_cuts = finished.lp
        search.report("root", lp=finished.lp, cuts=sum(finished.cuts.values()))

    def on_relaxed(known: RootBound) -> None:
        # Parts, and targets, say nothing of the whole.
        if part is not search.whole or target is not None:
            return
        if search.lp is None:
            search.lp = known.lp
        search.lp_after_cuts, search.exact = known.lp_after_cuts, known.first
        if known.last is not None:
            search.raise_bound(known.last.value)

    limits = RootLimits(deadline=search.deadline, target=target, goal=goal)
    with search.timed("root"):
        root = root_bound(
            part.formulation,
            part.objective,
            separation,
            limits=limits,
            on_round=on_round,
            on_relaxed=on_relaxed,
        )
    search.root_is_integral = root.status == "integral"
    if root.status == "integral" and root.point is not None:
        search.offer(part.columns[root.columns[root.point > 0.5]])
    return root


def branch(
    search: Search,
    part: Part,
    root: RootBound | None,
    *,
    cutoff: float | None = None,
    seconds: float | None = None,
) -> TreeStatus:
    """Let SCIP search a part, with the cuts and separators of its root bound; returns SCIP's status.

    Parameters
    ----------
    search : Search
    part : Part
    root : RootBound or None
        Of this part. Without it the separators start anew.
    cutoff : float, optional
        Only triangulations strictly better than this are wanted. Without it the part is the whole, and the
        search starts from the best triangulation so far.
    seconds : float, optional
        At most so long, within the deadline of the search.
    """
    from bcut.scip.host import TreeOptions, branch_and_cut

    if root is None:
        separation, cuts = search.separation(part), []
    else:
        separation, cuts = root.separation, root.cuts
        part = part.restricted_to(root.columns)
    limits = [limit for limit in (search.seconds_left, seconds) if limit is not None]
    options = TreeOptions(seconds=min(limits, default=None), seed=search.seed, cutoff=cutoff)

    def on_progress(facts: dict[str, Any]) -> None:
        # With a cutoff, SCIP's bounds are those of a part only.
        seen = {} if cutoff is not None else {k: facts[k] for k in ("value", "bound") if facts[k] is not None}
        search.report("tree", columns=len(part.columns), nodes=facts["nodes"], **seen)

    search.report("tree", columns=len(part.columns), nodes=0)
    with search.timed("tree"):
        tree = branch_and_cut(
            part.formulation,
            part.objective,
            separation,
            options=options,
            cuts=cuts,
            start=search.columns if cutoff is None else None,
            on_progress=on_progress,
        )
    search.nodes += tree.nodes
    search.rounds.extend(("tree", finished) for finished in tree.rounds)
    if tree.columns is not None:
        search.offer(part.columns[tree.columns])
    if search.lp is None and tree.rounds:
        search.lp, search.lp_after_cuts = tree.rounds[0].lp, tree.rounds[-1].lp
    if tree.bound is not None and cutoff is None:
        # Within SCIP's tolerance: a bound of 22.0000001 must not be rounded up to 23.
        bound = Fraction(search.sign * tree.bound)
        size = max(Fraction(search.whole.objective.largest_cost), abs(bound))
        search.raise_bound(bound - size / 10**6)
    return tree.status

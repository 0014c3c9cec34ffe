"""The way to an optimum for symmetric configurations: bound over orbits, fix orbits, search what is left.

No step lists all simplices, so configurations such as the 6-cube, with 366 million of them, can be solved.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from math import comb, inf
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.averaged import AveragedPart
from bcut.errors import TooLargeError
from bcut.formulations.partial_cocircuits import partial_cocircuit_formulation
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.partial_chirotope import PartialChirotope
from bcut.geometry.permutations import PermutationGroup
from bcut.geometry.placing import placing_triangulation
from bcut.objectives.objective import make_objective
from bcut.result import Certificate
from bcut.separation.driver import FamilyStatistics
from bcut.solving.capping import capped_stage
from bcut.solving.certificates import case_data, make_orbit_certificate
from bcut.solving.invariant_search import PASSES, find_invariant_triangulation
from bcut.solving.orbit_branching import branch_over_faces
from bcut.solving.orbit_stage import OrbitStage
from bcut.solving.report import settles
from bcut.solving.search import Part, Search, branch
from bcut.solving.strategies import is_optimal, is_resolved

if TYPE_CHECKING:
    from bcut.scip.host import TreeStatus

# SCIP looks at a program with at most so many columns for some seconds before subgroups are tried.
_SMALL = 15_000
_SECONDS_FOR_SMALL = 3.0
# Averaged link cuts look at every orbit of (d-2)-faces; with more faces than this they take longer than they are worth.
_MOST_FACES = 300_000
# Where the bound is not reached: columns among which better triangulations are sought, and for how long.
_MOST_TO_IMPROVE = 60_000
_SECONDS_TO_IMPROVE = 60.0
# Of the time that is left, for invariant triangulations that reach the bound.
_SHARE_FOR_TARGET = 0.4
# So many targets of invariant triangulations go up by one unit each, before steps grow.
_STEADY = 10
# Branching over faces lists the signs of all sets of d + 1 points; its share of the time that is left, and its time
# where there is no limit; how long it may look for an exact proof of what SCIP has refuted already.
_MOST_SIGNS = 1_000_000
_SHARE_FOR_FACES, _SECONDS_FOR_FACES, _SECONDS_FOR_PROOF = 0.4, 600.0, 60.0


def known_triangulation(stage: OrbitStage) -> Part:
    """Return a triangulation that takes no search, as a program whose only columns are its simplices."""
    simplices = stage.pulled()
    if simplices is None:
        chirotope = PartialChirotope(stage.configuration, stage.formulation.orbits.hull_facets)
        simplices = placing_triangulation(stage.configuration, chirotope)
    formulation = partial_cocircuit_formulation(
        stage.configuration,
        simplices,
        stage.formulation.orbits.hull_facets,
        spanning=stage.formulation.spanning,
    )
    return Part.whole(
        formulation, make_objective(stage.objective.name, formulation, sense=stage.objective.sense)
    )


def bound_by_orbits(search: Search, stage: OrbitStage, *, cuts: bool) -> OrbitStage:
    """Record the bound of the averaged relaxation, and improve it by averaged link cuts.

    Parameters
    ----------
    search : Search
    stage : OrbitStage
    cuts : bool
        Whether link cuts are wanted.

    Returns
    -------
    OrbitStage
        With the better bound.
    """
    if stage.root.bound is None:
        return stage
    _keep_bound(search, stage)
    n, d = stage.configuration.n, stage.configuration.dimension
    if cuts and not is_optimal(search) and comb(n, d - 1) <= _MOST_FACES:
        with search.timed("root"):
            left = search.seconds_left
            stage = stage.with_link_cuts(seconds=None if left is None else lambda: search.seconds_left or 0.0)
        _record(search, stage)
        _keep_bound(search, stage)
    return stage


def _keep_bound(search: Search, stage: OrbitStage) -> None:
    assert stage.root.bound is not None
    if search.lp is None:
        search.lp = stage.root.lp
    search.lp_after_cuts = stage.root.lp
    search.raise_bound(stage.root.bound.value)
    search.certificate = make_orbit_certificate(stage)
    search.report("orbits", lp=stage.root.lp)


def _record(search: Search, stage: OrbitStage) -> None:
    """Write down the rounds of averaged cuts."""
    search.rounds.extend(("orbits", finished) for finished in stage.rounds)
    family = search.statistics.setdefault("link", FamilyStatistics())
    family.calls += len(stage.rounds)
    family.seconds += stage.separating
    for finished in stage.rounds:
        added = finished.cuts.get("link", 0)
        family.found += added
        family.added += added


def solve_by_orbits(search: Search, stage: OrbitStage, *, cuts: bool) -> None:
    """Solve a symmetric configuration.

    Parameters
    ----------
    search : Search
        Its whole is the known triangulation; it ends as the program that the best triangulation was found in.
    stage : OrbitStage
    cuts : bool
        Whether link cuts are wanted.
    """
    best = _Best(search.whole, search.columns)
    search.offer(search.whole.columns)
    best.keep(search)
    try:
        stage = capped_stage(search, stage)
    except (KeyboardInterrupt, MemoryError):
        _keep_bound(search, stage)
        raise
    finally:
        best.keep(search)
    stage = bound_by_orbits(search, stage, cuts=cuts)
    if search.bound is None:
        return
    objective = stage.objective
    search.raise_bound(search.rounded_up(search.bound))
    proven, coarsest = search.bound, objective.restricted_to(np.array([], dtype=np.intp))
    refuted = 0
    while not is_optimal(search):
        # With large costs there may be many values below the optimum: the target moves in growing steps.
        target = search.bound + ((1 << max(0, refuted - 1)) - 1) * objective.unit
        if best.value is not None:
            target = min(target, search.sign * best.value - objective.unit)
        try:
            formulation, costs = stage.residual(target)
        except TooLargeError:
            break
        search.whole, search.columns = Part.whole(formulation, costs), None
        search.columns_after_fixing = len(formulation.simplices)
        coarsest = max(coarsest, costs, key=lambda some: some.largest_cost)
        try:
            outcome = _reach(search, stage, target, best, cuts)
        finally:
            # Also after Ctrl-C: what is handed out is a triangulation in any case.
            best.keep(search)
        if outcome == "refuted":
            refuted += 1
            search.raise_bound(target + objective.unit)
        _within_tolerance(search)
        if outcome == "limit" or outcome == "interrupted":
            search.status = outcome
            return
    search.status = "optimal" if is_optimal(search) else "limit"
    certificate = search.certificate or Certificate()
    # Solvers know nothing of such values, and only what is proven without them counts.
    if is_optimal(search) and not is_resolved(coarsest, search.value) and not settles(search, certificate):
        search.status, search.bound = "limit", proven


def _within_tolerance(search: Search) -> None:
    """Take back what SCIP refuted within its tolerances although it was found; the report tells of anything beyond."""
    if search.value is None or search.bound is None:
        return
    value = search.sign * search.value
    if value < search.bound <= value + max(Fraction(search.whole.objective.largest_cost), abs(value)) / 10**6:
        search.bound = value


class _Best:
    """The best triangulation so far, with the program that it is a solution of: each step has a program of its own."""

    def __init__(self, part: Part, columns: NDArray[np.intp] | None) -> None:
        self.part, self.columns = part, columns

    @property
    def value(self) -> Fraction | None:
        return None if self.columns is None else self.part.objective.value(self.columns)

    def keep(self, search: Search) -> None:
        """Take over what the search has found, or give it what is better."""
        if self.value is None or (
            search.value is not None and search.sign * search.value < search.sign * self.value
        ):
            self.part, self.columns = search.whole, search.columns
        else:
            search.whole, search.columns = self.part, self.columns


def solve_invariant(
    search: Search, stage: OrbitStage, subgroups: Sequence[PermutationGroup], *, cuts: bool
) -> None:
    """Find a best one among the triangulations that are invariant under one of some subgroups.

    Parameters
    ----------
    search : Search
        Ends with the best triangulation, its bound being one on such triangulations.
    stage : OrbitStage
    subgroups : sequence of PermutationGroup
        Of the stage's group.
    cuts : bool
        Whether link cuts are wanted.
    """
    stage = bound_by_orbits(search, stage, cuts=cuts)
    if search.bound is None:
        return
    objective = stage.objective
    proven = bound = objective.rounded_up(search.bound)
    refuted = 0
    while True:
        search.raise_bound(bound)
        # With costs that are no small multiples of a unit, steps of one unit would never come to an end.
        target = bound + ((1 << max(0, refuted - _STEADY)) - 1) * objective.unit
        try:
            formulation, costs = stage.residual(target)
        except TooLargeError:
            return
        search.whole, search.columns = Part.whole(formulation, costs), None
        search.columns_after_fixing = len(formulation.simplices)
        everything = len(formulation.simplices) == stage.formulation.sizes.sum()
        with search.timed("invariant"):
            found = find_invariant_triangulation(
                formulation,
                costs,
                stage.group,
                # On all columns there is nothing that a higher target could add.
                cutoff=None if everything else target + objective.unit / 2,
                goal=bound,
                deadline=search.deadline,
                seed=search.seed,
                subgroups=subgroups,
                passes=(*PASSES, inf),
            )
        if found.columns is not None:
            search.offer(found.columns)
        if found.status == "limit" or found.status == "interrupted":
            search.status = found.status
            return
        if everything or found.columns is not None:
            search.status = "infeasible" if search.value is None else "optimal"
            if search.value is not None and not is_resolved(costs, search.value):
                search.status, search.bound = "limit", proven
            elif search.value is not None:
                search.raise_bound(search.sign * search.value)
                _within_tolerance(search)
            return
        refuted += 1
        bound = target + objective.unit


def _reach(
    search: Search, stage: OrbitStage, target: Fraction, best: _Best, cuts: bool
) -> Literal["reached", "refuted", "limit", "interrupted"]:
    """Look for a triangulation of the target value, times sign, on the columns that may be in one."""
    part = search.whole
    cutoff = target + stage.objective.unit / 2
    decided: TreeStatus | None = None
    if len(part.columns) <= _SMALL:
        decided = _branch(search, part, cutoff, seconds=_SECONDS_FOR_SMALL)
        if decided != "interrupted" and not is_optimal(search):
            known = decided == "infeasible"
            if _branch_over_faces(search, stage, target, cuts=cuts, known=known):
                return "refuted"
    if decided in (None, "limit") and not is_optimal(search):
        left = search.seconds_left
        seconds = inf if left is None else _SHARE_FOR_TARGET * left
        _search_invariant(search, stage, cutoff=cutoff, goal=target, seconds=seconds)
    if is_optimal(search):
        return "reached"
    if decided not in ("infeasible", "interrupted"):
        _improve(search, stage, target, best)
        if is_optimal(search):
            return "reached"
        # The best triangulation is one of another program.
        search.whole, search.columns = part, None
        decided = _branch(search, part, cutoff)
    if is_optimal(search):
        return "reached"
    if decided == "infeasible":
        return "refuted"
    return "interrupted" if decided == "interrupted" else "limit"


def _branch_over_faces(
    search: Search, stage: OrbitStage, target: Fraction, *, cuts: bool, known: bool
) -> bool:
    """Look for a triangulation within the target by cases that keep symmetry; tell whether there is provably none.

    Then the certificate has the proof. `known` says that there is none, so that a proof is all that is missing.
    """
    configuration, part = stage.configuration, search.whole
    if comb(configuration.n, configuration.dimension + 1) > _MOST_SIGNS:
        return False
    left = search.seconds_left
    seconds = _SECONDS_FOR_FACES if left is None else _SHARE_FOR_FACES * left
    deadline = time.monotonic() + (min(seconds, _SECONDS_FOR_PROOF) if known else seconds)
    before = search.nodes

    def on_part(number: int) -> None:
        search.nodes = before + number
        search.report("faces", columns=len(part.columns), nodes=search.nodes)

    with search.timed("faces"):
        everything = AveragedPart(
            replace(part.formulation, chirotope=Chirotope.of(configuration)),
            part.objective,
            stage.flag,
            stage.group,
            np.arange(len(part.columns)),
        )
        found = branch_over_faces(
            everything,
            target,
            separating=cuts,
            seconds=lambda: deadline - time.monotonic(),
            on_part=on_part,
        )
    if found.columns is not None:
        search.offer(found.columns)
    if found.case is None or search.certificate is None:
        return False
    refutes = {"target": str(search.sign * target), "case": case_data(found.case)}
    search.certificate = replace(search.certificate, refutes=refutes)
    return True


def _branch(search: Search, part: Part, cutoff: Fraction, *, seconds: float | None = None) -> TreeStatus:
    """Let SCIP search a part with all triangulations below the cutoff; the best of them is the best of all."""
    status = branch(search, part, None, cutoff=float(search.sign * cutoff), seconds=seconds)
    if status == "optimal" and search.value is not None:
        search.raise_bound(search.sign * search.value)
    return status


def _improve(search: Search, stage: OrbitStage, target: Fraction, best: _Best) -> None:
    """Look for better triangulations than the best one, with more columns than the target leaves.

    The full search for the target may take forever; what a limit then hands out should be good.
    """
    best.keep(search)
    assert best.value is not None
    widest = stage.target_for(_MOST_TO_IMPROVE)
    reachable = min(search.sign * best.value - stage.objective.unit, widest)
    if reachable > target:
        formulation, costs = stage.residual(reachable)
        search.whole, search.columns = Part.whole(formulation, costs), None
        cutoff = search.sign * best.value
        _search_invariant(search, stage, cutoff=cutoff, goal=target, seconds=_SECONDS_TO_IMPROVE)
        best.keep(search)


def _search_invariant(
    search: Search, stage: OrbitStage, *, cutoff: Fraction, goal: Fraction, seconds: float
) -> None:
    """Offer the best triangulation of the search's program that some subgroup leaves invariant."""
    part = search.whole
    deadline = min(inf if search.deadline is None else search.deadline, time.monotonic() + seconds)
    with search.timed("invariant"):
        found = find_invariant_triangulation(
            part.formulation,
            part.objective,
            stage.group,
            cutoff=cutoff,
            goal=goal,
            deadline=None if deadline == inf else deadline,
            seed=search.seed,
        )
    if found.columns is not None:
        search.offer(found.columns)

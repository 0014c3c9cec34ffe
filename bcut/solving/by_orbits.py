"""The way to an optimum for symmetric configurations: bound over orbits, fix orbits, search what is left.

No step lists all simplices, so configurations such as the 6-cube, with 366 million of them, can be solved.
"""

from __future__ import annotations

from fractions import Fraction
from math import comb
from typing import Literal

import numpy as np

from bcut.errors import TooLargeError
from bcut.formulations.partial_cocircuits import partial_cocircuit_formulation
from bcut.geometry.partial_chirotope import PartialChirotope
from bcut.geometry.placing import placing_triangulation
from bcut.objectives.objective import make_objective
from bcut.solving.certificates import make_orbit_certificate
from bcut.solving.invariant_search import find_invariant_triangulation
from bcut.solving.orbit_stage import OrbitStage
from bcut.solving.search import Part, Search, branch
from bcut.solving.strategies import is_optimal

# SCIP looks at a program with at most so many columns for some seconds before subgroups are tried.
_SMALL = 15_000
_SECONDS_FOR_SMALL = 20.0
# Averaged link cuts look at every orbit of (d-2)-faces; with more faces than this they take longer than they are worth.
_MOST_FACES = 300_000


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
    root = stage.root
    if root.bound is None:
        return stage
    search.lp = search.lp_after_cuts = root.lp
    search.raise_bound(root.bound.value)
    search.certificate = make_orbit_certificate(stage)
    search.report("orbits", lp=root.lp)
    n, d = stage.configuration.n, stage.configuration.dimension
    if cuts and not is_optimal(search) and comb(n, d - 1) <= _MOST_FACES:
        with search.timed("root"):
            left = search.seconds_left
            stage = stage.with_link_cuts(seconds=None if left is None else lambda: search.seconds_left or 0.0)
        assert stage.root.bound is not None
        search.lp_after_cuts = stage.root.lp
        search.raise_bound(stage.root.bound.value)
        search.certificate = make_orbit_certificate(stage)
        search.report("orbits", lp=stage.root.lp)
    return stage


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
    known = search.whole
    search.offer(known.columns)
    stage = bound_by_orbits(search, stage, cuts=cuts)
    if search.bound is None:
        return
    objective = stage.objective
    search.raise_bound(objective.rounded_up(search.bound))
    best = search.value
    while not is_optimal(search):
        target = search.bound
        try:
            formulation, costs = stage.residual(target)
        except TooLargeError:
            break
        search.whole, search.columns = Part.whole(formulation, costs), None
        search.columns_after_fixing = len(formulation.simplices)
        try:
            outcome = _reach(search, stage, target)
        finally:
            # Also after Ctrl-C: what is handed out is a triangulation in any case.
            if search.value is None or (best is not None and search.sign * search.value > search.sign * best):
                search.whole, search.columns = known, known.columns
        if outcome == "refuted":
            search.raise_bound(target + objective.unit)
        elif outcome != "reached":
            search.status = outcome
            return
    search.status = "optimal" if is_optimal(search) else "limit"


def _reach(
    search: Search, stage: OrbitStage, target: Fraction
) -> Literal["reached", "refuted", "limit", "interrupted"]:
    """Look for a triangulation of the target value, times sign, on the columns that may be in one."""
    part = search.whole
    cutoff = target + stage.objective.unit / 2
    decided = ""
    if len(part.columns) <= _SMALL:
        decided = branch(search, part, None, cutoff=float(search.sign * cutoff), seconds=_SECONDS_FOR_SMALL)
    if decided in ("", "limit") and not is_optimal(search):
        with search.timed("invariant"):
            found = find_invariant_triangulation(
                part.formulation,
                part.objective,
                stage.group,
                cutoff=cutoff,
                goal=target,
                deadline=search.deadline,
                seed=search.seed,
            )
        if found is not None:
            search.offer(np.asarray(found.columns))
    if is_optimal(search):
        return "reached"
    if decided not in ("infeasible", "interrupted"):
        decided = branch(search, part, None, cutoff=float(search.sign * cutoff))
    if is_optimal(search):
        return "reached"
    if decided == "infeasible":
        return "refuted"
    return "interrupted" if decided == "interrupted" else "limit"

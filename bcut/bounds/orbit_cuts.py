"""Link cuts averaged over the symmetry group: the relaxation with all images of all cuts, as small as the averaged one.

A link cut ``a x <= 0`` (`bcut.separators.link`) is about the simplices around one (d-2)-face e, and its
images under the group are link cuts, too. Their sum says of a point that is constant on orbits

    sum over the simplices t around e of  a_t * |stabiliser of t| * X_o(t)  <=  0,

because each image of t is met |stabiliser of t| times. So it is enough to look at one face of each orbit, at
a point that is constant on orbits: if that point violates no link cut there, then none anywhere.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from math import gcd
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.orbit_root import OrbitRoot, orbit_root
from bcut.bounds.root import Round
from bcut.formulations.orbit_cocircuits import OrbitFormulation
from bcut.geometry.orbits import subset_orbits
from bcut.geometry.partial_chirotope import PartialChirotope
from bcut.geometry.stars import Star, Stars
from bcut.geometry.subsets import all_subsets, ranks
from bcut.objectives.objective import Objective

# Cuts are left out of the program again when they have been slack by more than this for some rounds.
_SLACK = 1e-7
_ROUNDS_SLACK = 5
# Lifting takes some milliseconds for each wedge: too long for stars with more than this.
_LIFTED = 2_000


@dataclass(frozen=True, eq=False)
class OrbitStar:
    """The star of one (d-2)-face, and the variable that each of its wedges belongs to.

    Attributes
    ----------
    star : Star
        Its columns number the wedges' simplices in `simplices`.
    simplices : ndarray of int64, shape (k, d + 1)
    orbits : ndarray of int64, shape (wedges,)
    """

    star: Star
    simplices: NDArray[np.int64]
    orbits: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class OrbitCut:
    """An averaged link cut.

    Attributes
    ----------
    face : tuple of int
        The (d-2)-face.
    simplices : ndarray of int64, shape (k, d + 1)
        The cut before averaging: ``coefficients @ x[simplices] <= 0``.
    coefficients : ndarray of int64, shape (k,)
    row : ndarray of int64, shape (m,)
        The averaged cut: ``row @ X <= 0``.
    factor : Fraction
        The row, times this, is the mean of the images of the cut under the group.
    proof : mapping
        Why the cut is valid, as `bcut.separators.link` gives it.
    """

    face: tuple[int, ...]
    simplices: NDArray[np.int64]
    coefficients: NDArray[np.int64]
    row: NDArray[np.int64]
    factor: Fraction
    proof: Any


class OrbitLinks:
    """Separates averaged link cuts.

    Parameters
    ----------
    formulation : OrbitFormulation
    """

    def __init__(self, formulation: OrbitFormulation) -> None:
        from bcut.separation.small_lp import SmallLps
        from bcut.separators.link import Link

        self.formulation = formulation
        self.link, self.unlifted = Link(), Link(lift=False)
        self.programs = SmallLps()
        order = formulation.orbits.group.order
        self.stabilisers = order // formulation.sizes
        self.stars = orbit_stars(formulation)

    def separate(
        self, point: NDArray[np.floating], seconds: Callable[[], float] | None = None
    ) -> list[OrbitCut]:
        """Return the most violated cut of each star, at the sums X of a point over the orbits.

        When the time is over, the stars that are left are not looked at.
        """
        from bcut.separators.link import most_violated_weights

        shares = np.maximum(point, 0) / self.formulation.sizes
        cuts = []
        for item in self.stars:
            if seconds is not None and seconds() <= 0:
                break
            values = shares[item.orbits]
            shortfall, weights = most_violated_weights(item.star, values, self.programs)
            link = self.link if len(item.orbits) <= _LIFTED else self.unlifted
            cut = link.cut_of(item.star, values, weights) if shortfall > 1e-6 else None
            if cut is not None and cut.coefficients is not None:
                columns = np.asarray(cut.simplices)
                coefficients = np.asarray(cut.coefficients, dtype=np.int64)
                row, factor = self._averaged(item, columns, coefficients)
                if row @ point > 0:
                    face = tuple(item.star.face.tolist())
                    simplices = item.simplices[columns]
                    cuts.append(OrbitCut(face, simplices, coefficients, row, factor, cut.proof))
        return cuts

    def _averaged(
        self, item: OrbitStar, columns: NDArray[np.int64], coefficients: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], Fraction]:
        """Return the coprime row, and what it takes to make it the mean of the images."""
        orbit_of = np.empty(len(item.simplices), dtype=np.int64)
        orbit_of[item.star.columns] = item.orbits
        # An orbit has no more simplices in the star than in all: no sum exceeds the group's order times the largest
        # coefficient, and a link cut's stay far below 2**32.
        row = np.zeros(len(self.formulation.simplices), dtype=np.int64)
        np.add.at(row, orbit_of[columns], coefficients * self.stabilisers[orbit_of[columns]])
        divisor = max(1, gcd(*row.tolist()))
        return row // divisor, Fraction(divisor, self.formulation.orbits.group.order)


def orbit_stars(formulation: OrbitFormulation) -> list[OrbitStar]:
    """Return the star of one (d-2)-face of each orbit of interior ones."""
    orbits, configuration = formulation.orbits, formulation.configuration
    n, d = configuration.n, configuration.dimension
    chirotope = PartialChirotope(configuration, orbits.hull_facets)
    known = ranks(formulation.simplices, n)
    order = np.argsort(known)
    stars = []
    for face in subset_orbits(configuration, orbits.forms, d - 1):
        others = np.setdiff1d(np.arange(n), face)
        pairs = others[all_subsets(len(others), 2)]
        simplices = np.sort(np.column_stack((np.tile(face, (len(pairs), 1)), pairs)), axis=1)
        simplices = simplices[chirotope.orientations(simplices) != 0]
        images = ranks(orbits.forms.of(simplices).images, n)
        place = np.minimum(np.searchsorted(known, images, sorter=order), len(known) - 1)
        allowed = known[order[place]] == images
        simplices, numbers = simplices[allowed], order[place][allowed]
        around = Stars(chirotope, simplices, around=face)
        if len(around.faces):
            star = around.star(0)
            stars.append(OrbitStar(star, simplices, numbers[star.columns]))
    return stars


@dataclass(frozen=True, eq=False)
class OrbitCutRoot:
    """What the cutting-plane loop over the averaged relaxation gave.

    Attributes
    ----------
    status : {"dry", "rounds", "infeasible", "limit"}
        Why it ended: no violated cut, the limit on rounds, no point at all, or the time limit.
    rounds : list of Round
        LP value of every round, in the sense of the objective, and the cuts that were then added.
    formulation : OrbitFormulation
        With the cuts of the last round.
    cuts : list of OrbitCut
        These, in the order of its rows.
    root : OrbitRoot
        The last relaxation; its bound is proven with these cuts.
    separating : float
        Seconds spent on finding cuts.
    """

    status: Literal["dry", "rounds", "infeasible", "limit"]
    rounds: list[Round]
    formulation: OrbitFormulation
    cuts: list[OrbitCut]
    root: OrbitRoot
    separating: float = 0.0


def orbit_root_with_cuts(
    formulation: OrbitFormulation,
    objective: Objective,
    *,
    rounds: int = 200,
    goal: Fraction | None = None,
    seconds: Callable[[], float] | None = None,
    method: Literal["simplex", "interior"] = "interior",
) -> OrbitCutRoot:
    """Add averaged link cuts to the averaged relaxation until none is violated.

    Parameters
    ----------
    formulation : OrbitFormulation
    objective : Objective
        Of the representatives; invariant under the group.
    rounds : int
        Relaxations with cuts, at most.
    goal : Fraction, optional
        Stop when the bound on ``sign * objective`` exceeds this.
    seconds : callable, optional
        Returns the seconds that are left.
    method : {"simplex", "interior"}
        How the last relaxation is solved: interior duals fix more orbits.
    """
    import scipy.sparse as sp

    links = OrbitLinks(formulation)
    slack_for: list[int] = []
    records: list[Round] = []
    separating = 0.0
    status: Literal["dry", "rounds", "infeasible", "limit"] = "rounds"
    current = formulation
    cuts: list[OrbitCut] = []
    best = OrbitCutRoot("limit", records, formulation, [], OrbitRoot("limit"))
    for number in range(rounds + 1):
        started = time.perf_counter()
        root = orbit_root(current, objective, seconds=None if seconds is None else seconds())
        if root.status != "optimal":
            # A limit leaves the last relaxation that was solved.
            last = root if root.status == "infeasible" else best.root
            return replace(best, status=root.status, root=last)
        assert root.point is not None
        assert root.lp is not None
        assert root.bound is not None
        best = OrbitCutRoot(status, records, current, cuts, root, separating)
        wanted = number < rounds and (goal is None or root.bound.value <= goal)
        before = time.perf_counter()
        found = links.separate(root.point, seconds) if wanted else []
        separating += time.perf_counter() - before
        records.append(Round(root.lp, {"link": len(found)} if found else {}, time.perf_counter() - started))
        if not wanted:
            break
        if not found:
            status = "dry"
            break
        kept = _kept(cuts, slack_for, root.point)
        cuts = [cuts[i] for i in kept] + found
        slack_for = [slack_for[i] for i in kept] + [0] * len(found)
        current = formulation.with_cuts(sp.csr_matrix(np.array([cut.row for cut in cuts])))
    if method == "interior":
        left = None if seconds is None else seconds()
        inner = orbit_root(best.formulation, objective, method="interior", seconds=left)
        best = replace(best, root=inner if inner.status == "optimal" else best.root)
    return replace(best, status=status, separating=separating)


def _kept(cuts: list[OrbitCut], slack_for: list[int], point: NDArray[Any]) -> list[int]:
    """Count for how long each cut has been slack, and return those that stay."""
    for number, cut in enumerate(cuts):
        scale = max(1.0, float(np.abs(cut.row).max()))
        slack_for[number] = slack_for[number] + 1 if -(cut.row @ point) / scale > _SLACK else 0
    return [number for number, rounds in enumerate(slack_for) if rounds < _ROUNDS_SLACK]

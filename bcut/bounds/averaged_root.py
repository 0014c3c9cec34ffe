"""Is a target out of reach of a part? The cutting-plane loop over its averaged program, with a record of the proof.

The loop is that of `bcut.bounds.orbit_cuts`, but for a target: orbits whose reduced costs exceed what the target
leaves are given up on the way, which makes the next relaxations smaller and stronger.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.averaged import AveragedCut, AveragedPart
from bcut.bounds.orbit_root import OrbitBound, OrbitRoot, orbit_root
from bcut.formulations.invariant import set_orbits
from bcut.geometry.stars import Stars
from bcut.objectives.objective import from_fractions

# On the way, orbits are given up when no more than this share of them remains.
_SHRINK = 0.8
# Cuts that have been slack by more than this for so many rounds are left out again.
_SLACK = 1e-7
_ROUNDS_SLACK = 5
# The loop ends when the bound has moved by less than this, relative to the largest cost, for some rounds.
_STALL = 2e-3
_ROUNDS_STALLED = 8
_INTEGRAL = 1e-6
# From so many orbits on, an interior point takes a tenth of the time of a vertex: 0.3 s instead of 2 s for 3,500.
_INTERIOR_FROM = 800

Seconds = Callable[[], float]


@dataclass(frozen=True, eq=False)
class AveragedStage:
    """One step of a proof, as `bcut.bounds.root.Stage` is one without symmetries.

    Attributes
    ----------
    row_faces : ndarray of int64, shape (rows, d)
    order : int
        Of the group: what the coverage row's right-hand side is.
    bound : OrbitBound
        Multipliers of the rows of these faces, then of the cuts.
    cuts : tuple of AveragedCut
    """

    row_faces: NDArray[np.int64]
    order: int
    bound: OrbitBound
    cuts: tuple[AveragedCut, ...]


@dataclass(frozen=True, eq=False)
class AveragedRoot:
    """What the loop found.

    Attributes
    ----------
    status : {"refuted", "integral", "open", "limit"}
        The target is out of reach; the relaxation has an integral point; neither; the time was over.
    stages : tuple of AveragedStage
        Each gives up the columns that its bound allows to; the last one proves a refuted target to be out of reach.
    part : AveragedPart
        What is left.
    cuts : tuple of AveragedCut
        Of the last relaxation.
    point : ndarray of float or None
        x on the columns of the part.
    bound : Fraction or None
        Of the last relaxation.
    """

    status: Literal["refuted", "integral", "open", "limit"]
    stages: tuple[AveragedStage, ...]
    part: AveragedPart
    cuts: tuple[AveragedCut, ...] = ()
    point: NDArray[np.float64] | None = None
    bound: Fraction | None = None


class AveragedLinks:
    """Separates link cuts on a part: one face of each orbit of faces is enough."""

    def __init__(self, part: AveragedPart) -> None:
        from bcut.separation.seam import Problem
        from bcut.separation.small_lp import SmallLps
        from bcut.separators.link import Link

        self.part = part
        self.link, self.programs = Link(), SmallLps()
        self.link.setup(Problem(part.whole.restricted_to(part.columns)))
        self.stars: Stars = self.link.stars
        orbits = set_orbits(self.stars.faces, part.group, part.whole.configuration.n)
        self.first = np.zeros(len(self.stars.faces), dtype=bool)
        self.first[np.unique(orbits, return_index=True)[1]] = True

    def separate(self, x: NDArray[np.float64], seconds: Seconds | None) -> list[AveragedCut]:
        """Return the most violated cut of each orbit of faces, averaged."""
        from bcut.separators.link import most_violated_weights

        found = []
        for number in self.link.faces_to_try(x):
            if not self.first[number] or (seconds is not None and seconds() <= 0):
                continue
            star = self.stars.star(number)
            shortfall, weights = most_violated_weights(star, x[star.columns], self.programs)
            cut = self.link.cut_of(star, x[star.columns], weights) if shortfall > _INTEGRAL else None
            if cut is not None and cut.coefficients is not None:
                places, coefficients = np.asarray(cut.simplices), np.asarray(cut.coefficients, dtype=np.int64)
                found.append(self.part.averaged(star.face, places, coefficients))
        return found


class _Loop:
    def __init__(
        self,
        part: AveragedPart,
        target: Fraction,
        cuts: Sequence[AveragedCut],
        seconds: Seconds | None,
        separating: bool,
    ) -> None:
        self.part, self.target, self.seconds, self.separating = part, target, seconds, separating
        self.cuts = part.about(cuts)
        self.slack_for = [0] * len(self.cuts)
        self.stages: list[AveragedStage] = []
        self.links: AveragedLinks | None = None

    def run(self, rounds: int) -> AveragedRoot:
        stalled, before = 0, None
        for number in range(rounds + 1):
            found = self.relaxed()
            if isinstance(found, AveragedRoot):
                return found
            root, bound = found
            assert root.point is not None
            assert root.lp is not None
            kept = self.give_up(bound, _SHRINK)
            if kept is not None and np.delete(root.point, kept).max() > _INTEGRAL:
                continue  # next to the target, what is given up may be in the point
            x = self.part.spread(root.point if kept is None else root.point[kept])
            if np.minimum(x, np.abs(1 - x)).max(initial=0.0) <= _INTEGRAL:
                return self.ended("integral", x, bound.value)
            size = self.part.objective.largest_cost
            stalled = stalled + 1 if before is not None and abs(root.lp - before) < _STALL * size else 0
            before = root.lp
            if not self.separating or number == rounds or stalled >= _ROUNDS_STALLED:
                break
            new = self.separated(x)
            if not new:
                break
            self.replace_cuts(root.point, new, fresh=kept is None)
        return self.finished()

    def relaxed(self, *, interior: bool = False) -> AveragedRoot | tuple[OrbitRoot, OrbitBound]:
        """Solve the relaxation; return the end of the loop where it is one."""
        left = None if self.seconds is None else self.seconds()
        if left is not None and left <= 0:
            return self.ended("limit")
        inside = interior or len(self.part.sizes) >= _INTERIOR_FROM
        root = self.part.relaxed(self.cuts, "interior" if inside else "simplex", seconds=left)
        bound = root.bound
        if root.status == "infeasible":
            bound = self.beyond()
            if bound is None:
                return self.ended("open")
        elif root.status == "limit" or bound is None:
            return self.ended("limit")
        if bound.value > self.target:
            self.record(bound)
            return self.ended("refuted", bound=bound.value)
        return (root, bound) if root.status == "optimal" else self.ended("open")

    def beyond(self) -> OrbitBound | None:
        """Prove that there is no point by what another way to cover everything, for more than the target, costs."""
        objective = self.part.orbit_objective
        costs = objective.exact_costs(np.arange(len(objective.numerators)))
        # Of the others' size: next to a far larger one, tolerances swallow them.
        size = max(map(abs, costs), default=Fraction(0)) or Fraction(1)
        costs.append(objective.sign * (self.target + max(size, abs(self.target))))
        wider = from_fractions(objective.name, objective.sense, costs)
        root = orbit_root(self.part.program(self.cuts).with_way_out(), wider)
        if root.bound is None:
            return None
        return replace(root.bound, reduced_costs=root.bound.reduced_costs[:-1])

    def record(self, bound: OrbitBound) -> None:
        faces = self.part.bare.row_faces
        self.stages.append(AveragedStage(faces, self.part.group.order, bound, tuple(self.cuts)))

    def give_up(self, bound: OrbitBound, share: float) -> NDArray[np.intp] | None:
        """Leave out what the target does not allow, if that is enough; return the orbits that are kept."""
        within = bound.orbits_within(self.target)
        if len(within) > share * len(self.part.sizes) or len(within) == len(self.part.sizes):
            return None
        self.record(bound)
        kept = np.zeros(len(self.part.sizes), dtype=bool)
        kept[within] = True
        self.part = self.part.restricted_to(kept[self.part.orbit_of])
        staying = {id(cut) for cut in self.part.about(self.cuts)}
        numbers = [number for number, cut in enumerate(self.cuts) if id(cut) in staying]
        self.cuts = [self.cuts[number] for number in numbers]
        self.slack_for = [self.slack_for[number] for number in numbers]
        self.links = None
        return within

    def separated(self, x: NDArray[np.float64]) -> list[AveragedCut]:
        if self.links is None:
            self.links = AveragedLinks(self.part)
        return self.links.separate(x, self.seconds)

    def replace_cuts(self, point: NDArray[np.float64], new: Sequence[AveragedCut], *, fresh: bool) -> None:
        """Add cuts, and leave those out that have been slack for long; `fresh` where the point is one of the part."""
        if fresh and self.cuts:
            program = self.part.program(self.cuts)
            assert program.cuts is not None
            scale = abs(program.cuts).max(axis=1).toarray().reshape(-1)
            slack = -(program.cuts @ point) / scale > _SLACK
            self.slack_for = [
                rounds + 1 if is_slack else 0 for rounds, is_slack in zip(self.slack_for, slack, strict=True)
            ]
        kept = [number for number, rounds in enumerate(self.slack_for) if rounds < _ROUNDS_SLACK]
        self.cuts = [self.cuts[number] for number in kept] + list(new)
        self.slack_for = [self.slack_for[number] for number in kept] + [0] * len(new)

    def finished(self) -> AveragedRoot:
        """Give up what duals in the middle of the optimal ones allow to, and solve what is left once more."""
        found = self.relaxed(interior=True)
        if isinstance(found, AveragedRoot):
            return found
        self.give_up(found[1], 1.0)
        found = self.relaxed()
        if isinstance(found, AveragedRoot):
            return found
        root, bound = found
        assert root.point is not None
        x = self.part.spread(root.point)
        integral = np.minimum(x, np.abs(1 - x)).max(initial=0.0) <= _INTEGRAL
        return self.ended("integral" if integral else "open", x, bound.value)

    def ended(
        self,
        status: Literal["refuted", "integral", "open", "limit"],
        x: NDArray[np.float64] | None = None,
        bound: Fraction | None = None,
    ) -> AveragedRoot:
        return AveragedRoot(status, tuple(self.stages), self.part, tuple(self.cuts), x, bound)


def averaged_root(
    part: AveragedPart,
    target: Fraction,
    *,
    cuts: Sequence[AveragedCut] = (),
    rounds: int = 60,
    separating: bool = True,
    seconds: Seconds | None = None,
) -> AveragedRoot:
    """Find out whether a part has triangulations within a target, as far as relaxations and link cuts can tell.

    Parameters
    ----------
    part : AveragedPart
    target : Fraction
        Of ``sign * objective``.
    cuts : sequence of AveragedCut
        Known from parts that contain this one.
    rounds : int
        Relaxations with new cuts, at most.
    separating : bool
        Whether cuts are looked for.
    seconds : callable, optional
        Returns the seconds that are left.
    """
    return _Loop(part, target, cuts, seconds, separating).run(rounds)

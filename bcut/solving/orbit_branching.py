"""Branching over orbits of faces: a case split that keeps what symmetry there is.

A target is to be reached by a triangulation that uses only some simplices, closed under a group H. Take a face f: a
vertex, an edge, ... Either the triangulation has none of the images of f under H: then the simplices that have one are
given up, and all of H is left. Or it has one, and by symmetry it has f itself: then the simplices that cross f are
given up, and the elements of H that take f to itself are left. In both parts the simplices are closed under what is
left of the group, so the averaged relaxation (`bcut.bounds.averaged_root`) goes on to be small. While the group is
large, one such decision settles a lot.

Two simplices that cross do so in a circuit, one side of which has no more than (d + 2) / 2 points and is a face of one
of them and crosses the other. So as long as two simplices that cross are left, there is a face of that size to branch
on, and each part has fewer simplices.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.averaged import AveragedCut, AveragedPart
from bcut.bounds.averaged_root import AveragedRoot, AveragedStage, averaged_root
from bcut.formulations.invariant import set_orbits
from bcut.geometry.crossings import crossing_matrix
from bcut.geometry.subsets import all_subsets
from bcut.verification.certificate_data import MAX_DEPTH

# Faces whose two parts are bounded before one is chosen: fewer where that takes longer, by the number of orbits.
_TRIED = ((400, 40), (1200, 12), (10**9, 6))
# Faces with more simplices around them, or crossing them, than this count as used, or as crossed, for sure.
_USUAL = 4.0
# What a bound beyond the target is worth, where 1 is a bound that reaches it.
_REFUTED = 1.3
# What the simplices that a part gives up count, and what is added so that one good side is worth something.
_FEWER, _LEAST = 0.3, 0.02
# Values that count as zero.
_NOISE = 1e-7


@dataclass(frozen=True, eq=False)
class Split:
    """A face that the triangulations of one part have and those of the other part, with all its images, have not."""

    face: tuple[int, ...]
    chosen: Case
    excluded: Case


@dataclass(frozen=True, eq=False)
class Case:
    """A part of the proof: stages that give up columns; either the last one is a proof, or there is a split."""

    stages: tuple[AveragedStage, ...]
    split: Split | None = None


@dataclass(frozen=True, eq=False)
class Branching:
    """What the search found.

    Attributes
    ----------
    status : {"refuted", "found", "limit"}
    case : Case or None
        The proof of a refuted target.
    columns : ndarray of int64 or None
        A triangulation within the target, as columns of the whole.
    parts : int
        How many were looked at.
    """

    status: Literal["refuted", "found", "limit"]
    case: Case | None = None
    columns: NDArray[np.int64] | None = None
    parts: int = 0


class _FoundError(Exception):
    def __init__(self, columns: NDArray[np.int64]) -> None:
        super().__init__()
        self.columns = columns


class _OutOfTimeError(Exception):
    pass


def branch_over_faces(
    part: AveragedPart,
    target: Fraction,
    *,
    separating: bool = True,
    rounds: int = 60,
    seconds: Callable[[], float] | None = None,
    on_part: Callable[[int], None] | None = None,
) -> Branching:
    """Find a triangulation within a target, or prove that there is none.

    Parameters
    ----------
    part : AveragedPart
        With all simplices that such a triangulation may use.
    target : Fraction
        Of ``sign * objective``.
    separating : bool
        Whether link cuts are looked for.
    rounds : int
        Of cuts for each part, at most.
    seconds : callable, optional
        Returns the seconds that are left.
    on_part : callable, optional
        Told of every part how many there were.
    """
    search = _Search(target, separating, rounds, seconds, on_part)
    try:
        case = search.settle(part, [], 0)
    except _FoundError as found:
        return Branching("found", columns=found.columns, parts=search.parts)
    except _OutOfTimeError:
        return Branching("limit", parts=search.parts)
    return Branching("refuted", case, parts=search.parts)


@dataclass
class _Search:
    target: Fraction
    separating: bool
    rounds: int
    seconds: Callable[[], float] | None
    on_part: Callable[[int], None] | None
    parts: int = field(default=0, init=False)

    def settle(self, part: AveragedPart, cuts: list[AveragedCut], depth: int) -> Case:
        """Prove that the target is out of reach of a part."""
        if depth > MAX_DEPTH:
            raise _OutOfTimeError  # nobody would read the proof
        self.parts += 1
        root = averaged_root(
            part,
            self.target,
            cuts=cuts,
            rounds=self.rounds,
            separating=self.separating,
            seconds=self.seconds,
        )
        if self.on_part is not None:
            self.on_part(self.parts)
        if root.status == "limit":
            raise _OutOfTimeError
        if root.status == "refuted":
            return Case(root.stages)
        if root.status == "integral":
            assert root.point is not None
            raise _FoundError(root.part.columns[root.point > 0.5])
        face = self.best_face(root)
        chosen, excluded = with_face(root.part, face), without_face(root.part, face)
        inherited = list(root.cuts)
        # A triangulation is found sooner where faces are chosen.
        first, second = (self.settle(smaller, inherited, depth + 1) for smaller in (chosen, excluded))
        return Case(root.stages, Split(face, first, second))

    def best_face(self, root: AveragedRoot) -> tuple[int, ...]:
        """Return the face whose two parts have the best bounds."""
        part, orbits = root.part, len(root.part.sizes)
        tried = next(count for most, count in _TRIED if orbits <= most)
        best, best_score = None, -1.0
        for face in undecided_faces(part, root.point)[:tried]:
            if best is not None and self.seconds is not None and self.seconds() <= 0:
                raise _OutOfTimeError
            score = 1.0
            for smaller in (with_face(part, face), without_face(part, face)):
                score *= _LEAST + self.progress(root, smaller)
            if score > best_score:
                best, best_score = face, score
        if best is None:
            raise _OutOfTimeError  # no two simplices cross, and yet the relaxation's point was not integral
        return best

    def progress(self, root: AveragedRoot, smaller: AveragedPart) -> float:
        """Say how far a part is from being settled, compared with the one that it came from."""
        if not len(smaller.columns):
            return _REFUTED
        bound = smaller.relaxed(smaller.about(root.cuts), "interior").bound
        if bound is None or bound.value > self.target:
            return _REFUTED
        if root.bound is None or root.bound >= self.target:
            moved = 0.0
        else:
            moved = float((bound.value - root.bound) / (self.target - root.bound))
        fewer = 1 - len(smaller.columns) / len(root.part.columns)
        return min(1.0, max(0.0, moved)) + _FEWER * fewer


def with_face(part: AveragedPart, face: tuple[int, ...]) -> AveragedPart:
    """Return the part of the triangulations that have a face, with the symmetries that take it to itself."""
    crossing = crossing_matrix(part.whole.chirotope, np.array([face]), part.simplices)[0]
    points = np.array(face)

    def keeps(elements: NDArray[np.integer]) -> NDArray[np.bool_]:
        return np.asarray((np.sort(elements[:, points], axis=1) == points).all(axis=1))

    fewer = part.restricted_to(~crossing)
    return AveragedPart(
        part.whole,
        part.objective,
        part.flag,
        part.group.subgroup(keeps),
        fewer.columns,
        part.level + 1,
    )


def without_face(part: AveragedPart, face: tuple[int, ...]) -> AveragedPart:
    """Return the part of the triangulations that have none of the images of a face."""
    images = part.group.orbit(face)
    member = np.zeros((len(part.columns), part.whole.configuration.n), dtype=bool)
    np.put_along_axis(member, part.simplices, True, axis=1)
    having = np.zeros(len(part.columns), dtype=bool)
    for image in images:
        having |= member[:, image].all(axis=1)
    return part.restricted_to(~having)


def undecided_faces(part: AveragedPart, x: NDArray[np.float64] | None) -> list[tuple[int, ...]]:
    """List one face of each orbit that some simplices have and others cross, the most undecided ones first."""
    n, d = part.whole.configuration.n, part.whole.chirotope.dimension
    if x is None:
        x = np.ones(len(part.columns))
    member = np.zeros((len(part.columns), n), dtype=np.int64)
    np.put_along_axis(member, part.simplices, 1, axis=1)
    found: list[tuple[float, tuple[int, ...]]] = []
    for size in range(1, (d + 2) // 2 + 1):
        faces = all_subsets(n, size)
        faces = faces[np.unique(set_orbits(faces, part.group, n), return_index=True)[1]]
        having = np.array([x[member[:, face].all(axis=1)].sum() for face in faces])
        faces, having = faces[having > _NOISE], having[having > _NOISE]
        crossed = crossing_matrix(part.whole.chirotope, faces, part.simplices) @ x
        both = np.minimum(np.minimum(having, crossed) / _USUAL, 1.0)
        found += [
            (float(value), tuple(face))
            for value, face in zip(both.tolist(), faces.tolist(), strict=True)
            if value > _NOISE
        ]
    return [face for _, face in sorted(found, key=lambda item: -item[0])]

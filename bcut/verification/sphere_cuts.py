"""Checker of sphere cuts: the simplices of a triangulation around a (d-3)-face close up, one of them in each direction.

Let F be a (d-3)-simplex and w >= 0 weights of the candidates that contain it: those that the proof lists, and alpha for
all others. A triangulation that uses F has exactly one simplex in a generic direction at F. Next to each of its
simplices that contain F, across each (d-1)-face that contains F and has points strictly on both sides, it has exactly
one other. No two of them cross. The checker branches over these choices, from a direction of its own, and shows that
whatever closes up weighs at least alpha. As weights are not negative, a branch ends where alpha is reached; so only
simplices of the list ever matter. With the simplices over the proof's direction counted alpha, the left side ``alpha *
[over the direction] - w`` is then at most zero for every triangulation; a cut with coefficients up to that is valid.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any
from weakref import WeakKeyDictionary

from bcut.errors import VerificationError
from bcut.verification.cut_data import Candidates, CertificateCut, UncheckedError, candidates_of, covers
from bcut.verification.exact_points import SideTable, Simplex, mask_of, without

# A proof that takes more branches than this is not checked. Measured: 13,000 for stars among 16 points in space.
_BRANCHES = 1_000_000


def check_sphere(sides: SideTable, cut: CertificateCut) -> Fraction:
    """Check that no triangulation of the star of the face weighs less than the proof says.

    The proof has the face, the weight alpha, a direction (the vertices of the face, then three points: from the face
    towards the first, and from there by ever less towards the second and the third), and the simplices that weigh less
    than alpha, each with its weight.

    Returns
    -------
    Fraction
        The right-hand side that follows, 0.

    Raises
    ------
    VerificationError
        The proof lacks something or does not hold, or less follows than the cut says.
    UncheckedError
        The proof takes too long to check.
    """
    candidates = candidates_of(sides)
    proof = _Proof.of(candidates, cut)
    for simplex in cut.simplices:
        if not set(proof.face) <= set(simplex):
            raise VerificationError(
                f"sphere cut: {list(simplex)} does not contain the face {list(proof.face)}"
            )
    if cut.rhs < 0:
        raise VerificationError(
            f"sphere cut: without the face {list(proof.face)} its left side is 0, but its right-hand side is {cut.rhs}"
        )
    coefficients = dict(zip(cut.simplices, cut.coefficients, strict=True))
    for simplex in _star(candidates, proof.face):
        weight = proof.light.get(simplex, proof.alpha)
        most = proof.alpha * covers(candidates, simplex, proof.direction) - weight
        if coefficients.get(simplex, 0) > most:
            raise VerificationError(
                f"sphere cut: the coefficient of {list(simplex)} is {coefficients.get(simplex, 0)}, "
                f"but the proof gives {most}"
            )
    _Search(candidates, proof).run()
    return Fraction(0)


@dataclass(frozen=True)
class _Proof:
    face: Simplex
    alpha: int
    direction: Simplex
    light: dict[Simplex, int]

    @classmethod
    def of(cls, candidates: Candidates, cut: CertificateCut) -> _Proof:
        n, d = candidates.points.n, candidates.points.dimension
        face = _points(cut.proof.get("face"), n, d - 2, "face")
        direction = _points(cut.proof.get("direction"), n, d + 1, "direction")
        if (
            not face
            or set(direction[: d - 2]) != set(face)
            or not candidates.orientation(tuple(sorted(direction)))
        ):
            raise VerificationError(f"sphere cut: {list(direction)} is no direction at the face {list(face)}")
        alpha, listed = cut.proof.get("alpha"), cut.proof.get("light")
        if type(alpha) is not int or alpha < 1 or not isinstance(listed, list):
            raise VerificationError(
                "sphere cut: its proof has no positive integer 'alpha' with a list 'light'"
            )
        light: dict[Simplex, int] = {}
        for entry in listed:
            if not (isinstance(entry, list) and len(entry) == 2 and type(entry[1]) is int and entry[1] >= 0):
                raise VerificationError(f"sphere cut: {entry!r} of its proof is no simplex with a weight")
            simplex = _points(entry[0], n, d + 1, "light")
            if not set(face) <= set(simplex) or list(simplex) != sorted(simplex) or simplex in light:
                raise VerificationError(
                    f"sphere cut: {list(simplex)} of its proof does not contain the face, or is there twice"
                )
            light[simplex] = entry[1]
        return cls(face, alpha, direction, light)


class _Search:
    """Tries to put a star together that weighs less than alpha. Sets of simplices are bit sets over `usable`."""

    def __init__(self, candidates: Candidates, proof: _Proof) -> None:
        self.candidates, self.proof = candidates, proof
        self.usable = [s for s, weight in proof.light.items() if weight < proof.alpha and s in candidates]
        self.weights = [proof.light[simplex] for simplex in self.usable]
        self.branches = 0
        # Of each face that has points on both sides: the simplices above it, those below it.
        self.beside: dict[Simplex, list[int]] = {}
        self.faces: list[list[tuple[Simplex, int]]] = []
        # Of each simplex: its vertices; of each of its facets around the face, that and the points beyond; the points
        # within all of these.
        self.masks = [mask_of(simplex) for simplex in self.usable]
        self.beyond: list[list[int]] = []
        self.inside: list[int] = []
        self.compatible: dict[int, int] = {}
        for number, simplex in enumerate(self.usable):
            own, beyond, inside = [], [], -1
            for position, vertex in enumerate(simplex):
                ridge = without(simplex, position)
                if vertex in proof.face:
                    continue
                side = candidates[ridge][1] >> vertex & 1
                inside &= candidates[ridge][side]
                beyond.append(mask_of(ridge) | candidates[ridge][1 - side])
                if all(candidates[ridge]):
                    self.beside.setdefault(ridge, [0, 0])[side] |= 1 << number
                    own.append((ridge, side))
            self.faces.append(own)
            self.beyond.append(beyond)
            self.inside.append(inside)

    def run(self) -> None:
        """Raise an error if there is such a star."""
        if self.usable:
            self._branch(self._first(), (1 << len(self.usable)) - 1, 0, {})

    def _first(self) -> int:
        """Return the simplices over the one of some directions that has the fewest."""
        choices = []
        for simplex in self.usable[:: max(1, len(self.usable) // 16)]:
            others = tuple(v for v in simplex if v not in self.proof.face)
            direction = (*self.proof.face, *others)
            choices.append([covers(self.candidates, other, direction) for other in self.usable])
        return mask_of(number for number, over in enumerate(min(choices, key=sum)) if over)

    def _branch(self, choices: int, free: int, weight: int, gaps: dict[Simplex, int]) -> None:
        """Add each of the choices, and go on where the star is not closed.

        A gap is a face that only one of the chosen simplices has, with the simplices at its other side; only those that
        are still free, that is, cross none of the chosen ones, fit.
        """
        for number in _bits(choices):
            self.branches += 1
            if self.branches > _BRANCHES:
                raise UncheckedError(
                    f"it takes more than {_BRANCHES:,} branches to check a sphere cut at {list(self.proof.face)}"
                )
            heavier = weight + self.weights[number]
            if heavier >= self.proof.alpha:
                continue
            left = dict(gaps)
            for ridge, side in self.faces[number]:
                if ridge in left:
                    del left[ridge]
                else:
                    left[ridge] = self.beside[ridge][1 - side]
            if not left:
                raise VerificationError(
                    f"sphere cut at {list(self.proof.face)}: its proof says that its stars weigh at least "
                    f"{self.proof.alpha}, but one weighs {heavier}"
                )
            still_free = free & self._compatible(number)
            fewest = min((fitting & still_free for fitting in left.values()), key=int.bit_count)
            self._branch(fewest, still_free, heavier, left)

    def _compatible(self, number: int) -> int:
        """Return the simplices that do not cross one of them, itself left out; the answer is kept."""
        if number not in self.compatible:
            others = (other for other in range(len(self.usable)) if other != number)
            self.compatible[number] = mask_of(other for other in others if not self._cross(number, other))
        return self.compatible[number]

    def _cross(self, first: int, second: int) -> bool:
        for a, b in ((first, second), (second, first)):
            # Strictly beyond a facet, but for vertices of it: they meet in a common face.
            if any(not self.masks[b] & ~beyond for beyond in self.beyond[a]):
                return False
            # A vertex in the interior of the cone from the face over the other one.
            if self.masks[b] & self.inside[a]:
                return True
        return self.candidates.crossing(self.usable[first], self.usable[second])


def _bits(mask: int) -> Iterator[int]:
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low


_STARS: WeakKeyDictionary[Candidates, dict[Simplex, list[Simplex]]] = WeakKeyDictionary()


def _star(candidates: Candidates, face: Simplex) -> list[Simplex]:
    """List the candidates that contain a face; the answer is kept, since cuts come back to the same faces."""
    known = _STARS.setdefault(candidates, {})
    if face not in known:
        others = [point for point in range(candidates.points.n) if point not in face]
        simplices = (tuple(sorted((*face, *rest))) for rest in combinations(others, 3))
        known[face] = [simplex for simplex in simplices if simplex in candidates]
    return known[face]


def _points(value: Any, n: int, size: int, what: str) -> Simplex:
    """Read some different points."""
    good = isinstance(value, list) and all(type(v) is int and 0 <= v < n for v in value)
    if not good or len(value) != size or len(set(value)) != size:
        raise VerificationError(f"sphere cut: its proof has no good '{what}'")
    return tuple(value)

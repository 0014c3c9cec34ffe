"""Checker of face-crossing cuts: inequalities over faces of all dimensions, from pairs of them that cross.

Each face of a proof stands with the rest of a flag: further points that make its vertices an affine basis of the space.
The generic point of the flag lies next to a point inside the face, so of the simplices of a triangulation that have the
face one at most contains it, and none if the face is not there. These simplices are summed up for each face, with its
weight; faces of a triangulation do not cross.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import floor
from typing import Any

from bcut.errors import VerificationError
from bcut.verification.cut_data import Candidates, CertificateCut, candidates_of, covers
from bcut.verification.exact_points import SideTable, Simplex
from bcut.verification.heavy_sets import HeavySets


@dataclass(frozen=True)
class _Node:
    """A face, the rest of its flag, and its weight in the inequality."""

    face: Simplex
    rest: Simplex
    weight: int

    def holds(self, candidates: Candidates, simplex: Simplex) -> bool:
        """Tell whether a simplex is one of those that are summed up for the face."""
        return set(self.face) <= set(simplex) and covers(candidates, simplex, self.face + self.rest)


def check_face_crossing(sides: SideTable, cut: CertificateCut) -> Fraction:
    """Check that no set of faces which do not cross weighs too much, and that the cut says no more than these weights.

    The proof lists faces with weights, and a bound. Each weight is compared with the bound less the most that the faces
    before it can weigh which cross neither it nor each other: so no faces that do not cross weigh more than the bound.

    A simplex gets the weights of all faces that it is summed up for. If none has a coefficient larger than c times
    that, what follows is c times the bound, rounded down where all coefficients are integers.

    Returns
    -------
    Fraction
        The least right-hand side that follows.

    Raises
    ------
    VerificationError
        The proof lacks something or does not hold, or less follows than the cut says.
    UncheckedError
        The weights take too long to check.
    """
    candidates = candidates_of(sides)
    nodes, bound = _nodes(candidates, cut), _bound(cut)
    _check_weights(candidates, nodes, bound)
    scale = Fraction(0)
    for simplex, coefficient in zip(cut.simplices, cut.coefficients, strict=True):
        if coefficient > 0:
            weight = sum(node.weight for node in nodes if node.holds(candidates, simplex))
            if not weight:
                raise VerificationError(
                    f"face-crossing cut: {list(simplex)} contains none of its faces in the direction of its flag"
                )
            scale = max(scale, coefficient / weight)
    least = scale * bound
    if all(coefficient.denominator == 1 for coefficient in cut.coefficients):
        least = Fraction(floor(least))
    if least > cut.rhs:
        raise VerificationError(
            f"face-crossing cut: its right-hand side is {cut.rhs}, but {least} is all that its faces prove"
        )
    return least


def _check_weights(candidates: Candidates, nodes: Sequence[_Node], bound: int) -> None:
    """Check, one face after another, that those which do not cross weigh no more than the bound."""

    def crossing(first: int, second: int) -> bool:
        return candidates.faces_crossing(nodes[first].face, nodes[second].face, nodes[first].rest)

    position = HeavySets([node.weight for node in nodes], crossing).first_excess(0, bound)
    if position is not None:
        raise VerificationError(
            f"face-crossing cut: with the weight {nodes[position].weight} of {list(nodes[position].face)}, faces that "
            f"do not cross weigh more than {bound}"
        )


def _bound(cut: CertificateCut) -> int:
    bound = cut.proof.get("bound")
    if type(bound) is not int or bound < 1:
        raise VerificationError("face-crossing cut: its proof has no integer 'bound', at least 1")
    return bound


def _nodes(candidates: Candidates, cut: CertificateCut) -> list[_Node]:
    """Read the faces of a proof: vertices, the rest of the flag, and the weight of each."""
    n, d = candidates.points.n, candidates.points.dimension
    entries: Any = cut.proof.get("faces")
    if not isinstance(entries, list):
        raise VerificationError("face-crossing cut: its proof has no list 'faces'")
    found = []
    for entry in entries:
        good = (
            isinstance(entry, list)
            and len(entry) == 3
            and all(isinstance(part, list) for part in entry[:2])
            and all(type(v) is int and 0 <= v < n for part in entry[:2] for v in part)
            and type(entry[2]) is int
            and entry[2] > 0
        )
        flag = [*entry[0], *entry[1]] if good else []
        if len(set(flag)) != len(flag) or len(flag) != d + 1 or not entry[0]:
            raise VerificationError(
                f"face-crossing cut: its proof lists {entry}, which is no face with a flag and a weight"
            )
        if entry[0] != sorted(entry[0]) or not candidates.orientation(tuple(sorted(flag))):
            raise VerificationError(
                f"face-crossing cut: the flag {flag} in its proof lies in a hyperplane, or its face is not ascending"
            )
        found.append(_Node(tuple(entry[0]), tuple(entry[1]), entry[2]))
    if len({node.face for node in found}) != len(found):
        raise VerificationError("face-crossing cut: a face stands twice in its proof")
    return found

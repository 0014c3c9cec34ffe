"""Checker of link cuts: around an interior (d-2)-face, the simplices of a triangulation wind exactly once.

Let e be a (d-2)-simplex that lies in no facet of the convex hull. The simplices of a triangulation that contain e, if
there are any, fit together facet to facet and surround e once: seen along e, they are arcs ``a -> b`` of less than half
a turn, counter-clockwise, which make up one closed walk on the points that winds once. So an inequality over simplices
that all contain e is valid exactly when no such walk of candidates, nor the empty set, has a left side above the
right-hand side. The heaviest walk is a longest path: cut the circle just before some direction, then one arc leads
over the cut and all others go forward.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cmp_to_key
from typing import Any

from bcut.errors import VerificationError
from bcut.verification.cut_data import Candidates, CertificateCut, candidates_of
from bcut.verification.exact_points import SideTable, Simplex, sign_of_order


def check_link(sides: SideTable, cut: CertificateCut) -> Fraction:
    """Check that every closed walk of candidates that winds around the face once satisfies the cut.

    Returns
    -------
    Fraction
        The least right-hand side that follows, from the heaviest walk and from the empty set.

    Raises
    ------
    VerificationError
        The face is missing or not interior, a simplex does not contain it, a weight of the proof contradicts the cut,
        or less follows than the cut says.
    """
    candidates = candidates_of(sides)
    face = _face(sides, cut)
    for simplex in cut.simplices:
        if not set(face) <= set(simplex):
            raise VerificationError(f"link cut: {list(simplex)} does not contain the face {list(face)}")
    circle = _Circle.around(candidates, face)
    weights = dict(zip(cut.simplices, cut.coefficients, strict=True))
    arcs = circle.arcs(candidates, weights)
    heaviest = _heaviest_walk(circle, arcs)
    least = Fraction(0) if heaviest is None else max(Fraction(0), heaviest)
    if least > cut.rhs:
        raise VerificationError(
            f"link cut at {list(face)}: simplices that wind around it once reach {least} on its left side, "
            f"but its right-hand side is {cut.rhs}"
        )
    _check_alpha(circle, candidates, cut)
    return least


@dataclass(frozen=True)
class _Arc:
    """From one point to another, counter-clockwise around the face, by less than half a turn."""

    tail: int
    head: int
    weight: Fraction


@dataclass(frozen=True)
class _Circle:
    """The points around a face, by direction.

    Attributes
    ----------
    face : tuple of int
    level : dict of int to int
        The direction of each point that lies in one, counted counter-clockwise from an arbitrary first one.
    """

    face: Simplex
    level: Mapping[int, int]
    sides: Candidates

    @classmethod
    def around(cls, sides: Candidates, face: Simplex) -> _Circle:
        others = [p for p in range(sides.points.n) if p not in face and any(sides[tuple(sorted((*face, p)))])]
        if not others:
            raise VerificationError(
                f"link cut: the points {list(face)} are affinely dependent, so they are no face"
            )
        circle = cls(face, {}, sides)
        for point in others:
            turns = {circle.turn(point, other) for other in others}
            if not {1, -1} <= turns:
                raise VerificationError(f"link cut: the face {list(face)} lies in a facet of the convex hull")
        return cls(face, circle.directions(others), sides)

    def turn(self, a: int, b: int) -> int:
        """Return 1 where b lies counter-clockwise of a, by less than half a turn, -1 for clockwise, 0 for neither."""
        if a == b:
            return 0
        order = (*self.face, a, b)
        return self.sides.orientation(tuple(sorted(order))) * sign_of_order(order)

    def directions(self, points: list[int]) -> dict[int, int]:
        """Sort points around the face, from the direction of the first one on; those in one direction share a level."""
        first = points[0]
        witness = next(point for point in points if self.turn(first, point) > 0)

        def half(point: int) -> int:
            turn = self.turn(first, point)
            # In line with the first point, either its direction or the opposite one.
            return 0 if turn > 0 or (turn == 0 and self.turn(point, witness) > 0) else 1

        halves = {point: half(point) for point in points}

        def compare(a: int, b: int) -> int:
            return halves[a] - halves[b] or -self.turn(a, b)

        ordered = sorted(points, key=cmp_to_key(compare))
        levels: dict[int, int] = {}
        for position, point in enumerate(ordered):
            before = ordered[position - 1]
            same = position > 0 and halves[point] == halves[before] and not self.turn(before, point)
            levels[point] = levels[before] if same else (levels[before] + 1 if position else 0)
        return levels

    def arcs(self, candidates: Candidates, weights: Mapping[Simplex, Fraction]) -> list[_Arc]:
        """Return all candidates that contain the face as arcs, with their coefficients, zero where they have none."""
        found = []
        for a in self.level:
            for b in self.level:
                if self.turn(a, b) > 0:
                    simplex = tuple(sorted((*self.face, a, b)))
                    if simplex in candidates:
                        found.append(_Arc(a, b, weights.get(simplex, Fraction(0))))
        return found

    def goes_forward(self, arc: _Arc) -> bool:
        """Tell whether an arc does not lead over the cut just before the first direction."""
        return self.level[arc.tail] < self.level[arc.head]


def _heaviest_walk(circle: _Circle, arcs: Sequence[_Arc]) -> Fraction | None:
    """Return the largest weight of a closed walk that winds once; None if there is none."""
    forward = sorted(
        (arc for arc in arcs if circle.goes_forward(arc)), key=lambda arc: circle.level[arc.tail]
    )
    over: dict[int, list[_Arc]] = {}
    for arc in arcs:
        if not circle.goes_forward(arc):
            over.setdefault(arc.head, []).append(arc)
    best: Fraction | None = None
    for start, closing in over.items():
        reached = {start: Fraction(0)}
        for arc in forward:
            if arc.tail in reached:
                weight = reached[arc.tail] + arc.weight
                reached[arc.head] = max(weight, reached.get(arc.head, weight))
        for arc in closing:
            if arc.tail in reached:
                weight = reached[arc.tail] + arc.weight
                best = weight if best is None else max(best, weight)
    return best


def _check_alpha(circle: _Circle, candidates: Candidates, cut: CertificateCut) -> None:
    """Compute alpha again from the weights of the proof: no closed walk that winds once weighs less."""
    alpha: Any = cut.proof.get("alpha")
    wedges: Any = cut.proof.get("wedges")
    if alpha is None and wedges is None:
        return  # the cut has been proven without them
    good = type(alpha) is int and isinstance(wedges, list)
    if not good or not all(_is_wedge(wedge, circle) for wedge in wedges):
        raise VerificationError(
            f"link cut at {list(circle.face)}: its proof has no integer 'alpha' with a list 'wedges'"
        )
    arcs = [
        _Arc(tail, head, Fraction(-weight))
        for tail, head, weight in wedges
        if tuple(sorted((*circle.face, tail, head))) in candidates
    ]
    heaviest = _heaviest_walk(circle, arcs)
    if heaviest is not None and -heaviest < alpha:
        raise VerificationError(
            f"link cut at {list(circle.face)}: its proof says that walks which wind once weigh at least {alpha}, "
            f"but one weighs {-heaviest}"
        )


def _is_wedge(wedge: Any, circle: _Circle) -> bool:
    return (
        isinstance(wedge, list)
        and len(wedge) == 3
        and all(type(entry) is int for entry in wedge)
        and wedge[0] in circle.level
        and wedge[1] in circle.level
        and circle.turn(wedge[0], wedge[1]) > 0
    )


def _face(sides: SideTable, cut: CertificateCut) -> Simplex:
    value: Any = cut.proof.get("face")
    n, d = sides.points.n, sides.points.dimension
    if not isinstance(value, list) or not all(type(v) is int and 0 <= v < n for v in value):
        raise VerificationError("link cut: its proof names no face")
    face = tuple(sorted(value))
    if len(set(face)) != d - 1:
        raise VerificationError(f"link cut: its face {value} does not have {d - 1} vertices")
    return face

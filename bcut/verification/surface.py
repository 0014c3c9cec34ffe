"""Closed surfaces of triangles, checked exactly from coordinates, and what is inside them, told by rays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import combinations, count
from math import lcm
from typing import Any, NoReturn

from bcut.errors import VerificationError
from bcut.verification.cut_data import Candidates
from bcut.verification.exact_points import ExactPoints, Simplex

Vector = tuple[int, int, int]


class SurfaceCheck:
    """Triangles between rational points of dimension 3.

    Parameters
    ----------
    points : sequence of n sequences of 3 Fraction
    triangles : sequence of tuple of int
        Counterclockwise as seen from outside.

    Attributes
    ----------
    points : ExactPoints
    sides : Candidates
        Which points lie on which side of planes, and what crosses.
    triangles : list of tuple of int
    surface : set of tuple of int
        The triangles with ascending vertices.
    """

    def __init__(self, points: Sequence[Sequence[Fraction]], triangles: Sequence[Simplex]) -> None:
        self.points = ExactPoints(points)
        self.sides = Candidates(self.points)
        self.triangles = list(triangles)
        self.surface = {tuple(sorted(triangle)) for triangle in triangles}
        unit = lcm(*(value.denominator for point in points for value in point))
        # Twelve times as fine, so that barycentres are integers.
        self.integers: list[Vector] = [
            (int(12 * unit * x), int(12 * unit * y), int(12 * unit * z)) for x, y, z in points
        ]

    def check(self) -> None:
        """Refuse a surface that is not closed, crosses itself, or does not have the region on its inner side.

        Raises
        ------
        VerificationError
        """
        edges: dict[tuple[int, int], int] = {}
        for number, (a, b, c) in enumerate(self.triangles):
            if not any(self.points.value(self.points.hyperplane((a, b, c)), p) for p in range(self.points.n)):
                _refuse(f"the points {[a, b, c]} lie on a line")
            for edge in ((a, b), (b, c), (c, a)):
                if edge in edges:
                    _refuse(f"the surface is not oriented: two triangles run along {list(edge)}")
                edges[edge] = number
        for a, b in edges:
            if (b, a) not in edges:
                _refuse(f"the surface is not closed at the edge {[a, b]}")
        if len(self.surface) < len(self.triangles):
            _refuse("the surface has a triangle twice")
        for first, second in combinations(sorted(self.surface), 2):
            if self._meet_beyond_faces(first, second):
                _refuse(f"the triangles {list(first)} and {list(second)} of the surface cross")
        for component in self._components(edges):
            if self._winding(component, behind=True) != 1:
                _refuse(f"the triangle {list(component)} of the surface is wrongly oriented")

    def _components(self, edges: Mapping[tuple[int, int], int]) -> list[Simplex]:
        """Return one triangle of each part of the surface that is connected by edges."""
        seen: set[int] = set()
        found = []
        for start, triangle in enumerate(self.triangles):
            if start not in seen:
                found.append(triangle)
            waiting = [start]
            while waiting:
                number = waiting.pop()
                if number not in seen:
                    seen.add(number)
                    a, b, c = self.triangles[number]
                    waiting += [edges[b, a], edges[c, b], edges[a, c]]
        return found

    def _meet_beyond_faces(self, first: Simplex, second: Simplex) -> bool:
        """Tell whether two triangles meet in something else than a common face.

        They do if and only if disjoint faces of them have relative interiors that meet in a point; at most five
        vertices are needed for that.
        """
        for size, other in ((1, 2), (1, 3), (2, 2), (2, 3)):
            for one, two in ((first, second), (second, first)):
                for face in combinations(one, size):
                    for against in combinations(two, other):
                        if not set(face) & set(against) and self._interiors_meet(face, against):
                            return True
        return False

    def _interiors_meet(self, face: Simplex, against: Simplex) -> bool:
        """Tell whether the relative interiors of two faces with disjoint vertices meet in a single point."""
        p, *more = (self.integers[v] for v in face)
        a, b, *last = (self.integers[v] for v in against)
        if not more and not last:
            return not any(_cross(_minus(a, p), _minus(b, p))) and _dot(_minus(a, p), _minus(b, p)) < 0
        if not more:
            normal = _cross(_minus(b, a), _minus(last[0], a))
            corners = (a, b, last[0], a)
            return _dot(normal, _minus(p, a)) == 0 and all(
                _dot(normal, _cross(_minus(corners[i + 1], corners[i]), _minus(p, corners[i]))) > 0
                for i in range(3)
            )
        q = more[0]
        if not last:
            normal = _cross(_minus(q, p), _minus(b, a))
            if not any(normal) or _dot(normal, _minus(a, p)):
                return False
            sides = [_dot(normal, _cross(_minus(q, p), _minus(x, p))) for x in (a, b)]
            others = [_dot(normal, _cross(_minus(b, a), _minus(x, a))) for x in (p, q)]
            return sides[0] * sides[1] < 0 and others[0] * others[1] < 0
        if _determinant(a, b, last[0], p) * _determinant(a, b, last[0], q) >= 0:
            return False
        around = [_determinant(p, q, x, y) for x, y in ((a, b), (b, last[0]), (last[0], a))]
        return all(value > 0 for value in around) or all(value < 0 for value in around)

    def volume(self) -> int:
        """Return the volume of the region in the units of `ExactPoints.volume`, by the divergence theorem."""
        total = sum(
            _dot(self.integers[a], _cross(self.integers[b], self.integers[c])) for a, b, c in self.triangles
        )
        return total // 12**3

    def _winding(self, simplex: Simplex, *, behind: bool = False) -> int:
        """Return how many times the surface winds around the barycentre of a tetrahedron.

        With `behind`, around a point next to the barycentre of a triangle of the surface, on its inner side.
        """
        corners = [self.integers[v] for v in simplex]
        start = _vector(sum(p[i] for p in corners) // len(corners) for i in range(3))
        skip = tuple(sorted(simplex)) if behind else ()
        normal = _cross(_minus(corners[1], corners[0]), _minus(corners[2], corners[0]))
        for k in count(1):
            # Any plane through the origin has at most two of these directions.
            direction = (1, k, k * k)
            slope = _dot(normal, direction)
            if behind and not slope:
                continue
            if behind and slope > 0:
                direction = (-1, -k, -k * k)
            passed = self._passed(start, direction, skip)
            if passed is not None:
                return passed
        raise AssertionError("there is always another direction")

    def _passed(self, start: Vector, direction: Vector, skip: Simplex) -> int | None:
        """Count the triangles where a ray leaves minus those where it enters; None if it hits an edge."""
        total = 0
        end = _vector(x + y for x, y in zip(start, direction, strict=True))
        for triangle in self.triangles:
            if tuple(sorted(triangle)) == skip:
                continue
            a, b, c = (self.integers[v] for v in triangle)
            around = [_determinant(start, end, x, y) for x, y in ((a, b), (b, c), (c, a))]
            if any(value > 0 for value in around) and any(value < 0 for value in around):
                continue
            if not all(around):
                return None
            normal = _cross(_minus(b, a), _minus(c, a))
            slope, height = _dot(normal, direction), _dot(normal, _minus(start, a))
            if height * slope < 0:
                total += 1 if slope > 0 else -1
        return total

    def fits(self, tetrahedron: Simplex) -> bool:
        """Tell whether a tetrahedron is not flat, inside, and meets the surface's triangles in common faces."""
        return (
            self.sides.orientation(tetrahedron) != 0
            and not any(self.sides.crossing(tetrahedron, triangle) for triangle in self.surface)
            and self._winding(tetrahedron) == 1
        )


def _refuse(reason: str) -> NoReturn:
    raise VerificationError(reason)


def _vector(values: Any) -> Vector:
    x, y, z = values
    return x, y, z


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _dot(a: Vector, b: Vector) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _determinant(a: Vector, b: Vector, c: Vector, d: Vector) -> int:
    return _dot(_cross(_minus(b, a), _minus(c, a)), _minus(d, a))

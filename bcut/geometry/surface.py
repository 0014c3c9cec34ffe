"""Regions of space that a closed triangulated surface bounds, and the tetrahedra inside; decided by signs alone.

The number of times that a closed oriented surface winds around a point p is the sum, over its triangles T, of the
orientation of (q, T) where the tetrahedron (q, T) contains p, for any point q: the cone from q over the surface has
the surface as its boundary. So for generic points, which are given symbolically (`bcut.geometry.generic_point`), the
chirotope decides whether they are inside.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from operator import index

import numpy as np
from numpy.typing import NDArray

from bcut.errors import SurfaceError, TooLargeError
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.circuits import circuits
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.crossings import crossing_matrix
from bcut.geometry.generic_point import simplices_containing_generic_point
from bcut.geometry.subsets import ranks
from bcut.geometry.volumes import volumes

Triangle = tuple[int, int, int]

#: All sets of five points are listed.
MAX_POINTS = 40


@dataclass(frozen=True, eq=False)
class Region:
    """What lies inside a closed surface of triangles. Make one with `Region.of`, which checks the surface.

    Attributes
    ----------
    configuration : PointConfiguration
        Points in dimension 3 with rational coordinates. Those that no triangle has are further vertices that a
        triangulation may use.
    triangles : tuple of (int, int, int)
        Counterclockwise when they are seen from outside.
    chirotope : Chirotope
    """

    configuration: PointConfiguration
    triangles: tuple[Triangle, ...]
    chirotope: Chirotope

    @classmethod
    def of(cls, configuration: PointConfiguration, triangles: Iterable[Sequence[int]]) -> Region:
        """Check that triangles bound a region.

        Parameters
        ----------
        configuration : PointConfiguration
        triangles : iterable of three point numbers each
            Counterclockwise when they are seen from outside.

        Raises
        ------
        SurfaceError
            If the points are not rational points of dimension 3, or the surface is not closed, has edges with more than
            two triangles, crosses itself or is wrongly oriented.
        TooLargeError
            If there are more than `MAX_POINTS` points.
        """
        name = configuration.name
        if configuration.dimension != 3:
            raise SurfaceError(
                f"{name}: a surface of triangles bounds a region of dimension 3, not {configuration.dimension}"
            )
        if configuration.field.degree > 1:
            raise SurfaceError(f"{name}: the coordinates of a region must be rational; round them")
        if configuration.n > MAX_POINTS:
            raise TooLargeError(
                f"{name}: {configuration.n} points; regions are solved with up to {MAX_POINTS} points"
            )
        listed = _listed(triangles, configuration)
        region = cls(configuration, listed, Chirotope.of(configuration))
        region._check_closed()
        region._check_crossings()
        region._check_orientation()
        return region

    @cached_property
    def sorted_triangles(self) -> NDArray[np.int64]:
        """The triangles with ascending vertices, shape (f, 3)."""
        return np.sort(np.array(self.triangles, dtype=np.int64).reshape(-1, 3), axis=1)

    @cached_property
    def tetrahedra(self) -> NDArray[np.int64]:
        """The tetrahedra inside that cross no triangle of the surface, shape (m, 4), ascending, in colex order.

        They are those that fit to the surface face to face: a triangulation of the region consists of such ones.
        """
        bases = self.chirotope.bases
        free = bases[~crossing_matrix(self.chirotope, self.sorted_triangles, bases).any(axis=0)]
        inside = [self.winding(tetrahedron) == 1 for tetrahedron in free]
        return free[np.array(inside, dtype=bool)]

    @cached_property
    def volumes(self) -> list[int]:
        """Volumes of the tetrahedra, in units of ``1 / (6 denominator**3)``."""
        return [int(value) for value in volumes(self.configuration, self.tetrahedra)[:, 0]]

    @cached_property
    def volume(self) -> int:
        """Volume of the region, in the same units."""
        simplices, signs = self._cone
        sizes = volumes(self.configuration, simplices)[:, 0].tolist()
        return int(sum(sign * size for sign, size in zip(signs.tolist(), sizes, strict=True)))

    def winding(self, flag: NDArray[np.int64]) -> int:
        """Return how many times the surface winds around the generic point of a flag of four independent points."""
        simplices, signs = self._cone
        contained = simplices_containing_generic_point(self.chirotope, simplices, flag)
        return int(signs[contained].sum())

    @cached_property
    def _cone(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """The tetrahedra from point 0 to the triangles, ascending, and their orientations; flat ones are left out."""
        rows, signs = [], []
        for triangle in self.triangles:
            sign = 0 if 0 in triangle else self._orientation((0, *triangle))
            if sign:
                rows.append(sorted((0, *triangle)))
                signs.append(sign)
        return np.array(rows, dtype=np.int64).reshape(-1, 4), np.array(signs, dtype=np.int64)

    def _orientation(self, points: Sequence[int]) -> int:
        inversions = sum(points[i] > points[j] for i in range(4) for j in range(i + 1, 4))
        sign = int(self.chirotope.orientations(np.array(sorted(points))))
        return -sign if inversions & 1 else sign

    def _edges(self) -> dict[tuple[int, int], list[int]]:
        """Return the triangles of each directed edge."""
        edges: dict[tuple[int, int], list[int]] = {}
        for number, (a, b, c) in enumerate(self.triangles):
            for edge in ((a, b), (b, c), (c, a)):
                edges.setdefault(edge, []).append(number)
        return edges

    def _check_closed(self) -> None:
        name, edges = self.configuration.name, self._edges()
        for (a, b), numbers in edges.items():
            count = len(numbers) + len(edges.get((b, a), ()))
            text = f"{min(a, b)},{max(a, b)}"
            if count == 1:
                raise SurfaceError(
                    f"{name}: the surface is not closed: triangle {self.triangles[numbers[0]]} is the only one with "
                    f"the edge {text}; add the missing triangles"
                )
            if count > 2:
                raise SurfaceError(
                    f"{name}: {count} triangles share the edge {text}; a surface has two at each edge, so split the "
                    "region there"
                )
            if len(numbers) == 2:
                first, second = (self.triangles[number] for number in numbers)
                raise SurfaceError(
                    f"{name}: the triangles {first} and {second} run along the edge {text} in the same direction: one "
                    "of them is wrongly oriented; list the vertices of each counterclockwise as seen from outside"
                )

    def _check_crossings(self) -> None:
        crossing = np.argwhere(crossing_faces(self.chirotope, self.sorted_triangles))
        if len(crossing):
            first, second = (self.triangles[number] for number in crossing[0].tolist())
            raise SurfaceError(
                f"{self.configuration.name}: the surface crosses itself: the triangles {first} and {second} meet in "
                "more than a common face; move their vertices apart, or divide them where they meet"
            )

    def _check_orientation(self) -> None:
        """Refuse a component of the surface whose inner side is not inside."""
        seen: set[int] = set()
        edges = self._edges()
        for start, triangle in enumerate(self.triangles):
            if start in seen:
                continue
            if not self._faces_outwards(triangle):
                raise SurfaceError(
                    f"{self.configuration.name}: the triangle {triangle} and those connected with it are wrongly "
                    "oriented: what they turn their backs to is not inside; reverse the order of the vertices of each"
                )
            waiting = [start]
            while waiting:
                number = waiting.pop()
                if number not in seen:
                    seen.add(number)
                    a, b, c = self.triangles[number]
                    waiting += [edges[edge][0] for edge in ((b, a), (c, b), (a, c))]

    def _faces_outwards(self, triangle: Triangle) -> bool:
        """Tell whether a point next to a triangle, on its inner side, is wound around once."""
        ascending = tuple(sorted(triangle))
        even = triangle in (ascending, (*ascending[1:], ascending[0]), (ascending[2], *ascending[:2]))
        # Seen from outside the triangle runs counterclockwise, so its determinant with an inner point is negative.
        sides = self.chirotope.sides[int(ranks(np.array(ascending), self.chirotope.n))]
        inner = np.flatnonzero(sides == (-1 if even else 1))
        return len(inner) > 0 and self.winding(np.array([*triangle, inner[0]])) == 1


def crossing_faces(chirotope: Chirotope, faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Tell which pairs of some simplices of any one dimension do not meet in a common face, shape (k, k).

    They do not exactly when a circuit has one part in each of them.
    """
    found = circuits(chirotope)
    found = found[((found > 0).sum(axis=1) <= faces.shape[1]) & ((found < 0).sum(axis=1) <= faces.shape[1])]
    absent = np.ones((len(faces), chirotope.n), dtype=np.float32)
    np.put_along_axis(absent, faces, 0, axis=1)
    result = np.zeros((len(faces), len(faces)), dtype=bool)
    step = 1 << 16
    for start in range(0, len(found), step):
        part = found[start : start + step]
        plus = ((part > 0).astype(np.float32) @ absent.T == 0).astype(np.float32)
        minus = ((part < 0).astype(np.float32) @ absent.T == 0).astype(np.float32)
        result |= plus.T @ minus > 0
    return result | result.T


def _listed(triangles: Iterable[Sequence[int]], configuration: PointConfiguration) -> tuple[Triangle, ...]:
    """Return triangles as triples of point numbers that exist and do not lie on a line."""
    name, listed, points = configuration.name, [], configuration.scalars()
    for number, face in enumerate(triangles):
        try:
            vertices = tuple(index(vertex) for vertex in face)
        except TypeError:
            raise SurfaceError(
                f"{name}: face {number} (counted from 0) is {face!r}, not three point numbers"
            ) from None
        if len(vertices) != 3:
            raise SurfaceError(
                f"{name}: face {number} (counted from 0) has {len(vertices)} vertices; divide it into triangles, since "
                "how it is divided matters"
            )
        if len(set(vertices)) < 3 or not all(0 <= vertex < configuration.n for vertex in vertices):
            raise SurfaceError(
                f"{name}: face {number} (counted from 0) is {list(vertices)}, which is no set of three of the "
                f"{configuration.n} points"
            )
        a, b, c = (points[vertex] for vertex in vertices)
        u, v = ([x - y for x, y in zip(p, a, strict=True)] for p in (b, c))
        if not any(u[i] * v[j] - u[j] * v[i] for i, j in ((0, 1), (1, 2), (0, 2))):
            raise SurfaceError(f"{name}: the points {list(vertices)} of face {number} lie on a line")
        listed.append((vertices[0], vertices[1], vertices[2]))
    if not listed:
        raise SurfaceError(f"{name}: there are no faces; give a closed surface of triangles")
    return tuple(listed)

"""Convex polygon cuts (2D): a triangulation has at most b - 2 triangles in a convex polygon through b points that is empty.

Definition
----------
Let V be the points of the configuration in their own convex hull, none of them in its interior, b in number (points inside
an edge of the polygon count). A triangulation's triangles with vertices in V have disjoint interiors, and can be completed
to a triangulation of the polygon; one that uses all of V has b - 2 triangles, and none has more:

    sum of x over the triangles with vertices in V  <=  b - 2.

This is Definition 1 of the paper with no interior points. For a point of Formulation 2 no such cut is violated: at each
vertex v of V, the triangles of V at v cover every direction into the polygon with total value at most 1, so the sum of x times
the angle at v is at most the polygon's angle there; summed over all vertices, pi times the left side is at most pi (b - 2).
That settles the paper's Conjecture 1. Points of Formulations 0 and 1, and points that are given by hand, can violate it.

Separation
----------
The left side counts all triangles of V, not those of one fan, so it is not a sum along the chain of V's edges, and dynamic
programming over convex chains does not apply. But without the condition of being empty and convex, the best set is easy:
choose triangles with profit x, each of which needs its three vertices at cost 1. That is a maximum-weight closure, one
minimum cut. For each triangle of positive value that V may contain, branch and bound asks for the best set by a minimum
cut, and where it is not empty and convex, a point in its way lies in the hull of few of its points: one of these must go.
If all points are in convex position the first minimum cut is the answer; otherwise the polygons around one triangle are few.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope
from bcut.separation.seam import Cut, FractionalPoint, Problem, Separator

# A cut counts as violated from this much on.
_MARGIN = 1e-4


class ConvexPolygonCuts(Separator):
    """Exact separation of the cuts of empty convex polygons; in dimensions other than 2 there are none.

    Parameters
    ----------
    max_cuts : int
        At most this many cuts per point, most violated first.
    effort : int
        Minimum cuts per point; a search that needs more ends with the best polygons so far.
    """

    name: ClassVar[str] = "convex-polygon"

    def __init__(self, *, max_cuts: int = 50, effort: int = 20_000) -> None:
        if min(max_cuts, effort) < 1:
            raise ValueError("max_cuts and effort are at least 1")
        self.max_cuts, self.effort = max_cuts, effort

    def setup(self, problem: Problem) -> None:
        """Prepare the sides of all lines through two points."""
        super().setup(problem)
        if problem.dimension == 2:
            self.lines = Lines(problem.chirotope)

    def separate(self, point: FractionalPoint) -> Iterator[Cut]:
        """Yield the cuts of violated polygons: the most violated one around each triangle, most violated first."""
        if self.problem.dimension != 2:
            return
        found = violated_polygons(self.lines, self.problem.simplices[point.support], point.x[point.support], self.effort)
        for polygon, _ in found[: self.max_cuts]:
            columns = np.flatnonzero(np.isin(self.problem.simplices, polygon).all(axis=1))
            yield Cut(columns, len(polygon) - 2, proof={"polygon": polygon})


class Lines:
    """The lines through two points of a planar configuration, as sets of points on each side; sets are bit masks.

    Attributes
    ----------
    left, on : list of list of int
        For an ordered pair (a, b), the points strictly on the left of the line from a to b, and those strictly between a
        and b.
    """

    def __init__(self, chirotope: Chirotope) -> None:
        n = self.n = chirotope.n
        self.left = [[0] * n for _ in range(n)]
        self.on = [[0] * n for _ in range(n)]
        collinear: dict[tuple[int, int], int] = {}
        for (a, b), sides in zip(chirotope.facets.tolist(), chirotope.sides, strict=True):
            self.left[a][b], self.left[b][a] = _mask(sides > 0), _mask(sides < 0)
            collinear[a, b] = _mask(sides == 0) & ~(1 << a | 1 << b)
        # A point r of the line through a and b is between them when some point off the line sees them in the order a, r, b.
        for (a, b), others in collinear.items():
            if others:
                viewer = _lowest(self.left[a][b] | self.left[b][a])
                turn = self.left[viewer][a] >> b & 1
                for r in _bits(others):
                    if (self.left[viewer][a] >> r & 1) == turn and (self.left[viewer][r] >> b & 1) == turn:
                        self.on[a][b] |= 1 << r
                self.on[b][a] = self.on[a][b]

    def in_triangle(self, a: int, b: int, c: int) -> int:
        """Return the points strictly inside a triangle."""
        if not self.left[a][b] >> c & 1:
            a, b = b, a
        return self.left[a][b] & self.left[b][c] & self.left[c][a]

    def inside(self, points: int) -> int:
        """Return all points of the configuration strictly inside the convex hull of some."""
        result = (1 << self.n) - 1
        members = list(_bits(points))
        for a in members:
            for b in members:
                # The hull lies on the left of its edges.
                if a != b and not points & ~self.left[a][b] & ~self.on[a][b] & ~(1 << a | 1 << b):
                    result &= self.left[a][b]
        return result

    def between(self, points: int) -> int:
        """Return the points of the configuration that lie between two of some, without these."""
        members, result = list(_bits(points)), 0
        for i, a in enumerate(members):
            for b in members[i + 1 :]:
                result |= self.on[a][b]
        return result & ~points

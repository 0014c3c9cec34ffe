"""Convex polygon cuts (2D): an empty convex polygon through b points has room for b - 2 triangles.

Definition
----------
Let V be all points of the configuration in a convex polygon, none of them in its interior, b in number
(points inside an edge of the polygon count). Triangles of a triangulation with vertices in V overlap nowhere,
so their angles, pi for each triangle, fit into the angles of the polygon at the points of V, pi (b - 2)
together:

    sum of x over the triangles with vertices in V  <=  b - 2.

This is Definition 1 of the paper with no interior points. A point x of Formulation 2 never violates it: in a
direction from v into the polygon, the triangles of V at v have a total value of at most 1, because all of
them contain the same chamber at v; so their angles times x fit as well. That is the paper's Conjecture 1.
Points of Formulations 0 and 1, and points that are given by hand, can violate it.

Separation
----------
The left side counts all triangles of V, not those of one fan, so it is not a sum along the chain of V's
edges, and dynamic programming over convex chains does not apply. But without the condition of being empty and
convex, the best set is easy: choose triangles with profit x, each of which needs its three vertices at cost
1. That is a maximum-weight closure, one minimum cut. For each triangle of positive value that V may contain,
branch and bound asks for the best set by a minimum cut, and where it is not empty and convex, a point in its
way lies in the hull of few of its points: one of these must go. If all points are in convex position the
first minimum cut is the answer; otherwise the polygons around one triangle are few.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope
from bcut.geometry.partial_chirotope import PartialChirotope
from bcut.separation.seam import Cut, FractionalPoint, Problem, Separator

# A cut counts as violated from this much on.
_MARGIN = 1e-4


class ConvexPolygon(Separator):
    """In an empty convex polygon through b points, at most b - 2 triangles: in the plane only, exact.

    Parameters
    ----------
    max_cuts : int
        At most this many cuts per point, most violated first.
    effort : int
        Minimum cuts per point; a search that needs more ends with the best polygons so far.
    """

    name: ClassVar[str] = "convex-polygon"
    dissections: ClassVar[bool] = True

    def __init__(self, *, max_cuts: int = 50, effort: int = 20_000) -> None:
        if min(max_cuts, effort) < 1:
            raise ValueError("max_cuts and effort are at least 1")
        self.max_cuts, self.effort = max_cuts, effort

    def setup(self, problem: Problem) -> None:
        """Prepare the sides of all lines through two points."""
        super().setup(problem)
        if problem.dimension == 2:
            chirotope = problem.chirotope
            if isinstance(chirotope, PartialChirotope):
                # Programs over orbits have no table of signs; in the plane it is small.
                chirotope = Chirotope.of(problem.configuration)
            self.lines = Lines(chirotope)

    def separate(self, point: FractionalPoint) -> Iterator[Cut]:
        """Yield the cuts of violated polygons, at most one around each triangle, most violated first."""
        if self.problem.dimension != 2:
            return
        found = violated_polygons(
            self.lines, self.problem.simplices[point.support], point.x[point.support], self.effort
        )
        for polygon, _ in found[: self.max_cuts]:
            columns = np.flatnonzero(np.isin(self.problem.simplices, polygon).all(axis=1))
            yield Cut(columns, len(polygon) - 2, proof={"polygon": polygon})


class Lines:
    """The lines through two points of a planar configuration, and the points beside them, as bit masks.

    Attributes
    ----------
    left, on : list of list of int
        For an ordered pair (a, b), the points strictly on the left of the line from a to b, and those
        strictly between a and b.
    """

    def __init__(self, chirotope: Chirotope) -> None:
        n = self.n = chirotope.n
        self.left = [[0] * n for _ in range(n)]
        self.on = [[0] * n for _ in range(n)]
        self._free: dict[tuple[int, int], int] = {}
        collinear: dict[tuple[int, int], int] = {}
        for (a, b), sides in zip(chirotope.facets.tolist(), chirotope.sides, strict=True):
            self.left[a][b], self.left[b][a] = _mask(sides > 0), _mask(sides < 0)
            collinear[a, b] = _mask(sides == 0) & ~(1 << a | 1 << b)
        # A point r of the line through a and b is between them when some point off the line sees them in the
        # order a, r, b.
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

    def free(self, a: int, b: int) -> int:
        """Return the points that span no triangle with a and b that has a point strictly inside."""
        if (a, b) not in self._free:
            others = _bits(((1 << self.n) - 1) & ~(1 << a | 1 << b))
            self._free[a, b] = sum(1 << c for c in others if not self.in_triangle(a, b, c))
        return self._free[a, b]

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


def violated_polygons(
    lines: Lines, triangles: NDArray[np.integer], values: NDArray[np.floating], effort: int
) -> list[tuple[list[int], float]]:
    """Find the empty convex polygons whose cuts a point violates most.

    Parameters
    ----------
    lines : Lines
        Of the configuration.
    triangles : ndarray of int, shape (k, 3)
        Those with a positive value.
    values : ndarray of float, shape (k,)
    effort : int
        Minimum cuts, at most.

    Returns
    -------
    list of (list of int, float)
        Polygons as ascending vertices, with their violations, most violated first. Each is a most violated
        one among those that contain some triangle and none of the triangles of larger value; so the first one
        is best of all.
    """
    search = _Search(lines, effort)
    order = np.argsort(-values, kind="stable")
    profits = {sum(1 << v for v in triangles[i].tolist()): float(values[i]) for i in order}
    remaining = dict(profits)
    found: dict[int, float] = {}
    for triangle in profits:
        polygon = search.best_around(triangle, remaining)
        if polygon:
            inside = sum(x for other, x in profits.items() if not other & ~polygon)
            found[polygon] = inside - polygon.bit_count() + 2
        # What contains this triangle is dealt with.
        del remaining[triangle]
    ranked = sorted(found, key=lambda polygon: (-found[polygon], polygon))
    return [(list(_bits(polygon)), found[polygon]) for polygon in ranked]


class _Search:
    """Branch and bound over points that are in, points that may come in, and points that are out."""

    def __init__(self, lines: Lines, effort: int) -> None:
        self.lines, self.effort = lines, effort
        self.best, self.best_violation = 0, _MARGIN

    def best_around(self, triangle: int, profits: dict[int, float]) -> int:
        """Return the most violated polygon that contains a triangle, 0 if none is violated."""
        self.best, self.best_violation = 0, _MARGIN
        if not self.lines.inside(triangle):
            everything = (1 << self.lines.n) - 1
            self._branch(triangle, everything & ~triangle, profits)
        return self.best

    def _branch(self, inner: int, candidates: int, profits: dict[int, float]) -> None:
        if self.effort <= 0:
            return
        allowed = self._compatible(inner, candidates)
        usable = {triangle: x for triangle, x in profits.items() if not triangle & ~(inner | allowed)}
        chosen = inner | self._closure(inner, allowed, usable)
        violation = (
            sum(x for triangle, x in usable.items() if not triangle & ~chosen) - chosen.bit_count() + 2
        )
        if violation <= self.best_violation:
            return
        obstacle = self._obstacle(chosen, inner)
        if obstacle is None:
            self.best, self.best_violation = chosen, violation
            return
        culprits, remedy = obstacle
        for point in _bits(culprits & ~inner):
            allowed &= ~(1 << point)
            self._branch(inner, allowed, usable)
            inner |= 1 << point
        if remedy & allowed and not self.lines.inside(inner | remedy):
            self._branch(inner | remedy, allowed & ~remedy, usable)

    def _compatible(self, inner: int, candidates: int) -> int:
        """Return those candidates each of which spans with `inner` a polygon that has nothing inside."""
        members = list(_bits(inner))
        for i, a in enumerate(members):
            for b in members[i + 1 :]:
                candidates &= self.lines.free(a, b)
        return sum(1 << point for point in _bits(candidates) if not self.lines.inside(inner | 1 << point))

    def _obstacle(self, chosen: int, inner: int) -> tuple[int, int] | None:
        """Return points of which one must go, unless another one, also returned, comes in; None if all is well."""
        inside = self.lines.inside(chosen)
        if inside:
            obstacle = inside & -inside
            # A minimal set around the obstacle: at most four points, as many as possible of those that are in
            # anyway.
            for point in [*_bits(chosen & ~inner), *_bits(inner)]:
                if self.lines.inside(chosen & ~(1 << point)) & obstacle:
                    chosen &= ~(1 << point)
            return chosen, 0
        between = self.lines.between(chosen)
        if not between:
            return None
        missing = _lowest(between)
        members = list(_bits(chosen))
        for i, a in enumerate(members):
            for b in members[i + 1 :]:
                if self.lines.on[a][b] >> missing & 1:
                    return 1 << a | 1 << b, 1 << missing
        raise AssertionError("a point between two others has these two")

    def _closure(self, inner: int, allowed: int, usable: dict[int, float]) -> int:
        """Return the points to add to `inner` for the largest profit minus 1 per point, whatever their shape."""
        profits: dict[int, float] = {}
        for triangle, x in usable.items():
            needed = triangle & ~inner
            if needed:
                profits[needed] = profits.get(needed, 0.0) + x
        # A point whose triangles together do not pay for it is in no best set.
        while allowed:
            income = dict.fromkeys(_bits(allowed), 0.0)
            for needed, x in profits.items():
                for point in _bits(needed):
                    income[point] += x
            poor = sum(1 << point for point, x in income.items() if x <= 1.0)
            if not poor:
                break
            allowed &= ~poor
            profits = {needed: x for needed, x in profits.items() if not needed & poor}
        if not allowed:
            return 0
        self.effort -= 1
        return _closure_by_minimum_cut(allowed, profits)


def _closure_by_minimum_cut(points: int, profits: dict[int, float]) -> int:
    """Return the set of points whose profits (of the sets that it contains) minus 1 per point are largest."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    number = {point: 1 + len(profits) + i for i, point in enumerate(_bits(points))}
    sink = 1 + len(profits) + len(number)
    # Capacities are 32-bit integers; no finite cut is larger than the sum of the profits.
    unit = 2.0**30 / max(2.0, 2.0 * sum(profits.values()))
    arcs: list[tuple[int, int, int]] = [(node, sink, round(unit)) for node in number.values()]
    for i, (needed, x) in enumerate(profits.items()):
        arcs.append((0, 1 + i, round(unit * x)))
        arcs.extend((1 + i, number[point], 2**30) for point in _bits(needed))
    tails, heads, capacities = np.array(arcs, dtype=np.int32).T
    graph = sp.csr_matrix((capacities, (tails, heads)), shape=(sink + 1, sink + 1))
    residual = graph - maximum_flow(graph, 0, sink).flow
    residual.data[residual.data < 0] = 0
    residual.eliminate_zeros()
    reached = set(breadth_first_order(residual, 0, return_predecessors=False).tolist())
    return sum(1 << point for point, node in number.items() if node in reached)


def _mask(flags: NDArray[np.bool_]) -> int:
    return int.from_bytes(np.packbits(flags, bitorder="little").tobytes(), "little")


def _lowest(mask: int) -> int:
    return (mask & -mask).bit_length() - 1


def _bits(mask: int) -> Iterator[int]:
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low

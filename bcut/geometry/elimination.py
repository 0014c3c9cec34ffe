r"""Edges that a minimum weight triangulation of the plane can have: theorems, without any linear program.

The weight of a triangulation is the sum of the lengths of its edges; all points are used. Below, S is the set of
points, an *edge* joins two points of S and contains no third one, and a triangle is *empty* if it contains no point
of S but its vertices. Two theorems take edges away.

**The diamond test.** Let pq be an edge of a minimum weight triangulation. Then at least one of the two isosceles
triangles with base pq and base angle pi/4.6 has no point of S in its interior. (G. Das and D. Joseph, "Which
triangulations approximate the complete graph?", 1989, with pi/8; R. Drysdale, S. McElfresh and J. Snoeyink, "On
exclusion regions for optimal triangulations", Discrete Applied Mathematics 109, 2001, for pi/4.6.) The proof
is an exchange: with a point on either side near enough, the edges that separate two such points can be replaced by a
segment between these and as many diagonals in all, of a smaller sum; the base angle is what the estimates there need.
Edges of the hull pass: one of their triangles lies outside. We take the theorem as it was published, for finite sets
of points. Nothing else here depends on it: `lmt_skeleton` can begin with `all_pairs`.

**Local minimality.** Let e be an edge of a minimum weight triangulation, not in the boundary of the hull, and t, t'
the two triangles at it. Where their union is strictly convex, e is not longer than the other diagonal f: f contains
no further point, since t and t' are empty, so f for e makes another triangulation, of smaller weight if f were
shorter. So where a set E of edges is known to contain all edges of a minimum weight triangulation, e must be *locally
minimal* in the union of some pair of empty triangles with edges in E; otherwise it is struck out of E, and E is
smaller for the next edge. Now let e in E be crossed by no other edge of E. A triangulation is a maximal set of edges
without crossings, so every one with edges in E has e: it is *certain*. The certain edges are the LMT-skeleton (M.
Dickerson and M. Montague, "A (usually?) connected subgraph of the minimum weight triangulation", SoCG 1996; P.
Belleville, M. Keil, M. McAllister and J. Snoeyink, "On computing edges that are in all minimum-weight
triangulations", 1996; R. Beirouti and J. Snoeyink, "Implementations of the LMT heuristic for minimum weight
triangulation", SoCG 1998). With the diamond test before it, it solves instances of millions of points (A. Haas,
"Solving large-scale minimum-weight triangulation instances to provable optimality", SoCG 2018). This argument needs
no general position: points may be collinear or cocircular.

**Faces.** Every triangulation with edges in E contains the certain ones, so it triangulates each face of the plane
graph of these by itself, and the faces are independent problems. A face whose boundary is connected is an open disk.
Each further edge of E in it cuts it into two disks, and the least weight on one side of the edge is a recursion over
the triangles there: dynamic programming (P. Gilbert, 1979; G. Klincsek, "Minimal triangulations of polygonal
domains", 1980). Others, such as faces with isolated points, are small set-partitioning programs.

What is decided here by floating point is decided on the safe side: an edge is struck out only where the inequality is
proven with all rounding errors, so ties and near-ties stay. Which triangles are empty is decided exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.errors import InputError, TooLargeError
from bcut.geometry.boundary import lie_in_boundary
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.determinants import orientation_signs
from bcut.geometry.plane import PlanePoints
from bcut.geometry.subsets import ranks

#: Base angle of the two triangles; a little less than pi/4.6 asks for a little less.
BASE_ANGLE = pi / 4.6 * (1 - 1e-9)
# Neighbours that are looked at first, and those for points that they do not settle.
_NEIGHBOURS, _MORE_NEIGHBOURS = 48, 256
# Edges and triangles of this many points on a circle, say, no longer fit.
_MOST_EDGES, _MOST_TRIANGLES = 10_000_000, 20_000_000


def diamond_edges(configuration: PointConfiguration) -> NDArray[np.int64]:
    """Return the edges that pass the diamond test.

    Parameters
    ----------
    configuration : PointConfiguration
        Of dimension 2.

    Returns
    -------
    ndarray of int64, shape (m, 2)
        Ascending vertices, in lexicographic order: all pairs but those that are proven to be in no minimum weight
        triangulation. Pairs with a third point between them may be among them.

    Raises
    ------
    InputError
        The points do not lie in the plane.
    TooLargeError
        The edges are too many.
    """
    from scipy.spatial import cKDTree

    from bcut.geometry import _diamond_kernels as kernels

    _check_plane(configuration)
    n, plane = configuration.n, PlanePoints.of(configuration)
    points, delta = plane.points, plane.delta
    tree = cKDTree(points)
    found: list[NDArray[np.int64]] = []
    who, neighbours, limits = (
        np.arange(n),
        np.empty((n, 0), dtype=np.int64),
        np.empty((n, kernels.DIRECTIONS, 2)),
    )
    for wanted in (_NEIGHBOURS, _MORE_NEIGHBOURS):
        count = min(wanted, n)
        neighbours = tree.query(points[who], count)[1].astype(np.int64).reshape(len(who), count)
        limits = np.empty((len(who), kernels.DIRECTIONS, 2))
        finished, codes = np.empty(len(who), dtype=bool), np.empty(len(who) * count, dtype=np.int64)
        size = kernels.near_diamonds(
            points, delta, who, neighbours, count == n, BASE_ANGLE, limits, finished, codes
        )
        found.append(np.unique(codes[:size]))
        who, neighbours, limits = who[~finished], neighbours[~finished], limits[~finished]
        if not len(who):
            break

    def far(room: NDArray[np.int64]) -> int:
        return int(kernels.far_diamonds(points, delta, who, neighbours, BASE_ANGLE, limits, room))

    what = f"{configuration.name}: edges that may be in a minimum weight triangulation"
    found.append(_filled(far, room=1 << 20, most=_MOST_EDGES, what=what))
    codes = np.unique(np.concatenate(found))
    return np.stack((codes // n, codes % n), axis=1)


def all_pairs(configuration: PointConfiguration) -> NDArray[np.int64]:
    """Return all pairs of points, shape (n (n - 1) / 2, 2): what is left without a diamond test."""
    _check_plane(configuration)
    return np.stack(np.triu_indices(configuration.n, 1), axis=1).astype(np.int64)


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The LMT-skeleton, and what may be added to it.

    Attributes
    ----------
    possible : ndarray of int64, shape (m, 2)
        Edges that every minimum weight triangulation takes its edges from; ascending, in lexicographic order.
    is_certain : ndarray of bool, shape (m,)
        Which of them are in every minimum weight triangulation.
    triangles : ndarray of int64, shape (t, 3)
        All empty triangles with edges in `possible`; ascending vertices, in colexicographic order.
    edge_sides : ndarray of int64, shape (t, 3)
        Twice the number of the edge opposite to each vertex, plus 1 where the triangle lies to its right.
    crossing_group : ndarray of int64, shape (m,)
        The same number for edges that cross, directly or through others.
    triangles_before : int
        The number of empty triangles before edges were struck out.
    """

    possible: NDArray[np.int64]
    is_certain: NDArray[np.bool_]
    triangles: NDArray[np.int64]
    edge_sides: NDArray[np.int64]
    crossing_group: NDArray[np.int64]
    triangles_before: int

    @property
    def certain(self) -> NDArray[np.int64]:
        """The edges that are in every minimum weight triangulation, shape (k, 2)."""
        return self.possible[self.is_certain]

    @cached_property
    def sides(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """For each side of an edge, where its triangles begin, and these: three times the number, plus the vertex."""
        return triangles_by_side(self.edge_sides, len(self.possible))

    def faces(self) -> tuple[int, NDArray[np.int64]]:
        """Group the triangles by the faces of the certain edges.

        Returns
        -------
        int
            The number of faces.
        ndarray of int64, shape (t,)
            The face of each triangle.

        Notes
        -----
        Triangles with a common uncertain edge lie in the same face, and so do triangles with edges that cross. All
        triangles of a face are connected in this way: let T be a triangulation with edges in E. Its triangles in the
        face are connected across its edges there. A further triangle has an uncertain edge in the face, which is in T
        or crosses an edge of T.
        """
        import scipy.sparse as sp
        from scipy.sparse.csgraph import connected_components

        t, edges = len(self.triangles), self.edge_sides // 2
        row, position = np.nonzero(~self.is_certain[edges])
        # One graph of triangles and groups of edges.
        column = t + self.crossing_group[edges[row, position]]
        size = t + len(self.possible)
        graph = sp.coo_matrix((np.ones(len(row), dtype=np.int8), (row, column)), shape=(size, size))
        labels = connected_components(graph, directed=False)[1][:t]
        faces, face_of = np.unique(labels, return_inverse=True)
        return len(faces), face_of.reshape(-1).astype(np.int64)


def lmt_skeleton(
    configuration: PointConfiguration, edges: NDArray[np.integer[Any]] | None = None
) -> Skeleton:
    """Strike out edges that are in no locally minimal triangulation, and tell which of the rest are certain.

    Parameters
    ----------
    configuration : PointConfiguration
        Of dimension 2.
    edges : ndarray of int, shape (m, 2), optional
        Ascending vertices; contains every edge of every minimum weight triangulation. `diamond_edges` if left out.

    Raises
    ------
    InputError
        The points do not lie in the plane.
    TooLargeError
        The triangles are too many.
    """
    from bcut.geometry import _elimination_kernels as kernels

    _check_plane(configuration)
    given = diamond_edges(configuration) if edges is None else np.asarray(edges, dtype=np.int64)
    given = given[np.lexsort((given[:, 1], given[:, 0]))]
    plane = PlanePoints.of(configuration)
    triangles, signs, opposite = _empty_triangles(configuration, plane, given)
    # Seen from the edge between the first and the last vertex, the orientation is the other way around.
    to_the_right = (signs[:, None] * np.array([1, -1, 1], dtype=np.int8)) < 0
    edge_sides = 2 * opposite + to_the_right
    starts, members = triangles_by_side(edge_sides, len(given))
    on_hull = lie_in_boundary(configuration, given)
    edge_lives, lives = np.ones(len(given), dtype=bool), np.ones(len(triangles), dtype=bool)
    kernels.keep_locally_minimal(
        plane.points, plane.delta, given, on_hull, triangles, edge_sides, starts, members, edge_lives, lives
    )
    number = np.cumsum(edge_lives) - 1
    kept = 2 * number[edge_sides[lives] // 2] + edge_sides[lives] % 2
    possible = given[edge_lives]
    crossed, groups = _crossing_groups(configuration, plane, possible)
    return Skeleton(possible, ~crossed, triangles[lives], kept, groups, len(triangles))


def triangles_by_side(
    edge_sides: NDArray[np.int64], edges: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Sort triangles by the sides of edges that they lie on.

    Parameters
    ----------
    edge_sides : ndarray of int64, shape (t, 3)
    edges : int
        Their number.

    Returns
    -------
    starts : ndarray of int64, shape (2 * edges + 1,)
    members : ndarray of int64, shape (3 * t,)
        Places in `edge_sides`, flattened.
    """
    flat = edge_sides.reshape(-1)
    starts = np.zeros(2 * edges + 1, dtype=np.int64)
    np.cumsum(np.bincount(flat, minlength=2 * edges), out=starts[1:])
    return starts, np.argsort(flat, kind="stable")


def _check_plane(configuration: PointConfiguration) -> None:
    if configuration.dimension != 2:
        raise InputError(
            f"{configuration.name}: edges of minimum weight triangulations are eliminated in the plane only, and this "
            f"configuration has dimension {configuration.dimension}"
        )


def _empty_triangles(
    configuration: PointConfiguration, plane: PlanePoints, edges: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int8], NDArray[np.int64]]:
    """Return the empty triangles with given edges, their orientations, and the edges opposite to their vertices."""
    from bcut.geometry import _elimination_kernels as kernels

    n = configuration.n
    starts = np.searchsorted(edges[:, 0], np.arange(n + 1))
    heads = np.ascontiguousarray(edges[:, 1])
    nothing = np.empty((0, 3), dtype=np.int64)
    count = kernels.closed_triples(starts, heads, nothing, nothing)
    if count > _MOST_TRIANGLES:
        raise _too_large(f"{configuration.name}: triangles of edges that are left", count, _MOST_TRIANGLES)
    triples, opposite = np.empty((count, 3), dtype=np.int64), np.empty((count, 3), dtype=np.int64)
    kernels.closed_triples(starts, heads, triples, opposite)
    signs = orientation_signs(configuration, triples)
    proper = np.flatnonzero(signs)
    order = proper[np.argsort(ranks(triples[proper], n), kind="stable")]
    triples, signs, opposite = triples[order], signs[order], opposite[order]
    tree = _tree(plane.points, plane.points)
    occupied = np.empty(len(triples), dtype=bool)
    doubts = _filled(
        lambda room: kernels.find_points_inside(
            plane.points, plane.delta, triples, signs, *tree, occupied, room
        ),
        room=1 << 12,
        most=_MOST_TRIANGLES,
        what=f"{configuration.name}: points near triangles",
        width=2,
    )
    inside = _lie_inside(configuration, triples[doubts[:, 0]], signs[doubts[:, 0]], doubts[:, 1])
    occupied[doubts[inside, 0]] = True
    return triples[~occupied], signs[~occupied], opposite[~occupied]


def _lie_inside(
    configuration: PointConfiguration,
    triangles: NDArray[np.int64],
    signs: NDArray[np.int8],
    points: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Tell exactly which points lie in the closed triangles."""
    inside = np.ones(len(triangles), dtype=bool)
    for position in range(3):
        moved = triangles.copy()
        moved[:, position] = points
        inside &= orientation_signs(configuration, moved) * signs >= 0
    return inside


def _crossing_groups(
    configuration: PointConfiguration, plane: PlanePoints, edges: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Tell exactly which edges are crossed, and number the groups of edges that cross, directly or through others."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    from bcut.geometry import _elimination_kernels as kernels

    m, ends = len(edges), plane.points[edges]
    tree = _tree(ends.min(axis=1), ends.max(axis=1))
    crossed, parents = np.zeros(m, dtype=bool), np.arange(m)
    pairs = _filled(
        lambda room: kernels.find_crossings(plane.points, plane.delta, edges, *tree, parents, crossed, room),
        room=1 << 16,
        most=_MOST_TRIANGLES,
        what=f"{configuration.name}: edges that nearly touch",
        width=2,
    )
    one, other = edges[pairs[:, 0]], edges[pairs[:, 1]]
    cross = np.ones(len(pairs), dtype=bool)
    for line, far in ((one, other), (other, one)):
        sides = [
            orientation_signs(configuration, np.concatenate((line, far[:, [k]]), axis=1)) for k in range(2)
        ]
        cross &= sides[0] * sides[1] < 0
    crossed[pairs[cross].reshape(-1)] = True
    first, second = (
        np.concatenate((np.arange(m), pairs[cross, 0])),
        np.concatenate((parents, pairs[cross, 1])),
    )
    graph = sp.coo_matrix((np.ones(len(first), dtype=np.int8), (first, second)), shape=(m, m))
    return crossed, connected_components(graph, directed=False)[1].astype(np.int64)


def _tree(
    lows: NDArray[np.float64], highs: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    from bcut.geometry import _elimination_kernels as kernels

    m = len(lows)
    order, boxes = np.empty(m, dtype=np.int64), np.empty((2 * m + 1, 4))
    ranges = np.zeros((2 * m + 1, 3), dtype=np.int64)
    kernels.box_tree(np.ascontiguousarray(lows), np.ascontiguousarray(highs), order, boxes, ranges)
    return order, boxes, ranges


def _filled(fill: Any, *, room: int, most: int, what: str, width: int = 0) -> NDArray[np.int64]:
    """Call a kernel that fills an array, again with more room where the first one was too small."""
    shape = (width,) if width else ()
    found = np.empty((room, *shape), dtype=np.int64)
    count = fill(found)
    if count > most:
        raise _too_large(what, count, most)
    if count > room:
        found = np.empty((count, *shape), dtype=np.int64)
        count = fill(found)
    return found[:count]


def _too_large(what: str, count: int, most: int) -> TooLargeError:
    return TooLargeError(f"{what}: there are {count:,}, more than {most:,}; take fewer points")

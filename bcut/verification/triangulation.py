"""Is it a triangulation? Exact checks of a list of simplices against its points, and nothing else.

Let A be points that span the space, and S a set of d-simplices with vertices in A. S is a triangulation of
A if and only if

1. every facet F of a simplex of S belongs either to exactly one more simplex of S, which lies on the other
   side of F, or to no other one, and then all points of A lie on one side of F;
2. some point in the interior of a simplex of S lies in no other simplex of S.

(Compare the characterisations of triangulations in De Loera, Rambau, Santos, "Triangulations", Springer
2010, Sec. 4.5.) Why this is enough:

Let a point move inside the hull along a path that misses all faces of dimension d - 2. Wherever it passes
through facets of simplices of S, by 1 each of them has one simplex on either side, one of which is left and
one entered. So the number of simplices over the point never changes, and by 2 it is one: the interiors are
disjoint, and S covers the hull.

Now let q be a point of the hull, in the relative interior of the face G of some simplex t of S. A simplex
next to t across a facet through q contains G, because that facet does, and has q in the relative interior
of its face G too. From neighbour to neighbour around q one reaches all simplices that contain q: what has
been reached fills a neighbourhood of q in the hull, since by 1 it has no boundary inside. So q lies in the
relative interior of the same face of all simplices that contain it. Hence any two simplices meet in a
common face.

That the volumes add up to the hull's then follows. It is checked all the same, against a hull that is
constructed independently: an error in one of the two computations does not go unnoticed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from operator import index
from typing import Any

from bcut.errors import VerificationError
from bcut.geometry.numbers import AlgebraicNumber
from bcut.verification.exact_points import ExactPoints, Hyperplane, Scalar, Simplex, without
from bcut.verification.hull import hull_volume

# How many defects of one kind a message names.
_NAMED = 3


@dataclass(frozen=True)
class TriangulationReport:
    """What is known of a verified triangulation.

    Attributes
    ----------
    simplices : tuple of tuple of int
        Ascending vertices, in ascending order.
    volume : Fraction or AlgebraicNumber
        Of the simplices together, and of the hull.
    unused : tuple of int
        Points that are no vertices of the triangulation.
    boundary_facets : int
        Number of (d-1)-simplices on the boundary of the hull.
    """

    simplices: tuple[Simplex, ...]
    volume: Fraction | AlgebraicNumber
    unused: tuple[int, ...]
    boundary_facets: int


def check_triangulation(
    points: ExactPoints | Sequence[Sequence[Scalar]],
    simplices: Iterable[Sequence[int]],
    *,
    spanning: bool = False,
) -> TriangulationReport:
    """Check exactly that simplices triangulate the convex hull of points, face to face.

    Parameters
    ----------
    points : ExactPoints, or a sequence of n sequences of d exact scalars
        Integers, `Fraction` or `AlgebraicNumber`, d >= 2. Each vertex of the hull must be among them once.
    simplices : iterable of sequences of d + 1 vertex indices
        In any order.
    spanning : bool
        Whether every point has to be a vertex of the triangulation.

    Returns
    -------
    TriangulationReport

    Raises
    ------
    VerificationError
        With the first reason found, which names the simplices, facets or points.
    """
    exact = points if isinstance(points, ExactPoints) else ExactPoints(points)
    listed = listed_simplices(simplices, exact)
    check = _Check(exact, listed)
    check.flatness()
    check.facets()
    check.overlap()
    check.volume()
    used = {vertex for simplex in listed for vertex in simplex}
    unused = tuple(vertex for vertex in range(exact.n) if vertex not in used)
    if spanning and unused:
        raise VerificationError(
            f"not spanning: {len(unused)} of {exact.n} points are in no simplex, {_named(unused)}, "
            "but the problem asks for triangulations that use every point"
        )
    return TriangulationReport(
        tuple(sorted(listed)), check.total * exact.volume_unit, unused, check.boundary_facets
    )


def listed_simplices(simplices: Iterable[Sequence[int]], points: ExactPoints) -> list[Simplex]:
    """Return the simplices with ascending vertices, once they are known to be sets of points, none twice."""
    size, last = points.dimension + 1, points.n - 1
    first: dict[Simplex, int] = {}
    for number, given in enumerate(simplices):
        vertices = tuple(sorted(index(vertex) for vertex in given))
        where = f"simplex {number}, {list(given)}"
        if len(vertices) != size:
            raise VerificationError(f"{where}: it has {len(vertices)} vertices, not {size}")
        for vertex in vertices:
            if not 0 <= vertex <= last:
                raise VerificationError(
                    f"{where}: there is no point {vertex}; points are numbered from 0 to {last}"
                )
        if len(set(vertices)) != size:
            twice = next(a for a, b in pairwise(vertices) if a == b)
            raise VerificationError(f"{where}: vertex {twice} occurs twice")
        if vertices in first:
            raise VerificationError(f"{where}: it is in the list twice, as simplex {first[vertices]} already")
        first[vertices] = number
    if not first:
        raise VerificationError("there are no simplices")
    return list(first)


class _Check:
    """The geometric checks, in the order in which their reasons help most."""

    def __init__(self, points: ExactPoints, simplices: list[Simplex]) -> None:
        self.points, self.simplices = points, simplices
        self.planes: dict[Simplex, Hyperplane] = {}
        self.total: Any = 0
        self.boundary_facets = 0
        self._hull: Any = None

    @property
    def hull(self) -> Any:
        """The volume of the hull, in the units of the points."""
        if self._hull is None:
            self._hull = hull_volume(self.points, self.simplices[0])
        return self._hull

    def _plane(self, facet: Simplex) -> Hyperplane:
        found = self.planes.get(facet)
        if found is None:
            found = self.planes[facet] = self.points.hyperplane(facet)
        return found

    def flatness(self) -> None:
        """Refuse simplices without volume."""
        for number, simplex in enumerate(self.simplices):
            volume = abs(self.points.value(self._plane(simplex[:-1]), simplex[-1]))
            if not volume:
                raise VerificationError(
                    f"simplex {number}, {list(simplex)}, is flat: "
                    f"its {len(simplex)} vertices lie in a common hyperplane"
                )
            self.total = self.total + volume

    def facets(self) -> None:
        """Refuse facets with two simplices on one side, and facets inside the hull with just one simplex."""
        overlaps: list[str] = []
        lonely: list[str] = []
        for facet, opposite in self._opposite_vertices().items():
            plane = self._plane(facet)
            by_side: dict[int, list[int]] = {}
            for vertex in opposite:
                by_side.setdefault(self.points.side(plane, vertex), []).append(vertex)
            for vertices in by_side.values():
                if len(vertices) > 1:
                    pair = " and ".join(str(sorted((*facet, vertex))) for vertex in vertices[:2])
                    overlaps.append(f"{pair} lie on the same side of their common facet {list(facet)}")
            if len(opposite) == 1:
                beyond = self._point_beyond(plane, next(iter(by_side)))
                if beyond is None:
                    self.boundary_facets += 1
                else:
                    owner = sorted((*facet, opposite[0]))
                    lonely.append(f"facet {list(facet)} of {owner} (point {beyond} is on its other side)")
        if overlaps:
            raise VerificationError(f"simplices overlap: {_first(overlaps)}; {self._volume_share()}")
        if lonely:
            belong = "a facet belongs" if len(lonely) == 1 else f"{len(lonely)} facets belong"
            raise VerificationError(
                f"inside the hull {belong} to one simplex only, with no partner on the other side: "
                f"{_first(lonely)}; {self._volume_share()}"
            )

    def overlap(self) -> None:
        """Refuse a second simplex over the barycentre of the first one, once all facets are matched."""
        points, first = self.points, self.simplices[0]
        for simplex in self.simplices[1:]:
            for position, vertex in enumerate(simplex):
                plane = self.planes[without(simplex, position)]
                if points.side_of_sum(plane, first) == -points.side(plane, vertex):
                    break
            else:
                raise VerificationError(
                    f"simplices overlap: the barycentre of {list(first)} lies in {list(simplex)} too; "
                    f"{self._volume_share()}"
                )

    def volume(self) -> None:
        """Refuse simplices whose volumes do not add up to the hull's."""
        if self.total != self.hull:
            raise VerificationError(f"the volumes do not add up: {self._volume_share()}")

    def _opposite_vertices(self) -> dict[Simplex, list[int]]:
        opposite: dict[Simplex, list[int]] = {}
        for simplex in self.simplices:
            for position, vertex in enumerate(simplex):
                opposite.setdefault(without(simplex, position), []).append(vertex)
        return opposite

    def _point_beyond(self, plane: Hyperplane, side: int) -> int | None:
        return next(
            (point for point in range(self.points.n) if self.points.side(plane, point) == -side), None
        )

    def _volume_share(self) -> str:
        """Say how the volumes compare with the hull's, and what follows."""
        return volume_share(self.total, self.hull)


def volume_share(total: Any, hull: Any) -> str:
    """Say how the volumes of simplices compare with that of the hull, and what follows."""
    share = total / hull if isinstance(hull, AlgebraicNumber) else Fraction(total, hull)
    if share == 1:
        return "their volumes add up to the hull's, so some overlap or do not meet face to face"
    if share > 1:
        return f"their volumes add up to {_share_text(share)} of the hull's, so some overlap"
    missing = _share_text(1 - share)
    return f"their volumes add up to {_share_text(share)} of the hull's: {missing} is missing"


def _share_text(share: Fraction | AlgebraicNumber) -> str:
    if isinstance(share, Fraction) and share.denominator <= 10**6:
        return str(share)
    return f"{float(share):.6g}"


def _first(defects: list[str]) -> str:
    more = f"; and {len(defects) - _NAMED} more" if len(defects) > _NAMED else ""
    return "; ".join(defects[:_NAMED]) + more


def _named(points: Sequence[int]) -> str:
    text = ", ".join(map(str, points[:10]))
    return f"{text}, ..." if len(points) > 10 else text

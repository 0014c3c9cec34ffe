"""Is it a dissection? Exact checks that simplices do not overlap and together have the hull's volume.

A dissection covers the hull with simplices whose interiors are disjoint, which need not meet face to face. Every
triangulation is one. Two simplices have disjoint interiors exactly when some hyperplane through d of their vertices has
one of them in each of its closed half-spaces: the affine functions that are >= 0 on the one and <= 0 on the other form
a pointed cone, and its extreme rays vanish on d affinely independent vertices.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import Any

from bcut.errors import VerificationError
from bcut.verification.exact_points import ExactPoints, Scalar, SideTable, Simplex, mask_of, without
from bcut.verification.hull import hull_volume
from bcut.verification.triangulation import TriangulationReport, listed_simplices, volume_share


def check_dissection(
    points: ExactPoints | Sequence[Sequence[Scalar]],
    simplices: Iterable[Sequence[int]],
    *,
    spanning: bool = False,
) -> TriangulationReport:
    """Check exactly that simplices dissect the convex hull of points.

    Parameters
    ----------
    points : ExactPoints, or a sequence of n sequences of d exact scalars
    simplices : iterable of sequences of d + 1 vertex indices
        In any order.
    spanning : bool
        Whether no simplex may contain a point of the configuration besides its vertices.

    Returns
    -------
    TriangulationReport
        Its `boundary_facets` are the facets of the simplices that lie on the boundary of the hull.

    Raises
    ------
    VerificationError
        With the first reason found, which names the simplices.
    """
    exact = points if isinstance(points, ExactPoints) else ExactPoints(points)
    listed = listed_simplices(simplices, exact)
    sides = SideTable(exact)
    total: Any = 0
    for number, simplex in enumerate(listed):
        if not sides.orientation(simplex):
            raise VerificationError(f"simplex {number}, {list(simplex)}, is flat")
        total = total + exact.volume(simplex)
        if spanning:
            _check_empty(sides, simplex)
    for first, second in combinations(listed, 2):
        if overlap(sides, first, second):
            raise VerificationError(
                f"simplices overlap: {list(first)} and {list(second)} have a common interior point"
            )
    hull = hull_volume(exact, listed[0])
    if total != hull:
        raise VerificationError(f"the volumes do not add up: {volume_share(total, hull)}")
    used = {vertex for simplex in listed for vertex in simplex}
    unused = tuple(vertex for vertex in range(exact.n) if vertex not in used)
    facets = [without(simplex, position) for simplex in listed for position in range(len(simplex))]
    boundary = sum(not all(sides[facet]) for facet in facets)
    return TriangulationReport(tuple(sorted(listed)), total * exact.volume_unit, unused, boundary)


def overlap(sides: SideTable, first: Simplex, second: Simplex) -> bool:
    """Tell whether two different d-simplices have a common interior point."""
    one, other = mask_of(first), mask_of(second)
    own = {without(simplex, position) for simplex in (first, second) for position in range(len(simplex))}
    union = sorted({*first, *second})
    # The hyperplanes of their own facets separate most pairs that can be separated.
    for facet in (*own, *(f for f in combinations(union, sides.points.dimension) if f not in own)):
        plus, minus = sides[facet]
        if (plus or minus) and (
            (not one & minus and not other & plus) or (not one & plus and not other & minus)
        ):
            return False
    return True


def _check_empty(sides: SideTable, simplex: Simplex) -> None:
    inside = (1 << sides.points.n) - 1
    for position, vertex in enumerate(simplex):
        plus, minus = sides[without(simplex, position)]
        inside &= ~(minus if plus >> vertex & 1 else plus)
    others = inside & ~mask_of(simplex)
    if others:
        raise VerificationError(
            f"not spanning: {list(simplex)} contains the point {(others & -others).bit_length() - 1}, but the problem "
            "asks for simplices without further points in them"
        )

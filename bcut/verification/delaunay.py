"""Exact check that a triangulation is Delaunay's: no point lies inside the sphere through the vertices of a simplex.

Lift every point p to the height |p|^2. A point lies inside the sphere through d + 1 others if and only if its lifted
point is below the hyperplane through theirs. So a triangulation with all points as vertices is Delaunay's if and only
if its lifted surface is convex, and for that it is enough that it is convex at every inner facet (see
`bcut.verification.regularity`). Where a fold is flat, d + 2 points lie on a common sphere, and there are other Delaunay
triangulations.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from bcut.errors import VerificationError
from bcut.verification.exact_points import ExactPoints, Scalar
from bcut.verification.regularity import folds
from bcut.verification.triangulation import check_triangulation


def check_delaunay(points: Sequence[Sequence[Scalar]], simplices: Iterable[Sequence[int]]) -> None:
    """Check exactly that simplices are a Delaunay triangulation of points.

    Parameters
    ----------
    points : sequence of n sequences of d exact scalars
        `Fraction` or `AlgebraicNumber`, d >= 2.
    simplices : iterable of sequences of d + 1 vertex indices

    Raises
    ------
    VerificationError
        They are no triangulation with all points as vertices, or some point is inside the sphere through a simplex.
    """
    exact = ExactPoints(points)
    report = check_triangulation(exact, simplices, spanning=True)
    heights = [_squared_length(point) for point in points]
    for fold in folds(exact, report.simplices):
        if fold.at(heights) < 0:
            raise VerificationError(
                f"the sphere through a simplex with the facet {list(fold.facet)} contains the vertex beyond that facet"
            )


def _squared_length(point: Sequence[Any]) -> Any:
    return sum((x * x for x in point[1:]), point[0] * point[0])

"""Checker of convex polygon cuts: b points on the boundary of their convex hull have room for b - 2 triangles."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from bcut.errors import VerificationError
from bcut.verification.cut_data import CertificateCut, candidates_of
from bcut.verification.exact_points import SideTable, mask_of


def check_convex_polygon(sides: SideTable, cut: CertificateCut) -> Fraction:
    """Check that the points lie on the boundary of their hull, and that all triangles of the cut have vertices there.

    The triangles of a triangulation with vertices among b such points overlap nowhere, so at each point their angles
    fit into the angle of the polygon, which adds up to pi (b - 2) over all points, flat ones included; each triangle
    takes pi of it.

    Returns
    -------
    Fraction
        The right-hand side that follows, b - 2 times the largest coefficient.

    Raises
    ------
    VerificationError
        The proof lacks something or does not hold, or less follows than the cut says.
    """
    points = sides.points
    if points.dimension != 2:
        raise VerificationError("convex-polygon cut: it belongs to the plane")
    value: Any = cut.proof.get("polygon")
    if not isinstance(value, list) or not all(type(v) is int and 0 <= v < points.n for v in value):
        raise VerificationError("convex-polygon cut: its proof names no polygon")
    polygon = sorted(set(value))
    if len(polygon) < 3 or len(polygon) != len(value):
        raise VerificationError(f"convex-polygon cut: {value} is no list of three or more different points")
    members = mask_of(polygon)
    for point in polygon:
        lines = [sides[min(point, other), max(point, other)] for other in polygon if other != point]
        if not any(not plus & members or not minus & members for plus, minus in lines):
            raise VerificationError(f"convex-polygon cut: point {point} lies inside the hull of the others")
    candidates = candidates_of(sides)
    for simplex, coefficient in zip(cut.simplices, cut.coefficients, strict=True):
        if coefficient > 0 and (mask_of(simplex) & ~members or not candidates.orientation(simplex)):
            raise VerificationError(
                f"convex-polygon cut: {list(simplex)} is no triangle with vertices in its polygon"
            )
    rhs = max(Fraction(0), *cut.coefficients) * (len(polygon) - 2)
    if rhs > cut.rhs:
        raise VerificationError(
            f"convex-polygon cut: its right-hand side is {cut.rhs}, but {rhs} is all that {len(polygon)} points give"
        )
    return rhs

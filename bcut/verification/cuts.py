"""Checkers for the cuts that a certificate uses, by family.

A checker is shown the cut and an oracle for exact sides, and raises `VerificationError` unless every
triangulation satisfies the cut. To have the cuts of another family re-checked, write a function below and
register it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any

from bcut.errors import VerificationError
from bcut.verification.exact_points import SideTable, Simplex, without


@dataclass(frozen=True)
class CertificateCut:
    """The inequality ``sum of coefficients[i] * x[simplices[i]] <= rhs`` and its multiplier.

    Attributes
    ----------
    family : str
        The name of the separator that made it.
    simplices : tuple of tuple of int
        Ascending vertices, none twice.
    coefficients : tuple of Fraction
    rhs : Fraction
    multiplier : Fraction
        For the minimisation of ``sign * costs``: not positive.
    proof : mapping
        What the family offers as a reason.
    """

    family: str
    simplices: tuple[Simplex, ...]
    coefficients: tuple[Fraction, ...]
    rhs: Fraction
    multiplier: Fraction
    proof: Mapping[str, Any]


Checker = Callable[[SideTable, CertificateCut], None]

CUT_CHECKERS: dict[str, Checker] = {}


def cut_checker(family: str) -> Callable[[Checker], Checker]:
    """Register the checker of a family of cuts."""

    def register(function: Checker) -> Checker:
        CUT_CHECKERS[family] = function
        return function

    return register


@cut_checker("clique")
def check_clique(sides: SideTable, cut: CertificateCut) -> None:
    """Check that at most one of the simplices is in a triangulation, and that none alone violates the cut."""
    for simplex in cut.simplices:
        if not sides.orientation(simplex):
            raise VerificationError(f"clique cut: {list(simplex)} is flat, so it is no candidate")
    for first, second in combinations(cut.simplices, 2):
        if not cross(sides, first, second):
            raise VerificationError(
                f"clique cut: {list(first)} and {list(second)} meet in a common face, "
                "so a triangulation may contain both"
            )
    if max(Fraction(0), *cut.coefficients) > cut.rhs:
        raise VerificationError(
            f"clique cut: one simplex alone can exceed its right-hand side {cut.rhs}: "
            f"the largest coefficient is {max(cut.coefficients)}"
        )


def cross(sides: SideTable, first: Simplex, second: Simplex) -> bool:
    """Tell whether two d-simplices do not meet in a common (possibly empty) face.

    They do not if and only if there is a circuit (Z+, Z-), a minimal affine dependence, with Z+ in `first`
    and Z- in `second`: its two parts are disjoint faces whose relative interiors meet. Since `first` is
    full-dimensional, Z extends, within the vertices of both, to d + 2 points that span the space, whose one
    dependence it is; so it is enough to look at those (d+2)-subsets. Cramer's rule gives the signs of the
    dependence.
    """
    union = sorted({*first, *second})
    in_first, in_second = set(first), set(second)
    for points in combinations(union, sides.points.dimension + 2):
        signs = [
            sides.orientation(without(points, position)) * (-1 if position & 1 else 1)
            for position in range(len(points))
        ]
        if not any(signs):
            continue
        for direction in (1, -1):
            plus = {point for point, sign in zip(points, signs, strict=True) if sign == direction}
            minus = {point for point, sign in zip(points, signs, strict=True) if sign == -direction}
            if plus <= in_first and minus <= in_second:
                return True
    return False

"""Checkers of cuts, by family.

A checker is shown exact sides, with the candidate simplices where those are restricted (`Candidates`), and a cut. It
returns the right-hand side that follows from the proof, and raises `VerificationError` where that is more than the
cut's: then some triangulation may violate it. Where that cannot be told within reasonable time, it raises
`UncheckedError`. It shares nothing with the separator that made the cut. To have the cuts of another family re-checked,
write such a function and register it.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from bcut.verification.crossing_cuts import check_clique, check_odd_cycle
from bcut.verification.cut_data import Candidates, CertificateCut, UncheckedError, cross
from bcut.verification.exact_points import SideTable
from bcut.verification.face_cuts import check_face_crossing
from bcut.verification.link_cuts import check_link
from bcut.verification.parity_cuts import check_parity
from bcut.verification.polygon_cuts import check_convex_polygon
from bcut.verification.sphere_cuts import check_sphere

Checker = Callable[[SideTable, CertificateCut], Fraction]

CUT_CHECKERS: dict[str, Checker] = {
    "clique": check_clique,
    "odd-cycle": check_odd_cycle,
    "link": check_link,
    "convex-polygon": check_convex_polygon,
    "parity": check_parity,
    "face-crossing": check_face_crossing,
    "sphere": check_sphere,
}

__all__ = [
    "CUT_CHECKERS",
    "Candidates",
    "CertificateCut",
    "Checker",
    "UncheckedError",
    "check_clique",
    "cross",
    "cut_checker",
]


def cut_checker(family: str) -> Callable[[Checker], Checker]:
    """Register the checker of a family of cuts."""

    def register(function: Checker) -> Checker:
        CUT_CHECKERS[family] = function
        return function

    return register

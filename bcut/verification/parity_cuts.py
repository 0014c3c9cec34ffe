"""Checker of parity cuts: sums, modulo 2, of how many simplices of a triangulation meet at (d-1)-simplices."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations, pairwise
from typing import Any

from bcut.errors import VerificationError
from bcut.verification.cut_data import Candidates, CertificateCut, candidates_of, covers
from bcut.verification.exact_points import SideTable, Simplex


def check_parity(sides: SideTable, cut: CertificateCut) -> Fraction:
    """Check that a triangulation contains a number of simplices of the other parity.

    The proof names (d-1)-simplices with points strictly on both sides, at each of which a triangulation has none or two
    simplices, and perhaps a flag, whose generic point is in exactly one. The candidates that are counted an odd number
    of times have to be those of the cut, with coefficients 1 for an F whose size has the wrong parity, -1 for others.

    Returns
    -------
    Fraction
        The right-hand side that follows, ``|F| - 1``.

    Raises
    ------
    VerificationError
        The proof lacks something or does not hold, or less follows than the cut says.
    """
    candidates = candidates_of(sides)
    odd, parity = _odd_candidates(candidates, cut)
    if odd != set(cut.simplices):
        other = min(odd ^ set(cut.simplices))
        where = "is not among" if other in odd else "is no odd one, but among"
        raise VerificationError(f"parity cut: {list(other)} {where} the simplices of the cut")
    if not all(abs(coefficient) == 1 for coefficient in cut.coefficients):
        raise VerificationError("parity cut: its coefficients are 1 and -1 only")
    size = sum(coefficient == 1 for coefficient in cut.coefficients)
    if size % 2 == parity:
        raise VerificationError(
            f"parity cut: triangulations contain an {'odd' if parity else 'even'} number of its simplices, "
            f"so {size} of them are not forbidden"
        )
    if size - 1 > cut.rhs:
        raise VerificationError(f"parity cut: {size - 1} is proven, but its right-hand side is {cut.rhs}")
    return Fraction(size - 1)


def _odd_candidates(candidates: Candidates, cut: CertificateCut) -> tuple[set[Simplex], int]:
    """Return the candidates that the rows of the proof count an odd number of times, and the parity of the count."""
    n, d = candidates.points.n, candidates.points.dimension
    odd: set[Simplex] = set()
    for row in _sets(cut.proof.get("rows"), n, d, "rows"):
        plus, minus = candidates[row]
        if not (plus and minus):
            raise VerificationError(f"parity cut: {list(row)} has no points strictly on both sides")
        # A set of simplices, each of them put in or, if it is there already, taken out.
        odd ^= {
            simplex
            for point in range(n)
            if (plus | minus) >> point & 1 and (simplex := tuple(sorted((*row, point)))) in candidates
        }
    order = cut.proof.get("flag")
    if order is None:
        return odd, 0
    if not isinstance(order, list) or not all(type(v) is int for v in order):
        raise VerificationError("parity cut: its proof has no good 'flag'")
    flag = _sets([sorted(order)], n, d + 1, "flag")[0]
    if not candidates.orientation(flag):
        raise VerificationError(f"parity cut: its flag {list(flag)} lies in a hyperplane")
    covering = {
        simplex
        for simplex in combinations(range(n), d + 1)
        if simplex in candidates and covers(candidates, simplex, tuple(order))
    }
    return odd ^ covering, 1


def _sets(value: Any, n: int, size: int, what: str) -> list[Simplex]:
    """Read a list of ascending sets of points."""
    good = isinstance(value, list) and all(
        isinstance(entry, list)
        and len(entry) == size
        and all(type(v) is int and 0 <= v < n for v in entry)
        and all(a < b for a, b in pairwise(entry))
        for entry in value
    )
    if not good:
        raise VerificationError(f"parity cut: its proof has no good '{what}'")
    return [tuple(entry) for entry in value]

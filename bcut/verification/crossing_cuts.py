"""Checkers of cuts that follow from pairs of crossing simplices: cliques, and odd cycles with lifting."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations
from typing import Any

from bcut.errors import VerificationError
from bcut.verification.cut_data import Candidates, CertificateCut, candidates_of
from bcut.verification.exact_points import SideTable, Simplex
from bcut.verification.heavy_sets import HeavySets


def check_clique(sides: SideTable, cut: CertificateCut) -> Fraction:
    """Check that at most one of the simplices is in a triangulation, and that none alone violates the cut.

    Returns
    -------
    Fraction
        The least right-hand side that follows.

    Raises
    ------
    VerificationError
        Some pair does not cross, or less follows than the cut says.
    """
    candidates = candidates_of(sides)
    _check_not_flat(candidates, cut)
    for first, second in combinations(cut.simplices, 2):
        if not candidates.crossing(first, second):
            raise VerificationError(
                f"clique cut: {list(first)} and {list(second)} meet in a common face, "
                "so a triangulation may contain both"
            )
    least = max(Fraction(0), *cut.coefficients)
    if least > cut.rhs:
        raise VerificationError(
            f"clique cut: one simplex alone can exceed its right-hand side {cut.rhs}: "
            f"the largest coefficient is {max(cut.coefficients)}"
        )
    return least


def check_odd_cycle(sides: SideTable, cut: CertificateCut) -> Fraction:
    """Check a cycle of k crossing pairs, k odd, and the coefficients of the simplices lifted into its inequality.

    At most (k - 1) / 2 simplices of the cycle are in a triangulation. A further simplex w may get any coefficient that
    does not exceed (k - 1) / 2 minus the most that the left side before it can be on simplices which cross neither w
    nor each other: without w the inequality is the one before, and with w only such simplices are left.

    Returns
    -------
    Fraction
        The right-hand side that follows, (k - 1) / 2.

    Raises
    ------
    VerificationError
        The proof lacks something or does not hold, or less follows than the cut says.
    UncheckedError
        The coefficients take too long to check.
    """
    candidates = candidates_of(sides)
    _check_not_flat(candidates, cut)
    cycle = _simplices(cut, "cycle", sides)
    lifted = _simplices(cut, "lifted", sides)
    size = len(cycle)
    if size < 3 or size % 2 == 0:
        raise VerificationError(f"odd-cycle cut: its cycle has {size} simplices, not an odd number from 3 on")
    order = [*cycle, *lifted]
    coefficients = dict(zip(cut.simplices, cut.coefficients, strict=True))
    unexplained = [s for s, value in coefficients.items() if value > 0 and s not in set(order)]
    if len(set(order)) != len(order) or unexplained:
        raise VerificationError(
            f"odd-cycle cut: its proof does not name each of its simplices once ({unexplained[:1] or order[:1]})"
        )
    for position, simplex in enumerate(cycle):
        if not candidates.crossing(cycle[position - 1], simplex):
            raise VerificationError(
                f"odd-cycle cut: neighbours {list(cycle[position - 1])} and {list(simplex)} of its cycle do not cross"
            )
        if coefficients.get(simplex, Fraction(0)) > 1:
            raise VerificationError(
                f"odd-cycle cut: {list(simplex)} of its cycle has the coefficient {coefficients[simplex]}, above 1"
            )
    rhs = Fraction((size - 1) // 2)
    _check_lifting(candidates, order, coefficients, size, rhs)
    if rhs > cut.rhs:
        raise VerificationError(
            f"odd-cycle cut: its right-hand side is {cut.rhs}, but {rhs} is all that follows"
        )
    return rhs


def _check_lifting(
    candidates: Candidates,
    order: list[Simplex],
    coefficients: dict[Simplex, Fraction],
    size: int,
    rhs: Fraction,
) -> None:
    weights = [coefficients.get(simplex, Fraction(0)) for simplex in order]
    sets = HeavySets(weights, lambda first, second: candidates.crossing(order[first], order[second]))
    position = sets.first_excess(size, rhs)
    if position is not None:
        raise VerificationError(
            f"odd-cycle cut: the coefficient {weights[position]} of {list(order[position])} is larger than "
            "what lifting it gives"
        )


def _check_not_flat(candidates: Candidates, cut: CertificateCut) -> None:
    for simplex in cut.simplices:
        if not candidates.orientation(simplex):
            raise VerificationError(f"{cut.family} cut: {list(simplex)} is flat, so it is no candidate")


def _simplices(cut: CertificateCut, key: str, sides: SideTable) -> list[Simplex]:
    """Read a list of simplices out of a proof."""
    value: Any = cut.proof.get(key)
    n, size = sides.points.n, sides.points.dimension + 1
    if not isinstance(value, list):
        raise VerificationError(f"{cut.family} cut: its proof has no list '{key}'")
    found = []
    for entry in value:
        good = isinstance(entry, list) and all(type(v) is int and 0 <= v < n for v in entry)
        simplex = tuple(sorted(entry)) if good else ()
        if len(set(simplex)) != size or not sides.orientation(simplex):
            raise VerificationError(
                f"{cut.family} cut: '{key}' of its proof lists {entry}, which is no simplex"
            )
        found.append(simplex)
    return found

"""Checkers of cuts that follow from pairs of crossing simplices: cliques, and odd cycles with lifting."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations
from typing import Any

from bcut.errors import VerificationError
from bcut.verification.cut_data import Candidates, CertificateCut, candidates_of
from bcut.verification.exact_points import SideTable, Simplex

# A made-up proof could keep the check busy for ever; cuts of the built-in families take less than a hundred.
_MOST_STEPS = 100_000


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
    crossed = [0] * len(order)
    for later, simplex in enumerate(order):
        for earlier in range(later):
            if candidates.crossing(order[earlier], simplex):
                crossed[later] |= 1 << earlier
                crossed[earlier] |= 1 << later
    for position in range(size, len(order)):
        if weights[position] <= 0:
            continue
        compatible = ((1 << position) - 1) & ~crossed[position]
        if exceeds(compatible, crossed, weights, rhs - weights[position]):
            raise VerificationError(
                f"odd-cycle cut: the coefficient {weights[position]} of {list(order[position])} is larger than "
                "what lifting it gives"
            )


def exceeds(nodes: int, crossed: Sequence[int], weights: Sequence[Fraction], limit: Fraction) -> bool:
    """Tell whether some of the nodes that do not cross each other weigh more than a limit.

    Raises
    ------
    VerificationError
        The search takes too long: it is refused rather than believed.
    """
    open_sets = [(nodes, limit)]
    for _ in range(_MOST_STEPS):
        if not open_sets:
            return False
        free, left = open_sets.pop()
        if left < 0:
            return True
        if free:
            lowest = free & -free
            node = lowest.bit_length() - 1
            open_sets.append((free ^ lowest, left))
            if weights[node] > 0:
                open_sets.append(((free ^ lowest) & ~crossed[node], left - weights[node]))
    raise VerificationError(
        f"a cut over {len(weights)} simplices or faces takes more than {_MOST_STEPS} steps to check, and is not "
        "believed; solve again without its family"
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

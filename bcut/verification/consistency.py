"""Whether status, value, bound and gap of a result agree with each other and with the value re-computed."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import ceil, floor

from bcut.errors import VerificationError
from bcut.verification.entries import FileNumber
from bcut.verification.reading import ResultData

# Bounds that are no integers come from floating-point solvers, which stop at a relative gap of this size.
RELATIVE_GAP = Fraction(1, 10**9)

#: Returns the largest absolute value of a cost, None where it is not known; it takes long, and is rarely asked for.
LargestCost = Callable[[], Fraction | None]


def rounded(bound: Fraction, sense: str, integral: bool) -> Fraction:
    """Round a bound to the best value that it allows, where values are integral."""
    if not integral:
        return bound
    return Fraction(ceil(bound) if sense == "min" else floor(bound))


def is_better(first: Fraction, second: Fraction, sense: str) -> bool:
    """Tell whether a value is strictly better than another one."""
    return first < second if sense == "min" else first > second


def gap_entry(value: Fraction, bound: Fraction) -> Fraction:
    """Return what a result file calls the gap, ``|value - bound| / max(1, |value|)``: absolute for small values."""
    return abs(value - bound) / max(Fraction(1), abs(value))


def is_close(value: Fraction, bound: Fraction, largest: LargestCost) -> bool:
    """Tell whether value and bound differ by no more than the solvers' tolerance.

    It is relative to the value, or to the largest cost where the value is smaller than that and smaller than 1. Where
    the largest cost is not known, it is taken for 1 there. Integers that differ are close from a billion on.
    """
    difference = abs(value - bound)
    if difference <= RELATIVE_GAP * abs(value):
        return True
    if difference > RELATIVE_GAP * max(Fraction(1), abs(value)):
        return False
    cost = largest()
    return cost is None or difference <= RELATIVE_GAP * cost


def check_consistency(
    data: ResultData, value: Fraction | None, largest: LargestCost, *, integral: bool
) -> None:
    """Check what a result says of itself.

    Parameters
    ----------
    data : ResultData
    value : Fraction or None
        Of its triangulation, re-computed.
    largest : callable
    integral : bool
        Whether all values are integral.

    Raises
    ------
    VerificationError
        A contradiction.
    """
    if data.status == "infeasible" and not data.restrictions and data.invariant_under is None:
        raise VerificationError(
            "its status is 'infeasible', but every point configuration has a triangulation, "
            "and one that uses all points"
        )
    if data.status == "infeasible" and value is not None:
        raise VerificationError("its status is 'infeasible', but it contains a triangulation")
    if value is None:
        if data.status == "optimal":
            raise VerificationError("its status is 'optimal', but it contains no triangulation")
        if data.value is not None:
            raise VerificationError(
                f"it claims the value {shown(data.value.exact)}, but contains no triangulation"
            )
    elif data.value is None or not _stands_for(data.value, value):
        claim = "no value" if data.value is None else f"the value {shown(data.value.exact)}"
        raise VerificationError(f"it claims {claim}, but its triangulation has the value {shown(value)}")
    if value is not None:
        _check_bound(data, value, largest, integral)
    _check_gap(data, value)


def _check_bound(data: ResultData, value: Fraction, largest: LargestCost, integral: bool) -> None:
    if data.bound is None:
        if data.status == "optimal":
            raise VerificationError("its status is 'optimal', but it has no bound")
        return
    bound = data.bound.exact
    if is_better(value, bound, data.sense) and not (data.bound.is_double and is_close(value, bound, largest)):
        raise VerificationError(
            f"its value {shown(value)} is better than its bound {shown(bound)}, so the bound is wrong"
        )
    reached = not is_better(rounded(bound, data.sense, integral), value, data.sense)
    if data.status == "optimal" and not reached and not is_close(value, bound, largest):
        raise VerificationError(
            f"its status is 'optimal', but its bound {shown(bound)} leaves room for a better value than "
            f"{shown(value)}"
        )


def _check_gap(data: ResultData, value: Fraction | None) -> None:
    if value is None or data.bound is None:
        if data.gap is not None:
            raise VerificationError(f"it has the gap {shown(data.gap)}, but not both a value and a bound")
        return
    gap = gap_entry(value, data.bound.exact)
    if data.gap is None or abs(data.gap - gap) > RELATIVE_GAP * max(Fraction(1), gap):
        claim = "none" if data.gap is None else shown(data.gap)
        raise VerificationError(
            f"its gap is {claim}, but the value {shown(value)} and the bound {shown(data.bound.exact)} "
            f"have the gap {shown(gap)}"
        )


def _stands_for(number: FileNumber, value: Fraction) -> bool:
    """Tell whether a number of the file is a value: exactly, or as the double nearest to it."""
    if not number.is_double:
        return number.exact == value
    try:
        return number.exact == Fraction(float(value))
    except OverflowError:
        return False


def shown(number: Fraction) -> str:
    """Write a number for people: exactly where that is short."""
    if number.denominator <= 10**6:
        return str(number)
    try:
        return f"{float(number):.10g}"
    except OverflowError:
        return str(number)

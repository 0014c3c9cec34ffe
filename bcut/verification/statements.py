"""What a verification says in words."""

from __future__ import annotations

from fractions import Fraction

from bcut.verification.certificate_data import CertifiedBound
from bcut.verification.consistency import RELATIVE_GAP, LargestCost, is_better, is_close, shown
from bcut.verification.reading import ResultData


def statement(
    data: ResultData,
    value: Fraction | None,
    best: Fraction | None,
    certified: CertifiedBound | None,
    largest: LargestCost,
) -> str:
    """Say in words what holds of an objective.

    Parameters
    ----------
    data : ResultData
        What the result says of it.
    value : Fraction or None
        Of the triangulation, which has been verified.
    best : Fraction or None
        The bound that its certificate proves, rounded where values are integral.
    certified : CertifiedBound or None
    largest : callable
    """
    noun = "dissection" if data.dissection else "triangulation"
    if data.status == "infeasible":
        return "infeasible according to the solver: its proof is not in this file"
    if value is None:
        parts = [f"there is no {noun} in this result (status '{data.status}')"]
    elif best is not None and not is_better(best, value, data.sense):
        return (
            f"optimal, proven exactly: the {noun} is verified, "
            f"and its value {shown(value)} meets the bound {shown(best)}"
        )
    else:
        parts = [f"{noun} verified, value {shown(value)}"]
    parts.append(_bound_statement(data, best, certified))
    if value is None or data.status != "optimal":
        if value is not None:
            parts.append(f"not claimed to be optimal (status '{data.status}')")
        if data.bound is not None and (best is None or is_better(best, data.bound.exact, data.sense)):
            parts.append(f"the bound {shown(data.bound.exact)} rests on the solver's tree")
    elif best is not None and (closeness := _closeness(value, best, largest)):
        parts.append(f"so the value is optimal up to {closeness}")
    else:
        # With a bound, what is left is the search between it and the value.
        rest = "run itself" if best is None else "solver's tree"
        parts.append(f"optimality rests on the {rest}")
    return "; ".join(parts)


def _closeness(value: Fraction, best: Fraction, largest: LargestCost) -> str:
    """Say how close a bound is to a value; nothing where it is not close, or that is not known."""
    difference = abs(value - best)
    if difference <= RELATIVE_GAP * abs(value):
        return f"a relative gap of {float(difference / abs(value)):.1e}"
    cost = largest() if is_close(value, best, largest) else None
    return "" if cost is None else f"{float(difference / cost):.1e} of the largest cost"


def _bound_statement(data: ResultData, best: Fraction | None, certified: CertifiedBound | None) -> str:
    if best is not None:
        proven = f"bound {shown(best)} proven exactly"
        if certified is not None and certified.obstacle:
            return (
                f"{proven}; what its certificate proves beyond that was not re-checked: {certified.obstacle}"
            )
        return proven
    if certified is not None:
        return f"the bound of its certificate was not re-checked: {certified.obstacle}"
    reason = data.certificate.reason if data.certificate is not None else ""
    return "no exact bound in this file" + (f" ({reason})" if reason else "")

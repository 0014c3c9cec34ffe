"""What an objective asks of a triangulation, and the bound that a certificate proves of it.

A sum is bounded by multipliers as `bcut.verification.certificate` says. A bottleneck is bounded by a threshold: with
cost 1 for the simplices that are no better than the threshold and 0 for all others, a positive bound on the sum of
costs says that every triangulation has such a simplex.

With objectives in front of it that have reached their optima, the triangulations in question are fewer. An earlier
bottleneck leaves the simplices that are no worse than its value. An earlier sum ``sign * c x <= sign * v`` is one more
row, whose multiplier must not be positive.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from bcut.errors import VerificationError
from bcut.geometry.configuration import PointConfiguration
from bcut.objectives.syntax import read_objective
from bcut.verification.certificate import check_claim
from bcut.verification.certificate_data import CertificateData, CertifiedBound
from bcut.verification.consistency import shown
from bcut.verification.costs import Cost, Costs, CostTable, UnknownCostError, costs_of_objective
from bcut.verification.exact_points import Simplex

#: From a certificate, costs and a sense to the bound that it proves.
Certifier = Callable[[CertificateData, Costs, str], CertifiedBound]


@dataclass(frozen=True)
class Goal:
    """An objective with its costs.

    Attributes
    ----------
    name : str
        As in a result file.
    sense : {"min", "max"}
    costs : Costs
        Of its measure.
    is_bottleneck : bool
    """

    name: str
    sense: str
    costs: Costs
    is_bottleneck: bool

    @classmethod
    def of(cls, name: str, sense: str, table: CostTable | None, configuration: PointConfiguration) -> Goal:
        """Read an objective.

        Raises
        ------
        InputError
            It is none, or contradicts the sense.
        """
        read = read_objective(name, sense)
        return cls(name, sense, costs_of_objective(read.measure, table, configuration), read.is_bottleneck)

    @property
    def sign(self) -> int:
        """1 for a minimum, -1 for a maximum."""
        return 1 if self.sense == "min" else -1

    def exact_costs(self, simplices: Sequence[Simplex]) -> list[Fraction]:
        """Return the costs of simplices."""
        return [Fraction(cost) for cost in self.costs.of(simplices)]

    def value(self, simplices: Sequence[Simplex]) -> Fraction:
        """Return the value of a triangulation."""
        costs = self.exact_costs(simplices)
        if not self.is_bottleneck:
            return sum(costs, Fraction(0))
        return max(costs) if self.sense == "min" else min(costs)

    def at_threshold(self, threshold: Fraction) -> Costs:
        """Return cost 1 for simplices that are no better than a threshold, and 0 for all others."""

        def of(simplices: Sequence[Simplex]) -> Sequence[Cost]:
            costs = self.exact_costs(simplices)
            return [int(self.sign * cost >= self.sign * threshold) for cost in costs]

        return Costs(of, integral=True)


@dataclass(frozen=True)
class Settled:
    """An earlier objective, and the value that the triangulations in question have."""

    goal: Goal
    value: Fraction


def certify(
    goal: Goal, certificate: CertificateData, certifier: Certifier, *, earlier: Sequence[Settled] = ()
) -> CertifiedBound:
    """Re-compute the bound of a certificate on an objective.

    Parameters
    ----------
    goal : Goal
    certificate : CertificateData
    certifier : callable
        Re-computes a bound on a sum of costs.
    earlier : sequence of Settled
        Objectives that come first.

    Raises
    ------
    VerificationError
        The certificate does not fit the objective, or proves less than it claims.
    """
    if goal.is_bottleneck != (certificate.threshold is not None):
        what = "a bottleneck, and has no threshold" if goal.is_bottleneck else "a sum, and has a threshold"
        raise VerificationError(f"its certificate is about {goal.name}, which is {what}")
    if len(certificate.earlier) not in (0, len(earlier)):
        raise VerificationError(
            f"its certificate has {len(certificate.earlier)} multipliers of earlier objectives, "
            f"but there are {len(earlier)} of these"
        )
    multipliers = certificate.earlier or (Fraction(0),) * len(earlier)
    threshold = certificate.threshold
    costs = goal.costs if threshold is None else goal.at_threshold(threshold)
    sense = goal.sense if threshold is None else "min"
    costs, constant = _combined(costs, 1 if sense == "min" else -1, earlier, multipliers)
    try:
        found = certifier(replace(certificate, bound=None), costs, sense)
    except UnknownCostError as error:
        return CertifiedBound(None, obstacle=str(error))
    if found.bound is None:
        return found
    found = replace(found, bound=found.bound + constant, integral=found.integral and not constant)
    assert found.bound is not None
    check_claim(certificate, found.bound, sense)
    if threshold is None:
        return found
    if found.bound <= 0:
        raise VerificationError(
            f"its certificate proves the bound {found.bound} on the number of simplices at the threshold "
            f"{shown(threshold)}, which must be positive to prove anything"
        )
    return replace(found, bound=threshold, integral=False)


def _combined(
    costs: Costs, sign: int, earlier: Sequence[Settled], multipliers: Sequence[Fraction]
) -> tuple[Costs, Fraction]:
    """Return costs less what the rows of earlier sums pay, without simplices that are too bad, and the constant."""
    if not earlier:
        return costs, Fraction(0)
    constant = Fraction(0)
    for settled, multiplier in zip(earlier, multipliers, strict=True):
        if multiplier > 0 or (multiplier and settled.goal.is_bottleneck):
            raise VerificationError(
                f"its certificate gives the earlier objective {settled.goal.name} the multiplier {multiplier}, "
                "which must be " + ("zero" if settled.goal.is_bottleneck else "zero or negative")
            )
        constant += sign * multiplier * settled.goal.sign * settled.value

    sums = [
        (settled.goal, sign * multiplier * settled.goal.sign)
        for settled, multiplier in zip(earlier, multipliers, strict=True)
        if multiplier
    ]
    worst = [settled for settled in earlier if settled.goal.is_bottleneck]

    def of(simplices: Sequence[Simplex]) -> Sequence[Cost]:
        found = list(costs.of(simplices))
        for goal, factor in sums:
            paid = goal.exact_costs(simplices)
            found = [cost - factor * share for cost, share in zip(found, paid, strict=True)]
        return found

    def admits(simplices: Sequence[Simplex]) -> Sequence[bool]:
        admitted = [True] * len(simplices)
        for settled in worst:
            sign, limit = settled.goal.sign, settled.value
            found = settled.goal.exact_costs(simplices)
            admitted = [
                old and sign * cost <= sign * limit for old, cost in zip(admitted, found, strict=True)
            ]
        return admitted

    return Costs(of, costs.integral and not sums, admits if worst else None), constant

"""`verify`: exact re-checking of a whole result, from nothing but the result."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction

from bcut.errors import ConfigurationError, InputError, ResultError, VerificationError
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.numbers import parse_coordinate
from bcut.verification.certificate import MAX_SUBSETS, CertifiedBound, certified_bound
from bcut.verification.consistency import (
    RELATIVE_GAP,
    check_consistency,
    is_better,
    relative_gap,
    rounded,
    shown,
)
from bcut.verification.costs import Costs, costs_of_objective
from bcut.verification.exact_points import ExactPoints
from bcut.verification.orbit_certificate import MAX_TABLE, certified_orbit_bound, is_invariant
from bcut.verification.reading import ResultData, Source, load_result
from bcut.verification.triangulation import check_triangulation


@dataclass(frozen=True)
class Verification:
    """What holds of a result, exactly.

    Attributes
    ----------
    statement : str
        One line for people; never stronger than what was checked.
    value : Fraction or None
        Of the triangulation, re-computed; None without one.
    exact_bound : Fraction or None
        Proven by the certificate: no triangulation has a better value. Unrounded.
    rounded_bound : Fraction or None
        The same, rounded to an integer where all costs are integral.
    proven_optimal : bool
        Whether the value reaches `rounded_bound`: a complete proof without trust in any solver.
    checks : list of str
        What was checked, in order.
    """

    statement: str
    value: Fraction | None = None
    exact_bound: Fraction | None = None
    rounded_bound: Fraction | None = None
    proven_optimal: bool = False
    checks: list[str] = field(default_factory=list)


def verify(result: Source, *, max_subsets: int | None = None) -> Verification:
    """Re-check a result exactly, without any solver and without the model that found it.

    Parameters
    ----------
    result : mapping, Result or path
        The data of a result file, what `bcut.solve` returned, or where the file is.
    max_subsets : int, optional
        Certificates are re-computed only where at most so many sets of points have to be looked at (of d + 1 points, or
        of d points where the certificate uses symmetries and no cuts); for larger configurations the statement says
        that this was left out.

    Returns
    -------
    Verification

    Raises
    ------
    VerificationError
        The result is refused; the message is the reason.
    ResultError
        It is no readable result of this schema.

    Examples
    --------
    >>> import bcut
    >>> bcut.solve("cube:3").save("cube.json")
    >>> bcut.verify("cube.json").statement
    'optimal, proven exactly: the triangulation is verified, and its value 5 meets the bound 5'
    """
    data, label = load_result(result)
    try:
        return _Verifier(data, max_subsets).run()
    except VerificationError as error:
        raise VerificationError(f"{label}: {error}") from None
    except InputError as error:
        raise ResultError(f"{label}: {error}") from None


class _Verifier:
    """One verification: what is known so far."""

    def __init__(self, data: ResultData, max_subsets: int | None) -> None:
        self.data, self.max_subsets = data, max_subsets
        self.checks: list[str] = []

    def run(self) -> Verification:
        data = self.data
        configuration = self._configuration()
        points = ExactPoints([[parse_coordinate(text) for text in point] for point in data.points])
        costs = costs_of_objective(data.objective, data.costs, configuration)
        value = self._value(points, costs)
        certified = self._certified(points, costs)
        integral = costs.integral or (certified is not None and certified.integral)
        check_consistency(data, value, integral=integral)
        self.checks.append(f"status '{data.status}', value, bound and gap do not contradict each other")
        exact = None if certified is None else certified.bound
        best = None if exact is None else rounded(exact, data.sense, integral)
        return Verification(
            statement=self._statement(value, best, certified),
            value=value,
            exact_bound=exact,
            rounded_bound=best,
            proven_optimal=value is not None and best is not None and not is_better(best, value, data.sense),
            checks=self.checks,
        )

    def _configuration(self) -> PointConfiguration:
        """Read the points, and compare what the result says of them."""
        data = self.data
        try:
            configuration = PointConfiguration.from_values(
                data.points, name=data.name, origin="instance.points"
            )
        except ConfigurationError as error:
            raise ResultError(str(error)) from None
        if configuration.dimension != data.dimension:
            raise VerificationError(
                f"instance.dimension is {data.dimension}, "
                f"but the points have {configuration.dimension} coordinates"
            )
        if configuration.digest != data.digest:
            raise VerificationError(
                "instance.digest does not belong to instance.points: one of them was changed after the run "
                f"(the points have {configuration.digest})"
            )
        self.checks.append(
            f"{configuration.n} points in dimension {data.dimension} have the digest of the instance"
        )
        return configuration

    def _value(self, points: ExactPoints, costs: Costs) -> Fraction | None:
        """Check the triangulation, and add up its costs."""
        data = self.data
        if data.triangulation is None:
            return None
        report = check_triangulation(points, data.triangulation, spanning=data.spanning)
        uses = "all points" if not report.unused else f"{points.n - len(report.unused)} of {points.n} points"
        self.checks.append(
            f"{len(report.simplices)} simplices with {uses} as vertices meet face to face, "
            "and have the hull's volume"
        )
        value = sum(map(Fraction, costs.of(report.simplices)), Fraction(0))
        self.checks.append(f"their {data.objective} is {shown(value)}")
        return value

    def _certified(self, points: ExactPoints, costs: Costs) -> CertifiedBound | None:
        """Re-compute the bound of the certificate; None where there is no such claim."""
        data = self.data
        if data.certificate is None or data.certificate.bound is None:
            return None
        symmetries = data.certificate.symmetries
        if symmetries is not None:
            certified = certified_orbit_bound(
                points,
                data.certificate,
                costs,
                invariant=lambda: is_invariant(data.objective, data.costs, symmetries),
                sense=data.sense,
                spanning=data.spanning,
                max_table=MAX_TABLE if self.max_subsets is None else self.max_subsets,
            )
        else:
            certified = certified_bound(
                points,
                data.certificate,
                costs,
                sense=data.sense,
                spanning=data.spanning,
                max_subsets=MAX_SUBSETS if self.max_subsets is None else self.max_subsets,
            )
        if certified.bound is not None:
            if symmetries:
                self.checks.append(f"{len(symmetries)} permutations of the points are affine symmetries")
            self.checks.append(
                f"the multipliers prove the bound {shown(certified.bound)} "
                f"over {certified.candidates:,} candidate simplices"
            )
        return certified

    def _statement(
        self, value: Fraction | None, best: Fraction | None, certified: CertifiedBound | None
    ) -> str:
        data = self.data
        if value is None:
            parts = [f"there is no triangulation in this result (status '{data.status}')"]
        elif best is not None and not is_better(best, value, data.sense):
            return (
                "optimal, proven exactly: the triangulation is verified, "
                f"and its value {shown(value)} meets the bound {shown(best)}"
            )
        else:
            parts = [f"triangulation verified, value {shown(value)}"]
        parts.append(self._bound_statement(best, certified))
        if value is None or data.status != "optimal":
            if value is not None:
                parts.append(f"not claimed to be optimal (status '{data.status}')")
            if data.bound is not None and (best is None or is_better(best, data.bound.exact, data.sense)):
                parts.append(f"the bound {shown(data.bound.exact)} rests on the solver's tree")
        elif best is not None and relative_gap(value, best) <= RELATIVE_GAP:
            parts.append(
                f"so the value is optimal up to a relative gap of {float(relative_gap(value, best)):.1e}"
            )
        else:
            parts.append("optimality rests on the solver's tree")
        return "; ".join(parts)

    def _bound_statement(self, best: Fraction | None, certified: CertifiedBound | None) -> str:
        if best is not None:
            return f"bound {shown(best)} proven exactly"
        if certified is not None:
            return f"the bound of its certificate was not re-checked: {certified.obstacle}"
        reason = self.data.certificate.reason if self.data.certificate is not None else ""
        return "no exact bound in this file" + (f" ({reason})" if reason else "")

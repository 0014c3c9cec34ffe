"""`verify`: exact re-checking of a whole result, from nothing but the result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache

from bcut.errors import ConfigurationError, InputError, ResultError, VerificationError
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.numbers import parse_coordinate
from bcut.verification.certificate import MAX_SUBSETS, certified_bound
from bcut.verification.certificate_data import CertificateData, CertifiedBound
from bcut.verification.consistency import (
    check_consistency,
    is_better,
    rounded,
    shown,
)
from bcut.verification.costs import Costs, largest_cost
from bcut.verification.cut_data import Candidates
from bcut.verification.dissection import check_dissection
from bcut.verification.exact_points import ExactPoints, Simplex
from bcut.verification.goals import Certifier, Goal, Settled, certify
from bcut.verification.orbit_certificate import MAX_TABLE, certified_orbit_bound, is_invariant
from bcut.verification.reading import ResultData, Source, load_result
from bcut.verification.region import verified_region
from bcut.verification.statements import statement
from bcut.verification.triangulation import check_triangulation


@dataclass(frozen=True)
class GoalVerification:
    """What holds of one objective, exactly; attributes as in `Verification`."""

    statement: str
    value: Fraction | None = None
    exact_bound: Fraction | None = None
    rounded_bound: Fraction | None = None
    proven_optimal: bool = False


@dataclass(frozen=True)
class Verification:
    """What holds of a result, exactly.

    Attributes
    ----------
    statement : str
        One line for people; never stronger than what was checked.
    value : Fraction or None
        Of the triangulation, re-computed; None without one. Of a region, the volume that is covered.
    exact_bound : Fraction or None
        Proven by the certificate: no triangulation has a better value. Unrounded.
    rounded_bound : Fraction or None
        The same, rounded to an integer where all costs are integral.
    proven_optimal : bool
        Whether the value reaches `rounded_bound`: a complete proof without trust in any solver.
    checks : list of str
        What was checked, in order.
    further : list of GoalVerification
        Of the further objectives of a lexicographic combination: value and bounds above are those of the first, and
        `proven_optimal` is about all of them.
    """

    statement: str
    value: Fraction | None = None
    exact_bound: Fraction | None = None
    rounded_bound: Fraction | None = None
    proven_optimal: bool = False
    checks: list[str] = field(default_factory=list)
    further: list[GoalVerification] = field(default_factory=list)

    def __repr__(self) -> str:
        return f"<Verification: {self.statement}>"


def verify(result: Source, *, max_subsets: int | None = None) -> Verification:
    """Re-check a result exactly, without any solver and without the model that found it.

    Parameters
    ----------
    result : mapping, Result or path
        The data of a result file, what `bcut.solve` or `bcut.region` returned, or where the file is.
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
    region = verified_region(result)
    if region is not None:
        return Verification(
            region.statement, region.covered, proven_optimal=region.settled, checks=region.checks
        )
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
        self.simplices: Sequence[Simplex] = ()

    @property
    def _max_subsets(self) -> int:
        return MAX_SUBSETS if self.max_subsets is None else self.max_subsets

    def run(self) -> Verification:
        data = self.data
        configuration = self._configuration()
        points = ExactPoints([[parse_coordinate(text) for text in point] for point in data.points])
        data.restrictions.check_points(points.n, points.dimension)
        goal = Goal.of(data.objective, data.sense, data.costs, configuration)
        value = self._value(points, goal)
        if data.certificate is not None and data.certificate.infeasible:
            return self._infeasible(points, data.certificate)
        first = self._of_goal(data, points, goal, value)
        if not data.then:
            return Verification(**vars(first), checks=self.checks)
        further = self._further(points, configuration, Settled(goal, value)) if value is not None else []
        proven = first.proven_optimal and len(further) == len(data.then)
        return Verification(
            statement=self._whole_statement(first, further),
            value=value,
            exact_bound=first.exact_bound,
            rounded_bound=first.rounded_bound,
            proven_optimal=proven and all(level.proven_optimal for level in further),
            checks=self.checks,
            further=further,
        )

    def _of_goal(
        self,
        data: ResultData,
        points: ExactPoints,
        goal: Goal,
        value: Fraction | None,
        earlier: Sequence[Settled] = (),
    ) -> GoalVerification:
        """Check what a result says of one objective."""
        certified = self._certified(data, points, goal, earlier)
        integral = goal.costs.integral or (certified is not None and certified.integral)

        @cache
        def largest() -> Fraction | None:
            candidates = Candidates(points, spanning=data.spanning, restrictions=data.restrictions)
            return largest_cost(candidates, goal.costs, self._max_subsets)

        check_consistency(data, value, largest, integral=integral)
        self.checks.append(f"status '{data.status}', value, bound and gap do not contradict each other")
        exact = None if certified is None else certified.bound
        best = None if exact is None else rounded(exact, data.sense, integral)
        if value is not None and best is not None and is_better(value, best, data.sense):
            # Both have been proven, so something is wrong with the proofs, and neither is to be relied on.
            raise VerificationError(
                f"its certificate proves the bound {shown(best)}, but its triangulation has the better value "
                f"{shown(value)}: one of the two checks is wrong, which is a defect of bcut; please report it"
            )
        return GoalVerification(
            statement=statement(data, value, best, certified, largest),
            value=value,
            exact_bound=exact,
            rounded_bound=best,
            proven_optimal=value is not None and best is not None and not is_better(best, value, data.sense),
        )

    def _further(
        self, points: ExactPoints, configuration: PointConfiguration, first: Settled
    ) -> list[GoalVerification]:
        """Check the further objectives, each with the values of those before it."""
        settled, found = [first], []
        for number, level in enumerate(self.data.then):
            if level.status is None:
                if self.data.status == "optimal":
                    raise VerificationError(f"its status is 'optimal', but then[{number}] was not begun")
                break
            if self.data.status == "optimal" and level.status != "optimal":
                raise VerificationError(
                    f"its status is 'optimal', but that of then[{number}] is '{level.status}'"
                )
            goal = Goal.of(level.objective, level.sense, level.costs, configuration)
            value = goal.value(self.simplices)
            self.checks.append(f"their {level.objective} is {shown(value)}")
            data = replace(
                self.data,
                objective=level.objective,
                sense=level.sense,
                status=level.status,
                value=level.value,
                bound=level.bound,
                gap=level.gap,
                certificate=level.certificate,
            )
            try:
                found.append(self._of_goal(data, points, goal, value, settled))
            except VerificationError as error:
                raise VerificationError(f"then[{number}] ({level.objective}): {error}") from None
            settled.append(Settled(goal, value))
        return found

    def _whole_statement(self, first: GoalVerification, further: Sequence[GoalVerification]) -> str:
        """Say of every objective what holds."""
        statements = [f"by {self.data.objective}: {first.statement}"]
        for number, level in enumerate(self.data.then):
            text = further[number].statement if number < len(further) else "not begun"
            statements.append(f"then by {level.objective}: {text}")
        return ". ".join(statements)

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

    def _value(self, points: ExactPoints, goal: Goal) -> Fraction | None:
        """Check the triangulation, and add up its costs."""
        data = self.data
        if data.triangulation is None:
            return None
        check = check_dissection if data.dissection else check_triangulation
        report = check(points, data.triangulation, spanning=data.spanning)
        uses = "all points" if not report.unused else f"{points.n - len(report.unused)} of {points.n} points"
        self.checks.append(
            f"{len(report.simplices)} simplices with {uses} as vertices "
            f"{'do not overlap' if data.dissection else 'meet face to face'}, and have the hull's volume"
        )
        if data.restrictions:
            data.restrictions.check(report.simplices)
            self.checks.append("they have the faces that are required, and none that is forbidden")
        if data.invariant_under is not None:
            self._check_invariance(report.simplices, data.invariant_under)
        self.simplices = report.simplices
        value = goal.value(report.simplices)
        self.checks.append(f"their {data.objective} is {shown(value)}")
        return value

    def _check_invariance(
        self, simplices: Sequence[Simplex], groups: Sequence[Sequence[Sequence[int]]]
    ) -> None:
        """Refuse a triangulation that none of some groups leaves invariant."""
        known = set(simplices)
        try:
            invariant = any(
                all(
                    tuple(sorted(permutation[v] for v in simplex)) in known
                    for permutation in group
                    for simplex in simplices
                )
                for group in groups
            )
        except IndexError:
            invariant = False
        if not invariant:
            raise VerificationError(
                "the triangulation is not invariant under the symmetries in problem.invariant_under"
            )
        self.checks.append("the triangulation is invariant under the symmetries asked for")

    def _infeasible(self, points: ExactPoints, certificate: CertificateData) -> Verification:
        """Re-compute a proof that there is no triangulation: a positive bound on the value 0 of each."""
        data = self.data
        if data.status != "infeasible" or data.dissection or certificate.symmetries is not None:
            raise VerificationError(
                "its certificate claims that there is no triangulation, but the rest of the result does not"
            )
        check_consistency(data, None, lambda: None, integral=False)
        certified = certified_bound(
            points,
            certificate,
            Costs(lambda simplices: [0] * len(simplices), integral=True),
            sense="min",
            spanning=data.spanning,
            restrictions=data.restrictions,
            max_subsets=self._max_subsets,
        )
        if certified.bound is None:
            return Verification(
                f"infeasible according to the solver; the proof was not re-checked: {certified.obstacle}",
                checks=self.checks,
            )
        if certified.bound <= 0:
            raise VerificationError(
                "its certificate claims that there is no triangulation, but proves nothing"
            )
        self.checks.append(
            f"the multipliers prove that no choice of the {certified.candidates:,} candidate simplices "
            "is a triangulation"
        )
        return Verification(
            "infeasible, proven exactly: there is no triangulation with the faces that are asked for",
            checks=self.checks,
        )

    def _certified(
        self, data: ResultData, points: ExactPoints, goal: Goal, earlier: Sequence[Settled]
    ) -> CertifiedBound | None:
        """Re-compute the bound of the certificate; None where there is no such claim."""
        if data.certificate is None or data.certificate.bound is None:
            return None
        symmetries = data.certificate.symmetries
        if data.dissection and (
            data.certificate.cocircuits
            or data.certificate.cuts
            or data.certificate.refutes is not None
            or symmetries is not None
        ):
            raise VerificationError(
                "its certificate uses rows that triangulations satisfy, but the problem is about dissections"
            )
        if symmetries is not None and data.restrictions:
            raise VerificationError(
                "its certificate is one over orbits, but required and forbidden faces break symmetries"
            )
        if symmetries is not None and (goal.is_bottleneck or earlier):
            raise VerificationError("its certificate is one over orbits, which is for sums of one objective")
        if symmetries is not None:
            certified = certified_orbit_bound(
                points,
                data.certificate,
                goal.costs,
                invariant=lambda: is_invariant(data.objective, data.costs, symmetries),
                sense=data.sense,
                spanning=data.spanning,
                max_table=MAX_TABLE if self.max_subsets is None else self.max_subsets,
            )
        else:
            certified = certify(goal, data.certificate, self._certifier(points), earlier=earlier)
        if certified.bound is not None and goal.is_bottleneck:
            self.checks.append(
                f"the multipliers prove that each triangulation has a simplex that is no better than "
                f"{shown(certified.bound)}, among {certified.candidates:,} candidate simplices"
            )
        elif certified.bound is not None:
            if symmetries:
                self.checks.append(f"{len(symmetries)} permutations of the points are affine symmetries")
            if certified.refuted is None:
                proof = f"the multipliers prove the bound {shown(certified.bound)}"
            else:
                proof = f"multipliers of rows and cuts prove that no triangulation reaches {shown(certified.refuted)},"
            self.checks.append(f"{proof} over {certified.candidates:,} candidate simplices")
        return certified

    def _certifier(self, points: ExactPoints) -> Certifier:
        def certifier(certificate: CertificateData, costs: Costs, sense: str) -> CertifiedBound:
            return certified_bound(
                points,
                certificate,
                costs,
                sense=sense,
                spanning=self.data.spanning,
                restrictions=self.data.restrictions,
                max_subsets=self._max_subsets,
            )

        return certifier

"""Re-computing the bound that exact dual multipliers prove, over every candidate simplex.

Let sign be 1 for a minimum and -1 for a maximum, and x the 0/1 vector of a triangulation, indexed by the
candidate simplices. It satisfies

- for a (d-1)-simplex f with points strictly on both sides: the sum over t = f + a of x_t times the sign of
  ``det(f_1 - f_0, ..., f_{d-1} - f_0, a - f_0)`` is 0, because as many simplices (one or none) lie on either
  side of f;
- coverage rows: the sum of x_t over the t that contain a generic point is 1 (that of a dissection too);
- the cuts ``a x <= rhs``, as far as they are valid.

Hence for any multipliers y of the equations and any multipliers z <= 0 of the cuts

    sign * c x >= sum of y_coverage + sum_k z_k rhs_k + sum_t min(0, sign * c_t - sum_i y_i A_it - sum_k z_k a_kt),

since 0 <= x_t <= 1. The generic point is ``v_0 + e (v_1 - v_0) + e^2 (v_2 - v_0) + ...`` for the flag v and
an infinitesimal e > 0: it is on the side of a hyperplane on which the first of v_0, v_1, ... lies that is
not on the hyperplane.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import combinations, islice
from math import comb, floor, lcm

from bcut.errors import VerificationError
from bcut.verification.costs import Costs
from bcut.verification.cuts import CUT_CHECKERS, Candidates, CertificateCut
from bcut.verification.exact_points import ExactPoints, SideTable, Simplex, mask_of, without
from bcut.verification.restrictions import RestrictionData

# Subsets of d + 1 points to look at, unless told otherwise: some minutes' work.
MAX_SUBSETS = 20_000_000

# Simplices whose costs are asked for at once.
_CHUNK = 1 << 16


@dataclass(frozen=True)
class CertificateData:
    """Multipliers as read from a result file.

    Attributes
    ----------
    bound : Fraction or None
        The claim, on the objective itself; None where the file claims nothing.
    flag : tuple of int
        v_0, ..., v_d.
    coverage : Fraction
        Multiplier of the coverage row.
    cocircuits : mapping of tuple of int to Fraction
        Multipliers of the rows of ascending (d-1)-simplices.
    chambers : mapping of tuple of int to Fraction
        Multipliers of the coverage rows of more generic points, by their flags.
    cuts : tuple of CertificateCut
    symmetries : tuple of tuple of int, or None
        Permutations of the points. Where this is not None, multipliers are those of all images of a row, those of cuts
        belong to the means of their images, and the volume row takes the place of the coverage row (see
        `bcut.verification.orbit_certificate`).
    volume : Fraction
        Multiplier of the volume row.
    volume_coefficient : int
        Which coefficient of the volumes, on the basis of the coordinates' number field, the volume row takes.
    refutes : RefutationData or None
        Goes beyond the bound.
    infeasible : bool
        Whether the multipliers are to prove a positive bound on the value 0 of all triangulations: that there is none.
    threshold : Fraction or None
        Of a bottleneck: the multipliers are to prove a positive bound on the number of simplices that are no better.
    earlier : tuple of Fraction
        Multipliers of the values of earlier objectives.
    reason : str
        Why there is no bound.
    """

    bound: Fraction | None
    flag: Simplex = ()
    coverage: Fraction = Fraction(0)
    cocircuits: Mapping[Simplex, Fraction] | None = None
    chambers: Mapping[Simplex, Fraction] | None = None
    cuts: tuple[CertificateCut, ...] = ()
    symmetries: tuple[Simplex, ...] | None = None
    volume: Fraction = Fraction(0)
    volume_coefficient: int = 0
    refutes: RefutationData | None = None
    infeasible: bool = False
    threshold: Fraction | None = None
    earlier: tuple[Fraction, ...] = ()
    reason: str = ""


@dataclass(frozen=True)
class RefutationData:
    """A value that no triangulation reaches, and why.

    Attributes
    ----------
    target : Fraction
        Of the objective.
    stages : tuple of CertificateData
        Each speaks of the candidates whose reduced costs in the one before, first in the certificate itself, a
        triangulation within the target may have.
    """

    target: Fraction
    stages: tuple[CertificateData, ...]


@dataclass(frozen=True)
class CertifiedBound:
    """What a certificate proves.

    Attributes
    ----------
    bound : Fraction or None
        No triangulation has a better value; None where `obstacle` kept the bound from being re-computed.
    integral : bool
        Whether all candidate simplices have integral costs, so that the bound may be rounded.
    candidates : int
        Number of candidate simplices.
    obstacle : str
        Why the bound could not be re-computed.
    refuted : Fraction or None
        A value beyond the bound that no triangulation reaches either.
    """

    bound: Fraction | None
    integral: bool = False
    candidates: int = 0
    obstacle: str = ""
    refuted: Fraction | None = None

    @property
    def is_checked(self) -> bool:
        """Whether the bound was re-computed."""
        return self.bound is not None


def certified_bound(
    points: ExactPoints,
    certificate: CertificateData,
    costs: Costs,
    *,
    sense: str,
    spanning: bool,
    restrictions: RestrictionData | None = None,
    max_subsets: int = MAX_SUBSETS,
) -> CertifiedBound:
    """Re-compute the bound of a certificate exactly.

    Parameters
    ----------
    points : ExactPoints
    certificate : CertificateData
    costs : Costs
    sense : {"min", "max"}
    spanning : bool
        Candidates are the simplices without further points in them, instead of all.
    restrictions : RestrictionData, optional
        Candidates are only those that these leave.
    max_subsets : int
        Give up, with an obstacle, where more (d+1)-subsets would have to be looked at.

    Returns
    -------
    CertifiedBound

    Raises
    ------
    VerificationError
        A row or a cut is not valid, or the multipliers prove less than the certificate claims.
    """
    subsets = comb(points.n, points.dimension + 1)
    if subsets > max_subsets:
        return CertifiedBound(
            None, obstacle=f"there are {subsets:,} subsets of {points.dimension + 1} points to look at"
        )
    sides = Candidates(points, spanning=spanning, restrictions=restrictions)
    for flag in (certificate.flag, *(certificate.chambers or {})):
        check_flag(sides, flag)
    _check_rows(sides, certificate)
    obstacle = check_cuts(sides, certificate)
    if obstacle:
        return CertifiedBound(None, obstacle=obstacle)
    sign = 1 if sense == "min" else -1
    program = _Program(sides, certificate, costs, sign, spanning)
    found = program.solve()
    assert found.bound is not None
    check_claim(certificate, found.bound, sense)
    if certificate.refutes is None:
        return found
    obstacle = _check_refutation(program, found.bound, certificate)
    if obstacle:
        return replace(found, obstacle=obstacle)
    target = certificate.refutes.target
    # Between integral values there is nothing: the next one is a bound.
    beyond = Fraction(sign * (floor(sign * target) + 1)) if found.integral else target
    return replace(found, bound=max(found.bound, beyond, key=lambda bound: sign * bound), refuted=target)


def _check_refutation(program: _Program, bound: Fraction, certificate: CertificateData) -> str:
    """Refuse stages that do not prove the target to be out of reach; return why they cannot be checked, or nothing."""
    refutes, sign, sides = certificate.refutes, program.sign, program.sides
    assert refutes is not None
    for number, stage in enumerate(refutes.stages):
        where = f"stage {number} of the certificate's refutation of {refutes.target}"
        left = program.left_within(sign * (refutes.target - bound))
        sides = sides.only(left)
        stage = replace(stage, flag=certificate.flag)
        try:
            _check_rows(sides, stage)
            obstacle = check_cuts(sides, stage)
        except VerificationError as error:
            raise VerificationError(f"{where}: {error}") from None
        if obstacle:
            return f"{where}: {obstacle}"
        program = _Program(sides, stage, program.costs, sign, program.spanning, left)
        found = program.solve().bound
        assert found is not None
        bound = found
    if not refutes.stages or sign * bound <= sign * refutes.target:
        raise VerificationError(
            f"the certificate claims that no triangulation reaches {refutes.target}, but its stages prove the bound "
            f"{bound} only"
        )
    return ""


def check_claim(certificate: CertificateData, proven: Fraction, sense: str) -> None:
    """Refuse a certificate that proves less than it claims."""
    claim = certificate.bound
    if claim is not None and (proven < claim if sense == "min" else proven > claim):
        raise VerificationError(
            f"the certificate claims the bound {claim}, but its multipliers prove {proven} only "
            f"({'at least' if sense == 'min' else 'at most'} {float(proven):.6g})"
        )


def check_flag(sides: SideTable, flag: Simplex) -> None:
    """Refuse a flag that is no list of d + 1 affinely independent points."""
    n, d = sides.points.n, sides.points.dimension
    if len(set(flag)) != d + 1 or len(flag) != d + 1 or not all(0 <= v < n for v in flag):
        raise VerificationError(
            f"the certificate's flag {list(flag)} is not a list of {d + 1} different points"
        )
    if not sides.orientation(tuple(sorted(flag))):
        raise VerificationError(
            f"the certificate's flag {list(flag)} lies in a hyperplane: it gives no generic point"
        )


def _check_rows(sides: SideTable, certificate: CertificateData) -> None:
    n, d = sides.points.n, sides.points.dimension
    for facet in certificate.cocircuits or {}:
        if len(facet) != d or not all(0 <= v < n for v in facet):
            raise VerificationError(f"the certificate's row {list(facet)} does not name {d} points")
        plus, minus = sides[facet]
        if not (plus and minus):
            raise VerificationError(
                f"the certificate has a multiplier for {list(facet)}, "
                "which has no points strictly on both sides: there is no such row"
            )


def check_cuts(sides: SideTable, certificate: CertificateData) -> str:
    """Refuse cuts that are not valid; return why they cannot be checked, or nothing."""
    unknown = sorted(
        {cut.family for cut in certificate.cuts if cut.multiplier and cut.family not in CUT_CHECKERS}
    )
    if unknown:
        return f"it uses cuts that cannot be re-checked ({', '.join(unknown)})"
    n, d = sides.points.n, sides.points.dimension
    for number, cut in enumerate(certificate.cuts):
        if not cut.multiplier:
            continue
        where = f"cut {number} of the certificate ({cut.family})"
        if cut.multiplier > 0:
            raise VerificationError(
                f"{where}: multiplier {cut.multiplier} of a '<=' row must not be positive"
            )
        for simplex in cut.simplices:
            if len(simplex) != d + 1 or not all(0 <= v < n for v in simplex):
                raise VerificationError(f"{where}: {list(simplex)} does not name {d + 1} points")
        try:
            CUT_CHECKERS[cut.family](sides, cut)
        except VerificationError as error:
            raise VerificationError(f"{where} is not valid: {error}") from None
    return ""


@dataclass(frozen=True, slots=True)
class _Facet:
    """What the candidates need to know of each of their facets, as bit sets of points.

    Attributes
    ----------
    plus, minus : int
        Points strictly on either side.
    generic : int
        Points strictly on the side of the generic point.
    multiplier : int
        Scaled to an integer.
    chambers_plus, chambers_minus : int
        Further generic points on either side, by their numbers.
    """

    plus: int
    minus: int
    generic: int
    multiplier: int
    chambers_plus: int = 0
    chambers_minus: int = 0


class _Program:
    """The sum over all candidate simplices, with all multipliers over one denominator."""

    def __init__(
        self,
        sides: Candidates,
        certificate: CertificateData,
        costs: Costs,
        sign: int,
        spanning: bool,
        only: Iterable[Simplex] | None = None,
    ) -> None:
        self.sides, self.costs, self.sign, self.spanning = sides, costs, sign, spanning
        self.only = None if only is None else sorted(only)
        cocircuits = certificate.cocircuits or {}
        in_cuts: dict[Simplex, Fraction] = {}
        chambers = certificate.chambers or {}
        constant = sum(chambers.values(), certificate.coverage)
        for cut in certificate.cuts:
            constant += cut.multiplier * cut.rhs
            for simplex, coefficient in zip(cut.simplices, cut.coefficients, strict=True):
                in_cuts[simplex] = in_cuts.get(simplex, Fraction(0)) + cut.multiplier * coefficient
        values = (constant, certificate.coverage, *chambers.values(), *cocircuits.values(), *in_cuts.values())
        self.scale = lcm(*(value.denominator for value in values))
        self.constant = int(constant * self.scale)
        self.coverage = int(certificate.coverage * self.scale)
        self.in_cuts = {simplex: int(value * self.scale) for simplex, value in in_cuts.items()}
        self.chambers = [int(value * self.scale) for value in chambers.values()]
        self._flags = list(chambers)
        self.facets = {
            facet: self._facet(facet, certificate.flag, int(cocircuits.get(facet, Fraction(0)) * self.scale))
            for facet in combinations(range(sides.points.n), sides.points.dimension)
        }

    def _facet(self, facet: Simplex, flag: Simplex, multiplier: int) -> _Facet:
        plus, minus = self.sides[facet]
        sides = [_side(plus, minus, chamber) for chamber in self._flags]
        return _Facet(
            plus,
            minus,
            (minus, 0, plus)[1 + _side(plus, minus, flag)],
            multiplier,
            mask_of(number for number, side in enumerate(sides) if side > 0),
            mask_of(number for number, side in enumerate(sides) if side < 0),
        )

    def solve(self) -> CertifiedBound:
        """Add up what each candidate can contribute at most."""
        total: int | Fraction = self.constant
        count, integral = 0, True
        for _, reduced, is_integral in self._reduced_costs():
            count += 1
            if reduced < 0:
                total += reduced
            integral = integral and is_integral
        bound = self.sign * Fraction(total) / self.scale
        return CertifiedBound(bound, integral or self.costs.integral, count)

    def left_within(self, slack: Fraction) -> list[Simplex]:
        """Return the candidates whose reduced costs are at most so much: others cost more than the bound by more."""
        most = slack * self.scale
        return [simplex for simplex, reduced, _ in self._reduced_costs() if reduced <= most]

    def _reduced_costs(self) -> Iterator[tuple[Simplex, int | Fraction, bool]]:
        """Yield each candidate with its reduced cost, times the scale, and whether its cost is integral."""
        activities = self._activities()
        while chunk := list(islice(activities, _CHUNK)):
            if self.costs.admits is not None:
                admitted = self.costs.admits([simplex for simplex, _ in chunk])
                chunk = [item for item, is_admitted in zip(chunk, admitted, strict=True) if is_admitted]
            costs = self.costs.of([simplex for simplex, _ in chunk])
            for (simplex, activity), cost in zip(chunk, costs, strict=True):
                yield simplex, self.sign * self.scale * cost - activity, cost.denominator == 1

    def _activities(self) -> Iterator[tuple[Simplex, int]]:
        """Yield each candidate with the sum of multiplier times coefficient over all rows and cuts."""
        points = self.sides.points
        everything = (1 << points.n) - 1
        facets, in_cuts, coverage, spanning = self.facets, self.in_cuts, self.coverage, self.spanning
        everywhere = combinations(range(points.n), points.dimension + 1)
        for simplex in everywhere if self.only is None else self.only:
            last = facets[simplex[:-1]]
            if not (last.plus | last.minus) >> simplex[-1] & 1:
                continue
            activity = in_cuts.get(simplex, 0)
            inside, covers = everything, True
            over = (1 << len(self.chambers)) - 1
            for position, vertex in enumerate(simplex):
                facet = facets[without(simplex, position)]
                on_plus = facet.plus >> vertex & 1
                covers = covers and bool(facet.generic >> vertex & 1)
                inside &= ~(facet.minus if on_plus else facet.plus)
                over &= facet.chambers_plus if on_plus else facet.chambers_minus
                if facet.multiplier:
                    activity += facet.multiplier if on_plus else -facet.multiplier
            if (spanning and inside != mask_of(simplex)) or not self.sides.admitted(simplex):
                continue
            while over:
                activity += self.chambers[(over & -over).bit_length() - 1]
                over &= over - 1
            yield simplex, activity + coverage if covers else activity


def _side(plus: int, minus: int, flag: Simplex) -> int:
    """Return on which side of a hyperplane a flag's generic point lies; 0 where its points are dependent."""
    for vertex in flag:
        if plus >> vertex & 1:
            return 1
        if minus >> vertex & 1:
            return -1
    return 0

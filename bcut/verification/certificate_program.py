"""Reduced costs of all candidate simplices from exact multipliers, and the bound that they add up to."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations, islice
from math import lcm

from bcut.verification.certificate_data import CertificateData, CertifiedBound
from bcut.verification.costs import Costs
from bcut.verification.cut_data import Candidates
from bcut.verification.exact_points import Simplex, mask_of, without

# Simplices whose costs are asked for at once.
_CHUNK = 1 << 16


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


class CertificateProgram:
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

"""Re-computing the bound of a certificate that speaks of orbits: over all candidates, without listing them.

Let G be the group that the certificate's symmetries generate, and let the costs be invariant under it. The rows are

- for the orbit of a (d-1)-simplex f with points strictly on both sides: the cocircuit row of f and those of all its
  images, oriented as the symmetries carry f to them, each with the same multiplier. Where a symmetry takes f to itself
  and exchanges its sides, these rows are the negatives of themselves: the orbit has none;
- the volume row, ``sum of x_t phi(vol t) = phi(vol hull)``, divided by its right-hand side. In a number field, phi
  takes one coefficient on the field's basis; any linear phi gives a valid equation, since x is rational;
- cuts, each of them averaged over its images under G.

All that is invariant under G, hence so are the reduced costs, and with h_t = min(0, reduced cost of t)

    (d + 1) sum over t of h_t  =  sum over orbits of (d-1)-simplices f of  |orbit| * sum over points a of h_(f + a),

as each d-simplex has d + 1 facets. So nothing needs to be known about orbits of d-simplices: it is enough to have all
orbits of sets of d points, with their lengths, which `SetOrbits` lists.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import comb, lcm
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.errors import VerificationError
from bcut.geometry.numbers import AlgebraicNumber
from bcut.verification.case_split import MAX_ELEMENTS, CaseChecker, Element, Frame, listed_elements
from bcut.verification.certificate import check_claim, check_cuts, check_flag
from bcut.verification.certificate_data import CertificateData, CertifiedBound
from bcut.verification.costs import Costs, CostTable, has_table
from bcut.verification.cuts import Candidates
from bcut.verification.exact_points import ExactPoints, SideTable, Simplex, mask_of, without
from bcut.verification.hull import hull_volume
from bcut.verification.symmetries import SetOrbits, check_symmetries

# Sets in one table, at most: a table takes four bytes for each.
MAX_TABLE = 200_000_000


def certified_orbit_bound(
    points: ExactPoints,
    certificate: CertificateData,
    costs: Costs,
    *,
    invariant: Callable[[], bool],
    sense: str,
    spanning: bool,
    max_table: int = MAX_TABLE,
) -> CertifiedBound:
    """Re-compute the bound of a certificate over orbits exactly.

    Parameters
    ----------
    points : ExactPoints
    certificate : CertificateData
        With symmetries.
    costs : Costs
    invariant : callable
        Tells whether all images of a simplex under the symmetries are known to have the same cost; asked once these are
        known to be permutations.
    sense : {"min", "max"}
    spanning : bool
        Candidates are the simplices without further points in them, instead of all.
    max_table : int
        Give up, with an obstacle, where a table of more sets of points would be needed.

    Raises
    ------
    VerificationError
        A symmetry, a row or a cut is not valid, or the multipliers prove less than the certificate claims.
    """
    n, d = points.n, points.dimension
    needed = comb(n, d + 1) if certificate.cuts else comb(n, d)
    if needed > max_table:
        return CertifiedBound(None, obstacle=f"it takes a table of {needed:,} sets of points")
    sides = Candidates(points, spanning=spanning)
    check_flag(sides, certificate.flag)
    assert certificate.symmetries is not None
    symmetries = check_symmetries(points, certificate.symmetries, certificate.flag)
    if not invariant():
        return CertifiedBound(None, obstacle="its costs are not known to be invariant under its symmetries")
    obstacle = check_cuts(sides, certificate)
    if obstacle:
        return CertifiedBound(None, obstacle=obstacle)
    facets = SetOrbits(symmetries, n, d)
    facets.add_all()
    if sum(facets.sizes) != comb(n, d):
        raise VerificationError(f"the orbits of sets of {d} points do not make up all of them")
    simplices = SetOrbits(symmetries, n, d + 1) if certificate.cuts else None
    sign = 1 if sense == "min" else -1
    program = _OrbitProgram(sides, certificate, facets, simplices, costs, sign, spanning)
    found = program.solve()
    assert found.bound is not None
    check_claim(certificate, found.bound, sense)
    refutes = certificate.refutes
    if refutes is None:
        return found
    if refutes.case is None:
        raise VerificationError("the certificate has symmetries, but its refutation does not use them")
    group = listed_elements(symmetries, n)
    if group is None:
        return replace(found, obstacle=f"it takes a list of more than {MAX_ELEMENTS:,} symmetries")
    left = frozenset(program.left_within(sign * (refutes.target - found.bound), group))
    checker = CaseChecker(sides, certificate.flag, costs, sign, spanning, refutes.target)
    obstacle = checker.check(refutes.case, [Frame(group, left)])
    if obstacle:
        return replace(found, obstacle=obstacle)
    return found.beyond(refutes.target, sign)


def is_invariant(objective: str, table: CostTable | None, symmetries: Sequence[Simplex]) -> bool:
    """Tell whether an objective is known to give all images of a simplex under some permutations the same cost."""
    if objective == "cardinality":
        return True
    if table is None or not has_table(objective):
        return False  # a table may stand in the file, and yet have nothing to do with the costs
    return all(
        all(0 <= v < len(permutation) for v in simplex)
        and table.costs.get(tuple(sorted(permutation[v] for v in simplex)), table.default) == cost
        for permutation in symmetries
        for simplex, cost in table.costs.items()
    )


@dataclass(frozen=True, eq=False)
class _Batch:
    """The candidates f + a over one representative f of an orbit of (d-1)-simplices.

    Attributes
    ----------
    length : int
        Of the orbit of f.
    simplices : list of tuple of int
    orientations : ndarray of int64
        Of their ascending vertices: 1 or -1.
    volumes : list of Fraction
        phi of their volumes.
    """

    length: int
    simplices: list[Simplex]
    orientations: NDArray[np.int64]
    volumes: list[Fraction]


class _OrbitProgram:
    """The sum over all candidates, with all multipliers over one denominator."""

    def __init__(
        self,
        sides: SideTable,
        certificate: CertificateData,
        facets: SetOrbits,
        simplices: SetOrbits | None,
        costs: Costs,
        sign: int,
        spanning: bool,
    ) -> None:
        self.sides, self.points, self.costs = sides, sides.points, costs
        self.facets, self.sign, self.spanning = facets, sign, spanning
        self.place = certificate.volume_coefficient
        hull = self._coefficient(hull_volume(self.points, certificate.flag))
        if not hull:
            raise VerificationError(
                f"the certificate's volume row takes coefficient {self.place} of the volumes, "
                "in which the hull's volume vanishes"
            )
        volume = certificate.volume / hull
        in_orbits = self._cut_coefficients(certificate, simplices)
        rows = self._row_multipliers(certificate)
        values = (certificate.volume, volume, *rows.values(), *in_orbits.values())
        constant = certificate.volume + sum(
            (cut.multiplier * cut.rhs for cut in certificate.cuts), Fraction(0)
        )
        self.scale = lcm(constant.denominator, *(value.denominator for value in values))
        self.constant = int(constant * self.scale)
        self.volume = int(volume * self.scale)
        # By number of the orbit, from 1.
        self.rows = [int(rows.get(k, Fraction(0)) * self.scale) for k in range(len(facets.sizes) + 1)]
        self.simplices = simplices
        count = 0 if simplices is None else len(simplices.sizes)
        self.in_orbits = [int(in_orbits.get(k, Fraction(0)) * self.scale) for k in range(count + 1)]

    def _coefficient(self, volume: Any) -> Fraction:
        """Return phi of a volume: one of its coefficients on the basis of the field."""
        coefficients = volume.coefficients if isinstance(volume, AlgebraicNumber) else (volume,)
        if not 0 <= self.place < len(coefficients):
            raise VerificationError(
                f"the certificate's volume row takes coefficient {self.place}, but volumes have {len(coefficients)}"
            )
        return Fraction(coefficients[self.place])

    def _row_multipliers(self, certificate: CertificateData) -> dict[int, Fraction]:
        """Return the multiplier of each orbit of rows, for the orientation of the orbit's representative."""
        multipliers: dict[int, Fraction] = {}
        for facet, multiplier in (certificate.cocircuits or {}).items():
            where = f"the certificate's row {list(facet)}"
            if len(facet) != self.points.dimension or not all(0 <= v < self.points.n for v in facet):
                raise VerificationError(f"{where} does not name {self.points.dimension} points")
            plus, minus = self.sides[facet]
            if not (plus and minus):
                raise VerificationError(f"{where} has no points strictly on both sides: there is no such row")
            column = np.array(facet, dtype=np.int64)[:, None]
            label = int(self.facets.labels[self.facets.ranks(column)[0]])
            number = abs(label)
            if self.facets.exchanged[number - 1]:
                raise VerificationError(f"{where}: a symmetry exchanges its sides, so there is no such row")
            if number in multipliers:
                raise VerificationError(f"{where} belongs to an orbit that has a multiplier already")
            multipliers[number] = multiplier if label > 0 else -multiplier
        return multipliers

    def _cut_coefficients(
        self, certificate: CertificateData, simplices: SetOrbits | None
    ) -> dict[int, Fraction]:
        """Return what the averaged cuts take off the reduced cost of each orbit of simplices."""
        total: dict[int, Fraction] = {}
        for cut in certificate.cuts:
            assert simplices is not None
            if not cut.multiplier:
                continue  # nobody has looked at its simplices
            for simplex, coefficient in zip(cut.simplices, cut.coefficients, strict=True):
                number = simplices.number_of(simplex)
                share = cut.multiplier * coefficient / simplices.sizes[number - 1]
                total[number] = total.get(number, Fraction(0)) + share
        return total

    def solve(self) -> CertifiedBound:
        """Add up what all candidates can contribute at most."""
        d = self.points.dimension
        loss: Fraction | int = 0
        count, integral = 0, True
        for batch, _, reduced, is_integral in self._reduced_costs():
            count += batch.length
            loss += batch.length * reduced if reduced < 0 else 0
            integral = integral and is_integral
        bound = self.sign * (self.constant + Fraction(loss, d + 1)) / self.scale
        return CertifiedBound(bound, integral or self.costs.integral, count // (d + 1))

    def left_within(self, slack: Fraction, group: Sequence[Element]) -> set[Simplex]:
        """Return all candidates whose reduced costs are at most so much."""
        most = slack * self.scale
        left: set[Simplex] = set()
        for _, simplex, reduced, _ in self._reduced_costs():
            if reduced <= most and simplex not in left:
                left.update(element.of(simplex) for element in group)
        return left

    def _reduced_costs(self) -> Iterator[tuple[_Batch, Simplex, int | Fraction, bool]]:
        """Yield the candidates of each batch with their reduced costs, times the scale, and whether costs are integral.

        Each orbit of candidates comes up, as every simplex has facets.
        """
        for batch in self._batches():
            if not batch.simplices:
                continue
            costs = self.costs.of(batch.simplices)
            for simplex, cost, activity in zip(batch.simplices, costs, self._activities(batch), strict=True):
                yield batch, simplex, self.sign * self.scale * cost - activity, cost.denominator == 1

    def _batches(self) -> Iterator[_Batch]:
        """Yield the candidates over each representative of the orbits of (d-1)-simplices."""
        points, d = self.points, self.points.dimension
        for facet, length in zip(self.facets.representatives, self.facets.sizes, strict=True):
            plane = points.hyperplane(facet)
            plus, minus = points.sides(plane)
            simplices, orientations, volumes = [], [], []
            for point in range(points.n):
                side = (plus >> point & 1) - (minus >> point & 1)
                simplex = tuple(sorted((*facet, point)))
                if side and not (self.spanning and self._has_other_points(simplex)):
                    simplices.append(simplex)
                    volumes.append(self._coefficient(points.value(plane, point)) * side)
                    # The point moves forward past those that are greater.
                    orientations.append(side if (d - simplex.index(point)) % 2 == 0 else -side)
            yield _Batch(length, simplices, np.array(orientations, dtype=np.int64), volumes)

    def _has_other_points(self, simplex: Simplex) -> bool:
        inside = (1 << self.points.n) - 1
        for position, vertex in enumerate(simplex):
            plus, minus = self.sides[without(simplex, position)]
            inside &= ~(minus if plus >> vertex & 1 else plus)
        return inside != mask_of(simplex)

    def _activities(self, batch: _Batch) -> list[Fraction]:
        """Return the sum of multiplier times coefficient over all rows and cuts, for each candidate."""
        d = self.points.dimension
        columns = np.array(batch.simplices, dtype=np.int64).T
        activities = [self.volume * volume for volume in batch.volumes]
        for position in range(d + 1):
            labels = self.facets.labels[self.facets.ranks(np.delete(columns, position, axis=0))]
            # Of the facet in ascending order, with the remaining vertex behind it.
            signs = np.sign(labels) * batch.orientations * (1 if (d - position) % 2 == 0 else -1)
            for k, (number, sign) in enumerate(zip(np.abs(labels).tolist(), signs.tolist(), strict=True)):
                activities[k] += sign * self.rows[number]
        if self.simplices is not None:
            numbers = np.abs(self.simplices.labels[self.simplices.ranks(columns)]).tolist()
            for k, number in enumerate(numbers):
                activities[k] += self.in_orbits[number]
        return activities

"""What checkers of cuts share: the cut, the simplices that a triangulation may use, and which of them cross."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import copy
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import TYPE_CHECKING, Any

from bcut.errors import BcutError
from bcut.verification.exact_points import ExactPoints, SideTable, Simplex, mask_of, without

if TYPE_CHECKING:
    from bcut.verification.restrictions import RestrictionData


class UncheckedError(BcutError):
    """A cut that takes too long to check: nothing is known of it, so it is neither refused nor believed."""

    exit_status = 3


@dataclass(frozen=True)
class CertificateCut:
    """The inequality ``sum of coefficients[i] * x[simplices[i]] <= rhs`` and its multiplier.

    Attributes
    ----------
    family : str
        The name of the separator that made it.
    simplices : tuple of tuple of int
        Ascending vertices, none twice.
    coefficients : tuple of Fraction
    rhs : Fraction
    multiplier : Fraction
        For the minimisation of ``sign * costs``: not positive.
    proof : mapping
        What the family offers as a reason.
    """

    family: str
    simplices: tuple[Simplex, ...]
    coefficients: tuple[Fraction, ...]
    rhs: Fraction
    multiplier: Fraction
    proof: Mapping[str, Any]


class Candidates(SideTable):
    """Exact sides, and with them the simplices that a triangulation may use.

    Parameters
    ----------
    points : ExactPoints
    spanning : bool
        Only simplices without further points in them are candidates; otherwise all that are not flat.
    restrictions : RestrictionData, optional
        What the triangulations in question must have and must not have.
    """

    def __init__(
        self,
        points: ExactPoints,
        *,
        spanning: bool = False,
        restrictions: RestrictionData | None = None,
    ) -> None:
        super().__init__(points)
        self.restrictions = restrictions
        self.spanning = spanning
        self._only: frozenset[Simplex] | None = None
        # Of d-simplices and of smaller faces alike: they cross if they do not meet in a common face.
        self._crossing: dict[tuple[Simplex, Simplex], bool] = {}
        self._circuits: dict[Simplex, tuple[int, int]] = {}

    def only(self, simplices: Iterable[Simplex]) -> Candidates:
        """Return the same points with none but some of the candidates, such as those that reduced costs left.

        What is known already of sides and crossings is shared.
        """
        fewer = copy(self)
        fewer._only = frozenset(simplices)
        return fewer

    def __contains__(self, simplex: Simplex) -> bool:
        """Tell whether a triangulation may use an ascending simplex."""
        if self._only is not None and simplex not in self._only:
            return False
        if not self.orientation(simplex) or not self.admitted(simplex):
            return False
        if not self.spanning:
            return True
        inside = (1 << self.points.n) - 1
        for position, vertex in enumerate(simplex):
            plus, minus = self[without(simplex, position)]
            inside &= ~(minus if plus >> vertex & 1 else plus)
        return inside.bit_count() == len(simplex)

    def admitted(self, simplex: Simplex) -> bool:
        """Tell whether the restrictions leave an ascending simplex that is not flat."""
        return not self.restrictions or self.restrictions.admit(self, simplex)

    def crossing(self, first: Simplex, second: Simplex) -> bool:
        """Tell whether two d-simplices cross; remembers the answer, since cuts come back to the same pairs."""
        pair = (first, second) if first < second else (second, first)
        found = self._crossing.get(pair)
        if found is None:
            found = self._crossing[pair] = cross(self, *pair)
        return found

    def faces_crossing(self, first: Simplex, second: Simplex, rest: Simplex) -> bool:
        """Tell whether two faces of any dimension cross; `rest` extends the first one to an affine basis."""
        pair = (first, second) if first < second else (second, first)
        found = self._crossing.get(pair)
        if found is None:
            found = self._crossing[pair] = faces_cross(self, first, second, rest)
        return found

    def circuit(self, points: Simplex) -> tuple[int, int]:
        """Return the two parts of the affine dependence of d + 2 ascending points, as bit sets; remembers them."""
        found = self._circuits.get(points)
        if found is None:
            found = self._circuits[points] = _circuit(self, points)
        return found


def candidates_of(sides: SideTable) -> Candidates:
    """Return sides with candidates: every simplex that is not flat, unless they say otherwise."""
    return sides if isinstance(sides, Candidates) else Candidates(sides.points)


def cross(sides: SideTable, first: Simplex, second: Simplex) -> bool:
    """Tell whether a d-simplex and another simplex, of any dimension, do not meet in a common (possibly empty) face.

    They do not if and only if there is a circuit (Z+, Z-), a minimal affine dependence, with Z+ in `first`
    and Z- in `second`: its two parts are disjoint faces whose relative interiors meet. Since `first` is
    full-dimensional, Z extends, within the vertices of both, to d + 2 points that span the space, whose one
    dependence it is; so it is enough to look at those (d+2)-subsets.
    """
    circuit = sides.circuit if isinstance(sides, Candidates) else lambda points: _circuit(sides, points)
    outside_first, outside_second = ~mask_of(first), ~mask_of(second)
    for points in combinations(sorted({*first, *second}), sides.points.dimension + 2):
        plus, minus = circuit(points)
        if not plus | minus:
            continue
        if not (plus & outside_first or minus & outside_second):
            return True
        if not (minus & outside_first or plus & outside_second):
            return True
    return False


def faces_cross(sides: Candidates, first: Simplex, second: Simplex, rest: Simplex) -> bool:
    """Tell whether two simplices of any dimension do not meet in a common (possibly empty) face.

    They do not if and only if some circuit (Z+, Z-) among their vertices has Z+ in the one and Z- in the other. Further
    points that are independent of the vertices bring no more circuits in. With as many of them as the space needs, each
    circuit is the one dependence of d + 2 points that span the space.

    Parameters
    ----------
    sides : Candidates
    first, second : tuple of int
        Vertices of simplices, ascending.
    rest : tuple of int
        Points that extend the first one to an affine basis of the space.
    """
    size = sides.points.dimension + 1 - len(first)
    fresh = [vertex for vertex in second if vertex not in first]
    # As many points of the second as possible, and the other ones from the rest, make the first a basis.
    further = next(
        extension
        for count in range(min(size, len(fresh)), -1, -1)
        for part in combinations(fresh, count)
        for extension in combinations(rest, size - count)
        if not set(part) & set(extension) and sides.orientation(tuple(sorted((*first, *part, *extension))))
    )
    outside_first, outside_second = ~mask_of(first), ~mask_of(second)
    for points in combinations(sorted({*first, *fresh, *further}), sides.points.dimension + 2):
        plus, minus = sides.circuit(points)
        for one, other in ((plus, minus), (minus, plus)):
            if one | other and not (one & outside_first or other & outside_second):
                return True
    return False


def covers(sides: SideTable, simplex: Simplex, flag: Simplex) -> bool:
    """Tell whether a simplex contains the generic point of a flag, on each hyperplane the side of its first vertex."""
    for position, vertex in enumerate(simplex):
        plus, minus = sides[without(simplex, position)]
        if not (plus | minus) >> vertex & 1:
            return False  # it is flat, and perhaps this face of it spans no hyperplane
        own = plus if plus >> vertex & 1 else minus
        first = next(v for v in flag if (plus | minus) >> v & 1)
        if not own >> first & 1:
            return False
    return True


def _circuit(sides: SideTable, points: Simplex) -> tuple[int, int]:
    """Return the two parts of the affine dependence of d + 2 points, as bit sets, by the signs of Cramer's rule.

    Both are empty where the points do not span the space.
    """
    plus = minus = 0
    for position, point in enumerate(points):
        sign = sides.orientation(without(points, position)) * (-1 if position & 1 else 1)
        if sign > 0:
            plus |= 1 << point
        elif sign < 0:
            minus |= 1 << point
    return plus, minus

"""Exact points, the hyperplanes through d of them, and the sides on which the other points lie.

Rational points become integers over one denominator, and integer arithmetic decides. Points in a number
field get, for every coordinate, an integer approximation with a proven error: a side that is farther from
zero than the error can reach is decided by the same integer arithmetic, and every other one by arithmetic
in the field.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from functools import cache, cached_property
from itertools import combinations, pairwise
from math import factorial, lcm
from operator import mul
from typing import Any

from bcut.errors import VerificationError
from bcut.geometry.expressions import Expression
from bcut.geometry.numbers import AlgebraicNumber, unify

Scalar = int | Expression | AlgebraicNumber
Simplex = tuple[int, ...]

# Bits behind the binary point of an approximation. With so many, what stays undecided is zero but for rare
# exceptions.
_BITS = 128


class Hyperplane:
    """The hyperplane through d points f_0, ..., f_{d-1}, as a linear form.

    The form takes the value ``det(f_1 - f_0, ..., f_{d-1} - f_0, a - f_0)`` at a point a: it vanishes
    everywhere when the d points are affinely dependent.
    """

    __slots__ = ("exact", "normal", "offset", "points")

    def __init__(self, points: Simplex, normal: list[int], offset: int) -> None:
        self.points, self.normal, self.offset = points, normal, offset
        self.exact: tuple[list[Any], Any] | None = None


class ExactPoints:
    """Points with exact coordinates, numbered from 0.

    Parameters
    ----------
    points : sequence of n sequences of d exact scalars
        Integers, `Fraction`, `AlgebraicNumber` or what `parse_coordinate` returns; d >= 2.

    Raises
    ------
    VerificationError
        There are no points, or not all have the same number of coordinates.

    Attributes
    ----------
    n, dimension : int
    volume_unit : Fraction
        What `volume` counts in.
    """

    def __init__(self, points: Sequence[Sequence[Scalar]]) -> None:
        self.n = len(points)
        self.dimension = len(points[0]) if points else 0
        if self.dimension < 2 or any(len(point) != self.dimension for point in points):
            raise VerificationError(
                "points are needed, all of them with the same number of coordinates, at least 2"
            )
        numbers = [Fraction(x) if isinstance(x, int) else x for point in points for x in point]
        field, rows = unify(numbers)
        denominator = lcm(*{c.denominator for row in rows for c in row})
        integers = [[c.numerator * (denominator // c.denominator) for c in row] for row in rows]
        self.volume_unit = Fraction(1, factorial(self.dimension) * denominator**self.dimension)
        self._exact: list[list[AlgebraicNumber]] | None = None
        self._error = 0
        if field.degree == 1:
            self._integers = self._by_point([row[0] for row in integers])
            return
        elements = [AlgebraicNumber(field, tuple(row)) for row in integers]
        self._exact = self._by_point(elements)
        irrational = field.enclosures(_BITS)[1:]
        self._integers = self._by_point(
            [(row[0] << _BITS) + sum(map(mul, row[1:], irrational)) for row in integers]
        )
        self._error = self._determinant_error(max(sum(map(abs, row[1:])) for row in integers))

    def _by_point(self, values: list[Any]) -> list[list[Any]]:
        d = self.dimension
        return [values[i : i + d] for i in range(0, len(values), d)]

    def _determinant_error(self, coordinate_error: int) -> int:
        """Bound the error of ``det(p_1 - p_0, ..., p_d - p_0)`` by that of the coordinates.

        With W a bound on the entries of the approximate matrix M and 2 e one on those of its error E, the
        determinant is linear in each row, so det(M + E) - det(M) is a sum over the nonempty sets of rows
        taken from E. By Hadamard's inequality the sum is at most (sqrt(d) (W + 2 e))^d - (sqrt(d) W)^d.
        """
        d = self.dimension
        widths = [max(column) - min(column) for column in zip(*self._integers, strict=True)]
        width = max(widths)
        return d ** ((d + 1) // 2) * ((width + 2 * coordinate_error) ** d - width**d)

    def hyperplane(self, points: Simplex) -> Hyperplane:
        """Return the hyperplane through d points, with the orientation that their order gives."""
        normal, offset = _linear_form([self._integers[i] for i in points])
        return Hyperplane(points, normal, offset)

    def side(self, plane: Hyperplane, point: int) -> int:
        """Return the sign of the form at a point: -1, 0 or 1."""
        if point in plane.points:
            return 0
        value = sum(map(mul, plane.normal, self._integers[point])) - plane.offset
        error = self._error
        if value > error:
            return 1
        if value < -error:
            return -1
        return self.value(plane, point).sign() if error else 0

    def side_of_sum(self, plane: Hyperplane, points: Sequence[int]) -> int:
        """Return on which side the barycentre of some points lies: -1, 0 or 1."""
        normal, integers = plane.normal, self._integers
        value = sum([sum(map(mul, normal, integers[i])) for i in points]) - len(points) * plane.offset
        error = self._error * len(points)
        if value > error:
            return 1
        if value < -error:
            return -1
        if not error:
            return 0
        return sum((self.value(plane, i) for i in points), AlgebraicNumber.of(self._field, 0)).sign()

    def sides(self, plane: Hyperplane) -> tuple[int, int]:
        """Return the points strictly on the + side and those strictly on the - side, as bit sets."""
        plus = minus = 0
        normal, offset, error = plane.normal, plane.offset, self._error
        for index, point in enumerate(self._integers):
            value = sum(map(mul, normal, point)) - offset
            if value > error:
                plus |= 1 << index
            elif value < -error:
                minus |= 1 << index
            elif error:
                side = self.side(plane, index)
                plus |= (side > 0) << index
                minus |= (side < 0) << index
        return plus, minus

    def volume(self, simplex: Simplex) -> Any:
        """Return the exact volume of a simplex in units of `volume_unit`; zero if it is flat."""
        return abs(self.value(self.hyperplane(simplex[:-1]), simplex[-1]))

    @property
    def _field(self) -> Any:
        assert self._exact is not None
        return self._exact[0][0].field

    def value(self, plane: Hyperplane, point: int) -> Any:
        """Return the exact value of the linear form at a point, in the units that the form is written in."""
        if self._exact is None:
            return sum(map(mul, plane.normal, self._integers[point])) - plane.offset
        if plane.exact is None:
            plane.exact = _linear_form([self._exact[i] for i in plane.points])
        normal, offset = plane.exact
        return sum(map(mul, normal, self._exact[point])) - offset


class SideTable:
    """Which points lie on which side of the hyperplane through d given points.

    Each hyperplane is computed once, when it is first asked for.

    Parameters
    ----------
    points : ExactPoints
    """

    def __init__(self, points: ExactPoints) -> None:
        self.points = points
        self._sides: dict[Simplex, tuple[int, int]] = {}

    def __getitem__(self, facet: Simplex) -> tuple[int, int]:
        """Return the bit sets of points on the + and on the - side of an ascending d-tuple."""
        found = self._sides.get(facet)
        if found is None:
            found = self._sides[facet] = self.points.sides(self.points.hyperplane(facet))
        return found

    @cached_property
    def is_general(self) -> bool:
        """Whether no d + 1 points lie in a common hyperplane; this looks at all d-tuples."""
        everything = (1 << self.points.n) - 1
        facets = combinations(range(self.points.n), self.points.dimension)
        return all(
            plus | minus | mask_of(facet) == everything for facet in facets for plus, minus in [self[facet]]
        )

    def orientation(self, simplex: Simplex) -> int:
        """Return the sign of ``det(t_1 - t_0, ..., t_d - t_0)`` of an ascending (d+1)-tuple t."""
        plus, minus = self[simplex[:-1]]
        return (plus >> simplex[-1] & 1) - (minus >> simplex[-1] & 1)


def mask_of(points: Iterable[int]) -> int:
    """Return a set of points as the bits of an integer."""
    mask = 0
    for point in points:
        mask |= 1 << point
    return mask


def without(simplex: Simplex, position: int) -> Simplex:
    """Return the facet opposite to one vertex."""
    return simplex[:position] + simplex[position + 1 :]


def _linear_form(points: list[list[Any]]) -> tuple[list[Any], Any]:
    """Return normal and offset of the hyperplane through d points, over any commutative ring.

    No division occurs: every minor of the first k rows is expanded along the k-th, from the minors before
    it, which takes d 2^(d-1) products.
    """
    first = points[0]
    rows = [[a - b for a, b in zip(point, first, strict=True)] for point in points[1:]]
    minors = rows[0]
    for row, step in zip(rows[1:], _expansions(len(first)), strict=True):
        minors = [
            sum([row[j] * minors[k] if plus else -(row[j] * minors[k]) for j, k, plus in terms])
            for terms in step
        ]
    # The minors now lack one column each, the last one first.
    normal = [minor if k % 2 == 0 else -minor for k, minor in enumerate(minors)][::-1]
    return normal, sum(map(mul, normal, first))


@cache
def _expansions(d: int) -> list[list[list[tuple[int, int, bool]]]]:
    """Plan the expansions of `_linear_form`: for each further row, for each set of columns, its terms.

    A term names a column, the position of the minor without it, and whether its sign is +. Sets of columns
    are ordered as integers with those bits, so that the sets with all columns but one come in the order of
    falling missing column.
    """
    levels = [[mask for mask in range(1 << d) if mask.bit_count() == size] for size in range(1, d)]
    plan = []
    for smaller, larger in pairwise(levels):
        position = {mask: k for k, mask in enumerate(smaller)}
        plan.append(
            [
                [
                    (j, position[mask ^ 1 << j], (mask >> (j + 1)).bit_count() % 2 == 0)
                    for j in range(d)
                    if mask >> j & 1
                ]
                for mask in larger
            ]
        )
    return plan


def sign_of_order(order: Sequence[int]) -> int:
    """Return the sign of the permutation that sorts some different numbers."""
    inversions = sum(a > b for i, a in enumerate(order) for b in order[i + 1 :])
    return -1 if inversions & 1 else 1

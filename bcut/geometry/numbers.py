"""Exact real numbers: scalars of a number field, their canonical texts, one common field for many."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import total_ordering
from typing import Any

from bcut.errors import ConfigurationError
from bcut.geometry.expressions import MAX_BITS, Expression, Sum, parse_coordinate, terms_of
from bcut.geometry.fields import RATIONALS, RealField, field_for, real_field
from bcut.geometry.radicals import Term

__all__ = [
    "RATIONALS",
    "AlgebraicNumber",
    "RealField",
    "exact_scalar",
    "number_text",
    "parse_coordinate",
    "parse_number",
    "real_field",
    "unify",
]


@total_ordering
@dataclass(frozen=True, slots=True, eq=False)
class AlgebraicNumber:
    """An immutable element of a real number field, with plain exact arithmetic.

    Attributes
    ----------
    field : RealField
    coefficients : tuple of int or Fraction
        The number is sum_k coefficients[k] * basis_k. Products of the basis have integer coefficients, so that
        sums and products of numbers with integers here have integers again, without the cost of fractions.
    """

    field: RealField
    coefficients: tuple[int | Fraction, ...]

    @classmethod
    def of(cls, field: RealField, rational: Fraction | int) -> AlgebraicNumber:
        """Return a rational number as an element of the field."""
        return cls(field, (rational, *[0] * (field.degree - 1)))

    def is_rational(self) -> bool:
        """Whether the number is rational; then it equals its first coefficient."""
        return not any(self.coefficients[1:])

    def integers(self) -> tuple[list[int], int]:
        """Integer coefficients over one positive denominator."""
        denominator = math.lcm(*(c.denominator for c in self.coefficients))
        return [int(c * denominator) for c in self.coefficients], denominator

    def sign(self) -> int:
        """Exact sign: -1, 0 or 1."""
        return self.field.sign(self.integers()[0])

    def text(self) -> str:
        """Canonical text that `parse_number` reads back."""
        return number_text(self)

    def inverse(self) -> AlgebraicNumber:
        """1 / self.

        Raises
        ------
        ZeroDivisionError
            The number is zero.
        """
        if self.is_rational():
            return AlgebraicNumber.of(self.field, 1 / Fraction(self.coefficients[0]))
        if self.field.degree == 2:
            a, b = self.coefficients
            norm = Fraction(a * a - self.field.radicands[1] * b * b)  # not zero: the radicand is no square
            return AlgebraicNumber(self.field, (a / norm, -b / norm))
        import flint

        # Column j holds self * basis_j; the inverse is the combination of these columns that gives 1.
        r = self.field.degree
        matrix = flint.fmpq_mat(r, r)
        for (i, j), constants in self.field.products.items():
            for k, constant in constants:
                share = self.coefficients[i] * constant
                matrix[k, j] += flint.fmpq(share.numerator, share.denominator)
        solution = matrix.solve(flint.fmpq_mat(r, 1, [1] + [0] * (r - 1)))
        return AlgebraicNumber(self.field, tuple(Fraction(int(x.p), int(x.q)) for x in solution.entries()))

    def _coerce(self, other: object) -> AlgebraicNumber | None:
        if isinstance(other, AlgebraicNumber):
            if other.field is not self.field and other.field != self.field:
                raise ValueError("numbers of different fields; bring them into one with unify()")
            return other
        return AlgebraicNumber.of(self.field, other) if isinstance(other, int | Fraction) else None

    def __add__(self, other: object) -> AlgebraicNumber:
        right = self._coerce(other)
        if right is None:
            return NotImplemented
        pairs = zip(self.coefficients, right.coefficients, strict=True)
        return AlgebraicNumber(self.field, tuple(a + b for a, b in pairs))

    __radd__ = __add__

    def __neg__(self) -> AlgebraicNumber:
        return AlgebraicNumber(self.field, tuple(-c for c in self.coefficients))

    def __sub__(self, other: object) -> AlgebraicNumber:
        right = self._coerce(other)
        return NotImplemented if right is None else self + -right

    def __rsub__(self, other: object) -> AlgebraicNumber:
        return -self + other

    def __mul__(self, other: object) -> AlgebraicNumber:
        right = self._coerce(other)
        if right is None:
            return NotImplemented
        total: list[int | Fraction] = [0] * self.field.degree
        products = self.field.products
        for i, a in enumerate(self.coefficients):
            if not a:
                continue
            for j, b in enumerate(right.coefficients):
                if b:
                    for k, constant in products[i, j]:
                        total[k] += a * b * constant
        return AlgebraicNumber(self.field, tuple(total))

    __rmul__ = __mul__

    def __truediv__(self, other: object) -> AlgebraicNumber:
        right = self._coerce(other)
        return NotImplemented if right is None else self * right.inverse()

    def __rtruediv__(self, other: object) -> AlgebraicNumber:
        return self.inverse() * other

    def __pow__(self, exponent: int) -> AlgebraicNumber:
        base = self if exponent >= 0 else self.inverse()
        power = AlgebraicNumber.of(self.field, 1)
        for bit in bin(abs(exponent))[2:]:
            power = power * power
            if bit == "1":
                power = power * base
        return power

    def __eq__(self, other: object) -> bool:
        if isinstance(other, AlgebraicNumber) and other.field != self.field:
            rows = unify([self, other])[1]
            return rows[0] == rows[1]
        right = self._coerce(other)
        return NotImplemented if right is None else self.coefficients == right.coefficients

    def __lt__(self, other: object) -> bool:
        right = self._coerce(other)
        return NotImplemented if right is None else (self - right).sign() < 0

    def __hash__(self) -> int:
        # The nearest float does not depend on the field in which the number is written.
        return hash(self.coefficients[0]) if self.is_rational() else hash(float(self))

    def __bool__(self) -> bool:
        return any(self.coefficients)

    def __float__(self) -> float:
        return self.field.nearest_float(*self.integers())

    def __abs__(self) -> AlgebraicNumber:
        return -self if self.sign() < 0 else self


def exact_scalar(field: RealField, numerators: Sequence[int], denominator: int) -> Fraction | AlgebraicNumber:
    """Return sum_k numerators[k] * basis_k / denominator; a plain Fraction where the field is Q."""
    coefficients = tuple(Fraction(int(c), int(denominator)) for c in numerators)
    return coefficients[0] if field.degree == 1 else AlgebraicNumber(field, coefficients)


def parse_number(text: str) -> Fraction | AlgebraicNumber:
    """Read one number, in the smallest field that its text needs.

    Raises
    ------
    ConfigurationError
        The text is no number of the grammar.
    """
    field, (coefficients,) = unify([parse_coordinate(text)])
    return coefficients[0] if field.degree == 1 else AlgebraicNumber(field, coefficients)


def unify(
    values: Sequence[Expression | AlgebraicNumber],
) -> tuple[RealField, list[tuple[Fraction, ...]]]:
    """Write numbers in one field.

    The field depends on the values' texts only, and is the same again when their canonical texts are read
    back.

    Returns
    -------
    field : RealField
    rows : list of tuple of Fraction
        The coefficients of each value on the field's basis.

    Raises
    ------
    ConfigurationError
        No field of moderate degree holds all of them, or a value divides by zero or grows too large.
    """
    if all(isinstance(value, Fraction) for value in values):
        return RATIONALS, [(value,) for value in values if isinstance(value, Fraction)]
    field = field_for(term for value in values for term in _terms(value))
    rows = [tuple(map(Fraction, _in_field(value, field).coefficients)) for value in values]
    while True:  # each step needs a smaller field; a text that is read back must find the last one
        used = [any(row[k] for row in rows) for k in range(field.degree)]
        basis = field.basis_terms()
        smaller = field_for(term for (_, term), is_used in zip(basis, used, strict=True) if is_used)
        if smaller == field:
            return field, rows
        images = {
            k: [factor * c for c in smaller.embed(term)] for k, (factor, term) in enumerate(basis) if used[k]
        }
        rows = [
            tuple(sum((row[k] * images[k][j] for k in images), Fraction(0)) for j in range(smaller.degree))
            for row in rows
        ]
        field = smaller


def number_text(number: Fraction | AlgebraicNumber) -> str:
    """Canonical text of a number, which `parse_number` reads back: "3", "-1/2", "1/2+1/2*sqrt(5)"."""
    if isinstance(number, Fraction):
        return str(number)
    text = ""
    for coefficient, (factor, (_, turns, radicand)) in zip(
        number.coefficients, number.field.basis_terms(), strict=True
    ):
        scaled = coefficient * factor
        if not scaled:
            continue
        atoms = []
        if turns:
            atoms.append(f"cos({2 * turns.numerator}*pi/{turns.denominator})")
        if radicand != 1:
            atoms.append(f"sqrt({radicand})")
        if abs(scaled) != 1 or not atoms:
            atoms.insert(0, str(abs(scaled)))
        text += ("-" if scaled < 0 else "+" if text else "") + "*".join(atoms)
    return text or "0"


def _terms(value: Expression | AlgebraicNumber) -> Iterable[Term]:
    if isinstance(value, AlgebraicNumber):
        pairs = zip(value.coefficients, value.field.basis_terms(), strict=True)
        return [term for coefficient, (_, term) in pairs if coefficient]
    return terms_of(value)


def _in_field(value: Any, field: RealField) -> AlgebraicNumber:
    if isinstance(value, Fraction):
        return AlgebraicNumber.of(field, value)
    if isinstance(value, AlgebraicNumber):
        parts = zip(value.coefficients, value.field.basis_terms(), strict=True)
        return _embedded(
            [(c * factor, turns, radicand) for c, (factor, (_, turns, radicand)) in parts if c], field
        )
    if isinstance(value, Sum):
        return _embedded(value.terms, field)
    left = _in_field(value.left, field)
    if value.operator == "**":
        return _power(left, value.right.numerator)
    right = _in_field(value.right, field)
    if value.operator == "+":
        return _bounded(left + right)
    if value.operator == "-":
        return _bounded(left - right)
    if value.operator == "*":
        return _bounded(left * right)
    if not right:
        raise ConfigurationError("a coordinate divides by an expression that is exactly zero")
    return _bounded(left / right)


def _embedded(terms: Iterable[Term], field: RealField) -> AlgebraicNumber:
    total = AlgebraicNumber.of(field, 0)
    for term in terms:
        total = total + AlgebraicNumber(field, tuple(field.embed(term)))
    return total


def _power(base: AlgebraicNumber, exponent: int) -> AlgebraicNumber:
    if exponent < 0 and not base:
        raise ConfigurationError("a coordinate divides by an expression that is exactly zero")
    if exponent < 0:
        base, exponent = base.inverse(), -exponent
    power = AlgebraicNumber.of(base.field, 1)
    for bit in bin(exponent)[2:]:
        power = _bounded(power * power)
        if bit == "1":
            power = _bounded(power * base)
    return power


def _bounded(value: AlgebraicNumber) -> AlgebraicNumber:
    if any(max(c.numerator.bit_length(), c.denominator.bit_length()) > MAX_BITS for c in value.coefficients):
        raise ConfigurationError(f"a coordinate leads to integers of more than {MAX_BITS} bits")
    return value

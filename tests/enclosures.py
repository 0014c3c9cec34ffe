"""Exact real numbers in interval arithmetic, from their definition."""

from __future__ import annotations

from fractions import Fraction

import flint
from hypothesis import strategies as st

from bcut.geometry.numbers import (
    AlgebraicNumber,
)

BITS = 600


def enclosed(value: Fraction) -> flint.arb:
    return flint.arb(flint.fmpq(value.numerator, value.denominator))


def enclosed_number(number: Fraction | AlgebraicNumber) -> flint.arb:
    """The number from its definition as a combination of basis elements, in interval arithmetic."""
    if isinstance(number, Fraction):
        return enclosed(number)
    total = flint.arb(0)
    for coefficient, (factor, (_, turns, radicand)) in zip(
        number.coefficients, number.field.basis_terms(), strict=True
    ):
        angle = flint.fmpq(2 * turns.numerator, turns.denominator)
        cosine = flint.arb.cos_pi_fmpq(angle) if turns else flint.arb(1)
        total += enclosed(coefficient * factor) * cosine * flint.arb(radicand).sqrt()
    return total


def rationals(limit: int = 20) -> st.SearchStrategy[Fraction]:
    return st.builds(Fraction, st.integers(-limit, limit), st.integers(1, 6))

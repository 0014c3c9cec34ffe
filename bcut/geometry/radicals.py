"""Square roots of rationals and cosines of rational multiples of pi, as sums of terms in normal form."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache

from bcut.errors import ConfigurationError

_TRIAL_DIVISION = 2000

#: A term of a number: coefficient, angle of a cosine in turns (0: no cosine), radicand (1: no square root).
Term = tuple[Fraction, Fraction, int]

# cos(2 pi t) where square roots suffice: t -> denominator, and the numerator of each sqrt(radicand).
_QUADRATIC_COSINES: dict[Fraction, tuple[int, dict[int, int]]] = {
    Fraction(0): (1, {1: 1}),
    Fraction(1, 3): (2, {1: -1}),
    Fraction(1, 4): (1, {}),
    Fraction(1, 5): (4, {1: -1, 5: 1}),
    Fraction(2, 5): (4, {1: -1, 5: -1}),
    Fraction(1, 8): (2, {2: 1}),
    Fraction(3, 8): (2, {2: -1}),
    Fraction(1, 12): (2, {3: 1}),
    Fraction(5, 12): (2, {3: -1}),
    Fraction(1, 24): (4, {6: 1, 2: 1}),
    Fraction(5, 24): (4, {6: 1, 2: -1}),
    Fraction(7, 24): (4, {6: -1, 2: 1}),
    Fraction(11, 24): (4, {6: -1, 2: -1}),
}


def sqrt_terms(value: Fraction) -> tuple[Term, ...]:
    """sqrt(value) of a non-negative rational as a rational times the square root of a squarefree integer."""
    numerator_root, numerator_radicand = _squarefree_split(value.numerator)
    denominator_root, denominator_radicand = _squarefree_split(value.denominator)
    # p/q in lowest terms: sqrt(p/q) = sqrt(pq)/q, and the squarefree parts of p and q are coprime.
    coefficient = Fraction(numerator_root, denominator_root * denominator_radicand)
    return ((coefficient, Fraction(0), numerator_radicand * denominator_radicand),) if coefficient else ()


def cosine_terms(turns: Fraction) -> tuple[Term, ...]:
    """cos(2 pi turns) as terms; square roots alone where they suffice."""
    sign, turns = reduce_turns(turns)
    if turns not in _QUADRATIC_COSINES:
        return ((Fraction(sign), turns, 1),)
    denominator, numerators = _QUADRATIC_COSINES[turns]
    return tuple(
        (Fraction(sign * c, denominator), Fraction(0), radicand) for radicand, c in numerators.items()
    )


def rewrite(term: Term) -> list[Term]:
    """Return the term with cosines left only where square roots do not suffice."""
    coefficient, turns, radicand = term
    return [
        (coefficient * c * math.gcd(radicand, r), t, class_product(radicand, r))
        for c, t, r in cosine_terms(turns)
    ]


def reduce_turns(turns: Fraction) -> tuple[int, Fraction]:
    """Sign s and angle t in [0, 1/2], denominator not 2 mod 4, with cos(2 pi turns) = s cos(2 pi t)."""
    turns %= 1
    sign = 1
    if turns.denominator % 4 == 2:
        sign, turns = -1, (turns - Fraction(1, 2)) % 1
    return sign, min(turns, 1 - turns)


def gauss_sum(radicand: int) -> list[tuple[Fraction, Fraction]]:
    """sqrt(radicand) as pairs (coefficient, angle in turns) of cosines: a quadratic Gauss sum."""
    if radicand == 1:
        return [(Fraction(1), Fraction(0))]
    import flint

    conductor = conductor_of(radicand)
    scale = Fraction(1) if conductor == radicand else Fraction(1, 2)
    pairs = []
    for a in range(1, conductor):
        if math.gcd(a, conductor) == 1:
            symbol = flint.fmpz(a).jacobi(conductor) if conductor % 2 else flint.fmpz(conductor).jacobi(a)
            pairs.append((scale * int(symbol), Fraction(a, conductor)))
    return pairs


def conductor_of(radicand: int) -> int:
    """Least N with sqrt(radicand) in the N-th cyclotomic field, for a positive squarefree radicand."""
    return radicand if radicand % 4 == 1 else 4 * radicand


def class_product(a: int, b: int) -> int:
    """Squarefree part of the product of two squarefree integers."""
    common = math.gcd(a, b)
    return (a // common) * (b // common)


def reduce_class(echelon: dict[int, int], radicand: int) -> int:
    """Reduce a squarefree integer, as a vector of prime exponents over GF(2), by an echelon form."""
    for prime, row in echelon.items():
        if radicand % prime == 0:
            radicand = class_product(radicand, row)
    return radicand


def insert_class(echelon: dict[int, int], radicand: int) -> None:
    """Add a square class to a reduced echelon form over GF(2), whose pivots are the largest primes."""
    radicand = reduce_class(echelon, radicand)
    if radicand == 1:
        return
    pivot = max(_prime_factors(radicand))
    for prime, row in list(echelon.items()):
        if row % pivot == 0:
            echelon[prime] = class_product(row, radicand)
    echelon[pivot] = radicand


def is_squarefree(value: int) -> bool:
    """Whether no square above 1 divides a positive integer."""
    return _squarefree_split(value)[0] == 1


def totient(value: int) -> int:
    """Euler's phi."""
    result = value
    for prime in _prime_factors(value):
        result -= result // prime
    return result


def _prime_factors(value: int) -> dict[int, int]:
    """Prime -> exponent. Trial division for small values spares the import of a library for sqrt(5)."""
    factors: dict[int, int] = {}
    prime = 2
    while prime * prime <= value and prime < _TRIAL_DIVISION:
        while value % prime == 0:
            factors[prime] = factors.get(prime, 0) + 1
            value //= prime
        prime += 1
    if 1 < value < _TRIAL_DIVISION**2:
        factors[value] = 1
    elif value > 1:
        import flint

        factors.update((int(p), int(e)) for p, e in flint.fmpz(value).factor())
    return factors


@lru_cache(maxsize=4096)
def _squarefree_split(value: int) -> tuple[int, int]:
    """Integers s, f with value = s**2 * f and f squarefree."""
    root = math.isqrt(value)
    if root * root == value:
        return root, 1
    if value >= 2**64:
        raise ConfigurationError(
            f"sqrt of an integer of {value.bit_length()} bits needs its factorisation; "
            "at most 64 bits are possible unless it is a perfect square"
        )
    square, radicand = 1, 1
    for prime, exponent in _prime_factors(value).items():
        square *= prime ** (exponent // 2)
        radicand *= prime ** (exponent % 2)
    return square, radicand

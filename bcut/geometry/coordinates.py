"""From what a person hands in (nested sequences, arrays, texts) to exact integers over one denominator."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

from bcut.errors import ConfigurationError
from bcut.geometry.expressions import Expression, Operation, Sum, parse_coordinate
from bcut.geometry.numbers import RATIONALS, AlgebraicNumber, RealField, unify

_INT64_LIMIT = 2**62
_MAX_DENOMINATOR_BITS = 16_000
_EXACT_FLOAT = 2**53


@dataclass(frozen=True, slots=True)
class Coordinates:
    """Points in one number field.

    Attributes
    ----------
    field : RealField
    numerators : (n, d, r) array
        int64 where all entries are below 2**62 in absolute value, otherwise Python integers.
    denominator : int
        Positive; coordinate j of point i is sum_k numerators[i, j, k] * basis_k / denominator, in lowest
        terms.
    """

    field: RealField
    numerators: npt.NDArray[Any]
    denominator: int


def coordinates_of(values: Any) -> Coordinates:
    """Read points from an (n, d) array or from nested sequences of numbers and coordinate texts.

    Raises
    ------
    ConfigurationError
        Not two levels deep, ragged, or an entry that is no finite exact real number.
    """
    if isinstance(values, np.ndarray) and values.dtype != object:
        return _from_array(values)
    rows = _rows(values)
    width = len(rows[0]) if rows else 0
    for index, row in enumerate(rows):
        if len(row) != width:
            raise ConfigurationError(
                f"point {index} has {len(row)} coordinates but point 0 has {width} (points count from 0); "
                "give every point the same number of coordinates"
            )
    kinds: set[type] = {type(value) for row in rows for value in row}
    if kinds == {float}:
        return _from_array(np.array(rows, dtype=np.float64))
    if kinds == {int}:
        return _reduced(RATIONALS, np.array(rows, dtype=object).reshape(len(rows), width, 1), 1)
    field, parsed = unify([_entry(value, i, j) for i, row in enumerate(rows) for j, value in enumerate(row)])
    return from_coefficients(field, parsed, (len(rows), width))


def from_coefficients(
    field: RealField, coefficients: Sequence[Sequence[Fraction]], shape: tuple[int, int]
) -> Coordinates:
    """Points from the coefficients of their n * d coordinates, row by row."""
    denominator = 1
    for value in {c.denominator for row in coefficients for c in row}:
        denominator = math.lcm(denominator, value)
        if denominator.bit_length() > _MAX_DENOMINATOR_BITS:
            raise ConfigurationError(
                f"the least common denominator of all coordinates has over {_MAX_DENOMINATOR_BITS} bits; "
                "use coordinates with fewer different denominators"
            )
    numerators = np.empty((len(coefficients), field.degree), dtype=object)
    for index, row in enumerate(coefficients):
        numerators[index] = [c.numerator * (denominator // c.denominator) for c in row]
    return _reduced(field, numerators.reshape(*shape, field.degree), denominator)


def nearest_floats(coordinates: Coordinates) -> npt.NDArray[np.float64]:
    """Return the nearest float64 of every coordinate, (n, d).

    Raises
    ------
    ConfigurationError
        A coordinate is beyond the range of float64.
    """
    numerators, denominator, field = coordinates.numerators, coordinates.denominator, coordinates.field
    small = numerators.dtype != object and denominator <= _EXACT_FLOAT
    if field.degree == 1 and small and np.abs(numerators).max(initial=0) <= _EXACT_FLOAT:
        return numerators[:, :, 0] / float(denominator)  # both are exact, and the quotient is rounded once
    floats = np.empty(numerators.shape[:2])
    for i, row in enumerate(numerators.tolist()):
        for j, coefficients in enumerate(row):
            floats[i, j] = field.nearest_float(coefficients, denominator)
    for i, j in np.argwhere(np.isinf(floats))[:1].tolist():
        raise ConfigurationError(
            f"coordinate {j} of point {i} (both count from 0) is beyond the range of float64, about 1.8e308; "
            "scale the points down"
        )
    return floats


def _rows(values: Any) -> list[list[Any]]:
    if isinstance(values, np.ndarray):
        values = values.tolist()
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise ConfigurationError(f"points must be a list of coordinate lists, not {type(values).__name__}")
    rows = []
    for index, point in enumerate(values):
        if isinstance(point, str | bytes | dict) or not isinstance(point, Iterable):
            raise ConfigurationError(
                f"point {index} (counted from 0) is {_shown(point)}, not a list of coordinates; "
                'write points like [[0, 0], [1, 0], ["1/2", "sqrt(3)/2"]]'
            )
        rows.append(point.tolist() if isinstance(point, np.ndarray) else list(point))
    return rows


def _entry(value: Any, i: int, j: int) -> Expression | AlgebraicNumber:
    """One coordinate as an exact value."""
    where = f"coordinate {j} of point {i} (both count from 0)"
    if isinstance(value, str):
        try:
            return parse_coordinate(value)
        except ConfigurationError as error:
            raise ConfigurationError(f"{where}: {error}") from None
    if isinstance(value, AlgebraicNumber | Sum | Operation):
        return value
    if isinstance(value, int | Fraction | np.integer) and type(value) is not bool:
        return Fraction(int(value.numerator), int(value.denominator))
    if isinstance(value, float | np.floating):
        if np.isfinite(value):
            return Fraction(*value.as_integer_ratio())
        raise ConfigurationError(f"{where} is {value}; coordinates must be finite numbers")
    raise ConfigurationError(f"{where} is {_shown(value)}, not an integer, a rational, a float or a text")


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _from_array(values: npt.NDArray[Any]) -> Coordinates:
    if values.ndim != 2:
        raise ConfigurationError(
            f"an array of shape {values.shape} holds no points; "
            "its shape must be (number of points, dimension)"
        )
    if values.dtype.kind in "iu":
        return _reduced(
            RATIONALS, values[:, :, np.newaxis].astype(object if values.dtype == np.uint64 else np.int64), 1
        )
    if values.dtype.kind != "f":
        if values.dtype.kind in "US":
            return coordinates_of(values.astype(str).tolist())
        raise ConfigurationError(
            f"an array of type {values.dtype} holds no real coordinates; use integers or floats"
        )
    for i, j in np.argwhere(~np.isfinite(values))[:1].tolist():
        raise ConfigurationError(
            f"coordinate {j} of point {i} (both count from 0) is {values[i, j]}; "
            "coordinates must be finite numbers"
        )
    if values.dtype.itemsize > 8:
        return coordinates_of([list(row) for row in values])
    return _from_float64(values.astype(np.float64))


def _from_float64(values: npt.NDArray[np.float64]) -> Coordinates:
    """Every finite float64 is an integer times a power of two."""
    fractions, exponents = np.frexp(values)
    mantissas = (fractions * 2.0**53).astype(np.int64)
    shifts = np.where(mantissas == 0, 0, exponents.astype(np.int64) - 53)
    low_bits = np.maximum(
        mantissas & -mantissas, 1
    )  # a power of two: float64 holds it, and its logarithm is exact
    trailing = np.log2(low_bits.astype(np.float64)).astype(np.int64)
    mantissas >>= trailing
    shifts += trailing
    scale = max(0, int(-shifts.min(initial=0)))
    lifts = shifts + scale
    bits = np.frexp(np.abs(mantissas).astype(np.float64))[1] + lifts
    if bits.max(initial=0) <= 62:
        numerators = np.left_shift(mantissas, np.where(mantissas == 0, 0, lifts))
    else:
        pairs = zip(mantissas.ravel().tolist(), lifts.ravel().tolist(), strict=True)
        numerators = np.empty(values.size, dtype=object)
        numerators[:] = [m << s if m else 0 for m, s in pairs]
        numerators = numerators.reshape(values.shape)
    return _reduced(RATIONALS, numerators[:, :, np.newaxis], 1 << scale)


def _reduced(field: RealField, numerators: npt.NDArray[Any], denominator: int) -> Coordinates:
    """Lowest terms, int64 where it holds all entries, read-only."""
    if numerators.dtype == object:
        common = math.gcd(denominator, *numerators.ravel().tolist()) if denominator > 1 else 1
        if common > 1:
            numerators = numerators // common
        if all(-_INT64_LIMIT < value < _INT64_LIMIT for value in numerators.ravel().tolist()):
            numerators = numerators.astype(np.int64)
    else:
        common = math.gcd(denominator, int(np.gcd.reduce(numerators, axis=None))) if denominator > 1 else 1
        if common > 1:
            numerators = numerators // common
        if numerators.size and (numerators.max() >= _INT64_LIMIT or numerators.min() <= -_INT64_LIMIT):
            numerators = numerators.astype(object)
    numerators = np.ascontiguousarray(numerators)
    numerators.setflags(write=False)
    return Coordinates(field, numerators, denominator // common)

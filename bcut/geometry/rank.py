"""Exact affine rank of points: floats choose what to try, exact arithmetic decides."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from bcut.geometry.coordinates import Coordinates
from bcut.geometry.numbers import AlgebraicNumber, exact_scalar

Scalar = Fraction | AlgebraicNumber


def affine_rank(coordinates: Coordinates, floats: npt.NDArray[np.float64]) -> int:
    """Dimension of the affine hull of the points.

    Parameters
    ----------
    coordinates : Coordinates
        At least one point.
    floats : (n, d) array
        Approximate points. They suggest d + 1 independent points, which is all that full rank takes to prove;
        only when the suggestion fails are all points eliminated exactly.
    """
    dimension = floats.shape[1]
    suggestion = _independent_looking(floats)
    if (
        len(suggestion) == dimension
        and len(pivot_columns(_differences(coordinates, suggestion))) == dimension
    ):
        return dimension
    return len(pivot_columns(_differences(coordinates, range(1, len(floats)))))


def pivot_columns(rows: Iterable[Sequence[Scalar]]) -> list[int]:
    """Columns that carry the pivots of an exact elimination; their number is the rank.

    The rows restricted to these columns have the same rank. Stops reading when the rank cannot grow any more.
    """
    echelon: list[tuple[int, list[Scalar]]] = []
    for row in rows:
        rest = list(row)
        for column, pivot_row in echelon:
            factor = rest[column]
            if factor:
                rest = [value - factor * other for value, other in zip(rest, pivot_row, strict=True)]
        pivot = next((j for j, value in enumerate(rest) if value), None)
        if pivot is not None:
            inverse = 1 / rest[pivot]
            echelon.append((pivot, [value * inverse for value in rest]))
            if len(echelon) == len(rest):
                break
    return sorted(column for column, _ in echelon)


def _differences(coordinates: Coordinates, indices: Iterable[int]) -> Iterable[list[Scalar]]:
    """Differences to point 0; the common denominator does not matter for a rank."""
    base = coordinates.numerators[0].tolist()
    for index in indices:
        point = coordinates.numerators[index].tolist()
        yield [
            exact_scalar(coordinates.field, [a - b for a, b in zip(value, origin, strict=True)], 1)
            for value, origin in zip(point, base, strict=True)
        ]


def _independent_looking(floats: npt.NDArray[np.float64]) -> list[int]:
    """Up to d points whose differences to point 0 are far from dependent, by pivoted Gram-Schmidt."""
    scale = np.abs(floats).max(axis=0)
    scaled = floats / np.where(scale > 0, scale, 1.0)
    rest = scaled - scaled[0]
    chosen: list[int] = []
    for _ in range(floats.shape[1]):
        squares = np.einsum("ij,ij->i", rest, rest)
        best = int(squares.argmax())
        if not squares[best] > 0:
            break
        chosen.append(best)
        direction = rest[best] / np.sqrt(squares[best])
        rest = rest - np.outer(rest @ direction, direction)
    return chosen

"""Differences of points as doubles, each rounded once, and as integers: what geometric measures are made of.

A measure computed from these depends on nothing but the shape of the simplex: translations change no bit of it, and
neither does the choice of the other simplices that are asked for.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.coordinates import Coordinates, nearest_floats
from bcut.geometry.subsets import all_subsets, ranks

# Bits behind the binary point of integers that stand for coordinates in a number field.
_BITS = 320


class Corners(Protocol):
    """Simplices of one size, seen from their vertices: vertex k of all of them is "k"."""

    def difference(self, i: int, j: int) -> list[Any]:
        """Return the coordinates of vertex j minus vertex i, for i < j: d arrays of shape (m,)."""


class Edges:
    """The differences of the points of a configuration.

    Attributes
    ----------
    exponent : int
        Differences are given in units of ``2**exponent``, in which none exceeds 1.
    """

    def __init__(self, configuration: PointConfiguration) -> None:
        self.configuration = configuration
        floats = configuration.floats
        with np.errstate(under="ignore"):
            half_width = float((floats.max(axis=0) / 2 - floats.min(axis=0) / 2).max())
        self.exponent = int(np.frexp(half_width)[1]) + 1
        # Differences of doubles are rounded once by the subtraction; other coordinates need a table.
        self._scaled = self._scale(floats) if _are_doubles(configuration) else None

    def _scale(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        with np.errstate(under="ignore"):
            return np.ldexp(values, -self.exponent)

    def between(self, first: NDArray[np.integer], second: NDArray[np.integer]) -> list[NDArray[np.float64]]:
        """Return the coordinates of the points `second` minus those of `first`: d arrays.

        Parameters
        ----------
        first, second : ndarray of int, shape (m,)
            ``first < second`` in each entry.
        """
        if self._scaled is not None:
            return [column[second] - column[first] for column in self._scaled.T]
        pairs = ranks(np.stack((first, second), axis=-1), self.configuration.n)
        return [column[pairs] for column in self._table.T]

    @cached_property
    def _table(self) -> NDArray[np.float64]:
        """The differences of all pairs in colexicographic order, shape (C(n, 2), d)."""
        configuration = self.configuration
        pairs = all_subsets(configuration.n, 2)
        numerators = configuration.numerators.astype(object)
        differences = numerators[pairs[:, 1]] - numerators[pairs[:, 0]]
        exact = Coordinates(configuration.field, differences, configuration.denominator)
        return self._scale(nearest_floats(exact))

    @cached_property
    def integers(self) -> NDArray[np.object_]:
        """The points as integers in some common unit, shape (n, d); in a number field correct to `_BITS` bits."""
        numerators = self.configuration.numerators.astype(object)
        field = self.configuration.field
        if field.degree == 1:
            return numerators[:, :, 0]
        basis = np.array(field.enclosures(_BITS), dtype=object)
        return (numerators * basis).sum(axis=-1)

    @property
    def integer_unit(self) -> Fraction:
        """What `integers` count."""
        configuration = self.configuration
        return Fraction(1, configuration.denominator << (_BITS if configuration.field.degree > 1 else 0))


@lru_cache(maxsize=2)
def edges_of(configuration: PointConfiguration) -> Edges:
    """Return the differences of a configuration, remembered for the next question about it."""
    return Edges(configuration)


class FloatCorners:
    """Simplices with differences in doubles."""

    def __init__(self, edges: Edges, simplices: NDArray[np.integer]) -> None:
        self.edges, self.columns = edges, simplices.T

    def difference(self, i: int, j: int) -> list[Any]:
        """Return the coordinates of vertex j minus vertex i."""
        return self.edges.between(self.columns[i], self.columns[j])


class IntegerCorners:
    """Simplices with differences in Python integers."""

    def __init__(self, edges: Edges, simplices: NDArray[np.integer]) -> None:
        self.points = edges.integers[simplices]

    def difference(self, i: int, j: int) -> list[Any]:
        """Return the coordinates of vertex j minus vertex i."""
        return list((self.points[:, j] - self.points[:, i]).T)

    def bits(self) -> list[int]:
        """Return, for each simplex, how many bits its differences from the first vertex take at most."""
        spans = np.abs(self.points - self.points[:, :1]).max(axis=(1, 2))
        return [int(span).bit_length() for span in spans]


def as_doubles(values: NDArray[np.object_], shifts: list[int]) -> NDArray[np.float64]:
    """Return ``values / 2**shifts``, each rounded once."""
    pairs = zip(values.tolist(), shifts, strict=True)
    return np.array([value / (1 << shift) for value, shift in pairs], dtype=float)


def _are_doubles(configuration: PointConfiguration) -> bool:
    """Tell whether every coordinate is a double, and so equal to its nearest one."""
    denominator = configuration.denominator
    if configuration.field.degree > 1 or denominator & (denominator - 1):
        return False
    exact = zip(configuration.numerators.ravel().tolist(), configuration.floats.ravel().tolist(), strict=True)
    return all(Fraction(value, denominator) == Fraction(double) for value, double in exact)

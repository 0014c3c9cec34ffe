"""All d-simplices of a configuration, or all empty ones, as arrays, at the speed of memory.

`bcut.geometry.simplices` does the same from tables of all signs; it needs no compiled code and is faster for
small configurations. Here the exact rotations about the ridges come first (`bcut.geometry.rotations`), and the
rest are compiled loops over small integers, whose work for empty simplices grows with the number of facets times
the number of points, not with the number of all simplices.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.errors import TooLargeError
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.rank import pivot_columns
from bcut.geometry.rotations import Rotations, sweep_order

# A simplex takes 8 bytes while they are listed and about 30 in a program; beyond this, no workstation holds them.
MAX_SIMPLICES = 200_000_000
# Steps of a compiled loop between two looks at what Python has to do (Ctrl-C), and keys of a piece of the list.
_STEPS = 100_000_000
_PIECE = 1 << 20


@dataclass(frozen=True, eq=False)
class SimplexArrays:
    """Simplices with their orientations.

    Attributes
    ----------
    vertices : ndarray of uint16 (or uint32), shape (m, d + 1)
        Ascending, in colexicographic order.
    orientations : ndarray of int8, shape (m,)
        1 or -1.
    rotations : Rotations
        From which they come.
    """

    vertices: NDArray[np.unsignedinteger[Any]]
    orientations: NDArray[np.int8]
    rotations: Rotations

    @property
    def size(self) -> int:
        """Number of simplices."""
        return len(self.vertices)


def list_simplices(configuration: PointConfiguration, *, spanning: bool = False) -> SimplexArrays:
    """List the d-simplices that a triangulation may use, by compiled code.

    Parameters
    ----------
    configuration : PointConfiguration
    spanning : bool
        Keep only empty simplices, as `bcut.geometry.simplices.candidate_simplices` does.

    Raises
    ------
    TooLargeError
        There are more than `MAX_SIMPLICES`, or the table of rotations would be too large.
    """
    from bcut.geometry import _rank_kernels

    n, d = configuration.n, configuration.dimension
    rotations = Rotations.of(configuration, sweep_order(configuration) if spanning else None)
    binomials = binomial_table(n, d + 1)
    pieces, total = [], 0
    for piece in _empty_keys(rotations, binomials) if spanning else _all_keys(rotations, binomials):
        pieces.append(piece)
        total += len(piece)
        if total > MAX_SIMPLICES:
            raise TooLargeError(
                f"{configuration.name}: {n} points in dimension {d} have more than {MAX_SIMPLICES:,} "
                f"{'empty ' if spanning else ''}simplices. Take fewer points."
            )
    keys = np.concatenate(pieces)
    pieces.clear()
    if spanning:
        keys.sort()
    orientations = (2 * (keys & 1) - 1).astype(np.int8)
    keys >>= 1
    vertices = np.empty((len(keys), d + 1), dtype=np.uint16 if n <= 1 << 16 else np.uint32)
    _rank_kernels.unrank(keys, binomials, vertices)
    return SimplexArrays(vertices, orientations, rotations)


def binomial_table(n: int, size: int) -> NDArray[np.int64]:
    """Return C(v, j) for j up to `size` and v up to n, shape (size + 1, n + 1)."""
    return np.array([[comb(v, j) for v in range(n + 1)] for j in range(size + 1)], dtype=np.int64)


def _empty_keys(rotations: Rotations, binomials: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    """Yield the keys of empty simplices, in no particular order."""
    from bcut.geometry import _kernels

    n, ridge = rotations.n, np.arange(rotations.dimension - 1, dtype=np.int64)
    keys = np.empty(max(_PIECE, n * n // 2 + 1), dtype=np.int64)
    rank, ridges = 0, len(rotations.half_turns)
    step = max(1, _STEPS // (n * n))
    while rank < ridges:
        rank, count = _kernels.list_empty(
            rotations.positions,
            rotations.half_turns,
            binomials,
            rotations.labels,
            ridge,
            rank,
            min(ridges, rank + step),
            keys,
        )
        yield keys[:count].copy()


def _all_keys(rotations: Rotations, binomials: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    """Yield the keys of all simplices, ascending; points must be numbered as in the configuration."""
    from bcut.geometry import _kernels

    n, d = rotations.n, rotations.dimension
    columns = np.ascontiguousarray(rotations.positions.T)
    for apex in range(d, n):
        keys = np.empty(comb(apex, d), dtype=np.int64)
        count = _kernels.list_all(columns, rotations.half_turns, binomials, d, apex, keys)
        yield keys if count == len(keys) else keys[:count].copy()


@dataclass(frozen=True, eq=False)
class FacetTable:
    """What every d-subset of a configuration is, by colexicographic rank.

    Attributes
    ----------
    configuration : PointConfiguration
    rotations : Rotations
    kinds : ndarray of int8, shape (C(n, d),)
        0 for dependent subsets, 1 for those in a facet of the convex hull, 2 for interior ones.
    point_sides : ndarray of int8, shape (C(n, d),)
        On which side the generic point of `first_basis` lies; 0 for dependent subsets.
    """

    configuration: PointConfiguration
    rotations: Rotations
    kinds: NDArray[np.int8]
    point_sides: NDArray[np.int8]

    @classmethod
    def of(cls, configuration: PointConfiguration, rotations: Rotations) -> FacetTable:
        """Classify all d-subsets."""
        from bcut.geometry import _kernels

        n, d = configuration.n, configuration.dimension
        kinds, point_sides = np.empty(comb(n, d), dtype=np.int8), np.empty(comb(n, d), dtype=np.int8)
        numbers = np.argsort(rotations.labels)
        _kernels.classify_facets(
            rotations.positions,
            rotations.half_turns,
            binomial_table(n, d + 1),
            rotations.labels,
            np.arange(d - 1, dtype=np.int64),
            numbers[first_basis(configuration)],
            kinds,
            point_sides,
        )
        return cls(configuration, rotations, kinds, point_sides)

    @cached_property
    def hull_facets(self) -> tuple[tuple[int, ...], ...]:
        """Facets of the convex hull, each as the ascending tuple of all configuration points on it."""
        from bcut.geometry import _rank_kernels

        labels, d = self.rotations.labels, self.rotations.dimension
        numbers = np.argsort(labels)
        places = np.flatnonzero(self.kinds == 1)
        subsets = np.empty((len(places), d), dtype=np.int64)
        _rank_kernels.unrank(places, binomial_table(len(labels), d + 1), subsets)
        found: list[tuple[int, ...]] = []
        while len(subsets):
            points = self._on_hyperplane(np.sort(numbers[subsets[0]]))
            found.append(tuple(np.sort(labels[points]).tolist()))
            member = np.zeros(len(labels), dtype=bool)
            member[labels[points]] = True
            subsets = subsets[~member[subsets].all(axis=1)]
        return tuple(sorted(found))

    def _on_hyperplane(self, facet: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the numbers of the points on the hyperplane of an independent ascending d-subset."""
        rank = sum(comb(int(v), j + 1) for j, v in enumerate(facet[:-1]))
        row, half = self.rotations.positions[rank], int(self.rotations.half_turns[rank])
        turns = (row.astype(np.int64) - int(row[facet[-1]])) % half
        return np.flatnonzero((row < 0) | (turns == 0))


def first_basis(configuration: PointConfiguration) -> NDArray[np.int64]:
    """Return the colexicographically first d + 1 affinely independent points."""
    points = configuration.scalars()
    rows = [[point[j] - points[0][j] for point in points[1:]] for j in range(configuration.dimension)]
    return np.array([0, *(column + 1 for column in pivot_columns(rows))], dtype=np.int64)

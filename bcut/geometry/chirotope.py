"""The chirotope of a point configuration: all that triangulations need to know, as signs.

Everything combinatorial is read off two tables: the orientation of every (d+1)-subset, and for every
(d-1)-simplex the side on which each point lies.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np
from numpy.typing import NDArray

from bcut.errors import TooLargeError
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.determinants import orientation_signs
from bcut.geometry.subsets import all_subsets, ranks, without

# Tables are arrays with an entry per (d+1)-subset; beyond this they no longer fit a workstation's memory.
MAX_SUBSETS = 60_000_000
# A determinant has 2**d minors.
MAX_DIMENSION = 16


@dataclass(frozen=True)
class Chirotope:
    """Orientations of all (d+1)-subsets of a point configuration.

    Attributes
    ----------
    n, dimension : int
        Number of points, and d.
    signs : ndarray of int8, shape (C(n, d+1),)
        Orientation of each ascending (d+1)-subset, by colexicographic rank.
    """

    n: int
    dimension: int
    signs: NDArray[np.int8]

    @classmethod
    def of(cls, configuration: PointConfiguration) -> Chirotope:
        """Compute all orientations exactly.

        Raises
        ------
        TooLargeError
            If there are more than `MAX_SUBSETS` subsets, or the dimension is above `MAX_DIMENSION`.
        """
        n, d = configuration.n, configuration.dimension
        if d > MAX_DIMENSION:
            raise TooLargeError(
                f"{configuration.name}: dimension {d}; determinants are computed up to dimension {MAX_DIMENSION}. "
                "Take points of a smaller dimension."
            )
        if comb(n, d + 1) > MAX_SUBSETS:
            raise TooLargeError(
                f"{configuration.name}: {n} points in dimension {d} have {comb(n, d + 1):,} subsets of {d + 1} points; "
                f"at most {MAX_SUBSETS:,} can be listed. Take fewer points."
            )
        return cls(n, d, orientation_signs(configuration, all_subsets(n, d + 1)))

    @cached_property
    def bases(self) -> NDArray[np.int64]:
        """All affinely independent (d+1)-subsets, ascending, in colex order, shape (m, d + 1)."""
        return all_subsets(self.n, self.dimension + 1)[self.signs != 0]

    @cached_property
    def facets(self) -> NDArray[np.int64]:
        """All d-subsets in colex order (rank = row), dependent ones included, shape (C(n, d), d)."""
        return all_subsets(self.n, self.dimension)

    @cached_property
    def sides(self) -> NDArray[np.int8]:
        """Side of every point with respect to every d-subset, shape (C(n, d), n).

        Entry (f, a) is the orientation of (f_0, ..., f_{d-1}, a); zero for points on the hyperplane of f, and
        the whole row is zero where f is affinely dependent.
        """
        d = self.dimension
        table = np.zeros((comb(self.n, d), self.n), dtype=np.int8)
        subsets = all_subsets(self.n, d + 1)
        for position in range(d + 1):
            facet_ranks = ranks(without(subsets, position), self.n)
            # Moving the vertex behind the others takes d - position transpositions.
            table[facet_ranks, subsets[:, position]] = -self.signs if (d - position) & 1 else self.signs
        return table

    def joined(self, size: int) -> NDArray[np.int8]:
        """Orientations of (s, t) for all subsets s of that size and all t with the other d + 1 - size points.

        Shape (C(n, size), C(n, d + 1 - size)), by colexicographic ranks; zero where s and t share a point.
        ``joined(d)`` is `sides`. Tables are kept.
        """
        if size not in self._joined:
            d = self.dimension
            table = np.zeros((comb(self.n, size), comb(self.n, d + 1 - size)), dtype=np.int8)
            subsets = all_subsets(self.n, d + 1)
            for first in all_subsets(d + 1, size).tolist():
                second = [position for position in range(d + 1) if position not in first]
                # Each position of the first part passes those of the second part below it.
                swaps = sum(first) - size * (size - 1) // 2
                rows, columns = ranks(subsets[:, first], self.n), ranks(subsets[:, second], self.n)
                table[rows, columns] = -self.signs if swaps & 1 else self.signs
            self._joined[size] = table
        return self._joined[size]

    @cached_property
    def _joined(self) -> dict[int, NDArray[np.int8]]:
        return {}

    @cached_property
    def facet_is_interior(self) -> NDArray[np.bool_]:
        """Whether each d-subset spans a (d-1)-simplex that lies in no facet of the convex hull, shape (C(n, d),)."""
        return (self.sides.max(axis=1) > 0) & (self.sides.min(axis=1) < 0)

    @cached_property
    def hull_facets(self) -> tuple[tuple[int, ...], ...]:
        """Facets of the convex hull, each as the ascending tuple of all configuration points on it."""
        supporting = (self.sides != 0).any(axis=1) & ~self.facet_is_interior
        on_plane = self.sides[supporting] == 0
        return tuple(sorted({tuple(np.flatnonzero(row).tolist()) for row in on_plane}))

    @property
    def is_general(self) -> bool:
        """Whether the configuration is in general position (no d+1 points on a common hyperplane)."""
        return bool(self.signs.all())

    def orientations(self, subsets: NDArray[np.integer]) -> NDArray[np.int8]:
        """Look up the orientations of ascending (d+1)-subsets, shape (..., d + 1) to (...)."""
        return self.signs[ranks(subsets, self.n)]

"""Rows that are too many to be written down: hosts ask for those that a point violates, and add them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chamber_flags import chamber_flags
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.crossings import crossing_matrix
from bcut.geometry.generic_point import simplices_containing_generic_point
from bcut.geometry.overlaps import overlap_matrix

# Rows that are handed out at once, the most violated ones first.
_AT_ONCE = 2000
# Values closer than this to 0 or 1 count as integral.
_INTEGRAL = 1e-6

Relation = Callable[[Chirotope, NDArray[np.int64], NDArray[np.int64]], NDArray[np.bool_]]


@dataclass(frozen=True, eq=False)
class LazyRow:
    """The row ``coefficients @ x[columns] <= rhs``, all integers.

    Attributes
    ----------
    kind : str
        "crossing", or "chamber" for a generic point that must be covered.
    columns : ndarray of int64
        Ascending.
    coefficients : ndarray of int64
    rhs : int
    """

    kind: str
    columns: NDArray[np.int64]
    coefficients: NDArray[np.int64]
    rhs: int


class LazyRows(ABC):
    """Rows of a formulation, as an oracle.

    On 0/1 points the oracle is exact: it returns rows if and only if some row is violated.
    """

    @abstractmethod
    def violated(self, x: NDArray[np.floating], tolerance: float) -> list[LazyRow]:
        """Return rows that a point violates by more than a tolerance; none only where none is.

        Parameters
        ----------
        x : ndarray of float
            A value for each column of the formulation.
        tolerance : float
        """

    @abstractmethod
    def restricted_to(self, columns: NDArray[np.int64], place: NDArray[np.int64]) -> LazyRows:
        """Return the rows over some of the columns.

        Parameters
        ----------
        columns : ndarray of int
            Those that remain.
        place : ndarray of int
            New column of each old one, -1 for those that go.
        """


@dataclass(frozen=True, eq=False)
class PairRows(LazyRows):
    """``x_s + x_t <= 1`` for simplices s and t that exclude each other.

    Attributes
    ----------
    chirotope : Chirotope
    simplices : ndarray of int, shape (m, d + 1)
        Those of the first m columns.
    dissection : bool
        Whether overlapping simplices exclude each other, instead of crossing ones.
    """

    chirotope: Chirotope
    simplices: NDArray[np.int64]
    dissection: bool

    @property
    def relation(self) -> Relation:
        """Which simplices exclude each other."""
        return overlap_matrix if self.dissection else crossing_matrix

    def violated(self, x: NDArray[np.floating], tolerance: float) -> list[LazyRow]:
        """Look at pairs with one value of more than 1/2."""
        x = x[: len(self.simplices)]
        large, support = np.flatnonzero(x > 0.5), np.flatnonzero(x > tolerance / 2)
        if not len(large):
            return []
        sums = x[large, None] + x[support]
        excluded = self.relation(self.chirotope, self.simplices[large], self.simplices[support])
        rows, others = np.nonzero(excluded & (sums > 1 + tolerance))
        pairs = np.sort(np.stack((large[rows], support[others]), axis=1), axis=1)
        return pair_rows(np.unique(pairs, axis=0), x)

    def restricted_to(self, columns: NDArray[np.int64], place: NDArray[np.int64]) -> PairRows:
        """Return the rows over some of the simplices."""
        kept = columns[columns < len(self.simplices)]
        return PairRows(self.chirotope, self.simplices[kept], self.dissection)


@dataclass(frozen=True, eq=False)
class ListedPairs(LazyRows):
    """``x_f + x_g <= 1`` for listed pairs of columns.

    Attributes
    ----------
    pairs : ndarray of int64, shape (k, 2)
    """

    pairs: NDArray[np.int64]

    def violated(self, x: NDArray[np.floating], tolerance: float) -> list[LazyRow]:
        """Look at all of them."""
        return pair_rows(self.pairs[x[self.pairs].sum(axis=1) > 1 + tolerance], x)

    def restricted_to(self, columns: NDArray[np.int64], place: NDArray[np.int64]) -> ListedPairs:
        """Return the pairs of which both columns remain."""
        pairs = place[self.pairs]
        return ListedPairs(pairs[(pairs >= 0).all(axis=1)])


@dataclass(frozen=True, eq=False)
class CoverageRows(LazyRows):
    """At 0/1 points: every chamber is covered.

    Where the volume row is inexact, a set of simplices that lacks a tiny bit of the hull satisfies it. Of the
    generic points of `bcut.geometry.chamber_flags` at least one shows that, and its row is what is missing.

    Attributes
    ----------
    chirotope : Chirotope
    simplices : ndarray of int, shape (m, d + 1)
        Those of the first m columns.
    """

    chirotope: Chirotope
    simplices: NDArray[np.int64]

    @cached_property
    def _containing(self) -> NDArray[np.bool_]:
        return chamber_incidence(self.chirotope, self.simplices)[0]

    def violated(self, x: NDArray[np.floating], tolerance: float) -> list[LazyRow]:
        """Look at the chambers where the point is integral, and at nothing elsewhere."""
        x = x[: len(self.simplices)]
        if np.minimum(np.abs(x), np.abs(1 - x)).max(initial=0.0) > _INTEGRAL:
            return []
        covered = self._containing[:, x > 0.5].any(axis=1)
        found = []
        for row in self._containing[~covered][:_AT_ONCE]:
            columns = np.flatnonzero(row)
            found.append(LazyRow("chamber", columns, np.full(len(columns), -1, dtype=np.int64), -1))
        return found

    def restricted_to(self, columns: NDArray[np.int64], place: NDArray[np.int64]) -> CoverageRows:
        """Return the rows over some of the simplices."""
        return CoverageRows(self.chirotope, self.simplices[columns[columns < len(self.simplices)]])


def pair_rows(pairs: NDArray[np.int64], x: NDArray[np.floating]) -> list[LazyRow]:
    """Return the rows of some pairs of columns, the most violated ones only where there are many."""
    if len(pairs) > _AT_ONCE:
        worst = np.argsort(-x[pairs].sum(axis=1), kind="stable")[:_AT_ONCE]
        pairs = pairs[np.sort(worst)]
    ones = np.ones(2, dtype=np.int64)
    return [LazyRow("crossing", pair, ones, 1) for pair in np.sort(pairs, axis=1)]


def violated_rows(lazy: Sequence[LazyRows], x: NDArray[np.floating], tolerance: float) -> list[LazyRow]:
    """Ask one oracle after the other, and return what the first one has that has something."""
    for rows in lazy:
        found = rows.violated(x, tolerance)
        if found:
            return found
    return []


def chamber_incidence(
    chirotope: Chirotope, simplices: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Tell which simplices contain which generic points of `chamber_flags`, one row for each different answer.

    Returns
    -------
    rows : ndarray of bool, shape (k, m)
    flags : ndarray of int64, shape (k, d + 1)
        The first flag that gives each row.
    """
    seen: dict[bytes, tuple[NDArray[np.bool_], NDArray[np.int64]]] = {}
    for flag in chamber_flags(chirotope):
        row = simplices_containing_generic_point(chirotope, simplices, flag)
        seen.setdefault(np.packbits(row).tobytes(), (row, flag))
    rows, flags = zip(*seen.values(), strict=True)
    return np.array(rows, dtype=bool), np.array(flags, dtype=np.int64)

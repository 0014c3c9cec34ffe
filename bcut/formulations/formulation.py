"""The type that all formulations share: columns, rows and where they come from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.subsets import ranks

if TYPE_CHECKING:
    import scipy.sparse as sp


@dataclass(frozen=True, eq=False)
class Formulation:
    """A 0/1 program over the d-simplices of a configuration: ``lower <= matrix @ x <= upper``, x in {0, 1}.

    Attributes
    ----------
    name : str
        As on the command line: "2" for the cocircuit form.
    configuration : PointConfiguration
    chirotope : Chirotope
    simplices : ndarray of int64, shape (m, d + 1)
        Ascending vertices, one row per variable, in colexicographic order.
    spanning : bool
        Whether the simplices were restricted to the empty ones.
    matrix : scipy.sparse.csr_matrix of int8, shape (rows, m)
    lower, upper : ndarray of int64, shape (rows,)
    row_faces : tuple of (tuple of int, or None)
        The (d-1)-simplex of each cocircuit row; None for the coverage row.
    """

    name: str
    configuration: PointConfiguration
    chirotope: Chirotope
    simplices: NDArray[np.int64]
    spanning: bool
    matrix: sp.csr_matrix
    lower: NDArray[np.int64]
    upper: NDArray[np.int64]
    row_faces: tuple[tuple[int, ...] | None, ...]

    @property
    def size(self) -> tuple[int, int]:
        """Numbers of columns and rows."""
        return len(self.simplices), self.matrix.shape[0]

    @cached_property
    def _simplex_ranks(self) -> NDArray[np.int64]:
        return ranks(self.simplices, self.chirotope.n)

    def columns_of(self, simplices: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the column of each simplex, -1 where it is none.

        Parameters
        ----------
        simplices : ndarray of int, shape (k, d + 1)
            Ascending vertices.
        """
        wanted = ranks(np.asarray(simplices), self.chirotope.n)
        known = self._simplex_ranks
        if not len(known):
            return np.full(wanted.shape, -1, dtype=np.int64)
        place = np.minimum(np.searchsorted(known, wanted), len(known) - 1)
        return np.where(known[place] == wanted, place, -1)

    def restricted_to(self, columns: NDArray[np.integer]) -> Formulation:
        """Return the same program on some of its columns; rows that become empty and homogeneous are dropped."""
        matrix = self.matrix[:, columns]
        keep = (np.diff(matrix.indptr) > 0) | (self.lower > 0) | (self.upper < 0)
        kept = np.flatnonzero(keep)
        return Formulation(
            name=self.name,
            configuration=self.configuration,
            chirotope=self.chirotope,
            simplices=self.simplices[columns],
            spanning=self.spanning,
            matrix=matrix[kept],
            lower=self.lower[kept],
            upper=self.upper[kept],
            row_faces=tuple(self.row_faces[row] for row in kept),
        )

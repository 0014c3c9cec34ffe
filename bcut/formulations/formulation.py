"""The type that all formulations share: columns, rows and where they come from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bcut.formulations.lazy_rows import LazyRows
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.subsets import ranks

if TYPE_CHECKING:
    import scipy.sparse as sp

# Stands for a side that a row does not have.
UNBOUNDED = np.int64(2**62)


@dataclass(frozen=True, eq=False)
class Formulation:
    """A 0/1 program over the d-simplices of a configuration: ``lower <= matrix @ x <= upper``, x in {0, 1}.

    The first m columns are the d-simplices, which alone have costs and which separators see; further columns,
    where there are any, are faces of them.

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
    matrix : scipy.sparse.csr_matrix of int8 or int64, shape (rows, m + len(faces))
    lower, upper : ndarray of int64, shape (rows,)
        `UNBOUNDED` above, or its negative below, where a row has no such side.
    row_faces : tuple of (tuple of int, or None)
        The (d-1)-simplex of each cocircuit row; None for all other rows.
    faces : tuple of tuple of int
        The ascending vertices of the faces that have columns of their own.
    row_names : tuple of str, or None
        What to call the rows in a model file; None where they are one coverage row and cocircuit rows.
    row_shifts : ndarray of int64, shape (rows,), or None
        Solvers are shown a row divided by two to this power; None for zeros.
    lazy : tuple of LazyRows
        More rows, which are too many to be written down: solvers ask for those that a point violates.
    dissection : bool
        Whether the 0/1 points are all dissections, not only those that are triangulations.
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
    faces: tuple[tuple[int, ...], ...] = ()
    row_names: tuple[str, ...] | None = None
    row_shifts: NDArray[np.int64] | None = None
    lazy: tuple[LazyRows, ...] = ()
    dissection: bool = False

    def __repr__(self) -> str:
        columns, rows = self.size
        return f"<Formulation {self.name} of {self.configuration.name}: {columns} columns, {rows} rows>"

    @property
    def size(self) -> tuple[int, int]:
        """Numbers of columns and rows, without those that are added when they are needed."""
        return self.width, self.matrix.shape[0]

    @property
    def width(self) -> int:
        """Number of columns: d-simplices, then other faces."""
        return len(self.simplices) + len(self.faces)

    def row_name(self, row: int) -> str:
        """Return what to call a row in a model file."""
        if self.row_names is not None:
            return self.row_names[row]
        face = self.row_faces[row]
        return "coverage" if face is None else "cocircuit_" + "_".join(map(str, face))

    @property
    def has_enclosing_rows(self) -> bool:
        """Whether two rows enclose an exact one, see `bcut.formulations.volume_rows`."""
        return self.row_shifts is not None and bool(self.row_shifts.any())

    @cached_property
    def scaled(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """What solvers are shown: entries in the order of ``matrix.data``, lower and upper sides (perhaps infinite)."""
        matrix = self.matrix
        entries = matrix.data.astype(float)
        lower = np.where(self.lower == -UNBOUNDED, -np.inf, self.lower.astype(float))
        upper = np.where(self.upper == UNBOUNDED, np.inf, self.upper.astype(float))
        if self.row_shifts is not None:
            entries = np.ldexp(entries, -np.repeat(self.row_shifts, np.diff(matrix.indptr)))
            lower, upper = np.ldexp(lower, -self.row_shifts), np.ldexp(upper, -self.row_shifts)
        return entries, lower, upper

    def completed(self, columns: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the columns of some simplices and of all their faces: what is 1 where these are the chosen ones."""
        if not self.faces:
            return np.asarray(columns, dtype=np.int64)
        chosen = self._faces_of(columns)
        return np.concatenate((columns, len(self.simplices) + np.flatnonzero(chosen))).astype(np.int64)

    def _faces_of(self, columns: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Tell which of `faces` some of the simplices have."""
        member = np.zeros((len(columns), self.configuration.n), dtype=bool)
        np.put_along_axis(member, self.simplices[columns], True, axis=1)
        found = [bool(member[:, face].all(axis=1).any()) for face in map(list, self.faces)]
        return np.array(found, dtype=bool)

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
        """Return the same program on some of its simplices; rows that become empty and say nothing are dropped."""
        kept_columns = self.completed(columns)
        matrix = self.matrix[:, kept_columns]
        keep = (np.diff(matrix.indptr) > 0) | (self.lower > 0) | (self.upper < 0)
        kept = np.flatnonzero(keep)
        place = np.full(self.width, -1, dtype=np.int64)
        place[kept_columns] = np.arange(len(kept_columns))
        faces = kept_columns[len(columns) :] - len(self.simplices)
        return replace(
            self,
            simplices=self.simplices[columns],
            matrix=matrix[kept],
            lower=self.lower[kept],
            upper=self.upper[kept],
            row_faces=tuple(self.row_faces[row] for row in kept),
            faces=tuple(self.faces[face] for face in faces.tolist()),
            row_names=None if self.row_names is None else tuple(self.row_names[row] for row in kept),
            row_shifts=None if self.row_shifts is None else self.row_shifts[kept],
            lazy=tuple(rows.restricted_to(kept_columns, place) for rows in self.lazy),
        )

"""The columns of a large linear program, laid out for passes over all of them.

Nearly all entries of our programs are 1 or -1, and nearly all columns have about as many of them: one for each facet of
a simplex. So a column is a fixed number of places in the vector ``(y, -y, 0)``, plus a short list of whatever does not
fit: entries of other values, and those of rows that few columns meet.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import scipy.sparse as sp

    from bcut.bounds._first_order_kernels import Kernels

# More fixed entries than this are not worth a kernel of their own.
_WIDEST = 12


@dataclass(frozen=True, eq=False)
class Columns:
    """A matrix by columns.

    Attributes
    ----------
    rows : int
        Number of rows.
    fixed : ndarray of int32, shape (m, width)
        Entries of 1 in row i as i, of -1 as ``rows + i``, and none as ``2 * rows``.
    starts : ndarray of int64, shape (m + 1,)
    places : ndarray of int32
        Rows of the further entries of column j in ``starts[j]:starts[j + 1]``.
    values : ndarray of int8 or float64
        Their values.
    """

    rows: int
    fixed: NDArray[np.int32]
    starts: NDArray[np.int64]
    places: NDArray[np.int32]
    values: NDArray[Any]

    @classmethod
    def of_matrix(cls, matrix: sp.sparray | sp.spmatrix) -> Columns:
        """Lay out any sparse matrix."""
        matrix = matrix.tocsc()
        matrix.sum_duplicates()
        rows, count = matrix.shape
        lengths = np.diff(matrix.indptr)
        unit = np.abs(matrix.data) == 1
        owners = np.repeat(np.arange(count, dtype=np.int64), lengths)
        # As many fixed entries as nearly all columns fill.
        units = np.bincount(owners[unit], minlength=count)
        width = min(_WIDEST, int(np.quantile(units, 0.75))) if count else 0
        order = np.flatnonzero(unit)
        position = np.arange(len(order)) - (np.cumsum(units) - units)[owners[order]]
        chosen = order[position < width]
        fixed = np.full((count, width), 2 * rows, dtype=np.int32)
        negative = matrix.data[chosen] < 0
        fixed[owners[chosen], position[position < width]] = matrix.indices[chosen] + rows * negative
        left = np.ones(len(owners), dtype=bool)
        left[chosen] = False
        return cls(
            rows,
            fixed,
            _starts(np.bincount(owners[left], minlength=count)),
            matrix.indices[left].astype(np.int32),
            _small(matrix.data[left]),
        )

    @classmethod
    def of_facets(
        cls,
        facet_rows: NDArray[np.integer],
        signs: NDArray[np.integer],
        coverage: NDArray[np.bool_],
        rows: int,
    ) -> Columns:
        """Lay out the cocircuit form.

        Parameters
        ----------
        facet_rows : ndarray of int, shape (m, d + 1)
            The cocircuit row of each facet, from 0; negative where it has none.
        signs : ndarray of int, shape (m, d + 1)
            The entries there.
        coverage : ndarray of bool, shape (m,)
            Which columns have an entry in the coverage row, which is row 0: the others are shifted by one.
        rows : int
            Number of cocircuit rows.
        """
        total = rows + 1
        fixed = np.add(facet_rows, 1, dtype=np.int32)
        fixed[signs < 0] += total
        fixed[facet_rows < 0] = 2 * total
        starts = _starts(coverage)
        places = np.zeros(starts[-1], dtype=np.int32)
        return cls(total, fixed, starts, places, np.ones(len(places), dtype=np.int8))

    @property
    def count(self) -> int:
        """Number of columns."""
        return len(self.fixed)

    @cached_property
    def kernels(self) -> Kernels:
        """The compiled passes over these columns."""
        from bcut.bounds._first_order_kernels import kernels

        return kernels(self.fixed.shape[1])

    @property
    def arrays(self) -> tuple[NDArray[Any], ...]:
        """What kernels take first."""
        return self.fixed, self.starts, self.places, self.values

    def with_combinations(self, combinations: sp.sparray | sp.spmatrix) -> Columns:
        """Append rows that are linear combinations of the rows.

        Parameters
        ----------
        combinations : sparse matrix, shape (k, rows)
            The factors.
        """
        further = (self.sparse().T @ combinations.T).tocsr()
        further.eliminate_zeros()
        extra = np.diff(further.indptr)
        own = np.diff(self.starts)
        total = self.rows + further.shape[1]
        fixed = self.fixed + np.where(self.fixed >= self.rows, further.shape[1], 0).astype(np.int32)
        fixed[self.fixed == 2 * self.rows] = 2 * total
        starts = _starts(own + extra)
        places = np.empty(starts[-1], dtype=np.int32)
        values = np.empty(starts[-1])
        old = _ranges(starts[:-1], own)
        new = _ranges(starts[:-1] + own, extra)
        places[old], values[old] = self.places, self.values
        places[new], values[new] = further.indices + self.rows, further.data
        return Columns(total, fixed, starts, places, _small(values))

    def restricted_to(self, columns: NDArray[np.integer]) -> Columns:
        """Return some of the columns; rows stay."""
        lengths = np.diff(self.starts)[columns]
        kept = _ranges(self.starts[:-1][columns], lengths)
        return Columns(self.rows, self.fixed[columns], _starts(lengths), self.places[kept], self.values[kept])

    def sparse(self) -> sp.csc_array:
        """Return the matrix, shape (rows, m), of int32 or float64."""
        import scipy.sparse as sp

        width = self.fixed.shape[1]
        present = self.fixed < 2 * self.rows
        own, extra = present.sum(axis=1), np.diff(self.starts)
        starts = _starts(own + extra)
        dtype = np.int32 if self.values.dtype == np.int8 else np.float64
        indices, data = np.empty(starts[-1], dtype=np.int32), np.empty(starts[-1], dtype=dtype)
        first, second = _ranges(starts[:-1], own), _ranges(starts[:-1] + own, extra)
        entries = self.fixed[present] if width else np.empty(0, dtype=np.int32)
        indices[first], data[first] = entries % self.rows, np.where(entries < self.rows, 1, -1)
        indices[second], data[second] = self.places, self.values
        return sp.csc_array((data, indices, starts), shape=(self.rows, self.count))

    def extended(self, y: NDArray[np.float64], out: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Return ``(y, -y, 0)``."""
        out = np.empty(2 * self.rows + 1) if out is None else out
        out[: self.rows] = y
        np.negative(y, out=out[self.rows : -1])
        out[-1] = 0.0
        return out

    def folded(self, products: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what a kernel added up at the places of ``(y, -y, 0)`` as one number for each row."""
        return products[: self.rows] - products[self.rows : -1]

    def row_scale(self) -> NDArray[np.float64]:
        """Return factors that make the mean size of the entries of a row 1."""
        scale = np.ones(self.rows)
        large = np.unique(self.places[np.abs(self.values) != 1])
        if len(large):
            # Rows with such entries have none or few among the fixed ones.
            total = np.bincount(self.places, np.abs(self.values), self.rows)
            number = np.bincount(self.places, minlength=self.rows)
            fixed = np.bincount(self.fixed.reshape(-1), minlength=2 * self.rows + 1)
            units = fixed[: self.rows] + fixed[self.rows : -1]
            scale[large] = (number[large] + units[large]) / (total[large] + units[large])
        return scale

    def times(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the products of the rows with x."""
        products = np.zeros(2 * self.rows + 1)
        self.kernels.collect(*self.arrays, x, products)
        return self.folded(products)

    def reduced(
        self, costs: NDArray[np.float64], y: NDArray[np.float64], out: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Return ``costs - y @ matrix``."""
        out = np.empty(self.count) if out is None else out
        self.kernels.price(*self.arrays, costs, self.extended(y), out)
        return out


def _starts(lengths: NDArray[Any]) -> NDArray[np.int64]:
    starts = np.zeros(len(lengths) + 1, dtype=np.int64)
    np.cumsum(lengths, out=starts[1:])
    return starts


def _ranges(starts: NDArray[np.integer], lengths: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return the concatenation of ``start, start + 1, ...`` of these lengths."""
    before = np.cumsum(lengths) - lengths
    return np.arange(int(np.sum(lengths))) + np.repeat(starts - before, lengths)


def _small(values: NDArray[Any]) -> NDArray[Any]:
    """Return the values as int8 where they are such integers, else as float64."""
    narrow = values.astype(np.int8)
    return narrow if np.array_equal(narrow, values) else values.astype(np.float64)

"""Formulation 2 in a few flat arrays, for millions of columns.

Every column of the cocircuit form has at most d + 1 entries besides that of the coverage row, each 1 or -1. So the
matrix is a table of d + 1 row numbers and d + 1 signs for each simplex: about 29 bytes for a tetrahedron, all
told. An ordinary `Formulation` is made of the columns that are still wanted when fixing is done.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bcut.formulations.formulation import Formulation
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.empty_simplices import FacetTable, binomial_table, list_simplices
from bcut.geometry.generic_point import simplices_containing_generic_point
from bcut.geometry.partial_chirotope import PartialChirotope
from bcut.geometry.simplices import candidate_simplices
from bcut.geometry.subsets import ranks, without

if TYPE_CHECKING:
    import scipy.sparse as sp

# Where tables of all (d+1)-subsets take longer than numba's start and the loading of its kernels.
MIN_SUBSETS_TO_COMPILE = 700_000


@dataclass(frozen=True, eq=False)
class CompactProgram:
    """The 0/1 program of `bcut.formulations.cocircuits.cocircuit_formulation`, as arrays.

    Attributes
    ----------
    configuration : PointConfiguration
    chirotope : Chirotope
        With tables where the configuration is small, else a `PartialChirotope`.
    spanning : bool
        Whether the simplices were restricted to the empty ones.
    simplices : ndarray of uint16 (or uint32), shape (m, d + 1)
        Ascending vertices, one row per column of the program, in colexicographic order.
    row_faces : ndarray of int64, shape (r, d)
        The (d-1)-simplices of the cocircuit rows, in colexicographic order.
    facet_rows : ndarray of int32, shape (m, d + 1)
        For the facet opposite to each vertex, its place in `row_faces`; -1 for facets in the hull's boundary.
    facet_signs : ndarray of int8, shape (m, d + 1)
        The entries of the matrix: the side of the facet that the vertex is on; 0 where there is no row.
    coverage : ndarray of bool, shape (m,)
        Which simplices contain the generic point; a triangulation has exactly one of these.
    """

    configuration: PointConfiguration
    chirotope: Chirotope
    spanning: bool
    simplices: NDArray[np.unsignedinteger[Any]]
    row_faces: NDArray[np.int64]
    facet_rows: NDArray[np.int32]
    facet_signs: NDArray[np.int8]
    coverage: NDArray[np.bool_]

    @property
    def size(self) -> tuple[int, int]:
        """Numbers of columns and rows, the coverage row included."""
        return len(self.simplices), len(self.row_faces) + 1

    @property
    def bytes_per_column(self) -> int:
        """Memory that one more column takes."""
        width = self.simplices.shape[1]
        per_vertex = self.simplices.itemsize + self.facet_rows.itemsize + self.facet_signs.itemsize
        return width * per_vertex + self.coverage.itemsize

    @cached_property
    def _ranks(self) -> NDArray[np.int64]:
        return ranks(self.simplices, self.configuration.n)

    def columns_of(self, simplices: NDArray[np.integer[Any]]) -> NDArray[np.int64]:
        """Return the column of each simplex, -1 where it is none.

        Parameters
        ----------
        simplices : ndarray of int, shape (k, d + 1)
            Ascending vertices.
        """
        wanted = ranks(np.asarray(simplices), self.configuration.n)
        place = np.minimum(np.searchsorted(self._ranks, wanted), len(self._ranks) - 1)
        return np.where(self._ranks[place] == wanted, place, -1)

    def matrix(self, columns: NDArray[np.integer[Any]] | None = None) -> sp.csc_matrix:
        """Return the matrix of int8, shape (r + 1, m): row 0 is the coverage row, row k + 1 that of face k.

        Parameters
        ----------
        columns : ndarray of int, optional
            Only these, in this order; all if left out. Rows stay.
        """
        import scipy.sparse as sp

        chosen = slice(None) if columns is None else columns
        coverage, rows = self.coverage[chosen], self.facet_rows[chosen]
        count, width = rows.shape
        # The further back the opposite vertex, the lower the facet's rank: ascending row numbers in every column.
        numbers = np.zeros((count, width + 1), dtype=np.int32)
        np.add(rows[:, ::-1], 1, out=numbers[:, 1:])
        entries = np.ones((count, width + 1), dtype=np.int8)
        entries[:, 1:] = self.facet_signs[chosen][:, ::-1]
        entries[:, 0] = coverage
        present = entries != 0
        starts = np.zeros(count + 1, dtype=np.int64)
        np.cumsum(present.sum(axis=1), out=starts[1:])
        # SciPy wants both index arrays of one type.
        starts = starts.astype(np.int32) if starts[-1] < 2**31 else starts
        parts = (entries[present], numbers[present], starts)
        matrix = sp.csc_matrix(parts, shape=(len(self.row_faces) + 1, count), copy=False)
        matrix.has_sorted_indices = True
        return matrix

    def formulation(self, columns: NDArray[np.integer[Any]] | None = None) -> Formulation:
        """Return an ordinary formulation on some columns; rows that become empty and homogeneous are dropped.

        Parameters
        ----------
        columns : ndarray of int, optional
            Ascending; all if left out.

        Returns
        -------
        Formulation
            With simplices of int64 and a Python tuple for every row: for what is left after fixing.
        """
        matrix = self.matrix(columns).tocsr()
        keep = np.diff(matrix.indptr) > 0
        keep[0] = True
        kept = np.flatnonzero(keep)
        right = np.zeros(len(kept), dtype=np.int64)
        right[0] = 1
        simplices = self.simplices if columns is None else self.simplices[columns]
        return Formulation(
            name="2",
            configuration=self.configuration,
            chirotope=self.chirotope,
            simplices=simplices.astype(np.int64),
            spanning=self.spanning,
            matrix=matrix if keep.all() else matrix[kept],
            lower=right,
            upper=right.copy(),
            row_faces=(None, *map(tuple, self.row_faces[kept[1:] - 1].tolist())),
        )


def compact_program(
    configuration: PointConfiguration, *, spanning: bool = False, compiled: bool | None = None
) -> CompactProgram:
    """Build Formulation 2 as arrays.

    Parameters
    ----------
    configuration : PointConfiguration
    spanning : bool
        Only triangulations that use every point.
    compiled : bool, optional
        Whether to use the compiled kernels; decided by size if left out. The result is the same.

    Raises
    ------
    TooLargeError
        There are too many simplices, or too many ridges for the table of rotations.
    """
    if compiled is None:
        compiled = pays_to_compile(configuration)
    build = _by_kernels if compiled else _from_tables
    return build(configuration, spanning)


def pays_to_compile(configuration: PointConfiguration) -> bool:
    """Tell whether the compiled kernels, their start included, are faster than tables of all signs.

    They need about two determinants for each pair of a ridge and a point, the tables one for each (d+1)-subset;
    in high dimension the latter are fewer.
    """
    n, d = configuration.n, configuration.dimension
    subsets = comb(n, d + 1)
    return subsets > MIN_SUBSETS_TO_COMPILE and subsets > n * comb(n, d - 1)


def _from_tables(configuration: PointConfiguration, spanning: bool) -> CompactProgram:
    chirotope = Chirotope.of(configuration)
    simplices = candidate_simplices(chirotope, spanning=spanning)
    facet_ranks = np.stack(
        [ranks(without(simplices, p), chirotope.n) for p in range(simplices.shape[1])], axis=1
    )
    interior = chirotope.facet_is_interior[facet_ranks]
    used = np.unique(facet_ranks[interior])
    signs = chirotope.sides[facet_ranks, simplices]
    return CompactProgram(
        configuration=configuration,
        chirotope=chirotope,
        spanning=spanning,
        simplices=simplices.astype(np.uint16),
        row_faces=chirotope.facets[used],
        facet_rows=np.where(interior, np.searchsorted(used, facet_ranks), -1).astype(np.int32),
        facet_signs=np.where(interior, signs, 0).astype(np.int8),
        coverage=simplices_containing_generic_point(chirotope, simplices, chirotope.bases[0]),
    )


def _by_kernels(configuration: PointConfiguration, spanning: bool) -> CompactProgram:
    from bcut.geometry import _rank_kernels

    n, d = configuration.n, configuration.dimension
    listed = list_simplices(configuration, spanning=spanning)
    simplices = listed.vertices
    facets = FacetTable.of(configuration, listed.rotations)
    binomials = binomial_table(n, d + 1)
    used = np.zeros(comb(n, d), dtype=bool)
    _rank_kernels.mark_facets(simplices, binomials, used)
    with_row = np.flatnonzero(used & (facets.kinds == 2))
    row_faces = np.empty((len(with_row), d), dtype=np.int64)
    _rank_kernels.unrank(with_row, binomials, row_faces)
    row_of = np.full(len(used), -1, dtype=np.int32)
    row_of[with_row] = np.arange(len(with_row), dtype=np.int32)
    facet_rows = np.empty(simplices.shape, dtype=np.int32)
    facet_signs = np.empty(simplices.shape, dtype=np.int8)
    coverage = np.empty(len(simplices), dtype=bool)
    _rank_kernels.fill_rows(
        simplices,
        listed.orientations,
        binomials,
        row_of,
        facets.point_sides,
        facet_rows,
        facet_signs,
        coverage,
    )
    return CompactProgram(
        configuration=configuration,
        chirotope=PartialChirotope(configuration, facets.hull_facets),
        spanning=spanning,
        simplices=simplices,
        row_faces=row_faces,
        facet_rows=facet_rows,
        facet_signs=facet_signs,
        coverage=coverage,
    )

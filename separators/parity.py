"""Parity cuts: modulo 2, every row of Formulation 2 is a parity check, and so is every sum of rows.

A triangulation has zero or two simplices at an interior (d-1)-simplex, hence an even number of those in its cocircuit
row, and exactly one over a generic point. Modulo 2 signs do not matter, so the sum of some of these rows says of a set
N of simplices, those that occur in an odd number of the rows, that a triangulation contains an even number of them, or
an odd number if the coverage row is among the rows. That forbids all choices of the wrong parity:

    x(F) - x(rest of N) <= |F| - 1     for every F within N whose size has the wrong parity.

For a given N the most violated F is the set of those with values above 1/2, or differs from it by the one simplex whose
exchange costs least. The left side falls short of |F| by the sum of min(x, 1 - x), so what is wanted are checks with
little fractional support. They come from Gaussian elimination over GF(2), with the columns ordered by how fractional
they are (as for linear codes: M. H. Taghavi and P. H. Siegel, "Adaptive methods for linear programming decoding",
2008). Two kinds of checks are left in the end. A pivot row has one very fractional simplex and few others. A row
without a pivot has no fractional simplex at all, and if its parity is wrong, its cut is violated by 1. At points in
halves only the second kind cuts anything off, because every check has an even number of fractional simplices there:
docs/parity-cuts.md has the proof. These are {0, 1/2}-cuts (A. Caprara and M. Fischetti, 1996) on the rows of the
formulation, complete ones, with no rounding of coefficients.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from bcut.separation.seam import Cut, FractionalPoint, Problem, Separator

# A cut counts as violated from this much on.
_VIOLATION = 1e-4


class Parity(Separator):
    """Forbidden choices of the wrong parity: sums of cocircuit and coverage rows modulo 2, by Gaussian elimination.

    Parameters
    ----------
    max_cuts : int
        At most this many cuts per point, most violated first.
    max_columns : int
        Only that many simplices, the most fractional ones, are eliminated.
    max_support : int
        Cuts with more simplices than this are left out: they slow the relaxation more than they help.
    """

    name: ClassVar[str] = "parity"
    stage: ClassVar[int] = 1

    def __init__(self, *, max_cuts: int = 40, max_columns: int = 2000, max_support: int = 4000) -> None:
        if min(max_cuts, max_columns, max_support) < 1:
            raise ValueError("max_cuts, max_columns and max_support are at least 1")
        self.max_cuts, self.max_columns, self.max_support = max_cuts, max_columns, max_support

    def setup(self, problem: Problem) -> None:
        """Take the parity checks out of the formulation: its cocircuit rows and its coverage row."""
        super().setup(problem)
        formulation = problem.formulation
        names = ["coverage" if face is None else "" for face in formulation.row_faces]
        checks = [
            row for row, name in enumerate(names) if not name or formulation.row_name(row) == "coverage"
        ]
        self.faces = [formulation.row_faces[row] for row in checks]
        matrix = formulation.matrix[checks][:, : len(problem.simplices)]
        self.rows = abs(matrix).tocsr()
        self.columns = self.rows.tocsc()
        starts, indices, odd = self.rows.indptr, self.rows.indices, self.rows.data % 2 == 1
        self.odd = [indices[start:end][odd[start:end]] for start, end in pairwise(starts)]

    def separate(self, point: FractionalPoint) -> Iterator[Cut]:
        """Yield the most violated cut of every row of the eliminated system, most violated first."""
        if not self.faces or not len(point.fractional):
            return
        x = point.x
        fractional = point.fractional[np.argsort(np.abs(x[point.fractional] - 0.5), kind="stable")]
        found = []
        for combination in self._combinations(fractional[: self.max_columns]):
            cut = self._cut(combination, x)
            if cut is not None:
                found.append(cut)
        found.sort(key=lambda item: (-item[0], len(item[1].simplices)))
        for _, kept in found[: self.max_cuts]:
            yield kept

    def _combinations(self, columns: NDArray[np.integer]) -> Iterator[NDArray[np.intp]]:
        """Yield sets of rows whose sums have few of the columns, or none."""
        part = self.columns[:, columns]
        rows = np.unique(part.indices)
        table = np.zeros((len(rows), len(columns)), dtype=bool)
        place = np.searchsorted(rows, part.indices)
        table[place, np.repeat(np.arange(len(columns)), np.diff(part.indptr))] = True
        # What has been added to a row stands behind it.
        packed = _packed(table), _packed(np.eye(len(rows), dtype=bool))
        work = np.concatenate(packed, axis=1)
        free = np.ones(len(rows), dtype=bool)
        for column in range(len(columns)):
            word, bit = divmod(column, 64)
            has = (work[:, word] >> np.uint64(bit)) & np.uint64(1) == 1
            candidates = np.flatnonzero(has & free)
            if len(candidates):
                pivot = candidates[0]
                has[pivot] = False
                work[has] ^= work[pivot]
                free[pivot] = False
        width = packed[0].shape[1]
        for row in work[:, width:]:
            members = np.unpackbits(row.view(np.uint8), bitorder="little", count=len(rows))
            yield rows[np.flatnonzero(members)]

    def _cut(self, combination: NDArray[np.intp], x: NDArray[np.floating]) -> tuple[float, Cut] | None:
        """Return the most violated cut of a sum of rows, with its violation."""
        if not len(combination):
            return None
        occurrences = np.bincount(np.concatenate([self.odd[row] for row in combination]))
        members = np.flatnonzero(occurrences & 1)
        if not len(members) or len(members) > self.max_support:
            return None
        faces = [self.faces[row] for row in combination]
        parity = sum(face is None for face in faces) % 2
        values = x[members]
        chosen = values > 0.5
        distance = np.minimum(values, 1 - values)
        short = float(distance.sum())
        if int(chosen.sum()) % 2 == parity:
            flip = int(np.argmin(np.abs(1 - 2 * values)))
            chosen[flip] = not chosen[flip]
            short += abs(1 - 2 * float(values[flip]))
        if 1 - short < _VIOLATION:
            return None
        coefficients = np.where(chosen, 1, -1)
        proof: dict[str, Any] = {"rows": [list(face) for face in faces if face is not None]}
        if parity:
            proof["flag"] = self.problem.chirotope.bases[0].tolist()
        return 1 - short, Cut(members, int(chosen.sum()) - 1, coefficients, proof)


def _packed(table: NDArray[np.bool_]) -> NDArray[np.uint64]:
    """Pack rows of truth values into words."""
    width = -(-table.shape[1] // 64) * 64
    padded = np.zeros((len(table), width), dtype=bool)
    padded[:, : table.shape[1]] = table
    return np.packbits(padded, axis=1, bitorder="little").view(np.uint64)

"""Compiled loops over simplices by their colexicographic ranks; ``binomials[j, v]`` is C(v, j).

Import this module only where an instance is large enough to repay numba's start.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bcut.geometry._compiled import compiled

# Arrays of whatever width the caller has; numba types them at the first call.
Array = Any


@compiled
def unrank(ranks: Array, binomials: Array, subsets: Array) -> None:
    """Fill in the subsets, shape (m, k), of ascending colexicographic ranks, shape (m,).

    While the later elements stay the same, an element only grows from subset to subset: so no search.
    """
    for j in range(len(ranks)):
        rest, same = ranks[j], j > 0
        for i in range(subsets.shape[1] - 1, 0, -1):
            before: Any = np.int64(subsets[j - 1, i]) if same else i
            element = before
            while binomials[i + 1, element + 1] <= rest:
                element += 1
            same = same and element == before
            rest -= binomials[i + 1, element]
            subsets[j, i] = element
        subsets[j, 0] = rest


@compiled
def mark_facets(simplices: Array, binomials: Array, used: Array) -> None:
    """Mark the ranks of all facets of some simplices, shape (m, d + 1), in a table of bool, shape (C(n, d),)."""
    size = simplices.shape[1]
    for j in range(len(simplices)):
        rank = 0
        for i in range(1, size):
            rank += binomials[i, simplices[j, i]]
        used[rank] = True
        for i in range(1, size):
            # The vertex before takes the place of this one.
            rank += binomials[i, simplices[j, i - 1]] - binomials[i, simplices[j, i]]
            used[rank] = True


@compiled
def fill_rows(
    simplices: Array, orientations: Array, binomials: Array, row_of: Array, point_sides: Array, rows: Array,
    signs: Array, coverage: Array,
) -> None:  # fmt: skip
    """Fill in row and sign of each facet of each simplex, and whether it contains the generic point.

    Parameters
    ----------
    row_of : ndarray of int32, shape (C(n, d),)
        The row of each facet, -1 where it has none.
    rows, signs : ndarray, shape (m, d + 1)
        By the position of the opposite vertex; where there is no row, -1 and 0.
    coverage : ndarray of bool, shape (m,)
    """
    size = simplices.shape[1]
    for j in range(len(simplices)):
        rank = 0
        for i in range(1, size):
            rank += binomials[i, simplices[j, i]]
        inside = True
        # Moving a vertex behind the others takes size - 1 - position transpositions.
        sign = orientations[j] if size & 1 else -orientations[j]
        for i in range(size):
            if i > 0:
                rank += binomials[i, simplices[j, i - 1]] - binomials[i, simplices[j, i]]
            row = row_of[rank]
            rows[j, i] = row
            signs[j, i] = sign if row >= 0 else 0
            inside = inside and point_sides[rank] == sign
            sign = -sign
        coverage[j] = inside

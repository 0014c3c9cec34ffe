"""Candidate simplices: all full-dimensional ones, or only those that a spanning triangulation can use."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope
from bcut.geometry.subsets import ranks, without

_CHUNK = 1 << 18


def candidate_simplices(chirotope: Chirotope, *, spanning: bool = False) -> NDArray[np.int64]:
    """List the d-simplices that a triangulation may use.

    Parameters
    ----------
    chirotope : Chirotope
        Of the point configuration.
    spanning : bool
        Keep only empty simplices: no other point of the configuration anywhere in the closed simplex, its
        boundary included. A triangulation uses all points exactly when all its simplices are empty (the
        paper, Sec. 2.4.2).

    Returns
    -------
    ndarray of int64, shape (m, d + 1)
        Ascending vertices, in colexicographic order.
    """
    simplices = chirotope.bases
    return simplices[empty(chirotope, simplices)] if spanning else simplices


def empty(chirotope: Chirotope, simplices: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Tell which simplices contain no point of the configuration besides their vertices.

    A point is in the closed simplex exactly when, for each facet, it is not strictly on the side away from
    the opposite vertex. The points that are not, one bit each, come from the rows of `Chirotope.sides`.
    """
    not_below = np.packbits(chirotope.sides >= 0, axis=1)
    not_above = np.packbits(chirotope.sides <= 0, axis=1)
    result = np.empty(len(simplices), dtype=bool)
    for start in range(0, len(simplices), _CHUNK):
        chunk = simplices[start : start + _CHUNK]
        contained = np.full((len(chunk), not_below.shape[1]), 0xFF, dtype=np.uint8)
        for position in range(chunk.shape[1]):
            facet_ranks = ranks(without(chunk, position), chirotope.n)
            above = chirotope.sides[facet_ranks, chunk[:, position]] > 0
            contained &= np.where(above[:, None], not_below[facet_ranks], not_above[facet_ranks])
        # Padding bits are zero in both tables, so they never count.
        points_inside = np.bitwise_count(contained).sum(axis=1, dtype=np.int64)
        result[start : start + _CHUNK] = points_inside == chunk.shape[1]
    return result

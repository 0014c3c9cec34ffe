"""Subsets of {0, ..., n-1} in colexicographic order, as arrays, with their ranks.

The rank of a subset ``a_0 < a_1 < ... < a_{k-1}`` is ``sum_j C(a_j, j + 1)`` (the combinatorial number
system), so a subset's place in a table can be computed without searching, and does not depend on n.
"""

from __future__ import annotations

from functools import lru_cache
from math import comb

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]


def all_subsets(n: int, k: int) -> Indices:
    """List every k-subset of ``range(n)`` in colexicographic order.

    Parameters
    ----------
    n, k : int
        Size of the ground set and of the subsets, ``0 <= k <= n``.

    Returns
    -------
    ndarray of int64, shape (C(n, k), k)
        Each row ascending. Row r has rank r.
    """
    table = np.empty((1, 0), dtype=np.int64)
    for size in range(1, k + 1):
        # In colex order the subsets with largest element m are the first C(m, size-1) smaller ones, with m
        # appended.
        counts = [comb(m, size - 1) for m in range(size - 1, n)]
        largest = np.repeat(np.arange(size - 1, n, dtype=np.int64), counts)
        starts = np.concatenate(([0], np.cumsum(counts)[:-1]))
        within = np.arange(len(largest), dtype=np.int64) - np.repeat(starts, counts)
        table = np.concatenate((table[within], largest[:, None]), axis=1)
    return table


@lru_cache(maxsize=64)
def _binomials(n: int, k: int) -> Indices:
    """Return the table of C(v, j+1) for v < n, j < k, as (k, n)."""
    table = np.array([[comb(v, j + 1) for v in range(n)] for j in range(k)], dtype=np.int64).reshape(k, n)
    table.setflags(write=False)
    return table


def ranks(subsets: NDArray[np.integer], n: int) -> Indices:
    """Return the colexicographic ranks of ascending subsets.

    Parameters
    ----------
    subsets : ndarray of int, shape (..., k)
        Each ascending along the last axis, entries below n.
    n : int
        Size of the ground set (any n above the largest entry gives the same ranks).

    Returns
    -------
    ndarray of int64, shape (...)
    """
    k = subsets.shape[-1]
    table = _binomials(n, k)
    total = np.zeros(subsets.shape[:-1], dtype=np.int64)
    for j in range(k):
        total += table[j][subsets[..., j]]
    return total


def without(subsets: NDArray[np.integer], position: int) -> NDArray[np.integer]:
    """Drop one position from each subset: the face opposite to that vertex, shape (..., k - 1)."""
    keep = [j for j in range(subsets.shape[-1]) if j != position]
    return subsets[..., keep]


@lru_cache(maxsize=256)
def face_positions(size: int, face_size: int) -> Indices:
    """Return the positions of all faces with `face_size` vertices in a simplex with `size`, read-only."""
    table = all_subsets(size, face_size)
    table.setflags(write=False)
    return table

"""Circuits: minimal affine dependences, as pairs of faces whose relative interiors meet in one point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope
from bcut.geometry.subsets import all_subsets, without

# Subsets of d + 2 points that are worked on at once.
_CHUNK = 1 << 16


def circuits(chirotope: Chirotope) -> NDArray[np.int8]:
    """List all circuits (Z+, Z-) of a configuration.

    A subset of d + 2 points that spans the space has one affine dependence, whose signs Cramer's rule gives;
    what it vanishes on is left out, and what remains is a circuit. Every circuit extends to such a subset, so
    all are found, the same one perhaps many times. In general position each (d+2)-subset is a circuit of its
    own, and its parts have d + 2 points together: dimensions that add up to d.

    Parameters
    ----------
    chirotope : Chirotope

    Returns
    -------
    ndarray of int8, shape (k, n)
        1 on Z+, -1 on Z-, the first point of each being on Z+; each circuit once, in ascending order.
    """
    n, d = chirotope.n, chirotope.dimension
    found = [np.empty((0, n), dtype=np.int8)]
    if n < d + 2:
        return found[0]
    subsets = all_subsets(n, d + 2)
    for start in range(0, len(subsets), _CHUNK):
        part = subsets[start : start + _CHUNK]
        signs = np.stack(
            [chirotope.orientations(without(part, i)) * (-1 if i & 1 else 1) for i in range(d + 2)], axis=1
        )
        spanning = signs.any(axis=1)
        rows = np.zeros((int(spanning.sum()), n), dtype=np.int8)
        np.put_along_axis(rows, part[spanning], signs[spanning], axis=1)
        first = rows[np.arange(len(rows)), (rows != 0).argmax(axis=1)]
        found.append(rows * first[:, None])
    return np.unique(np.concatenate(found), axis=0)

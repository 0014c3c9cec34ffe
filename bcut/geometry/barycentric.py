"""Where a point lies with respect to simplices, as signs of its barycentric coordinates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope


def barycentric_signs(chirotope: Chirotope, simplices: NDArray[np.integer], point: int) -> NDArray[np.int8]:
    """Return the signs of the barycentric coordinates of a point in simplices, shape (k, d + 1).

    Parameters
    ----------
    chirotope : Chirotope
        Only asked for orientations.
    simplices : ndarray of int, shape (k, d + 1)
        Ascending and affinely independent.
    point : int
    """
    own = chirotope.orientations(simplices)
    signs = np.zeros(simplices.shape, dtype=np.int8)
    is_vertex = simplices == point
    signs[is_vertex] = 1
    other = np.flatnonzero(~is_vertex.any(axis=1))
    for position in range(simplices.shape[1]):
        # With the point in place of a vertex, the volume is that vertex's coordinate times as large.
        rest = np.delete(simplices[other], position, axis=1)
        place = (rest < point).sum(axis=1)
        moved = np.sort(np.column_stack((rest, np.full(len(rest), point))), axis=1)
        swaps = np.where((place - position) & 1, -1, 1)
        signs[other, position] = chirotope.orientations(moved) * swaps * own[other]
    return signs

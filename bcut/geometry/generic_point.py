"""A generic point of the convex hull, given symbolically, and the simplices that contain it.

The point is ``v_0 + e (v_1 - v_0) + e^2 (v_2 - v_0) + ...`` for a simplex v and an infinitesimal e > 0, so it
lies on no hyperplane spanned by the configuration, and the side it is on is the first nonzero side among v_0,
v_1, ...: signs decide, no coordinates are needed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope
from bcut.geometry.subsets import ranks, without


def simplices_containing_generic_point(
    chirotope: Chirotope, simplices: NDArray[np.int64], flag: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Tell which simplices contain the generic point of a flag.

    Parameters
    ----------
    chirotope : Chirotope
        Of the point configuration.
    simplices : ndarray of int, shape (m, d + 1)
        Ascending vertices.
    flag : ndarray of int, shape (d + 1,)
        An ordered, affinely independent tuple v_0, v_1, ..., v_d of points.

    Returns
    -------
    ndarray of bool, shape (m,)
        Every triangulation contains exactly one of the marked simplices.
    """
    contained = np.ones(len(simplices), dtype=bool)
    point_sides = _first_nonzero(chirotope.sides[:, flag])
    for position in range(simplices.shape[1]):
        facet_ranks = ranks(without(simplices, position), chirotope.n)
        contained &= point_sides[facet_ranks] == chirotope.sides[facet_ranks, simplices[:, position]]
    return contained


def contain_generic_points(
    chirotope: Chirotope, simplices: NDArray[np.integer], flags: NDArray[np.integer]
) -> NDArray[np.bool_]:
    """Tell which simplices contain the generic point of the flag in the same row.

    Parameters
    ----------
    chirotope : Chirotope
    simplices : ndarray of int, shape (k, d + 1)
        Ascending vertices.
    flags : ndarray of int, shape (k, d + 1)
        Ordered, affinely independent tuples.

    Returns
    -------
    ndarray of bool, shape (k,)
    """
    contained = np.ones(len(simplices), dtype=bool)
    for position in range(simplices.shape[1]):
        facets = ranks(without(simplices, position), chirotope.n)
        point_sides = _first_nonzero(chirotope.sides[facets[:, None], flags])
        contained &= point_sides == chirotope.sides[facets, simplices[:, position]]
    return contained


def _first_nonzero(table: NDArray[np.int8]) -> NDArray[np.int8]:
    """Return the first nonzero entry of each row, 0 where there is none."""
    result = np.zeros(len(table), dtype=np.int8)
    for column in table.T:
        result = np.where(result == 0, column, result)
    return result

"""The Delaunay triangulation where floating point finds one, checked exactly."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.barycentric import barycentric_signs
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.placing import placing_triangulation
from bcut.geometry.subsets import ranks, without
from bcut.geometry.sweep import sweep_triangulation


def first_triangulation(configuration: PointConfiguration, chirotope: Chirotope) -> NDArray[np.int64]:
    """Return a spanning triangulation that takes no search: Delaunay's, or the placing triangulation.

    Qhull works in floating point: flat simplices and overlaps are what it may return for points on a common sphere, in
    grids or nearly so. Then, or where it leaves out points, the placing triangulation takes its place.

    Parameters
    ----------
    configuration : PointConfiguration
    chirotope : Chirotope
        Only asked for orientations.

    Returns
    -------
    ndarray of int64, shape (k, d + 1)
        Ascending simplices, in colexicographic order.
    """
    found = qhull_simplices(configuration)
    if found is not None and len(np.unique(found)) == configuration.n and is_triangulation(found, chirotope):
        return found
    if configuration.dimension == 2:
        return sweep_triangulation(configuration)
    return placing_triangulation(configuration, chirotope)


def qhull_simplices(configuration: PointConfiguration) -> NDArray[np.int64] | None:
    """Return what Qhull takes for the Delaunay triangulation, in floating point, or None where it gives up.

    Parameters
    ----------
    configuration : PointConfiguration

    Returns
    -------
    ndarray of int64, shape (k, d + 1), or None
        Ascending simplices, in colexicographic order.
    """
    from scipy.spatial import Delaunay, QhullError

    if configuration.dimension < 2:
        return None
    try:
        simplices = np.sort(Delaunay(configuration.floats).simplices.astype(np.int64), axis=1)
    except (QhullError, ValueError):
        return None
    return simplices[np.argsort(ranks(simplices, configuration.n))]


def is_triangulation(simplices: NDArray[np.int64], chirotope: Chirotope) -> bool:
    """Tell exactly whether simplices triangulate the configuration.

    Each is solid; each facet belongs to two simplices on different sides of it, or to one with all points on its side.
    Then all generic points of the hull are in equally many simplices, and one of them is looked at.

    Parameters
    ----------
    simplices : ndarray of int, shape (k, d + 1)
        Ascending, no two alike.
    chirotope : Chirotope
        Only asked for orientations.
    """
    n, size = chirotope.n, simplices.shape[1]
    own = chirotope.orientations(simplices)
    if not len(simplices) or not own.all():
        return False
    facets = np.concatenate([without(simplices, p) for p in range(size)])
    sides = np.concatenate([own * (-1 if (size - 1 - p) & 1 else 1) for p in range(size)]).astype(np.int64)
    _, first, place, counts = np.unique(
        ranks(facets, n), return_index=True, return_inverse=True, return_counts=True
    )
    balance = np.bincount(place.reshape(-1), weights=sides)
    if counts.max() > 2 or balance[counts == 2].any():
        return False
    alone = first[counts == 1]
    return _support(facets[alone], sides[alone], chirotope) and _times_covered(simplices, chirotope) == 1


def _support(facets: NDArray[np.int64], sides: NDArray[np.int64], chirotope: Chirotope) -> bool:
    """Tell whether no point lies beyond any of the facets, whose simplices are on the given sides."""
    points = np.arange(chirotope.n)
    for facet, side in zip(facets, sides.tolist(), strict=True):
        others = points[~np.isin(points, facet)]
        joined = np.column_stack((np.tile(facet, (len(others), 1)), others))
        behind = (facet > others[:, None]).sum(axis=1)
        signs = chirotope.orientations(np.sort(joined, axis=1)) * np.where(behind & 1, -1, 1)
        if (signs * side < 0).any():
            return False
    return True


def _times_covered(simplices: NDArray[np.int64], chirotope: Chirotope) -> int:
    """Count the simplices with a generic point of the first: it is close to its first vertex, then to the next."""
    inside = np.ones(len(simplices), dtype=bool)
    undecided = np.ones(simplices.shape, dtype=bool)
    for point in simplices[0].tolist():
        signs = barycentric_signs(chirotope, simplices, point)
        inside &= ~(undecided & (signs < 0)).any(axis=1)
        undecided &= signs == 0
    return int(inside.sum())

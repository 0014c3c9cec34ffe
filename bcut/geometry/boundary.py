"""Which (d-1)-simplices lie in the boundary of the convex hull, without listing all orientations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.determinants import orientation_signs

# Points whose sides are looked at before the facets that are settled are left out: at least so many, and more where few
# facets are left.
_POINTS, _TUPLES = 4, 1 << 16


def lie_in_boundary(configuration: PointConfiguration, facets: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Tell which (d-1)-simplices have all points on one side.

    Parameters
    ----------
    configuration : PointConfiguration
    facets : ndarray of int, shape (k, d)

    Returns
    -------
    ndarray of bool, shape (k,)
        Decided exactly. True also where the d points are affinely dependent.
    """
    floats = configuration.floats
    # Points far out lie on both sides of most hyperplanes; the order matters for speed only.
    centre = floats.mean(axis=0)
    far_out_first = np.argsort(-np.abs(floats - centre).sum(axis=1), kind="stable")
    has_plus = np.zeros(len(facets), dtype=bool)
    has_minus = np.zeros(len(facets), dtype=bool)
    undecided = np.arange(len(facets))
    start = 0
    while start < configuration.n and len(undecided):
        points = far_out_first[start : start + max(_POINTS, _TUPLES // len(undecided))]
        start += len(points)
        rows = np.repeat(facets[undecided], len(points), axis=0)
        tuples = np.concatenate((rows, np.tile(points, len(undecided))[:, None]), axis=1)
        signs = orientation_signs(configuration, tuples).reshape(len(undecided), len(points))
        has_plus[undecided] |= (signs > 0).any(axis=1)
        has_minus[undecided] |= (signs < 0).any(axis=1)
        undecided = undecided[~(has_plus & has_minus)[undecided]]
    return ~(has_plus & has_minus)

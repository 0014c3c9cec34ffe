"""Which simplices overlap: pairs whose interiors meet, so that no dissection contains both.

In general position simplices that do not overlap meet in a common face, and this is the same as crossing
(`bcut.geometry.crossings`). Elsewhere they may touch without meeting in a common face.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope

# Entries of a table that are worked on at once.
_CHUNK = 1 << 24


def overlap_matrix(
    chirotope: Chirotope, simplices: NDArray[np.int64], others: NDArray[np.int64] | None = None
) -> NDArray[np.bool_]:
    """Tell which pairs of d-simplices have a common interior point.

    Two convex bodies have disjoint interiors exactly when a hyperplane separates them weakly. The affine
    functions that are >= 0 on one simplex and <= 0 on the other form a cone, pointed because the vertices
    span the space; so if there is one that is not zero, an extreme ray of the cone is one, and it vanishes on
    d affinely independent vertices. Hence it is enough to look at the hyperplanes through d points of the
    configuration, and any such hyperplane that separates will do.

    Parameters
    ----------
    chirotope : Chirotope
        Of the point configuration.
    simplices : ndarray of int, shape (m, d + 1)
    others : ndarray of int, shape (k, d + 1), optional
        The second partners; `simplices` again when omitted.

    Returns
    -------
    ndarray of bool, shape (m, k)
        A simplex does not overlap itself, by convention.
    """
    same = simplices if others is None else others
    spanning = chirotope.sides[(chirotope.sides != 0).any(axis=1)]
    # A hyperplane and its negative are one separation; both orders of the two simplices are looked at.
    above, below = _within(spanning >= 0, same), _within(spanning <= 0, same)
    result = np.empty((len(simplices), len(same)), dtype=bool)
    step = max(1, _CHUNK // max(1, len(spanning), len(same)))
    for start in range(0, len(simplices), step):
        part = simplices[start : start + step]
        # Sums of so few ones are exact in single precision, and products of floats are fast.
        apart = _within(spanning >= 0, part) @ below.T + _within(spanning <= 0, part) @ above.T
        result[start : start + step] = apart == 0
    equal = (np.sort(simplices, axis=1)[:, None] == np.sort(same, axis=1)[None]).all(axis=2)
    return result & ~equal


def _within(half_spaces: NDArray[np.bool_], simplices: NDArray[np.int64]) -> NDArray[np.float32]:
    """Tell which simplices lie in which closed half-spaces, shape (m, half-spaces)."""
    contained = np.ones((len(half_spaces), len(simplices)), dtype=bool)
    for vertices in simplices.T:
        contained &= half_spaces[:, vertices]
    return contained.T.astype(np.float32)

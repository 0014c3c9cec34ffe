"""Angles from correctly rounded operations only, so that every machine gets the same doubles.

The arcus functions of numpy and of C libraries differ in the last bit between processors, and a cost in a result
file must be found again on another one.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

# Enough terms of the series for double precision at arguments up to tan(pi/16).
_TERMS = 12


def arctangent2(y: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the angles in [0, pi] of the vectors (x, y) with y >= 0; 0 for the zero vector.

    The error is a few units in the last place.

    Parameters
    ----------
    y, x : ndarray of float, shape (m,)
    """
    width = np.abs(x)
    steep = y > width
    long = np.where(steep, y, width)
    with np.errstate(under="ignore"):
        tangents = np.where(steep, width, y) / np.where(long > 0, long, 1.0)
        angles = _arctangent(tangents)
    angles = np.where(steep, pi / 2 - angles, angles)
    return np.where(x < 0, pi - angles, angles)


def _arctangent(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the arcus tangens of numbers in [0, 1]: halve the angle twice, then sum the series."""
    for _ in range(2):
        t = t / (1.0 + np.sqrt(1.0 + t * t))
    square = t * t
    total = np.full(t.shape, 1.0 / (2 * _TERMS + 1))
    for k in range(_TERMS - 1, -1, -1):
        total = 1.0 / (2 * k + 1) - square * total
    return 4.0 * (t * total)

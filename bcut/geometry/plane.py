"""Points of the plane as doubles with one error bound, for filters that also compare lengths."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.configuration import PointConfiguration

_UNIT_ROUNDOFF = 2.0**-53
# With integers below this, differences, their products, and sums of two of these are exact in doubles.
_EXACT_BELOW = 2**25


@dataclass(frozen=True, eq=False)
class PlanePoints:
    """A similar copy of a configuration in the plane.

    Attributes
    ----------
    points : ndarray of float64, shape (n, 2)
        In a unit in which differences do not exceed 2, or small integers.
    delta : float
        No coordinate is off by more than this. Zero: coordinates are exact, and a difference of two is rounded once.
        Negative: they are integers so small that sums of products of two differences are exact as well.
    """

    points: NDArray[np.float64]
    delta: float

    @classmethod
    def of(cls, configuration: PointConfiguration) -> PlanePoints:
        """Convert a configuration of dimension 2. All coordinates are scaled alike: lengths keep their ratios."""
        numerators = configuration.numerators.astype(object)
        centred = numerators - numerators[0]
        largest = max(1, int(np.abs(centred).max()))
        degree = configuration.field.degree
        if degree == 1 and largest < _EXACT_BELOW:
            return cls(np.ascontiguousarray(centred[..., 0].astype(float)), -1.0)
        if degree == 1 and _are_doubles(configuration):
            floats = configuration.floats
            with np.errstate(under="ignore", over="ignore"):
                spread = float((floats.max(axis=0) / 2 - floats.min(axis=0) / 2).max())
                return cls(np.ldexp(floats, -int(np.frexp(spread)[1])), 0.0)
        # Python's true division of integers, of any size, rounds correctly.
        terms = np.true_divide(centred, largest).astype(float) * configuration.field.basis_floats
        spread = float(np.abs(terms).sum(axis=-1).max())
        # A sum of `degree` terms, each off by at most three roundings, summed and scaled with as many again.
        return cls(np.ascontiguousarray(terms.sum(axis=-1) / spread), 4 * (4 + 2 * degree) * _UNIT_ROUNDOFF)


def _are_doubles(configuration: PointConfiguration) -> bool:
    """Tell whether every rational coordinate is a double, and so equal to its nearest one."""
    numerators, denominator = configuration.numerators[..., 0], configuration.denominator
    if denominator & (denominator - 1):
        return False
    if np.abs(numerators).max() <= 2**53 and denominator < 2**1000:
        return True
    exact = zip(numerators.ravel().tolist(), configuration.floats.ravel().tolist(), strict=True)
    return all(Fraction(value, denominator) == Fraction(double) for value, double in exact)

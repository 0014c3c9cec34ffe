"""The volume row: the volumes of the chosen simplices add up to that of the hull (the paper, Sec. 2.1 and 2.2).

Where all volumes are small integral multiples of one number, that is an equation in integers. Elsewhere they are
rationals with long numerators (of points given as doubles) or real algebraic numbers. The coefficients on the basis of
the number field then give one equation over the rationals each, which together say the same as the equation over the
reals at rational points x. No single one of them will do here: unlike in `bcut.formulations.orbit_cocircuits`, where
cocircuit rows make the cover of the hull a constant, a stable set that leaves a part of the hull uncovered can agree
with the hull in one coefficient, such as the rational one if the volume of that part is a multiple of sqrt(5). Nor can
a solver with a tolerance tell tiny volumes from none.

So the row is written with its coefficients rounded to multiples of 2**-40 of the hull, as two rows,

    sum of floor(2**40 v_t / V) x_t  <=  2**40  <=  sum of ceil(2**40 v_t / V) x_t,

which every x >= 0 with the exact row satisfies: a relaxation, and a very close one. Shares below 2**-28 become 0 and
2**-28, for SCIP makes wrong cuts of coefficients near its tolerance of 10**-9. At 0/1 points the rows of
`bcut.formulations.lazy_rows.CoverageRows` see to the rest, exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.formulations.formulation import UNBOUNDED
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.volumes import hull_volume, volumes

# Up to this volume of the hull, in units of the common divisor, a solver's tolerance of 1e-6 is less than a unit.
_LARGEST_EXACT = 1 << 16
_SHIFT = 40
# The least coefficient other than 0.
_LEAST = 1 << (_SHIFT - 28)


@dataclass(frozen=True, eq=False)
class VolumeRows:
    """One row, or two that enclose it.

    Attributes
    ----------
    coefficients : ndarray of int64, shape (rows, m)
    lower, upper : ndarray of int64, shape (rows,)
    shifts : ndarray of int64, shape (rows,)
        Solvers are shown a row divided by two to this power.
    names : tuple of str
    exact : bool
        Whether a solver with the usual tolerance tells 0/1 points that satisfy the exact row from others.
    """

    coefficients: NDArray[np.int64]
    lower: NDArray[np.int64]
    upper: NDArray[np.int64]
    shifts: NDArray[np.int64]
    names: tuple[str, ...]
    exact: bool


def volume_rows(
    configuration: PointConfiguration, chirotope: Chirotope, simplices: NDArray[np.int64]
) -> VolumeRows:
    """Return the volume row of some simplices, exact or enclosed.

    Parameters
    ----------
    configuration : PointConfiguration
    chirotope : Chirotope
        Of the same configuration.
    simplices : ndarray of int64, shape (m, d + 1)
    """
    parts = volumes(configuration, simplices).astype(object)
    whole = hull_volume(configuration, chirotope.hull_facets)
    if not parts[:, 1:].any() and not whole[1:].any():
        divisor = gcd(int(whole[0]), *map(int, parts[:, 0]))
        total = int(whole[0]) // divisor
        if total <= _LARGEST_EXACT:
            row = np.array([int(v) // divisor for v in parts[:, 0]], dtype=np.int64)[None]
            sides = np.array([total])
            return VolumeRows(row, sides, sides.copy(), np.zeros(1, dtype=np.int64), ("volume",), True)
    low, high = _shares(configuration, parts, whole)
    return VolumeRows(
        np.stack((low, high)),
        np.array([-UNBOUNDED, 1 << _SHIFT]),
        np.array([1 << _SHIFT, UNBOUNDED]),
        np.full(2, _SHIFT),
        ("volume_at_most", "volume_at_least"),
        False,
    )


def _shares(
    configuration: PointConfiguration, parts: NDArray[Any], whole: NDArray[Any]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return lower and upper bounds on the shares of the hull, times 2**40, hardly more than 1 apart."""
    largest = max(abs(int(v)) for v in (*parts.reshape(-1), *whole))
    # More bits until the relative error of the hull's volume does not matter: large coefficients may nearly cancel.
    bits = 2 * _SHIFT + largest.bit_length()
    while True:
        basis = [int(value) for value in configuration.field.enclosures(bits)]
        total, error = _enclosed(whole, basis)
        if total > error << _SHIFT:
            break
        bits *= 2
    low, high = [], []
    for part in parts:
        value, own = _enclosed(part, basis)
        low.append(max(0, ((value - own) << _SHIFT) // (total + error)))
        high.append(-((-(value + own) << _SHIFT) // (total - error)))
    lower, upper = np.array(low, dtype=np.int64), np.array(high, dtype=np.int64)
    return np.where(lower < _LEAST, 0, lower), np.maximum(upper, _LEAST)


def _enclosed(coefficients: NDArray[Any], basis: list[int]) -> tuple[int, int]:
    """Return an integer and a bound on its distance to the number times a power of two."""
    value = sum(int(c) * b for c, b in zip(coefficients, basis, strict=True))
    # The first basis element is 1, whose enclosure is exact.
    return value, sum(abs(int(c)) for c in coefficients[1:])

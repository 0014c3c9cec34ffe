"""Signs of determinants of point tuples: exact, vectorised over many tuples at once.

Three tiers, each exact on what it decides:

1. rational points whose determinants provably fit into 64 bits: integer arithmetic;
2. otherwise floating point with a proven error bound, which decides all but (nearly) vanishing determinants;
3. for those, integer arithmetic on arrays of Python integers, or of coefficients in a real number field.
"""

from __future__ import annotations

from math import comb, factorial, prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.configuration import PointConfiguration

Signs = NDArray[np.int8]

# Numbers in the widest layer of minors: large enough to amortise numpy's overhead, small enough for the
# cache.
_CHUNK = 1 << 18
_UNIT_ROUNDOFF = 2.0**-53


def orientation_signs(configuration: PointConfiguration, tuples: NDArray[np.integer]) -> Signs:
    """Return the orientation of each (d+1)-tuple of points.

    Parameters
    ----------
    configuration : PointConfiguration
        n points in dimension d.
    tuples : ndarray of int, shape (m, d + 1)
        Indices of points, in the order that defines the orientation.

    Returns
    -------
    ndarray of int8, shape (m,)
        Sign of ``det(p_1 - p_0, ..., p_d - p_0)``: -1, 0 or 1, decided exactly.
    """
    kernel = _Kernel(configuration)
    d = configuration.dimension
    step = max(1, _CHUNK // (comb(d, d // 2) * configuration.field.degree))
    signs = np.empty(len(tuples), dtype=np.int8)
    for start in range(0, len(tuples), step):
        signs[start : start + step] = kernel.signs(tuples[start : start + step])
    return signs


def determinants(rows: list[list[Any]], multiply: Any = np.multiply) -> Any:
    """Return determinants by expansion along the rows, each minor computed once.

    Parameters
    ----------
    rows : list of d lists of d arrays
        ``rows[i][j]`` holds entry (i, j) of every matrix; any shapes that `multiply` accepts.
    multiply : callable
        Product of two entries. Sums and differences are numpy's.

    Returns
    -------
    array
        The determinants. Every intermediate value is a minor, bounded by ``k! * B**k`` for entries bounded by
        B.
    """
    return minors(rows, multiply)[(1 << len(rows)) - 1]


def minors(rows: list[list[Any]], multiply: Any = np.multiply) -> dict[int, Any]:
    """Return all maximal minors of matrices with k rows and d >= k columns, by expansion along the rows.

    Parameters
    ----------
    rows : list of k lists of d arrays
        As for `determinants`; at least one row.
    multiply : callable
        Product of two entries.

    Returns
    -------
    dict
        From each set of k columns, as the bits of an integer, to the minors on these columns.
    """
    d = len(rows[0])
    found = {1 << j: rows[0][j] for j in range(d)}
    for size in range(1, len(rows)):
        grown: dict[int, Any] = {}
        for columns in (mask for mask in range(1 << d) if mask.bit_count() == size + 1):
            total = None
            for j in (j for j in range(d) if columns >> j & 1):
                term = multiply(rows[size][j], found[columns & ~(1 << j)])
                # The entry of column j in the last row: its sign is the parity of the columns to its right.
                negative = (columns >> (j + 1)).bit_count() & 1
                if total is None:
                    total = -term if negative else term
                else:
                    total = total - term if negative else total + term
            grown[columns] = total
        found = grown
    return found


class _Kernel:
    """The tiers for one configuration, prepared once."""

    def __init__(self, configuration: PointConfiguration) -> None:
        self.field = configuration.field
        self.dimension = d = configuration.dimension
        # Centred numerators: a translation changes no determinant and makes the entries small.
        numerators = configuration.numerators.astype(object)
        numerators = numerators - numerators[0]
        # Differences are at most twice these. A term of a determinant has one factor from each column, and a
        # product in the field multiplies bounds by the sum of |structure|, which itself may exceed 64 bits.
        largest = np.abs(numerators).max(axis=(0, 2), initial=1)
        degree = self.field.degree
        growth = 1 if degree == 1 else int(np.abs(self.field.structure).astype(object).sum(axis=(0, 1)).max())
        bound = factorial(d) * prod(2 * int(value) for value in largest) * growth ** (d - 1)
        exact_in_64_bits = bound < 2**62
        self.numerators = numerators.astype(np.int64) if exact_in_64_bits else numerators
        self.integers_decide = exact_in_64_bits and degree == 1
        if not self.integers_decide:
            self._prepare_filter(numerators, largest)

    def _prepare_filter(self, numerators: NDArray[np.object_], largest: NDArray[np.object_]) -> None:
        """Scale each coordinate into [-1, 1] and bound the error of a determinant of differences.

        Scaling a coordinate, at all points alike, changes no sign. With u = 2**-53 and a field of degree r: a
        scaled coordinate is a sum of at most r terms, each off by at most 3u relative (conversion, basis
        number, product), summed and scaled with another r roundings, so it is within (3 + r)u of the exact
        one. A difference is at most 2 in size and within (8 + 2r)u. The determinant is a sum of d! products
        of d such entries; each product goes through d - 1 multiplications and, a minor of size k having k
        terms, at most 1 + 2 + ... + (d - 1) additions. To first order the error is at most ``d! 2**d d (4 +
        r) u`` from the entries plus ``d! 2**d d (d + 1)/2 u`` from the arithmetic; the bound below is twice
        that, which covers the higher orders.
        """
        d, degree = self.dimension, self.field.degree
        scales = np.broadcast_to(largest[None, :, None], numerators.shape)
        # Python's true division of integers, of any size, rounds correctly.
        scaled = np.true_divide(numerators, scales).astype(float)
        if degree > 1:
            terms = scaled * self.field.basis_floats
            spread = np.abs(terms).sum(axis=-1).max(axis=0)
            scaled = terms.sum(axis=-1) / np.where(spread > 0, spread, 1.0)
        else:
            scaled = scaled[..., 0]
        self.scaled = scaled
        self.error_bound = factorial(d) * 2.0**d * d * (2 * (4 + degree) + d + 1) * _UNIT_ROUNDOFF

    def signs(self, tuples: NDArray[np.integer]) -> Signs:
        if self.integers_decide:
            return np.sign(self._integer_determinants(tuples)[..., 0]).astype(np.int8)
        values = determinants(_differences(self.scaled, tuples))
        signs = np.where(values > 0, 1, -1).astype(np.int8)
        unsure = np.flatnonzero(~(np.abs(values) > self.error_bound))
        if len(unsure):
            signs[unsure] = self._exact_signs(tuples[unsure])
        return signs

    def _exact_signs(self, tuples: NDArray[np.integer]) -> Signs:
        values = self._integer_determinants(tuples)
        if self.field.degree > 1:
            return self.field.signs(values)
        return np.array([(v > 0) - (v < 0) for v in values[..., 0]], dtype=np.int8)

    def _integer_determinants(self, tuples: NDArray[np.integer]) -> Any:
        """Return coefficients, shape (m, degree), of the determinants of the numerators."""
        if self.field.degree == 1:
            return np.asarray(determinants(_differences(self.numerators[..., 0], tuples)))[:, None]
        return determinants(_differences(self.numerators, tuples), self._field_product)

    def _field_product(self, left: Any, right: Any) -> Any:
        """Multiply arrays of field elements, shape (m, degree), by the structure constants."""
        structure = self.field.structure
        result = np.zeros(left.shape, dtype=left.dtype)
        for i, j, k in zip(*np.nonzero(structure), strict=True):
            result[:, k] += left[:, i] * right[:, j] * int(structure[i, j, k])
        return result


def _differences(coordinates: Any, tuples: NDArray[np.integer]) -> list[list[Any]]:
    """Return entry arrays of the matrices with rows p_i - p_0."""
    base = coordinates[tuples[:, 0]]
    rows = [coordinates[tuples[:, i]] - base for i in range(1, tuples.shape[1])]
    return [[row[:, j] for j in range(coordinates.shape[1])] for row in rows]

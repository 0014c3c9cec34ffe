"""The affine symmetries of a point configuration, as permutations of its points, found by search and proven exactly.

Let V be the (d+1) x n matrix of the homogeneous coordinates (columns (p_i, 1)), and P = V^T (V V^T)^-1 V, the
orthogonal projection onto its row space. A permutation comes from an affine map of space exactly when it maps the row
space to itself, that is, when it leaves the matrix P unchanged: ``P[g(i), g(j)] = P[i, j]``. So the symmetries are
the automorphisms of a complete graph with coloured edges, and the images of an affine basis determine each of them,
because the vectors that P is the Gram matrix of are determined by their products with d + 1 independent ones among
them.

P is computed exactly in the number field of the coordinates. Each permutation that the search returns leaves the
exact matrix unchanged, which proves it; `is_symmetry` proves it again, in another way, from the coordinates.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from math import lcm
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.numbers import AlgebraicNumber, RealField, exact_scalar
from bcut.geometry.permutations import Level, PermutationGroup, index_type, level_of
from bcut.geometry.rank import pivot_columns

Exact = NDArray[Any]


@lru_cache(maxsize=8)
def symmetry_group(configuration: PointConfiguration) -> PermutationGroup:
    """Return the group of all affine symmetries of a configuration.

    Parameters
    ----------
    configuration : PointConfiguration

    Returns
    -------
    PermutationGroup
        Of permutations g of the points for which some affine map takes point i to point g(i), for all i.
    """
    field = configuration.field
    columns = _homogeneous(configuration)
    gram = _inverse_up_to_scale(_product(columns, columns.transpose(1, 0, 2), field), field)
    half = _product(gram, columns, field)
    lengths = _entries_product(columns, half, field).sum(axis=0)
    point_colours = _colours(lengths)
    if point_colours.max(initial=0) == configuration.n - 1:
        return PermutationGroup.trivial(configuration.n)
    matrix = _product(columns.transpose(1, 0, 2), half, field)
    return _Search(_colours(matrix), _affine_basis(configuration, point_colours)).run()


def is_symmetry(configuration: PointConfiguration, permutation: NDArray[np.integer]) -> bool:
    """Tell whether a permutation of the points extends to an affine map, exactly and from the coordinates alone.

    The affine map that the images of an affine basis determine is applied to every point.
    """
    images = np.asarray(permutation, dtype=np.int64)
    if images.shape != (configuration.n,) or not np.array_equal(np.sort(images), np.arange(configuration.n)):
        return False
    basis, scale, weights = _barycentric(configuration)
    columns = _homogeneous(configuration)
    field = configuration.field
    # scale * point = sum of weights * basis points must hold for the images as well.
    left = _entries_product(columns[:, images], np.broadcast_to(scale, columns[:, images].shape), field)
    right = _product(columns[:, images[basis]], weights, field)
    return bool(np.all(left == right))


def _homogeneous(configuration: PointConfiguration) -> Exact:
    """Return V as Python integers on the field's basis, shape (d + 1, n, r)."""
    numerators = configuration.numerators.astype(object)
    ones = np.zeros((configuration.n, 1, configuration.field.degree), dtype=object)
    ones[:, :, 0] = 1
    return np.ascontiguousarray(np.concatenate((numerators, ones), axis=1).transpose(1, 0, 2))


def _product(left: Exact, right: Exact, field: RealField) -> Exact:
    """Multiply matrices over the field, (a, b, r) times (b, c, r)."""
    result = np.zeros((left.shape[0], right.shape[1], field.degree), dtype=object)
    for (i, j), terms in field.products.items():
        part = left[:, :, i].dot(right[:, :, j])
        for k, constant in terms:
            result[:, :, k] += part * constant
    return result


def _entries_product(left: Exact, right: Exact, field: RealField) -> Exact:
    """Multiply arrays over the field entry by entry, shape (..., r)."""
    result = np.zeros(left.shape, dtype=object)
    for (i, j), terms in field.products.items():
        part = left[..., i] * right[..., j]
        for k, constant in terms:
            result[..., k] += part * constant
    return result


def _scalars(matrix: Exact, field: RealField) -> list[list[Fraction | AlgebraicNumber]]:
    return [[exact_scalar(field, entry, 1) for entry in row] for row in matrix.tolist()]


def _inverse_up_to_scale(matrix: Exact, field: RealField) -> Exact:
    """Return a positive multiple of the inverse of a regular matrix over the field, as integer coefficients."""
    size = len(matrix)
    one = exact_scalar(field, [1, *[0] * (field.degree - 1)], 1)
    rows = _scalars(matrix, field)
    for i, row in enumerate(rows):
        row.extend(one if i == j else one - one for j in range(size))
    for column in range(size):
        pivot = next(i for i in range(column, size) if rows[i][column])
        rows[column], rows[pivot] = rows[pivot], rows[column]
        factor = one / rows[column][column]
        rows[column] = [factor * value for value in rows[column]]
        for i in range(size):
            share = rows[i][column]
            if i != column and share:
                rows[i] = [a - share * b for a, b in zip(rows[i], rows[column], strict=True)]
    return _integers([row[size:] for row in rows], field)


def _integers(rows: list[list[Fraction | AlgebraicNumber]], field: RealField) -> Exact:
    """Return field elements over a common denominator, without it, shape (a, b, r)."""
    coefficients = [
        [value.coefficients if isinstance(value, AlgebraicNumber) else (value,) for value in row]
        for row in rows
    ]
    denominator = lcm(*(c.denominator for row in coefficients for entry in row for c in entry))
    result = np.empty((len(rows), len(rows[0]), field.degree), dtype=object)
    for i, row in enumerate(coefficients):
        for j, entry in enumerate(row):
            result[i, j] = [int(c * denominator) for c in entry]
    return result


def _colours(exact: Exact) -> NDArray[np.int64]:
    """Give numbers to the different values of an array over the field, shape (..., r) to (...)."""
    flat = exact.reshape(-1, exact.shape[-1])
    number: dict[tuple[int, ...], int] = {}
    colours = [number.setdefault(tuple(entry), len(number)) for entry in flat.tolist()]
    return np.array(colours, dtype=np.int64).reshape(exact.shape[:-1])


def _affine_basis(configuration: PointConfiguration, colours: NDArray[np.int64]) -> list[int]:
    """Return d + 1 affinely independent points, those of rare colours first."""
    order = np.argsort(np.bincount(colours)[colours], kind="stable")
    rows = _scalars(_homogeneous(configuration)[:, order], configuration.field)
    return [int(order[column]) for column in pivot_columns(rows)]


@lru_cache(maxsize=8)
def _barycentric(configuration: PointConfiguration) -> tuple[NDArray[np.int64], Exact, Exact]:
    """Return a basis, s > 0 and integers w, shape (d + 1, n, r), with ``s p_j = sum_i w_ij basis_i`` for all points."""
    field = configuration.field
    columns = _homogeneous(configuration)
    basis = np.array(pivot_columns(_scalars(columns, field)), dtype=np.int64)
    inverse = _inverse_up_to_scale(columns[:, basis], field)
    weights = _product(inverse, columns, field)
    return basis, weights[0, basis[0]], weights


class _Search:
    """Automorphisms of a complete graph with coloured edges and vertices, by backtracking along a base.

    The colours of a point's edges to the base points so far are hashed into one number per point. Equal numbers of
    unequal colours would only make the search try more: what it returns is compared with the whole matrix.
    """

    def __init__(self, matrix: NDArray[np.int64], base: list[int]) -> None:
        self.matrix, self.base = matrix, base
        self.n = len(matrix)
        # Odd multipliers are invertible, so a hash never forgets a colour for sure.
        rng = np.random.default_rng(0)
        self.factors = rng.integers(1, 2**63, size=len(base) + 1, dtype=np.uint64) | np.uint64(1)
        self.mixed = rng.integers(0, 2**63, size=int(matrix.max()) + 1, dtype=np.uint64)[matrix]
        rows = np.sort(matrix, axis=1)
        classes = np.unique(np.column_stack((np.diagonal(matrix), rows)), axis=0, return_inverse=True)[
            1
        ].reshape(-1)
        self.codes = [rng.integers(0, 2**63, size=int(classes.max()) + 1, dtype=np.uint64)[classes]]
        for depth, point in enumerate(base):
            self.codes.append(self._extended(self.codes[-1], depth, point))
        self.sorted_codes = [np.sort(codes) for codes in self.codes]

    def run(self) -> PermutationGroup:
        """Work up from the deepest level: there is nothing but the identity below it."""
        generators: list[NDArray[np.int64]] = []
        levels: list[Level] = []
        for depth in reversed(range(len(self.base))):
            level = self._level(depth, generators)
            levels.insert(0, level)
        return PermutationGroup(self.n, np.array(generators, dtype=np.int64).reshape(-1, self.n), levels)

    def _level(self, depth: int, generators: list[NDArray[np.int64]]) -> Level:
        """Find the orbit of a base point under the automorphisms that fix those before it; adds to the generators."""
        point = self.base[depth]
        codes = self.codes[depth]
        level = level_of(point, generators, self.n)
        decided = np.zeros(self.n, dtype=bool)
        decided[level.orbit] = True
        for image in np.flatnonzero(codes == codes[point]).tolist():
            if decided[image]:
                continue
            found = self._extend(depth + 1, self._extended(codes, depth, image))
            if found is None:
                # No image of it under the group found so far can be reached either.
                decided[level_of(image, generators, self.n).orbit] = True
                continue
            generators.append(found)
            level = level_of(point, generators, self.n)
            decided[level.orbit] = True
        return level

    def _extended(self, codes: NDArray[np.uint64], depth: int, point: int) -> NDArray[np.uint64]:
        return codes * self.factors[depth] + (self.mixed[point] ^ (self.mixed[point] >> np.uint64(29)))

    def _extend(self, depth: int, codes: NDArray[np.uint64]) -> NDArray[np.int64] | None:
        """Extend images of the first base points, given by their codes, to an automorphism."""
        if not np.array_equal(np.sort(codes), self.sorted_codes[depth]):
            return None
        if depth == len(self.base):
            return self._automorphism(codes)
        wanted = self.codes[depth][self.base[depth]]
        for image in np.flatnonzero(codes == wanted).tolist():
            found = self._extend(depth + 1, self._extended(codes, depth, image))
            if found is not None:
                return found
        return None

    def _automorphism(self, codes: NDArray[np.uint64]) -> NDArray[np.int64] | None:
        permutation = np.empty(self.n, dtype=np.int64)
        permutation[np.argsort(self.codes[-1])] = np.argsort(codes)
        if np.array_equal(self.matrix[np.ix_(permutation, permutation)], self.matrix):
            return permutation
        return None


__all__ = ["PermutationGroup", "index_type", "is_symmetry", "symmetry_group"]

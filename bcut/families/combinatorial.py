"""Families with integer coordinates: cubes, cross-polytopes, cyclic polytopes, products, grids and more."""

from __future__ import annotations

import itertools
import math

import numpy as np
import numpy.typing as npt

from bcut.families.parameters import MAX_POINTS, Parameters

Integers = npt.NDArray[np.int64]


def cube(parameters: Parameters) -> Integers:
    """Vertices of [0, 1]^d in binary order: point i has the binary digits of i, the highest one first."""
    d = parameters.integer("D", 2, 62, default=3)
    parameters.finish(2**d, d)
    indices = np.arange(2**d, dtype=np.int64)
    return (indices[:, np.newaxis] >> np.arange(d - 1, -1, -1)) & 1


def cross_polytope(parameters: Parameters) -> Integers:
    """Return the points +e_1, -e_1, +e_2, -e_2, ..."""
    d = parameters.integer("D", 2)
    parameters.finish(2 * d, d)
    points = np.zeros((2 * d, d), dtype=np.int64)
    axes = np.arange(d)
    points[2 * axes, axes] = 1
    points[2 * axes + 1, axes] = -1
    return points


def cyclic(parameters: Parameters) -> list[list[int]]:
    """Points (t, t^2, ..., t^d) in the order of t, for n consecutive integers t around 0.

    Where the integers begin does not matter, as a shift of t is an affine map; around 0 the coordinates stay
    small.
    """
    n, d = parameters.integer("N", 3), parameters.integer("D", 2, 1000)
    if n < d + 1:
        parameters.fail(f"N must be at least D + 1 = {d + 1}, not {n}")
    parameters.finish(n, d * d)  # the coordinates have up to d log2(n) bits each
    first = -((n - 1) // 2)
    return [[t**k for k in range(1, d + 1)] for t in range(first, first + n)]


def simplex_product(parameters: Parameters) -> Integers:
    """Products of the vertices 0, e_1, ..., e_a of each factor; the last factor's vertex changes fastest."""
    factors = parameters.integers("A", 1)
    dimension = sum(factors)
    if dimension < 2:
        parameters.fail("the dimensions of the factors must add up to at least 2")
    parameters.finish(math.prod(a + 1 for a in factors), dimension)
    corners = [np.vstack([np.zeros((1, a), dtype=np.int64), np.eye(a, dtype=np.int64)]) for a in factors]
    return np.array([np.concatenate(choice) for choice in itertools.product(*corners)])


def hypersimplex(parameters: Parameters) -> Integers:
    """Return the 0/1 vectors of length n with k ones, in lexicographic order of their supports.

    The last entry is left out: it is k minus the sum of the others, so that is an affine isomorphism.
    """
    n, k = parameters.integer("N", 3, 62), parameters.integer("K", 1)
    if k >= n:
        parameters.fail(f"K must be below N = {n}, not {k}")
    count = math.comb(n, k)
    parameters.finish(count, n - 1)
    points = np.zeros((count, n), dtype=np.int64)
    supports = np.array(list(itertools.combinations(range(n), k)))
    np.put_along_axis(points, supports, 1, axis=1)
    return points[:, :-1]


def grid(parameters: Parameters) -> Integers:
    """All integer points with 0 <= x_i < a_i; the last coordinate changes fastest."""
    sizes = parameters.integers("A", 2)
    if len(sizes) < 2:
        parameters.fail("a grid needs at least two directions")
    parameters.finish(math.prod(sizes) if len(sizes) < 64 else MAX_POINTS + 1, len(sizes))
    return np.array(list(itertools.product(*map(range, sizes))), dtype=np.int64)


def moae(parameters: Parameters) -> Integers:
    """Two nested triangles with parallel edges: "the mother of all examples" of a non-regular triangulation.

    Barycentric coordinates (4,0,0), (0,4,0), (0,0,4), (2,1,1), (1,2,1), (1,1,2), without the third.
    """
    parameters.finish(6, 2)
    return np.array([[4, 0], [0, 4], [0, 0], [2, 1], [1, 2], [1, 1]])

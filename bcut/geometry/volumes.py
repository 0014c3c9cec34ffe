"""Exact volumes of simplices, as integers on the basis of the coordinates' number field."""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial, prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.determinants import determinants
from bcut.geometry.hull import incidence, vertices_of_hull

_CHUNK = 1 << 14


def volumes(configuration: PointConfiguration, simplices: NDArray[np.integer]) -> NDArray[Any]:
    """Return the normalised volumes of some simplices.

    Parameters
    ----------
    configuration : PointConfiguration
    simplices : ndarray of int, shape (m, d + 1)

    Returns
    -------
    ndarray of int64 or of Python integers, shape (m, r)
        ``d! * denominator**d`` times the volumes, as coefficients on the basis of the field.
    """
    field, d = configuration.field, configuration.dimension
    numerators = configuration.numerators.astype(object)
    numerators = numerators - numerators[0]
    largest = np.abs(numerators).max(axis=(0, 2), initial=1)
    growth = 1 if field.degree == 1 else int(np.abs(field.structure).astype(object).sum(axis=(0, 1)).max())
    bound = factorial(d) * prod(2 * int(value) for value in largest) * growth ** (d - 1)
    if bound < 2**62:
        numerators = numerators.astype(np.int64)
    parts = [np.empty((0, field.degree), dtype=numerators.dtype)]
    for start in range(0, len(simplices), _CHUNK):
        corners = numerators[simplices[start : start + _CHUNK]]
        edges = corners[:, 1:] - corners[:, :1]
        if field.degree == 1:
            values = determinants([[edges[:, i, j, 0] for j in range(d)] for i in range(d)])[:, None]
        else:
            rows = [[edges[:, i, j] for j in range(d)] for i in range(d)]
            values = determinants(rows, lambda left, right: _product(left, right, field))
        parts.append(values * field.signs(values)[:, None].astype(values.dtype))
    return np.concatenate(parts)


def _product(left: Any, right: Any, field: Any) -> Any:
    """Multiply elements of the field, shape (m, r)."""
    result = np.zeros(left.shape, dtype=left.dtype)
    for (i, j), terms in field.products.items():
        for k, constant in terms:
            result[:, k] += left[:, i] * right[:, j] * constant
    return result


def hull_volume(configuration: PointConfiguration, hull_facets: Sequence[Sequence[int]]) -> NDArray[Any]:
    """Return the normalised volume of the convex hull, shape (r,): the sum of `volumes` over any triangulation.

    Parameters
    ----------
    configuration : PointConfiguration
    hull_facets : sequence of sequences of int
        All points on each facet of the hull.
    """
    simplices = pulling_triangulation(hull_facets, configuration.n)
    return volumes(configuration, simplices).astype(object).sum(axis=0)


def pulling_triangulation(hull_facets: Sequence[Sequence[int]], n: int) -> NDArray[np.int64]:
    """Return a triangulation of the convex hull, from nothing but which points lie on which facets.

    Each face is the union of the pyramids from its least vertex over its own facets that do not contain it.

    Parameters
    ----------
    hull_facets : sequence of sequences of int
        All points on each facet of the hull.
    n : int
        Number of points; those that are no vertices of the hull are not used.

    Returns
    -------
    ndarray of int64, shape (k, d + 1)
        Ascending vertices.
    """
    vertices = vertices_of_hull(hull_facets, n)
    masks = [sum(1 << v for v in vertices if row[v]) for row in incidence(hull_facets, n)]
    known: dict[int, list[tuple[int, ...]]] = {}

    def simplices_of(face: int) -> list[tuple[int, ...]]:
        if face not in known:
            least = (face & -face).bit_length() - 1
            parts = {face & mask for mask in masks} - {face, 0}
            facets = [p for p in parts if not any(p != q and p & q == p for q in parts)]
            away = [simplex for p in facets if not p >> least & 1 for simplex in simplices_of(p)]
            known[face] = [(least, *simplex) for simplex in away] or [(least,)]
        return known[face]

    return np.array(sorted(simplices_of(sum(1 << v for v in vertices))), dtype=np.int64)

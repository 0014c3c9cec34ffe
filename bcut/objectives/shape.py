"""Shapes of simplices as numbers: ratio of radii, dihedral and solid angles.

With D the determinant of the differences from one vertex (d! times the volume) and N_i the vector of the maximal minors
of the differences within facet i, signed so that all point outwards or all inwards (its length is (d-1)! times the
facet's volume), the measures are quotients and square roots of polynomials in the differences of the vertices, and
arcs of tangents of such. The polynomials are evaluated in doubles first. Where one of them is so small that rounding
could matter, as for slivers, those of that simplex are evaluated again in integers: every result is good to nine
digits and nearly all are to fourteen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.determinants import minors
from bcut.objectives.arctangent import arctangent2
from bcut.objectives.edges import Corners, FloatCorners, IntegerCorners, as_doubles, edges_of

Doubles = NDArray[np.float64]

# Simplices at once: their numbers fit a processor's cache.
_CHUNK = 1 << 14
# A polynomial in doubles is believed where it is at least this part of what its terms may add up to.
_CERTAIN = 2.0**-20


@dataclass
class Polynomials:
    """Polynomials in the differences of the vertices, at each of m simplices.

    Attributes
    ----------
    values : list of (int, array)
        Degree and values.
    sizes : list of (array, array)
        Values that cancellation may spoil, and what their terms add up to in size.
    """

    values: list[tuple[int, Any]] = field(default_factory=list)
    sizes: list[tuple[Any, Any]] = field(default_factory=list)


@dataclass(frozen=True)
class Shape:
    """A measure: the polynomials that it needs, and what it makes of them.

    Attributes
    ----------
    polynomials : callable
        From corners and the dimension.
    finish : callable
        From the dimension and the polynomials' values as doubles, in order.
    """

    polynomials: Callable[[Corners, int], Polynomials]
    finish: Callable[[int, Sequence[Doubles]], Doubles]


def evaluate(shape: Shape, configuration: PointConfiguration, simplices: NDArray[np.integer]) -> Doubles:
    """Measure simplices.

    Parameters
    ----------
    shape : Shape
    configuration : PointConfiguration
    simplices : ndarray of int, shape (m, d + 1)
        Ascending vertices.

    Returns
    -------
    ndarray of float, shape (m,)
    """
    edges, d = edges_of(configuration), configuration.dimension
    result = np.empty(len(simplices))
    for start in range(0, len(simplices), _CHUNK):
        chunk = simplices[start : start + _CHUNK]
        with np.errstate(all="ignore"):
            found = shape.polynomials(FloatCorners(edges, chunk), d)
            measured = shape.finish(d, [values for _, values in found.values])
            unsure = np.zeros(len(chunk), dtype=bool)
            for values, size in found.sizes:
                unsure |= ~(np.abs(values) > _CERTAIN * size)
            if unsure.any():
                corners = IntegerCorners(edges, chunk[unsure])
                bits = corners.bits()
                exact = [
                    as_doubles(values, [degree * size for size in bits])
                    for degree, values in shape.polynomials(corners, d).values
                ]
                measured[unsure] = shape.finish(d, exact)
        result[start : start + _CHUNK] = measured
    return result


def facet_normal(corners: Corners, vertices: Sequence[int]) -> list[Any]:
    """Return the signed minors of the differences of d vertices from the first: (d-1)! times the volume long."""
    rows = [corners.difference(vertices[0], vertex) for vertex in vertices[1:]]
    d = len(vertices)
    found = minors(rows)
    everything = (1 << d) - 1
    return [found[everything & ~(1 << j)] * (-1) ** j for j in range(d)]


def square(vector: Sequence[Any]) -> Any:
    """Return the squared lengths."""
    return _dot(vector, vector)


def _dot(left: Sequence[Any], right: Sequence[Any]) -> Any:
    total = left[0] * right[0]
    for a, b in zip(left[1:], right[1:], strict=True):
        total = total + a * b
    return total


def _is_float(values: Any) -> bool:
    return bool(values.dtype.kind == "f")


def _determinant(corners: Corners, d: int, found: Polynomials) -> list[list[Any]]:
    """Add D to the polynomials; return the differences from vertex 0."""
    rows = [corners.difference(0, i) for i in range(1, d + 1)]
    value = minors(rows)[(1 << d) - 1]
    found.values.append((d, value))
    if _is_float(value):
        found.sizes.append((value, prod(np.sqrt(square(row)) for row in rows)))
    return rows


def _normals(corners: Corners, d: int) -> list[list[Any]]:
    """Return N_i for the facet opposite to each vertex, signed alike."""
    normals = []
    for i in range(d + 1):
        normal = facet_normal(corners, [j for j in range(d + 1) if j != i])
        normals.append([-c for c in normal] if i & 1 else normal)
    return normals


def _ratio_polynomials(corners: Corners, d: int) -> Polynomials:
    """D, the squared length of 2 D times the vector from vertex 0 to the circumcentre, and that of each N_i."""
    found = Polynomials()
    rows = _determinant(corners, d, found)
    normals = _normals(corners, d)
    squares = [square(row) for row in rows]
    centre = [sum(s * normal[j] for s, normal in zip(squares, normals[1:], strict=True)) for j in range(d)]
    lengths = [square(normal) for normal in normals]
    found.values.append((2 * d + 2, square(centre)))
    found.values += [(2 * d - 2, length) for length in lengths]
    if _is_float(squares[0]):
        reach = sum(s * np.sqrt(length) for s, length in zip(squares, lengths[1:], strict=True))
        found.sizes.append((np.sqrt(square(centre)), reach))
    return found


def _ratio_of_radii(d: int, values: Sequence[Doubles]) -> Doubles:
    """R = |centre| / 2 |D| and r = |D| / sum of |N_i|."""
    determinant, centre, *normals = values
    surface = np.sqrt(normals[0])
    for normal in normals[1:]:
        surface = surface + np.sqrt(normal)
    return np.sqrt(centre) / (2.0 * np.abs(determinant)) * (surface / np.abs(determinant))


def _dihedral_polynomials(corners: Corners, d: int) -> Polynomials:
    """D, and for each two facets N_i N_j and the squared volume of the ridge that they share, times (d-2)!^2."""
    found = Polynomials()
    _determinant(corners, d, found)
    normals = _normals(corners, d)
    for i, j in combinations(range(d + 1), 2):
        found.values.append((2 * d - 2, _dot(normals[i], normals[j])))
        ridge = [k for k in range(d + 1) if k not in (i, j)]
        if d == 2:
            ridge_square = normals[i][0] * 0 + 1  # a single vertex
        else:
            rows = [corners.difference(ridge[0], k) for k in ridge[1:]]
            ridge_square = square(list(minors(rows).values()))
        found.values.append((2 * d - 4, ridge_square))
    return found


def _smallest_dihedral_angle(d: int, values: Sequence[Doubles]) -> Doubles:
    """Facets i and j meet at the angle of cosine -N_i N_j / |N_i| |N_j| and sine |D| |ridge| / |N_i| |N_j|."""
    determinant = np.abs(values[0])
    smallest = np.full(determinant.shape, np.inf)
    for product, ridge in zip(values[1::2], values[2::2], strict=True):
        smallest = np.minimum(smallest, arctangent2(determinant * np.sqrt(ridge), -product))
    return smallest


def _solid_polynomials(corners: Corners, d: int) -> Polynomials:
    """D, and at each vertex of a tetrahedron the products of the three edges there with each other."""
    found = Polynomials()
    _determinant(corners, d, found)
    for vertex in range(d + 1):
        edges = [
            corners.difference(vertex, k) if vertex < k else [-c for c in corners.difference(k, vertex)]
            for k in range(d + 1)
            if k != vertex
        ]
        for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
            found.values.append((2, _dot(edges[i], edges[j])))
    return found


def _smallest_solid_angle(d: int, values: Sequence[Doubles]) -> Doubles:
    """Tangent of half the angle between edges a, b, c, by A. van Oosterom and J. Strackee (1983).

    |D| / (|a||b||c| + (a b)|c| + (a c)|b| + (b c)|a|).
    """
    determinant = np.abs(values[0])
    smallest = np.full(determinant.shape, np.inf)
    for vertex in range(d + 1):
        aa, bb, cc, ab, ac, bc = values[1 + 6 * vertex : 7 + 6 * vertex]
        a, b, c = np.sqrt(aa), np.sqrt(bb), np.sqrt(cc)
        below = a * b * c + ab * c + ac * b + bc * a
        smallest = np.minimum(smallest, 2.0 * arctangent2(determinant, below))
    return smallest


RATIO_OF_RADII = Shape(_ratio_polynomials, _ratio_of_radii)
DIHEDRAL_ANGLE = Shape(_dihedral_polynomials, _smallest_dihedral_angle)
SOLID_ANGLE = Shape(_solid_polynomials, _smallest_solid_angle)

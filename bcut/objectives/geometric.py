"""Measures from lengths, volumes and angles. Lengths are in the unit of the points, angles in radians."""

from __future__ import annotations

from fractions import Fraction
from math import comb, factorial

import numpy as np
from numpy.typing import NDArray

from bcut.errors import InputError
from bcut.geometry.boundary import lie_in_boundary
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.determinants import minors
from bcut.geometry.subsets import all_subsets, ranks, without
from bcut.geometry.volumes import volumes
from bcut.objectives.edges import FloatCorners, IntegerCorners, edges_of
from bcut.objectives.registry import Costs, Ratios, Simplices, measure, refuse_argument
from bcut.objectives.shape import DIHEDRAL_ANGLE, RATIO_OF_RADII, SOLID_ANGLE, evaluate, square

# As for shapes: below this part of the product of its edges, the volume of a facet is computed in integers.
_CERTAIN = 2.0**-20


@measure("weight")
def weight(configuration: PointConfiguration, simplices: Simplices, argument: str) -> Costs:
    """Total (d-1)-volume of the facets, each counted once: edge lengths in 2D, areas of triangles in 3D.

    A simplex has half of each of its facets, and all of those in the boundary of the convex hull, so that the sum over
    a triangulation is its weight.
    """
    refuse_argument("weight", argument)
    n, d = configuration.n, configuration.dimension
    total = np.zeros(len(simplices))
    positions = range(d + 1)
    if comb(n, d) <= (d + 1) * len(simplices):
        shares = _shares(configuration, all_subsets(n, d))
        for position in positions:
            total += shares[ranks(without(simplices, position), n)]
        return total
    facets = np.concatenate([without(simplices, position) for position in positions])
    _, first, place = np.unique(ranks(facets, n), return_index=True, return_inverse=True)
    for part in _shares(configuration, facets[first])[place].reshape(d + 1, len(simplices)):
        total += part
    return total


def _shares(configuration: PointConfiguration, facets: NDArray[np.integer]) -> NDArray[np.float64]:
    """Return what one simplex on a facet pays for it: half its volume, or all where there is no second one."""
    is_inner = ~lie_in_boundary(configuration, facets)
    return np.where(is_inner, 0.5, 1.0) * facet_volumes(configuration, facets)


def facet_volumes(configuration: PointConfiguration, facets: NDArray[np.integer]) -> NDArray[np.float64]:
    """Return the (d-1)-volumes of (d-1)-simplices, shape (k, d) to (k,).

    The squared volume is the sum of the squares of all maximal minors of the edges from one vertex, over (d-1)!^2
    (Cauchy and Binet).
    """
    edges, d = edges_of(configuration), configuration.dimension
    with np.errstate(over="ignore", under="ignore"):
        rows = [FloatCorners(edges, facets).difference(0, k) for k in range(1, d)]
        sizes = np.sqrt(square(list(minors(rows).values())))
        reach = np.ones(len(facets))
        for row in rows:
            reach = reach * np.sqrt(square(row))
        unsure = np.flatnonzero(~(sizes > _CERTAIN * reach))
        if len(unsure):
            corners = IntegerCorners(edges, facets[unsure])
            exact = square(list(minors([corners.difference(0, k) for k in range(1, d)]).values()))
            unit = (edges.integer_unit / Fraction(2) ** edges.exponent) ** (2 * (d - 1))
            sizes[unsure] = np.sqrt(np.array([float(value * unit) for value in exact.tolist()]))
        return np.ldexp(sizes / factorial(d - 1), edges.exponent * (d - 1))


@measure("volume")
def volume(configuration: PointConfiguration, simplices: Simplices, argument: str) -> Costs:
    """Volume of the simplices: exact for rational points, else rounded to doubles.

    All triangulations have the same sum; the smallest and the largest simplex differ.
    """
    refuse_argument("volume", argument)
    d, field = configuration.dimension, configuration.field
    values, denominator = volumes(configuration, simplices), factorial(d) * configuration.denominator**d
    if field.degree == 1:
        return Ratios(values[:, 0], denominator)
    return np.array([field.nearest_float(row, denominator) for row in values.tolist()], dtype=float)


@measure("aspect-ratio")
def aspect_ratio(configuration: PointConfiguration, simplices: Simplices, argument: str) -> Costs:
    """Circumradius over inradius: d for a regular simplex, large for a flat one."""
    refuse_argument("aspect-ratio", argument)
    return evaluate(RATIO_OF_RADII, configuration, simplices)


@measure("min-angle")
def min_angle(configuration: PointConfiguration, simplices: Simplices, argument: str) -> Costs:
    """Smallest angle of a triangle, in radians (2D)."""
    refuse_argument("min-angle", argument)
    if configuration.dimension != 2:
        raise InputError(
            f"objective 'min-angle' is for triangles, and {configuration.name} has dimension "
            f"{configuration.dimension}; take dihedral-angle"
            + (" or solid-angle" if configuration.dimension == 3 else "")
        )
    return evaluate(DIHEDRAL_ANGLE, configuration, simplices)


@measure("dihedral-angle")
def dihedral_angle(configuration: PointConfiguration, simplices: Simplices, argument: str) -> Costs:
    """Smallest angle between two facets of a simplex, in radians: along the edges of a tetrahedron in 3D.

    In any dimension it is measured inside the simplex at the (d-2)-face that the two facets share; in 2D that is a
    vertex, and the measure is the smallest angle.
    """
    refuse_argument("dihedral-angle", argument)
    return evaluate(DIHEDRAL_ANGLE, configuration, simplices)


@measure("solid-angle")
def solid_angle(configuration: PointConfiguration, simplices: Simplices, argument: str) -> Costs:
    """Smallest solid angle of a tetrahedron at its vertices, in steradians (3D)."""
    refuse_argument("solid-angle", argument)
    if configuration.dimension != 3:
        raise InputError(
            f"objective 'solid-angle' is for tetrahedra, and {configuration.name} has dimension "
            f"{configuration.dimension}; take {'min-angle' if configuration.dimension == 2 else 'dihedral-angle'}"
        )
    return evaluate(SOLID_ANGLE, configuration, simplices)

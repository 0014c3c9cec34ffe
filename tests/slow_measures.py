"""Measures of simplices by slow formulas, in floating point, and of one simplex by the program."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any

import numpy as np

from bcut.geometry.configuration import PointConfiguration
from bcut.objectives.measures import exact, measured


def volume_by_cayley_and_menger(points: Any) -> float:
    """Volume of a simplex of any dimension from its edge lengths."""
    k = len(points) - 1
    matrix = np.ones((k + 2, k + 2))
    matrix[0, 0] = 0
    for i, a in enumerate(points):
        for j, b in enumerate(points):
            matrix[i + 1, j + 1] = math.dist(a, b) ** 2
    square = (-1) ** (k + 1) * np.linalg.det(matrix) / (2**k * math.factorial(k) ** 2)
    return math.sqrt(max(square, 0.0))


def facets_of(points: Any) -> list[Any]:
    return [[p for j, p in enumerate(points) if j != i] for i in range(len(points))]


def ratio_of_radii(points: Any) -> float:
    base, others = np.array(points[0]), np.array(points[1:])
    edges = others - base
    centre = np.linalg.solve(2 * edges, (edges**2).sum(axis=1))
    surface = sum(volume_by_cayley_and_menger(facet) for facet in facets_of(points))
    volume = abs(np.linalg.det(edges)) / math.factorial(len(edges))
    return float(np.linalg.norm(centre) / (len(edges) * volume / surface))


def dihedral_angles(points: Any) -> list[float]:
    """Angles between facets, by projecting the two other vertices along the ridge."""
    points = np.array(points)
    found = []
    for i, j in combinations(range(len(points)), 2):
        ridge = [k for k in range(len(points)) if k not in (i, j)]
        base = points[ridge[0]]
        span = np.linalg.qr((points[ridge[1:]] - base).T)[0] if len(ridge) > 1 else np.zeros((len(base), 0))
        first, second = (v - span @ (span.T @ v) for v in (points[i] - base, points[j] - base))
        cosine = first @ second / np.linalg.norm(first) / np.linalg.norm(second)
        found.append(math.acos(max(-1.0, min(1.0, cosine))))
    return found


def solid_angles(points: Any) -> list[float]:
    """Girard: the three dihedral angles at a vertex exceed pi by the solid angle."""
    angles = dict(zip(combinations(range(4), 2), dihedral_angles(points), strict=True))
    found = []
    for vertex in range(4):
        # The facets at a vertex are those opposite to the others.
        others = [k for k in range(4) if k != vertex]
        found.append(sum(angles[i, j] for i, j in combinations(others, 2)) - math.pi)
    return found


SLOW = {
    "aspect-ratio": ratio_of_radii,
    "dihedral-angle": lambda points: min(dihedral_angles(points)),
    "solid-angle": lambda points: min(solid_angles(points)),
    "min-angle": lambda points: min(dihedral_angles(points)),
}


def weight_of(configuration: PointConfiguration, simplices: Any) -> float:
    """Sum over the set of all facets, each once."""
    facets = {facet for simplex in simplices for facet in combinations(simplex, configuration.dimension)}
    return math.fsum(
        volume_by_cayley_and_menger(configuration.floats[list(facet)].tolist()) for facet in facets
    )


def one(values: Any, measure: str) -> Any:
    """The measure of the simplex on d + 1 points, exact where it is."""
    configuration = PointConfiguration.from_values(values)
    simplex = np.arange(configuration.n)[None, :]
    return exact(measured(measure, configuration, simplex))[0]

"""Slow and plain exact geometry to compare with: no signs tables, no bit sets, no floating point."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np

from bcut.errors import ConfigurationError
from bcut.geometry.configuration import PointConfiguration

Point = Sequence[Any]


def determinant(rows: Sequence[Point]) -> Any:
    """Determinant of exact numbers by elimination."""
    matrix = [list(row) for row in rows]
    result: Any = Fraction(1)
    for column in range(len(matrix)):
        pivot = next((r for r in range(column, len(matrix)) if matrix[r][column]), None)
        if pivot is None:
            return Fraction(0)
        if pivot != column:
            matrix[column], matrix[pivot] = matrix[pivot], matrix[column]
            result = -result
        result = result * matrix[column][column]
        for row in matrix[column + 1 :]:
            factor = row[column] / matrix[column][column]
            for j in range(column, len(matrix)):
                row[j] = row[j] - factor * matrix[column][j]
    return result


def sign(value: Any) -> int:
    return int(value > 0) - int(value < 0)


def signed_volume(points: Sequence[Point], vertices: Sequence[int]) -> Any:
    """The determinant of the differences to the first vertex: d! times the signed volume."""
    base = points[vertices[0]]
    return determinant([[a - b for a, b in zip(points[v], base, strict=True)] for v in vertices[1:]])


def orientation(points: Sequence[Point], vertices: Sequence[int]) -> int:
    return sign(signed_volume(points, vertices))


def barycentric(points: Sequence[Point], simplex: Sequence[int], point: Point) -> list[Any]:
    """Barycentric coordinates of a point with respect to a simplex."""
    extended = [*points, point]
    new = len(points)
    whole = signed_volume(points, simplex)
    return [
        signed_volume(extended, [new if v == vertex else v for v in simplex]) / whole for vertex in simplex
    ]


def full_simplices(points: Sequence[Point]) -> list[tuple[int, ...]]:
    """All affinely independent (d+1)-subsets, in colexicographic order."""
    subsets = combinations(range(len(points)), len(points[0]) + 1)
    return sorted((s for s in subsets if orientation(points, s)), key=lambda s: s[::-1])


def is_empty(points: Sequence[Point], simplex: Sequence[int]) -> bool:
    """Whether the closed simplex contains no other of the points."""
    others = [p for i, p in enumerate(points) if i not in simplex]
    return not any(min(barycentric(points, simplex, p)) >= 0 for p in others)


def on_hull(points: Sequence[Point], facet: Sequence[int]) -> bool:
    """Whether no two points lie strictly on different sides of the hyperplane of a (d-1)-simplex."""
    return len({orientation(points, (*facet, i)) for i in range(len(points))} - {0}) == 1


def assert_triangulation(
    points: Sequence[Point], simplices: Iterable[Sequence[int]], *, spanning: bool = False
) -> None:
    """Check that simplices are a triangulation.

    They are exactly when every facet of one of them either lies on the hull and belongs to no other, or
    belongs to one simplex on each side, and some point on none of their boundaries is covered once.
    """
    chosen = [tuple(simplex) for simplex in simplices]
    assert len(set(chosen)) == len(chosen)
    sides: dict[tuple[int, ...], list[int]] = {}
    for simplex in chosen:
        assert orientation(points, simplex)
        for vertex in simplex:
            facet = tuple(v for v in simplex if v != vertex)
            sides.setdefault(facet, []).append(orientation(points, (*facet, vertex)))
    for facet, found in sides.items():
        expected = [[1], [-1]] if on_hull(points, facet) else [[-1, 1]]
        assert sorted(found) in expected, f"facet {facet}"
    if spanning:
        assert {v for simplex in chosen for v in simplex} == set(range(len(points)))
    assert cover_of_generic_point(points, chosen) == 1


def cover_of_generic_point(points: Sequence[Point], simplices: Sequence[Sequence[int]]) -> int:
    """How many simplices contain a point of the convex hull that lies on no boundary of them."""
    rng = np.random.default_rng(0)
    while True:
        weights = [Fraction(int(w), 1) for w in rng.integers(1, 10**6, size=len(points))]
        total = sum(weights)
        point = [
            sum((w * p[j] for w, p in zip(weights, points, strict=True)), Fraction(0)) / total
            for j in range(len(points[0]))
        ]
        least = [min(barycentric(points, simplex, point)) for simplex in simplices]
        if all(value != 0 for value in least):
            return sum(value > 0 for value in least)


def configuration_or_none(values: Any, name: str = "test") -> PointConfiguration | None:
    """A configuration, or None where the points are none (duplicates, or in a hyperplane)."""
    try:
        return PointConfiguration.from_values(values, name=name)
    except ConfigurationError:
        return None

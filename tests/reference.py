"""Slow and plain exact geometry to compare with: no signs tables, no bit sets, no floating point."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from itertools import combinations
from math import lcm, prod
from typing import Any

import numpy as np

from bcut.errors import ConfigurationError
from bcut.geometry.configuration import PointConfiguration

Point = Sequence[Any]


def determinant(rows: Sequence[Point]) -> Any:
    """Determinant of exact numbers: of rational ones by integers alone, of others by expansion."""
    if not all(isinstance(value, int | Fraction) for row in rows for value in row):
        return _expansion(rows)
    multiples = [lcm(*(value.denominator for value in row)) for row in rows]
    integers = [
        [value.numerator * (multiple // value.denominator) for value in row]
        for row, multiple in zip(rows, multiples, strict=True)
    ]
    return Fraction(_integer_determinant(integers), prod(multiples))


def _expansion(rows: Sequence[Point]) -> Any:
    if len(rows) == 1:
        return rows[0][0]
    return sum(
        (-1) ** j * value * _expansion([[*row[:j], *row[j + 1 :]] for row in rows[1:]])
        for j, value in enumerate(rows[0])
        if value
    )


def _integer_determinant(matrix: list[list[int]]) -> int:
    """Determinant by Bareiss' elimination, whose divisions leave no remainder; the matrix is overwritten."""
    size, result, previous = len(matrix), 1, 1
    for k in range(size):
        pivot = next((i for i in range(k, size) if matrix[i][k]), None)
        if pivot is None:
            return 0
        if pivot != k:
            matrix[k], matrix[pivot] = matrix[pivot], matrix[k]
            result = -result
        first, leading = matrix[k], matrix[k][k]
        for row in matrix[k + 1 :]:
            factor = row[k]
            for j in range(k + 1, size):
                row[j] = (leading * row[j] - factor * first[j]) // previous
        previous = leading
    return result * previous


def sign(value: Any) -> int:
    return int(value > 0) - int(value < 0)


def integral(points: Sequence[Point]) -> Sequence[Point]:
    """A multiple of the points with integer coordinates where they are rational: their signs are the same."""
    if not all(isinstance(value, int | Fraction) for point in points for value in point):
        return points
    multiple = lcm(*(value.denominator for point in points for value in point))
    return [[value.numerator * (multiple // value.denominator) for value in point] for point in points]


def signed_volume(points: Sequence[Point], vertices: Sequence[int]) -> Any:
    """The determinant of the differences to the first vertex: d! times the signed volume."""
    return determinant(_edges(points, vertices))


def _edges(points: Sequence[Point], vertices: Sequence[int]) -> list[list[Any]]:
    base = points[vertices[0]]
    return [[a - b for a, b in zip(points[v], base, strict=True)] for v in vertices[1:]]


def orientation(points: Sequence[Point], vertices: Sequence[int]) -> int:
    edges = _edges(points, vertices)
    if all(type(value) is int for edge in edges for value in edge):
        return sign(_integer_determinant(edges))
    return sign(determinant(edges))


def barycentric(points: Sequence[Point], simplex: Sequence[int], point: Point) -> list[Any]:
    """Barycentric coordinates of a point with respect to a simplex."""
    extended = [*points, point]
    new = len(points)
    whole = signed_volume(points, simplex)
    return [
        signed_volume(extended, [new if v == vertex else v for v in simplex]) / whole for vertex in simplex
    ]


def barycentric_signs(points: Sequence[Point], simplex: Sequence[int], point: Point) -> list[int]:
    """The signs of the barycentric coordinates of a point with respect to a simplex."""
    extended = [*points, point]
    new = len(points)
    whole = orientation(points, simplex)
    return [whole * orientation(extended, [new if v == vertex else v for v in simplex]) for vertex in simplex]


def full_simplices(points: Sequence[Point]) -> list[tuple[int, ...]]:
    """All affinely independent (d+1)-subsets, in colexicographic order."""
    points = integral(points)
    subsets = combinations(range(len(points)), len(points[0]) + 1)
    return sorted((s for s in subsets if orientation(points, s)), key=lambda s: s[::-1])


def is_empty(points: Sequence[Point], simplex: Sequence[int]) -> bool:
    """Whether the closed simplex contains no other of the points."""
    points = integral(points)
    others = [p for i, p in enumerate(points) if i not in simplex]
    return not any(min(barycentric_signs(points, simplex, p)) >= 0 for p in others)


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
    points = integral(points)
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
        weights = rng.integers(1, 10**6, size=len(points)).tolist()
        # Everything is scaled by the sum of the weights, so that integers remain integers.
        total = sum(weights)
        scaled = [[total * value for value in point] for point in points]
        point = [sum(w * p[j] for w, p in zip(weights, points, strict=True)) for j in range(len(points[0]))]
        least = [min(barycentric_signs(scaled, simplex, point)) for simplex in simplices]
        if all(value != 0 for value in least):
            return sum(value > 0 for value in least)


def configuration_or_none(values: Any, name: str = "test") -> PointConfiguration | None:
    """A configuration, or None where the points are none (duplicates, or in a hyperplane)."""
    try:
        return PointConfiguration.from_values(values, name=name)
    except ConfigurationError:
        return None

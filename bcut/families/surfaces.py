"""Families of closed surfaces that bound non-convex regions, some of which have no triangulation.

All coordinates are integers, so that files hold them exactly.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from bcut.families.parameters import Parameters

Surface = tuple[list[list[int]], list[list[int]]]

_RADIUS = 1000


def schoenhardt(parameters: Parameters) -> Surface:
    """Triangular prism, twisted by 30 degrees, with concave sides: Schönhardt's polyhedron."""
    parameters.finish(6, 3)
    return _twisted(3, 30, None)


def twisted_prism(parameters: Parameters) -> Surface:
    """Prism over an m-gon whose top is turned, with concave sides; perhaps with its vertices moved at random."""
    m = parameters.integer("M", 3, 12)
    twist = parameters.option("twist", 90 // m)
    seed = parameters.option("seed", 0)
    parameters.finish(2 * m, 3)
    if not 0 < twist < 180 // m:
        parameters.fail(f"twist must be at least 1 and below {180 // m}, the degrees at which sides meet")
    return _twisted(m, twist, seed or None)


def _twisted(m: int, twist: int, seed: int | None) -> Surface:
    """Return bottom and top, then sides whose diagonals are the ones that the turn stretches, so that they cave in."""
    shift = np.zeros((2, m), dtype=np.int64)
    if seed is not None:
        # Vertices move along the circle, so that bottom and top stay convex and plane.
        shift = np.random.default_rng(seed).integers(-100, 101, size=(2, m)) * (6 if m < 6 else 3)
    points = []
    for level in (0, 1):
        for k in range(m):
            degrees = 360 * k / m + twist * level + float(shift[level, k]) / 100 * 2 / m
            angle = math.radians(degrees)
            points.append(
                [
                    round(_RADIUS * math.cos(angle)),
                    round(_RADIUS * math.sin(angle)),
                    _RADIUS * level,
                ]
            )
    faces = [[0, k + 1, k] for k in range(1, m - 1)] + [[m, m + k, m + k + 1] for k in range(1, m - 1)]
    for k in range(m):
        after = (k + 1) % m
        faces += [[k, after, m + after], [k, m + after, m + k]]
    return points, faces


def chazelle(parameters: Parameters) -> Surface:
    """Box with k notches from below and k across from above, which come close along a saddle.

    The inner edges of the notches from below lie on z = x y, those from above on z = x y + 1, as in Chazelle's
    polyhedra, so that many convex pieces are needed to cover what is between them.
    """
    k = parameters.integer("K", 1, 3)
    parameters.finish(8 * k + 4, 3)
    size = 2 * k
    low, high = -4 * size * size, 4 * size * size
    points: list[list[int]] = []
    # Lines along y on the lower side, at x = -k ... k; every other one is the edge of a notch.
    lower, upper = [], []
    for number in range(2 * k + 1):
        x = 2 * (number - k)
        notch = bool(number & 1)
        lower.append((len(points), len(points) + 1))
        points += [[x, y, x * y if notch else low] for y in (-size, size)]
    for number in range(2 * k + 1):
        y = 2 * (number - k)
        notch = bool(number & 1)
        upper.append((len(points), len(points) + 1))
        points += [[x, y, x * y + 1 if notch else high] for x in (-size, size)]
    faces: list[list[int]] = []
    for (a, b), (c, d) in pairwise(lower):
        faces += [[a, b, c], [b, d, c]]
    for (a, b), (c, d) in pairwise(upper):
        faces += [[a, b, d], [a, d, c]]
    # The four sides: two have the zigzag of the lower side at their bottom, two that of the upper side at their top.
    (sw, nw), (se, ne) = lower[0], lower[-1]
    (s_low, s_high), (n_low, n_high) = upper[0], upper[-1]
    south = [line[0] for line in lower]
    north = [line[1] for line in lower]
    west = [line[0] for line in upper]
    east = [line[1] for line in upper]
    faces += _polygon([*south, s_high, s_low], points, 0)
    faces += _polygon([*north[::-1], n_low, n_high], points, 0)
    faces += _polygon([nw, sw, *west], points, 1)
    faces += _polygon([se, ne, *east[::-1]], points, 1)
    return points, faces


def _polygon(vertices: list[int], points: list[list[int]], axis: int) -> list[list[int]]:
    """Cut off ears of a simple polygon in a plane on which ``points[:, axis]`` and z are coordinates."""
    flat = {vertex: (points[vertex][axis], points[vertex][2]) for vertex in vertices}

    def turn(a: int, b: int, c: int) -> int:
        (ax, ay), (bx, by), (cx, cy) = flat[a], flat[b], flat[c]
        return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)

    area = sum(
        flat[a][0] * flat[b][1] - flat[b][0] * flat[a][1]
        for a, b in zip(vertices, [*vertices[1:], vertices[0]], strict=True)
    )
    way = 1 if area > 0 else -1
    rest, faces = list(vertices), []
    while len(rest) > 3:
        for position, b in enumerate(rest):
            a, c = rest[position - 1], rest[(position + 1) % len(rest)]
            others = (p for p in rest if p not in (a, b, c))
            inside = any(
                min(way * turn(a, b, p), way * turn(b, c, p), way * turn(c, a, p)) >= 0 for p in others
            )
            if way * turn(a, b, c) > 0 and not inside:
                faces.append([a, b, c])
                del rest[position]
                break
        else:
            raise AssertionError("a simple polygon has an ear")
    return [*faces, rest]


#: Name -> points and triangles, counterclockwise as seen from outside.
SURFACES: dict[str, Callable[[Parameters], Surface]] = {
    "schoenhardt": schoenhardt,
    "twisted-prism": twisted_prism,
    "chazelle": chazelle,
}


def points_of(name: str) -> Callable[[Parameters], list[list[int]]]:
    """Return the function that builds the points of a family of surfaces alone."""
    return lambda parameters: SURFACES[name](parameters)[0]

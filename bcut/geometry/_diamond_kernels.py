"""Compiled loops of the diamond test (`bcut.geometry.elimination`).

Points are doubles of shape (n, 2) with one error `delta` for all coordinates, as `bcut.geometry.plane.PlanePoints` has
them. Nothing here imports another kernel: numba's cache on disk watches the file of a kernel only.
"""

from __future__ import annotations

from math import ceil, floor, pi, sqrt
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from bcut.geometry._compiled import compiled

Array = NDArray[Any]

# Sixteen and more roundings in all, relative to the sizes of products.
_ROUNDINGS = 2.0**-48
# Absorbs products that underflow.
_TINY = 1e-290
# Directions around a point, in steps, and how much of a step's neighbourhood blockers have to cover as well.
DIRECTIONS = 256
_STEP = 2 * pi / DIRECTIONS
_MARGIN = 1e-6
# Nearer points than so many errors have no reliable direction.
_RELIABLE = 1e8


@numba.njit
def _half_of_diamond(points: Array, p: int, q: int, r: int, tangent: float, delta: float) -> int:
    """Return 1 or -1 where r is proven to be inside the triangle to the left or right of the base p q, else 0."""
    ux, uy = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1]
    vx, vy = points[r, 0] - points[p, 0], points[r, 1] - points[p, 1]
    height, along, whole = ux * vy - uy * vx, ux * vx + uy * vy, ux * ux + uy * uy
    sizes = 2 * (abs(ux) + abs(uy)) + abs(vx) + abs(vy)
    products = (abs(ux) + abs(uy)) * (abs(vx) + abs(vy)) + whole
    # Generous also for small integers: only proven insides count, and a boundary is no inside.
    unsure = max(delta, 0.0)
    error = 2 * _ROUNDINGS * products + unsure * (16 * sizes + 64 * unsure) + _TINY
    if along <= error or whole - along <= error:
        return 0
    side = 1 if height > 0 else -1
    height = abs(height)
    if height <= error or height + error >= tangent * (along - error):
        return 0
    return side if height + error < tangent * (whole - along - error) else 0


@numba.njit
def _is_excluded(points: Array, p: int, q: int, near: Array, count: int, tangent: float, delta: float) -> int:
    """Return which halves of the diamond over p q contain some of the first points near p: bits 1 (left) and 2."""
    halves = 0
    for k in range(count):
        if near[k] != q and near[k] != p:
            side = _half_of_diamond(points, p, q, near[k], tangent, delta)
            if side != 0:
                halves |= 1 if side > 0 else 2
                if halves == 3:
                    break
    return halves


@numba.njit
def _block(limits: Array, angle: float, reach: float, base: float) -> None:
    """Note that bases which begin here are excluded on one side beyond a length, in some directions.

    A point r at direction `angle` and distance ``reach / (2 cos(base))`` lies in the left half of the diamond over
    every base that is longer than `reach` and has a direction between ``angle - base`` and `angle`; and likewise on
    the right.
    """
    first, last = ceil((angle - base + _MARGIN) / _STEP), floor((angle - _MARGIN) / _STEP)
    for k in range(first, last):
        direction = k % DIRECTIONS
        limits[direction, 0] = min(limits[direction, 0], reach)
    first, last = ceil((angle + _MARGIN) / _STEP), floor((angle + base - _MARGIN) / _STEP)
    for k in range(first, last):
        direction = k % DIRECTIONS
        limits[direction, 1] = min(limits[direction, 1], reach)


@numba.njit
def _direction(angle: float) -> int:
    return floor(angle / _STEP) % DIRECTIONS


@compiled
def near_diamonds(
    points: Array, delta: float, who: Array, neighbours: Array, everyone: bool, base: float, limits: Array,
    finished: Array, codes: Array,
) -> int:  # fmt: skip
    """Find the edges that pass the diamond test, for points whose neighbours settle it.

    Parameters
    ----------
    points, delta
    who : ndarray of int64, shape (k,)
        The points in question.
    neighbours : ndarray of int64, shape (k, c)
        Points near each of them, by distance, themselves included.
    everyone : bool
        Whether the neighbours are all points.
    base : float
        Angle at the base of the two triangles.
    limits : ndarray of float64, shape (k, directions, 2)
        Filled: from which length on edges in a direction are excluded on the left and on the right.
    finished : ndarray of bool, shape (k,)
        Filled: whether no point that is farther away than the neighbours can be joined to this one.
    codes : ndarray of int64, shape (k * c,)
        Filled with ``a * n + b`` for each edge a < b of the finished points.

    Returns
    -------
    int
        The number of codes.
    """
    n, tangent, stretch = len(points), np.tan(base), 2 * np.cos(base) * (1 + _MARGIN)
    count = 0
    for i in range(len(who)):
        p, start = who[i], count
        limits[i] = np.inf
        finished[i] = everyone
        longest = np.inf
        for j in range(neighbours.shape[1]):
            q = neighbours[i, j]
            if q == p:
                continue
            dx, dy = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1]
            distance = sqrt(dx * dx + dy * dy)
            if distance > longest:
                finished[i] = True
                break
            angle = np.arctan2(dy, dx)
            here = limits[i, _direction(angle)]
            passes = here[0] >= distance or here[1] >= distance
            if passes and _is_excluded(points, p, q, neighbours[i], j, tangent, delta) != 3:
                codes[count] = min(p, q) * n + max(p, q)
                count += 1
            if distance > _RELIABLE * delta:
                _block(limits[i], angle, distance * stretch, base)
                if j % 4 == 3:
                    longest = limits[i].max()
        if not finished[i]:
            count = start
    return count


@compiled
def far_diamonds(
    points: Array, delta: float, who: Array, neighbours: Array, base: float, limits: Array, codes: Array
) -> int:
    """Find the edges between points that `near_diamonds` did not finish.

    Parameters
    ----------
    points, delta, who, neighbours, base, limits
        As `near_diamonds` left them.
    codes : ndarray of int64
        Filled as far as there is room.

    Returns
    -------
    int
        The number of codes that there are.
    """
    n, tangent, count = len(points), np.tan(base), 0
    known = neighbours.shape[1]
    for i in range(len(who)):
        for j in range(i + 1, len(who)):
            p, q = who[i], who[j]
            dx, dy = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1]
            distance = sqrt(dx * dx + dy * dy)
            halves = 0
            if distance > _RELIABLE * delta:
                angle = np.arctan2(dy, dx)
                there, back = limits[i, _direction(angle)], limits[j, _direction(angle + pi)]
                # Left and right change places when one looks back.
                if there[0] < distance or back[1] < distance:
                    halves |= 1
                if there[1] < distance or back[0] < distance:
                    halves |= 2
            if halves != 3:
                halves |= _is_excluded(points, p, q, neighbours[i], known, tangent, delta)
            if halves != 3:
                turned = _is_excluded(points, q, p, neighbours[j], known, tangent, delta)
                halves |= (turned & 1) << 1 | turned >> 1
            if halves != 3:
                if count < len(codes):
                    codes[count] = min(p, q) * n + max(p, q)
                count += 1
    return count

"""The compiled loop of the dynamic program for simply connected faces (`bcut.geometry.elimination`)."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from bcut.geometry._compiled import compiled

Array = NDArray[Any]


@compiled
def best_tilings(
    roots: Array, costs: Array, edge_sides: Array, starts: Array, members: Array, is_wall: Array, values: Array,
    chosen: Array,
) -> int:  # fmt: skip
    """Tile simply connected faces by triangles of least cost.

    Parameters
    ----------
    roots : ndarray of int64, shape (f,)
        A side of an edge on the boundary of each face.
    costs : ndarray of float64, shape (t,)
    edge_sides, starts, members
        As for `bcut.geometry._elimination_kernels.keep_locally_minimal`, of the triangles that may be used.
    is_wall : ndarray of bool, shape (m,)
        Which edges are in the boundary of faces.
    values : ndarray of float64, shape (f,)
        Filled with the costs of the tilings; infinite where there is none.
    chosen : ndarray of int64, shape (t,)
        Filled with the triangles.

    Returns
    -------
    int
        The number of triangles, or -1 where a face is not simply connected.
    """
    sides = len(starts) - 1
    best, value = np.full(sides, -1, np.int64), np.full(sides, np.nan)
    cursor, opened = starts[:-1].copy(), np.zeros(sides, np.bool_)
    stack, count = np.empty(sides + 3, np.int64), 0
    for f in range(len(roots)):
        size, stack[0] = 1, roots[f]
        while size > 0:
            side = stack[size - 1]
            if not np.isnan(value[side]):
                size -= 1
                continue
            opened[side] = True
            waiting = False
            while cursor[side] < starts[side + 1] and not waiting:
                t = members[cursor[side]] // 3
                for position in range(3):
                    beyond = edge_sides[t, position] ^ 1
                    if beyond == side ^ 1 or is_wall[beyond // 2] or not np.isnan(value[beyond]):
                        continue
                    if opened[beyond]:
                        return -1
                    waiting = True
                    stack[size] = beyond
                    size += 1
                    break
                if not waiting:
                    cursor[side] += 1
            if not waiting:
                value[side], best[side] = _best_triangle(
                    side, costs, edge_sides, starts, members, is_wall, value
                )
                opened[side] = False
        values[f] = value[roots[f]]
        if values[f] == np.inf:
            continue
        size, stack[0] = 1, roots[f]
        while size > 0:
            size -= 1
            side = stack[size]
            chosen[count] = best[side]
            for position in range(3):
                beyond = edge_sides[chosen[count], position] ^ 1
                if beyond != side ^ 1 and not is_wall[beyond // 2]:
                    stack[size] = beyond
                    size += 1
            count += 1
    return count


@numba.njit
def _best_triangle(
    side: int, costs: Array, edge_sides: Array, starts: Array, members: Array, is_wall: Array, value: Array
) -> tuple[float, int]:
    """Return the least cost of what lies on a side of an edge, and the triangle next to the edge."""
    least, best = np.inf, -1
    for k in range(starts[side], starts[side + 1]):
        t = members[k] // 3
        total = costs[t]
        for position in range(3):
            beyond = edge_sides[t, position] ^ 1
            if beyond != side ^ 1 and not is_wall[beyond // 2]:
                total += value[beyond]
        if total < least:
            least, best = total, t
    return least, best

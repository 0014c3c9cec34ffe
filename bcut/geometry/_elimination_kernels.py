"""Compiled loops of `bcut.geometry.elimination`, but for the diamond test and the tilings.

They decide what floating point can decide, and list the rest. Points are doubles of shape (n, 2), in units in which
differences do not exceed 2 (or are small integers), with one error `delta` for all coordinates: a coordinate is off
by at most that. Zero says that coordinates are exact, so that a difference is rounded once; a negative `delta` says
that they are integers small enough for every operation here to be exact.

The kernels of this file stand together because numba's cache on disk watches the file of a kernel only.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from bcut.geometry._compiled import compiled

Array = NDArray[Any]

#: Neither side was proven.
UNDECIDED = 2
# Eight roundings: more than the operations below have, relative to the sizes of their products.
_ROUNDINGS = 2.0**-50
# Absorbs products that underflow.
_TINY = 1e-290
# Boxes in a leaf of a tree.
_LEAF = 8


@numba.njit
def _error(left: float, right: float, size: float, delta: float) -> float:
    """Bound the error of a sum of two products of differences: their sizes, and the sum of the differences' sizes."""
    if delta < 0:
        return 0.0
    return _ROUNDINGS * (left + right) + delta * (4 * size + 16 * delta) + _TINY


@numba.njit
def _orientation_at(points: Array, a: int, b: int, x: float, y: float, delta: float) -> int:
    """Return the side of the line from a to b that (x, y) is on: 1 for left, -1, or 0 or `UNDECIDED`."""
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    vx, vy = x - points[a, 0], y - points[a, 1]
    left, right = ux * vy, uy * vx
    error = _error(abs(left), abs(right), abs(ux) + abs(uy) + abs(vx) + abs(vy), delta)
    if left - right > error:
        return 1
    if left - right < -error:
        return -1
    return 0 if delta < 0 else UNDECIDED


@numba.njit
def _orientation(points: Array, a: int, b: int, c: int, delta: float) -> int:
    return _orientation_at(points, a, b, points[c, 0], points[c, 1], delta)


@numba.njit
def _is_longer(points: Array, a: int, b: int, c: int, d: int, delta: float) -> bool:
    """Tell whether the segment from a to b is proven to be longer than that from c to d."""
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    vx, vy = points[d, 0] - points[c, 0], points[d, 1] - points[c, 1]
    # Each square is a product of a difference with itself: the difference's size counts twice.
    first, second = ux * ux + uy * uy, vx * vx + vy * vy
    error = _error(first, second, 2 * (abs(ux) + abs(uy) + abs(vx) + abs(vy)), delta)
    return first - second > 2 * error


@compiled
def box_tree(lows: Array, highs: Array, order: Array, boxes: Array, ranges: Array) -> int:
    """Build a tree of boxes by halving along the longer side.

    Parameters
    ----------
    lows, highs : ndarray of float64, shape (m, 2)
        Corners of the boxes to be found.
    order : ndarray of int64, shape (m,)
        Filled with a permutation of them.
    boxes : ndarray of float64, shape (2 m + 1, 4)
        Filled: what a node contains, lower corner before upper one.
    ranges : ndarray of int64, shape (2 m + 1, 3)
        Filled: first and last place in `order`, and the first of two children, 0 for leaves.

    Returns
    -------
    int
        The number of nodes.
    """
    m = len(lows)
    for k in range(m):
        order[k] = k
    middles = lows + highs
    ranges[0, 0], ranges[0, 1], nodes, node = 0, m, 1, 0
    while node < nodes:
        first, last = ranges[node, 0], ranges[node, 1]
        box, low, high = boxes[node], np.full(2, np.inf), np.full(2, -np.inf)
        box[:2], box[2:] = np.inf, -np.inf
        for k in order[first:last]:
            for axis in range(2):
                box[axis] = min(box[axis], lows[k, axis])
                box[2 + axis] = max(box[2 + axis], highs[k, axis])
                low[axis] = min(low[axis], middles[k, axis])
                high[axis] = max(high[axis], middles[k, axis])
        ranges[node, 2] = 0
        if last - first > _LEAF:
            axis = 0 if high[0] - low[0] > high[1] - low[1] else 1
            part = order[first:last].copy()
            order[first:last] = part[np.argsort(middles[part, axis])]
            half = (first + last) // 2
            ranges[node, 2] = nodes
            ranges[nodes, 0], ranges[nodes, 1] = first, half
            ranges[nodes + 1, 0], ranges[nodes + 1, 1] = half, last
            nodes += 2
        node += 1
    return nodes


@numba.njit
def _is_right_of(points: Array, a: int, b: int, box: Array, delta: float) -> bool:
    """Tell whether a box is proven to be strictly to the right of the line from a to b."""
    x = box[0] if points[b, 1] > points[a, 1] else box[2]
    y = box[3] if points[b, 0] > points[a, 0] else box[1]
    return _orientation_at(points, a, b, x, y, delta) == -1


# --------------------------------------------------------------------------------------------- empty triangles


@compiled
def closed_triples(starts: Array, heads: Array, triples: Array, edges: Array) -> int:
    """List the triples of points that are pairwise joined.

    Parameters
    ----------
    starts, heads : ndarray of int64, shape (n + 1,) and (m,)
        The higher neighbours of each point, ascending.
    triples : ndarray of int64, shape (t, 3)
        Filled as far as there is room, ascending.
    edges : ndarray of int64, shape (t, 3)
        Filled with the places in `heads` of the edges opposite to each vertex.

    Returns
    -------
    int
        The number of triples that there are.
    """
    n, count = len(starts) - 1, 0
    place = np.full(n, -1, np.int64)
    for a in range(n):
        for k in range(starts[a], starts[a + 1]):
            place[heads[k]] = k
        for k in range(starts[a], starts[a + 1]):
            b = heads[k]
            for j in range(starts[b], starts[b + 1]):
                c = heads[j]
                if place[c] >= 0:
                    if count < len(triples):
                        triples[count, 0], triples[count, 1], triples[count, 2] = a, b, c
                        edges[count, 0], edges[count, 1], edges[count, 2] = j, place[c], k
                    count += 1
        for k in range(starts[a], starts[a + 1]):
            place[heads[k]] = -1
    return count


@compiled
def find_points_inside(
    points: Array, delta: float, triples: Array, signs: Array, order: Array, boxes: Array, ranges: Array,
    occupied: Array, doubts: Array,
) -> int:  # fmt: skip
    """Tell which closed triangles contain further points.

    Parameters
    ----------
    points, delta
    triples : ndarray of int64, shape (t, 3)
    signs : ndarray of int8, shape (t,)
        Their orientations, 1 or -1.
    order, boxes, ranges
        The tree of the points.
    occupied : ndarray of bool, shape (t,)
        Filled: whether a further point is proven to be in the triangle.
    doubts : ndarray of int64, shape (k, 2)
        Filled as far as there is room: triangles not known to be occupied, with a point that may be in them.

    Returns
    -------
    int
        The number of doubts that there are.
    """
    stack, count = np.empty(256, np.int64), 0
    slack = 4 * max(delta, 0.0)
    for t in range(len(triples)):
        a = triples[t, 0]
        b, c = (triples[t, 1], triples[t, 2]) if signs[t] > 0 else (triples[t, 2], triples[t, 1])
        left = min(points[a, 0], points[b, 0], points[c, 0]) - slack
        right = max(points[a, 0], points[b, 0], points[c, 0]) + slack
        bottom = min(points[a, 1], points[b, 1], points[c, 1]) - slack
        top = max(points[a, 1], points[b, 1], points[c, 1]) + slack
        before, size, stack[0] = count, 1, 0
        occupied[t] = False
        while size > 0 and not occupied[t]:
            size -= 1
            node = stack[size]
            box = boxes[node]
            if box[0] > right or box[2] < left or box[1] > top or box[3] < bottom:
                continue
            if (
                _is_right_of(points, a, b, box, delta)
                or _is_right_of(points, b, c, box, delta)
                or _is_right_of(points, c, a, box, delta)
            ):
                continue
            if ranges[node, 2] > 0:
                stack[size], stack[size + 1] = ranges[node, 2], ranges[node, 2] + 1
                size += 2
                continue
            for p in order[ranges[node, 0] : ranges[node, 1]]:
                if p in (a, b, c):
                    continue
                first = _orientation(points, a, b, p, delta)
                second = _orientation(points, b, c, p, delta)
                third = _orientation(points, c, a, p, delta)
                if first == -1 or second == -1 or third == -1:
                    continue
                if first != UNDECIDED and second != UNDECIDED and third != UNDECIDED:
                    occupied[t] = True
                    break
                if count < len(doubts):
                    doubts[count, 0], doubts[count, 1] = t, p
                count += 1
        if occupied[t]:
            count = before
    return count


# --------------------------------------------------------------------------------- locally minimal triangulations


@compiled
def keep_locally_minimal(
    points: Array, delta: float, edges: Array, on_hull: Array, triangles: Array, edge_sides: Array, starts: Array,
    members: Array, edge_lives: Array, triangle_lives: Array,
) -> None:  # fmt: skip
    """Strike out edges that no pair of triangles left makes locally minimal, again and again.

    Parameters
    ----------
    points, delta
    edges : ndarray of int64, shape (m, 2)
        Ascending.
    on_hull : ndarray of bool, shape (m,)
    triangles : ndarray of int64, shape (t, 3)
    edge_sides : ndarray of int64, shape (t, 3)
        Twice the number of the edge opposite to each vertex, plus 1 where the triangle lies to its right.
    starts, members : ndarray of int64, shape (2 m + 1,) and (3 t,)
        For each side of an edge, the triangles there: three times the number, plus the position of the opposite vertex.
    edge_lives, triangle_lives : ndarray of bool
        All true; set to false for what is struck out.
    """
    m = len(edges)
    queue, waits = np.arange(m), np.ones(m, np.bool_)
    head, length = 0, m
    while length > 0:
        e = queue[head]
        head, length = (head + 1) % m, length - 1
        waits[e] = False
        if not edge_lives[e] or _has_certificate(
            points, delta, edges[e, 0], edges[e, 1], e, on_hull[e], triangles, starts, members, triangle_lives
        ):
            continue
        edge_lives[e] = False
        for k in range(starts[2 * e], starts[2 * e + 2]):
            t = members[k] // 3
            if not triangle_lives[t]:
                continue
            triangle_lives[t] = False
            for position in range(3):
                other = edge_sides[t, position] // 2
                if edge_lives[other] and not waits[other]:
                    waits[other] = True
                    queue[(head + length) % m] = other
                    length += 1


@numba.njit
def _has_certificate(
    points: Array, delta: float, a: int, b: int, e: int, on_hull: bool, triangles: Array, starts: Array,
    members: Array, triangle_lives: Array,
) -> bool:  # fmt: skip
    """Tell whether some pair of triangles on both sides of an edge may be in a locally minimal triangulation."""
    for i in range(starts[2 * e], starts[2 * e + 1] if not on_hull else starts[2 * e + 2]):
        if not triangle_lives[members[i] // 3]:
            continue
        if on_hull:
            return True
        c = triangles[members[i] // 3, members[i] % 3]
        for j in range(starts[2 * e + 1], starts[2 * e + 2]):
            if not triangle_lives[members[j] // 3]:
                continue
            d = triangles[members[j] // 3, members[j] % 3]
            if not _is_longer(points, a, b, c, d, delta):
                return True
            one, other = _orientation(points, c, d, a, delta), _orientation(points, c, d, b, delta)
            # What is not proven to be strictly convex has no other diagonal.
            if one == UNDECIDED or other == UNDECIDED or one * other >= 0:
                return True
    return False


@numba.njit
def _root(parents: Array, e: int) -> int:
    while parents[e] != e:
        parents[e] = parents[parents[e]]
        e = parents[e]
    return e


@compiled
def find_crossings(
    points: Array, delta: float, edges: Array, order: Array, boxes: Array, ranges: Array, parents: Array,
    crossed: Array, doubts: Array,
) -> int:  # fmt: skip
    """Tell which edges are crossed, and group those that cross, directly or through others.

    Parameters
    ----------
    points, delta
    edges : ndarray of int64, shape (m, 2)
        None has a further point on it.
    order, boxes, ranges
        The tree of the edges' boxes.
    parents : ndarray of int64, shape (m,)
        0 ... m - 1; filled with a forest of the groups.
    crossed : ndarray of bool, shape (m,)
        Filled.
    doubts : ndarray of int64, shape (k, 2)
        Filled as far as there is room: pairs that may cross, and would tell something new.

    Returns
    -------
    int
        The number of doubts that there are.
    """
    stack, count = np.empty(256, np.int64), 0
    slack = 4 * max(delta, 0.0)
    for e in range(len(edges)):
        a, b = edges[e, 0], edges[e, 1]
        left, right = min(points[a, 0], points[b, 0]) - slack, max(points[a, 0], points[b, 0]) + slack
        bottom, top = min(points[a, 1], points[b, 1]) - slack, max(points[a, 1], points[b, 1]) + slack
        size, stack[0], group = 1, 0, _root(parents, e)
        while size > 0:
            size -= 1
            node = stack[size]
            box = boxes[node]
            if box[0] > right or box[2] < left or box[1] > top or box[3] < bottom:
                continue
            if _is_right_of(points, a, b, box, delta) or _is_right_of(points, b, a, box, delta):
                continue
            if ranges[node, 2] > 0:
                stack[size], stack[size + 1] = ranges[node, 2], ranges[node, 2] + 1
                size += 2
                continue
            for other in order[ranges[node, 0] : ranges[node, 1]]:
                # Edges of one group of two or more are crossed.
                theirs = _root(parents, other) if other > e else group
                if theirs == group:
                    continue
                answer = _crossing(points, a, b, edges[other, 0], edges[other, 1], delta)
                if answer == 1:
                    crossed[e] = crossed[other] = True
                    parents[theirs] = group
                elif answer == UNDECIDED:
                    if count < len(doubts):
                        doubts[count, 0], doubts[count, 1] = e, other
                    count += 1
    return count


@numba.njit
def _crossing(points: Array, a: int, b: int, c: int, d: int, delta: float) -> int:
    """Return 1 where two segments cross, 0 where they do not, or `UNDECIDED`."""
    if a in (c, d) or b in (c, d):
        return 0
    one, other = _opposite_sides(points, a, b, c, d, delta), _opposite_sides(points, c, d, a, b, delta)
    return one if one == 0 or other == 1 else other


@numba.njit
def _opposite_sides(points: Array, a: int, b: int, c: int, d: int, delta: float) -> int:
    """Return 1 where c and d are on opposite sides of the line from a to b, 0 where they are not, or `UNDECIDED`."""
    first, second = _orientation(points, a, b, c, delta), _orientation(points, a, b, d, delta)
    if first == UNDECIDED or second == UNDECIDED:
        return UNDECIDED
    return 1 if first * second < 0 else 0

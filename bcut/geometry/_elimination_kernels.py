"""Compiled loops of `bcut.geometry.elimination`: what floating point decides, and lists of what it does not.

Points are doubles of shape (n, 2), in units in which differences do not exceed 2 (or are small integers), with one error
`delta` for all coordinates: a coordinate is off by at most that. Zero says that coordinates are exact, so that a difference is
rounded once; a negative `delta` says that they are integers small enough for every operation here to be exact.

The kernels of this file stand together because numba's cache on disk watches the file of a kernel only.
"""

from __future__ import annotations

from math import floor, pi, sqrt
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
# Directions around a point, in steps, and how much of a step's neighbourhood blockers have to cover as well.
_DIRECTIONS = 256
_STEP = 2 * pi / _DIRECTIONS
_MARGIN = 1e-6
# Nearer points than so many errors have no reliable direction.
_RELIABLE = 1e8
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


# ---------------------------------------------------------------------------------------------- the diamond test


@numba.njit
def _half_of_diamond(points: Array, p: int, q: int, r: int, tangent: float, delta: float) -> int:
    """Return 1 or -1 where r is proven to be inside the triangle to the left or right of the base p q, else 0."""
    ux, uy = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1]
    vx, vy = points[r, 0] - points[p, 0], points[r, 1] - points[p, 1]
    height, along, whole = ux * vy - uy * vx, ux * vx + uy * vy, ux * ux + uy * uy
    sizes = 2 * (abs(ux) + abs(uy)) + abs(vx) + abs(vy)
    products = (abs(ux) + abs(uy)) * (abs(vx) + abs(vy)) + whole
    # Generous also for small integers: only proven insides count, and a boundary is no inside.
    error = 4 * _error(products, products, sizes, max(delta, 0.0))
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

    A point r at direction `angle` and distance ``reach / (2 cos(base))`` lies in the left half of the diamond over every
    base that is longer than `reach` and has a direction between ``angle - base`` and `angle`; and likewise on the right.
    """
    first = int(np.ceil((angle - base + _MARGIN) / _STEP))
    last = int(floor((angle - _MARGIN) / _STEP))
    for k in range(first, last):
        direction = k % _DIRECTIONS
        limits[direction, 0] = min(limits[direction, 0], reach)
    first = int(np.ceil((angle + _MARGIN) / _STEP))
    last = int(floor((angle + base - _MARGIN) / _STEP))
    for k in range(first, last):
        direction = k % _DIRECTIONS
        limits[direction, 1] = min(limits[direction, 1], reach)


@numba.njit
def _direction(angle: float) -> int:
    return int(floor(angle / _STEP)) % _DIRECTIONS


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


# ------------------------------------------------------------------------------------------- a tree of boxes


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
                if p == a or p == b or p == c:
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


@compiled
def find_crossings(
    points: Array, delta: float, edges: Array, order: Array, boxes: Array, ranges: Array, pairs: Array
) -> int:
    """List pairs of edges that are not proven not to cross.

    Parameters
    ----------
    points, delta
    edges : ndarray of int64, shape (m, 2)
        None has a further point on it.
    order, boxes, ranges
        The tree of the edges' boxes.
    pairs : ndarray of int64, shape (k, 2)
        Filled as far as there is room.

    Returns
    -------
    int
        The number of pairs that there are.
    """
    stack, count = np.empty(256, np.int64), 0
    slack = 4 * max(delta, 0.0)
    for e in range(len(edges)):
        a, b = edges[e, 0], edges[e, 1]
        left, right = min(points[a, 0], points[b, 0]) - slack, max(points[a, 0], points[b, 0]) + slack
        bottom, top = min(points[a, 1], points[b, 1]) - slack, max(points[a, 1], points[b, 1]) + slack
        size, stack[0] = 1, 0
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
                if other > e and _may_cross(points, a, b, edges[other, 0], edges[other, 1], delta):
                    if count < len(pairs):
                        pairs[count, 0], pairs[count, 1] = e, other
                    count += 1
    return count


@numba.njit
def _may_cross(points: Array, a: int, b: int, c: int, d: int, delta: float) -> bool:
    if a == c or a == d or b == c or b == d:
        return False
    return not (
        _are_on_one_side(points, a, b, c, d, delta) or _are_on_one_side(points, c, d, a, b, delta)
    )


@numba.njit
def _are_on_one_side(points: Array, a: int, b: int, c: int, d: int, delta: float) -> bool:
    """Tell whether c and d are proven not to be on opposite sides of the line from a to b."""
    first, second = _orientation(points, a, b, c, delta), _orientation(points, a, b, d, delta)
    return first != UNDECIDED and second != UNDECIDED and first * second >= 0


# ---------------------------------------------------------------------------------------------- dynamic programming


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
        As for `keep_locally_minimal`, of the triangles that may be used.
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

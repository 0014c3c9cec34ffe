"""In which order to paint disjoint tetrahedra so that nearer ones hide those behind them."""

from __future__ import annotations

import heapq
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_EDGES = np.array(list(combinations(range(4), 2)))
_FACES = np.array(list(combinations(range(4), 3)))
_TOLERANCE = 1e-9


def back_to_front(corners: Floats, towards: Floats) -> list[int]:
    """Order tetrahedra for painting, seen in parallel projection.

    Parameters
    ----------
    corners : ndarray of float, shape (m, 4, 3)
        Tetrahedra with disjoint interiors.
    towards : ndarray of float, shape (3,)
        From the scene to the viewer.

    Returns
    -------
    list of int
        Every tetrahedron after those that it hides. Where they hide each other in a cycle, which no order
        gets right, the one whose middle is farthest away comes first.
    """
    before: list[list[int]] = [[] for _ in corners]
    waiting = np.zeros(len(corners), dtype=int)
    for first, second in _hidden_pairs(corners, towards):
        before[first].append(second)
        waiting[second] += 1
    depths = (corners.mean(axis=1) @ towards).tolist()
    free = [(depths[number], number) for number in range(len(corners)) if not waiting[number]]
    heapq.heapify(free)
    left = set(range(len(corners)))
    order: list[int] = []
    while left:
        number = heapq.heappop(free)[1] if free else min(left, key=depths.__getitem__)
        if number not in left:
            continue
        left.remove(number)
        order.append(number)
        for other in before[number]:
            waiting[other] -= 1
            if not waiting[other]:
                heapq.heappush(free, (depths[other], other))
    return order


def _hidden_pairs(corners: Floats, towards: Floats) -> list[tuple[int, int]]:
    """Return the pairs (behind, in front) that overlap in projection.

    Two convex polytopes with disjoint interiors are separated by a plane parallel to a face of one or to an
    edge of each (the separating axis theorem), and the viewer's side of that plane tells which of them is in
    front. They do not overlap exactly when some separating plane contains the viewing direction.
    """
    spread = float(np.abs(corners - corners.mean(axis=(0, 1))).max()) or 1.0
    scaled = corners / spread
    edges = scaled[:, _EDGES[:, 1]] - scaled[:, _EDGES[:, 0]]
    faces = np.cross(
        scaled[:, _FACES[:, 1]] - scaled[:, _FACES[:, 0]], scaled[:, _FACES[:, 2]] - scaled[:, _FACES[:, 0]]
    )
    silhouettes = np.cross(edges, towards)
    pairs: list[tuple[int, int]] = []
    for first in range(len(corners) - 1):
        rest = slice(first + 1, None)
        count = len(corners) - first - 1
        own = np.concatenate((faces[first], silhouettes[first]))
        crosses = np.cross(edges[first][None, :, None, :], edges[rest][:, None, :, :]).reshape(count, -1, 3)
        axes = np.concatenate(
            (np.broadcast_to(own, (count, *own.shape)), faces[rest], silhouettes[rest], crosses), axis=1
        )
        norms = np.linalg.norm(axes, axis=2, keepdims=True)
        axes = np.divide(axes, norms, out=np.zeros_like(axes), where=norms > _TOLERANCE)
        here, there = axes @ scaled[first].T, np.einsum("cak,cvk->cav", axes, scaled[rest])
        is_above = here.min(axis=2) >= there.max(axis=2) - _TOLERANCE
        is_below = here.max(axis=2) <= there.min(axis=2) + _TOLERANCE
        is_axis = norms[..., 0] > _TOLERANCE
        tilt = axes @ towards
        tilt[np.abs(tilt) < _TOLERANCE] = 0.0
        # +1 where the first is on the viewer's side of this separating plane, -1 where it is behind.
        sides = np.sign(tilt) * (is_above.astype(int) - is_below.astype(int))
        separated = (is_above ^ is_below) & is_axis
        clear = (separated & (tilt == 0)).any(axis=1)
        in_front = (separated & (sides > 0)).any(axis=1) & ~clear
        behind = (separated & (sides < 0)).any(axis=1) & ~clear
        pairs += [(first + 1 + int(other), first) for other in np.flatnonzero(in_front & ~behind)]
        pairs += [(first, first + 1 + int(other)) for other in np.flatnonzero(behind & ~in_front)]
    return pairs

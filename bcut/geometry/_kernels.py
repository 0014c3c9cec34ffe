"""Compiled loops over ridges and facets: comparisons of small integers, no coordinates.

Import this module only where an instance is large enough to repay numba's start. What a kernel calls stands in
its own file, because numba compiles again only when the kernel's own file has changed. Points have the numbers of
`bcut.geometry.rotations.Rotations`; ``labels`` turns them into points of the configuration, and the ranks that
come out are those of the configuration's subsets. ``binomials[j, v]`` is C(v, j).
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from bcut.geometry._compiled import compiled

# Arrays of whatever width the caller has; numba types them at the first call.
Array = Any


@numba.njit
def _advance(subset: Array, n: int) -> None:
    """Go on to the next subset in colexicographic order, if there is one."""
    size = len(subset)
    for j in range(size):
        bound = subset[j + 1] if j + 1 < size else n
        if subset[j] + 1 < bound:
            subset[j] += 1
            for i in range(j):
                subset[i] = i
            return


@numba.njit
def _sort(values: Array) -> int:
    """Sort a few values in place; return the sign of the permutation."""
    sign = 1
    for i in range(1, len(values)):
        value, j = values[i], i
        while j > 0 and values[j - 1] > value:
            values[j] = values[j - 1]
            j -= 1
            sign = -sign
        values[j] = value
    return sign


@numba.njit
def _rank(subset: Array, binomials: Array) -> int:
    """Return the colexicographic rank of an ascending subset."""
    rank = 0
    for j in range(len(subset)):
        rank += binomials[j + 1, subset[j]]
    return rank


@numba.njit
def _blocked(q: int, positions: Array, rows: Array, bases: Array) -> bool:
    """Tell whether a point of a facet's hyperplane, not outside its last ridge, is in the closed facet."""
    for i in range(len(rows) - 1):
        p = positions[rows[i], q]
        if p >= 0 and p != bases[i]:
            return False
    return True


@numba.njit
def _pareto(
    direction: int, start: int, size: int, limit: int, turns: Array, around: Array, positions: Array,
    rows: Array, bases: Array, halves: Array, front: Array, owners: Array, fresh: Array, found: Array,
) -> int:  # fmt: skip
    """Find the apexes of the empty simplices on one side of a facet.

    A point is in the closed simplex of the facet and an apex exactly when, about every ridge of the facet, it
    does not come later than the apex, turning away from the facet. The points come in the order about the last
    ridge; `front` holds the minimal vectors of their places about the others. Points at the same place about
    the last ridge are compared with each other before any of them counts as minimal.
    """
    others = len(rows) - 1
    here, half = bases[others], halves[others]
    width, waiting, previous, count, j = 0, 0, 0, 0, start
    for _ in range(size):
        if j == size:
            j = 0
        elif j < 0:
            j = size - 1
        turn = direction * (turns[j] - here)
        if turn < 0:
            turn += 2 * half
        if turn == 0 or turn >= half:
            break
        if waiting > 0 and turn != previous:
            for k in range(width):
                if fresh[k]:
                    fresh[k] = False
                    if owners[k] < limit:
                        found[count] = owners[k]
                        count += 1
            waiting = 0
        previous = turn
        q = around[j]
        j += direction
        away = -direction
        for i in range(others - 1, -1, -1):
            place = away * (np.int64(positions[rows[i], q]) - bases[i])
            if place < 0:
                place += 2 * halves[i]
            front[width, i] = place
            away = -away
        dominated = False
        for k in range(width):
            below = True
            for i in range(others):
                if front[k, i] > front[width, i]:
                    below = False
                    break
            if below:
                dominated = True
                break
        if dominated:
            continue
        owners[width], fresh[width] = q, True
        waiting += 1
        kept = 0
        for k in range(width + 1):
            above = k < width
            if above:
                for i in range(others):
                    if front[k, i] < front[width, i]:
                        above = False
                        break
            if above:
                continue
            if kept < k:
                # The new vector stays in its row until all others were compared with it.
                for i in range(others):
                    front[kept, i] = front[k, i]
                owners[kept], fresh[kept] = owners[k], fresh[k]
            kept += 1
        width = kept
    for k in range(width):
        if fresh[k] and owners[k] < limit:
            found[count] = owners[k]
            count += 1
    return count


@numba.njit
def _pareto_plane(
    direction: int, start: int, size: int, turns: Array, around: Array, row: Array, bases: Array, halves: Array,
    found: Array,
) -> int:  # fmt: skip
    """Do in two dimensions what `_pareto` does: a minimal vector of two places is a new least second place."""
    here, half, base, whole = bases[1], halves[1], bases[0], 2 * halves[0]
    least, best, owner, previous, count, j = whole, whole, -1, 0, 0, start
    for _ in range(size):
        if j == size:
            j = 0
        elif j < 0:
            j = size - 1
        turn = direction * (turns[j] - here)
        if turn < 0:
            turn += 2 * half
        if turn == 0 or turn >= half:
            break
        if turn != previous:
            if best < least:
                found[count] = owner
                count += 1
                least = best
            previous = turn
        q = around[j]
        j += direction
        place = direction * (base - row[q])
        if place < 0:
            place += whole
        if place < best:
            best, owner = place, q
    if best < least:
        found[count] = owner
        count += 1
    return count


@numba.njit
def _seats(
    here: int, size: int, turns: Array, around: Array, aside: int, flat: Array, positions: Array, rows: Array,
    bases: Array,
) -> tuple[int, int]:  # fmt: skip
    """Find where a facet stands in the order about its last ridge.

    Returns the numbers of turns before its own and up to its own; the latter is -1 where a point, of those in
    the order or aside in the affine hull of the ridge, is in the closed facet, so that no simplex of it is
    empty.
    """
    low, high = 0, size
    while low < high:
        middle = (low + high) // 2
        if turns[middle] < here:
            low = middle + 1
        else:
            high = middle
    high = low
    while high < size and turns[high] == here:
        if _blocked(around[high], positions, rows, bases):
            return low, -1
        high += 1
    for k in range(aside):
        if _blocked(flat[k], positions, rows, bases):
            return low, -1
    return low, high


@numba.njit
def _insert(turn: int, point: int, size: int, turns: Array, around: Array) -> None:
    """Put a point into the order about a ridge."""
    k = size
    while k > 0 and turns[k - 1] > turn:
        turns[k], around[k] = turns[k - 1], around[k - 1]
        k -= 1
    turns[k], around[k] = turn, point


@numba.njit
def _ranks_around(ridge: Array, binomials: Array, below: Array) -> None:
    """Fill in the ranks of a ridge without each of its points."""
    for i in range(len(ridge)):
        below[i] = 0
        for k in range(len(ridge)):
            if k != i:
                below[i] += binomials[k + 1 if k < i else k, ridge[k]]


@compiled
def list_empty(
    positions: Array, half_turns: Array, binomials: Array, labels: Array, ridge: Array, rank: int, stop: int,
    keys: Array,
) -> tuple[int, int]:  # fmt: skip
    """List empty simplices whose first, third, fourth ... but not last vertex form one of some ridges.

    Points must be numbered along a sweep (`bcut.geometry.rotations.sweep_order`): then only points between the
    first and the last vertex of a simplex can be in it, and each simplex is found once, with its second vertex
    as the apex over the facet of the others.

    Parameters
    ----------
    positions, half_turns, labels
        Of the rotations.
    ridge : ndarray of int64, shape (d - 1,)
        The first ridge; becomes the one to go on with.
    rank, stop : int
        Its rank, and the rank to stop before.
    keys : ndarray of int64
        Filled: twice the rank of a simplex, plus 1 where its orientation is positive. Must have room for half
        of n squared.

    Returns
    -------
    int, int
        The rank to go on with, which is below `stop` where the room did not suffice, and the number of keys.
    """
    n, d = positions.shape[1], len(ridge) + 1
    turns, around, flat = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    rows, bases, halves = np.empty(d, np.int64), np.empty(d, np.int64), np.empty(d, np.int64)
    below, facet, found = np.empty(d, np.int64), np.empty(d, np.int64), np.empty(n, np.int64)
    front, owners, fresh = (
        np.empty((n + 1, d), np.int64),
        np.empty(n + 1, np.int64),
        np.empty(n + 1, np.bool_),
    )
    count = 0
    while rank < stop:
        first, last = ridge[0], ridge[d - 2]
        room = (n - first) * (n - first) // 2 if d == 2 else (ridge[1] - first - 1) * (n - 1 - last)
        if count + room > len(keys):
            break
        rows[d - 1], halves[d - 1], row = rank, half_turns[rank], positions[rank]
        _ranks_around(ridge, binomials, below)
        size, aside, member = 0, 0, 1
        for w in range(first + 1, n if half_turns[rank] > 0 and room > 0 else 0):
            if member < d - 1 and ridge[member] == w:
                member += 1
                continue
            here = np.int64(row[w])
            if here >= 0 and w > last and (d > 2 or w > first + 1):
                bases[d - 1] = here
                for i in range(d - 1):
                    rows[i] = below[i] + binomials[d - 1, w]
                    bases[i], halves[i] = positions[rows[i], ridge[i]], half_turns[rows[i]]
                low, high = _seats(here, size, turns, around, aside, flat, positions, rows, bases)
                for direction in (1, -1):
                    if high < 0:
                        break
                    start = high if direction > 0 else low - 1
                    if d == 2:
                        apexes = _pareto_plane(
                            direction, start, size, turns, around, positions[w], bases, halves, found
                        )
                    else:
                        apexes = _pareto(
                            direction, start, size, ridge[1], turns, around, positions, rows, bases, halves,
                            front, owners, fresh, found,
                        )  # fmt: skip
                    if apexes > 0:
                        for k in range(d - 1):
                            facet[k] = labels[ridge[k]]
                        facet[d - 1] = labels[w]
                        sign = _sort(facet) * direction
                        for k in range(apexes):
                            keys[count + k] = _key(facet, labels[found[k]], sign, binomials)
                        count += apexes
            if here < 0:
                flat[aside] = w
                aside += 1
            else:
                _insert(here, w, size, turns, around)
                size += 1
        rank += 1
        _advance(ridge, n)
    return rank, count


@numba.njit
def _key(facet: Array, apex: int, sign: int, binomials: Array) -> int:
    """Encode the simplex of an ascending facet and an apex on its positive or negative side."""
    rank, shift = 0, 1
    for j in range(len(facet)):
        if shift == 1 and facet[j] > apex:
            rank += binomials[j + 1, apex]
            shift = 2
        rank += binomials[j + shift, facet[j]]
        if shift == 2:
            sign = -sign
    if shift == 1:
        rank += binomials[len(facet) + 1, apex]
    return 2 * rank + (1 if sign > 0 else 0)


@compiled
def list_all(columns: Array, half_turns: Array, binomials: Array, d: int, apex: int, keys: Array) -> int:
    """List all simplices with a given last vertex, in colexicographic order.

    Parameters
    ----------
    columns : ndarray, shape (n, C(n, d - 1))
        The positions, transposed, for points numbered as in the configuration.
    apex : int
        The last vertex.
    keys : ndarray of int64, shape (C(apex, d),)
        Filled as by `list_empty`.

    Returns
    -------
    int
        The number of keys.
    """
    count = 0
    for w in range(d - 1, apex):
        start = binomials[d + 1, apex] + binomials[d, w]
        for rank in range(binomials[d - 1, w]):
            half = half_turns[rank]
            here, there = np.int64(columns[w, rank]), np.int64(columns[apex, rank])
            if half == 0 or here < 0 or there < 0:
                continue
            turn = there - here
            if turn < 0:
                turn += 2 * half
            if turn != 0 and turn != half:
                keys[count] = 2 * (start + rank) + (1 if turn < half else 0)
                count += 1
    return count


@compiled
def classify_facets(
    positions: Array, half_turns: Array, binomials: Array, labels: Array, ridge: Array, flag: Array,
    kinds: Array, point_sides: Array,
) -> None:  # fmt: skip
    """Tell of every d-subset whether it is interior, and on which side of it a generic point lies.

    Parameters
    ----------
    ridge : ndarray of int64, shape (d - 1,)
        The first ridge; used as scratch.
    flag : ndarray of int64
        Numbers of the points that define the generic point, as in `bcut.geometry.generic_point`.
    kinds : ndarray of int8, shape (C(n, d),)
        Filled by rank: 0 for dependent subsets, 1 for those in a facet of the hull, 2 for interior ones.
    point_sides : ndarray of int8, shape (C(n, d),)
        Filled by rank: the side of the generic point, 0 for dependent subsets.
    """
    n, d = positions.shape[1], len(ridge) + 1
    occupied, facet = np.empty(2 * n, np.bool_), np.empty(d, np.int64)
    ahead, behind = np.empty(2 * n, np.int64), np.empty(2 * n, np.int64)
    for rank in range(len(half_turns)):
        half, row = np.int64(half_turns[rank]), positions[rank]
        whole = 2 * half
        occupied[:whole] = False
        for q in range(n):
            if half > 0 and row[q] >= 0:
                occupied[row[q]] = True
        # Distances to the next occupied position on either side; twice around, to begin with a known one.
        distance: Any = whole
        for k in range(2 * whole):
            p = k % whole
            behind[p] = distance
            distance = 1 if occupied[p] else distance + 1
        distance = whole
        for k in range(2 * whole - 1, -1, -1):
            p = k % whole
            ahead[p] = distance
            distance = 1 if occupied[p] else distance + 1
        for w in range(ridge[d - 2] + 1, n):
            for k in range(d - 1):
                facet[k] = labels[ridge[k]]
            facet[d - 1] = labels[w]
            sign = _sort(facet)
            place = _rank(facet, binomials)
            kinds[place], point_sides[place] = 0, 0
            here = np.int64(row[w])
            if half == 0 or here < 0:
                continue
            kinds[place] = 2 if ahead[here] < half and behind[here] < half else 1
            for k in range(len(flag)):
                there = np.int64(row[flag[k]])
                turn = (there - here) % whole
                if there >= 0 and turn != 0 and turn != half:
                    point_sides[place] = sign if turn < half else -sign
                    break
        _advance(ridge, n)

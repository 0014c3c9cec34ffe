"""Compiled passes over the columns of a linear program, for `bcut.bounds.first_order`.

A column has `width` entries of 1 or -1, listed as places in the vector ``(y, -y, 0)``, so that signs and missing
entries cost nothing, and any number of further entries with values. One set of kernels is made for each width, which
lets the compiler unroll the loops over the fixed entries.

Use this module only where an instance is large enough to repay numba's start.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from bcut.geometry._compiled import compiled

# Arrays of whatever types the caller has; numba types them at the first call.
Array = Any


@dataclass(frozen=True)
class Kernels:
    """The passes for one width. Their first four arguments are the columns: fixed, starts, places, values.

    Attributes
    ----------
    step : callable
        ``(*columns, costs, margin, steps, pace, y, x, origin, share, plain, products, before, near, count, wide)
        -> (moved, entered, count)``: one primal step on all columns (`count` negative) or on those listed in
        ``near[:count]``. ``steps * pace`` are the step lengths. x moves to
        ``share * (2 p - x) + (1 - share) * origin``, p the projected point, or to p where `plain`; the products
        of all 2 p - x with the columns are added to `products`. Returns the squared length of p - x in the norm
        of the steps. A pass over all columns also tells how much of that is due to columns that were at rest, and
        lists in `near` those that may move before the next such pass, as far as `wide` times the change of their
        reduced costs since the last one tells.
    price : callable
        ``(*columns, costs, y, reduced) -> None``: reduced costs.
    collect : callable
        ``(*columns, x, products) -> None``: adds the products with the columns.
    sizes : callable
        ``(*columns, weights, x, rows, sums) -> None``: absolute entries, summed over the columns with factors x
        (into `rows`) and over the rows with factors `weights` (into `sums`).
    """

    step: Callable[..., Any]
    price: Callable[..., Any]
    collect: Callable[..., Any]
    sizes: Callable[..., Any]


@compiled
def dual_step(
    sums: Array, lower: Array, upper: Array, steps: Array, pace: float, share: float, plain: bool, y: Array,
    origin: Array, products: Array, origin_products: Array, projected: Array,
) -> Any:  # fmt: skip
    """Make the step that belongs to a primal one: y and its companion `products`, the rows' values at x.

    Parameters
    ----------
    sums : ndarray of float, shape (2 * rows + 1,)
        What the primal step added up.
    lower, upper, steps, y, origin, products, origin_products : ndarray of float, shape (rows,)
        ``steps * pace`` are the step lengths.
    projected : ndarray of float, shape (rows,)
        Receives the point of T.

    Returns
    -------
    crossed, moved : float
        Of the change of y, its product with that of the rows' values, and the squared length.
    """
    crossed = 0.0
    moved = 0.0
    rows = y.size
    for i in range(rows):
        reflected = sums[i] - sums[rows + i]
        length = pace * steps[i]
        target = y[i] / length - reflected
        new = length * (target + min(max(-target, lower[i]), upper[i]))
        by = new - y[i]
        crossed += 0.5 * by * (reflected - products[i])
        moved += by * by / length
        projected[i] = new
        if plain:
            products[i] = 0.5 * (reflected + products[i])
            y[i] = new
        else:
            products[i] = share * reflected + (1.0 - share) * origin_products[i]
            y[i] = share * (new + by) + (1.0 - share) * origin[i]
    return crossed, moved


@compiled
def crossed_faces(inverses: Array, beyond: Array, way: Array, faces: Array, values: Array) -> int:
    """List the faces that a segment crosses.

    Parameters
    ----------
    inverses : ndarray of float, shape (rows, d, d)
        Of the matrices whose columns lead from the beginning of the segment to the vertices of a face.
    beyond : ndarray of int8, shape (rows,)
        0 for faces to be left out.
    way : ndarray of float, shape (d,)
        From the beginning of the segment to its end.
    faces, values : ndarray, shape (rows,)
        Receive the faces and their entries of `beyond`.

    Returns
    -------
    count : int
        How many there are.
    """
    d = way.size
    count = 0
    for face in range(beyond.size):
        total = 0.0
        inside = beyond[face] != 0
        for i in range(d):
            weight = 0.0
            for j in range(d):
                weight += inverses[face, i, j] * way[j]
            inside = inside and weight > 0.0
            total += weight
        if inside and total > 1.0:
            faces[count] = face
            values[count] = beyond[face]
            count += 1
    return count


@cache
def kernels(width: int) -> Kernels:
    """Return the compiled passes for columns with this many fixed entries."""

    # Functions that the kernels shared would be new objects in every process, and so would defeat the cache on disk.
    @compiled
    def step(
        fixed: Array, starts: Array, places: Array, values: Array, costs: Array, margin: float, steps: Array,
        pace: float, y: Array, x: Array, origin: Array, share: float, plain: bool, products: Array, before: Array,
        near: Array, count: int, wide: float,
    ) -> Any:  # fmt: skip
        everything = count < 0
        moved = 0.0
        entered = 0.0
        listed = 0
        for i in range(x.size if everything else count):
            j = i if everything else near[i]
            r = costs[j] - margin
            for k in range(width):
                r -= y[fixed[j, k]]
            for k in range(starts[j], starts[j + 1]):
                r -= values[k] * y[places[k]]
            length = pace * steps[j]
            old = x[j]
            new = max(0.0, old - length * r)
            by = new - old
            reflected = new + by
            if reflected != 0.0 or by != 0.0:
                moved += by * by / length
                for k in range(width):
                    products[fixed[j, k]] += reflected
                for k in range(starts[j], starts[j + 1]):
                    products[places[k]] += values[k] * reflected
            x[j] = new if plain else share * reflected + (1.0 - share) * origin[j]
            if everything:
                if old == 0.0 and origin[j] == 0.0:
                    entered += by * by / length
                if x[j] != 0.0 or origin[j] != 0.0 or r < wide * abs(r - before[j]):
                    near[listed] = j
                    listed += 1
                before[j] = r
        return moved, entered, listed

    @compiled
    def price(
        fixed: Array, starts: Array, places: Array, values: Array, costs: Array, y: Array, reduced: Array
    ) -> None:
        for j in range(costs.size):
            r = costs[j]
            for k in range(width):
                r -= y[fixed[j, k]]
            for k in range(starts[j], starts[j + 1]):
                r -= values[k] * y[places[k]]
            reduced[j] = r

    @compiled
    def collect(fixed: Array, starts: Array, places: Array, values: Array, x: Array, products: Array) -> None:
        for j in range(x.size):
            if x[j] != 0.0:
                for k in range(width):
                    products[fixed[j, k]] += x[j]
                for k in range(starts[j], starts[j + 1]):
                    products[places[k]] += values[k] * x[j]

    @compiled
    def sizes(
        fixed: Array, starts: Array, places: Array, values: Array, weights: Array, x: Array, rows: Array, sums: Array
    ) -> None:  # fmt: skip
        for j in range(x.size):
            total = 0.0
            for k in range(width):
                rows[fixed[j, k]] += x[j]
                total += weights[fixed[j, k]]
            for k in range(starts[j], starts[j + 1]):
                rows[places[k]] += abs(values[k]) * x[j]
                total += abs(values[k]) * weights[places[k]]
            sums[j] = total

    return Kernels(step, price, collect, sizes)

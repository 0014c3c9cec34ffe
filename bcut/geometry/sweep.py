"""A spanning triangulation of points of the plane in a time that is nearly linear, by a sweep."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.subsets import ranks


def sweep_triangulation(configuration: PointConfiguration) -> NDArray[np.int64]:
    """Return the triangulation that places the points of the plane in lexicographic order.

    It is that of `bcut.geometry.placing`, but needs no chirotope: the point placed last is a vertex of the hull, so
    what the next one sees begins there, along both chains of the hull.

    Parameters
    ----------
    configuration : PointConfiguration
        Of dimension 2.

    Returns
    -------
    ndarray of int64, shape (t, 3)
        Ascending simplices, in colexicographic order.
    """
    points, side = _exact(configuration)
    order = sorted(range(configuration.n), key=points.__getitem__)
    count = 2
    while side(order[0], order[1], order[count]) == 0:
        count += 1
    # The first points are on a line; the next one sees all segments between them.
    line, apex = order[:count], order[count]
    triangles = [(a, b, apex) for a, b in pairwise(line)]
    whole, short = [*line, apex], [line[0], apex]
    below, above = (short, whole) if side(line[0], line[1], apex) < 0 else (whole, short)
    for point in order[count + 1 :]:
        for chain, sign in ((below, -1), (above, 1)):
            while len(chain) > 1 and side(chain[-2], chain[-1], point) == sign:
                triangles.append((chain[-2], chain[-1], point))
                chain.pop()
            chain.append(point)
    simplices = np.sort(np.array(triangles, dtype=np.int64), axis=1)
    return simplices[np.argsort(ranks(simplices, configuration.n))]


def _exact(configuration: PointConfiguration) -> tuple[list[Any], Callable[[int, int, int], int]]:
    """Return the points as pairs of exact numbers, and the side of a line through two points that a third one is on."""
    if configuration.field.degree == 1:
        points: list[Any] = [tuple(row) for row in configuration.numerators[..., 0].tolist()]
    else:
        points = list(configuration.scalars())

    def side(a: int, b: int, c: int) -> int:
        (ax, ay), (bx, by), (cx, cy) = points[a], points[b], points[c]
        value = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        return (value > 0) - (value < 0)

    return points, side

"""A triangulation of any configuration, quickly: placing the points one after the other.

Taken in an order in which each point lies outside the hull of those before it, the new point is joined to
every facet of the hull that it sees. In lexicographic order of the coordinates every point lies outside, so
the triangulation uses all of them: it is spanning.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.rank import pivot_columns
from bcut.geometry.subsets import ranks


def placing_triangulation(configuration: PointConfiguration, chirotope: Chirotope) -> NDArray[np.int64]:
    """Return the spanning triangulation that places the points in a lexicographic order.

    Parameters
    ----------
    configuration : PointConfiguration
    chirotope : Chirotope
        Of the same configuration.

    Returns
    -------
    ndarray of int64, shape (k, d + 1)
        Ascending simplices, in colexicographic order.
    """
    order = sorted(range(configuration.n), key=configuration.scalars().__getitem__)
    growth = _Growth(chirotope, order, _first_basis(configuration, order))
    for point in order[1:]:
        growth.place(point)
    simplices = np.array(sorted(growth.simplices), dtype=np.int64)
    return simplices[np.argsort(ranks(simplices, chirotope.n))]


def _first_basis(configuration: PointConfiguration, order: list[int]) -> list[int]:
    """Return the first affine basis in the order: each point that is not in the span of those before it."""
    points = configuration.scalars()
    rows: list[list[Any]] = [[Fraction(1)] * len(order)]
    rows += [[points[point][j] for point in order] for j in range(configuration.dimension)]
    return [order[column] for column in pivot_columns(rows)]


class _Growth:
    """A triangulation of the points placed so far, in their own affine span.

    Attributes
    ----------
    simplices : list of tuple
        Ascending vertices, one more than the dimension of the span.
    boundary : dict
        The vertex opposite to each facet that belongs to one simplex only.
    beyond : list of int
        Points that extend the span to all of space: an orientation within the span is one with these
        appended.
    """

    def __init__(self, chirotope: Chirotope, order: list[int], basis: list[int]) -> None:
        self.chirotope = chirotope
        self.simplices: list[tuple[int, ...]] = [(order[0],)]
        self.boundary: dict[tuple[int, ...], int] = {(): order[0]}
        self.beyond = basis[1:]

    def place(self, point: int) -> None:
        """Join a point outside the hull to every facet that it sees, or to everything where it extends the span."""
        if self.beyond and point == self.beyond[0]:
            self.beyond.pop(0)
            base = dict.fromkeys(self.simplices, point)
            sides = {_with(facet, point): vertex for facet, vertex in self.boundary.items()}
            self.simplices = [_with(simplex, point) for simplex in self.simplices]
            self.boundary = {**base, **sides}
            return
        seen = [facet for facet, vertex in self.boundary.items() if self._opposite(facet, vertex, point)]
        for facet in seen:
            del self.boundary[facet]
        for facet in seen:
            simplex = _with(facet, point)
            self.simplices.append(simplex)
            for vertex in facet:
                ridge_side = tuple(v for v in simplex if v != vertex)
                # Two new simplices share each facet through an inner ridge of what is seen.
                if ridge_side in self.boundary:
                    del self.boundary[ridge_side]
                else:
                    self.boundary[ridge_side] = vertex

    def _opposite(self, facet: tuple[int, ...], vertex: int, point: int) -> bool:
        return self._orientation((*facet, vertex)) * self._orientation((*facet, point)) < 0

    def _orientation(self, points: tuple[int, ...]) -> int:
        whole = (*points, *self.beyond)
        inversions = sum(a > b for i, a in enumerate(whole) for b in whole[i + 1 :])
        sign = int(self.chirotope.orientations(np.array(sorted(whole))))
        return -sign if inversions & 1 else sign


def _with(simplex: tuple[int, ...], point: int) -> tuple[int, ...]:
    return tuple(sorted((*simplex, point)))

"""The volume of a convex hull, from a construction of its own: placing the points one after the other."""

from __future__ import annotations

from typing import Any

from bcut.verification.exact_points import ExactPoints, Hyperplane, Simplex, without


def hull_volume(points: ExactPoints, start: Simplex) -> Any:
    """Return the exact volume of the convex hull of all points, in units of ``points.volume_unit``.

    The beneath-beyond method: the hull of the points so far is kept as a set of (d-1)-simplices that tile
    its boundary; a new point is joined to those that it sees strictly, and what has become of them is the
    boundary's new part. This is right in degenerate position too, where several of these simplices tile one
    facet of the hull.

    Parameters
    ----------
    points : ExactPoints
    start : tuple of int
        d + 1 affinely independent points.
    """
    growth = _Growth(points, start)
    for point in range(points.n):
        if point not in start:
            growth.place(point)
    return growth.volume


class _Growth:
    """A growing polytope: its volume, and (d-1)-simplices that tile its boundary, with their inner sides."""

    def __init__(self, points: ExactPoints, start: Simplex) -> None:
        self.points = points
        self.volume = points.volume(start)
        self.boundary: dict[Simplex, tuple[Hyperplane, int]] = {}
        simplex = tuple(sorted(start))
        for position, vertex in enumerate(simplex):
            self._add(without(simplex, position), vertex)

    def place(self, point: int) -> None:
        """Join a point to every part of the boundary that it sees."""
        side = self.points.side
        seen = [facet for facet, (plane, inner) in self.boundary.items() if side(plane, point) == -inner]
        fresh: dict[Simplex, int] = {}
        for facet in seen:
            del self.boundary[facet]
            simplex = tuple(sorted((*facet, point)))
            self.volume = self.volume + self.points.volume(simplex)
            for position, vertex in enumerate(simplex):
                # A facet through an inner ridge of what is seen belongs to two new simplices: no boundary.
                wall = without(simplex, position)
                if vertex != point and fresh.pop(wall, None) is None:
                    fresh[wall] = vertex
        for facet, vertex in fresh.items():
            self._add(facet, vertex)

    def _add(self, facet: Simplex, inner_vertex: int) -> None:
        plane = self.points.hyperplane(facet)
        self.boundary[facet] = plane, self.points.side(plane, inner_vertex)

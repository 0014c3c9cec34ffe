"""The value of a face at a point x: the sum of x over the simplices around it in one generic direction.

Let f be a face of some simplices, and u a generic direction at f. Of a triangulation the simplices with the face f
cover a neighbourhood of its inner points in the hull once, so exactly one of them contains u, as seen from f, if f is
a face of the triangulation and u points into the hull; otherwise none does.

Directions are given by flags: d + 1 affinely independent points, the vertices of f first. The generic point of such a
flag (`bcut.geometry.generic_point`) lies next to a point inside f, in a direction into the hull.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.face_crossings import Face, FaceGraph
from bcut.geometry.generic_point import contain_generic_points
from bcut.geometry.subsets import face_positions

# Directions at a face among which the one with the fewest simplices is taken.
_DIRECTIONS = 64


class FaceValues:
    """Values of faces, and the simplices that make them up.

    Parameters
    ----------
    graph : FaceGraph
        The faces.
    simplices : ndarray of int, shape (m, d + 1)
        Those that the graph was made of.
    """

    def __init__(self, graph: FaceGraph, simplices: NDArray[np.int64]) -> None:
        self.graph, self.simplices = graph, simplices
        self._around: dict[int, tuple[NDArray[np.intp], Face]] = {}

    def at(self, columns: NDArray[np.integer], x: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return the values of all faces at a point.

        Parameters
        ----------
        columns : ndarray of int, shape (k,)
            The simplices that have values; that of all others is taken to be 0.
        x : ndarray of float, shape (k,)

        Returns
        -------
        ndarray of float, shape (faces,)
            At points of Formulation 2 the value of a face does not depend on the direction; elsewhere that of the
            first simplex with the face is taken.
        """
        graph, corners = self.graph, self.simplices[columns]
        d = graph.chirotope.dimension
        values = np.zeros(len(graph))
        for size in range(1, d + 2):
            positions = face_positions(d + 1, size)
            rest = np.array([[p for p in range(d + 1) if p not in row] for row in positions.tolist()])
            orders = np.concatenate((positions, rest.reshape(len(positions), -1).astype(np.int64)), axis=1)
            occurrences = graph.table.incidence[size][columns].ravel()
            used, first, which = np.unique(occurrences, return_index=True, return_inverse=True)
            simplex, place = np.divmod(first, len(positions))
            flags = np.take_along_axis(corners[simplex], orders[place], axis=1)
            rows = np.arange(len(occurrences)) // len(positions)
            inside = contain_generic_points(graph.chirotope, corners[rows], flags[which])
            values[graph.starts[size - 1] + used] = np.bincount(which, weights=x[rows] * inside)
        return values

    def around(self, face: int) -> tuple[NDArray[np.intp], Face]:
        """Return the columns around a face in one direction, and the flag of the direction.

        Of some directions next to the simplices with the face it is one that the fewest of them contain. Answers are
        remembered.
        """
        if face not in self._around:
            self._around[face] = self._fewest_around(face)
        return self._around[face]

    def _fewest_around(self, face: int) -> tuple[NDArray[np.intp], Face]:
        graph, vertices = self.graph, self.graph.vertices(face)
        size = len(vertices)
        row = face - graph.starts[size - 1]
        columns = np.flatnonzero((graph.table.incidence[size] == row).any(axis=1))
        star = self.simplices[columns]
        turns = max(1, star.shape[1] - size)
        chosen = np.unique(np.linspace(0, len(star) - 1, max(1, _DIRECTIONS // turns)).astype(np.int64))
        others = star[chosen][~np.isin(star[chosen], vertices)].reshape(len(chosen), -1)
        flags = np.concatenate(
            [
                np.concatenate((np.tile(vertices, (len(others), 1)), np.roll(others, turn, axis=1)), axis=1)
                for turn in range(turns)
            ]
        ).astype(np.int64)
        pairs = np.tile(star, (len(flags), 1)), np.repeat(flags, len(star), axis=0)
        inside = contain_generic_points(graph.chirotope, *pairs).reshape(len(flags), len(star))
        best = int(np.argmin(inside.sum(axis=1)))
        return columns[inside[best]], tuple(flags[best].tolist())

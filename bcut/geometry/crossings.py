"""Which simplices cross: pairs that no triangulation contains together.

Two simplices A and B meet in a common face unless some circuit (Z+, Z-) has Z+ in A and Z- in B. Such a
circuit extends by vertices of A to a (d+2)-subset that spans the space, split into a face s of A and a face t
of B. So A and B cross exactly when they have disjoint faces s and t, with d + 2 vertices together, for which
the one affine dependence on s and t is weakly positive on s and weakly negative on t. In general position
"weakly" changes nothing, and this is Proposition 1 of the paper; with it the statement holds for every
configuration.

Simplices share their faces, so the work is done once for each pair of faces, not of simplices.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope
from bcut.geometry.subsets import face_positions, ranks, without

# Entries of a table that are worked on at once: what stays in a processor's cache, times a few.
_CHUNK = 1 << 20

# Entries of a table over all faces of complementary sizes; a larger one is computed where it is needed only.
_LARGEST_TABLE = 1 << 27


class FaceTable:
    """All faces of some simplices, each listed once, with their incidences.

    Attributes
    ----------
    count : int
        The number m of simplices.
    faces : dict of int to ndarray
        For s = 0..d+1, the distinct faces with s vertices, shape (f_s, s), ascending in colex order.
    incidence : dict of int to ndarray of int32
        For each s, shape (m, C(d+1, s)): the rows of ``faces[s]`` for each simplex.
    """

    def __init__(self, simplices: NDArray[np.int64], n: int) -> None:
        self.n = n
        self.count, size = simplices.shape
        self.faces: dict[int, NDArray[np.int64]] = {0: np.empty((1, 0), dtype=np.int64)}
        self.incidence: dict[int, NDArray[np.int32]] = {0: np.zeros((self.count, 1), dtype=np.int32)}
        self._ranks: dict[int, NDArray[np.int64]] = {0: np.zeros(1, dtype=np.int64)}
        for face_size in range(1, size + 1):
            listed = simplices[:, face_positions(size, face_size)]
            known, first, inverse = np.unique(
                ranks(listed, n).ravel(), return_index=True, return_inverse=True
            )
            self.faces[face_size] = listed.reshape(-1, face_size)[first]
            self.incidence[face_size] = inverse.reshape(listed.shape[:2]).astype(np.int32)
            self._ranks[face_size] = known

    def boundary(self, face_size: int) -> NDArray[np.int64]:
        """Return, for each face and position, the row of ``faces[face_size - 1]`` that omits that vertex."""
        faces = self.faces[face_size]
        return np.stack([self.rows(without(faces, i)) for i in range(face_size)], axis=1)

    def rows(self, faces: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the rows in which some ascending faces of one size are listed, shape (..., s) to (...)."""
        return np.searchsorted(self._ranks[faces.shape[-1]], ranks(faces, self.n))


class CrossingTable:
    """The crossings of any simplices with some fixed ones.

    Parameters
    ----------
    chirotope : Chirotope
        Of the point configuration, in dimension d.
    simplices : ndarray of int, shape (m, d + 1)
        The fixed ones, vertices ascending. Memory grows with their number, and with that of their faces.
    """

    def __init__(self, chirotope: Chirotope, simplices: NDArray[np.int64]) -> None:
        self.chirotope = chirotope
        self.table = FaceTable(simplices, chirotope.n)
        self._boundary = {size: self.table.boundary(size) for size in range(1, chirotope.dimension + 2)}

    def rows(self, simplices: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Tell which of the fixed simplices cross each of the given ones, shape (k, m).

        Parameters
        ----------
        simplices : ndarray of int, shape (k, s)
            Ascending vertices; simplices of a smaller dimension too: the extension of a circuit that the module
            describes needs the vertices of one full-dimensional simplex only, and the fixed ones are.
        """
        d = self.chirotope.dimension
        left = FaceTable(simplices, self.chirotope.n)
        # One bit for each given simplex, in one row for each fixed one: a face then passes on all its bits at
        # once.
        crossing = np.zeros((self.table.count, (left.count + 7) // 8), dtype=np.uint8)
        omitting = self._orientations(left, 0)
        for size in range(1, simplices.shape[1] + 1):
            keeping = self._orientations(left, size)
            faces = self._crossing_faces(left, size, omitting, keeping)
            if faces.any():
                hit = _packed_by_column(faces, left.incidence[size])
                for column in self.table.incidence[d + 2 - size].T:
                    crossing |= hit[column]
            omitting = keeping
        return np.ascontiguousarray(np.unpackbits(crossing, axis=1, count=left.count).T).view(np.bool_)

    def between_faces(self, size: int) -> NDArray[np.bool_]:
        """Tell which faces with `size` vertices of the fixed simplices cross which with d + 2 - size vertices.

        Only pairs whose vertices are different and span the space are told of, shape (f_s, f_(d+2-s)): circuits of
        fewer points are not looked for.
        """
        omitting, keeping = (self._orientations(self.table, s) for s in (size - 1, size))
        return self._crossing_faces(self.table, size, omitting, keeping)

    def _crossing_faces(
        self, left: FaceTable, size: int, omitting: NDArray[np.int8], keeping: NDArray[np.int8]
    ) -> NDArray[np.bool_]:
        """Tell which faces with `size` vertices cross which fixed faces with d + 2 - size vertices.

        By Cramer's rule the affine dependence on the points (s, t) has at the i-th of them the coefficient
        (-1)^i times the orientation of the others. `omitting` holds the orientations with one vertex of s
        left out, `keeping` those with one vertex of t left out.
        """
        d = self.chirotope.dimension
        faces, others = left.faces[size], self.table.faces[d + 2 - size]
        left_boundary, right_boundary = left.boundary(size), self._boundary[d + 2 - size]
        result = np.empty((len(faces), len(others)), dtype=bool)
        step = max(1, _CHUNK // max(1, len(others)))
        for start in range(0, len(faces), step):
            part = slice(start, start + step)
            signs = [(1, i, omitting[left_boundary[part, i]]) for i in range(size)]
            # The sign on t is turned round, so that a crossing shows one sign only; none at all means no full
            # rank.
            signs += [(-1, size + j, keeping[part][:, rows]) for j, rows in enumerate(right_boundary.T)]
            plus, minus = np.zeros((2, *signs[0][2].shape), dtype=bool)
            for turned, position, coefficient in signs:
                up, down = (plus, minus) if turned * (-1) ** position > 0 else (minus, plus)
                up |= coefficient > 0
                down |= coefficient < 0
            plus ^= minus
            used = np.zeros((len(plus), self.chirotope.n), dtype=bool)
            np.put_along_axis(used, faces[part], True, axis=1)
            for vertices in others.T:
                plus &= ~used[:, vertices]
            result[part] = plus
        return result

    def _orientations(self, left: FaceTable, size: int) -> NDArray[np.int8]:
        """Orientations of (s, t) for faces s of `left` with `size` vertices and fixed faces t with the rest.

        The rest is d + 1 - size; zero where s and t share a vertex.
        """
        chirotope, d = self.chirotope, self.chirotope.dimension
        first, second = left.faces[size], self.table.faces[d + 1 - size]
        if size == d:
            return chirotope.sides[ranks(first, chirotope.n)][:, second[:, 0]]
        if size == 1:
            # A point passes the d points of a facet in d transpositions.
            sides = chirotope.sides[ranks(second, chirotope.n)][:, first[:, 0]].T
            return -sides if d & 1 else sides
        if comb(chirotope.n, size) * comb(chirotope.n, d + 1 - size) <= _LARGEST_TABLE:
            rows, columns = ranks(first, chirotope.n), ranks(second, chirotope.n)
            return chirotope.joined(size)[rows[:, None], columns]
        result = np.empty((len(first), len(second)), dtype=np.int8)
        step = max(1, _CHUNK // (max(1, len(second)) * (d + 1)))
        for start in range(0, len(first), step):
            result[start : start + step] = _joined_orientations(
                chirotope, first[start : start + step], second
            )
        return result


def _packed_by_column(faces: NDArray[np.bool_], incidence: NDArray[np.int32]) -> NDArray[np.uint8]:
    """Join the rows of each simplex's faces; return for each column the simplices that have it, as bits."""
    rows = np.packbits(faces, axis=1)
    step = max(8, _CHUNK // max(1, faces.shape[1]) // 8 * 8)
    parts = []
    for start in range(0, len(incidence), step):
        joined = np.bitwise_or.reduce(rows[incidence[start : start + step]], axis=1)
        parts.append(np.packbits(np.unpackbits(joined, axis=1, count=faces.shape[1]), axis=0))
    return np.ascontiguousarray(np.concatenate(parts).T)


def _joined_orientations(
    chirotope: Chirotope, first: NDArray[np.int64], second: NDArray[np.int64]
) -> NDArray[np.int8]:
    """Orientations of all concatenations (s, t), zero where a point occurs twice."""
    shape = (len(first), len(second))
    inversions = np.zeros(shape, dtype=np.int64)
    repeated = np.zeros(shape, dtype=bool)
    for a in first.T:
        for b in second.T:
            inversions += a[:, None] > b
            repeated |= a[:, None] == b
    joined = np.concatenate(
        (
            np.broadcast_to(first[:, None], (*shape, first.shape[1])),
            np.broadcast_to(second, (*shape, second.shape[1])),
        ),
        axis=2,
    )
    joined.sort(axis=2)
    result = np.zeros(shape, dtype=np.int8)
    distinct = ~repeated
    signs = chirotope.orientations(joined[distinct])
    result[distinct] = np.where(inversions[distinct] & 1, -signs, signs)
    return result


def crossing_matrix(
    chirotope: Chirotope, simplices: NDArray[np.int64], others: NDArray[np.int64] | None = None
) -> NDArray[np.bool_]:
    """Tell which pairs of d-simplices cross, that is, do not meet in a common (possibly empty) face.

    Parameters
    ----------
    chirotope : Chirotope
        Of the point configuration.
    simplices : ndarray of int, shape (m, d + 1)
        Ascending vertices.
    others : ndarray of int, shape (k, d + 1), optional
        The second partners; `simplices` again when omitted.

    Returns
    -------
    ndarray of bool, shape (m, k)
        No triangulation contains both simplices of a pair marked here. A simplex does not cross itself.
    """
    return CrossingTable(chirotope, simplices if others is None else others).rows(simplices)

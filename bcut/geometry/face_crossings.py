"""Which faces cross, of simplices and in all dimensions: pairs that no triangulation has both of.

Faces f and g of a triangulation meet in a common face. They do unless some circuit (Z+, Z-) has Z+ in f and Z- in g,
for then the relative interiors of two disjoint faces meet. So crossing is handed on from faces to larger faces, and
begins at circuits. One of d + 2 points, which span the space, shows in the orientations of its points without one
(`bcut.geometry.crossings.CrossingTable.between_faces`). One of fewer points, which exists in degenerate position only,
lies in d + 1 points of a hyperplane that have no other dependence (`small_circuits`).
"""

from __future__ import annotations

from bisect import bisect_right
from collections import OrderedDict
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope
from bcut.geometry.crossings import CrossingTable
from bcut.geometry.subsets import all_subsets, face_positions, ranks, without

Face = tuple[int, ...]

# Faces that are worked on together: they are bits of one table.
_CHUNK = 256

# Rows of the crossing graph that are remembered, in bytes: a row is one bit per face.
_ROW_CACHE = 1 << 27


def small_circuits(chirotope: Chirotope) -> list[tuple[Face, Face]]:
    """List the circuits of at most d + 1 points: none in general position.

    Such a circuit has one affine dependence, and extends by independent points to d + 1 points that span a hyperplane
    and have no other. With a point outside the hyperplane, where the dependence vanishes, Cramer's rule gives its
    signs.

    Returns
    -------
    list of (tuple of int, tuple of int)
        Both parts ascending, each circuit once.
    """
    d = chirotope.dimension
    subsets = all_subsets(chirotope.n, d + 1)[chirotope.signs == 0]
    facets = [ranks(without(subsets, position), chirotope.n) for position in range(d + 1)]
    signs = np.zeros((len(subsets), d + 1), dtype=np.int8)
    outside = np.full(len(subsets), -1)
    for facet in facets:
        sides = chirotope.sides[facet]
        outside = np.where((outside < 0) & sides.any(axis=1), (sides != 0).argmax(axis=1), outside)
    known = outside >= 0
    for position, facet in enumerate(facets):
        side = chirotope.sides[facet[known], outside[known]]
        signs[known, position] = -side if position & 1 else side
    found: dict[tuple[Face, Face], None] = {}
    for points, row in zip(subsets[known].tolist(), signs[known].tolist(), strict=True):
        plus = tuple(point for point, sign in zip(points, row, strict=True) if sign > 0)
        minus = tuple(point for point, sign in zip(points, row, strict=True) if sign < 0)
        found[min(plus, minus), max(plus, minus)] = None
    return list(found)


class FaceGraph:
    """All faces of some d-simplices, these included, and which of them cross.

    Faces are numbered by size, and by colexicographic rank within a size.

    Parameters
    ----------
    chirotope : Chirotope
    simplices : ndarray of int, shape (m, d + 1)
        Ascending vertices.

    Attributes
    ----------
    table : FaceTable
        The faces by size, and which simplices have which.
    starts : list of int
        The number of the first face with s vertices, for s = 1 ... d + 1, at ``starts[s - 1]``; and at the end how
        many faces there are.
    sizes : ndarray of int, shape (faces,)
        How many vertices each face has.
    boundaries : dict of int to ndarray of int
        For s = 2 ... d + 1, the numbers of the facets of the faces with s vertices, shape (f_s, s).
    """

    def __init__(self, chirotope: Chirotope, simplices: NDArray[np.int64]) -> None:
        self.chirotope = chirotope
        self._crossing_table = CrossingTable(chirotope, simplices)
        self.table = self._crossing_table.table
        face_sizes = range(1, chirotope.dimension + 2)
        counts = [len(self.table.faces[size]) for size in face_sizes]
        self.starts: list[int] = np.cumsum([0, *counts]).tolist()
        self.sizes = np.repeat(np.array(face_sizes), counts)
        self.boundaries = {
            size: self.table.boundary(size) + self.starts[size - 2] for size in face_sizes if size > 1
        }
        self._subfaces: dict[int, NDArray[np.int64]] = {}
        self._pairs: dict[int, NDArray[np.uint8]] = {}
        self._rows: OrderedDict[int, NDArray[np.uint8]] = OrderedDict()

    def __len__(self) -> int:
        return self.starts[-1]

    def part(self, size: int) -> slice:
        """Return the numbers of the faces with `size` vertices."""
        return slice(self.starts[size - 1], self.starts[size])

    def vertices(self, face: int) -> Face:
        """Return the vertices of a face, ascending."""
        size = bisect_right(self.starts, face)
        return tuple(self.table.faces[size][face - self.starts[size - 1]].tolist())

    def number(self, vertices: Face) -> int | None:
        """Return the number of the face with these ascending vertices; None if no simplex has it."""
        known = self.table.faces[len(vertices)]
        row = int(self.table.rows(np.array(vertices)))
        found = row < len(known) and tuple(known[row].tolist()) == vertices
        return row + self.starts[len(vertices) - 1] if found else None

    def subfaces(self, face: int) -> NDArray[np.int64]:
        """Return the numbers of all faces of a face, itself included, ascending, so smaller ones first."""
        found = self._subfaces.get(face)
        if found is None:
            vertices = np.array(self.vertices(face))
            found = np.concatenate(
                [
                    self.table.rows(vertices[face_positions(len(vertices), size)]) + self.starts[size - 1]
                    for size in range(1, len(vertices) + 1)
                ]
            )
            self._subfaces[face] = found
        return found

    def crossings(
        self, faces: NDArray[np.integer], others: NDArray[np.integer] | None = None
    ) -> NDArray[np.bool_]:
        """Tell which faces cross which, given by numbers, shape (len(faces), len(others)).

        `others` defaults to all faces there are. No face crosses itself. Rows are remembered.
        """
        asked = np.asarray(faces).tolist()
        missing = [face for face in dict.fromkeys(asked) if face not in self._rows]
        for start in range(0, len(missing), _CHUNK):
            fresh = missing[start : start + _CHUNK]
            self._rows.update(zip(fresh, self._computed(fresh), strict=True))
        for face in asked:
            self._rows.move_to_end(face)
        width = (len(self) + 7) // 8
        packed = np.array([self._rows[face] for face in asked], dtype=np.uint8).reshape(-1, width)
        while len(self._rows) > max(1, _ROW_CACHE // width):
            self._rows.popitem(last=False)
        if others is None:
            return np.unpackbits(packed, axis=1, count=len(self)).view(np.bool_)
        bits = packed[:, others >> 3] >> (7 - (others & 7)).astype(np.uint8)
        return (bits & 1).astype(bool)

    def _computed(self, faces: list[int]) -> NDArray[np.uint8]:
        """Return rows of the crossing graph, packed."""
        hits = np.zeros((len(self), len(faces)), dtype=bool)
        for position, face in enumerate(faces):
            self._mark_circuits(face, hits[:, position])
        # One bit for each given face, so that every face hands all its bits on at once.
        bits = np.packbits(hits, axis=1)
        for size, facets in self.boundaries.items():
            for column in facets.T:
                bits[self.part(size)] |= bits[column]
        return np.packbits(np.unpackbits(bits, axis=1, count=len(faces)).T, axis=1)

    def _mark_circuits(self, face: int, hits: NDArray[np.bool_]) -> None:
        """Mark the faces that are one part of a circuit whose other part lies in the given one."""
        subfaces = self.subfaces(face)
        sizes = self.sizes[subfaces]
        for size in range(1, int(sizes[-1]) + 1):
            rows = subfaces[sizes == size] - self.starts[size - 1]
            part = self.part(self.chirotope.dimension + 2 - size)
            found = np.bitwise_or.reduce(self._crossing_pairs(size)[rows], axis=0)
            hits[part] |= np.unpackbits(found, count=part.stop - part.start).view(np.bool_)
        if self._partners:
            for subface in subfaces.tolist():
                hits[self._partners.get(subface, [])] = True

    def _crossing_pairs(self, size: int) -> NDArray[np.uint8]:
        """Return the pairs of crossing faces with `size` and d + 2 - size vertices that span the space, as bits."""
        if size not in self._pairs:
            smaller = min(size, self.chirotope.dimension + 2 - size)
            pairs = self._crossing_table.between_faces(smaller)
            self._pairs[smaller] = np.packbits(pairs, axis=1)
            self._pairs[self.chirotope.dimension + 2 - smaller] = np.packbits(pairs.T, axis=1)
        return self._pairs[size]

    @cached_property
    def _partners(self) -> dict[int, list[int]]:
        """For each face that is one part of a small circuit, the other parts."""
        found: dict[int, list[int]] = {}
        for plus, minus in small_circuits(self.chirotope):
            one, other = self.number(plus), self.number(minus)
            if one is not None and other is not None:
                found.setdefault(one, []).append(other)
                found.setdefault(other, []).append(one)
        return found

"""The star of a (d-2)-face, seen along the face: wedges between directions in a plane.

Project along a (d-2)-simplex e (a vertex in the plane, an edge in space). The d-simplices ``e + {a, b}``
become wedges of less than half a turn between the directions of a and b, that is, arcs from a to b where b is
counter-clockwise of a. The directions themselves are the (d-1)-faces ``e + {a}``. All signs come from the
chirotope.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope
from bcut.geometry.hull import lie_on_hull
from bcut.geometry.subsets import all_subsets, ranks


@dataclass(frozen=True, eq=False)
class Star:
    """One face and the wedges around it.

    Nodes are numbered counter-clockwise from an arbitrary first direction; nodes of equal `level` are points
    in the same direction.

    Attributes
    ----------
    face : ndarray of int, shape (d - 1,)
        Ascending vertices.
    columns : ndarray of int, shape (w,)
        The simplex of each wedge.
    tails, heads : ndarray of int, shape (w,)
        Nodes; each wedge turns counter-clockwise from its tail to its head.
    levels : ndarray of int, shape (nodes,)
        Ascending numbers of the directions, from 0.
    points : ndarray of int, shape (nodes,)
        The point of each node.
    """

    face: NDArray[np.int64]
    columns: NDArray[np.int64]
    tails: NDArray[np.int64]
    heads: NDArray[np.int64]
    levels: NDArray[np.int64]
    points: NDArray[np.int64]

    @property
    def size(self) -> int:
        """Number of nodes."""
        return len(self.points)

    @property
    def turn(self) -> int:
        """Number of directions."""
        return int(self.levels[-1]) + 1

    @cached_property
    def wraps(self) -> NDArray[np.bool_]:
        """Whether each wedge contains the direction just before the first node, shape (w,)."""
        return self.heads < self.tails

    @cached_property
    def spans(self) -> NDArray[np.int64]:
        """How many directions each wedge turns by, shape (w,)."""
        return (self.levels[self.heads] - self.levels[self.tails]) % self.turn

    @cached_property
    def over(self) -> NDArray[np.bool_]:
        """Which wedges contain the generic direction just before each level, shape (turn, w)."""
        behind = np.arange(self.turn)[:, None] - self.levels[self.tails] - 1
        return behind % self.turn < self.spans


class Stars:
    """The stars of all interior (d-2)-faces of some simplices.

    Parameters
    ----------
    chirotope : Chirotope
    simplices : ndarray of int, shape (m, d + 1)
        Ascending vertices.
    around : ndarray of int, shape (d - 1,), optional
        Only the star of this face; all when left out.

    Attributes
    ----------
    faces : ndarray of int64, shape (f, d - 1)
        The interior faces (in no facet of the convex hull) that some simplex contains.
    starts : ndarray of int, shape (f + 1,)
        Where the wedges of each face begin in the arrays below.
    face_of, columns, tails, heads : ndarray of int, shape (wedges,)
        The face and the simplex of each wedge, and the points it turns from and to.
    """

    def __init__(
        self,
        chirotope: Chirotope,
        simplices: NDArray[np.int64],
        *,
        around: NDArray[np.integer] | None = None,
    ) -> None:
        self.chirotope = chirotope
        d = chirotope.dimension
        orientations = chirotope.orientations(simplices)
        face_ranks, tails, heads = [], [], []
        for i, j in combinations(range(d + 1), 2):
            rest = [k for k in range(d + 1) if k not in (i, j)]
            face_ranks.append(ranks(simplices[:, rest], chirotope.n))
            # Moving i and then j behind the others takes (d - 1 - i) + (d - j) transpositions.
            turns_left = (orientations > 0) ^ bool((d - 1 - i + d - j) & 1)
            tails.append(np.where(turns_left, simplices[:, i], simplices[:, j]))
            heads.append(np.where(turns_left, simplices[:, j], simplices[:, i]))
        wedge_faces = np.concatenate(face_ranks)
        order = np.argsort(wedge_faces, kind="stable")
        if around is not None:
            order = order[wedge_faces[order] == ranks(np.asarray(around)[None, :], chirotope.n)]
        used, first = np.unique(wedge_faces[order], return_index=True)
        faces = all_subsets(chirotope.n, d - 1)[used]
        interior = ~lie_on_hull(faces, chirotope.hull_facets, chirotope.n)
        lengths = np.diff(np.append(first, len(order)))
        order = order[np.repeat(interior, lengths)]
        used, lengths, self.faces = used[interior], lengths[interior], faces[interior]
        self.starts = np.concatenate(([0], np.cumsum(lengths)))
        self.columns = np.tile(np.arange(len(simplices)), len(tails))[order]
        self.tails = np.concatenate(tails)[order]
        self.heads = np.concatenate(heads)[order]
        self.face_of = np.repeat(np.arange(len(used)), np.diff(self.starts))
        self._known: dict[int, Star] = {}

    def star(self, number: int) -> Star:
        """Return the star of ``faces[number]``; the angular order is computed once."""
        if number not in self._known:
            part = slice(self.starts[number], self.starts[number + 1])
            points, levels = self._angular_order(self.faces[number], part)
            place = np.full(self.chirotope.n, -1, dtype=np.int64)
            place[points] = np.arange(len(points))
            self._known[number] = Star(
                self.faces[number],
                self.columns[part],
                place[self.tails[part]],
                place[self.heads[part]],
                levels,
                points,
            )
        return self._known[number]

    def _angular_order(
        self, face: NDArray[np.int64], part: slice
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Sort the points of some wedges counter-clockwise around a face; equal directions get equal levels."""
        points = np.unique(np.concatenate((self.tails[part], self.heads[part])))
        turns = self._turns(face, points)
        # Directions in the half turn from the first point on, then the others.
        reference = turns[0]
        witness = int(np.flatnonzero(reference)[0])
        same = (reference == 0) & (turns[:, witness] == reference[witness])
        first_half = (reference > 0) | same
        # Within half a turn, the number of points clockwise of a point orders it.
        key = np.empty(len(points), dtype=np.int64)
        for half, offset in ((first_half, 0), (~first_half, len(points))):
            members = np.flatnonzero(half)
            key[members] = offset + (turns[np.ix_(members, members)] > 0).sum(axis=0)
        order = np.argsort(key, kind="stable")
        levels = np.unique(key, return_inverse=True)[1]
        return points[order], levels[order]

    def _turns(self, face: NDArray[np.int64], points: NDArray[np.int64]) -> NDArray[np.int8]:
        """Return the orientations of face + (a, b) for all pairs of points, shape (len(points), len(points))."""
        rows, columns = np.triu_indices(len(points), 1)
        table = np.zeros((len(points), len(points)), dtype=np.int8)
        table[rows, columns] = self.turns(
            np.broadcast_to(face, (len(rows), len(face))), points[rows], points[columns]
        )
        table[columns, rows] = -table[rows, columns]
        return table

    def turns(
        self, faces: NDArray[np.int64], first: NDArray[np.int64], second: NDArray[np.int64]
    ) -> NDArray[np.int8]:
        """Tell how one turns around a face from one point to another, the short way.

        Parameters
        ----------
        faces : ndarray of int, shape (k, d - 1)
        first, second : ndarray of int, shape (k,)
            Points that are no vertices of the face.

        Returns
        -------
        ndarray of int8, shape (k,)
            1 for counter-clockwise, -1 for clockwise, 0 where both directions are equal or opposite.
        """
        tuples = np.concatenate((faces, first[:, None], second[:, None]), axis=1)
        # The face ascends, so inversions are vertices of it behind a point, and the two points themselves.
        inversions = (
            (faces > first[:, None]).sum(axis=1) + (faces > second[:, None]).sum(axis=1) + (first > second)
        )
        signs = np.where(inversions & 1, -1, 1).astype(np.int8)
        different = first != second
        signs[~different] = 0
        signs[different] *= self.chirotope.orientations(np.sort(tuples[different], axis=1))
        return signs

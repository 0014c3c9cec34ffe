"""Enough generic points to know every chamber by.

A chamber is a cell that the (d-1)-simplices of a configuration cut its hull into (the paper, Sec. 2.3), and
its row says that the chosen simplices that contain it have the value 1 together. There may be very many
chambers, but few generic points are enough: the rows of all chambers are combinations of the rows of the
generic points listed here, with the same right-hand side, so that a vector x which satisfies these satisfies
all.

Theorem. Let S(B) be the following flags of a configuration B of dimension k: one affine basis of B in some
order; and for every hyperplane G spanned by points of B, with points of B strictly on both sides, and every
flag (v_0, ..., v_{k-1}) in S(B n G), the two flags (v_0, ..., v_{k-1}, a) with a on the one and on the other
side. Then the incidence vector (which k-simplices contain it) of every chamber of B is a combination of
those of the generic points of the flags in S(B) with coefficients of sum 1.

Proof, by induction on k. Two generic points can be joined by a path inside the hull that leaves one chamber
for another at points w only that lie on one spanned hyperplane G each, are generic in G, and have the hull
on both sides. There, simplices are entered or left exactly if they have a facet F in G that contains w: the
incidence vector changes by the sum over these F of the row

    c_F = (the simplices F + a with a on the + side) - (those with a on the - side).

This is the image of the incidence vector of w among the (k-1)-simplices of B n G under the linear map that
takes F to c_F. By induction that vector is a combination with sum 1 of those of flags f in S(B n G). The
generic point of a flag f of G lies on no spanned hyperplane except G: it is next to v_0, in the direction of
v_1, and so on, so a hyperplane through it contains all of f. Hence the points (f, a) on both sides of it differ
by the image of its incidence vector. So walking from the first flag's point to any chamber adds combinations
of differences of two flags of S(B) each. (In dimension 0 there is one point and one flag.)  QED

In general position B n G is a simplex, and there are at most 1 + 2 C(n, d) flags.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope

Flag = tuple[int, ...]


def chamber_flags(chirotope: Chirotope) -> NDArray[np.int64]:
    """Return the flags of the theorem above.

    Parameters
    ----------
    chirotope : Chirotope

    Returns
    -------
    ndarray of int64, shape (k, d + 1)
        Ordered, affinely independent tuples for
        `bcut.geometry.generic_point.simplices_containing_generic_point`.
    """
    flats = _Flats(chirotope)
    found = [tuple(chirotope.bases[0].tolist())]
    seen: set[bytes] = set()
    interior = chirotope.sides[chirotope.facet_is_interior]
    for sides in interior:
        key = (sides == 0).tobytes()
        if key in seen:
            continue
        seen.add(key)
        above, below = int(np.flatnonzero(sides > 0)[0]), int(np.flatnonzero(sides < 0)[0])
        inner = flats.flags(tuple(np.flatnonzero(sides == 0).tolist()), (above,))
        found += [(*flag, apex) for flag in inner for apex in (above, below)]
    return np.array(found, dtype=np.int64)


class _Flats:
    """Flags of the points in a flat; signs within it come from points that extend it to all of space."""

    def __init__(self, chirotope: Chirotope) -> None:
        self.chirotope = chirotope
        self._known: dict[Flag, list[Flag]] = {}

    def flags(self, points: Flag, beyond: Flag) -> list[Flag]:
        """Return S(points), where `beyond` extends the flat to all of space."""
        dimension = self.chirotope.dimension - len(beyond)
        if len(points) == dimension + 1:
            return [points]
        if points not in self._known:
            self._known[points] = self._flags(points, beyond, dimension)
        return self._known[points]

    def _flags(self, points: Flag, beyond: Flag, dimension: int) -> list[Flag]:
        # Of all bases the first one found will do.
        found = [next(b for b in combinations(points, dimension + 1) if self._sign((*b, *beyond)))]
        seen: set[Flag] = set()
        for facet in combinations(points, dimension):
            signs = {p: self._sign((*facet, p, *beyond)) for p in points}
            on_plane = tuple(p for p in points if not signs[p])
            above = [p for p in points if signs[p] > 0]
            below = [p for p in points if signs[p] < 0]
            if not (above and below) or on_plane in seen:
                continue
            seen.add(on_plane)
            inner = self.flags(on_plane, (above[0], *beyond))
            found += [(*flag, apex) for flag in inner for apex in (above[0], below[0])]
        return found

    def _sign(self, points: Flag) -> int:
        if len(set(points)) < len(points):
            return 0
        inversions = sum(a > b for i, a in enumerate(points) for b in points[i + 1 :])
        sign = int(self.chirotope.orientations(np.array(sorted(points))))
        return -sign if inversions & 1 else sign

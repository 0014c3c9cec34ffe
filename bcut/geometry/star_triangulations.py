"""The triangulations of the star of a (d-3)-face: small spherical triangulations, searched for the lightest one.

Seen from a (d-3)-simplex F (a vertex in space), the d-simplices that contain F are spherical triangles. Those of a
triangulation that uses F fit together edge to edge and cover, exactly once, the sphere or, where F lies on the hull's
boundary, the region of it that the hull takes up. The edges are the (d-1)-simplices that contain F; across those that
lie in no facet of the hull, the triangulation goes on.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope
from bcut.geometry.subsets import ranks, without

#: A weight, and the simplices that have it together, as positions.
Found = tuple[float, tuple[int, ...]]


class SearchLimitError(Exception):
    """A search took more steps than it was allowed."""


class StarTriangulations:
    """Searches triangulations of the star of a face that consist of given simplices.

    Parameters
    ----------
    chirotope : Chirotope
    face : ndarray of int, shape (d - 2,)
        F.
    simplices : ndarray of int, shape (k, d + 1)
        Ascending vertices; all of them contain F.
    crossings : ndarray of bool, shape (k, k)
        Which of them cross, so that no triangulation has both.
    """

    def __init__(
        self,
        chirotope: Chirotope,
        face: NDArray[np.integer],
        simplices: NDArray[np.int64],
        crossings: NDArray[np.bool_],
    ) -> None:
        self.size = len(simplices)
        self.everything = (1 << self.size) - 1
        members: dict[tuple[int, bool], int] = {}
        sides: list[list[tuple[int, bool]]] = [[] for _ in range(self.size)]
        for position in range(simplices.shape[1]):
            opposite = np.flatnonzero((simplices[:, position, None] != face).all(axis=1))
            numbers = ranks(without(simplices[opposite], position), chirotope.n)
            above = chirotope.sides[numbers, simplices[opposite, position]] > 0
            inside = chirotope.facet_is_interior[numbers]
            for simplex, ridge, side in zip(
                opposite[inside].tolist(), numbers[inside].tolist(), above[inside].tolist(), strict=True
            ):
                members[ridge, side] = members.get((ridge, side), 0) | 1 << simplex
                sides[simplex].append((ridge, side))
        # Each ridge of each simplex, with the simplices that can be its neighbour there.
        self._neighbours = [
            [(ridge, members.get((ridge, not side), 0)) for ridge, side in own] for own in sides
        ]
        self._compatible = []
        for simplex, row in enumerate(crossings):
            packed = int.from_bytes(np.packbits(row, bitorder="little").tobytes(), "little")
            # Two on one side of a ridge overlap.
            same = [members[key] for key in sides[simplex]]
            for mask in same:
                packed |= mask
            self._compatible.append(self.everything & ~(packed | 1 << simplex))

    def lightest(
        self,
        weights: Sequence[float],
        below: float,
        start: Iterable[int],
        *,
        among: int | None = None,
        steps: int = 20_000,
        enough: int = 0,
    ) -> list[Found]:
        """Return lighter and lighter triangulations of the star, down to the lightest.

        Parameters
        ----------
        weights : sequence of int or float, shape (k,)
            Not negative. With integers the result is exact.
        below : float
            Only triangulations lighter than this are of interest.
        start : iterable of int
            Simplices of which each triangulation in question has exactly one, such as those that contain a
            generic direction.
        among : int, optional
            The simplices to use, as a bit set; all, when left out.
        steps : int
            At most this many partial triangulations are looked at.
        enough : int
            Stop after this many, with or without the lightest; 0 for no such limit.

        Returns
        -------
        list of Found
            Each lighter than the one before; empty if none is light enough.

        Raises
        ------
        SearchLimitError
            After that many steps.
        """
        found: list[Found] = []
        best = below
        neighbours, compatible = self._neighbours, self._compatible

        def extend(available: int, gaps: dict[int, int], weight: float, chosen: tuple[int, ...]) -> bool:
            """Close the gap with the fewest choices; tell whether enough has been found."""
            nonlocal best, steps
            steps -= 1
            if steps < 0:
                raise SearchLimitError
            if not gaps:
                best = weight
                found.append((weight, chosen))
                return len(found) == enough
            choices, fewest = 0, self.size + 1
            for mask in gaps.values():
                fitting = mask & available
                count = fitting.bit_count()
                if count < fewest:
                    choices, fewest = fitting, count
                    if count == 0:
                        return False
            return branch(_members(choices), available, gaps, weight, chosen)

        def branch(
            choices: list[int], available: int, gaps: dict[int, int], weight: float, chosen: tuple[int, ...]
        ) -> bool:
            if len(choices) > 1:
                choices.sort(key=weights.__getitem__)
            for simplex in choices:
                heavier = weight + weights[simplex]
                if heavier >= best:
                    return False
                left = dict(gaps)
                for ridge, fitting in neighbours[simplex]:
                    # Next to a gap the simplex closes it, as others that touch its ridge cross what is there.
                    if left.pop(ridge, None) is None:
                        left[ridge] = fitting
                if extend(available & compatible[simplex], left, heavier, (*chosen, simplex)):
                    return True
            return False

        branch(list(start), self.everything if among is None else among, {}, 0, ())
        return found


def _members(mask: int) -> list[int]:
    """List the bits of a set."""
    members = []
    while mask:
        low = mask & -mask
        members.append(low.bit_length() - 1)
        mask ^= low
    return members

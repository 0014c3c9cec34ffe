"""All triangulations of a small configuration, one by one.

A search over exact covers: choose the simplex over a generic point, then again and again a (d-1)-simplex that
is covered on one side only, and each simplex that fits on its other side. Every triangulation is found
exactly once, because at each step exactly one of the alternatives is in it; and nothing else is found,
because chosen simplices never cross.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chirotope import Chirotope
from bcut.geometry.crossings import crossing_matrix
from bcut.geometry.generic_point import simplices_containing_generic_point
from bcut.geometry.simplices import candidate_simplices
from bcut.geometry.subsets import ranks, without


def triangulations(chirotope: Chirotope, *, spanning: bool = False) -> Iterator[tuple[int, ...]]:
    """Yield every triangulation of a configuration.

    Parameters
    ----------
    chirotope : Chirotope
        Of the point configuration. Memory grows with the square of the number of candidate simplices, time
        with the number of triangulations: meant for small ones.
    spanning : bool
        Only triangulations that use every point.

    Yields
    ------
    tuple of int
        Ascending rows of ``candidate_simplices(chirotope, spanning=spanning)``.
    """
    search = _Search(chirotope, candidate_simplices(chirotope, spanning=spanning))
    yield from search.run()


def count_by_size(chirotope: Chirotope, *, spanning: bool = False) -> dict[int, int]:
    """Count the triangulations by their number of simplices."""
    counts: dict[int, int] = {}
    for triangulation in triangulations(chirotope, spanning=spanning):
        counts[len(triangulation)] = counts.get(len(triangulation), 0) + 1
    return dict(sorted(counts.items()))


class _Search:
    """Sets of simplices and of half-facets are bit masks in Python integers.

    A half-facet is an interior (d-1)-simplex together with one of its sides: number 2f or 2f + 1.
    """

    def __init__(self, chirotope: Chirotope, simplices: NDArray[np.int64]) -> None:
        count = len(simplices)
        self.compatible = _masks(~crossing_matrix(chirotope, simplices))
        start = simplices_containing_generic_point(chirotope, simplices, chirotope.bases[0])
        self.start = _mask(start)
        # For each simplex: its interior half-facets (mask over half-facets).
        self.half_facets: list[list[int]] = [[] for _ in range(count)]
        self.candidates: dict[int, int] = {}
        for position in range(simplices.shape[1]):
            facet_ranks = ranks(without(simplices, position), chirotope.n)
            interior = chirotope.facet_is_interior[facet_ranks]
            above = chirotope.sides[facet_ranks, simplices[:, position]] > 0
            for simplex in np.flatnonzero(interior).tolist():
                half = 2 * int(facet_ranks[simplex]) + int(above[simplex])
                self.half_facets[simplex].append(half)
                self.candidates[half] = self.candidates.get(half, 0) | 1 << simplex

    def run(self) -> Iterator[tuple[int, ...]]:
        """Search depth first with an explicit stack: (chosen, still allowed, open half-facets)."""
        everything = (1 << len(self.compatible)) - 1
        stack = [(choice, *self._extend(frozenset(), everything, choice)) for choice in _bits(self.start)]
        chosen: list[int] = []
        depth_of = [0] * len(stack)
        while stack:
            simplex, allowed, opened = stack.pop()
            depth = depth_of.pop()
            del chosen[depth:]
            chosen.append(simplex)
            if not opened:
                yield tuple(sorted(chosen))
                continue
            for choice in _bits(self._fewest_choices(allowed, opened)):
                stack.append((choice, *self._extend(opened, allowed, choice)))
                depth_of.append(depth + 1)

    def _extend(self, opened: frozenset[int], allowed: int, simplex: int) -> tuple[int, frozenset[int]]:
        """Choose a simplex: what stays allowed, and which half-facets now wait for a partner."""
        # A half-facet that the simplex covers was waiting, or else its other half waits from now on.
        covered = self.half_facets[simplex]
        waiting = {half ^ 1 for half in covered if half not in opened}
        return allowed & self.compatible[simplex] & ~(1 << simplex), opened.difference(covered) | waiting

    def _fewest_choices(self, allowed: int, opened: frozenset[int]) -> int:
        """Return the choices at the open half-facet that has fewest; 0 where one has none."""
        best, fewest = 0, None
        for half in opened:
            choices = self.candidates.get(half, 0) & allowed
            number = choices.bit_count()
            if fewest is None or number < fewest:
                best, fewest = choices, number
                if number == 0:
                    break
        return best


def _mask(flags: NDArray[np.bool_]) -> int:
    return int.from_bytes(np.packbits(flags, bitorder="little").tobytes(), "little")


def _masks(table: NDArray[np.bool_]) -> list[int]:
    return [_mask(row) for row in table]


def _bits(mask: int) -> Iterator[int]:
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low

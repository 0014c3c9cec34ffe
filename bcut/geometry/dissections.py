"""All dissections of a small configuration, one by one.

A dissection covers the convex hull by d-simplices without common interior points, which need not meet in common faces:
a set of simplices is one exactly when every chamber is in exactly one of them. By the theorem of
`bcut.geometry.chamber_flags` it is enough that each generic point there is. So dissections are the exact covers of
these points, and a search finds each of them once: choose a point that is not covered, then every simplex over it that
overlaps none of those chosen before.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.chamber_flags import chamber_flags
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.generic_point import simplices_containing_generic_point
from bcut.geometry.overlaps import overlap_matrix
from bcut.geometry.simplices import candidate_simplices


def dissections(chirotope: Chirotope, *, spanning: bool = False) -> Iterator[tuple[int, ...]]:
    """Yield every dissection of a configuration, triangulations among them.

    Parameters
    ----------
    chirotope : Chirotope
        Of the point configuration. In degenerate position there are many times more dissections than
        triangulations: meant for very small ones.
    spanning : bool
        Only dissections into empty simplices.

    Yields
    ------
    tuple of int
        Ascending rows of ``candidate_simplices(chirotope, spanning=spanning)``.
    """
    simplices = candidate_simplices(chirotope, spanning=spanning)
    flags = chamber_flags(chirotope)
    rows = [simplices_containing_generic_point(chirotope, simplices, flag) for flag in flags]
    over = np.unique(np.array(rows, dtype=bool), axis=0)
    apart = ~overlap_matrix(chirotope, simplices)

    def search(
        chosen: list[int], points: NDArray[np.bool_], allowed: NDArray[np.bool_]
    ) -> Iterator[list[int]]:
        """Complete some simplices, given the points that they leave uncovered and what overlaps none of them."""
        if not len(points):
            yield chosen
            return
        choices = points & allowed
        # The point with fewest choices; where one has none, there is nothing to complete.
        hardest = choices[choices.sum(axis=1).argmin()]
        for simplex in np.flatnonzero(hardest).tolist():
            uncovered = points[~points[:, simplex]]
            yield from search([*chosen, simplex], uncovered, allowed & apart[simplex])

    for found in search([], over, np.ones(len(simplices), dtype=bool)):
        yield tuple(sorted(found))

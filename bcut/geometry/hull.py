"""What the facets of the convex hull, as lists of points, tell about points and simplices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def incidence(hull_facets: Sequence[Sequence[int]], n: int) -> NDArray[np.bool_]:
    """Return which point lies on which facet, shape (facets, n)."""
    member = np.zeros((len(hull_facets), n), dtype=bool)
    for row, facet in zip(member, hull_facets, strict=True):
        row[list(facet)] = True
    return member


def vertices_of_hull(hull_facets: Sequence[Sequence[int]], n: int) -> list[int]:
    """Return the vertices of the hull: each is the only point on all the facets that it lies on."""
    member = incidence(hull_facets, n)
    # Entry (p, q): the facets of p that do not contain q.
    missing = member.T.astype(np.int64) @ ~member
    return np.flatnonzero(((missing == 0).sum(axis=1) == 1) & member.any(axis=0)).tolist()


def lie_on_hull(sets: NDArray[np.integer], hull_facets: Sequence[Sequence[int]], n: int) -> NDArray[np.bool_]:
    """Tell which point sets, shape (m, k), lie in a common facet of the hull."""
    found = np.zeros(len(sets), dtype=bool)
    for row in incidence(hull_facets, n):
        found |= row[sets].all(axis=1)
    return found

"""Formulation 2 on some of the simplices, where all of them together are too many for a table.

Rows exist for the interior (d-1)-simplices that one of the given simplices has as a facet; the others are 0 =
0. The orientation of a simplex tells on which side of each of its facets it lies, so no other signs are
needed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bcut.formulations.formulation import Formulation
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.determinants import orientation_signs
from bcut.geometry.hull import lie_on_hull, vertices_of_hull
from bcut.geometry.partial_chirotope import PartialChirotope
from bcut.geometry.rank import pivot_columns
from bcut.geometry.subsets import ranks, without


def partial_cocircuit_formulation(
    configuration: PointConfiguration,
    simplices: NDArray[np.int64],
    hull_facets: tuple[tuple[int, ...], ...],
    *,
    spanning: bool = False,
) -> Formulation:
    """Build Formulation 2 on some simplices.

    Parameters
    ----------
    configuration : PointConfiguration
    simplices : ndarray of int64, shape (m, d + 1)
        Affinely independent, ascending vertices, in colexicographic order.
    hull_facets : tuple of tuple of int
        All points on each facet of the convex hull.
    spanning : bool
        Whether the simplices are empty ones; recorded only.

    Returns
    -------
    Formulation
        As from `bcut.formulations.cocircuits.cocircuit_formulation`, restricted to these columns, except that
        the coverage row may be about another generic point.
    """
    import scipy.sparse as sp

    n, d = configuration.n, configuration.dimension
    orientations = orientation_signs(configuration, simplices)
    covering = _covering(configuration, simplices, vertices_of_hull(hull_facets, n)[0])
    columns, facets = [np.flatnonzero(covering)], [np.full(int(covering.sum()), -1, dtype=np.int64)]
    values = [np.ones(len(columns[0]), dtype=np.int8)]
    for position in range(d + 1):
        opposite = without(simplices, position)
        interior = np.flatnonzero(~lie_on_hull(opposite, hull_facets, n))
        columns.append(interior)
        facets.append(ranks(opposite[interior], n))
        # Moving the vertex behind the others takes d - position transpositions.
        values.append(-orientations[interior] if (d - position) & 1 else orientations[interior])
    numbers = np.concatenate(facets)
    used, first, rows = np.unique(numbers, return_index=True, return_inverse=True)
    if not len(columns[0]):
        # Nothing covers the generic point: the row stays, and nothing can satisfy it.
        used, rows = np.concatenate(([-1], used)), rows + 1
        first = np.concatenate(([0], first))
    entries = (np.concatenate(values), (rows.reshape(-1), np.concatenate(columns)))
    matrix = sp.csr_matrix(entries, shape=(len(used), len(simplices)), dtype=np.int8)
    matrix.sort_indices()
    starts = np.cumsum([len(part) for part in columns])
    position_of = np.searchsorted(starts, first[1:], side="right") - 1
    faces = _faces(simplices, np.concatenate(columns)[first[1:]], position_of)
    right = np.zeros(len(used), dtype=np.int64)
    right[0] = 1
    return Formulation(
        name="2",
        configuration=configuration,
        chirotope=PartialChirotope(configuration, hull_facets),
        simplices=simplices,
        spanning=spanning,
        matrix=matrix,
        lower=right,
        upper=right.copy(),
        row_faces=(None, *map(tuple, faces.tolist())),
    )


def _faces(
    simplices: NDArray[np.int64], columns: NDArray[np.int64], positions: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the facet opposite to a position of each of some simplices."""
    rows = simplices[columns]
    keep = np.ones(rows.shape, dtype=bool)
    keep[np.arange(len(rows)), positions] = False
    return rows[keep].reshape(len(rows), -1 if len(rows) else simplices.shape[1] - 1)


def _covering(
    configuration: PointConfiguration, simplices: NDArray[np.int64], vertex: int
) -> NDArray[np.bool_]:
    """Tell which simplices contain a generic point next to a vertex of the hull.

    The point is ``v_0 + e (v_1 - v_0) + e^2 (v_2 - v_0) + ...`` as in `bcut.geometry.generic_point`. As v_0
    is a vertex of the hull, only simplices with that vertex come so close to it, and the facets opposite to
    it are far away.
    """
    order = [vertex, *(p for p in range(configuration.n) if p != vertex)]
    points = configuration.scalars()
    origin = points[vertex]
    rows = [[points[p][j] - origin[j] for p in order[1:]] for j in range(configuration.dimension)]
    flag = [order[1 + column] for column in pivot_columns(rows)]
    covering = (simplices == vertex).any(axis=1)
    for position in range(simplices.shape[1]):
        candidates = np.flatnonzero(covering)
        candidates = candidates[simplices[candidates, position] != vertex]
        own = orientation_signs(configuration, simplices[candidates])
        undecided = np.arange(len(candidates))
        for point in flag:
            tuples = simplices[candidates[undecided]].copy()
            tuples[:, position] = point
            # A repeated point makes a flat simplex: orientation zero, as it should be.
            side = orientation_signs(configuration, tuples)
            covering[candidates[undecided[side == -own[undecided]]]] = False
            undecided = undecided[side == 0]
    return covering

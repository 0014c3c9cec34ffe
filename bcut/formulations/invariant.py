"""Formulation 2 restricted to the triangulations that a subgroup of the symmetries maps to themselves.

The simplices of an orbit under the subgroup are chosen together, so one variable stands for all of them; rows that
are images of each other become equal. What is found is a triangulation of the configuration, but nothing is proven
about the others: a tool for finding good ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bcut.formulations.formulation import Formulation
from bcut.geometry.permutations import PermutationGroup
from bcut.geometry.subsets import ranks

if TYPE_CHECKING:
    import scipy.sparse as sp


@dataclass(frozen=True, eq=False)
class InvariantProgram:
    """A formulation whose variables stand for orbits of the simplices of another one.

    Attributes
    ----------
    formulation : Formulation
        Its `simplices` are one of each orbit; each row is one of an orbit of rows.
    lengths : ndarray of int64, shape (orbits,)
        How many simplices each variable stands for: its cost is that of one of them times this.
    orbit_of : ndarray of int64, shape (m,)
        The variable of each simplex of the original formulation.
    """

    formulation: Formulation
    lengths: NDArray[np.int64]
    orbit_of: NDArray[np.int64]

    @property
    def representatives(self) -> NDArray[np.intp]:
        """A column of the original formulation for each variable."""
        return np.unique(self.orbit_of, return_index=True)[1]

    def expanded(self, columns: NDArray[np.integer]) -> NDArray[np.intp]:
        """Return the columns of the original formulation that a choice of variables stands for."""
        return np.flatnonzero(np.isin(self.orbit_of, columns))


def invariant_program(formulation: Formulation, subgroup: PermutationGroup) -> InvariantProgram:
    """Identify the variables that a subgroup maps to each other.

    Parameters
    ----------
    formulation : Formulation
        Its columns must be closed under the subgroup, such as whole orbits under a larger group.
    subgroup : PermutationGroup
        Of affine symmetries of the configuration.
    """
    import scipy.sparse as sp

    n = formulation.configuration.n
    columns = len(formulation.simplices)
    orbit_of = set_orbits(formulation.simplices, subgroup, n)
    count = int(orbit_of.max(initial=-1)) + 1
    gather = sp.csr_matrix(
        (np.ones(columns, dtype=np.int32), (np.arange(columns), orbit_of)), shape=(columns, count)
    )
    faces = np.array(formulation.row_faces[1:], dtype=np.int64).reshape(-1, formulation.chirotope.dimension)
    row_orbit = set_orbits(faces, subgroup, n)
    rows = np.concatenate(([0], 1 + np.unique(row_orbit, return_index=True)[1])).astype(np.int64)
    matrix = (formulation.matrix[rows].astype(np.int32) @ gather).tocsr()
    matrix.eliminate_zeros()
    matrix.sort_indices()
    rows, matrix = _without_empty(rows, matrix)
    lengths = np.bincount(orbit_of, minlength=count)
    representatives = np.unique(orbit_of, return_index=True)[1]
    return InvariantProgram(
        Formulation(
            name=formulation.name,
            configuration=formulation.configuration,
            chirotope=formulation.chirotope,
            simplices=formulation.simplices[representatives],
            spanning=formulation.spanning,
            matrix=matrix,
            lower=formulation.lower[rows],
            upper=formulation.upper[rows],
            row_faces=tuple(formulation.row_faces[row] for row in rows.tolist()),
        ),
        lengths,
        orbit_of,
    )


def set_orbits(sets: NDArray[np.int64], group: PermutationGroup, n: int) -> NDArray[np.int64]:
    """Give numbers to the orbits of some sets of points, in the order of their first members.

    Parameters
    ----------
    sets : ndarray of int64, shape (m, k)
        Ascending rows.
    group : PermutationGroup
        Images that are not in the list are ignored.
    n : int
        Number of points.

    Returns
    -------
    ndarray of int64, shape (m,)
    """
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    count = len(sets)
    known = ranks(sets, n)
    order = np.argsort(known)
    known = known[order]
    ends: list[NDArray[np.integer]] = [np.empty((2, 0), dtype=np.int64)]
    for generator in group.generators:
        images = ranks(np.sort(generator[sets].astype(np.int64), axis=1), n)
        place = np.minimum(np.searchsorted(known, images), count - 1)
        found = np.flatnonzero(known[place] == images)
        ends.append(np.stack((found, order[place[found]])))
    tails, heads = np.concatenate(ends, axis=1)
    graph = sp.csr_matrix((np.ones(len(tails), dtype=np.int8), (tails, heads)), shape=(count, count))
    labels = connected_components(graph, directed=False)[1]
    # Numbered in the order of their first members, so that the result does not depend on the search.
    _, first, numbers = np.unique(labels, return_index=True, return_inverse=True)
    place_of = np.empty(len(first), dtype=np.int64)
    place_of[np.argsort(first)] = np.arange(len(first))
    return place_of[numbers.reshape(-1)]


def _without_empty(rows: NDArray[np.int64], matrix: sp.csr_matrix) -> tuple[NDArray[np.int64], sp.csr_matrix]:
    """Drop cocircuit rows without entries."""
    kept = np.flatnonzero((np.diff(matrix.indptr) > 0) | (rows == 0))
    return rows[kept], matrix[kept]

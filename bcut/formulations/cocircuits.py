"""Formulation 2 (the paper, Sec. 2.3.1): cocircuit rows and one coverage row.

For every (d-1)-simplex f that lies in no facet of the convex hull, the chosen simplices on its two sides are
equal in number: ``sum of x_t over t = f + a, a on the + side, minus the same on the - side, = 0``. These rows
make the number of chosen simplices over a generic point constant; one more row, "exactly one chosen simplex
contains this generic point", makes it 1. The integer points are exactly the triangulations, for every
configuration (De Loera, Hosten, Santos, Sturmfels 1996).

The paper writes rows with right-hand side 1 for the (d-1)-simplices on the boundary instead. That is the same
where every facet of the hull is a simplex, and wrong elsewhere: a square facet of a cube has four triangles,
of which a triangulation contains two. Hence the coverage row.
"""

from __future__ import annotations

import numpy as np

from bcut.formulations.formulation import Formulation
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.generic_point import simplices_containing_generic_point
from bcut.geometry.simplices import candidate_simplices
from bcut.geometry.subsets import ranks, without


def cocircuit_formulation(
    configuration: PointConfiguration, *, spanning: bool = False, chirotope: Chirotope | None = None
) -> Formulation:
    """Build Formulation 2.

    Parameters
    ----------
    configuration : PointConfiguration
    spanning : bool
        Only triangulations that use every point.
    chirotope : Chirotope, optional
        Of `configuration`, where it is known already.

    Returns
    -------
    Formulation
        Row 0 is the coverage row; the others are the cocircuit rows that have a nonzero entry, in
        colexicographic order of their (d-1)-simplices.
    """
    import scipy.sparse as sp

    chirotope = chirotope or Chirotope.of(configuration)
    simplices = candidate_simplices(chirotope, spanning=spanning)
    covering = simplices_containing_generic_point(chirotope, simplices, chirotope.bases[0])
    columns = [np.flatnonzero(covering)]
    facets = [np.full(len(columns[0]), -1, dtype=np.int64)]
    values = [np.ones(len(columns[0]), dtype=np.int8)]
    for position in range(simplices.shape[1]):
        facet_ranks = ranks(without(simplices, position), chirotope.n)
        interior = np.flatnonzero(chirotope.facet_is_interior[facet_ranks])
        columns.append(interior)
        facets.append(facet_ranks[interior])
        values.append(chirotope.sides[facet_ranks[interior], simplices[interior, position]])
    used, rows = np.unique(np.concatenate(facets), return_inverse=True)
    entries = (np.concatenate(values), (rows, np.concatenate(columns)))
    matrix = sp.csr_matrix(entries, shape=(len(used), len(simplices)), dtype=np.int8)
    matrix.sort_indices()
    right = np.zeros(len(used), dtype=np.int64)
    right[0] = 1
    return Formulation(
        name="2",
        configuration=configuration,
        chirotope=chirotope,
        simplices=simplices,
        spanning=spanning,
        matrix=matrix,
        lower=right,
        upper=right.copy(),
        row_faces=(None, *map(tuple, chirotope.facets[used[1:]].tolist())),
    )

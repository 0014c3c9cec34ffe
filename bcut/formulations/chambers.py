"""The set partitioning form (the paper, Sec. 2.3): every chamber is in exactly one chosen simplex.

The rows are those of the generic points of `bcut.geometry.chamber_flags`, which by the theorem there are
enough: a vector satisfies them if and only if it satisfies the rows of all chambers. In general position
neighbouring chambers differ by a cocircuit row, so the relaxation is that of Formulation 2. In degenerate
position it is larger, and the 0/1 points are all dissections; for triangulations the rows ``x_s + x_t <= 1`` of
crossing simplices that do not overlap are added, as far as a point violates them.
"""

from __future__ import annotations

import numpy as np

from bcut.formulations.formulation import Formulation
from bcut.formulations.lazy_rows import LazyRows, PairRows, chamber_incidence
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.simplices import candidate_simplices

#: Rows are called by this and the flag of their generic point, such as "chamber_0_1_4".
CHAMBER_ROW = "chamber_"


def chamber_formulation(
    configuration: PointConfiguration,
    *,
    spanning: bool = False,
    dissection: bool = False,
    chirotope: Chirotope | None = None,
) -> Formulation:
    """Build the set partitioning form.

    Parameters
    ----------
    configuration : PointConfiguration
    spanning : bool
        Only empty simplices.
    dissection : bool
        Whether all dissections are wanted, not only triangulations.
    chirotope : Chirotope, optional
        Of `configuration`, where it is known already.

    Returns
    -------
    Formulation
        One row of ones, with right-hand side 1, for each different set of simplices over one of the points.
    """
    import scipy.sparse as sp

    chirotope = chirotope or Chirotope.of(configuration)
    simplices = candidate_simplices(chirotope, spanning=spanning)
    rows, flags = chamber_incidence(chirotope, simplices)
    matrix = sp.csr_matrix(rows.astype(np.int8))
    ones = np.ones(matrix.shape[0], dtype=np.int64)
    lazy: tuple[LazyRows, ...] = ()
    if not dissection and not chirotope.is_general:
        lazy = (PairRows(chirotope, simplices, False),)
    return Formulation(
        name="chambers",
        configuration=configuration,
        chirotope=chirotope,
        simplices=simplices,
        spanning=spanning,
        matrix=matrix,
        lower=ones,
        upper=ones.copy(),
        row_faces=(None,) * len(ones),
        row_names=tuple(CHAMBER_ROW + "_".join(map(str, flag)) for flag in flags.tolist()),
        lazy=lazy,
        dissection=dissection,
    )

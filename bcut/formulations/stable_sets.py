"""Formulation 0 (the paper, Sec. 2.1): a stable set of d-simplices whose volumes add up to the hull's.

``x_s + x_t <= 1`` for every pair of simplices that exclude each other, and the volume row. In degenerate
position there are two relations. Simplices that *cross* (do not meet in a common face) are in no triangulation
together; those of them that *overlap* (have a common interior point) are in no dissection together either. In
general position they are the same.

The pairs grow like n^(2d + 2), so from some number on they are not written down; hosts ask for those that a point
violates (`bcut.formulations.lazy_rows`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bcut.formulations.formulation import UNBOUNDED, Formulation
from bcut.formulations.lazy_rows import CoverageRows, LazyRows, PairRows
from bcut.formulations.volume_rows import VolumeRows, volume_rows
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.simplices import candidate_simplices

if TYPE_CHECKING:
    import scipy.sparse as sp

# Pairs that are written down; with more, solvers spend their time on rows that do not matter.
MOST_WRITTEN = 20_000
# So many simplices have too many pairs in any case, and looking at all of them takes long.
_MOST_SIMPLICES = 3000


def stable_set_formulation(
    configuration: PointConfiguration,
    *,
    spanning: bool = False,
    dissection: bool = False,
    chirotope: Chirotope | None = None,
    lazy: bool | None = None,
) -> Formulation:
    """Build Formulation 0.

    Parameters
    ----------
    configuration : PointConfiguration
    spanning : bool
        Only empty simplices.
    dissection : bool
        Whether overlapping simplices exclude each other, instead of crossing ones.
    chirotope : Chirotope, optional
        Of `configuration`, where it is known already.
    lazy : bool, optional
        Whether pairs are left to be asked for; if left out, where they are many.

    Returns
    -------
    Formulation
        First the volume row (or two rows that enclose it), then the pairs as far as they are written.
    """
    chirotope = chirotope or Chirotope.of(configuration)
    simplices = candidate_simplices(chirotope, spanning=spanning)
    exclusive = PairRows(chirotope, simplices, dissection)
    pairs = np.empty((0, 2), dtype=np.int64)
    if lazy is None:
        lazy = len(simplices) > _MOST_SIMPLICES
        if not lazy:
            pairs = _pairs(exclusive)
            lazy = len(pairs) > MOST_WRITTEN
    elif not lazy:
        pairs = _pairs(exclusive)
    volume = volume_rows(configuration, chirotope, simplices)
    asked: list[LazyRows] = [exclusive] if lazy else []
    if not volume.exact:
        asked.append(CoverageRows(chirotope, simplices))
    if lazy:
        pairs = pairs[:0]
    return assembled(
        "0", configuration, chirotope, simplices, spanning, volume, pairs, asked, dissection=dissection
    )


def assembled(
    name: str,
    configuration: PointConfiguration,
    chirotope: Chirotope,
    simplices: NDArray[np.int64],
    spanning: bool,
    volume: VolumeRows,
    pairs: NDArray[np.int64],
    lazy: list[LazyRows],
    *,
    faces: tuple[tuple[int, ...], ...] = (),
    lattice: NDArray[np.int64] | None = None,
    dissection: bool = False,
) -> Formulation:
    """Put volume rows, lattice rows and pairs of columns together.

    Parameters
    ----------
    pairs : ndarray of int64, shape (k, 2)
        Columns that exclude each other.
    lattice : ndarray of int64, shape (l, 2), optional
        Columns (f, g) with ``x_f - x_g >= 0``.
    """
    import scipy.sparse as sp

    width = len(simplices) + len(faces)
    order = np.empty((0, 2), dtype=np.int64) if lattice is None else lattice
    top = sp.csr_matrix(volume.coefficients, shape=(len(volume.lower), width))
    matrix = sp.vstack((top, _two_entries(order, -1, width), _two_entries(pairs, 1, width)), format="csr")
    matrix.sort_indices()
    names = [f"face_{f}_of_{g}" for f, g in order.tolist()] + [f"pair_{s}_{t}" for s, t in pairs.tolist()]
    return Formulation(
        name=name,
        configuration=configuration,
        chirotope=chirotope,
        simplices=simplices,
        spanning=spanning,
        matrix=matrix.astype(np.int64),
        lower=np.concatenate((volume.lower, np.zeros(len(order)), np.full(len(pairs), -UNBOUNDED))).astype(
            np.int64
        ),
        upper=np.concatenate(
            (volume.upper, np.full(len(order), UNBOUNDED), np.ones(len(pairs), dtype=np.int64))
        ).astype(np.int64),
        row_faces=(None,) * matrix.shape[0],
        faces=faces,
        row_names=(*volume.names, *names),
        row_shifts=np.concatenate((volume.shifts, np.zeros(len(names), dtype=np.int64))),
        lazy=tuple(lazy),
        dissection=dissection,
    )


def _pairs(exclusive: PairRows) -> NDArray[np.int64]:
    """List all pairs that exclude each other, ascending."""
    related = exclusive.relation(exclusive.chirotope, exclusive.simplices, exclusive.simplices)
    return np.argwhere(np.triu(related, 1)).astype(np.int64)


def _two_entries(pairs: NDArray[np.int64], second: int, width: int) -> sp.csr_matrix:
    """Return one row for each pair, with the entries 1 and `second`."""
    import scipy.sparse as sp

    rows = np.repeat(np.arange(len(pairs)), 2)
    values = np.tile(np.array([1, second]), len(pairs))
    return sp.csr_matrix((values, (rows, pairs.reshape(-1))), shape=(len(pairs), width), dtype=np.int64)

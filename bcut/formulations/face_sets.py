"""Formulation 1 (the paper, Sec. 2.2): a stable set of simplices of all dimensions, with the lattice of their faces.

A column for each face of the candidate d-simplices, vertices included. Rows:

- the lattice: ``x_f >= x_g`` for each facet f of a simplex g, in all dimensions;
- crossings: ``x_f + x_g <= 1`` for each circuit whose two parts are the faces f and g. In general position these
  are the pairs of crossing faces of complementary dimensions, one for each d + 2 points (Proposition 1 of the paper).
  In degenerate position circuits have fewer points, such as a point between two others; their rows and the lattice
  imply those of all larger faces that cross;
- the volume row.

Proposition 2 of the paper holds for every configuration: projected to the d-simplices, the relaxation is that of
Formulation 0. Simplices s and t cross if and only if the parts of some circuit are faces f of s and g of t
(`bcut.geometry.crossings`). So ``x_s + x_t <= x_f + x_g <= 1`` follows from the rows here. The other way round, let x
satisfy Formulation 0, and give each face the largest value of a simplex that contains it. That satisfies the lattice;
and the simplices that give f and g their values cross, or one of them would be both and have a circuit among its
vertices, so ``x_f + x_g <= 1``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bcut.formulations.formulation import Formulation
from bcut.formulations.lazy_rows import CoverageRows, LazyRows, ListedPairs
from bcut.formulations.stable_sets import MOST_WRITTEN, assembled
from bcut.formulations.volume_rows import volume_rows
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.circuits import circuits
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.crossings import FaceTable
from bcut.geometry.simplices import candidate_simplices


def face_set_formulation(
    configuration: PointConfiguration,
    *,
    spanning: bool = False,
    chirotope: Chirotope | None = None,
    lazy: bool | None = None,
) -> Formulation:
    """Build Formulation 1.

    Parameters
    ----------
    configuration : PointConfiguration
    spanning : bool
        Only empty d-simplices, and their faces.
    chirotope : Chirotope, optional
        Of `configuration`, where it is known already.
    lazy : bool, optional
        Whether crossings are left to be asked for; if left out, where they are many.

    Returns
    -------
    Formulation
        The columns of faces follow those of the d-simplices, smaller faces first. First the volume row (or two rows
        that enclose it), then the lattice, then the crossings as far as they are written.
    """
    chirotope = chirotope or Chirotope.of(configuration)
    simplices = candidate_simplices(chirotope, spanning=spanning)
    columns = _Columns(simplices, chirotope.n)
    pairs = columns.of_circuits(circuits(chirotope))
    if lazy is None:
        lazy = len(pairs) > MOST_WRITTEN
    volume = volume_rows(configuration, chirotope, simplices)
    asked: list[LazyRows] = [ListedPairs(pairs)] if lazy else []
    if not volume.exact:
        asked.append(CoverageRows(chirotope, simplices))
    return assembled(
        "1",
        configuration,
        chirotope,
        simplices,
        spanning,
        volume,
        pairs[:0] if lazy else pairs,
        asked,
        faces=columns.faces,
        lattice=columns.lattice(),
    )


class _Columns:
    """The columns of all faces of some d-simplices: these first, then vertices, edges, and so on."""

    def __init__(self, simplices: NDArray[np.int64], n: int) -> None:
        self.table = FaceTable(simplices, n)
        self.size = simplices.shape[1]
        self.first = {self.size: 0}
        position = len(simplices)
        listed: list[tuple[int, ...]] = []
        for size in range(1, self.size):
            self.first[size] = position
            faces = self.table.faces[size]
            position += len(faces)
            listed += map(tuple, faces.tolist())
        self.faces = tuple(listed)

    def lattice(self) -> NDArray[np.int64]:
        """Return the columns (f, g) of every facet f of a face g, shape (k, 2)."""
        found = [np.empty((0, 2), dtype=np.int64)]
        for size in range(2, self.size + 1):
            smaller = self.first[size - 1] + self.table.boundary(size)
            larger = np.repeat(self.first[size] + np.arange(len(smaller)), size)
            found.append(np.stack((smaller.reshape(-1), larger), axis=1))
        return np.concatenate(found)

    def of_circuits(self, signs: NDArray[np.int8]) -> NDArray[np.int64]:
        """Return the columns of both parts of the circuits whose parts are faces, shape (k, 2)."""
        column = {face: len(self.table.faces[self.size]) + i for i, face in enumerate(self.faces)}
        for i, simplex in enumerate(self.table.faces[self.size].tolist()):
            column[tuple(simplex)] = i
        found = []
        for row in signs:
            parts = [tuple(np.flatnonzero(row == sign).tolist()) for sign in (1, -1)]
            if all(part in column for part in parts):
                found.append([column[part] for part in parts])
        return np.array(found, dtype=np.int64).reshape(-1, 2)

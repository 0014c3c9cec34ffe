"""Integer programs for regions that a closed surface bounds: triangulate all of it, or as much as possible.

**All of it.** One row for each triangle: of a surface triangle, exactly one chosen tetrahedron has it; of any other, as
many on the one side as on the other. Then the number of chosen tetrahedra over a generic point is 0 outside, rises by
one across each surface triangle, and changes nowhere else: it is 1 inside. So the 0/1 points are exactly the
triangulations of the region with the surface's triangles as boundary faces.

**As much as possible.** Tetrahedra of which no two cross, so that together with the surface they are a simplicial
complex, of the largest volume (the paper, Sec. 5): a stable set problem. Its rows are cliques: tetrahedra on one side
of a triangle, those over one generic point, and enough others that every pair that crosses is in one.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.crossings import crossing_matrix
from bcut.geometry.generic_point import simplices_containing_generic_point
from bcut.geometry.subsets import ranks, without
from bcut.geometry.surface import Region

if TYPE_CHECKING:
    import scipy.sparse as sp

# Generic points are taken at all corners of this many tetrahedra at most; cliques grown from pairs do the rest.
_CORNERED = 400


@dataclass(frozen=True, eq=False)
class RegionProgram:
    """Rows over the tetrahedra of a region: ``matrix @ x = right``, or ``<= right``, x in {0, 1}.

    Attributes
    ----------
    matrix : scipy.sparse.csr_matrix of int64, shape (rows, m)
    right : ndarray of int64, shape (rows,)
    equations : bool
    names : tuple
        The triangle of each equation, as a tuple of points; of another row, the numbers of its tetrahedra.
    """

    matrix: sp.csr_matrix
    right: NDArray[np.int64]
    equations: bool
    names: tuple[tuple[int, ...], ...]


def covering_program(region: Region) -> RegionProgram:
    """Return the rows of which the triangulations of a region are the 0/1 points."""
    import scipy.sparse as sp

    n, tetrahedra = region.chirotope.n, region.tetrahedra
    surface = ranks(region.sorted_triangles, n)
    columns, faces, values = [], [], []
    for position in range(4):
        found = ranks(without(tetrahedra, position), n)
        sides = region.chirotope.sides[found, tetrahedra[:, position]].astype(np.int64)
        columns.append(np.arange(len(tetrahedra)))
        faces.append(found)
        # Those inside are all on the same side of a surface triangle.
        values.append(np.where(np.isin(found, surface), 1, sides))
    used, rows = np.unique(np.concatenate([surface, *faces]), return_inverse=True)
    rows = rows.reshape(-1)[len(surface) :]
    matrix = sp.csr_matrix(
        (np.concatenate(values), (rows, np.concatenate(columns))), shape=(len(used), len(tetrahedra))
    )
    right = np.isin(used, surface).astype(np.int64)
    names = tuple(map(tuple, region.chirotope.facets[used].tolist()))
    return RegionProgram(matrix, right, True, names)


def packing_program(region: Region, crossing: NDArray[np.bool_]) -> RegionProgram:
    """Return clique rows of which the sets of tetrahedra that do not cross are the 0/1 points.

    Parameters
    ----------
    region : Region
    crossing : ndarray of bool, shape (m, m)
        As from `tetrahedra_crossing`.
    """
    import scipy.sparse as sp

    cliques = _maximal([*_one_sided(region), *_over_generic_points(region)], crossing)
    covered = np.zeros_like(crossing)
    for clique in cliques:
        covered[np.ix_(clique, clique)] = True
    while (missing := np.argwhere(crossing & ~covered)).size:
        clique = _grown(missing[0].tolist(), crossing)
        covered[np.ix_(clique, clique)] = True
        cliques.append(clique)
    alone = set(range(len(crossing))) - {column for clique in cliques for column in clique}
    names = tuple(tuple(clique) for clique in [*cliques, *([column] for column in sorted(alone))])
    rows = np.repeat(np.arange(len(names)), [len(name) for name in names])
    members = np.array([column for name in names for column in name], dtype=np.int64)
    matrix = sp.csr_matrix(
        (np.ones(len(members), dtype=np.int64), (rows, members)), shape=(len(names), len(crossing))
    )
    return RegionProgram(matrix, np.ones(len(names), dtype=np.int64), False, names)


def tetrahedra_crossing(region: Region) -> NDArray[np.bool_]:
    """Tell which pairs of the tetrahedra of a region cross, shape (m, m)."""
    return crossing_matrix(region.chirotope, region.tetrahedra)


def _one_sided(region: Region) -> list[list[int]]:
    """Return the tetrahedra on each side of each triangle: any two of them overlap next to it."""
    n, tetrahedra = region.chirotope.n, region.tetrahedra
    groups: dict[tuple[int, int], list[int]] = {}
    for position in range(4):
        faces = ranks(without(tetrahedra, position), n)
        sides = region.chirotope.sides[faces, tetrahedra[:, position]]
        for column, key in enumerate(zip(faces.tolist(), sides.tolist(), strict=True)):
            groups.setdefault(key, []).append(column)
    return [group for group in groups.values() if len(group) > 1]


def _over_generic_points(region: Region) -> list[list[int]]:
    """Return the tetrahedra over generic points next to vertices of tetrahedra: any two of them overlap there."""
    tetrahedra = region.tetrahedra
    found = set()
    for tetrahedron in tetrahedra[:_CORNERED]:
        for flag in permutations(tetrahedron.tolist()):
            contained = simplices_containing_generic_point(region.chirotope, tetrahedra, np.array(flag))
            found.add(tuple(np.flatnonzero(contained).tolist()))
    return [list(group) for group in sorted(found) if len(group) > 1]


def _maximal(groups: list[list[int]], crossing: NDArray[np.bool_]) -> list[list[int]]:
    """Grow cliques and drop those that are then there twice."""
    grown = {tuple(_grown(group, crossing)) for group in groups}
    return [list(clique) for clique in sorted(grown)]


def _grown(clique: list[int], crossing: NDArray[np.bool_]) -> list[int]:
    """Add tetrahedra that cross all of a clique, as long as there are any."""
    common = crossing[clique].all(axis=0)
    grown = list(clique)
    while common.any():
        new = int(common.argmax())
        grown.append(new)
        common &= crossing[new]
    return sorted(grown)

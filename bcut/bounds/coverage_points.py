"""Many coverage rows out of one, as combinations of rows.

The cocircuit form says once that a generic point p is covered exactly once, and its homogeneous rows carry that from
simplex to simplex. Walk from p to another generic point q: where the way crosses a (d-1)-simplex f, the simplices
behind f come in place of those before it, so

    coverage(q)  =  coverage(p)  +  sum over the f that are crossed of (side of f that q is on) * row(f).

A linear relaxation gains nothing from these rows, but first-order methods do: without them, news travels from one
simplex to the next in each iteration. Crossings are found in floating-point arithmetic. That is safe, since any
combination of rows is valid: where a sign is wrong, the row helps less.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import scipy.sparse as sp

    from bcut.formulations.compact import CompactProgram
    from bcut.formulations.formulation import Formulation

# As many points as repay the longer columns.
_POINTS = 64
# Of so many random points the most distant ones are taken.
_CANDIDATES = 16


def coverage_points(
    program: CompactProgram | Formulation, *, points: int = _POINTS, seed: int = 0
) -> sp.csr_array:
    """Return combinations of rows that are coverage rows of further points.

    Parameters
    ----------
    program : CompactProgram or Formulation
        The cocircuit form. Row 0 is the coverage row of the flag of the first affinely independent points.
    points : int
        Their number, at most: fewer where columns would become much longer.
    seed : int

    Returns
    -------
    scipy.sparse.csr_array, shape (points, rows)
    """
    import scipy.sparse as sp

    floats = program.configuration.floats
    faces, apexes, signs = _faces(program)
    source = _flag_point(floats)
    targets = spread_points(floats, points, np.random.default_rng(seed))
    inverse, usable = _inverses(floats[faces] - source)
    # The side that the apex is on, relative to that of the source.
    heights = np.einsum("rij,rj->ri", inverse, floats[apexes] - source).sum(axis=1)
    beyond = np.where(heights > 1, signs, -signs)
    rows, columns, values = [], [], []
    for number, target in enumerate(targets):
        weights = inverse @ (target - source)
        crossed = np.flatnonzero(usable & (weights > 0).all(axis=1) & (weights.sum(axis=1) > 1))
        rows.append(np.full(len(crossed) + 1, number))
        columns.append(np.concatenate(([0], crossed + 1)))
        values.append(np.concatenate(([1], beyond[crossed])))
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csr_array(entries, shape=(len(targets), len(faces) + 1), dtype=np.int32)


def _faces(
    program: CompactProgram | Formulation,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the face of each homogeneous row, the apex of one of its simplices, and the entry of that."""
    from bcut.formulations.formulation import Formulation

    if isinstance(program, Formulation):
        matrix = program.matrix
        faces = np.array(program.row_faces[1:], dtype=np.int64)
        first = matrix.indptr[1:-1]
        columns, signs = matrix.indices[first], matrix.data[first]
    else:
        faces = program.row_faces
        columns = np.empty(len(faces), dtype=np.int64)
        signs = np.empty(len(faces), dtype=np.int64)
        for position in range(faces.shape[1] + 1):
            own = program.facet_rows[:, position]
            interior = np.flatnonzero(own >= 0)
            columns[own[interior]] = interior
            signs[own[interior]] = program.facet_signs[interior, position]
    simplices = program.simplices[columns].astype(np.int64)
    return faces, simplices.sum(axis=1) - faces.sum(axis=1), signs.astype(np.int64)


def _flag_point(floats: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a point near that of the flag of the first affinely independent points."""
    d = floats.shape[1]
    # The last of the powers still counts in the sign of a determinant of doubles.
    step = 2.0 ** -(36 // d)
    chosen = [floats[0]]
    for point in floats[1:]:
        edges = np.array([*chosen[1:], point]) - chosen[0]
        if np.linalg.matrix_rank(edges) == len(edges):
            chosen.append(point)
        if len(chosen) == d + 1:
            break
    source = chosen[0].copy()
    for k, point in enumerate(chosen[1:]):
        source += step ** (k + 1) * (point - chosen[0])
    return source


def _inverses(edges: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the inverses of the transposed matrices, and which of them exist."""
    matrices = np.swapaxes(edges, 1, 2).copy()
    usable: NDArray[np.bool_] = np.abs(np.linalg.det(matrices)) > 0
    matrices[~usable] = np.eye(matrices.shape[1])
    return np.asarray(np.linalg.inv(matrices), dtype=np.float64), usable


def spread_points(
    floats: NDArray[np.float64], count: int, generator: np.random.Generator
) -> NDArray[np.float64]:
    """Draw points of the convex hull that are far from each other.

    Parameters
    ----------
    floats : ndarray of float, shape (n, d)
        The points whose hull it is.
    count : int
    generator : numpy.random.Generator

    Returns
    -------
    ndarray of float, shape (count, d)
    """
    from scipy.spatial import Delaunay

    cells = floats[Delaunay(floats, qhull_options="QJ Pp").simplices]
    volumes = np.abs(np.linalg.det(cells[:, 1:] - cells[:, :1]))
    drawn = generator.choice(len(cells), size=_CANDIDATES * count, p=volumes / volumes.sum())
    weights = generator.dirichlet(np.ones(cells.shape[1]), size=len(drawn))
    candidates = np.einsum("ki,kij->kj", weights, cells[drawn])
    distances = np.full(len(candidates), np.inf)
    chosen = []
    for _ in range(count):
        chosen.append(int(distances.argmax()))
        distances = np.minimum(distances, ((candidates - candidates[chosen[-1]]) ** 2).sum(axis=1))
    return candidates[chosen]

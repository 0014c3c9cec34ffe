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

from bcut.geometry.volumes import pulling_triangulation

if TYPE_CHECKING:
    import scipy.sparse as sp

    from bcut.formulations.compact import CompactProgram
    from bcut.formulations.formulation import Formulation

# The rows lengthen the columns by so many entries on the average, but there are no more and no fewer than this.
_ENTRIES, _FEWEST, _MOST = 0.4, 16, 512
# Columns that tell how many simplices contain a point.
_SAMPLE = 2000
# Of so many random points, for each that is wanted, the most distant ones are taken.
_CANDIDATES = 8


def coverage_points(
    program: CompactProgram | Formulation, *, points: int | None = None, seed: int = 0
) -> sp.csr_array:
    """Return combinations of rows that are coverage rows of further points.

    Parameters
    ----------
    program : CompactProgram or Formulation
        The cocircuit form. Row 0 is the coverage row of the flag of the first affinely independent points.
    points : int, optional
        Their number; as many as repay the longer columns if left out.
    seed : int

    Returns
    -------
    scipy.sparse.csr_array, shape (points, rows)
    """
    import scipy.sparse as sp

    from bcut.bounds._first_order_kernels import crossed_faces

    generator = np.random.default_rng(seed)
    floats = program.configuration.floats
    cells = floats[pulling_triangulation(program.chirotope.hull_facets, len(floats))]
    scale = _exponent(floats)
    volumes = _volumes(cells[:, 1:] - cells[:, :1], scale)
    if points is None:
        corners = floats[program.simplices[generator.integers(len(program.simplices), size=_SAMPLE)]]
        points = _number(_volumes(corners[:, 1:] - corners[:, :1], scale), float(volumes.sum()))
    targets = spread_points(cells, volumes, points, generator)
    faces, apexes, signs = _faces(program)
    source = _flag_point(floats)
    inverses, usable = _inverses(floats[faces] - source)
    # The side that the apex is on, relative to that of the source.
    heights = np.einsum("rij,rj->r", inverses, floats[apexes] - source)
    beyond = np.where(usable, np.where(heights > 1, signs, -signs), 0).astype(np.int8)
    found, values = np.empty(len(faces), dtype=np.int64), np.empty(len(faces), dtype=np.int8)
    columns, entries, starts = [], [], [0]
    for target in targets:
        count = crossed_faces(inverses, beyond, target - source, found, values)
        columns += [np.zeros(1, dtype=np.int64), found[:count] + 1]
        entries += [np.ones(1, dtype=np.int32), values[:count].astype(np.int32)]
        starts.append(starts[-1] + count + 1)
    parts = (np.concatenate(entries), np.concatenate(columns), np.array(starts))
    return sp.csr_array(parts, shape=(len(targets), len(faces) + 1))


def _exponent(floats: NDArray[np.float64]) -> int:
    """Return a power of two near the largest absolute value."""
    return int(np.frexp(np.abs(floats).max(initial=0.0))[1])


def _volumes(edges: NDArray[np.float64], exponent: int) -> NDArray[np.float64]:
    """Return what volumes would be if edges were divided by a power of two: else they may be infinite, or zero."""
    return np.asarray(np.abs(np.linalg.det(np.ldexp(edges, -exponent))), dtype=np.float64)


def _number(sampled: NDArray[np.float64], volume: float) -> int:
    """Return how many points are covered as often as wanted, if the simplices are like some of them."""
    share = float(sampled.mean()) / volume
    return int(np.clip(_ENTRIES / max(share, 1e-300), _FEWEST, _MOST))


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
    usable: NDArray[np.bool_] = _volumes(matrices, _exponent(matrices)) > 0
    matrices[~usable] = np.eye(matrices.shape[1])
    return np.asarray(np.linalg.inv(matrices), dtype=np.float64), usable


def spread_points(
    cells: NDArray[np.float64], volumes: NDArray[np.float64], count: int, generator: np.random.Generator
) -> NDArray[np.float64]:
    """Draw points that are far from each other, uniformly before the choice.

    Parameters
    ----------
    cells : ndarray of float, shape (k, d + 1, d)
        Simplices to draw from.
    volumes : ndarray of float, shape (k,)
    count : int
    generator : numpy.random.Generator

    Returns
    -------
    ndarray of float, shape (count, d)
    """
    drawn = generator.choice(len(cells), size=_CANDIDATES * count, p=volumes / volumes.sum())
    weights = generator.dirichlet(np.ones(cells.shape[1]), size=len(drawn))
    candidates = np.einsum("ki,kij->kj", weights, cells[drawn])
    distances = np.full(len(candidates), np.inf)
    chosen = []
    for _ in range(count):
        chosen.append(int(distances.argmax()))
        distances = np.minimum(distances, ((candidates - candidates[chosen[-1]]) ** 2).sum(axis=1))
    return candidates[chosen]

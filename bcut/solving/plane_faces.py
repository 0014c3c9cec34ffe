"""Faces of the certain edges of a minimum weight triangulation, each a problem of its own.

`bcut.geometry.elimination` says why. Faces that are disks are solved by dynamic programming, others by the integer
program to cover each side of certain edges once, and both sides of other edges equally often.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.safe import SafeBound
from bcut.errors import SolverError
from bcut.formulations.formulation import Formulation
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.elimination import Skeleton
from bcut.geometry.partial_chirotope import PartialChirotope
from bcut.objectives.objective import Objective, objective_of
from bcut.objectives.syntax import read_objective
from bcut.solving.search import Part, Search, bound_at_root, branch
from bcut.solving.strategies import RELATIVE_GAP

# Costs of triangles are sums of three lengths, each with fewer than eight roundings.
COST_ERROR = Fraction(1, 2**48)
SUM_ERROR = Fraction(1, 2**52)
# Of the bound of a face that is left to the integer program: how far above it the optimum is sought at first.
_FIRST_SHARE, _GROWTH = Fraction(1, 1000), 4


def part_of(
    configuration: PointConfiguration,
    triangles: NDArray[np.int64],
    edge_sides: NDArray[np.int64],
    edges: NDArray[np.int64],
    is_certain: NDArray[np.bool_],
    objective: Objective | None = None,
) -> Part:
    """Return the program to cover each side of certain edges once, and both sides of other edges equally often.

    Its 0/1 points are the triangulations of the faces in question with such triangles: glued to triangulations of the
    other faces they satisfy the cocircuit row of every inner edge, and near an edge of the hull they cover once.
    """
    import scipy.sparse as sp

    side, certain = edge_sides & 1, is_certain[edge_sides // 2] if len(edges) else edge_sides > 0
    # Two rows for a certain edge, one for any other.
    keys = np.where(certain, edge_sides, edge_sides - side)
    used, rows = np.unique(keys, return_inverse=True)
    columns = np.repeat(np.arange(len(triangles)), 3)
    entries = np.where(certain | (side == 0), 1, -1).astype(np.int8).reshape(-1)
    matrix = sp.csr_matrix((entries, (rows.reshape(-1), columns)), shape=(len(used), len(triangles)))
    matrix.sort_indices()
    right = is_certain[used // 2].astype(np.int64)
    formulation = Formulation(
        name="2",
        configuration=configuration,
        chirotope=PartialChirotope(configuration, ()),
        simplices=triangles,
        spanning=True,
        matrix=matrix,
        lower=right,
        upper=right.copy(),
        row_faces=tuple(map(tuple, edges[used // 2].tolist())),
    )
    if objective is None:
        objective = objective_of(read_objective("weight", "min"), formulation)
    return Part.whole(formulation, objective)


def are_disks(skeleton: Skeleton, faces: int, face_of: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Tell which faces have a connected boundary: all vertices, joined by the certain edges on which the face lies."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    corners = skeleton.triangles
    n = int(corners.max(initial=0)) + 1
    keys, place = np.unique(face_of[:, None] * n + corners, return_inverse=True)
    place = place.reshape(corners.shape)
    row, position = np.nonzero(skeleton.is_certain[skeleton.edge_sides // 2])
    first, second = place[row, (position + 1) % 3], place[row, (position + 2) % 3]
    graph = sp.coo_matrix((np.ones(len(first), dtype=np.int8), (first, second)), shape=(len(keys), len(keys)))
    labels = connected_components(graph, directed=False)[1]
    pieces = np.unique(np.stack((keys // n, labels), axis=1), axis=0)[:, 0]
    return np.bincount(pieces, minlength=faces) == 1


def best_tilings(
    skeleton: Skeleton, objective: Objective, face_of: NDArray[np.int64], programmed: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return triangles that tile some faces at least cost."""
    from bcut.geometry import _tiling_kernels as kernels

    on_boundary = skeleton.is_certain[skeleton.edge_sides // 2]
    row, position = np.nonzero(on_boundary)
    where, first = np.unique(face_of[row], return_index=True)
    wanted = np.isin(where, programmed)
    roots = skeleton.edge_sides[row[first[wanted]], position[first[wanted]]]
    starts, members = skeleton.sides
    values, chosen = np.empty(len(roots)), np.empty(len(skeleton.triangles), dtype=np.int64)
    count = kernels.best_tilings(
        roots,
        objective.costs,
        skeleton.edge_sides,
        starts,
        members,
        skeleton.is_certain,
        values,
        chosen,
    )
    if count < 0 or not np.isfinite(values).all():
        raise SolverError("elimination left a face that has no triangulation; this is an error in bcut")
    return chosen[:count]


def solve_face(
    search: Search, skeleton: Skeleton, columns: NDArray[np.intp]
) -> tuple[NDArray[np.intp] | None, Fraction, bool]:
    """Solve the integer program of a face: its triangles, a bound, and whether that is the optimum."""
    whole = search.whole
    part = part_of(
        whole.formulation.configuration,
        skeleton.triangles[columns],
        skeleton.edge_sides[columns],
        skeleton.possible,
        skeleton.is_certain,
        whole.objective.restricted_to(columns),
    )
    face = Search(
        whole=part, make_separators=search.make_separators, deadline=search.deadline, seed=search.seed
    )
    root = bound_at_root(face, part, None)
    if root.last is not None:
        _reach_optimum(face, root.last)
    if face.status == "interrupted":
        search.status = "interrupted"
    search.nodes += face.nodes
    for stage, seconds in face.seconds.items():
        search.seconds[stage] = search.seconds.get(stage, 0.0) + seconds
    bound = max(Fraction(0), face.bound or Fraction(0))
    return None if face.columns is None else columns[face.columns], bound, _is_settled(face)


def _reach_optimum(face: Search, exact: SafeBound) -> None:
    """Look for the optimum of a face within a target above its bound, which rises until there is a triangulation.

    Only triangles with small reduced costs are in triangulations within the target.
    """
    share = _FIRST_SHARE
    while not _is_settled(face) and face.seconds_left != 0.0:
        target = exact.value * (1 + share)
        part = face.whole.restricted_to(exact.columns_within(target))
        everything = len(part.columns) == len(face.whole.columns)
        root = bound_at_root(face, part, None)
        if root.status == "infeasible" and not everything:
            face.raise_bound(target)
            share *= _GROWTH
            continue
        if root.last is not None:
            face.raise_bound(root.last.value if everything else min(target, root.last.value))
        if _is_settled(face):
            return
        outcome = branch(face, part, root, cutoff=None if everything else float(target))
        if outcome == "optimal" and face.value is not None and (everything or face.value <= target):
            face.raise_bound(face.value)
        elif everything and outcome == "infeasible":
            raise SolverError("elimination left a face that has no triangulation; this is an error in bcut")
        elif outcome in ("optimal", "infeasible"):
            # No less than the double that was the cutoff.
            face.raise_bound(target * (1 - SUM_ERROR))
            share *= _GROWTH
        else:
            face.status = "interrupted" if outcome == "interrupted" else "limit"
            return


def _is_settled(face: Search) -> bool:
    value, bound = face.value, face.bound
    return value is not None and bound is not None and float(value - bound) <= RELATIVE_GAP * float(value)

"""Minimum weight triangulations of the plane: strike out edges by theorems, then solve the faces that are left.

`bcut.geometry.elimination` states the theorems. They speak of real lengths, and what floating point decides there is decided
on the safe side. The costs of triangles are doubles, each correct to a few roundings, and values are exact sums of them. So
the result is a triangulation whose weight no other one undercuts by more than the rounding of the costs, and of the sums
in the dynamic programs: a relative 1e-12 or less, unless one face has thousands of triangles. A face that is left to the
integer program adds the gap of that. The bound of a search says all this in numbers: no triangulation, with all its costs as
doubles, is below it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from fractions import Fraction
from math import comb

import numpy as np
from numpy.typing import NDArray

from bcut.errors import InputError, SolverError
from bcut.formulations.formulation import Formulation
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.elimination import Skeleton, diamond_edges, lmt_skeleton
from bcut.geometry.partial_chirotope import PartialChirotope
from bcut.geometry.placing import placing_triangulation
from bcut.objectives.objective import Objective, objective_of
from bcut.objectives.syntax import read_objective
from bcut.result import Certificate
from bcut.solving.search import Part, Progress, Search, bound_at_root, branch
from bcut.solving.strategies import RELATIVE_GAP

# Costs of triangles are sums of three lengths, each with fewer than eight roundings.
_COST_ERROR = Fraction(1, 2**48)
_SUM_ERROR = Fraction(1, 2**52)


@dataclass
class EliminationStatistics:
    """How many edges, triangles and faces were left at each stage; None where it was not reached.

    Attributes
    ----------
    pairs : int
        Of points.
    edges : int
        That pass the diamond test.
    triangles : int
        Empty ones with such edges.
    possible_edges, possible_triangles : int
        That may be in a locally minimal triangulation.
    certain_edges : int
        That are in every minimum weight triangulation.
    faces : int
        Of the certain edges that are no triangles yet.
    programmed_faces, integer_faces : int
        Those of them that were solved by dynamic programming and by an integer program.
    largest_face : int
        Most possible triangles in one of them.
    """

    pairs: int
    edges: int | None = None
    triangles: int | None = None
    possible_edges: int | None = None
    possible_triangles: int | None = None
    certain_edges: int | None = None
    faces: int | None = None
    programmed_faces: int | None = None
    integer_faces: int | None = None
    largest_face: int | None = None


@dataclass(frozen=True, eq=False)
class PlaneTriangulation:
    """A minimum weight triangulation.

    Attributes
    ----------
    status : str
        "optimal", or "limit" or "interrupted" where there was not enough time.
    simplices : ndarray of int64, shape (t, 3), or None
        Ascending vertices, in colexicographic order.
    value : Fraction or None
        The exact sum of the costs of the triangles, which are doubles.
    bound : Fraction or None
        No triangulation that uses all points has a smaller sum.
    statistics : EliminationStatistics
    seconds : dict
        Per stage.
    """

    status: str
    simplices: NDArray[np.int64] | None
    value: Fraction | None
    bound: Fraction | None
    statistics: EliminationStatistics
    seconds: dict[str, float]


def minimum_weight_triangulation_2d(
    configuration: PointConfiguration,
    *,
    time_limit: float | None = None,
    seed: int = 0,
    on_progress: Progress | None = None,
) -> PlaneTriangulation:
    """Find a minimum weight triangulation that uses all points of the plane.

    Parameters
    ----------
    configuration : PointConfiguration
        Of dimension 2.
    time_limit : float, optional
        In seconds.
    seed : int
        Of the solver's random choices, where one is needed.
    on_progress : callable, optional
        Told of stages, as a dict.

    Raises
    ------
    InputError
        The points do not lie in the plane.
    TooLargeError
        There are too many edges or triangles.
    """
    search = Search(
        whole=empty_part(configuration),
        make_separators=list,
        deadline=None if time_limit is None else time.monotonic() + time_limit,
        seed=seed,
        on_progress=on_progress,
    )
    statistics = solve_by_elimination(search)
    found = search.columns
    return PlaneTriangulation(
        search.status,
        None if found is None else search.whole.formulation.simplices[np.sort(found)],
        search.value,
        search.bound,
        statistics,
        search.seconds,
    )


def check_question(configuration: PointConfiguration, name: str, sense: str, *, spanning: bool) -> None:
    """Refuse what elimination is no theorem for.

    Raises
    ------
    InputError
        The question is not that for a minimum weight triangulation of the plane that uses all points.
    """
    if configuration.dimension != 2 or (name, sense) != ("weight", "min") or not spanning:
        raise InputError(
            "method 'elimination': it is for triangulations of least weight that use all points of the plane "
            "(--objective weight --spanning in dimension 2); use the method listing"
        )


def empty_part(configuration: PointConfiguration) -> Part:
    """Return a program without columns, for a search to begin with."""
    nothing = np.empty((0, 3), dtype=np.int64)
    return _part_of(configuration, nothing, nothing, np.empty((0, 2), dtype=np.int64), np.empty(0, dtype=bool))


def solve_by_elimination(search: Search) -> EliminationStatistics:
    """Solve for least weight in the plane, all points used.

    Parameters
    ----------
    search : Search
        Its whole is `empty_part` of the configuration; it ends as the program on the triangles that are left.
    """
    configuration = search.whole.formulation.configuration
    statistics = EliminationStatistics(comb(configuration.n, 2))
    search.certificate = Certificate(
        reason="edges were eliminated by theorems on minimum weight triangulations, not by multipliers"
    )
    try:
        _solve(search, configuration, statistics)
    except KeyboardInterrupt:
        search.status = "interrupted"
    if search.columns is None:
        _place(search, configuration)
    return statistics


def _solve(search: Search, configuration: PointConfiguration, statistics: EliminationStatistics) -> None:
    with search.timed("diamond"):
        edges = diamond_edges(configuration)
    statistics.edges = len(edges)
    search.report("diamond", edges=len(edges))
    if search.seconds_left == 0.0:
        return
    with search.timed("skeleton"):
        skeleton = lmt_skeleton(configuration, edges)
    statistics.triangles, statistics.possible_triangles = skeleton.triangles_before, len(skeleton.triangles)
    statistics.possible_edges = len(skeleton.possible)
    statistics.certain_edges = int(skeleton.is_certain.sum())
    search.report(
        "skeleton", edges=len(skeleton.possible), certain=statistics.certain_edges, columns=len(skeleton.triangles)
    )
    if search.seconds_left == 0.0:
        return
    with search.timed("model"):
        search.whole = _part_of(
            configuration, skeleton.triangles, skeleton.edge_sides, skeleton.possible, skeleton.is_certain
        )
    search.columns_after_fixing = len(skeleton.triangles)
    _solve_faces(search, skeleton, statistics)


def _solve_faces(search: Search, skeleton: Skeleton, statistics: EliminationStatistics) -> None:
    """Solve face by face; the bound is the sum of theirs."""
    objective = search.whole.objective
    with search.timed("faces"):
        faces, face_of = skeleton.faces()
        is_open = ~skeleton.is_certain[skeleton.edge_sides // 2].all(axis=1)
        settled = np.flatnonzero(~is_open)
        is_disk = _disks(skeleton, faces, face_of)
        open_faces = np.unique(face_of[is_open])
        programmed = open_faces[is_disk[open_faces]]
        rest = open_faces[~is_disk[open_faces]]
        statistics.faces, statistics.programmed_faces = len(open_faces), len(programmed)
        statistics.integer_faces = len(rest)
        statistics.largest_face = int(np.bincount(face_of[is_open], minlength=1).max(initial=0))
        tilings = _program(skeleton, objective, face_of, programmed)
    chosen = np.concatenate((settled, tilings))
    costs = objective.exact_costs(chosen)
    # Errors of sums grow with the number of terms in a face.
    _, place, sizes = np.unique(face_of[chosen], return_inverse=True, return_counts=True)
    errors = [_COST_ERROR + size * _SUM_ERROR for size in sizes.tolist()]
    bound = sum(
        (cost * (1 - errors[k]) for cost, k in zip(costs, place.reshape(-1).tolist(), strict=True)), Fraction(0)
    )
    complete, parts = True, [chosen]
    for face in rest.tolist():
        found, proven, finished = _solve_face(search, skeleton, np.flatnonzero(face_of == face))
        complete = complete and finished
        # Where nothing is proven zero is, as weights are positive.
        bound += proven * (1 - _COST_ERROR)
        if found is None:
            parts = []
        elif parts:
            parts.append(found)
        if search.status == "interrupted":
            break
    if search.status == "interrupted" and rest.size:
        complete = False
    search.raise_bound(bound)
    if parts and (complete or len(parts) == 1 + len(rest)):
        search.offer(np.concatenate(parts))
        if complete:
            search.status = "optimal"


def _disks(skeleton: Skeleton, faces: int, face_of: NDArray[np.int64]) -> NDArray[np.bool_]:
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


def _program(
    skeleton: Skeleton, objective: Objective, face_of: NDArray[np.int64], programmed: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return triangles that tile some faces at least cost."""
    from bcut.geometry import _elimination_kernels as kernels

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


def _solve_face(
    search: Search, skeleton: Skeleton, columns: NDArray[np.intp]
) -> tuple[NDArray[np.intp] | None, Fraction, bool]:
    """Solve the integer program of a face: its triangles, a bound, and whether that is the optimum."""
    whole = search.whole
    part = _part_of(
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
        face.raise_bound(root.last.value)
    if not _is_settled(face) and root.last is not None and face.seconds_left != 0.0:
        outcome = branch(face, part, root)
        if outcome == "optimal" and face.value is not None:
            face.raise_bound(face.value)
        elif outcome == "infeasible":
            raise SolverError("elimination left a face that has no triangulation; this is an error in bcut")
        elif outcome == "interrupted":
            search.status = "interrupted"
    search.nodes += face.nodes
    for stage, seconds in face.seconds.items():
        search.seconds[stage] = search.seconds.get(stage, 0.0) + seconds
    bound = max(Fraction(0), face.bound or Fraction(0))
    return None if face.columns is None else columns[face.columns], bound, _is_settled(face)


def _is_settled(face: Search) -> bool:
    value, bound = face.value, face.bound
    return value is not None and bound is not None and float(value - bound) <= RELATIVE_GAP * float(value)


def _place(search: Search, configuration: PointConfiguration) -> None:
    """Hand out some triangulation where there was no time for the best one."""
    simplices = placing_triangulation(configuration, PartialChirotope(configuration, ()))
    nothing = np.zeros(simplices.shape, dtype=np.int64)
    search.whole = _part_of(configuration, simplices, nothing, np.zeros((1, 2), dtype=np.int64), np.zeros(1, bool))
    search.offer(np.arange(len(simplices)))


def _part_of(
    configuration: PointConfiguration,
    triangles: NDArray[np.int64],
    edge_sides: NDArray[np.int64],
    edges: NDArray[np.int64],
    is_certain: NDArray[np.bool_],
    objective: Objective | None = None,
) -> Part:
    """Return the program to cover each side of certain edges once, and both sides of other edges equally often.

    Its 0/1 points are the triangulations of the faces in question with such triangles: glued to triangulations of the other
    faces they satisfy the cocircuit row of every inner edge, and near an edge of the hull they cover once.
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

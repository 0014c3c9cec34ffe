"""Minimum weight triangulations of the plane: strike out edges by theorems, then solve the faces that are left.

`bcut.geometry.elimination` states the theorems. They speak of real lengths, and what floating point decides there is
decided on the safe side. The costs of triangles are doubles, each correct to a few roundings, and values are exact
sums of them. So the result is a triangulation whose weight no other one undercuts by more than the rounding of the
costs, and of the sums in the dynamic programs: a relative 1e-12 or less, unless one face has thousands of triangles.
A face that is left to the integer program adds the gap of that. The bound of a search says all this in numbers: no
triangulation, with all its costs as doubles, is below it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from math import comb

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.delaunay import first_triangulation
from bcut.geometry.elimination import Skeleton, all_pairs, diamond_edges, lmt_skeleton
from bcut.geometry.partial_chirotope import PartialChirotope
from bcut.result import Certificate
from bcut.solving.plane_faces import COST_ERROR, SUM_ERROR, are_disks, best_tilings, part_of, solve_face
from bcut.solving.search import Part, Progress, Search


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
    rows : int
        Of the program on the possible triangles.
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
    rows: int = 0

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows: what the diamond test leaves, and what the program has that is solved."""
        return self.triangles or 0, self.rows


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
    diamond: bool = True,
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
    diamond : bool
        Whether to begin with the diamond test; without it all pairs of points are edges, for small configurations.
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
    statistics = solve_by_elimination(search, diamond=diamond)
    found = search.columns
    return PlaneTriangulation(
        search.status,
        None if found is None else search.whole.formulation.simplices[np.sort(found)],
        search.value,
        search.bound,
        statistics,
        search.seconds,
    )


def empty_part(configuration: PointConfiguration) -> Part:
    """Return a program without columns, for a search to begin with."""
    nothing = np.empty((0, 3), dtype=np.int64)
    return part_of(configuration, nothing, nothing, np.empty((0, 2), dtype=np.int64), np.empty(0, dtype=bool))


def solve_by_elimination(search: Search, *, diamond: bool = True) -> EliminationStatistics:
    """Solve for least weight in the plane, all points used.

    Parameters
    ----------
    search : Search
        Its whole is `empty_part` of the configuration; it ends as the program on the triangles that are left.
    diamond : bool
        Whether to begin with the diamond test.
    """
    configuration = search.whole.formulation.configuration
    statistics = EliminationStatistics(comb(configuration.n, 2))
    search.certificate = Certificate(
        reason="edges were eliminated by theorems on minimum weight triangulations, not by multipliers"
    )
    try:
        _solve(search, configuration, statistics, diamond_edges if diamond else all_pairs)
    except KeyboardInterrupt:
        search.status = "interrupted"
    except MemoryError:
        search.status = "limit"
    if search.columns is None:
        _place(search, configuration)
    return statistics


def _solve(
    search: Search,
    configuration: PointConfiguration,
    statistics: EliminationStatistics,
    first_edges: Callable[[PointConfiguration], NDArray[np.int64]],
) -> None:
    with search.timed("diamond"):
        edges = first_edges(configuration)
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
        "skeleton",
        edges=len(skeleton.possible),
        certain=statistics.certain_edges,
        columns=len(skeleton.triangles),
    )
    if search.seconds_left == 0.0:
        return
    with search.timed("model"):
        search.whole = part_of(
            configuration, skeleton.triangles, skeleton.edge_sides, skeleton.possible, skeleton.is_certain
        )
    search.columns_after_fixing, statistics.rows = search.whole.formulation.size
    _solve_faces(search, skeleton, statistics)


def _solve_faces(search: Search, skeleton: Skeleton, statistics: EliminationStatistics) -> None:
    """Solve face by face; the bound is the sum of theirs."""
    objective = search.whole.objective
    with search.timed("faces"):
        faces, face_of = skeleton.faces()
        is_open = ~skeleton.is_certain[skeleton.edge_sides // 2].all(axis=1)
        settled = np.flatnonzero(~is_open)
        is_disk = are_disks(skeleton, faces, face_of)
        open_faces = np.unique(face_of[is_open])
        programmed = open_faces[is_disk[open_faces]]
        rest = open_faces[~is_disk[open_faces]]
        statistics.faces, statistics.programmed_faces = len(open_faces), len(programmed)
        statistics.integer_faces = len(rest)
        statistics.largest_face = int(np.bincount(face_of[is_open], minlength=1).max(initial=0))
        tilings = best_tilings(skeleton, objective, face_of, programmed)
    chosen = np.concatenate((settled, tilings))
    costs = objective.exact_costs(chosen)
    # Errors of sums grow with the number of terms in a face.
    _, place, sizes = np.unique(face_of[chosen], return_inverse=True, return_counts=True)
    errors = [COST_ERROR + size * SUM_ERROR for size in sizes.tolist()]
    bound = sum(
        (cost * (1 - errors[k]) for cost, k in zip(costs, place.reshape(-1).tolist(), strict=True)),
        Fraction(0),
    )
    complete, parts = True, [chosen]
    for face in rest.tolist():
        found, proven, finished = solve_face(search, skeleton, np.flatnonzero(face_of == face))
        complete = complete and finished
        # Where nothing is proven zero is, as weights are positive.
        bound += proven * (1 - COST_ERROR)
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


def _place(search: Search, configuration: PointConfiguration) -> None:
    """Hand out some triangulation where there was no time for the best one."""
    simplices = first_triangulation(configuration, PartialChirotope(configuration, ()))
    nothing = np.zeros(simplices.shape, dtype=np.int64)
    search.whole = part_of(
        configuration, simplices, nothing, np.zeros((1, 2), dtype=np.int64), np.zeros(1, bool)
    )
    search.offer(np.arange(len(simplices)))

"""`solve` and `bound`: from what a user writes to a verified result."""

from __future__ import annotations

from collections.abc import Sequence

from bcut.errors import InputError
from bcut.objectives.syntax import ObjectiveLike
from bcut.result import Result
from bcut.separation.observer import CutObserver
from bcut.solving.arguments import read_argument
from bcut.solving.groups import GroupLike
from bcut.solving.options import InstanceLike, Options, SeparatorLike
from bcut.solving.run import Run
from bcut.solving.search import Progress


def solve(
    instance: InstanceLike,
    *,
    objective: ObjectiveLike = "cardinality",
    sense: str | None = None,
    then: ObjectiveLike | Sequence[ObjectiveLike] = (),
    formulation: str | int | None = None,
    spanning: bool = False,
    dissection: bool = False,
    require: Sequence[Sequence[int]] = (),
    forbid: Sequence[Sequence[int]] = (),
    star: int | None = None,
    separators: SeparatorLike | Sequence[SeparatorLike] | None = None,
    time_limit: float | None = None,
    memory_limit: float | None = None,
    seed: int = 0,
    method: str = "auto",
    symmetries: GroupLike | None = None,
    invariant_under: int | GroupLike | None = None,
    on_progress: Progress | None = None,
    cut_observer: CutObserver | None = None,
) -> Result:
    """Find an optimal triangulation.

    Parameters
    ----------
    instance : str, path, points or PointConfiguration
        A file, a bundled instance or a family (``"cube:4"``); or points, as an array of shape (n, d) or as lists of
        coordinates.
    objective : str, function, or (str, function)
        A measure, whose sum counts: ``"cardinality"``, ``"weight"``, ``"volume"``, ``"aspect-ratio"``, ``"min-angle"``
        (2D), ``"dihedral-angle"``, ``"solid-angle"`` (3D), ``"costs:FILE"``, ``"random-costs:SEED"``, or a function in
        a file, ``"./mine.py"`` or ``"./mine.py:function"``. ``"min-max:MEASURE"`` and ``"max-min:MEASURE"`` are
        bottlenecks: the worst simplex counts. A function itself may stand for a measure: it takes the coordinates of m
        simplices, an array of shape (m, d + 1, d), and returns m costs, each of which depends on its own simplex only;
        ``("max-min", function)`` makes a bottleneck of it.
    sense : {"min", "max"}, optional
        Of a sum, which is minimised without it. Bottlenecks have their own.
    then : sequence of objectives
        Further objectives, each of which decides among the best by those before it: ``["cardinality"]``,
        ``["max:weight"]``, ``[("max", function)]``. A text or a function may stand alone.
    formulation : {"2", "0", "1", "chambers"}, optional
        The integer program; "2", the cocircuit form, if left out, and "chambers" for dissections.
    spanning : bool
        Only triangulations that use every point; of dissections, those into simplices without further points in them.
    dissection : bool
        Whether simplices need not meet face to face, as long as they do not overlap. In general position they always
        do.
    require, forbid : sequence of sequences of int
        Faces of any dimension, as sets of points, that must be in the triangulation, or must not.
    star : int, optional
        Only triangulations all of whose simplices have this point as a vertex.
    separators : sequence of str, Separator or Separator subclass, optional
        The cut families at work; a default set when omitted, none when empty. One of them may stand alone.
    time_limit : float, optional
        In seconds; what was found is returned when it is reached.
    memory_limit : float, optional
        Of the process, in GiB; likewise.
    seed : int
        Of the solver's random choices.
    method : {"auto", "listing", "orbits", "fixing", "elimination", "scip"}
        "listing" lists all simplices, bounds and fixes at the root, and lets SCIP branch on what is left; "orbits"
        does so with orbits of simplices under the symmetries that keep the costs, for cardinality and costs in a file
        only; "fixing" bounds by a first-order method, so that only some per cent of the simplices are ever in a solver;
        "elimination", for least weight in the plane with all points used, takes edges away by theorems, without a
        certificate; "scip" hands SCIP everything.
        "auto" takes orbits for large symmetric configurations, elimination or fixing for other large ones, and listing
        otherwise.
    symmetries : path, or sequence of permutations, optional
        For the method "orbits", which "auto" then is: generators of the symmetries to work with, instead of all that
        there are. A file holds ``[[1,0,2,3],[0,1,3,2]]``, or is one of TOPCOM's with generators behind its points.
    invariant_under : int, path, or sequence of permutations, optional
        For the method "orbits", which "auto" then is: only triangulations that some symmetries leave invariant, given
        as `symmetries`; or those that are invariant under some subgroup of this order, among those that a random
        search finds, one of each kind. Value, bound and status are about these triangulations.
    on_progress : callable, optional
        Told of stages, bounds and incumbents, as a dict.
    cut_observer : CutObserver, optional
        Told of every relaxation that is separated, and of every cut that is found.

    Returns
    -------
    Result
        Its triangulation has been verified exactly.

    Raises
    ------
    BcutError
        For everything that a user can cause.

    Examples
    --------
    >>> import bcut
    >>> bcut.solve("cube:3").value
    5
    """
    options = Options.of(
        objective=objective,
        sense=sense,
        then=then,
        formulation=formulation,
        spanning=spanning,
        dissection=dissection,
        require=require,
        forbid=forbid,
        star=star,
        separators=separators,
        time_limit=time_limit,
        memory_limit=memory_limit,
        seed=seed,
        method=method,
        symmetries=symmetries,
        invariant_under=invariant_under,
    )
    observer = read_argument("cut_observer", cut_observer)
    run = Run(instance, options, read_argument("on_progress", on_progress))
    run.search.cut_observer = observer
    run.within_limits(run.solve)
    run.hand_out()
    return run.finish()


def bound(
    instance: InstanceLike,
    *,
    objective: ObjectiveLike = "cardinality",
    sense: str | None = None,
    formulation: str | int | None = None,
    spanning: bool = False,
    dissection: bool = False,
    require: Sequence[Sequence[int]] = (),
    forbid: Sequence[Sequence[int]] = (),
    star: int | None = None,
    separators: SeparatorLike | Sequence[SeparatorLike] | None = None,
    time_limit: float | None = None,
    memory_limit: float | None = None,
    seed: int = 0,
    method: str = "auto",
    symmetries: GroupLike | None = None,
    on_progress: Progress | None = None,
) -> Result:
    """Bound the optimum at the root, before and after cuts, with no branching and none of the solver's own cuts.

    Parameters are those of `solve`, but for the method "scip". The result has status "bound" and no triangulation. Over
    orbits, "link" is the only family that is at work, averaged over the symmetries.
    """
    if method == "scip":
        raise InputError(
            "method 'scip': it is for solve only; known here are auto, listing, orbits and fixing"
        )
    options = Options.of(
        objective=objective,
        sense=sense,
        formulation=formulation,
        spanning=spanning,
        dissection=dissection,
        require=require,
        forbid=forbid,
        star=star,
        separators=separators,
        time_limit=time_limit,
        memory_limit=memory_limit,
        seed=seed,
        method=method,
        symmetries=symmetries,
        only_bound=True,
    )
    run = Run(instance, options, read_argument("on_progress", on_progress))
    run.search.status = "bound"
    run.within_limits(run.bound)
    run.search.columns = None
    return run.finish()

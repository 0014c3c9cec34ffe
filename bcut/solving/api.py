"""`solve` and `bound`: from what a user writes to a verified result."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from math import comb, inf
from pathlib import Path
from typing import Any

from bcut.errors import InputError, SeparatorLoadError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.formulation import Formulation
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.symmetry import symmetry_group
from bcut.instance import load_instance
from bcut.objectives.measures import read_costs
from bcut.objectives.objective import make_objective
from bcut.result import Certificate, Question, Result
from bcut.separation.driver import check_names
from bcut.separation.resolve import resolve
from bcut.separation.seam import Separator
from bcut.solving.by_orbits import bound_by_orbits, known_triangulation, solve_by_orbits
from bcut.solving.certificates import make_certificate
from bcut.solving.orbit_stage import OrbitStage, orbit_stage
from bcut.solving.report import make_result
from bcut.solving.search import Part, Progress, Search, bound_at_root, place
from bcut.solving.strategies import solve_at_once, solve_by_targets, solve_in_scip

DEFAULT_SEPARATORS = ("link",)
FORMULATIONS: dict[str, Callable[..., Formulation]] = {"2": cocircuit_formulation}
METHODS = ("auto", "listing", "orbits", "scip")
# From so many (d+1)-subsets on, the symmetries of a configuration are used where it has any.
_ORBITS_FROM = 200_000

InstanceLike = str | os.PathLike[str] | PointConfiguration
SeparatorLike = str | Separator | type[Separator]


def solve(
    instance: InstanceLike,
    *,
    objective: str = "cardinality",
    sense: str = "min",
    formulation: str = "2",
    spanning: bool = False,
    separators: Sequence[SeparatorLike] | None = None,
    time_limit: float | None = None,
    seed: int = 0,
    method: str = "auto",
    on_progress: Progress | None = None,
) -> Result:
    """Find an optimal triangulation.

    Parameters
    ----------
    instance : str, path or PointConfiguration
        A file, a bundled instance or a family (``"cube:4"``).
    objective : str
        ``"cardinality"``, ``"costs:FILE"``, ``"random-costs:SEED"``.
    sense : {"min", "max"}
    formulation : {"2"}
    spanning : bool
        Only triangulations that use every point.
    separators : sequence of str, Separator or Separator subclass, optional
        The cut families at work; a default set when omitted, none when empty.
    time_limit : float, optional
        In seconds; what was found is returned when it is reached.
    seed : int
        Of the solver's random choices.
    method : {"auto", "listing", "orbits", "scip"}
        "listing" lists all simplices, bounds and fixes at the root, and lets SCIP branch on what is left; "orbits"
        does so with orbits of simplices under the symmetries, for cardinality only; "scip" hands SCIP everything.
        "auto" takes orbits for large symmetric configurations, and lists otherwise.
    on_progress : callable, optional
        Told of stages, bounds and incumbents, as a dict.

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
    run = _Run(
        instance, objective, sense, formulation, spanning, separators, time_limit, seed, method, on_progress
    )
    search = run.search
    try:
        run.solve()
    except KeyboardInterrupt:
        search.status = "interrupted"
    if search.columns is None and search.status != "infeasible":
        place(search)
    return run.finish()


def bound(
    instance: InstanceLike,
    *,
    objective: str = "cardinality",
    sense: str = "min",
    formulation: str = "2",
    spanning: bool = False,
    separators: Sequence[SeparatorLike] | None = None,
    time_limit: float | None = None,
    seed: int = 0,
    method: str = "auto",
    on_progress: Progress | None = None,
) -> Result:
    """Bound the optimum at the root, before and after cuts, with no branching and none of the solver's own cuts.

    Parameters are those of `solve`, but for the method "scip". The result has status "bound" and no triangulation. Over
    orbits, "link" is the only family that is at work, averaged over the symmetries.
    """
    if method == "scip":
        raise InputError("method 'scip': it is for solve only; known here are auto, listing and orbits")
    run = _Run(
        instance, objective, sense, formulation, spanning, separators, time_limit, seed, method, on_progress
    )
    run.search.status = "bound"
    try:
        run.bound()
    except KeyboardInterrupt:
        run.search.status = "interrupted"
    run.search.columns = None
    return run.finish()


class _Run:
    """One run: its checked input, its search, and the result made from it."""

    def __init__(
        self,
        instance: InstanceLike,
        objective: str,
        sense: str,
        formulation: str,
        spanning: bool,
        separators: Sequence[SeparatorLike] | None,
        time_limit: float | None,
        seed: int,
        method: str,
        on_progress: Progress | None,
    ) -> None:
        self.started = time.perf_counter()
        _check_options(formulation, time_limit, seed, method)
        given = DEFAULT_SEPARATORS if separators is None else tuple(separators)
        check_names([_make(item) for item in given])
        deadline = None if time_limit is None else time.monotonic() + time_limit
        self.configuration = instance if isinstance(instance, PointConfiguration) else load_instance(instance)
        started = time.perf_counter()
        self.method = method
        families = {_describe(item).split(":")[0] for item in given}
        self.link, self.only_link = "link" in families, families <= {"link"}
        self.stage = self._orbits(objective, sense, spanning, time_limit)
        if self.stage is None:
            listed = FORMULATIONS[formulation](self.configuration, spanning=spanning)
            whole = Part.whole(listed, make_objective(objective, listed, sense=sense))
            self.size = listed.size
        else:
            whole = known_triangulation(self.stage)
            self.size = (int(self.stage.formulation.sizes.sum()), self.stage.formulation.matrix.shape[0] + 1)
        self.search = Search(
            whole=whole,
            make_separators=lambda: [_make(item) for item in given],
            deadline=deadline,
            seed=seed,
            on_progress=on_progress,
        )
        self.search.seconds["model"] = time.perf_counter() - started
        self.question = Question(
            objective=objective,
            sense=sense,
            spanning=spanning,
            formulation=formulation,
            separators=[_describe(item) for item in given],
            seed=seed,
            limits={"time": time_limit},
            method=self.method,
            costs=_embedded_costs(objective, self.configuration),
        )

    def _orbits(self, objective: str, sense: str, spanning: bool, seconds: float | None) -> OrbitStage | None:
        """Return the stage over orbits where that is the way to go, and settle what "auto" means."""
        n, d = self.configuration.n, self.configuration.dimension
        invariant = objective == "cardinality"
        if self.method == "orbits" and not invariant:
            raise InputError(
                f"method 'orbits': objective '{objective}' is not known to be invariant; use cardinality"
            )
        if self.method == "auto":
            # Other families than link are at work in the tree only, over orbits: who asks for them wants the listing.
            large = invariant and self.only_link and comb(n, d + 1) >= _ORBITS_FROM
            symmetric = large and symmetry_group(self.configuration).order > 1
            self.method = "orbits" if symmetric else "listing"
        if self.method != "orbits":
            return None
        return orbit_stage(self.configuration, objective, sense=sense, spanning=spanning, seconds=seconds)

    def solve(self) -> None:
        """Search for an optimum."""
        if self.stage is not None:
            solve_by_orbits(self.search, self.stage, cuts=self.link)
        elif self.method == "scip":
            solve_in_scip(self.search)
        elif self.search.whole.objective.counts_units:
            solve_by_targets(self.search)
        else:
            solve_at_once(self.search)

    def bound(self) -> None:
        """Bound at the root only."""
        search = self.search
        if self.stage is not None:
            bound_by_orbits(search, self.stage, cuts=self.link)
            search.status = "limit" if search.bound is None else "bound"
            return
        root = bound_at_root(search, search.whole, search.separation(search.whole))
        search.exact = root.first
        if root.last is not None:
            search.raise_bound(root.last.value)
        if root.status == "limit":
            search.status = "limit"

    def finish(self) -> Result:
        """Verify what was found and write it down."""
        return make_result(
            self.configuration,
            self.question,
            self.search,
            size=self.size,
            certificate=self.certificate(),
            started=self.started,
        )

    def certificate(self) -> Certificate:
        """Write out the multipliers of the exact bound without cuts."""
        exact = self.search.exact
        if self.search.certificate is not None:
            return self.search.certificate
        if exact is None:
            return Certificate(reason="no relaxation was solved to optimality outside SCIP")
        return make_certificate(self.search.whole.formulation, self.search.whole.objective, exact)


def _check_options(formulation: str, time_limit: float | None, seed: int, method: str) -> None:
    if formulation not in FORMULATIONS:
        raise InputError(f"unknown formulation '{formulation}': known are {', '.join(FORMULATIONS)}")
    if method not in METHODS:
        raise InputError(f"unknown method '{method}': known are {', '.join(METHODS)}")
    if time_limit is not None and not 0 <= time_limit < inf:
        raise InputError(f"time limit {time_limit}: give a finite number of seconds that is not negative")
    if seed < 0:
        raise InputError(f"seed {seed}: give an integer that is not negative")


def _make(item: SeparatorLike) -> Separator:
    if isinstance(item, str):
        return resolve(item)
    made: Any = item() if isinstance(item, type) else item
    if not isinstance(made, Separator):
        raise SeparatorLoadError(f"{item!r} is no separator: give a name, a file, or a bcut.Separator")
    return made


def _describe(item: SeparatorLike) -> str:
    return item if isinstance(item, str) else item.name


def _embedded_costs(objective: str, configuration: PointConfiguration) -> dict[str, Any] | None:
    """Return the table of a costs file, so that the result alone is enough to verify the value."""
    kind, _, path = objective.partition(":")
    if kind != "costs":
        return None
    default, table = read_costs(Path(path), configuration)
    entries = [[list(simplex), str(cost)] for simplex, cost in sorted(table.items())]
    return {"default": str(default), "costs": entries}

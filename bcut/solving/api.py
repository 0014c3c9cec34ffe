"""`solve` and `bound`: from what a user writes to a verified result."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Sequence
from fractions import Fraction
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

import bcut
from bcut.errors import InputError, SeparatorLoadError, SolverError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.formulation import Formulation
from bcut.geometry.configuration import PointConfiguration
from bcut.instance import load_instance
from bcut.objectives.measures import read_costs
from bcut.objectives.objective import make_objective
from bcut.result import Certificate, Instance, Question, Result, Root, RoundRecord, Size
from bcut.separation.driver import check_names
from bcut.separation.resolve import resolve
from bcut.separation.seam import Separator
from bcut.solving.certificates import make_certificate
from bcut.solving.search import Part, Progress, Search, bound_at_root, place
from bcut.solving.strategies import solve_at_once, solve_by_targets, solve_in_scip

DEFAULT_SEPARATORS = ("link",)
FORMULATIONS: dict[str, Callable[..., Formulation]] = {"2": cocircuit_formulation}
METHODS = ("auto", "scip")

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
    method : {"auto", "scip"}
        "auto" bounds and fixes at the root before SCIP branches on what is left; "scip" hands SCIP everything.
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
        _choose(method, search)(search)
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
    on_progress: Progress | None = None,
) -> Result:
    """Bound the optimum at the root, before and after cuts, with no branching and none of the solver's own cuts.

    Parameters are those of `solve`. The result has status "bound" and no triangulation.
    """
    run = _Run(
        instance, objective, sense, formulation, spanning, separators, time_limit, seed, "auto", on_progress
    )
    search = run.search
    search.status = "bound"
    try:
        root = bound_at_root(search, search.whole, search.separation(search.whole))
        search.exact = root.first
        if root.last is not None:
            search.raise_bound(root.last.value)
        if root.status == "limit":
            search.status = "limit"
    except KeyboardInterrupt:
        search.status = "interrupted"
    search.columns = None
    return run.finish()


def _choose(method: str, search: Search) -> Callable[[Search], None]:
    if method == "scip":
        return solve_in_scip
    return solve_by_targets if search.whole.objective.counts_units else solve_at_once


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
        self.formulation = FORMULATIONS[formulation](self.configuration, spanning=spanning)
        self.objective = make_objective(objective, self.formulation, sense=sense)
        self.search = Search(
            whole=Part.whole(self.formulation, self.objective),
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
            method=method,
            costs=_embedded_costs(objective, self.configuration),
        )

    def finish(self) -> Result:
        """Verify what was found and write it down."""
        search = self.search
        triangulation = None
        if search.columns is not None:
            triangulation = self.formulation.simplices[np.sort(search.columns)].tolist()
            with search.timed("verify"):
                self._verify(triangulation)
        search.seconds["total"] = time.perf_counter() - self.started
        sign = search.sign
        proven = None if search.bound is None else sign * self.objective.rounded_up(search.bound)
        return Result(
            instance=_describe_instance(self.configuration),
            problem=self.question,
            status=search.status,
            value=_number(search.value),
            bound=_number(proven),
            gap=_gap(search.value, proven),
            root=Root(
                search.lp,
                search.lp_after_cuts,
                search.root_is_integral,
                [_record(*item) for item in search.rounds],
            ),
            size=Size(*self.formulation.size, search.columns_after_fixing),
            nodes=search.nodes,
            separators={name: vars(family).copy() for name, family in search.statistics.items()},
            seconds=search.seconds,
            triangulation=triangulation,
            certificate=self._certificate(),
            versions=_versions(),
        )

    def _verify(self, triangulation: list[list[int]]) -> None:
        from bcut.errors import VerificationError
        from bcut.verification.triangulation import check_triangulation

        try:
            check_triangulation(self.configuration.scalars(), triangulation, spanning=self.question.spanning)
        except VerificationError as error:
            raise SolverError(
                f"{self.configuration.name}: the solver's answer is no triangulation: {error}"
            ) from error

    def _certificate(self) -> Certificate:
        search = self.search
        if search.exact is None:
            return Certificate(reason="no relaxation was solved to optimality outside SCIP")
        return make_certificate(self.formulation, self.objective, search.exact)


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


def _describe_instance(configuration: PointConfiguration) -> Instance:
    points = [list(point) for point in configuration.exact_points()]
    return Instance(configuration.name, configuration.dimension, points, configuration.digest)


def _embedded_costs(objective: str, configuration: PointConfiguration) -> dict[str, Any] | None:
    """Return the table of a costs file, so that the result alone is enough to verify the value."""
    kind, _, path = objective.partition(":")
    if kind != "costs":
        return None
    default, table = read_costs(Path(path), configuration)
    entries = [[list(simplex), str(cost)] for simplex, cost in sorted(table.items())]
    return {"default": str(default), "costs": entries}


def _record(stage: str, finished: Any) -> RoundRecord:
    return RoundRecord(finished.lp, finished.cuts, stage)


def _number(value: Fraction | None) -> int | float | None:
    if value is None:
        return None
    return int(value) if value.denominator == 1 else float(value)


def _gap(value: Fraction | None, proven: Fraction | None) -> float | None:
    if value is None or proven is None:
        return None
    return abs(float(value - proven)) / max(1.0, abs(float(value)))


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    return {
        "bcut": bcut.__version__,
        "scip": _scip_version(),
        "pyscipopt": version("pyscipopt"),
        "highs": version("highspy"),
        "python": platform.python_version(),
    }


def _scip_version() -> str:
    """Return SCIP's version from the library when it is loaded anyway, so that root-only runs need not load it."""
    import sys

    if "pyscipopt" not in sys.modules:
        return "not used"
    from bcut.scip.host import scip_version

    return scip_version()

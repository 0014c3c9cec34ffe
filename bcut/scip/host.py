"""Branch-and-cut: a formulation and separators in, an optimum or the best that the limits allowed out."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pyscipopt import SCIP_PARAMSETTING, Model, Variable

from bcut.bounds.root import Round
from bcut.errors import SolverError
from bcut.formulations.formulation import Formulation
from bcut.objectives.objective import Objective
from bcut.scip.console import native_output_to_stderr
from bcut.scip.lazy import LazyRowsHandler
from bcut.scip.model import build_model
from bcut.scip.plugins import LpValues, Observer, RootRecord, SeparatorAdapter
from bcut.scip.root_lp import RootLpWatcher
from bcut.scip.statistics import SolverStatistics, read_statistics
from bcut.separation.driver import IntegerCut, Separation

# SCIP's own infinity: the largest time limit that it accepts.
_LONGEST = 1e20

TreeStatus = Literal["optimal", "infeasible", "limit", "interrupted"]


@dataclass(frozen=True)
class TreeOptions:
    """How SCIP is to search.

    Attributes
    ----------
    seconds : float, optional
        Time limit.
    nodes : int, optional
        Node limit; 1 stops after the root.
    seed : int
        Of SCIP's random number generators.
    cutoff : float, optional
        Only solutions strictly better than this value (in the sense of the objective) are wanted.
    scip_separators : bool
        Whether SCIP's own separators run.
    unlimited : tuple of str
        Separators of SCIP, such as "zerohalf", that run at the root without a limit on rounds or cuts,
        whether or not the others run.
    named : tuple of str
        Separators of SCIP that run at the root within their usual limits, whether or not the others run.
    presolve : bool
    heuristics : bool
    separate_every : int
        Depths between nodes at which our separators run; 0 for the root only.
    root_rounds, tree_rounds : int
        Rounds of our separators per node.
    plain : bool
        Leave all parameters of SCIP at their defaults, but for the seed and the limits.
    statistics : bool
        Whether to ask SCIP afterwards where its time went.
    """

    seconds: float | None = None
    nodes: int | None = None
    seed: int = 0
    cutoff: float | None = None
    scip_separators: bool = True
    unlimited: tuple[str, ...] = ()
    named: tuple[str, ...] = ()
    presolve: bool = True
    heuristics: bool = True
    separate_every: int = 1
    root_rounds: int = 1000
    tree_rounds: int = 5
    plain: bool = False
    statistics: bool = False


@dataclass
class TreeResult:
    """What SCIP found.

    Attributes
    ----------
    status : {"optimal", "infeasible", "limit", "interrupted"}
        "infeasible" also when nothing is better than the cutoff.
    columns : ndarray of int, or None
        The chosen simplices of the best solution; where nothing is better than the cutoff, perhaps one that
        is not.
    bound : float or None
        SCIP's dual bound, in the sense of the objective.
    nodes : int
    rounds : list of Round
        Root relaxations.
    seconds : float
    watching, watching_processor : float
        Those of them that `on_root_lp` took, with what it is shown; and its processor time.
    solver : SolverStatistics or None
        Where they were asked for.
    """

    status: TreeStatus
    columns: NDArray[np.int64] | None
    bound: float | None
    nodes: int
    rounds: list[Round] = field(default_factory=list)
    seconds: float = 0.0
    watching: float = 0.0
    watching_processor: float = 0.0
    solver: SolverStatistics | None = None


def branch_and_cut(
    formulation: Formulation,
    objective: Objective,
    separation: Separation | None = None,
    *,
    options: TreeOptions | None = None,
    cuts: Sequence[IntegerCut] = (),
    start: NDArray[np.integer] | None = None,
    on_progress: Callable[[dict[str, Any]], None] | None = None,
    on_root_lp: RootLpWatcher | None = None,
) -> TreeResult:
    """Solve a formulation with SCIP.

    Parameters
    ----------
    formulation : Formulation
    objective : Objective
    separation : Separation, optional
        Our separators at work on exactly this formulation.
    options : TreeOptions, optional
    cuts : sequence of IntegerCut
        Known valid cuts, rows of the root relaxation from the start.
    start : ndarray of int, optional
        Columns of a known triangulation.
    on_progress : callable, optional
        Told of new bounds and incumbents.
    on_root_lp : callable, optional
        Shown every relaxation of the root as SCIP solved it, with the rows of all separators.

    Raises
    ------
    SeparatorError
        If a separator raised.
    SolverError
        If SCIP failed.
    """
    options = options or TreeOptions()
    started = time.perf_counter()
    unit = float(objective.solver_unit)
    model, variables = build_model(
        formulation, objective, cuts=cuts, name=formulation.configuration.name, costs=objective.solver_costs
    )
    _set_parameters(model, formulation, options)
    _set_limits(model, options, time.perf_counter() - started, unit)
    # Separators and records see the d-simplices only.
    simplices = variables[: len(formulation.simplices)]
    values = LpValues(simplices)
    ours = {separator.name for separator in separation.separators} if separation is not None else set()
    record = RootRecord(objective, on_root_lp, ours)
    adapter = _include_adapter(model, separation, values, record, options)
    observer = Observer(values, record, on_progress, unit, separation)
    model.includeEventhdlr(observer, "bcut-observer", "records root bounds and reports progress")
    lazy = LazyRowsHandler(formulation.lazy, variables)
    if formulation.lazy:
        lazy.include_in(model)
    if start is not None:
        _add_start(model, variables, formulation.completed(start))
    error = _optimize(model)
    captured = adapter.error or observer.error or lazy.error
    if captured is not None:
        raise captured
    if error is not None:
        raise SolverError(f"SCIP failed on {formulation.configuration.name}: {error}") from error
    result = _collect(model, simplices, record, unit)
    result.seconds = time.perf_counter() - started
    result.watching, result.watching_processor = record.watching, record.watching_processor
    if options.statistics:
        result.solver = read_statistics(model)
    model.freeProb()
    return result


def _set_parameters(model: Model, formulation: Formulation, options: TreeOptions) -> None:
    model.setParam("randomization/randomseedshift", options.seed % 2**31)
    # One Ctrl-C stops the search and keeps the incumbent.
    model.setParam("misc/catchctrlc", True)
    if options.plain:
        return
    # What enclosing rows leave between them is less than SCIP's tolerance: its presolve and its own cuts take more.
    narrow = formulation.has_enclosing_rows
    if narrow or not options.presolve:
        model.setPresolve(SCIP_PARAMSETTING.OFF)
        model.setParam("presolving/maxrestarts", 0)
    # Probing takes most of the time on these models and finds next to nothing.
    model.setParam("propagating/probing/maxprerounds", 0)
    if narrow or not options.scip_separators:
        model.setSeparating(SCIP_PARAMSETTING.OFF)
    for name in (*options.named, *options.unlimited):
        model.setParam(f"separating/{name}/freq", 0)
    for name in options.unlimited:
        model.setParam(f"separating/{name}/maxroundsroot", -1)
        model.setParam(f"separating/{name}/maxsepacutsroot", 2**30)
        _unlimit_rounds(model)
    if not options.heuristics:
        model.setHeuristics(SCIP_PARAMSETTING.OFF)


def _set_limits(model: Model, options: TreeOptions, elapsed: float, unit: float) -> None:
    if options.seconds is not None:
        model.setParam("limits/time", min(max(0.0, options.seconds - elapsed), _LONGEST))
    if options.nodes is not None:
        model.setParam("limits/totalnodes", options.nodes)
    if options.cutoff is not None:
        model.setObjlimit(options.cutoff / unit)


def _include_adapter(
    model: Model, separation: Separation | None, values: LpValues, record: RootRecord, options: TreeOptions
) -> SeparatorAdapter:
    if separation is not None and not separation.separators:
        separation = None
    adapter = SeparatorAdapter(separation, values, record, options.root_rounds, options.tree_rounds)
    # Without separators it records the rounds of the root.
    frequency = 0 if separation is None else options.separate_every
    model.includeSepa(adapter, "bcut", "separators of bcut", priority=1_000_000, freq=frequency, delay=False)
    # By default SCIP calls a separator at depths 0, 1, 4, 16, ... whatever its frequency says.
    model.setParam("separating/bcut/expbackoff", 1)
    if separation is not None:
        # Rounds are limited by the adapter.
        _unlimit_rounds(model)
    return adapter


def _unlimit_rounds(model: Model) -> None:
    """Lift SCIP's overall limits on root rounds, which would end separation after a few that do not move the bound."""
    model.setParam("separating/maxstallroundsroot", -1)
    model.setParam("separating/maxroundsroot", -1)


def _add_start(model: Model, variables: list[Variable], start: NDArray[np.integer]) -> None:
    solution = model.createSol()
    for variable in variables:
        model.setSolVal(solution, variable, 0.0)
    for column in start.tolist():
        model.setSolVal(solution, variables[column], 1.0)
    model.addSol(solution)


def _optimize(model: Model) -> Exception | None:
    """Run SCIP; an exception here is either its own or a symptom of one captured in a callback."""
    try:
        with native_output_to_stderr():
            model.optimize()
    except Exception as error:
        return error
    return None


def _collect(model: Model, variables: list[Variable], record: RootRecord, unit: float) -> TreeResult:
    status = model.getStatus()
    columns = None
    if model.getNSols() > 0:
        best = model.getBestSol()
        chosen = [
            column for column, variable in enumerate(variables) if model.getSolVal(best, variable) > 0.5
        ]
        columns = np.array(chosen, dtype=np.int64)
    bound = model.getDualbound()
    outcome: TreeStatus
    if status == "optimal":
        outcome = "optimal"
    elif status in ("infeasible", "inforunbd"):
        outcome = "infeasible"
    elif status in ("userinterrupt", "terminate"):
        outcome = "interrupted"
    elif status in ("timelimit", "nodelimit", "totalnodelimit", "memlimit", "gaplimit", "stallnodelimit"):
        outcome = "limit"
    else:
        raise SolverError(f"SCIP ended with the unexpected status '{status}'")
    return TreeResult(
        outcome,
        columns,
        None if abs(bound) >= model.infinity() else float(bound) * unit,
        int(model.getNTotalNodes()),
        record.rounds,
    )


def scip_separators() -> list[str]:
    """Return the names of SCIP's own separators."""
    names = (re.fullmatch(r"separating/(\w+)/freq", parameter) for parameter in Model().getParams())
    return sorted(match[1] for match in names if match)


@cache
def scip_version() -> str:
    """Return the version of the SCIP library, such as "10.0.2"."""
    model = Model()
    return f"{model.getMajorVersion()}.{model.getMinorVersion()}.{model.getTechVersion()}"

"""Bounds on large linear programs by a first-order method.

The method needs nothing but products with the matrix (`bcut.bounds.halpern`), and multipliers become bounds by a small
repair (`bcut.bounds.repair`). What makes the difference on cocircuit rows is a third thing: only one of them is not
homogeneous, and what it says has to travel from simplex to simplex, one in each iteration. Combinations of the rows
that say the same at many places (`bcut.bounds.coverage_points`) divide the number of iterations by two to thirteen
(benchmarks/README.md). Their multipliers are turned back into those of the rows.

All in floating-point numbers: `bcut.bounds.safe` proves what the multipliers are worth.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bcut.bounds.halpern import HalpernIteration
from bcut.bounds.repair import Floats, Program, Repair

Status = Literal["converged", "stopped", "iterations", "time", "interrupted"]

# Iterations between two looks at the bound.
_CHECK = 40


@dataclass(frozen=True)
class Progress:
    """How far the method has come.

    Attributes
    ----------
    iterations : int
    seconds : float
    bound : float
        The best so far.
    dual, primal : float
        Values of the current point.
    infeasibility : float
        The largest violation of a row by the current point.
    within : int or None
        With an incumbent: how many columns a better solution can use, as far as the bound tells.
    """

    iterations: int
    seconds: float
    bound: float
    dual: float
    primal: float
    infeasibility: float
    within: int | None


@dataclass(frozen=True, eq=False)
class FirstOrder:
    """What the method found.

    Attributes
    ----------
    status : {"converged", "stopped", "iterations", "time", "interrupted"}
        Why it ended: the bound agrees with the primal value to within the tolerance, the caller's `stop` said so,
        a limit, or Ctrl-C. The rest is valid in any case.
    bound : float
        What `duals` prove, up to rounding.
    duals : ndarray of float, shape (rows,)
        Multipliers of the rows, without those of combinations, repaired.
    reduced_costs : ndarray of float, shape (m,)
        For these multipliers.
    x : ndarray of float, shape (m,)
        The last primal point: nearly feasible, with small entries of either sign where it tends to 0.
    history : tuple of (int, float, float)
        Iterations, best bound and seconds, at every check.
    """

    status: Status
    bound: float
    duals: Floats
    reduced_costs: Floats
    x: Floats
    history: tuple[tuple[int, float, float], ...]

    @property
    def iterations(self) -> int:
        """Iterations made until the last check."""
        return self.history[-1][0] if self.history else 0


def first_order_bound(
    program: Program,
    *,
    anchor: Floats | None = None,
    start: tuple[Floats | None, Floats | None] = (None, None),
    incumbent: float | None = None,
    tolerance: float = 1e-4,
    iterations: int = 100_000,
    seconds: float | None = None,
    on_progress: Callable[[Progress], None] | None = None,
    stop: Callable[[Progress], bool] | None = None,
) -> FirstOrder:
    """Bound a linear program from below.

    Parameters
    ----------
    program : Program
    anchor : ndarray of float, shape (rows,), optional
        Multipliers with positive reduced costs, for programs with costs that are not positive; see `Repair`.
    start : pair of ndarray of float, or None
        x and multipliers to start from.
    incumbent : float, optional
        The value of a known solution: then progress counts the columns that a better one may use.
    tolerance : float
        Stop when bound and primal value are this close, relative to their size, and rows are satisfied to within it,
        relative to the largest right-hand side.
    iterations, seconds : optional
        Limits.
    on_progress, stop : callable, optional
        Told of the progress every few iterations; `stop` tells whether to end.

    Returns
    -------
    FirstOrder
        The same in every run, but for `seconds`. After Ctrl-C, what was found until then.
    """
    run = _Run(program, anchor, incumbent, tolerance)
    status: Status = "iterations"
    if not program.columns.count:
        return run.result(status)
    try:
        iteration = HalpernIteration(program, run.repair, start)
        run.x = iteration.x
        while iteration.iterations < iterations:
            iteration.advance()
            late = seconds is not None and run.elapsed > seconds
            if not late and iteration.iterations % _CHECK and iteration.iterations < iterations:
                continue
            progress, agrees = run.check(iteration)
            if on_progress is not None:
                on_progress(progress)
            stopped = stop is not None and stop(progress)
            if stopped or agrees or late:
                status = "stopped" if stopped else "converged" if agrees else "time"
                break
    except KeyboardInterrupt:
        status = "interrupted"
    return run.result(status)


class _Run:
    """One run: the best bound so far, and its history."""

    def __init__(
        self, program: Program, anchor: Floats | None, incumbent: float | None, tolerance: float
    ) -> None:
        self.started = time.perf_counter()
        self.program, self.incumbent, self.tolerance = program, incumbent, tolerance
        self.repair = Repair(program, anchor)
        # Bound and multipliers: one assignment, so that Ctrl-C cannot come between the two.
        self.best = self.repair.repaired(self.repair.anchor, self.repair.slack)
        self.within: int | None = None
        self.history: list[tuple[int, float, float]] = []
        self.x = np.zeros(program.columns.count)
        self.reduced = np.empty(program.columns.count)

    @property
    def elapsed(self) -> float:
        return time.perf_counter() - self.started

    def check(self, iteration: HalpernIteration) -> tuple[Progress, bool]:
        """Turn the current point into a bound; tell whether it agrees with the primal value."""
        program, repair = self.program, self.repair
        y, x = iteration.projected_y, iteration.x
        program.columns.reduced(program.costs, y, self.reduced)
        found = repair.repaired(y, self.reduced)
        if found[0] > self.best[0]:
            self.best = found
            if self.incumbent is not None:
                reduced = program.columns.reduced(program.costs, found[1], self.reduced)
                self.within = int((reduced <= self.incumbent - found[0]).sum())
        bound = self.best[0]
        self.history.append((iteration.iterations, bound, self.elapsed))
        dual, primal = repair.value(y), float((program.costs * x).sum())
        below = np.max(program.lower - iteration.products, initial=0.0)
        above = np.max(iteration.products - program.upper, initial=0.0)
        infeasibility = float(max(below, above))
        size = max(abs(primal), abs(bound), 1e-300)
        agrees = infeasibility <= self.tolerance * program.largest_side
        agrees = agrees and abs(primal - bound) <= self.tolerance * size
        if not repair.scales:
            # Reduced costs that stay a little above 0 lose less than those below 0, of which there may be many.
            iteration.margin = 0.25 * self.tolerance * abs(dual) / max(float(np.abs(x).sum()), 1.0)
        progress = Progress(
            iteration.iterations, self.elapsed, bound, dual, primal, infeasibility, self.within
        )
        return progress, agrees

    def result(self, status: Status) -> FirstOrder:
        bound, duals = self.best
        reduced = self.program.columns.reduced(self.program.costs, duals, self.reduced)
        own = self.program.without_combinations(duals)
        return FirstOrder(status, bound, own, reduced, self.x, tuple(self.history))

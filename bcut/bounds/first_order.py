"""Bounds on large linear programs by a first-order method.

The primal-dual hybrid gradient method needs nothing but products with the matrix. Here it is restarted and reflected
Halpern iteration on it, as in "rHPDHG" (Lu, Yang 2024) and cuPDLPx (Lu, Peng, Yang 2025): the k-th point after a restart
is

    z_{k+1} = (k + 1) / (k + 2) * (2 T(z_k) - z_k) + 1 / (k + 2) * z_0,

with T one step of the method; it restarts when z - T(z) has become small enough, or has stopped shrinking. What is ours:

- **Step lengths that follow the reduced costs.** With weights p > 0 on the columns, the lengths
  ``p_j / sum_i |a_ij|`` and ``1 / sum_j |a_ij| p_j`` are those of Pock and Chambolle (2011) for scaled columns.
  Columns with large reduced costs, which will be 0 in the end, need not slow down their rows: at restarts, p_j
  becomes smaller the larger they are. A third to a half of the iterations are saved.
- **Combinations of rows as further rows.** The program has one row that is not homogeneous, and what it says has to
  travel from row to row otherwise: `bcut.bounds.coverage_points` says the same at many places, which divides the number
  of iterations by five to thirty. Multipliers of combinations are turned back into those of the rows.
- **Columns at rest are visited in every tenth iteration only**, unless their reduced costs are about to change sign.

A bound needs multipliers with reduced costs that are not negative. Multipliers y with such reduced costs r only
nearly become ``(1 - t) y + t a``, t as small as possible, for an `anchor` a whose reduced costs are all positive:
with positive costs that is a = 0, and the repaired multipliers are y divided by ``1 + max(-r_j / c_j)``. Floating-point
numbers only: `bcut.bounds.safe` proves what the returned multipliers are worth.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from math import exp, inf, log, sqrt
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.columns import Columns

if TYPE_CHECKING:
    import scipy.sparse as sp

Floats = NDArray[np.float64]

# Restart when the residual has shrunk by the first factor, or by the second and begins to grow, or when this share of
# all iterations was made since the last restart.
_MUCH, _ENOUGH, _LONG = 0.1, 0.9, 0.36
# How far the primal weight goes to what the last stretch suggests, on a logarithmic scale.
_SMOOTHING = 0.5
# Weights of columns are divided by this plus their reduced costs, relative to their costs.
_FLOOR = 0.03
# Step lengths follow reduced costs from this iteration on, whenever the number of iterations has grown by this factor.
_FIRST_REFRESH, _REFRESH = 200, 1.2
# Share of the largest stable step length, and iterations of the power method that estimates it.
_SAFETY, _POWER_FIRST, _POWER_AGAIN = 0.97, 25, 8
# Passes over all columns; between them, over those that may move.
_PERIOD, _WIDE = 10, 2.0
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
        Values of the current point, which satisfies its rows up to `infeasibility`.
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
        ``lower``/``upper`` weighted by `duals`, plus what negative reduced costs take away; up to rounding.
    duals : ndarray of float, shape (rows,)
        Multipliers that prove it, repaired.
    reduced_costs : ndarray of float, shape (m,)
        For these multipliers.
    x : ndarray of float, shape (m,)
        The last primal point: nearly feasible, with small entries of either sign where it tends to 0.
    history : tuple of (int, float, float)
        Iterations, best bound and seconds, at every check.
    """

    status: Literal["converged", "stopped", "iterations", "time", "interrupted"]
    bound: float
    duals: Floats
    reduced_costs: Floats
    x: Floats
    history: tuple[tuple[int, float, float], ...]

    @property
    def iterations(self) -> int:
        """Iterations made until the last check."""
        return self.history[-1][0] if self.history else 0


@dataclass(frozen=True, eq=False)
class Program:
    """Minimise ``costs @ x`` over ``lower <= A x <= upper`` and x >= 0.

    Attributes
    ----------
    columns : Columns
        A. Rows ``columns.rows - combinations.shape[0]`` onwards are `combinations` of those before.
    costs : ndarray of float, shape (m,)
    lower, upper : ndarray of float, shape (rows,)
        Infinite where a row has no such side.
    column_upper : float or ndarray of float, shape (m,)
        Upper bounds on x that the rows imply; infinite if unknown. They serve to turn multipliers into bounds
        where costs are not positive, and to nothing else.
    combinations : sparse matrix, or None
    """

    columns: Columns
    costs: Floats
    lower: Floats
    upper: Floats
    column_upper: float | Floats = inf
    combinations: sp.sparray | None = None

    def with_combinations(self, combinations: sp.sparray) -> Program:
        """Append combinations of rows that are equations; the first that this is done to has none.

        Parameters
        ----------
        combinations : sparse matrix, shape (k, rows)
        """
        used = np.unique(combinations.tocsr().indices)
        if not np.array_equal(self.lower[used], self.upper[used]):
            raise ValueError("only equations can be combined")
        sides = combinations @ np.where(self.lower == self.upper, self.lower, 0.0)
        return Program(
            self.columns.with_combinations(combinations),
            self.costs,
            np.concatenate((self.lower, sides)),
            np.concatenate((self.upper, sides)),
            self.column_upper,
            combinations,
        )

    def without_combinations(self, y: Floats) -> Floats:
        """Return the multipliers of the rows themselves."""
        if self.combinations is None:
            return y
        rows = self.combinations.shape[1]
        own: Floats = y[:rows] + self.combinations.T @ y[rows:]
        return own


class Repair:
    """Turns multipliers into bounds.

    Parameters
    ----------
    program : Program
    anchor : ndarray of float, shape (rows,), optional
        Multipliers with positive reduced costs; zeros will do where all costs are positive. If there is none, negative
        reduced costs are paid for with the upper bounds of their columns.
    """

    def __init__(self, program: Program, anchor: Floats | None = None) -> None:
        self.program = program
        self.anchor = np.zeros(program.columns.rows)
        self.slack = program.costs
        if anchor is not None:
            self.anchor[: len(anchor)] = anchor
            self.slack = program.columns.reduced(program.costs, self.anchor)
        self.scales = bool(self.slack.min(initial=inf) > 0)

    def value(self, y: Floats) -> float:
        """Return what the sides of the rows are worth."""
        program = self.program
        sides = np.where(y > 0, program.lower, program.upper)
        active = y != 0
        return float((y[active] * sides[active]).sum())

    def share(self, reduced: Floats) -> float:
        """Return how much of the anchor is needed until no reduced cost is negative."""
        worst = float(np.max(-reduced / self.slack, initial=0.0))
        # A little more, for the sake of rounding.
        return worst * (1 + 1e-9) / (1 + worst) if worst > 0 else 0.0

    def repaired(self, y: Floats, reduced: Floats) -> tuple[float, Floats]:
        """Return a bound and the multipliers that prove it.

        Parameters
        ----------
        y : ndarray of float, shape (rows,)
            Of signs that the rows allow.
        reduced : ndarray of float, shape (m,)
            Its reduced costs.
        """
        candidates = [(self.value(y) + self._loss(reduced), y)]
        if self.scales:
            share = self.share(reduced)
            mixed = (1 - share) * y + share * self.anchor
            candidates.append((self.value(mixed), mixed))
        return max(candidates, key=lambda pair: pair[0])

    def _loss(self, reduced: Floats) -> float:
        if np.all(np.isinf(self.program.column_upper)) and reduced.min(initial=0.0) < 0:
            return -inf
        return float((np.minimum(reduced, 0.0) * np.minimum(self.program.column_upper, 1e300)).sum())


class _Iteration:
    """The iteration itself: z = (x, y), where it started from, and its step lengths."""

    def __init__(self, program: Program, repair: Repair, start: tuple[Floats | None, Floats | None]) -> None:
        columns = program.columns
        count, rows = columns.count, columns.rows
        self.program, self.columns = program, columns
        x, y = start
        self.x = np.zeros(count) if x is None else np.array(x, dtype=float)
        self.y = np.zeros(rows)
        if y is not None:
            self.y[: len(y)] = y
        self.origin_x, self.origin_y = self.x.copy(), self.y.copy()
        self.products = columns.times(self.x)
        self.origin_products = self.products.copy()
        self.projected_y = self.y.copy()
        # What reduced costs are compared with.
        self.scale = repair.slack if repair.scales else np.full(count, float(np.abs(program.costs).mean() or 1))
        self.margin = 0.0
        self.row_scale = columns.row_scale()
        self.eigenvector = np.random.default_rng(1).standard_normal(rows)
        self.stable = inf
        self.weights = np.median(self.scale) / self.scale
        self._set_lengths(_POWER_FIRST)
        self.weight = 1.0
        self.before = np.full(count, -inf)
        self.near = np.empty(count, dtype=np.int32)
        self.listed, self.until_pass = -1, 0
        self.since_restart, self.iterations, self.refreshed = 0, 0, 0
        self.first_residual = self.last_residual = inf
        self.restart_next = False
        self._extended, self._sums = columns.extended(self.y), np.empty(2 * rows + 1)

    def advance(self) -> None:
        """Make one step."""
        from bcut.bounds._first_order_kernels import dual_step

        program, plain = self.program, self.restart_next
        share = (self.since_restart + 1) / (self.since_restart + 2)
        moved = self._primal_step(share, plain)
        crossed, moved_y = dual_step(
            self._sums,
            program.lower,
            program.upper,
            self.row_steps,
            self.length * self.weight,
            share,
            plain,
            self.y,
            self.origin_y,
            self.products,
            self.origin_products,
            self.projected_y,
        )
        self.iterations += 1
        if 2 * abs(crossed) > 0.999 * (moved + moved_y) + 1e-300:
            # The power method was too optimistic: with steps of this length the iteration need not converge.
            self.stable = self.length = 0.9 * self.length
            self.restart_next = True
        if plain:
            self._restart()
        else:
            self.since_restart += 1
            self._decide(sqrt(max(0.0, moved - 2 * crossed + moved_y)))

    def _primal_step(self, share: float, plain: bool) -> float:
        """Move x, leave the rows' products in `_sums`, and return the squared length of the step."""
        columns = self.columns
        self._sums[:] = 0.0
        columns.extended(self.y, self._extended)
        everything = self.until_pass <= 0
        moved, listed = columns.kernels.step(
            *columns.arrays,
            self.program.costs,
            self.margin,
            self.steps,
            self.length / self.weight,
            self._extended,
            self.x,
            self.origin_x,
            share,
            plain,
            self._sums,
            self.before,
            self.near,
            -1 if everything else self.listed,
            _WIDE,
        )
        if everything:
            self.listed, self.until_pass = listed, _PERIOD
        self.until_pass -= 1
        return float(moved)

    def _decide(self, residual: float) -> None:
        """Have the next step restart the iteration, where that is due."""
        if self.since_restart == 1:
            self.first_residual = residual
        elif (
            residual <= _MUCH * self.first_residual
            or (residual <= _ENOUGH * self.first_residual and residual > self.last_residual)
            or self.since_restart >= _LONG * self.iterations
        ):
            self.restart_next = True
        self.last_residual = residual

    def _restart(self) -> None:
        if self.iterations >= max(_FIRST_REFRESH, _REFRESH * self.refreshed):
            self._refresh()
        by_x = sqrt(float(((self.x - self.origin_x) ** 2 / self.steps).sum()))
        by_y = sqrt(float(((self.y - self.origin_y) ** 2 / self.row_steps).sum()))
        if by_x > 1e-12 and by_y > 1e-12:
            self.weight = exp(_SMOOTHING * log(by_y / by_x) + (1 - _SMOOTHING) * log(self.weight))
        self.origin_x[:] = self.x
        self.origin_y[:], self.origin_products[:] = self.y, self.products
        self.since_restart, self.until_pass, self.restart_next = 0, 0, False

    def _refresh(self) -> None:
        """Let step lengths follow the reduced costs."""
        self.refreshed = self.iterations
        # Not needed again before the next pass over all columns.
        reduced = self.columns.reduced(self.program.costs, self.y, self.before)
        fresh = 1 / ((_FLOOR + np.clip(reduced / self.scale, 0.0, 1.0)) * self.scale)
        # The columns in use keep their step lengths, and so the primal weight its meaning.
        fresh *= np.abs(self.x).sum() / max(float((fresh * np.abs(self.x)).sum()), 1e-300)
        self.weights = np.sqrt(fresh * self.weights)
        self.before.fill(-inf)
        self._set_lengths(_POWER_AGAIN)

    def _set_lengths(self, iterations: int) -> None:
        columns = self.columns
        rows, sums = np.zeros(2 * columns.rows + 1), np.empty(columns.count)
        scale = np.concatenate((self.row_scale, self.row_scale, [0.0]))
        columns.kernels.sizes(*columns.arrays, scale, self.weights, rows, sums)
        totals = rows[: columns.rows] + rows[columns.rows : -1]
        self.steps = self.weights / np.where(sums > 0, sums, 1.0)
        self.row_steps = self.row_scale / np.where(totals > 0, totals, 1.0)
        root, zeros = np.sqrt(self.row_steps), np.zeros(columns.count)
        for _ in range(iterations):
            self.eigenvector /= _norm(self.eigenvector)
            columns.reduced(zeros, root * self.eigenvector, sums)
            self.eigenvector = root * columns.times(-self.steps * sums)
        norm = sqrt(_norm(self.eigenvector))
        self.length = min(self.stable, _SAFETY / norm if norm > 0 else 1.0)


def _norm(vector: Floats) -> float:
    # Not the routine of BLAS, whose threads cost more than they give on vectors of this length.
    return sqrt(float(np.square(vector).sum()))


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
        Stop when bound and primal value are this close, relative to their size, and rows are satisfied to within it.
    iterations, seconds : optional
        Limits.
    on_progress, stop : callable, optional
        Told of the progress now and then; `stop` tells whether to end.

    Returns
    -------
    FirstOrder
        Deterministic but for `seconds`. After Ctrl-C, what was found until then.
    """
    return _Run(program, anchor, incumbent, tolerance, time.perf_counter()).run(
        start, iterations, seconds, on_progress, stop
    )


class _Run:
    """One run: the iteration, the best bound so far, and when to end."""

    def __init__(
        self,
        program: Program,
        anchor: Floats | None,
        incumbent: float | None,
        tolerance: float,
        started: float,
    ) -> None:
        self.program, self.incumbent, self.tolerance, self.started = program, incumbent, tolerance, started
        self.repair = Repair(program, anchor)
        self.bound, self.duals = self.repair.repaired(
            self.repair.anchor.copy(), np.array(self.repair.slack, dtype=float)
        )
        self.within: int | None = None
        self.history: list[tuple[int, float, float]] = []
        self.reduced = np.empty(program.columns.count)

    def run(
        self,
        start: tuple[Floats | None, Floats | None],
        iterations: int,
        seconds: float | None,
        on_progress: Callable[[Progress], None] | None,
        stop: Callable[[Progress], bool] | None,
    ) -> FirstOrder:
        status: Literal["converged", "stopped", "iterations", "time", "interrupted"] = "iterations"
        x = np.zeros(self.program.columns.count)
        try:
            iteration = _Iteration(self.program, self.repair, start)
            x = iteration.x
            while iteration.iterations < iterations:
                iteration.advance()
                late = seconds is not None and time.perf_counter() - self.started > seconds
                if not late and iteration.iterations % _CHECK and iteration.iterations < iterations:
                    continue
                progress, agrees = self._check(iteration)
                if on_progress is not None:
                    on_progress(progress)
                if stop is not None and stop(progress):
                    status = "stopped"
                elif agrees:
                    status = "converged"
                elif late:
                    status = "time"
                else:
                    continue
                break
        except KeyboardInterrupt:
            status = "interrupted"
        duals = self.program.without_combinations(self.duals)
        reduced = self.program.columns.reduced(self.program.costs, self.duals, self.reduced)
        return FirstOrder(status, self.bound, duals, reduced, x, tuple(self.history))

    def _check(self, iteration: _Iteration) -> tuple[Progress, bool]:
        program, repair = self.program, self.repair
        y, x = iteration.projected_y, iteration.x
        program.columns.reduced(program.costs, y, self.reduced)
        bound, duals = repair.repaired(y, self.reduced)
        if bound > self.bound:
            self.bound, self.duals = bound, duals
            if self.incumbent is not None:
                reduced = program.columns.reduced(program.costs, duals, self.reduced)
                self.within = int((reduced <= self.incumbent - bound).sum())
        elapsed = time.perf_counter() - self.started
        self.history.append((iteration.iterations, self.bound, elapsed))
        dual, primal = repair.value(y), float((program.costs * x).sum())
        below = np.max(program.lower - iteration.products, initial=0.0)
        above = np.max(iteration.products - program.upper, initial=0.0)
        infeasibility = float(max(below, above))
        size = max(abs(primal), abs(self.bound), 1e-300)
        agrees = infeasibility <= self.tolerance and abs(primal - self.bound) <= self.tolerance * size
        if not repair.scales:
            # Reduced costs that stay a little above 0 lose less than those below 0, of which there may be many.
            iteration.margin = 0.25 * self.tolerance * abs(dual) / max(float(np.abs(x).sum()), 1.0)
        return (
            Progress(iteration.iterations, elapsed, self.bound, dual, primal, infeasibility, self.within),
            agrees,
        )

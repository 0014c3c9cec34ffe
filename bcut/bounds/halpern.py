"""Restarted and reflected Halpern iteration on the primal-dual hybrid gradient method.

The k-th point after a restart is

    z_{k+1} = (k + 1) / (k + 2) * (2 T(z_k) - z_k) + 1 / (k + 2) * z_0,

with T one step of the method, as in "r2HPDHG" (Lu and Yang 2024) and cuPDLPx (Lu, Peng and Yang 2025). It restarts
when z - T(z) has become small enough, or has stopped shrinking.

Step lengths follow the reduced costs: with weights p > 0 on the columns, the lengths ``p_j / sum_i |a_ij|`` and
``1 / sum_j |a_ij| p_j`` are those of Pock and Chambolle (2011) for scaled columns. Columns with large reduced costs,
which will be 0 in the end, need not slow down their rows: at restarts, p_j becomes the smaller the larger they are.
And columns at rest are visited in every tenth iteration only, unless their reduced costs are about to change sign.
"""

from __future__ import annotations

from math import exp, inf, log, sqrt

import numpy as np

from bcut.bounds.repair import Floats, Program, Repair

# Restart when the residual has shrunk by the first factor, or by the second and begins to grow, or when this share of
# all iterations was made since the last restart.
_MUCH, _ENOUGH, _LONG = 0.1, 0.9, 0.36
# How far the primal weight goes to what the last stretch suggests, on a logarithmic scale.
_SMOOTHING = 0.5
# Factor of the primal weight while x does not move at all.
_FASTER = 4.0
# Weights of columns are divided by this plus their reduced costs, relative to their costs.
_FLOOR = 0.005
# Step lengths follow reduced costs from this iteration on, whenever the number of iterations has grown by this factor.
_FIRST_REFRESH, _REFRESH = 200, 1.4
# Share of the largest stable step length, and iterations of the power method that estimates it.
_SAFETY, _POWER_FIRST, _POWER_AGAIN = 0.97, 25, 8
# Passes over all columns; between them, over those that may move.
_LONGEST, _WIDE = 10, 2.0
# Passes come more often when columns at rest had too large a share in the last step.
_SURPRISE = 0.05


class HalpernIteration:
    """The iteration: z = (x, y), where it started from, and its step lengths.

    Parameters
    ----------
    program : Program
    repair : Repair
        Its slack is what reduced costs are compared with, where it is positive.
    start : pair of ndarray of float, or None
        x and y to start from.

    Attributes
    ----------
    x : ndarray of float, shape (m,)
    products : ndarray of float, shape (rows,)
        ``A x``.
    projected_y : ndarray of float, shape (rows,)
        The multipliers of the last T(z), of signs that the rows allow.
    margin : float
        Is subtracted from all costs.
    iterations : int
    """

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
        self.scale = (
            repair.slack if repair.scales else np.full(count, float(np.abs(program.costs).mean() or 1))
        )
        self.margin = 0.0
        self.row_scale = columns.row_scale()
        self.eigenvector = np.random.default_rng(1).standard_normal(rows)
        self.stable, self.length = inf, 1.0
        self.weights = np.median(self.scale) / self.scale
        self._set_lengths(_POWER_FIRST)
        # y is measured in costs, x in right-hand sides.
        self.weight = float(np.median(self.scale)) / program.largest_side
        self.before = np.full(count, -inf)
        self.near = np.empty(count, dtype=np.int32)
        self.listed, self.until_pass, self.period = -1, 0, 1
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
        moved, entered, listed = columns.kernels.step(
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
            late = entered > _SURPRISE * moved
            self.period = max(1, self.period // 2) if late else min(_LONGEST, self.period + 1)
            self.listed, self.until_pass = listed, self.period
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
        elif by_y > 1e-12:
            # Nothing that y did has reached x yet.
            self.weight *= _FASTER
        self.origin_x[:] = self.x
        self.origin_y[:], self.origin_products[:] = self.y, self.products
        self.since_restart, self.until_pass, self.restart_next = 0, 0, False

    def _refresh(self) -> None:
        """Let step lengths follow the reduced costs."""
        self.refreshed = self.iterations
        # Not needed again before the next pass over all columns.
        reduced = self.columns.reduced(self.program.costs, self.y, self.before)
        fresh = 1 / ((_FLOOR + np.clip(reduced / self.scale, 0.0, 1.0)) * self.scale)
        used = np.abs(self.x)
        if used.any():
            # The columns in use keep their step lengths, and so the primal weight its meaning.
            fresh *= used.sum() / (fresh * used).sum()
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

"""The bound of the averaged relaxation, exactly, and the orbits that no solution within a target can use.

For multipliers y of the cocircuit rows and z of the coverage row, every triangulation satisfies

    sign * objective  >=  z * volume + sum over orbits o of |o| * min(0, r_o),
    r_o = sign * c_o - z * volume_o - y M_o,

since 0 <= X_o <= |o|; cuts ``a X <= 0`` take part with multipliers that are not positive. Floating-point
duals are rounded to fractions over one denominator, and everything is computed again from these integers.
Inexact duals leave some r_o slightly below zero, which costs a lot where orbits are long; so z is lowered
until no r_o is negative, where that is possible (all volumes are positive) and gains something.

Integers are of 64 bits where a bound on what is computed with them shows that it stays below 2**63 in size, and
Python's elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import floor, ldexp
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.large_program import LARGE, solve_large_program
from bcut.bounds.linear_program import LinearProgram, solve_linear_program
from bcut.bounds.safe import exponent_of
from bcut.objectives.objective import Objective

if TYPE_CHECKING:
    import scipy.sparse as sp

# Where costs and duals are around 1, multipliers are multiples of 2**-SHIFT.
SHIFT = 45
# From this size on, the hull's volume is a factor of the denominator: without it, a multiplier of the volume row is a
# multiple of 2**-SHIFT, and rounding it shifts the bound by up to 2**-SHIFT times the volume.
_LARGE = 1 << 25


class OrbitProgram(Protocol):
    """Whatever is a program over orbits, such as `bcut.formulations.orbit_cocircuits.OrbitFormulation`.

    With the sums X of x over the orbits: ``matrix @ X = 0``, ``volumes @ X = volume``, ``cuts @ X <= 0`` where there
    are cuts, and 0 <= X <= sizes.
    """

    @property
    def simplices(self) -> NDArray[np.int64]:
        """One of each orbit, shape (m, d + 1)."""

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Lengths of the orbits, shape (m,)."""

    @property
    def matrix(self) -> sp.csr_matrix:
        """Cocircuit rows, of integers."""

    @property
    def volumes(self) -> NDArray[Any]:
        """Integers, shape (m,)."""

    @property
    def volume(self) -> int:
        """Positive."""

    @property
    def cuts(self) -> sp.csr_matrix | None:
        """Of integers, shape (cuts, m)."""


@dataclass(frozen=True, eq=False)
class OrbitBound:
    """A bound on ``sign * objective``, proven in integer arithmetic.

    Attributes
    ----------
    value : Fraction
        No triangulation has ``sign * objective`` below it.
    multipliers : ndarray of int64 or of Python integers, shape (rows + cuts,)
        Of the cocircuit rows and of the cuts, over `denominator`; those of cuts are not positive.
    coverage : int
        Multiplier of the volume row, over `denominator`.
    reduced_costs : ndarray of int64 or of Python integers, shape (m,)
        r_o over `denominator`, rounded down where costs had to be.
    denominator : int
    """

    value: Fraction
    multipliers: NDArray[Any]
    coverage: int
    reduced_costs: NDArray[Any]
    denominator: int

    def orbits_within(self, target: Fraction) -> NDArray[np.intp]:
        """List the orbits that a triangulation with ``sign * objective <= target`` may use (reduced-cost fixing)."""
        return np.flatnonzero(self.reduced_costs <= floor((target - self.value) * self.denominator))


@dataclass(frozen=True, eq=False)
class OrbitRoot:
    """What the averaged relaxation gave.

    Attributes
    ----------
    status : {"optimal", "infeasible", "limit"}
        "infeasible" when no point satisfies all rows: then there is no triangulation of the wanted kind.
    lp : float or None
        Value of the relaxation in the sense of the objective, unrounded.
    point : ndarray of float or None
        X, the sums of x over the orbits.
    bound : OrbitBound or None
        Proven by the duals. Of a program with very many orbits there is one after a limit, too.
    """

    status: Literal["optimal", "infeasible", "limit"]
    lp: float | None = None
    point: NDArray[np.float64] | None = None
    bound: OrbitBound | None = None


def orbit_root(
    formulation: OrbitProgram,
    objective: Objective,
    *,
    method: Literal["simplex", "interior"] = "simplex",
    seconds: float | None = None,
) -> OrbitRoot:
    """Solve the averaged relaxation, whose optimum is that of the relaxation itself.

    Parameters
    ----------
    formulation : OrbitProgram
    objective : Objective
        Of the representatives ``formulation.simplices``; invariant under the group.
    method : {"simplex", "interior"}
        "interior" gives duals that fix the most orbits.
    seconds : float, optional
        Time limit of the linear program.
    """
    if not formulation.volumes.any():
        return OrbitRoot("infeasible")  # nothing covers anything
    program = _program(formulation, objective)
    large = len(program.costs) >= LARGE
    solve = solve_large_program if large else solve_linear_program
    solution = solve(program, method=method, seconds=seconds)
    if solution.status == "infeasible" or (solution.status == "limit" and not large):
        return OrbitRoot(solution.status)
    unit = float(objective.solver_unit)
    duals = solution.duals * unit
    bound = safe_orbit_bound(formulation, objective, _unscaled(formulation, duals[1:]), float(duals[0]))
    if solution.status == "limit":
        return OrbitRoot("limit", bound=bound)
    return OrbitRoot("optimal", objective.sign * solution.value * unit, solution.x, bound)


def _program(formulation: OrbitProgram, objective: Objective) -> LinearProgram:
    """Return the program with the coverage row first, divided by the hull's volume, and costs in solvers' units.

    X <= |o| is left out: the other rows imply it, as each simplex contains a generic point, and each generic point is
    covered once.
    """
    import scipy.sparse as sp

    # Quotients of Python's integers do not overflow where the integers are beyond all doubles.
    shares = (formulation.volumes.astype(object) / formulation.volume).astype(float)
    # Rows with entries around 1 suit the solver best.
    scale = float(np.abs(shares).max())
    blocks = [sp.csr_matrix(shares / scale), formulation.matrix.astype(float)]
    if formulation.cuts is not None:
        largest = abs(formulation.cuts).max(axis=1).toarray().reshape(-1)
        blocks.append(sp.diags_array(1 / largest) @ formulation.cuts)
    matrix = sp.vstack(blocks, format="csr")
    lower, upper = np.zeros(matrix.shape[0]), np.zeros(matrix.shape[0])
    lower[0] = upper[0] = 1 / scale
    lower[1 + formulation.matrix.shape[0] :] = -np.inf
    return LinearProgram(objective.sign * objective.solver_costs, matrix, lower, upper)


def _unscaled(formulation: OrbitProgram, duals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the duals of the rows as they are, from those of `_program`, whose cuts have entries of size 1."""
    if formulation.cuts is None:
        return duals
    largest = abs(formulation.cuts).max(axis=1).toarray().reshape(-1)
    return np.concatenate((duals[: -len(largest)], duals[-len(largest) :] / largest))


def safe_orbit_bound(
    formulation: OrbitProgram, objective: Objective, duals: NDArray[np.floating], coverage: float
) -> OrbitBound:
    """Turn floating-point multipliers into an exact bound.

    Parameters
    ----------
    formulation : OrbitProgram
    objective : Objective
    duals : ndarray of float, shape (rows + cuts,)
        Any numbers; good ones give good bounds. For the minimisation of ``sign * objective``.
    coverage : float
        Multiplier of the coverage row, if that row were divided by the largest of its entries' sizes.
    """
    duals = np.where(np.isfinite(duals), duals, 0.0)
    coverage = float(coverage) if np.isfinite(coverage) else 0.0
    volume, largest = formulation.volume, max(1, _most(formulation.volumes))
    columns = _columns(formulation)
    sizes = abs(columns).astype(float)
    shift = _shift(sizes, objective, duals, coverage)
    denominator = (1 << max(0, shift)) * (volume if max(volume, largest) >= _LARGE else 1)
    # Multipliers of the rows are multiples of 2**-shift, which is so much over the denominator.
    unit = denominator >> shift if shift >= 0 else denominator << -shift
    multipliers: NDArray[Any] = np.rint(np.ldexp(duals, shift)).astype(np.int64)
    rows = formulation.matrix.shape[0]
    multipliers[rows:] = np.minimum(multipliers[rows:], 0)
    products = _products(columns, sizes, multipliers)
    if unit != 1:
        multipliers, products = multipliers.astype(object) * unit, products.astype(object) * unit
    # Where they have 64 bits, costs are at most 2**61 in size and products hardly exceed 2**62.
    reduced = _costs(objective, denominator) - products
    cover = round(Fraction(coverage) * denominator / largest)
    bounds = [_with_coverage(formulation, reduced, cover)]
    lowered = _lowered(formulation.volumes, bounds[0][1])
    if lowered:
        bounds.append(_with_coverage(formulation, reduced, cover - lowered))
    total, left, chosen = max(bounds, key=lambda bound: bound[0])
    return OrbitBound(Fraction(total, denominator), multipliers, chosen, left, denominator)


def _columns(formulation: OrbitProgram) -> sp.csr_matrix:
    """Return the cocircuit rows and the cuts."""
    import scipy.sparse as sp

    matrix = formulation.matrix.astype(np.int64)
    return matrix if formulation.cuts is None else sp.vstack((matrix, formulation.cuts), format="csr")


def _most(values: NDArray[Any]) -> int:
    """Return the largest size of some integers."""
    return max(-int(values.min(initial=0)), int(values.max(initial=0)))


def _products(columns: sp.csr_matrix, sizes: sp.csr_matrix, multipliers: NDArray[np.int64]) -> NDArray[Any]:
    """Return the products of integer multipliers with the columns, of 64 bits where they hardly exceed 2**62.

    Parameters
    ----------
    columns : scipy.sparse.csr_matrix of int64, shape (rows, m)
    sizes : scipy.sparse.csr_matrix of float, shape (rows, m)
        Their absolute values.
    multipliers : ndarray of int64, shape (rows,)
        Up to 2**61 in size.
    """
    # No partial sum exceeds the sum of the sizes, which rounding changes by (k + 2) * 2**-53 of it, for k entries: next
    # to nothing of what is left to 2**63.
    if float((sizes.T @ np.abs(multipliers).astype(float)).max(initial=0.0)) < 2.0**62:
        small: NDArray[np.int64] = columns.T @ multipliers
        return small
    entries = columns.tocoo()
    products = np.zeros(columns.shape[1], dtype=object)
    np.add.at(products, entries.col, entries.data.astype(object) * multipliers[entries.row].astype(object))
    return products


def _with_coverage(
    formulation: OrbitProgram, reduced: NDArray[Any], cover: int
) -> tuple[int, NDArray[Any], int]:
    """Return the bound and the reduced costs with a multiplier of the volume row, over the denominator."""
    volumes = formulation.volumes
    # The multiplier has as many bits as the denominator, next to those of the volumes.
    if _most(reduced) + max(1, _most(volumes)) * abs(cover) >= 2**63:
        reduced, volumes = reduced.astype(object), volumes.astype(object)
    left = reduced - volumes * cover
    negative = np.flatnonzero(left < 0)
    loss = sum(
        size * cost
        for size, cost in zip(formulation.sizes[negative].tolist(), left[negative].tolist(), strict=True)
    )
    return cover * formulation.volume + loss, left, cover


def _lowered(volumes: NDArray[Any], reduced: NDArray[Any]) -> int:
    """Return by how much less a multiplier of the volume row leaves no reduced cost negative; 0 where none does."""
    negative = np.flatnonzero(reduced < 0)
    pairs = list(zip(reduced[negative].tolist(), volumes[negative].tolist(), strict=True))
    # Of irrational volumes this is one coefficient, of any sign.
    if not pairs or volumes.min() <= 0:
        return 0
    return max(-(cost // volume) for cost, volume in pairs)


def _costs(objective: Objective, denominator: int) -> NDArray[Any]:
    """Return ``floor(sign * cost * denominator)``, of 64 bits where none exceeds 2**61 in size."""
    scale = objective.sign * denominator
    if objective.are_doubles:
        values = [floor(Fraction(cost) * scale) for cost in objective.numerators.tolist()]
    else:
        values = [int(cost) * scale // objective.denominator for cost in objective.numerators.tolist()]
    fits = max(map(abs, values), default=0) <= 2**61
    return np.array(values, dtype=np.int64 if fits else object)


def _shift(sizes: sp.csr_matrix, objective: Objective, duals: NDArray[np.floating], coverage: float) -> int:
    """Return the largest shift for which a reduced cost stays below 2**61, but no more than numbers of this size need.

    It is negative where costs or multipliers are huge.
    """
    largest = max(
        float(np.abs(objective.costs).max(initial=0.0)),
        float(np.abs(duals).max(initial=0.0)),
        abs(coverage),
    )
    if largest == 0.0:
        return SHIFT
    # By a power of two less, so that nothing overflows on the way.
    power = exponent_of(largest)
    costs, scaled = np.abs(np.ldexp(objective.costs, -power)), np.abs(np.ldexp(duals, -power))
    size = float(costs.max(initial=0.0)) + 2 * abs(ldexp(coverage, -power))
    size += float((sizes.T @ scaled).max(initial=0.0)) + float(scaled.max(initial=0.0))
    power += exponent_of(size)
    return min(SHIFT - min(0, power), 61 - power)

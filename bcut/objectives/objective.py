"""The type of an objective, and how the text of a user becomes one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from math import ceil, frexp, lcm
from sys import float_info
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from bcut.errors import InputError
from bcut.geometry.configuration import PointConfiguration
from bcut.objectives.syntax import ObjectiveName, Sense, read_objective

# Integer costs up to this size keep all exact bound computations within 64 bits.
_MAX_NUMERATOR = 1 << 40

# Sums of costs, also times the multipliers that bounds take, must be doubles.
_LARGEST_SUM = 10**280

# Costs of more units than this leave solvers no room for their tolerances.
_MAX_UNITS = 10**6


class Candidates(Protocol):
    """Whatever has simplices that get costs: a formulation, of all simplices or of one of each orbit."""

    @property
    def configuration(self) -> PointConfiguration:
        """The points."""

    @property
    def simplices(self) -> NDArray[np.int64]:
        """Ascending vertices, shape (m, d + 1)."""


@dataclass(frozen=True, eq=False)
class Objective:
    """Minimise or maximise ``sum of costs[t] * x[t]`` over the chosen d-simplices.

    Attributes
    ----------
    name : str
        As written by the user, such as "cardinality".
    sense : {"min", "max"}
    numerators : ndarray of int64, object or float64, shape (m,)
        Exact costs times `denominator`: integers, or doubles that are taken exactly.
    denominator : int
        Positive; 1 for doubles.
    """

    name: str
    sense: Sense
    numerators: NDArray[Any]
    denominator: int = 1

    @property
    def sign(self) -> int:
        """1 for a minimum, -1 for a maximum: solvers minimise ``sign * costs``."""
        return 1 if self.sense == "min" else -1

    @property
    def are_doubles(self) -> bool:
        """Whether the costs are doubles: then no Python number is made for each of them."""
        return self.numerators.dtype == np.float64

    @cached_property
    def costs(self) -> NDArray[np.float64]:
        """The costs, each rounded once to a double."""
        if self.are_doubles:
            return self.numerators
        if self.denominator == 1 and self.numerators.dtype == np.int64:
            return self.numerators.astype(float)
        return np.array([int(value) / self.denominator for value in self.numerators], dtype=float)

    @cached_property
    def largest_cost(self) -> float:
        """The largest absolute value of a cost; 1 where all are zero: what differences are to be compared with."""
        return float(np.abs(self.costs).max(initial=0.0)) or 1.0

    @cached_property
    def unit(self) -> Fraction:
        """The largest number of which every cost, and so every value, is an integral multiple; 1 where all are zero."""
        if not self.are_doubles:
            return Fraction(abs(int(np.gcd.reduce(self.numerators))) or 1, self.denominator)
        mantissas, exponents = _odd_parts(self.numerators[self.numerators != 0])
        if not len(mantissas):
            return Fraction(1)
        # The greatest common divisor of a 2^i and b 2^j, for odd a and b.
        return int(np.gcd.reduce(mantissas)) * Fraction(2) ** int(exponents.min())

    @property
    def counts_units(self) -> bool:
        """Whether costs are small multiples of `unit`, so that a solver can tell neighbouring values apart."""
        return self.largest_cost <= _MAX_UNITS * self.unit

    def rounded_up(self, bound: Fraction) -> Fraction:
        """Round a bound on ``sign * objective`` up to the next value that a triangulation can have."""
        return ceil(bound / self.unit) * self.unit

    @cached_property
    def solver_unit(self) -> Fraction:
        """What solvers count costs in, as their tolerances are absolute: `unit`, or a power of two near the largest."""
        return self.unit if self.counts_units else Fraction(2) ** frexp(self.largest_cost)[1]

    @cached_property
    def solver_costs(self) -> NDArray[np.float64]:
        """The costs in units of `solver_unit`: exact integers where `counts_units`, at most 1 in size elsewhere."""
        if self.counts_units:
            return np.rint(self.costs / float(self.unit))
        return np.ldexp(self.costs, -frexp(self.largest_cost)[1])

    @property
    def fits_64_bits(self) -> bool:
        """Whether the numerators are small integers, so that exact bounds can use 64-bit arithmetic."""
        return self.numerators.dtype == np.int64

    def value(self, columns: NDArray[np.integer] | Sequence[int]) -> Fraction:
        """Return the exact value of a set of simplices."""
        return sum(self.exact_costs(columns), Fraction(0))

    def exact_costs(self, columns: NDArray[np.integer] | Sequence[int]) -> list[Fraction]:
        """Return the exact costs of some simplices."""
        chosen = self.numerators[np.asarray(columns, dtype=np.intp)].tolist()
        if self.are_doubles:
            return [Fraction(value) for value in chosen]
        return [Fraction(int(value), self.denominator) for value in chosen]

    def times(self, columns: NDArray[np.integer], factors: NDArray[np.integer]) -> Objective:
        """Return the objective on some of its columns, each with an integer times its cost."""
        if not self.are_doubles:
            return replace(self, numerators=self.numerators[columns] * factors)
        costs = zip(self.exact_costs(columns), factors.tolist(), strict=True)
        return from_fractions(self.name, self.sense, [cost * factor for cost, factor in costs])

    def restricted_to(self, columns: NDArray[np.integer]) -> Objective:
        """Return the objective on some of its columns."""
        return replace(self, numerators=self.numerators[columns])


class Bottleneck(Objective):
    """Minimise the largest, or maximise the smallest, cost of a chosen d-simplex.

    Linear programs and solvers see the costs as those of a sum; values are those of the worst simplex.
    """

    def value(self, columns: NDArray[np.integer] | Sequence[int]) -> Fraction:
        """Return the cost of the worst of a set of simplices."""
        chosen = self.numerators[np.asarray(columns, dtype=np.intp)]
        worst = (chosen.max() if self.sense == "min" else chosen.min()) if len(chosen) else 0
        return Fraction(worst.item() if isinstance(worst, np.generic) else worst) / self.denominator

    def rounded_up(self, bound: Fraction) -> Fraction:
        """Return the bound: it is the cost of some simplex already."""
        return bound

    @cached_property
    def ranks(self) -> NDArray[np.int64]:
        """How bad each simplex is: 0 for the best cost, and so on, the same for equal ones; shape (m,)."""
        found = np.unique(self.numerators, return_inverse=True)[1].reshape(-1).astype(np.int64)
        return found if self.sense == "min" else found.max(initial=0) - found


def _odd_parts(values: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Write doubles as odd integers times powers of two; zeros as 0 times 1."""
    fractions, powers = np.frexp(values)
    mantissas = np.ldexp(fractions, 53).astype(np.int64)
    low = mantissas & -mantissas
    trailing = np.frexp(low.astype(float))[1].astype(np.int64) - 1
    trailing[mantissas == 0] = 0
    exponents = np.where(mantissas == 0, 0, powers.astype(np.int64) - 53 + trailing)
    return mantissas >> trailing, exponents


def from_fractions(name: str, sense: Sense, costs: Sequence[Fraction]) -> Objective:
    """Make an objective of exact costs."""
    denominator = lcm(*(cost.denominator for cost in costs)) if len(costs) else 1
    return Objective(name, sense, _narrowed([int(cost * denominator) for cost in costs]), denominator)


def _narrowed(integers: Sequence[int]) -> NDArray[Any]:
    """Return integers as int64 where all are small, else as they are."""
    if all(abs(value) <= _MAX_NUMERATOR for value in integers):
        return np.array(integers, dtype=np.int64)
    numerators = np.empty(len(integers), dtype=object)
    numerators[:] = integers
    return numerators


def make_objective(text: str, formulation: Candidates, *, sense: str | None = None) -> Objective:
    """Make the objective that a user wrote: ``MEASURE``, ``min-max:MEASURE`` or ``max-min:MEASURE``.

    Parameters
    ----------
    text : str
        A measure is a name, with its argument where it takes one (``costs:FILE``, ``random-costs:SEED``), or a
        function of a user (``./mine.py``, ``./mine.py:function``).
    formulation : Candidates
        Whose simplices get costs, such as a `Formulation`.
    sense : {"min", "max"}, optional
        Without it, a sum is minimised; bottlenecks have their own.

    Returns
    -------
    Objective
        A `Bottleneck` for the worst simplex.

    Raises
    ------
    InputError
        If there is no such measure, its argument does not fit, or the sense is no sense or not that of a bottleneck.
    ObjectiveError
        If a user's function raises, or does not return costs.
    """
    return objective_of(read_objective(text, sense), formulation)


def objective_of(name: ObjectiveName, formulation: Candidates) -> Objective:
    """Make an objective that has been read: evaluate its measure at the simplices of a formulation."""
    from bcut.objectives.measures import measured
    from bcut.objectives.registry import Ratios

    costs = measured(name.measure, formulation.configuration, formulation.simplices)
    kind = Bottleneck if name.is_bottleneck else Objective
    if isinstance(costs, Ratios):
        numerators, denominator = costs.numerators, costs.denominator
        if numerators.dtype != np.int64 or np.abs(numerators).max(initial=0) > _MAX_NUMERATOR:
            numerators = _narrowed(numerators.tolist())
    elif isinstance(costs, np.ndarray):
        numerators, denominator = costs, 1
    else:
        plain = from_fractions(name.text, name.sense, costs)
        numerators, denominator = plain.numerators, plain.denominator
    objective = kind(name.text, name.sense, numerators, denominator)
    _check_range(objective)
    return objective


def _check_range(objective: Objective) -> None:
    """Refuse costs whose sums, or which themselves, no double can hold, as solvers and result files need them."""
    numerators = objective.numerators
    if not len(numerators):
        return
    ends = numerators[[numerators.argmin(), numerators.argmax()]].tolist()
    largest = max(abs(Fraction(end)) for end in ends) / objective.denominator
    if largest * len(numerators) > _LARGEST_SUM:
        raise InputError(
            f"objective '{objective.name}': costs of {len(str(int(largest)))} digits have sums beyond the range of "
            "float64; scale the costs, or the points they come from"
        )
    if 0 < largest < Fraction(float_info.min):
        size = f"1e-{len(str(int(1 / largest))) - 1}"
        raise InputError(
            f"objective '{objective.name}': the largest cost is about {size}, below the range of float64; scale the "
            "costs, or the points they come from"
        )


def sum_objective(text: str, formulation: Candidates, *, sense: str | None = None, purpose: str) -> Objective:
    """Make an objective for a purpose that needs a sum.

    Raises
    ------
    InputError
        Also if it is a bottleneck.
    """
    name = read_objective(text, sense)
    if name.is_bottleneck:
        raise InputError(f"objective '{text}': {purpose} takes sums only; write {name.measure}")
    return objective_of(name, formulation)

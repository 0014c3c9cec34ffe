"""The type of an objective, and how the text of a user becomes one."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from math import ceil, frexp, lcm
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from bcut.errors import InputError
from bcut.geometry.configuration import PointConfiguration

Sense = Literal["min", "max"]

# Integer costs up to this size keep all exact bound computations within 64 bits.
_MAX_NUMERATOR = 1 << 40

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
    numerators : ndarray of int64 or object, shape (m,)
        Exact costs times `denominator`.
    denominator : int
        Positive.
    """

    name: str
    sense: Sense
    numerators: NDArray[np.int64] | NDArray[np.object_]
    denominator: int = 1

    @property
    def sign(self) -> int:
        """1 for a minimum, -1 for a maximum: solvers minimise ``sign * costs``."""
        return 1 if self.sense == "min" else -1

    @cached_property
    def costs(self) -> NDArray[np.float64]:
        """The costs, each rounded once to a double."""
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
        return Fraction(int(np.gcd.reduce(self.numerators)) or 1, self.denominator)

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
        chosen = self.numerators[np.asarray(columns, dtype=np.intp)]
        return Fraction(sum(int(value) for value in chosen), self.denominator)

    def restricted_to(self, columns: NDArray[np.integer]) -> Objective:
        """Return the objective on some of its columns."""
        return replace(self, numerators=self.numerators[columns])


def from_fractions(name: str, sense: Sense, costs: Sequence[Fraction]) -> Objective:
    """Make an objective of exact costs."""
    denominator = lcm(*(cost.denominator for cost in costs)) if len(costs) else 1
    integers = [int(cost * denominator) for cost in costs]
    numerators = np.array(integers, dtype=object)
    if all(abs(value) <= _MAX_NUMERATOR for value in integers):
        numerators = numerators.astype(np.int64)
    return Objective(name, sense, numerators, denominator)


def make_objective(text: str, formulation: Candidates, *, sense: str = "min") -> Objective:
    """Make the objective that a user wrote: ``MEASURE`` or ``MEASURE:ARGUMENT``.

    Parameters
    ----------
    text : str
        The name of a measure, with its argument where it takes one (``costs:FILE``, ``random-costs:SEED``).
    formulation : Candidates
        Whose simplices get costs, such as a `Formulation`.
    sense : {"min", "max"}

    Raises
    ------
    InputError
        If there is no such measure, its argument does not fit, or the sense is no sense.
    """
    from bcut.objectives.measures import MEASURES

    if sense not in ("min", "max"):
        raise InputError(f"sense '{sense}': it is 'min' or 'max'")
    name, _, argument = text.partition(":")
    if name not in MEASURES:
        near = difflib.get_close_matches(name, MEASURES, n=1)
        hint = f"did you mean '{near[0]}'?" if near else f"known are {', '.join(sorted(MEASURES))}"
        raise InputError(f"unknown objective '{name}': {hint}")
    costs = MEASURES[name](formulation.configuration, formulation.simplices, argument)
    direction: Sense = "min" if sense == "min" else "max"
    if isinstance(costs, np.ndarray):
        return Objective(text, direction, costs)
    return from_fractions(text, direction, costs)

"""Exact costs of simplices, from what a result file says of its objective."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations, islice
from math import comb
from typing import TYPE_CHECKING

from bcut.errors import ResultError, VerificationError
from bcut.objectives.syntax import MeasureName
from bcut.verification.cut_data import Candidates
from bcut.verification.exact_points import Simplex

if TYPE_CHECKING:
    from bcut.geometry.configuration import PointConfiguration

Cost = int | Fraction

# Simplices whose costs are asked for at once.
CHUNK = 1 << 16


class UnknownCostError(VerificationError):
    """A simplex whose cost is not in the file."""


@dataclass(frozen=True)
class CostTable:
    """The costs that a result file embeds: a default, None where there is none, and others by ascending vertices."""

    default: Fraction | None
    costs: Mapping[Simplex, Fraction]


@dataclass(frozen=True)
class Costs:
    """Exact costs of simplices.

    Attributes
    ----------
    of : callable
        Maps a list of ascending simplices to their costs.
    integral : bool
        Whether every simplex is known to have an integral cost, even those that nobody has looked at.
    admits : callable, optional
        Tells for each of a list of simplices whether it may be used at all; all may without it.
    most : Fraction, optional
        No cost is larger in size, as far as that is known without looking at the simplices.
    """

    of: Callable[[Sequence[Simplex]], Sequence[Cost]]
    integral: bool
    admits: Callable[[Sequence[Simplex]], Sequence[bool]] | None = None
    most: Fraction | None = None


def costs_of_objective(objective: str, table: CostTable | None, configuration: PointConfiguration) -> Costs:
    """Return the costs that an objective stands for.

    The number of simplices is counted here, and embedded tables are looked up here. Other measures are
    evaluated by the functions registered for them, at the simplices in question.

    Parameters
    ----------
    objective : str
        As in a result file: the name of a measure, with its argument behind a colon.
    table : CostTable, optional
        For ``costs:FILE`` and functions of users, which are neither read nor called.
    configuration : PointConfiguration

    Raises
    ------
    ResultError
        There is no such measure.
    InputError
        Its argument does not fit.
    """
    if objective == "cardinality":
        return Costs(lambda simplices: [1] * len(simplices), integral=True, most=Fraction(1))
    if has_table(objective):
        if table is None:
            raise ResultError(
                f"problem.costs is missing, so the values of objective '{objective}' cannot be re-computed; "
                "solve the instance again, then the table of costs is written into the result"
            )
        listed = (*table.costs.values(), *([] if table.default is None else [table.default]))
        return Costs(
            _looked_up(table),
            integral=all(cost.denominator == 1 for cost in listed),
            most=None if table.default is None else max(map(abs, listed)),
        )
    return Costs(_registered_measure(objective, configuration), integral=False)


def largest_cost(candidates: Candidates, costs: Costs, max_subsets: int) -> Fraction | None:
    """Return the largest absolute value of a candidate's cost, 1 where all are zero: a scale for differences of values.

    Parameters
    ----------
    candidates : Candidates
    costs : Costs
    max_subsets : int
        With more (d+1)-subsets, what is known without looking at them has to do.

    Returns
    -------
    Fraction or None
        None where it is not known.
    """
    n, size = candidates.points.n, candidates.points.dimension + 1
    if comb(n, size) > max_subsets:
        return None if costs.most is None else costs.most or Fraction(1)
    largest = Fraction(0)
    simplices = (simplex for simplex in combinations(range(n), size) if simplex in candidates)
    try:
        while chunk := list(islice(simplices, CHUNK)):
            largest = max(largest, *(abs(Fraction(cost)) for cost in costs.of(chunk)))
    except UnknownCostError:
        return None
    return largest or Fraction(1)


def has_table(objective: str) -> bool:
    """Tell whether the costs of an objective are those of the table in the result file, whatever else is there."""
    return objective.partition(":")[0] == "costs" or MeasureName.parse(objective).is_function


def _registered_measure(
    objective: str, configuration: PointConfiguration
) -> Callable[[Sequence[Simplex]], Sequence[Cost]]:
    import numpy as np

    from bcut.objectives.measures import MEASURES, exact, measured

    if objective.partition(":")[0] not in MEASURES:
        raise ResultError(
            f"problem.objective is '{objective}', a measure that this version does not know; "
            "verify the result with the version of bcut that wrote it"
        )

    def of(simplices: Sequence[Simplex]) -> Sequence[Cost]:
        rows = np.array(simplices, dtype=np.int64).reshape(len(simplices), configuration.dimension + 1)
        return exact(measured(objective, configuration, rows))

    return of


def _looked_up(table: CostTable) -> Callable[[Sequence[Simplex]], Sequence[Cost]]:
    def of(simplices: Sequence[Simplex]) -> Sequence[Cost]:
        found = []
        for simplex in simplices:
            cost = table.costs.get(simplex, table.default)
            if cost is None:
                raise UnknownCostError(f"the cost of simplex {list(simplex)} is not in the file")
            found.append(cost)
        return found

    return of

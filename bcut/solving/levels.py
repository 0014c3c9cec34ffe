"""Lexicographic combinations: the best by one objective, and among these the best by the next, and so on.

What an objective has reached becomes a restriction for those behind it: a bottleneck leaves the simplices that are no
worse, a sum adds the row that its value must stay. So each level is a problem of the same kind as the first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from bcut.errors import InputError, SolverError
from bcut.formulations.value_row import with_value_row
from bcut.geometry.configuration import PointConfiguration
from bcut.objectives.objective import Bottleneck, objective_of
from bcut.objectives.syntax import ObjectiveName
from bcut.result import Certificate, LevelQuestion, LevelRecord
from bcut.solving.bottleneck import solve_bottleneck
from bcut.solving.capping import with_capped_costs
from bcut.solving.certificates import make_certificate
from bcut.solving.embedding import costs_to_embed
from bcut.solving.report import as_number, gap, proven_bound, settles
from bcut.solving.search import Part, Search
from bcut.solving.strategies import solve_at_once, solve_by_targets


def solve_listed(search: Search) -> None:
    """Solve a problem whose simplices are listed, in the way that its objective asks for."""
    objective = search.whole.objective
    if isinstance(objective, Bottleneck):
        solve_bottleneck(search)
    elif objective.counts_units:
        solve_by_targets(search)
    else:
        with_capped_costs(search, solve_at_once)


@dataclass
class Level:
    """A further objective.

    Attributes
    ----------
    name : ObjectiveName
    columns : ndarray of int
        Where the columns of its search stand among all.
    search : Search
    """

    name: ObjectiveName
    columns: NDArray[np.intp]
    search: Search


class Levels:
    """A search, and those that follow it.

    Parameters
    ----------
    first : Search
        Of the first objective, over all simplices.
    names : sequence of ObjectiveName
        The further objectives.

    Attributes
    ----------
    objectives : list of Objective
        All of them, with the costs of all simplices.
    further : list of Level
        Those that have been begun.

    Raises
    ------
    InputError
        If an objective that another one follows has values that cannot be told apart.
    """

    def __init__(self, first: Search, names: Sequence[ObjectiveName]) -> None:
        self.first, self.names = first, names
        formulation = first.whole.formulation
        self.objectives = [first.whole.objective, *(objective_of(name, formulation) for name in names)]
        for objective, follower in zip(self.objectives, names, strict=False):
            if not isinstance(objective, Bottleneck) and not objective.counts_units:
                raise InputError(
                    f"objective '{follower.text}' after '{objective.name}': sums of these costs are too close to each "
                    "other to be held fixed; put it last, or take costs that are small multiples of a unit"
                )
        self.further: list[Level] = []

    def solve(self) -> None:
        """Solve level by level, until one is not solved to the end."""
        search, columns = self.first, np.arange(len(self.first.whole.columns))
        solve_listed(search)
        for number, name in enumerate(self.names):
            if search.status != "optimal":
                return
            search, columns = self._after(number, search, columns)
            self.further.append(Level(name, columns, search))
            solve_listed(search)
            self._check(number)

    def _after(
        self, number: int, search: Search, columns: NDArray[np.intp]
    ) -> tuple[Search, NDArray[np.intp]]:
        """Return the search that follows a finished one, and where its columns stand among all."""
        objective, formulation = search.whole.objective, search.whole.formulation
        assert search.columns is not None
        kept = np.arange(len(formulation.simplices))
        if isinstance(objective, Bottleneck):
            kept = np.flatnonzero(objective.ranks <= objective.ranks[search.columns].max())
            formulation = formulation.restricted_to(kept)
        else:
            # Integers, in the unit of all costs, which those that are left may have a multiple of.
            whole = self.objectives[number]
            coefficients = (search.sign * whole.solver_costs[columns]).astype(np.int64)
            upper = int(search.sign * objective.value(search.columns) / whole.unit)
            formulation = with_value_row(formulation, coefficients, upper, name=_row_name(number))
        columns = columns[kept]
        further = self.objectives[number + 1].restricted_to(columns)
        follower = Search(
            whole=Part.whole(formulation, further),
            make_separators=search.make_separators,
            deadline=search.deadline,
            seed=search.seed,
            on_progress=search.on_progress,
            cut_observer=search.cut_observer,
            columns=np.searchsorted(kept, np.sort(search.columns)),
            statistics=search.statistics,
            seconds=search.seconds,
        )
        return follower, columns

    def _check(self, number: int) -> None:
        """Refuse an answer that lets go of what earlier objectives had reached."""
        level = self.further[number]
        assert level.search.columns is not None
        chosen = level.columns[level.search.columns]
        reached = [self.first, *(earlier.search for earlier in self.further[:number])]
        for objective, search in zip(self.objectives, reached, strict=False):
            if objective.value(chosen) != search.value:
                raise SolverError(
                    f"objective '{level.name.text}': the solver's answer has another value of '{objective.name}' than "
                    f"the best, {float(objective.value(chosen))}; costs with fewer different digits may help"
                )

    def certificate(self, number: int) -> Certificate:
        """Write out what is proven exactly of a further objective, with the values of those before it given."""
        search = self.further[number].search
        found = search.certificate
        bound = None if isinstance(search.whole.objective, Bottleneck) else search.exact
        formulation = search.whole.formulation
        if found is None and bound is not None:
            found = make_certificate(formulation, search.whole.objective, bound)
        if found is None:
            return Certificate(reason="no relaxation was solved to optimality outside SCIP")
        earlier = [Fraction(0)] * (number + 1)
        multipliers = []
        for row, multiplier in found.multipliers or []:
            if isinstance(row, str) and row.startswith(_ROW):
                level = int(row.removeprefix(_ROW))
                earlier[level] = Fraction(multiplier) / self.objectives[level].unit
            else:
                multipliers.append([row, multiplier])
        if found.bound is None:
            return found
        return replace(found, multipliers=multipliers, earlier=[str(value) for value in earlier])

    def conclude(self) -> None:
        """Bring what the last level found back to the first search: its triangulation, its status."""
        first = self.first
        for level in self.further:
            if first.status == "interrupted" and level.search.status != "optimal":
                level.search.status = "interrupted"
            assert level.search.columns is not None
            first.columns = level.columns[level.search.columns]
            first.nodes += level.search.nodes
            if level.search.status != "optimal":
                first.status = level.search.status
        if len(self.further) < len(self.names) and first.status == "optimal":
            first.status = "limit"

    def questions(self, configuration: PointConfiguration) -> list[LevelQuestion]:
        """Write down the further objectives, with the costs that a result file must hold."""
        return [
            LevelQuestion(name.text, name.sense, costs_to_embed(name, objective, configuration, self.first))
            for name, objective in zip(self.names, self.objectives[1:], strict=True)
        ]

    def records(self) -> list[LevelRecord]:
        """Write down what was found by the further objectives."""
        records = []
        for number in range(len(self.names)):
            record = LevelRecord(certificate=Certificate(reason="it was not begun"))
            if number < len(self.further):
                search = self.further[number].search
                value, proven = search.value, proven_bound(search)
                record.status = search.status
                record.value, record.bound = as_number(value), as_number(proven)
                record.gap = gap(value, proven)
                certificate = self.certificate(number)
                record.certificate = replace(certificate, settles=settles(search, certificate))
            records.append(record)
        return records


# Rows that hold the value of an earlier objective have this name, with its number.
_ROW = "value_"


def _row_name(number: int) -> str:
    return f"{_ROW}{number}"

"""Separators for tests; one knows every triangulation, so it is valid and separates all that can be separated."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.formulation import Formulation
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.objectives.objective import Objective, from_fractions
from bcut.scip import host
from bcut.separation.driver import Separation
from bcut.separation.seam import Cut, FractionalPoint, Problem, Separator


def incidence(formulation: Formulation) -> np.ndarray:
    """All triangulations as 0/1 rows."""
    found = list(triangulations(formulation.chirotope, spanning=formulation.spanning))
    table = np.zeros((len(found), len(formulation.simplices)), dtype=np.int64)
    for row, columns in enumerate(found):
        table[row, list(columns)] = 1
    return table


@cache
def listed(instance: str, spanning: bool) -> tuple[Formulation, list[tuple[int, ...]]]:
    """A program and all its triangulations."""
    formulation = cocircuit_formulation(load_instance(instance), spanning=spanning)
    return formulation, list(triangulations(formulation.chirotope, spanning=spanning))


class HullCuts(Separator):
    """Separates a point from the convex hull of all triangulations, one cut at a time."""

    name = "hull"

    def setup(self, problem: Problem) -> None:
        super().setup(problem)
        # The problem may have lost columns: only triangulations on the rest count.
        whole = cocircuit_formulation(problem.configuration, spanning=problem.formulation.spanning)
        kept = whole.columns_of(problem.simplices)
        everything = incidence(whole)
        lost = np.delete(everything, kept, axis=1).any(axis=1)
        self.table = everything[~lost][:, kept]

    def separate(self, point: FractionalPoint) -> Iterator[Cut]:
        columns = point.support
        if not len(self.table):
            yield Cut(columns, -1)
            return
        rows = np.unique(self.table[:, columns], axis=0)
        count = len(columns)
        solution = linprog(
            np.append(-point.x[columns], 1.0),
            A_ub=np.hstack((rows, -np.ones((len(rows), 1)))),
            b_ub=np.zeros(len(rows)),
            bounds=[(-1, 1)] * count + [(None, None)],
            method="highs",
        )
        weights = np.rint(solution.x[:count] * 60).astype(int)
        rank = int((rows @ weights).max())
        if weights @ point.x[columns] > rank + 1e-6:
            used = np.flatnonzero(weights)
            yield Cut(columns[used], rank, weights[used].tolist(), proof={"rank": rank})


class Watching(Separator):
    """Yields nothing, and remembers what it was shown."""

    name = "watching"

    def __init__(self) -> None:
        self.points: list[np.ndarray] = []

    def separate(self, point: FractionalPoint) -> Iterable[Cut]:
        self.points.append(np.array(point.x))
        return ()


class Scripted(Separator):
    """Yields what a function makes of each point."""

    def __init__(self, script: Any, name: str = "scripted") -> None:
        self.script = script
        self.name = name  # type: ignore[misc]

    def separate(self, point: FractionalPoint) -> Iterable[Cut]:
        return self.script(point)


def at_work(formulation: Formulation, *separators: Separator) -> Separation:
    return Separation(separators, Problem(formulation))


def with_gap(number: int, sense: Any = "min") -> tuple[Formulation, Objective, int]:
    """A formulation and integer costs whose relaxation misses the optimum, with the optimum."""
    formulation = cocircuit_formulation(load_instance("random:10,2,seed=2"), spanning=True)
    seed = (137, 151, 352, 378, 597, 802)[number]
    rng = np.random.default_rng(seed)
    costs = (rng.random(formulation.size[0]) < rng.choice([0.3, 0.5, 0.7])) * rng.integers(
        1, 4, size=formulation.size[0]
    )
    if sense == "max":
        costs = -costs
    objective = from_fractions("gap", sense, [Fraction(int(cost)) for cost in costs])
    values = incidence(formulation) @ costs
    return formulation, objective, int(values.min() if sense == "min" else values.max())


#: SCIP alone with our separators: no presolve, no heuristics, none of its own cuts.
BARE: dict[str, Any] = {"presolve": False, "heuristics": False, "scip_separators": False}


def costs_of(formulation: Formulation, costs: Any, sense: Any = "min") -> Objective:
    """An objective of integer costs."""
    return from_fractions("test", sense, [Fraction(int(cost)) for cost in costs])


def with_depth(monkeypatch: pytest.MonkeyPatch) -> tuple[Formulation, Objective]:
    """A problem on which SCIP, with a bad branching rule from here on, goes down some levels."""
    set_parameters = host._set_parameters

    def with_bad_branching(model: Any, formulation: Formulation, options: Any) -> None:
        set_parameters(model, formulation, options)
        model.setParam("branching/random/priority", 10**6)
        model.setParam("propagating/maxrounds", 0)

    monkeypatch.setattr(host, "_set_parameters", with_bad_branching)
    formulation = cocircuit_formulation(load_instance("random:25,2,seed=1"), spanning=True)
    return formulation, costs_of(
        formulation, np.random.default_rng(2).integers(0, 2, size=formulation.size[0])
    )

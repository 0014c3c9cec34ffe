"""Sums of costs of very different sizes: what is too dear for an optimum does not spoil the accuracy."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bcut
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.objectives.objective import Objective, from_fractions, make_objective
from bcut.solving.capping import capped_costs
from bcut.solving.search import Part, Search
from bcut.verification.verify import verify


def nearly_a_cube(noise: float) -> PointConfiguration:
    corners = np.array([[k & 1, k >> 1 & 1, k >> 2 & 1] for k in range(8)], dtype=float)
    return PointConfiguration.from_values(corners + noise * np.random.default_rng(1).random((8, 3)))


@pytest.mark.parametrize("noise", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("sense", ["min", "max"])
def test_slivers_do_not_spoil_sums_of_aspect_ratios(noise: float, sense: str) -> None:
    configuration = nearly_a_cube(noise)
    formulation = cocircuit_formulation(configuration)
    objective = make_objective("aspect-ratio", formulation)
    assert objective.largest_cost > 0.1 / noise
    values = [objective.value(chosen) for chosen in triangulations(formulation.chirotope)]
    best = min(values) if sense == "min" else max(values)
    result = bcut.solve(configuration, objective="aspect-ratio", sense=sense)
    assert result.status == "optimal"
    assert result.value == pytest.approx(float(best), rel=1e-9)
    checked = verify(result)
    assert checked.exact_bound is not None
    assert abs(checked.exact_bound - best) <= best / 10**6


def search_for(costs: Any, sense: Any = "min") -> Search:
    formulation = cocircuit_formulation(load_instance("random:7,2,seed=1"))
    count = len(formulation.simplices)
    entries = np.resize(np.array(costs), count)
    objective = Objective("test", sense, entries.astype(float))
    return Search(whole=Part.whole(formulation, objective), make_separators=list)


def test_costs_are_capped_within_the_block_only() -> None:
    search = search_for([1.0, 2.0, 3.0, 1e12])
    whole = search.whole
    with capped_costs(search):
        assert search.value is not None
        capped = search.whole.objective
        assert float(search.value) < capped.largest_cost <= 4 * float(search.value)
        dear = whole.objective.costs > capped.largest_cost
        assert capped.costs[~dear].tolist() == whole.objective.costs[~dear].tolist()
        assert set(capped.costs[dear]) == {capped.largest_cost}
    assert search.whole is whole


def test_fractions_are_capped_exactly() -> None:
    search = search_for([1.0])
    costs = [
        Fraction(1, 3) if number % 4 else Fraction(10**20) for number in range(len(search.whole.columns))
    ]
    objective = from_fractions("test", "min", costs)
    search.whole = Part(search.whole.formulation, objective, search.whole.columns)
    found = {search.whole.objective.value([column]) for column in range(len(costs))}
    assert found == {Fraction(1, 3), Fraction(10**20)}
    with capped_costs(search):
        capped = search.whole.objective
        least, largest = sorted({capped.value([column]) for column in range(len(costs))})
        assert least == Fraction(1, 3)
        assert search.value is not None
        assert min(search.value, Fraction(10**20)) <= largest <= 10**20


@pytest.mark.parametrize(
    ("costs", "sense"),
    [
        ([1.0, 2.0, 900.0], "min"),
        ([-1.0, 2.0, 30.0], "min"),
        ([-1e12, 2.0, 1e12], "min"),
        ([1.0, 2.0, 1e12], "max"),
        ([0.0], "min"),
    ],
)
def test_other_costs_are_left_alone(costs: list[float], sense: str) -> None:
    search = search_for(costs, sense)
    whole = search.whole
    with capped_costs(search):
        assert search.whole is whole
        assert search.columns is None


def test_negative_costs_make_room_for_what_they_gain() -> None:
    search = search_for([-1.0, 2.0, 1e12])
    gained = float(np.abs(np.minimum(search.whole.objective.costs, 0)).sum())
    with capped_costs(search):
        assert search.value is not None
        size = abs(float(search.value)) + gained
        assert 2 * size <= search.whole.objective.largest_cost <= 4 * size


@pytest.mark.parametrize("method", ["listing", "scip", "orbits"])
@pytest.mark.parametrize(("case", "least"), [(0, 0), (1, 1), (2, -3), (3, 0)])
def test_prices_that_keep_simplices_out(method: str, case: int, least: int, tmp_path: Path) -> None:
    """Costs of a few units beside 10^10 for what is not wanted: SCIP would take the former for zero."""
    configuration = load_instance(f"random:9,2,seed={case}")
    formulation = cocircuit_formulation(configuration)
    rng = np.random.default_rng(case)
    table = [
        [simplex, int(cost) + 0.5 * int(half)]
        for simplex, cost, half in zip(
            formulation.simplices.tolist(),
            rng.integers(least, 5, formulation.size[0]),
            rng.integers(0, 2, formulation.size[0]),
            strict=True,
        )
        if rng.random() < 0.7
    ]
    file = tmp_path / "costs.json"
    file.write_text(json.dumps({"default": 10**10, "costs": table}))
    objective = make_objective(f"costs:{file}", formulation)
    best = min(objective.value(chosen) for chosen in triangulations(formulation.chirotope))
    assert abs(best) < 10**4
    result = bcut.solve(configuration, objective=f"costs:{file}", method=method)
    assert (result.status, result.value) == ("optimal", float(best))
    assert verify(result).value == best


@pytest.mark.parametrize("sense", ["min", "max"])
def test_no_cap_changes_a_cost_that_no_double_holds(sense: Any, tmp_path: Path) -> None:
    """Every triangulation needs simplices that cost 2^53 + 1: there is nothing to cap."""
    configuration = load_instance("random:7,2,seed=5")
    formulation = cocircuit_formulation(configuration, spanning=True)
    rng = np.random.default_rng(0)
    sign = 1 if sense == "min" else -1
    costs = [
        sign * (2**53 + 1 if rng.random() < 0.8 else int(rng.integers(1, 9))) for _ in formulation.simplices
    ]
    table = [[simplex, cost] for simplex, cost in zip(formulation.simplices.tolist(), costs, strict=True)]
    file = tmp_path / "costs.json"
    file.write_text(json.dumps({"costs": table}))
    values = [
        sum(costs[column] for column in chosen)
        for chosen in triangulations(formulation.chirotope, spanning=True)
    ]
    result = bcut.solve(configuration, objective=f"costs:{file}", spanning=True, sense=sense, method="orbits")
    assert (result.status, verify(result).value) == ("optimal", sign * min(abs(value) for value in values))


@pytest.mark.parametrize("name", ["0", "1"])
def test_a_cap_from_a_poor_triangulation_is_lowered(name: str) -> None:
    best = bcut.solve("random:8,2,seed=1", objective="aspect-ratio")
    result = bcut.solve("random:8,2,seed=1", objective="aspect-ratio", formulation=name)
    assert (result.status, result.value) == ("optimal", pytest.approx(best.value))


@pytest.mark.parametrize("method", ["listing", "scip", "orbits"])
@pytest.mark.parametrize("sense", ["min", "max"])
def test_costs_that_cancel_are_not_called_optimal_before_they_are(
    method: str, sense: Any, tmp_path: Path
) -> None:
    """Areas times 10^13, less their mean, add up to nothing: beside them solvers do not see what differs."""
    configuration = load_instance("random:9,2,seed=1")
    formulation = cocircuit_formulation(configuration, spanning=True)
    every = list(triangulations(formulation.chirotope, spanning=True))
    volumes = make_objective("volume", formulation)
    mean = volumes.value(every[0]) / len(every[0])
    small = np.random.default_rng(1).integers(0, 9, formulation.size[0]).tolist()
    table = [
        [simplex, str((volumes.value([column]) / mean - 1) * 10**13 + small[column])]
        for column, simplex in enumerate(formulation.simplices.tolist())
    ]
    file = tmp_path / "costs.json"
    file.write_text(json.dumps({"costs": table}))
    values = [sum(small[column] for column in chosen) for chosen in every]
    best = min(values) if sense == "min" else max(values)
    result = bcut.solve(configuration, objective=f"costs:{file}", spanning=True, method=method, sense=sense)
    assert result.value is not None
    assert result.value in values
    assert result.bound is not None
    assert result.bound <= best if sense == "min" else result.bound >= best
    assert (result.status == "optimal") <= (result.value == best)
    assert ("a limit of the solvers' accuracy" in str(result)) == (result.status == "limit")
    assert verify(result).value == result.value


def test_an_interrupt_while_costs_are_capped_loses_nothing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def interrupted(search: Search) -> None:
        raise KeyboardInterrupt

    configuration = load_instance("random:9,2,seed=1")
    simplices = cocircuit_formulation(configuration).simplices.tolist()
    file = tmp_path / "costs.json"
    file.write_text(json.dumps({"default": 10**10, "costs": [[simplex, 1.5] for simplex in simplices[::2]]}))
    monkeypatch.setattr("bcut.solving.capping.without_bad_simplices", interrupted)
    result = bcut.solve(configuration, objective=f"costs:{file}", method="orbits")
    assert result.status == "interrupted"
    assert result.bound is not None
    assert verify(result).value >= result.bound


def test_the_other_sense() -> None:
    search = search_for([-1.0, -2.0, -3.0, -1e12], "max")
    with capped_costs(search):
        assert search.value is not None
        assert search.whole.objective.costs.min() >= 4 * float(search.value)


def test_no_simplices_at_all() -> None:
    result = bcut.solve("cube:2", objective="random-costs:1", forbid=[[0]], star=0)
    assert result.status == "infeasible"
    assert bcut.solve("cube:2", objective="min-max:weight", forbid=[[0]], star=0).status == "infeasible"

"""From an instance to a verified optimum: known optima, brute force, and what a result says."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from oracles import Watching, incidence, with_gap
from reference import assert_triangulation, configuration_or_none
from solving import METHODS, assert_solved

import bcut
import bcut.instances
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.simplices import candidate_simplices
from bcut.geometry.triangulations import count_by_size, triangulations
from bcut.instance import load_instance
from bcut.scip import host
from bcut.solving import strategies
from bcut.verification.verify import verify

OPTIMA = json.loads(bcut.instances.path("known-optima").read_text(encoding="utf-8"))
SMALL = [
    (row, sense)
    for row in OPTIMA
    if row["points"] <= 30 and row["dimension"] <= 5
    for sense in ("min", "max")
    if row[sense] is not None
]


def label(value: Any) -> str:
    if isinstance(value, dict):
        return value["instance"] + (" spanning" if value["spanning"] else "")
    return str(value)


@pytest.mark.parametrize(("row", "sense"), SMALL, ids=label)
def test_known_optima(row: dict[str, Any], sense: str) -> None:
    result = bcut.solve(row["instance"], sense=sense, spanning=row["spanning"])
    assert_solved(result, row[sense])
    assert result.triangulation is not None
    assert len(result.triangulation) == row[sense]
    if sense == "min" and row["root_lp_min"] is not None:
        tolerance = 1e-4 if row["root_lp_min"] != round(row["root_lp_min"], 1) else 1e-6
        assert result.root.lp == pytest.approx(row["root_lp_min"], abs=tolerance)


def test_every_known_optimum_up_to_dimension_four_is_among_them() -> None:
    assert len([row for row, _ in SMALL if row["dimension"] <= 4]) >= 66


@pytest.mark.parametrize(
    ("instance", "lp", "value"),
    [
        ("random:12,3,seed=1000", Fraction(33, 2), 17),
        ("random:14,3,seed=1000", Fraction(41, 2), 21),
        ("random:16,3,seed=1000", Fraction(49, 2), 25),
        ("random:16,3,seed=1002", Fraction(49, 2), 25),
        ("random:20,3,seed=1000", Fraction(71, 2), 36),
        ("random:20,3,seed=1001", Fraction(103, 3), 35),
        ("random:20,3,seed=1002", Fraction(71, 2), 36),
    ],
)
def test_random_points_whose_relaxation_is_fractional(instance: str, lp: Fraction, value: int) -> None:
    result = bcut.solve(instance, spanning=True)
    assert_solved(result, value)
    assert result.root.lp == pytest.approx(float(lp), abs=1e-6)
    assert result.problem.spanning


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("instance", "spanning", "sense", "value"),
    [
        ("cube:3", False, "min", 5),
        ("cube:3", False, "max", 6),
        ("cube:4", False, "min", 16),
        ("random:12,3,seed=1000", True, "min", 17),
        ("icosahedron", False, "max", 20),
        ("grid:3,3", True, "max", 8),
    ],
)
def test_both_methods_agree(instance: str, spanning: bool, sense: str, value: int, method: str) -> None:
    assert_solved(bcut.solve(instance, spanning=spanning, sense=sense, method=method), value)


COSTS = f"costs:{bcut.instances.path('pentagon-center-costs')}"


@pytest.mark.parametrize("method", METHODS)
def test_the_fractional_example_of_the_paper(method: str) -> None:
    result = bcut.solve("pentagon-center", objective=COSTS, method=method)
    assert_solved(result, 1)
    assert result.problem.costs is not None
    if method == "auto":
        assert result.root.lp == pytest.approx(0, abs=1e-9)


def test_bound_of_the_fractional_example_of_the_paper() -> None:
    without = bcut.bound("pentagon-center", objective=COSTS, separators=[])
    assert (without.status, without.bound, without.triangulation) == ("bound", 0, None)
    result = bcut.bound("pentagon-center", objective=COSTS, separators=["odd-cycle"])
    assert (result.status, result.bound, result.value) == ("bound", 1, None)
    assert result.root.lp == pytest.approx(0, abs=1e-9)
    assert result.root.lp_after_cuts == pytest.approx(1, abs=1e-6)
    counts = result.separators["odd-cycle"]
    assert counts["calls"] >= 1
    assert counts["found"] >= counts["added"] >= 1
    assert result.root.rounds[0].cuts == {"odd-cycle": counts["added"]}


# Brute force.


def costs_file(folder: Path, configuration: PointConfiguration, costs: Any, *, spanning: bool) -> str:
    simplices = candidate_simplices(Chirotope.of(configuration), spanning=spanning)
    entries = [[simplex, cost] for simplex, cost in zip(simplices.tolist(), costs, strict=True)]
    path = folder / "costs.json"
    path.write_text(json.dumps({"costs": entries}), encoding="utf-8")
    return f"costs:{path}"


SCALES = [
    lambda c: int(c),
    lambda c: int(c) * 10**5 + 3,
    lambda c: int(c) * 10**9,
    lambda c: f"{c}/7",
    lambda c: f"{c}e-12",
    lambda c: f"{c}e-200",
    lambda c: f"{c}e12",
    lambda c: f"{c}e30",
    lambda c: f"{c}e200",
]


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.integers(2, 3).flatmap(
        lambda d: st.lists(
            st.lists(st.integers(0, 4), min_size=d, max_size=d), min_size=d + 2, max_size=8, unique_by=tuple
        )
    ),
    st.booleans(),
    st.sampled_from(["min", "max"]),
    st.sampled_from(SCALES),
    st.sampled_from(METHODS),
    st.integers(0, 10**6),
)
def test_brute_force_on_random_points_with_random_costs(
    tmp_path: Path, values: Any, spanning: bool, sense: str, scale: Any, method: str, seed: int
) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    chirotope = Chirotope.of(configuration)
    count = len(candidate_simplices(chirotope, spanning=spanning))
    costs = [scale(c) for c in np.random.default_rng(seed).integers(-4, 5, size=count)]
    exact = [Fraction(cost) for cost in costs]
    found = triangulations(chirotope, spanning=spanning)
    best = (min if sense == "min" else max)(sum((exact[t] for t in chosen), Fraction(0)) for chosen in found)
    objective = costs_file(tmp_path, configuration, costs, spanning=spanning)
    result = bcut.solve(configuration, objective=objective, sense=sense, spanning=spanning, method=method)
    assert result.status == "optimal"
    assert verify(result).value == best
    assert result.triangulation is not None
    assert_triangulation(configuration.scalars(), result.triangulation, spanning=spanning)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.lists(st.integers(0, 5), min_size=3, max_size=3), min_size=5, max_size=8, unique_by=tuple),
    st.booleans(),
)
def test_sizes_of_smallest_and_largest_triangulations(values: Any, spanning: bool) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    sizes = count_by_size(Chirotope.of(configuration), spanning=spanning)
    assert_solved(bcut.solve(configuration, spanning=spanning), min(sizes))
    assert_solved(bcut.solve(configuration, spanning=spanning, sense="max"), max(sizes))


@pytest.mark.parametrize("sense", ["min", "max"])
@pytest.mark.parametrize("scale", [1, 1000, 10**6, 10**9, Fraction(1, 3)])
@pytest.mark.parametrize("number", range(6))
def test_gaps_are_closed_at_every_scale_of_costs(tmp_path: Path, number: int, scale: Any, sense: str) -> None:
    formulation, objective, optimum = with_gap(number, sense)
    costs = [str(int(cost) * scale) for cost in objective.numerators]
    text = costs_file(tmp_path, formulation.configuration, costs, spanning=True)
    result = bcut.solve(formulation.configuration, objective=text, spanning=True, sense=sense, separators=[])
    # Where values lie far apart, targets must not be tried one by one.
    assert len(result.root.rounds) < 100
    assert result.status == "optimal"
    assert verify(result).value == optimum * Fraction(scale)
    assert result.bound == pytest.approx(float(optimum * Fraction(scale)), rel=1e-6)


def test_targets_grow_until_one_is_reached(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    formulation, objective, optimum = with_gap(3)
    targets: list[Fraction] = []
    reach = strategies._reach

    def recording(search: Any, part: Any, target: Fraction) -> Any:
        targets.append(target)
        return reach(search, part, target)

    monkeypatch.setattr(strategies, "_reach", recording)
    # Costs of 50000 units each, but for one that is never used.
    costs = [int(cost) * 50_000 for cost in objective.numerators]
    unused = next(j for j, cost in enumerate(costs) if cost == 150_000)
    costs[unused] += 1
    text = costs_file(tmp_path, formulation.configuration, costs, spanning=True)
    result = bcut.solve(formulation.configuration, objective=text, spanning=True, separators=[])
    best = (incidence(formulation) @ np.array(costs)).min()
    assert best == optimum * 50_000
    assert_solved(result, best)
    assert 1 < len(targets) < 15
    # A triangulation within a target may be found that is not the best: then the next one lies just below it.
    out_of_reach = [target for target in targets if target < best]
    assert out_of_reach == sorted(set(out_of_reach))


# The result.


def test_a_result_says_what_was_asked_and_found() -> None:
    result = bcut.solve(
        "random:12,3,seed=1000", spanning=True, separators=["link", HullLike], seed=3, time_limit=50
    )
    question = result.problem
    assert (question.objective, question.sense, question.spanning) == ("cardinality", "min", True)
    assert (question.formulation, question.separators, question.seed) == ("2", ["link", "hull-like"], 3)
    assert question.limits == {"time": 50, "memory": None}
    assert result.instance.name == "random:12,3,seed=1000"
    assert len(result.instance.points) == 12
    formulation = cocircuit_formulation(load_instance("random:12,3,seed=1000"), spanning=True)
    assert (result.size.columns, result.size.rows) == formulation.size
    assert result.size.columns_after_fixing is not None
    assert 0 < result.size.columns_after_fixing < result.size.columns
    assert set(result.separators) == {"link", "hull-like"}
    assert result.separators["hull-like"]["calls"] > 0
    assert set(result.separators["link"]) >= {"calls", "found", "added", "seconds"}
    assert result.seconds["total"] >= sum(v for k, v in result.seconds.items() if k != "total") - 0.05
    assert result.triangulation == sorted(result.triangulation or [], key=lambda s: s[::-1])
    assert json.loads(result.to_json())["value"] == result.value == 17
    assert next(iter(json.loads(result.to_json()))) == "schema"


class HullLike(Watching):
    name = "hull-like"


def test_root_rounds_are_unrounded_and_count_cuts() -> None:
    result = bcut.solve("random:12,3,seed=1000", spanning=True)
    rounds = result.root.rounds
    assert rounds[0].lp == pytest.approx(16.5, abs=1e-6)
    added = sum(finished.cuts.get("link", 0) for finished in rounds)
    assert added == result.separators["link"]["added"] > 0


def test_a_costs_objective_is_embedded_in_the_result(tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    path.write_text('{"default": "1/2", "costs": [[[2, 1, 0], 3]]}', encoding="utf-8")
    result = bcut.solve("cube:2", objective=f"costs:{path}")
    path.unlink()
    assert result.problem.costs == {"default": "1/2", "costs": [[[0, 1, 2], "3"]]}
    assert verify(result).value == 1


@pytest.mark.parametrize("method", METHODS)
def test_progress_is_reported(method: str) -> None:
    seen: list[dict[str, Any]] = []
    bcut.solve("random:12,3,seed=1000", spanning=True, method=method, separators=[], on_progress=seen.append)
    assert {"stage", "value", "bound"} <= set(seen[0])
    assert ("tree" if method == "scip" else "root") in {facts["stage"] for facts in seen}
    values = [facts["value"] for facts in seen if facts["value"] is not None]
    assert all(value >= 17 for value in values)
    assert all(facts["bound"] is None or facts["bound"] <= 17 + 1e-6 for facts in seen)


def test_scip_starts_from_a_triangulation(monkeypatch: pytest.MonkeyPatch) -> None:
    starts: list[Any] = []
    search = host.branch_and_cut

    def recording(formulation: Any, *arguments: Any, **options: Any) -> Any:
        starts.append(formulation.simplices[options["start"]].tolist())
        return search(formulation, *arguments, **options)

    monkeypatch.setattr(host, "branch_and_cut", recording)
    bcut.solve("cube:3", method="scip", sense="max")
    assert len(starts) == 1
    assert_triangulation(load_instance("cube:3").scalars(), starts[0])


def test_the_same_question_has_the_same_answer() -> None:
    results = [bcut.solve("random:12,3,seed=1000", spanning=True, seed=5) for _ in range(2)]
    assert results[0].triangulation == results[1].triangulation
    assert [r.lp for r in results[0].root.rounds] == [r.lp for r in results[1].root.rounds]


@pytest.mark.parametrize("sense", ["min", "max"])
def test_a_value_that_the_first_bound_reaches_is_not_cut_for(sense: str) -> None:
    """All triangulations have the same volume, at fractional points of the relaxation, too."""
    watching = Watching()
    result = bcut.solve(
        "random:16,3,seed=1", objective="volume", sense=sense, spanning=True, separators=[watching]
    )
    assert result.optimal
    assert result.root.integral is False
    assert (result.nodes, watching.points) == (0, [])
    assert verify(result).value == pytest.approx(result.value)

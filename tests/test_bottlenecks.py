"""Bottlenecks and lexicographic combinations: known optima, fractional relaxations, restrictions and limits."""

from __future__ import annotations

import json
import math
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import listed
from scipy.spatial import Delaunay

import bcut
import bcut.instances
from bcut.cli.main import run
from bcut.errors import InputError
from bcut.formulations.formulation import Formulation
from bcut.geometry.configuration import PointConfiguration
from bcut.instance import load_instance
from bcut.objectives.measures import measured
from bcut.objectives.objective import Bottleneck, Objective, make_objective
from bcut.result import Result
from bcut.solving.bottleneck import threshold_certificate
from bcut.verification.verify import verify

PENTAGON = f"costs:{bcut.instances.path('pentagon-center-costs')}"


@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("objective", ["max-min:dihedral-angle", "min-max:aspect-ratio"])
def test_fifteen_random_points_are_solved_and_proven(objective: str, seed: int) -> None:
    result = bcut.solve(f"random:15,3,seed={seed}", objective=objective, spanning=True)
    assert result.status == "optimal"
    assert result.value == result.bound
    assert result.triangulation is not None
    configuration = load_instance(f"random:15,3,seed={seed}")
    costs = measured(objective[8:], configuration, np.array(result.triangulation))
    assert result.value == (costs.max() if objective[:3] == "min" else costs.min())
    checked = verify(result)
    assert checked.proven_optimal
    assert checked.exact_bound == checked.value == Fraction(result.value)
    assert checked.statement.startswith("optimal, proven exactly")


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_delaunay_triangulations_maximise_the_smallest_angle(seed: int) -> None:
    configuration = load_instance(f"random:25,2,seed={seed}")
    result = bcut.solve(configuration, objective="max-min:min-angle", spanning=True)
    triangles = np.sort(Delaunay(configuration.floats).simplices, axis=1).astype(np.int64)
    assert result.value == measured("min-angle", configuration, triangles).min()
    assert verify(result).proven_optimal


@pytest.mark.parametrize("corners", [5, 7, 12])
def test_every_triangulation_of_a_regular_polygon_has_an_ear(corners: int) -> None:
    # The sine of an angle is the cosine of what it lacks of a right one.
    points = [
        [f"cos({2 * k}*pi/{corners})", f"cos({(corners - 4 * k) % (4 * corners)}*pi/{2 * corners})"]
        for k in range(corners)
    ]
    result = bcut.solve(PointConfiguration.from_values(points), objective="max-min:min-angle")
    assert result.value == pytest.approx(math.pi / corners, rel=1e-13)
    assert verify(result).proven_optimal


# Where the relaxation is fractional.


@pytest.mark.parametrize("separators", [[], ["odd-cycle"], ["link"]])
def test_what_the_relaxation_leaves_open_rests_on_the_solver(separators: list[str]) -> None:
    """The ten triangles of cost 0 cover the pentagon twice, but no triangulation consists of them."""
    result = bcut.solve("pentagon-center", objective=f"min-max:{PENTAGON}", separators=separators)
    assert (result.status, result.value, result.bound) == ("optimal", 1, 1)
    assert (result.root.lp, result.root.lp_after_cuts) == (0, 1)
    assert result.certificate.threshold == "0"
    checked = verify(result)
    assert (checked.value, checked.exact_bound, checked.proven_optimal) == (1, 0, False)
    assert checked.statement == (
        "triangulation verified, value 1; bound 0 proven exactly; optimality rests on the solver's tree"
    )


def test_bounds_of_bottlenecks_before_and_after_cuts() -> None:
    without, within = (
        bcut.bound("pentagon-center", objective=f"min-max:{PENTAGON}", separators=separators)
        for separators in ([], ["odd-cycle"])
    )
    assert (without.status, without.bound, without.triangulation) == ("bound", 0, None)
    assert (without.root.lp, without.root.lp_after_cuts) == (0, 0)
    assert (within.status, within.bound) == ("bound", 1)
    assert (within.root.lp, within.root.lp_after_cuts) == (0, 1)
    assert within.separators["odd-cycle"]["added"] >= 1
    assert "bound 0 proven exactly" in verify(within).statement


def test_many_ranks_above_a_fractional_relaxation(tmp_path: Path) -> None:
    """Costs 0 for the ten triangles and 1, ..., 10 for the others: SCIP bisects what the relaxation leaves."""
    table = json.loads(Path(PENTAGON.partition(":")[2]).read_text())
    formulation, every = listed("pentagon-center", False)
    zeros = {tuple(simplex) for simplex, cost in table["costs"] if cost == 0}
    if table.get("default", 1) == 0:
        zeros |= {tuple(s) for s in formulation.simplices.tolist()} - {tuple(s) for s, _ in table["costs"]}
    for seed in range(8):
        order = iter(np.random.default_rng(seed).permutation(10) + 1)
        costs = {
            tuple(s): 0 if tuple(s) in zeros else int(next(order)) for s in formulation.simplices.tolist()
        }
        path = tmp_path / f"{seed}.json"
        path.write_text(json.dumps({"costs": [[list(s), cost] for s, cost in costs.items()]}))
        listed_costs = list(costs.values())
        expected = min(max(listed_costs[t] for t in chosen) for chosen in every)
        result = bcut.solve("pentagon-center", objective=f"min-max:costs:{path}", separators=[])
        assert (result.status, result.value, result.bound) == ("optimal", expected, expected)
        assert verify(result).value == expected


def test_a_threshold_that_is_not_proven_is_not_written() -> None:
    formulation, _ = listed("pentagon-center", False)
    objective = make_objective(f"min-max:{PENTAGON}", formulation)
    assert isinstance(objective, Bottleneck)
    assert threshold_certificate(formulation, objective, 0).threshold == "0"
    refused = threshold_certificate(formulation, objective, 1)
    assert (refused.bound, refused.threshold) == (None, None)
    assert refused.reason


@pytest.mark.parametrize("formulation", ["0", "1", "chambers"])
def test_other_formulations_find_the_same(formulation: str) -> None:
    for objective in ("min-max:aspect-ratio", "max-min:volume"):
        expected = bcut.solve("random:7,3,seed=2", objective=objective)
        result = bcut.solve("random:7,3,seed=2", objective=objective, formulation=formulation)
        assert (result.status, result.value) == ("optimal", expected.value)
        assert result.certificate.threshold is None
        checked = verify(result)
        assert not checked.proven_optimal
        assert f"this is formulation {formulation}" in checked.statement


# Restrictions, limits.


def test_restrictions_hold_for_the_worst_simplex_too() -> None:
    formulation, every = listed("random:8,2,seed=2", False)
    simplices = formulation.simplices
    objective = make_objective("max-min:min-angle", formulation)
    forbidden = simplices[optimal_columns(formulation, objective)[0]].tolist()
    allowed = [t for t in every if forbidden not in simplices[list(t)].tolist()]
    result = bcut.solve(formulation.configuration, objective="max-min:min-angle", forbid=[forbidden])
    assert result.value == float(max(objective.value(t) for t in allowed))
    assert verify(result).proven_optimal


def optimal_columns(formulation: Formulation, objective: Objective) -> Any:
    result = bcut.solve(formulation.configuration, objective=objective.name)
    return formulation.columns_of(np.array(result.triangulation))


def test_no_triangulation_is_said_and_proven() -> None:
    result = bcut.solve("cube:2", objective="min-max:weight", forbid=[[0, 3], [1, 2]])
    assert (result.status, result.value, result.bound) == ("infeasible", None, None)
    assert "infeasible, proven exactly" in verify(result).statement
    further = bcut.solve("cube:2", objective="min-max:weight", forbid=[[0, 3], [1, 2]], then=["weight"])
    assert (further.status, further.then[0].status) == ("infeasible", None)
    assert "infeasible" in verify(further).statement


@pytest.mark.parametrize("then", [[], ["cardinality"]])
def test_a_limit_keeps_what_was_found(then: list[str]) -> None:
    result = bcut.solve("random:10,3,seed=1", objective="max-min:dihedral-angle", time_limit=0, then=then)
    assert result.status == "limit"
    assert result.triangulation is not None
    assert result.bound is not None
    assert result.value is not None
    assert result.value <= result.bound
    assert [level.status for level in result.then] == [None] * len(then)
    checked = verify(result)
    assert "not claimed to be optimal" in checked.statement
    assert ("not begun" in checked.statement) == bool(then)


def test_an_interrupt_between_levels_keeps_the_first() -> None:
    def stop(facts: dict[str, Any]) -> None:
        if facts["stage"] == "root":
            raise KeyboardInterrupt

    result = bcut.solve(
        "random:10,3,seed=1",
        objective="max-min:dihedral-angle",
        spanning=True,
        then=["cardinality", "weight"],
        on_progress=stop,
    )
    assert result.status == "interrupted"
    assert result.value == result.bound
    assert [level.status for level in result.then] == ["interrupted", None]
    checked = verify(result)
    assert checked.exact_bound == checked.value
    assert not checked.proven_optimal
    assert "then by weight: not begun" in checked.statement


def test_progress_is_told() -> None:
    seen: list[dict[str, Any]] = []
    bcut.solve("random:12,3,seed=1", objective="max-min:volume", on_progress=seen.append)
    bounds = [facts["bound"] for facts in seen if facts["stage"] == "bottleneck"]
    assert len(bounds) > 2
    assert bounds == sorted(bounds, reverse=True)


@pytest.mark.parametrize(
    ("first", "then"),
    [("weight", ["cardinality"]), ("cardinality", ["random-costs:1", "cardinality"])],
)
def test_only_values_that_can_be_told_apart_are_held(first: str, then: list[str]) -> None:
    with pytest.raises(InputError, match="too close to each other to be held fixed; put it last"):
        bcut.solve("random:7,2,seed=1", objective=first, then=then)


# Invariance.


@settings(max_examples=25, deadline=None)
@given(st.integers(2, 3), st.integers(0, 10**6), st.randoms(), st.sampled_from(["1/3", "5", "1/1024"]))
def test_relabelled_and_similar_points_have_the_same_optima(
    d: int, seed: int, random: Any, scale: str
) -> None:
    before = PointConfiguration.from_values(np.random.default_rng(seed).random((7, d)))
    permutation = list(range(7))
    random.shuffle(permutation)
    turn = [["3/5", "-4/5", 0], ["4/5", "3/5", 0], [0, 0, 1]]
    factor = Fraction(scale)
    matrix = [[Fraction(turn[i][j]) * factor for j in range(d)] for i in range(d)]
    after = before.relabelled(permutation).affine_image(matrix, [3, -1, 7][:d])
    for objective, degree in (
        ("max-min:dihedral-angle", 0),
        ("min-max:aspect-ratio", 0),
        ("min-max:weight", d - 1),
        ("weight", d - 1),
        ("max-min:volume", d),
    ):
        old, new = (bcut.solve(points, objective=objective).value for points in (before, after))
        assert old is not None
        assert new == pytest.approx(old * float(factor) ** degree, rel=1e-8)


# The command line.


def test_the_summary_and_the_report_of_verify_tell_all_values(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "result.json"
    arguments = ["random:8,3,seed=1", "--spanning", "--objective", "max-min:dihedral-angle"]
    assert (
        run(["solve", *arguments, "--then", "cardinality", "--then", "max:weight", "--output", str(file)])
        == 0
    )
    lines = capsys.readouterr().out.splitlines()
    data = json.loads(file.read_text())
    assert [line.split()[1:3] for line in lines if line.split()[0] == "then"] == [
        ["min", "cardinality:"],
        ["max", "weight:"],
    ]
    assert any(f"value {data['then'][0]['value']}, bound" in line for line in lines)
    assert data["problem"]["then"] == [
        {"objective": "cardinality", "sense": "min", "costs": None},
        {"objective": "weight", "sense": "max", "costs": None},
    ]
    assert run(["verify", str(file), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [level["value"] is not None for level in report["then"]] == [True, True]
    library: Result = bcut.solve(
        arguments[0], spanning=True, objective=arguments[3], then=["cardinality", "max:weight"]
    )
    assert [vars(level)["value"] for level in library.then] == [level["value"] for level in data["then"]]

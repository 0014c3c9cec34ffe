"""Bottlenecks and lexicographic combinations: brute force, known optima, proofs, and proofs that were tampered with."""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

import bcut
import bcut.instances
from bcut.cli.main import run
from bcut.errors import InputError, ResultError, VerificationError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.formulation import Formulation
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.objectives.measures import measured
from bcut.objectives.objective import Bottleneck, Objective, make_objective
from bcut.objectives.syntax import read_level
from bcut.result import Result
from bcut.solving.bottleneck import threshold_certificate
from bcut.verification.verify import verify

# Every triangulation of these is listed.
SMALL = [
    ("random:9,2,seed=1", True),
    ("random:8,2,seed=2", False),
    ("random:8,3,seed=1", True),
    ("random:8,3,seed=4", False),
    ("random:7,3,seed=2", False),
    ("random:7,4,seed=1", True),
    ("random:7,4,seed=3", False),
    ("grid:3,3", True),
    ("moae", False),
    ("prism:3", False),
    ("cube:3", False),
    ("polygon:6,center", False),
]
MEASURES = [
    "weight",
    "volume",
    "aspect-ratio",
    "dihedral-angle",
    "min-angle",
    "solid-angle",
    "random-costs:1",
]
OBJECTIVES = [f"{kind}{measure}" for kind in ("", "min-max:", "max-min:") for measure in MEASURES]
COMBINATIONS = [
    ["max-min:dihedral-angle", "cardinality"],
    ["max-min:dihedral-angle", "max:cardinality", "max:weight"],
    ["min-max:aspect-ratio", "weight"],
    ["min-max:weight", "max-min:volume", "min-max:random-costs:2"],
    ["cardinality", "max-min:dihedral-angle"],
    ["cardinality", "max:weight"],
    ["max:cardinality", "min-max:aspect-ratio", "random-costs:3"],
]
PENTAGON = f"costs:{bcut.instances.path('pentagon-center-costs')}"


def fits(objective: str, dimension: int) -> bool:
    if "min-angle" in objective.replace("max-min:", ""):
        return dimension == 2
    return "solid-angle" not in objective or dimension == 3


@cache
def listed(instance: str, spanning: bool) -> tuple[Formulation, list[tuple[int, ...]]]:
    formulation = cocircuit_formulation(load_instance(instance), spanning=spanning)
    return formulation, list(triangulations(formulation.chirotope, spanning=spanning))


def best_of(instance: str, spanning: bool, objectives: Sequence[str]) -> list[Fraction]:
    """The values of a best triangulation, found by looking at all of them."""
    formulation, left = listed(instance, spanning)
    values = []
    for text in objectives:
        name = read_level(text)
        objective = make_objective(name.text, formulation, sense=name.sense)
        costs = objective.exact_costs(range(len(formulation.simplices)))
        if not name.is_bottleneck:
            found = [sum((costs[t] for t in chosen), Fraction(0)) for chosen in left]
        else:
            worst = max if name.sense == "min" else min
            found = [worst(costs[t] for t in chosen) for chosen in left]
        values.append(min(found) if name.sense == "min" else max(found))
        left = [chosen for chosen, value in zip(left, found, strict=True) if value == values[-1]]
    return values


def assert_close(found: Any, exact: Fraction, *, is_bottleneck: bool) -> None:
    if is_bottleneck:
        assert found == float(exact)
    else:
        assert found == pytest.approx(float(exact), rel=1e-9)


@pytest.mark.parametrize(("instance", "spanning"), SMALL)
def test_brute_force_agrees_with_every_objective(instance: str, spanning: bool) -> None:
    formulation, _ = listed(instance, spanning)
    for objective in filter(lambda text: fits(text, formulation.configuration.dimension), OBJECTIVES):
        is_bottleneck = objective[:3] in ("min", "max") and ":" in objective
        for sense in (None,) if is_bottleneck else ("min", "max"):
            text = objective if sense is None else f"{sense}:{objective}"
            (expected,) = best_of(instance, spanning, [text])
            result = bcut.solve(
                formulation.configuration, objective=objective, sense=sense, spanning=spanning
            )
            assert result.status == "optimal", text
            assert_close(result.value, expected, is_bottleneck=is_bottleneck)
            checked = verify(result)
            assert checked.value is not None
            assert_close(float(checked.value), expected, is_bottleneck=is_bottleneck)
            if is_bottleneck:
                assert result.bound == result.value


@pytest.mark.parametrize(("instance", "spanning"), SMALL)
def test_brute_force_agrees_with_combinations(instance: str, spanning: bool) -> None:
    formulation, _ = listed(instance, spanning)
    for first, *further in COMBINATIONS:
        name = read_level(first)
        expected = best_of(instance, spanning, [first, *further])
        result = bcut.solve(
            formulation.configuration,
            objective=name.text,
            sense=name.sense,
            then=further,
            spanning=spanning,
        )
        assert result.status == "optimal", further
        assert [level.status for level in result.then] == ["optimal"] * len(further)
        assert_close(result.value, expected[0], is_bottleneck=name.is_bottleneck)
        checked = verify(result)
        for text, level, proof, value in zip(
            further, result.then, checked.further, expected[1:], strict=True
        ):
            bottleneck = read_level(text).is_bottleneck
            assert_close(level.value, value, is_bottleneck=bottleneck)
            assert proof.value is not None
            assert_close(float(proof.value), value, is_bottleneck=bottleneck)


# Larger ones, whose optima are known for other reasons.


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


# Thresholds that were tampered with.


def solved(objective: str = "max-min:min-angle", **options: Any) -> dict[str, Any]:
    data = bcut.solve("random:8,2,seed=2", objective=objective, **options).to_dict()
    assert verify(data).exact_bound is not None
    return copy.deepcopy(data)


@pytest.mark.parametrize("objective", ["max-min:min-angle", "min-max:aspect-ratio"])
def test_a_better_threshold_is_refused(objective: str) -> None:
    data = solved(objective)
    threshold = Fraction(data["certificate"]["threshold"])
    factor = Fraction(99, 100) if objective.startswith("max-min") else Fraction(101, 100)
    data["certificate"]["threshold"] = str(threshold * factor)
    with pytest.raises(VerificationError, match=r"claims the bound .* but its multipliers prove"):
        verify(data)
    data["certificate"]["bound"] = "-1000"
    with pytest.raises(VerificationError, match="which must be positive to prove anything"):
        verify(data)


def test_a_worse_threshold_proves_less() -> None:
    data = solved()
    threshold = Fraction(data["certificate"]["threshold"])
    data["certificate"]["threshold"] = str(threshold * Fraction(101, 100))
    checked = verify(data)
    assert not checked.proven_optimal
    assert checked.statement.endswith("optimality rests on the solver's tree")


def test_every_multiplier_of_a_threshold_counts() -> None:
    data = solved()
    for number in range(len(data["certificate"]["multipliers"])):
        changed = copy.deepcopy(data)
        row = changed["certificate"]["multipliers"][number]
        row[1] = str(-Fraction(row[1]))
        with pytest.raises(VerificationError, match="multipliers prove"):
            verify(changed)


@pytest.mark.parametrize(
    ("path", "entry", "message"),
    [
        ("certificate.threshold", None, "is a bottleneck, and has no threshold"),
        ("problem.objective", "min-angle", "is a sum, and has a threshold|claims the value"),
        ("problem.objective", "min-max:min-angle", "contradict each other"),
        ("problem.sense", "min", "contradict each other"),
        ("value", 0.25, "claims the value 1/4, but its triangulation has"),
        ("certificate.threshold", "x", "this is a rational as text"),
        ("certificate.earlier", ["0"], "has 1 multipliers of earlier objectives, but there are 0"),
        ("certificate.symmetries", [[0, 1, 2, 3, 4, 5, 6, 7]], "one over orbits|multipliers"),
    ],
)
def test_results_of_bottlenecks_that_were_changed(path: str, entry: Any, message: str) -> None:
    data = solved()
    *folders, last = path.split(".")
    target = data
    for folder in folders:
        target = target[folder]
    target[last] = entry
    with pytest.raises((VerificationError, ResultError), match=message):
        verify(data)


def combined() -> dict[str, Any]:
    return solved("cardinality", spanning=True, then=["max-min:min-angle", "weight"])


@pytest.mark.parametrize(
    ("path", "entry", "message"),
    [
        ("then.0.value", 0.5, r"then\[0\] \(max-min:min-angle\): it claims the value 1/2, but"),
        ("then.1.value", None, r"then\[1\] \(weight\): it claims no value"),
        ("then.1.bound", 100.0, r"then\[1\] \(weight\): its value .* is better than its bound"),
        ("then.0.status", "limit", r"its status is 'optimal', but that of then\[0\] is 'limit'"),
        ("then.0.status", None, r"its status is 'optimal', but then\[0\] was not begun"),
        ("then.0.certificate.earlier", ["1"], "which must be zero or negative"),
        ("then.1.certificate.earlier", ["0", "-1"], "which must be zero"),
        ("then.1.certificate.earlier", ["-1000", "0"], "claims the bound .* but its multipliers prove"),
        ("then.1.certificate.earlier", ["0"], "1 multipliers of earlier objectives, but there are 2"),
        ("then.0.certificate.threshold", "1/100", "must be positive|multipliers prove"),
        ("then.0.certificate.multipliers.0.1", "x", r"'then\[0\]\.certificate\.multipliers\[0\]'"),
        ("then", [], r"'then': this is a list of 2, one entry for each of problem\.then"),
        ("then.0", 3, r"'then\[0\]': this is a JSON object"),
        ("problem.then.0.sense", "least", r"'problem\.then\[0\]\.sense': this is one of min, max"),
        ("problem.then.1.sense", "max", "claims the bound|better than|room for a better"),
        ("problem.then.0.objective", "max-min:beauty", "a measure that this version does not know"),
    ],
)
def test_combinations_that_were_changed(path: str, entry: Any, message: str) -> None:
    data = combined()
    *folders, last = [int(part) if part.isdigit() else part for part in path.split(".")]
    target: Any = data
    for folder in folders:
        target = target[folder]
    target[last] = entry
    with pytest.raises((VerificationError, ResultError), match=message):
        verify(data)


def test_a_combination_is_only_as_optimal_as_its_last_objective() -> None:
    data = solved("cardinality", spanning=True, then=["max-min:min-angle"])
    assert verify(data).proven_optimal
    assert verify(data).statement == (
        f"by cardinality: optimal, proven exactly: the triangulation is verified, and its value "
        f"{data['value']} meets the bound {data['value']}. then by max-min:min-angle: optimal, proven exactly: "
        f"the triangulation is verified, and its value {data['then'][0]['value']:.10g} meets the bound "
        f"{data['then'][0]['value']:.10g}"
    )
    data["then"][0]["certificate"] = None
    checked = verify(data)
    assert not checked.proven_optimal
    assert checked.further[0].exact_bound is None
    assert "optimality rests on the run itself" in checked.statement


def test_a_threshold_that_is_not_proven_is_not_written() -> None:
    formulation, _ = listed("pentagon-center", False)
    objective = make_objective(f"min-max:{PENTAGON}", formulation)
    assert isinstance(objective, Bottleneck)
    assert threshold_certificate(formulation, objective, 0).threshold == "0"
    refused = threshold_certificate(formulation, objective, 1)
    assert (refused.bound, refused.threshold) == (None, None)
    assert refused.reason


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

"""Bottlenecks and lexicographic combinations have the values that looking at all triangulations gives."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import pytest
from oracles import listed

import bcut
import bcut.instances
from bcut.objectives.objective import make_objective
from bcut.objectives.syntax import read_level
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


def fits(objective: str, dimension: int) -> bool:
    if "min-angle" in objective.replace("max-min:", ""):
        return dimension == 2
    return "solid-angle" not in objective or dimension == 3


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

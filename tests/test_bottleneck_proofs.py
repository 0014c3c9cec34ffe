"""Proofs for bottlenecks and combinations: what was tampered with is refused or proves less."""

from __future__ import annotations

import copy
from fractions import Fraction
from typing import Any

import pytest

import bcut
import bcut.instances
from bcut.errors import ResultError, VerificationError
from bcut.verification.verify import verify


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

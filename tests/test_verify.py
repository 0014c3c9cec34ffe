"""Whole results: what is right is stated, no stronger than it holds, and tampering is refused."""

from __future__ import annotations

import json
from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations, permutations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bcut
from bcut.errors import BcutError, ResultError, VerificationError
from bcut.geometry.configuration import PointConfiguration
from bcut.verification import verify as verify_module
from bcut.verification.certificate_data import CertifiedBound
from bcut.verification.verify import verify

CUBE = [[k & 1, k >> 1 & 1, k >> 2 & 1] for k in range(8)]
# One tetrahedron on alternate vertices, and the four corners that it leaves.
CUBE_5 = [[0, 3, 5, 6], [0, 1, 3, 5], [0, 2, 3, 6], [0, 4, 5, 6], [3, 5, 6, 7]]
# The paths from 0 to 7 along the edges.
CUBE_6 = [[0, a, a | b, 7] for a, b in permutations((1, 2, 4), 2)]

GRID = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]]

PENTAGON = [
    ["1", "0"],
    ["cos(2*pi/5)", "cos(2*pi/20)"],
    ["cos(4*pi/5)", "cos(6*pi/20)"],
    ["cos(6*pi/5)", "-cos(6*pi/20)"],
    ["cos(8*pi/5)", "-cos(2*pi/20)"],
    ["0", "0"],
]
WHEEL = [[0, 1, 5], [1, 2, 5], [2, 3, 5], [3, 4, 5], [0, 4, 5]]


def result_of(points: Sequence[Sequence[Any]], simplices: Any, /, **changes: Any) -> dict[str, Any]:
    """A result as `bcut solve` writes it, without a certificate; `a__b` changes entry b of entry a."""
    configuration = PointConfiguration.from_values(points, name="by hand")
    value = None if simplices is None else len(simplices)
    data: dict[str, Any] = {
        "schema": 1,
        "instance": {
            "name": configuration.name,
            "dimension": configuration.dimension,
            "points": [list(point) for point in configuration.exact_points()],
            "digest": configuration.digest,
        },
        "problem": {"objective": "cardinality", "sense": "min", "spanning": False},
        "status": "limit" if simplices is None else "optimal",
        "value": value,
        "bound": value,
        "gap": None if value is None else 0.0,
        "triangulation": simplices,
        "certificate": None,
    }
    for name, entry in changes.items():
        *path, last = name.split("__")
        target = data
        for step in path:
            target = target[step]
        target[last] = entry
    return data


def test_optimal_result_without_certificate_rests_on_the_solver() -> None:
    verification = verify(result_of(CUBE, CUBE_5))
    assert verification.statement == (
        "triangulation verified, value 5; no exact bound in this file; optimality rests on the run itself"
    )
    assert (verification.value, verification.exact_bound, verification.proven_optimal) == (5, None, False)
    assert any("face to face" in check for check in verification.checks)


def test_reason_for_a_missing_bound_is_passed_on() -> None:
    certificate = {"bound": None, "flag": None, "multipliers": None, "cuts": [], "reason": "out of time"}
    statement = verify(result_of(CUBE, CUBE_5, certificate=certificate)).statement
    assert "no exact bound in this file (out of time)" in statement


@pytest.mark.parametrize("status", ["limit", "interrupted"])
def test_stopped_run_claims_nothing(status: str) -> None:
    verification = verify(result_of(CUBE, CUBE_6, status=status, bound=4.5, gap=0.25))
    assert f"not claimed to be optimal (status '{status}')" in verification.statement
    assert "the bound 9/2 rests on the solver's tree" in verification.statement
    assert not verification.proven_optimal


@pytest.mark.parametrize("status", ["limit", "interrupted", "bound"])
def test_result_without_triangulation(status: str) -> None:
    verification = verify(result_of(CUBE, None, status=status, bound=5))
    assert f"no triangulation in this result (status '{status}')" in verification.statement
    assert "the bound 5 rests on the solver's tree" in verification.statement
    assert verification.value is None


def test_result_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "cube.json"
    path.write_text(json.dumps(result_of(CUBE, CUBE_5)))
    assert verify(path) == verify(str(path)) == verify(result_of(CUBE, CUBE_5))


def test_irrational_points_survive_the_file(tmp_path: Path) -> None:
    path = tmp_path / "pentagon.json"
    path.write_text(json.dumps(result_of(PENTAGON, WHEEL, problem__spanning=True)))
    assert verify(path).value == 5


COSTS = {"default": "1/2", "costs": [[[0, 1, 3], 2], [[1, 3, 4], "0.1"], [[2, 1, 4], 0.25]]}
GRID_4 = [[0, 1, 3], [1, 3, 4], [1, 2, 4], [2, 4, 5]]


@pytest.mark.parametrize("value", ["57/20", 2.85])
def test_value_of_an_embedded_costs_table(value: str | float) -> None:
    data = result_of(
        GRID, GRID_4, value=value, bound=value, problem__objective="costs:gone.json", problem__costs=COSTS
    )
    assert verify(data).value == Fraction(57, 20)


def test_bound_is_not_rounded_where_one_cost_is_no_integer() -> None:
    costs = {"default": 1, "costs": [[[0, 1, 3], "1/2"]]}
    changes = {"problem__objective": "costs:gone.json", "problem__costs": costs, "value": 3.5}
    verify(result_of(GRID, GRID_4, bound=3.5, **changes))
    with pytest.raises(VerificationError, match="'optimal', but its bound 31/10 leaves room"):
        verify(result_of(GRID, GRID_4, bound="31/10", gap=0.4 / 3.5, **changes))


def test_value_of_a_registered_measure() -> None:
    values = [Fraction(x) for x in np.random.default_rng(3).random(20).tolist()]
    colex = sorted(combinations(range(6), 3), key=lambda simplex: simplex[::-1])
    total = sum(values[colex.index(tuple(simplex))] for simplex in GRID_4)
    data = result_of(
        GRID, GRID_4, value=float(total), bound=float(total), problem__objective="random-costs:3"
    )
    assert verify(data).value == total
    data["value"] = data["bound"] = float(np.nextafter(float(total), 1))
    with pytest.raises(VerificationError, match="its triangulation has the value"):
        verify(data)


MOVED = [["1/2", "0", "0"], *[[str(x) for x in point] for point in CUBE[1:]]]


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"triangulation": CUBE_5[1:]}, "one simplex only"),
        ({"triangulation": [[0, 3, 5, 7], *CUBE_5[1:]]}, "overlap"),
        ({"triangulation": CUBE_6}, "claims the value 5, but its triangulation has the value 6"),
        ({"value": 4, "bound": 4}, "claims the value 4"),
        ({"value": None, "gap": None}, "claims no value"),
        ({"value": 5.5}, "claims the value 11/2"),
        ({"bound": 6, "gap": 0.2}, "value 5 is better than its bound 6"),
        ({"bound": 5.0001, "gap": 2e-5}, "is better than its bound"),
        ({"bound": 4, "gap": 0.2}, "'optimal', but its bound 4 leaves room for a better value than 5"),
        ({"bound": None, "gap": None}, "'optimal', but it has no bound"),
        ({"gap": 0.1}, "its gap is 0.1, but .* have the gap 0"),
        ({"gap": None}, "its gap is none"),
        ({"status": "limit", "bound": None, "gap": 0.0}, "has the gap 0, but not both"),
        ({"triangulation": None}, "'optimal', but it contains no triangulation"),
        ({"status": "limit", "triangulation": None}, "claims the value 5, but contains no triangulation"),
        ({"status": "infeasible", "triangulation": None, "value": None}, "every point configuration has"),
        ({"problem__sense": "max", "bound": 6, "gap": 0.2}, "'optimal', but its bound 6 leaves room"),
        ({"problem__sense": "max", "bound": 4, "gap": 0.2}, "value 5 is better than its bound 4"),
        ({"instance__points": MOVED}, "instance.digest does not belong to instance.points"),
        ({"instance__digest": "0" * 64}, "instance.digest does not belong to instance.points"),
        ({"instance__dimension": 4}, "instance.dimension is 4, but the points have 3"),
    ],
)
def test_tampered_results_are_refused(changes: dict[str, Any], reason: str) -> None:
    verify(result_of(CUBE, CUBE_5))
    with pytest.raises(VerificationError, match=f"the result: .*{reason}") as caught:
        verify(result_of(CUBE, CUBE_5, **changes))
    assert caught.value.exit_status == 2


def test_spanning_result_that_leaves_points_out_is_refused() -> None:
    data = result_of(GRID, [[0, 2, 3], [2, 3, 5]])
    verify(data)
    data["problem"]["spanning"] = True
    with pytest.raises(VerificationError, match="not spanning"):
        verify(data)


def test_solver_tolerance_is_forgiven_in_bounds_that_are_doubles() -> None:
    assert verify(result_of(CUBE, CUBE_5, bound=5 + 1e-10)).value == 5
    assert verify(result_of(CUBE, CUBE_5, bound=4.2, gap=0.16)).value == 5


TINY = {"default": "1/1000000000000", "costs": []}


def tiny_grid(bound: Any, /, **costs: Any) -> dict[str, Any]:
    """Four triangles of cost 1e-12 each, said to be optimal."""
    apart = abs(4e-12 - float(Fraction(bound)))
    table = {**TINY, **costs}
    objective = {"problem__objective": "costs:gone.json", "problem__costs": table}
    return result_of(GRID, GRID_4, value="1/250000000000", bound=bound, gap=apart, **objective)


CHEAP = [[simplex, "1/1000000000000"] for simplex in GRID_4]
ALL_TRIANGLES = [
    [list(t), "1/1000000000000"] for t in combinations(range(6), 3) if t not in [(0, 1, 2), (3, 4, 5)]
]


@pytest.mark.parametrize(
    "costs",
    [
        {},
        # Nothing costs 1, whatever the table says.
        {"costs": [[[0, 1, 2], 1]]},
        {"default": 1, "costs": ALL_TRIANGLES},
    ],
)
@pytest.mark.parametrize("bound", ["0", 0.0, 3.9e-12, "-1/1000000000000"])
def test_small_costs_do_not_make_values_optimal(bound: Any, costs: dict[str, Any]) -> None:
    assert verify({**tiny_grid(bound, **costs), "status": "limit"}).value == Fraction(4, 10**12)
    with pytest.raises(
        VerificationError, match=r"'optimal', but its bound .* leaves room for a better value"
    ):
        verify(tiny_grid(bound, **costs))
    turned = tiny_grid(bound, **costs)
    turned["problem"]["sense"] = "max"
    # The value is better than such a bound, and by more than rounding explains.
    with pytest.raises(VerificationError, match="is better than its bound"):
        verify(turned)


def test_the_largest_cost_is_not_looked_for_where_sets_are_too_many() -> None:
    with pytest.raises(VerificationError, match="leaves room"):
        verify(tiny_grid(0), max_subsets=1)
    # One of them may cost 1, as far as that is known without looking at all.
    assert verify(tiny_grid(0, costs=[[[0, 1, 2], 1]]), max_subsets=1).value == Fraction(4, 10**12)


def test_integers_as_large_as_what_solvers_tell_apart() -> None:
    """Costs of 10^15 with bounds from floating-point solvers: optimal within the relative gap of other large values."""
    costs = {"default": 10**15 + 1, "costs": []}
    value = 5 * (10**15 + 1)
    changes: dict[str, Any] = {
        "problem__objective": "costs:gone.json",
        "problem__costs": costs,
        "value": value,
    }
    for bound in (value, value - 5, value - 10**6):
        checked = verify(result_of(CUBE, CUBE_5, bound=bound, gap=(value - bound) / value, **changes))
        assert (checked.value, checked.proven_optimal) == (value, False)
        assert "optimality rests on the run itself" in checked.statement
    with pytest.raises(VerificationError, match="leaves room"):
        verify(result_of(CUBE, CUBE_5, bound=value - 10**7, gap=10**7 / value, **changes))


def test_solve_and_verify_agree_on_large_integers(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    simplices = [list(simplex) for simplex in combinations(range(8), 3)]
    table = [
        [simplex, int(cost)]
        for simplex, cost in zip(
            simplices, 10**15 * rng.integers(1, 9, 56) + rng.integers(0, 4, 56), strict=True
        )
    ]
    file = tmp_path / "costs.json"
    file.write_text(json.dumps({"costs": table}))
    for seed in range(8):
        for sense in ("min", "max"):
            result = bcut.solve(f"random:8,2,seed={seed}", objective=f"costs:{file}", sense=sense)
            assert result.status == "optimal"
            assert verify(result).value == result.value


@pytest.mark.parametrize("bound", [3.99999999999e-12, "3999999999/1000000000000000000000"])
def test_what_solvers_leave_open_is_relative_to_small_values_too(bound: Any) -> None:
    assert "optimality rests on the run itself" in verify(tiny_grid(bound)).statement


@pytest.mark.parametrize("costs", [{"default": 1, "costs": CHEAP}, {"default": None, "costs": CHEAP}])
def test_a_small_value_of_larger_costs_is_compared_with_these(costs: dict[str, Any]) -> None:
    # All others cost 1, or what they cost is not known: solvers cannot tell 0 from 4e-12 then.
    assert "optimality rests on the run itself" in verify(tiny_grid(0, **costs)).statement
    with pytest.raises(VerificationError, match="leaves room"):
        verify(tiny_grid(-1e-8, **costs))
    hundredth = {**costs, "default": "1/100"} if costs["default"] else costs
    verify(tiny_grid(-4e-12, **hundredth))


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"schema": 2}, "has schema 2, but this version of bcut reads schema 1"),
        ({"schema": True}, "has schema true"),
        ({"instance": []}, "'instance': this is a JSON object, not"),
        ({"instance__points": "cube"}, "'instance.points': this is a list of points"),
        (
            {"instance__points": [["0", "0"], 3]},
            r"'instance.points\[1\]': a point is a list of coordinates, not 3",
        ),
        ({"instance__points": [["0", 0.5]]}, "coordinates are exact, as text, not 0.5"),
        ({"instance__points": [["0", "x"], ["1", "0"], ["0", "1"]]}, r"instance.points: .*'?x"),
        (
            {"instance__points": [["0", "0"], ["1", "0"], ["2", "0"]]},
            "instance.points: the points lie in a common",
        ),
        ({"instance__points": [["0", "0"], ["1"], ["2", "0"]]}, "instance.points: point 1 has 1 coordinates"),
        ({"instance__dimension": "3"}, "'instance.dimension': this is an integer"),
        ({"instance__digest": 5}, "'instance.digest': this is a text"),
        ({"problem__sense": "down"}, "'problem.sense': this is one of min, max, not \"down\""),
        ({"problem__spanning": 1}, "'problem.spanning': this is true or false, not 1"),
        (
            {"problem__objective": "beauty"},
            "problem.objective is 'beauty', a measure that this version does not know",
        ),
        ({"problem__objective": "random-costs:x"}, "random-costs:x"),
        ({"problem__objective": "costs:c.json"}, "problem.costs is missing"),
        ({"problem__costs": 3}, "'problem.costs': this is a JSON object"),
        ({"problem__costs": {"costs": []}}, "has no entry 'problem.costs.default'"),
        ({"problem__costs": {"default": 1, "costs": [[[0, 1, 3, 5]]]}}, "a pair of a simplex and its cost"),
        (
            {"problem__costs": {"default": 1, "costs": [[[0, 1], 1], [[1, 0], 2]]}},
            "each simplex has one cost",
        ),
        ({"problem__costs": {"default": "1/0", "costs": []}}, "a rational as text"),
        ({"status": "done"}, "'status': this is one of optimal"),
        ({"value": "five"}, "'value': this is a rational as text"),
        ({"value": float("inf")}, "'value': this is a finite number"),
        ({"value": True}, "'value': this is a finite number"),
        ({"triangulation": {"0": [0, 1, 2, 4]}}, "'triangulation': this is a list of simplices"),
        ({"triangulation": [[0, 1, 2, "4"]]}, r"'triangulation\[0\]': this is an integer, not \"4\""),
        ({"certificate": "none"}, "'certificate': this is a JSON object or null"),
        ({"certificate": {}}, "has no entry 'certificate.bound'"),
        ({"certificate": {"bound": 5}}, "'?certificate"),
    ],
)
def test_malformed_results(changes: dict[str, Any], reason: str) -> None:
    with pytest.raises(ResultError, match=f"the result: .*{reason}") as caught:
        verify(result_of(CUBE, CUBE_5, **changes))
    assert caught.value.exit_status == 2


@pytest.mark.parametrize(
    "name",
    [
        "schema",
        "instance",
        "instance.points",
        "instance.name",
        "problem",
        "problem.sense",
        "status",
        "value",
        "bound",
        "gap",
        "triangulation",
        "certificate",
    ],
)
def test_missing_entries_are_named(name: str) -> None:
    data = result_of(CUBE, CUBE_5)
    *path, last = name.split(".")
    target = data
    for step in path:
        target = target[step]
    del target[last]
    with pytest.raises(ResultError, match=f"has no entry '{name}'"):
        verify(data)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "is not JSON .line 1, column 1"),
        (b"{", "is not JSON"),
        (b"[1, 2]", "a result is a JSON object"),
        (b"\xff\xfe{}", "is not UTF-8 text"),
        (b'{"schema": NaN}', "NaN is no number"),
        (b"[" * 100_000, "is not JSON"),
    ],
)
def test_files_that_hold_no_result(tmp_path: Path, content: bytes, reason: str) -> None:
    path = tmp_path / "bad.json"
    path.write_bytes(content)
    with pytest.raises(ResultError, match=f"bad.json: .*{reason}"):
        verify(path)


@pytest.mark.parametrize(
    ("name", "reason"), [("gone.json", "no such file"), ("", "cannot be read"), ("a\0b", "cannot")]
)
def test_files_that_cannot_be_read(tmp_path: Path, name: str, reason: str) -> None:
    with pytest.raises(ResultError, match=reason):
        verify(f"{tmp_path}/{name}")


def test_random_damage_never_escapes_as_another_error() -> None:
    text = json.dumps(result_of(CUBE, CUBE_5))
    generator = np.random.default_rng(11)
    for _ in range(300):
        position = int(generator.integers(len(text)))
        damaged = text[:position] + chr(int(generator.integers(32, 127))) + text[position + 1 :]
        try:
            data = json.loads(damaged)
        except json.JSONDecodeError:
            continue
        try:
            verification = verify(data)
        except BcutError:
            continue
        # What passes says the same as before; a name or an unused entry may have changed.
        assert verification.value == 5


def test_a_bound_beyond_a_verified_triangulation_is_a_defect(monkeypatch: pytest.MonkeyPatch) -> None:
    result = bcut.solve("cube:3")
    monkeypatch.setattr(
        verify_module, "certify", lambda *args, **options: CertifiedBound(Fraction(11, 2), integral=True)
    )
    with pytest.raises(
        VerificationError, match=r"proves the bound 6, but its triangulation has the better value 5"
    ):
        verify(result)

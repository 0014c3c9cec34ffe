from __future__ import annotations

import json
from fractions import Fraction
from math import comb, gcd
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import bcut.instances
from bcut.errors import InputError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.formulation import Formulation
from bcut.geometry.configuration import PointConfiguration
from bcut.instance import load_instance
from bcut.objectives.measures import MEASURES, read_costs
from bcut.objectives.objective import from_fractions, make_objective


@pytest.fixture(scope="module")
def square() -> Formulation:
    """The four points of a square: simplices 012, 013, 023, 123."""
    return cocircuit_formulation(load_instance("cube:2"))


def write(path: Path, data: Any) -> str:
    path.write_text(data if isinstance(data, str) else json.dumps(data), encoding="utf-8")
    return f"costs:{path}"


def test_cardinality_counts_simplices(square: Formulation) -> None:
    objective = make_objective("cardinality", square)
    assert objective.value([0, 3]) == 2
    assert objective.costs.tolist() == [1.0] * 4
    assert objective.unit == 1


def test_senses_turn_the_sign(square: Formulation) -> None:
    assert make_objective("cardinality", square).sign == 1
    assert make_objective("cardinality", square, sense="max").sign == -1


def test_random_costs_are_the_doubles_of_the_generator_by_colexicographic_rank() -> None:
    formulation = cocircuit_formulation(load_instance("grid:3,3"))
    objective = make_objective("random-costs:7", formulation)
    drawn = np.random.default_rng(7).random(comb(9, 3))
    for column, (a, b, c) in enumerate(formulation.simplices.tolist()):
        rank = comb(a, 1) + comb(b, 2) + comb(c, 3)
        assert objective.value([column]) == Fraction(drawn[rank])
        assert objective.costs[column] == drawn[rank]
    assert not objective.counts_units


def test_random_costs_do_not_depend_on_which_simplices_are_candidates() -> None:
    configuration = load_instance("grid:3,3")
    every, some = (cocircuit_formulation(configuration, spanning=spanning) for spanning in (False, True))
    columns = every.columns_of(some.simplices)
    expected = make_objective("random-costs:3", every).costs[columns]
    assert make_objective("random-costs:3", some).costs.tolist() == expected.tolist()


def test_costs_of_a_file_are_exact(square: Formulation, tmp_path: Path) -> None:
    costs = [[[2, 1, 0], "1/3"], [[0, 1, 3], 0.1], [[1, 2, 3], "-2.5e-1"]]
    objective = make_objective(write(tmp_path / "c.json", {"default": 7, "costs": costs}), square)
    assert [tuple(row) for row in square.simplices.tolist()] == [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)]
    expected = [Fraction(1, 3), Fraction(0.1), Fraction(7), Fraction(-1, 4)]
    assert [objective.value([column]) for column in range(4)] == expected
    assert objective.value([0, 1, 2, 3]) == sum(expected)
    assert objective.costs.tolist() == [float(value) for value in expected]


def test_the_default_of_a_costs_file_is_one(square: Formulation, tmp_path: Path) -> None:
    objective = make_objective(write(tmp_path / "c.json", {"costs": [[[0, 1, 2], 5]]}), square)
    assert objective.numerators.tolist() == [5, 1, 1, 1]


def test_costs_of_simplices_that_are_no_candidates_are_ignored(tmp_path: Path) -> None:
    formulation = cocircuit_formulation(load_instance("grid:3,3"), spanning=True)
    text = write(tmp_path / "c.json", {"default": 2, "costs": [[[0, 1, 2], 9], [[0, 2, 6], "1/7"]]})
    objective = make_objective(text, formulation)
    assert set(objective.numerators.tolist()) == {2}


def test_the_bundled_costs_of_the_paper() -> None:
    path = bcut.instances.path("pentagon-center-costs")
    formulation = cocircuit_formulation(load_instance("pentagon-center"))
    costs = make_objective(f"costs:{path}", formulation).numerators.tolist()
    assert sorted(costs) == [0] * 10 + [1] * 10


BAD_COSTS = [
    ("", r"c\.json.*line 1"),
    ("[]", r"c\.json: expected \{"),
    ({"default": 1}, r"c\.json: expected \{"),
    ({"costs": [], "extra": 1}, r"c\.json: expected \{"),
    ({"costs": {}}, r"c\.json: 'costs' must be a list"),
    ({"costs": [[[0, 1, 2]]]}, r"c\.json: entry 0: expected \[\[vertices\], cost\]"),
    ({"costs": [[[0, 1, 2], 1], [[0, 1], 1]]}, r"c\.json: entry 1: a simplex here has 3 distinct vertices"),
    ({"costs": [[[0, 1, 1], 1]]}, r"c\.json: entry 0: a simplex here has 3 distinct"),
    ({"costs": [[[0, 1, 4], 1]]}, r"c\.json: entry 0: vertices are integers from 0 to 3"),
    ({"costs": [[[0, 1, True], 1]]}, r"c\.json: entry 0: vertices are integers"),
    ({"costs": [[[0, 1, -1], 1]]}, r"c\.json: entry 0: vertices are integers"),
    ({"costs": [[[0, 1, 2], 1], [[2, 1, 0], 2]]}, r"c\.json: entry 1: \[0, 1, 2\] has a cost already"),
    ({"costs": [[[0, 1, 2], "one"]]}, r"c\.json: entry 0: a cost is a finite number"),
    ({"costs": [[[0, 1, 2], "1/0"]]}, r"c\.json: entry 0: a cost is a finite number"),
    ({"costs": [[[0, 1, 2], True]]}, r"c\.json: entry 0: a cost is"),
    ({"costs": [[[0, 1, 2], None]]}, r"c\.json: entry 0: a cost is"),
    ({"default": "x", "costs": []}, r"c\.json: default: a cost is"),
    ('{"costs": [[[0, 1, 2], NaN]]}', r"c\.json: entry 0: a cost is"),
    ('{"costs": [[[0, 1, 2], Infinity]]}', r"c\.json: entry 0: a cost is"),
    ('{"costs": [[[0, 1, 2], 1e999]]}', r"c\.json: entry 0: a cost is"),
    ({"costs": [[[0, 1, 2], "1e999"]]}, r"c\.json: entry 0: a cost is"),
    ({"costs": [[[0, 1, 2], "1e999999999"]]}, r"c\.json: entry 0: a cost is"),
    ({"costs": [[[0, 1, 2], "1e-400"]]}, r"c\.json: entry 0: a cost is"),
    ({"costs": [[[0, 1, 2], "1e-999999999"]]}, r"c\.json: entry 0: a cost is"),
    ({"costs": [[[0, 1, 2], "1" + "0" * 400]]}, r"c\.json: entry 0: a cost is .*\.\.\.$"),
    ('{"costs": [[[0, 1, 2], ' + "1" * 5000 + "]]}", r"c\.json: cannot be read"),
    ("[" * 200_000, r"c\.json"),
]


@pytest.mark.parametrize(("data", "message"), BAD_COSTS)
def test_bad_costs_files_are_refused_with_the_place(
    square: Formulation, tmp_path: Path, data: Any, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        make_objective(write(tmp_path / "c.json", data), square)


def test_costs_files_that_cannot_be_read_are_refused(square: Formulation, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.json: cannot be read"):
        make_objective(f"costs:{tmp_path / 'none.json'}", square)
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"binary\.json: is not UTF-8"):
        make_objective(f"costs:{tmp_path / 'binary.json'}", square)
    with pytest.raises(InputError, match="cannot be read"):
        make_objective(f"costs:{tmp_path}", square)


@pytest.mark.parametrize(
    ("text", "sense", "message"),
    [
        ("cardinalty", "min", "unknown objective 'cardinalty': did you mean 'cardinality'"),
        ("zzz", "min", "known are .*cardinality"),
        ("", "min", "unknown objective ''"),
        ("cardinality:3", "min", "takes no argument"),
        ("random-costs", "min", "random-costs:SEED"),
        ("random-costs:-1", "min", "non-negative integer"),
        ("random-costs:1.5", "min", "non-negative integer"),
        ("costs", "min", "name the file"),
        ("cardinality", "least", "'min' or 'max'"),
    ],
)
def test_bad_objectives_are_refused(square: Formulation, text: str, sense: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make_objective(text, square, sense=sense)


def test_a_new_measure_is_a_function_with_a_name(
    square: Formulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(MEASURES, "last", lambda configuration, simplices, argument: simplices[:, -1])
    assert make_objective("last:x", square).value([0, 3]) == 5


@given(st.lists(st.fractions(max_denominator=10**6), min_size=1, max_size=8), st.data())
def test_values_are_exact_sums(costs: list[Fraction], data: st.DataObject) -> None:
    objective = from_fractions("x", "min", costs)
    chosen = data.draw(st.lists(st.integers(0, len(costs) - 1), unique=True))
    assert objective.value(chosen) == sum(costs[i] for i in chosen)
    assert objective.costs.tolist() == [float(cost) for cost in costs]
    part = objective.restricted_to(np.array(chosen, dtype=np.int64))
    assert part.value(range(len(chosen))) == objective.value(chosen)


@pytest.mark.parametrize(
    ("costs", "fits"),
    [([2**40, -(2**40)], True), ([2**40 + 1], False), ([Fraction(1, 3), Fraction(2**39)], False)],
)
def test_only_small_numerators_are_kept_in_64_bits(costs: list[Any], fits: bool) -> None:
    objective = from_fractions("x", "min", [Fraction(c) for c in costs])
    assert objective.fits_64_bits is fits
    assert [objective.value([i]) for i in range(len(costs))] == costs


def test_costs_beyond_64_bits_are_summed_exactly() -> None:
    objective = from_fractions("x", "max", [Fraction(10**300), Fraction(1), Fraction(-(10**300))])
    assert objective.value([0, 1, 2]) == 1


@given(st.lists(st.fractions(-9, 9, max_denominator=12), min_size=1, max_size=8), st.fractions())
def test_every_value_is_a_multiple_of_the_unit(costs: list[Fraction], bound: Fraction) -> None:
    objective = from_fractions("x", "min", costs)
    multiples = [cost / objective.unit for cost in costs]
    assert all(multiple.denominator == 1 for multiple in multiples)
    assert gcd(*(int(multiple) for multiple in multiples)) in (0, 1)
    rounded = objective.rounded_up(bound)
    assert bound <= rounded < bound + objective.unit
    assert (rounded / objective.unit).denominator == 1
    assert objective.counts_units
    assert objective.solver_unit == objective.unit
    assert objective.solver_costs.tolist() == [float(multiple) for multiple in multiples]


@pytest.mark.parametrize(
    ("costs", "counts"),
    [
        ([0, 0], True),
        ([10**6, 1], True),
        ([10**6 + 1, 1], False),
        ([10**30, 3 * 10**30], True),
        ([Fraction(1, 10**30), Fraction(1, 10**30)], True),
        ([Fraction(1, 10**30), Fraction(1, 10**20)], False),
        ([10**300, 1], False),
    ],
)
def test_solvers_see_costs_of_ordinary_size(costs: list[Any], counts: bool) -> None:
    objective = from_fractions("x", "min", [Fraction(cost) for cost in costs])
    assert objective.counts_units is counts
    assert np.abs(objective.solver_costs).max() <= (10**6 if counts else 1)
    restored = objective.solver_costs * float(objective.solver_unit)
    assert restored.tolist() == pytest.approx([float(cost) for cost in costs], rel=1e-15)


def test_read_costs_returns_the_default_and_the_table(tmp_path: Path) -> None:
    write(tmp_path / "c.json", {"default": "1/2", "costs": [[[3, 1, 0], 4]]})
    assert read_costs(tmp_path / "c.json", load_instance("cube:2")) == (
        Fraction(1, 2),
        {(0, 1, 3): Fraction(4)},
    )


def test_costs_beyond_the_range_of_doubles_are_refused() -> None:
    """Exact volumes may be smaller, or add up to more, than a double can be."""
    for scale, message in (
        (1e-120, "the largest cost is about 1e-360, below the range"),
        (1e95, "sums beyond the range"),
    ):
        points = (scale * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])).tolist()
        formulation = cocircuit_formulation(PointConfiguration.from_values(points))
        with pytest.raises(InputError, match=message):
            make_objective("volume", formulation)
        assert make_objective("cardinality", formulation).largest_cost == 1
    for scale in (1e-95, 1e90):
        points = (scale * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])).tolist()
        formulation = cocircuit_formulation(PointConfiguration.from_values(points))
        assert make_objective("volume", formulation).largest_cost > 0

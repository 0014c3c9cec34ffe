"""Solving at limits: what was found is handed out, and separators and options that are wrong are told."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from oracles import HullCuts, Scripted
from reference import assert_triangulation
from solving import METHODS

import bcut
import bcut.instances
from bcut.errors import InputError, SeparatorError, SeparatorLoadError, SolverError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.instance import load_instance
from bcut.separation.seam import Cut, FractionalPoint
from bcut.verification.verify import verify


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("sense", ["min", "max"])
@pytest.mark.parametrize("objective", ["cardinality", "random-costs:1"])
def test_no_time_at_all_still_gives_a_triangulation(method: str, sense: str, objective: str) -> None:
    result = bcut.solve("cuboctahedron", sense=sense, time_limit=0, method=method, objective=objective)
    assert result.status == "limit"
    assert result.triangulation is not None
    assert_triangulation(load_instance("cuboctahedron").scalars(), result.triangulation)
    assert verify(result).value == pytest.approx(result.value)


def test_a_time_limit_keeps_the_triangulation() -> None:
    result = bcut.solve("dodecahedron", sense="max", time_limit=1.5, method="scip")
    assert result.status == "limit"
    assert result.value is not None
    assert result.bound is None or result.bound >= result.value
    verify(result)


def test_a_time_limit_in_the_root_keeps_the_bound(time_is_up: Callable[[], None]) -> None:
    def slow(point: FractionalPoint) -> Iterator[Cut]:
        time_is_up()
        yield from ()

    result = bcut.solve("random:12,3,seed=1000", spanning=True, separators=[Scripted(slow)], time_limit=900)
    assert result.status == "limit"
    assert result.bound == 17
    assert result.root.lp == pytest.approx(16.5)
    assert result.value is not None
    assert result.value >= 17
    verify(result)


def test_bound_with_no_time() -> None:
    result = bcut.bound("dodecahedron", time_limit=0)
    assert (result.status, result.value, result.bound, result.triangulation) == ("limit", None, None, None)


@pytest.mark.parametrize("method", METHODS)
def test_ctrl_c_in_a_separator_hands_out_what_there_is(method: str) -> None:
    def interrupt(point: FractionalPoint) -> Iterator[Cut]:
        raise KeyboardInterrupt
        yield

    result = bcut.solve(
        "random:12,3,seed=1000", spanning=True, separators=[Scripted(interrupt)], method=method
    )
    assert result.status == "interrupted"
    assert result.triangulation is not None
    verify(result)


@pytest.mark.parametrize("method", METHODS)
def test_a_separator_that_raises_ends_the_solve(method: str) -> None:
    def fail(point: FractionalPoint) -> Iterator[Cut]:
        raise OSError("gone")
        yield

    with pytest.raises(
        SeparatorError, match=r"separator 'mine': separate\(\) raised OSError: gone"
    ) as caught:
        bcut.solve("random:12,3,seed=1000", spanning=True, separators=[Scripted(fail, "mine")], method=method)
    assert "in fail" in caught.value.trace


def test_a_separator_that_is_invalid_is_not_believed_for_a_triangulation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    formulation = cocircuit_formulation(load_instance("cube:3"))

    def dissection(search: Any) -> None:
        search.offer(np.array([0, 1, 2]))
        search.status = "optimal"

    monkeypatch.setattr("bcut.solving.levels.solve_by_targets", dissection)
    assert len(formulation.simplices) > 3
    with pytest.raises(SolverError, match="cube:3: the solver's answer is no triangulation"):
        bcut.solve("cube:3")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"time_limit": -1}, "time limit -1"),
        ({"time_limit": float("nan")}, "time limit nan"),
        ({"time_limit": float("inf")}, "finite number of seconds"),
        ({"seed": -1}, "seed -1"),
        (
            {"method": "magic"},
            "unknown method 'magic': known are auto, listing, orbits, fixing, elimination, scip",
        ),
        ({"formulation": "7"}, "unknown formulation '7'"),
        ({"sense": "best"}, "'min' or 'max'"),
        ({"objective": "beauty"}, "unknown objective 'beauty'"),
    ],
)
def test_bad_options_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        bcut.solve("cube:3", **options)


@pytest.mark.parametrize(
    ("separators", "message"),
    [
        (["clik"], "unknown separator"),
        (["clique", "clique:max_cuts=3"], "'clique' is given twice"),
        ([7], "7 is no separator"),
        ([dict], "is no separator"),
    ],
)
def test_bad_separators_are_refused(separators: list[Any], message: str) -> None:
    with pytest.raises(SeparatorLoadError, match=message):
        bcut.solve("cube:3", separators=separators)


def test_separators_may_be_names_classes_or_objects() -> None:
    for separator in ("link", HullCuts, HullCuts()):
        result = bcut.solve("random:9,2,seed=1", separators=[separator])
        assert result.status == "optimal"

"""What the host does around separators: exact scaling, filters, counts, and naming the culprit."""

from __future__ import annotations

import json
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import Scripted, Watching, at_work

from bcut.errors import SeparatorError, SeparatorLoadError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.instance import load_instance
from bcut.separation import calls
from bcut.separation.driver import (
    MAX_COEFFICIENT,
    FamilyStatistics,
    Limits,
    Separation,
    UnusableCutError,
    to_integers,
)
from bcut.separation.seam import Cut, FractionalPoint, Problem, Separator

FORMULATION = cocircuit_formulation(load_instance("polygon:6"))
COUNT = FORMULATION.size[0]
HALVES = np.full(COUNT, 0.5)


def one(cut: Cut) -> Scripted:
    return Scripted(lambda point: [cut])


def added_by(*cuts: Cut, x: np.ndarray = HALVES, limits: Limits | None = None) -> list[tuple[Any, ...]]:
    separation = Separation([Scripted(lambda point: cuts)], Problem(FORMULATION), limits)
    return [(c.columns.tolist(), c.coefficients.tolist(), c.rhs) for c in separation.round(x)]


coefficient_lists = st.lists(
    st.tuples(st.integers(0, 19), st.fractions(-5, 5, max_denominator=12)),
    min_size=1,
    max_size=6,
    unique_by=lambda p: p[0],
)


@given(coefficient_lists, st.fractions(-9, 9, max_denominator=12))
def test_scaling_keeps_the_integer_points_of_a_cut(
    entries: list[tuple[int, Fraction]], rhs: Fraction
) -> None:
    columns, coefficients = [c for c, _ in entries], [v for _, v in entries]
    if not any(coefficients):
        return
    cut = to_integers(Cut(columns, rhs, coefficients), "x", COUNT)
    assert cut.columns.tolist() == sorted(c for c, v in entries if v)
    assert np.gcd.reduce(cut.coefficients) == 1
    rng = np.random.default_rng(len(entries))
    for point in rng.integers(0, 2, size=(40, COUNT)):
        left = sum((v * int(point[c]) for c, v in entries), Fraction(0))
        assert (left <= rhs) == (int(cut.coefficients @ point[cut.columns]) <= cut.rhs)


def test_right_hand_sides_are_rounded_down() -> None:
    cut = to_integers(Cut([3, 1], Fraction(7, 2), [2, 4]), "x", COUNT)
    assert (cut.columns.tolist(), cut.coefficients.tolist(), cut.rhs) == ([1, 3], [2, 1], 1)
    assert to_integers(Cut([0], Fraction(-1, 2)), "x", COUNT).rhs == -1


@pytest.mark.parametrize("kind", [list, tuple, np.array, lambda c: np.array(c, dtype=np.uint8)])
def test_columns_and_coefficients_of_any_integer_type(kind: Any) -> None:
    cut = to_integers(Cut(kind([4, 2]), np.int64(3), kind([2, 3])), "x", COUNT)
    assert (cut.columns.tolist(), cut.coefficients.tolist(), cut.rhs) == ([2, 4], [3, 2], 3)


def test_violation_and_efficacy() -> None:
    cut = to_integers(Cut([0, 1], 1, [3, 4]), "x", COUNT)
    assert cut.violation(HALVES) == pytest.approx(2.5)
    assert cut.efficacy(HALVES) == pytest.approx(0.5)


def test_cuts_that_are_not_violated_are_dropped_and_not_counted() -> None:
    separation = at_work(FORMULATION, one(Cut([0, 1], 1)))
    assert separation.round(HALVES) == []
    assert separation.statistics["scripted"] == FamilyStatistics(
        1, 0, 0, separation.statistics["scripted"].seconds
    )


def test_counts_of_calls_finds_and_additions() -> None:
    separation = at_work(
        FORMULATION, Scripted(lambda point: [Cut([0, 1, 2], 1), Cut([3, 4, 5], 1)]), Watching()
    )
    first = separation.round(HALVES)
    separation.confirm(first[0])
    separation.round(HALVES)
    counts = separation.statistics["scripted"]
    assert (counts.calls, counts.found, counts.added) == (2, 4, 1)
    assert counts.seconds > 0
    watching = separation.statistics["watching"]
    assert (watching.calls, watching.found, watching.added) == (2, 0, 0)


def test_statistics_go_on_where_they_were() -> None:
    counts = {"scripted": FamilyStatistics(calls=5, found=4, added=3, seconds=2.0)}
    separation = Separation([one(Cut([0, 1, 2], 1))], Problem(FORMULATION), statistics=counts)
    separation.confirm(separation.round(HALVES)[0])
    smaller = separation.restricted_to(np.arange(10))
    smaller.round(HALVES[:10])
    assert (counts["scripted"].calls, counts["scripted"].found, counts["scripted"].added) == (7, 6, 4)
    assert counts["scripted"].seconds > 2.0
    assert len(smaller.problem.simplices) == 10


def test_the_most_efficacious_cuts_come_first_and_the_number_is_limited() -> None:
    cuts = [Cut([0, 1], 0), Cut([2, 3, 4], 0), Cut([5], 0), Cut([6, 7, 8, 9], 0)]
    listed = added_by(*cuts, limits=Limits(cuts_per_round=3))
    assert [columns for columns, _, _ in listed] == [[6, 7, 8, 9], [2, 3, 4], [0, 1]]


def test_a_least_efficacy() -> None:
    assert added_by(Cut([0, 1], 0), limits=Limits(min_efficacy=0.71)) == []
    assert len(added_by(Cut([0, 1], 0), limits=Limits(min_efficacy=0.70))) == 1


def test_equal_inequalities_are_one_cut() -> None:
    same = [
        Cut([0, 1], 0),
        Cut([1, 0], 0),
        Cut([0, 1], Fraction(1, 2)),
        Cut([0, 1], 0, [2, 2]),
        Cut([0, 1, 2], 0, [3, 3, 0]),
    ]
    assert added_by(*same) == [([0, 1], [1, 1], 0)]


def test_nearly_parallel_cuts_are_dropped_the_weaker_one() -> None:
    strong, weak = Cut([0, 1], 0), Cut([0, 1], 50, [100, 101])
    assert added_by(weak, strong) == [([0, 1], [1, 1], 0)]
    assert len(added_by(weak, strong, limits=Limits(max_parallelism=1.0))) == 2
    # Opposite directions are not parallel.
    assert len(added_by(Cut([0, 1], 0), Cut([0, 1], -2, [-1, -1]))) == 2


def test_a_confirmed_cut_is_not_offered_again_until_it_is_forgotten() -> None:
    separation = at_work(FORMULATION, one(Cut([0, 1, 2], 1)))
    (cut,) = separation.round(HALVES)
    assert len(separation.round(HALVES)) == 1
    separation.confirm(cut)
    assert separation.round(HALVES) == []
    separation.forget(cut)
    assert len(separation.round(HALVES)) == 1


def test_coefficients_too_large_for_a_solver_are_found_but_not_added() -> None:
    fine, large = Cut([0, 1], 0, [1, MAX_COEFFICIENT]), Cut([2, 3], 0, [1, MAX_COEFFICIENT + 1])
    huge, huge_side = Cut([4, 5], 0, [1, 10**40]), Cut([6, 7], -(10**40))
    separation = at_work(FORMULATION, Scripted(lambda point: [fine, large, huge, huge_side]))
    assert [cut.columns.tolist() for cut in separation.round(HALVES)] == [[0, 1]]
    assert separation.statistics["scripted"].found == 4
    with pytest.raises(UnusableCutError, match="separator 'x': a cut has numbers of more than 62 bits"):
        to_integers(huge, "x", COUNT)


def test_separators_are_not_asked_about_integral_points() -> None:
    watching = Watching()
    separation = at_work(FORMULATION, watching)
    x = np.zeros(COUNT)
    x[[0, 3]] = 1 - 1e-7
    assert separation.round(x) == []
    assert watching.points == []
    x[0] = 0.99
    separation.round(x)
    assert len(watching.points) == 1


def test_a_point_is_read_only_and_shows_its_support() -> None:
    x = np.zeros(COUNT)
    x[[2, 5, 7]] = [0.5, 1.0, 1e-9]
    point = FractionalPoint(Problem(FORMULATION), x)
    assert point.support.tolist() == [2, 5]
    assert point.fractional.tolist() == [2]
    with pytest.raises(ValueError, match="read-only"):
        point.x[0] = 1.0
    assert point.value(Cut([2, 5], 1, [Fraction(1, 2), 3])) == pytest.approx(3.25)
    assert point.value(Cut([2, 5], 1)) == pytest.approx(1.5)


def fail_in_a_helper() -> None:
    raise ZeroDivisionError("of my own making")


class FailsInSetup(Separator):
    name = "fails-in-setup"

    def setup(self, problem: Problem) -> None:
        fail_in_a_helper()

    def separate(self, point: FractionalPoint) -> Iterable[Cut]:
        return ()


def fails_late(point: FractionalPoint) -> Iterable[Cut]:
    yield Cut([0, 1, 2], 1)
    fail_in_a_helper()


def test_a_separator_that_raises_is_named_with_its_own_traceback() -> None:
    separation = at_work(FORMULATION, Watching(), Scripted(fails_late, "late"))
    with pytest.raises(
        SeparatorError, match=r"separator 'late': separate\(\) raised ZeroDivisionError: of my"
    ) as caught:
        separation.round(HALVES)
    assert caught.value.separator == "late"
    assert "fail_in_a_helper" in caught.value.trace
    assert "fails_late" in caught.value.trace
    assert caught.value.exit_status == 5
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


def test_a_separator_that_raises_in_setup_is_named() -> None:
    with pytest.raises(
        SeparatorError, match=r"'fails-in-setup': setup\(\) raised ZeroDivisionError"
    ) as caught:
        at_work(FORMULATION, FailsInSetup())
    assert "fail_in_a_helper" in caught.value.trace


def test_a_traceback_begins_with_the_separator_s_own_lines() -> None:
    with pytest.raises(SeparatorError) as caught:
        at_work(FORMULATION, Scripted(fails_late)).round(HALVES)
    first = caught.value.trace.splitlines()[1]
    assert "oracles.py" in first or "test_driver.py" in first
    assert 'driver.py", line' not in caught.value.trace.replace("test_driver.py", "")


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        (None, r"separate\(\) returned None; yield Cuts or return a list of them"),
        (42, r"separate\(\) returned int 42; yield Cuts"),
        (Cut([0], 0), r"separate\(\) returned Cut Cut\(.*; yield Cuts"),
        ([None], r"separate\(\) must yield Cut objects, not None; write Cut\(simplices, rhs\)"),
        ([([0, 1], 1)], r"separate\(\) must yield Cut objects, not tuple \(\[0, 1\], 1\); write Cut"),
        ("clique", r"separate\(\) must yield Cut objects, not str 'c'; write Cut"),
        ([Cut([-1], 0)], r"must be distinct columns from 0 to 19, not list \[-1\]"),
        ([Cut([[0], [1, 2]], 0)], r"must be a non-empty list of columns, not list \[\[0\], \[1, 2\]\]"),
        ([Cut([0, 1], 0, 3)], "coefficients must be a list of numbers, or left out, not int 3"),  # type: ignore[arg-type]
    ],
)
def test_what_is_no_cut_is_said_without_a_traceback(returned: Any, message: str) -> None:
    with pytest.raises(SeparatorError, match=f"separator 'scripted': .*{message}") as caught:
        at_work(FORMULATION, Scripted(lambda point: returned)).round(HALVES)
    assert caught.value.trace == ""


def test_a_proof_becomes_plain_data() -> None:
    proof = {
        "clique": np.array([3, 4]),
        "weights": (np.float64(0.5), np.int64(2), Fraction(3, 2), np.bool_(True), None),
        "nested": {np.int64(7): [[np.float32(1.5)], "text"], 1: {}},
    }
    cut = to_integers(Cut([0, 1], 1, proof=proof), "x", COUNT)
    plain = {
        "clique": [3, 4],
        "weights": [0.5, 2, "3/2", True, None],
        "nested": {"7": [[1.5], "text"], "1": {}},
    }
    assert cut.proof == plain
    assert json.loads(json.dumps(cut.proof, allow_nan=False)) == plain


def test_no_proof_is_an_empty_one() -> None:
    assert to_integers(Cut([0, 1], 1, proof=None), "x", COUNT).proof == {}  # type: ignore[arg-type]
    assert to_integers(Cut([0, 1], 1), "x", COUNT).proof == {}


def holding_itself() -> list[Any]:
    proof: list[Any] = []
    proof.append(proof)
    return proof


@pytest.mark.parametrize(
    ("proof", "message"),
    [
        ([1, 2], r"must be a mapping such as .*, or left out, not list \[1, 2\]"),
        ("clique", "must be a mapping such as .*, or left out, not str 'clique'"),
        ({"members": {3}}, r"holds set \{3\} under 'members'; a proof is JSON-ready data"),
        ({"weights": [1.0, float("nan")]}, "holds the number nan under 'weights'"),
        ({"weights": np.array([np.inf])}, "holds the number inf under 'weights'"),
        ({"z": 1j}, "holds complex 1j under 'z'"),
        ({"when": np.datetime64("2000-01-01")}, "holds datetime64 .* under 'when'"),
        ({(0, 1): 2}, r"holds the key tuple \(0, 1\) under \(0, 1\)"),
        ({"faces": {None: 2}}, "holds the key NoneType None under 'faces'"),
        ({"faces": holding_itself()}, "is nested too deeply under 'faces', or holds itself"),
    ],
)
def test_a_proof_that_json_does_not_hold_is_refused(proof: Any, message: str) -> None:
    with pytest.raises(SeparatorError, match=f"separator 'scripted': a cut's proof {message}") as caught:
        at_work(FORMULATION, one(Cut([0, 1, 2], 1, proof=proof))).round(HALVES)
    assert caught.value.trace == ""


class Endless:
    """Yields cuts for ever, and notes whether it was closed; does something after so many of them."""

    def __init__(self, *cuts: Cut, after: int = 0, act: Callable[[], None] | None = None) -> None:
        self.cuts, self.after, self.act = cuts, after, act
        self.yielded, self.closed = 0, False

    def __call__(self, point: FractionalPoint) -> Iterator[Cut]:
        try:
            while True:
                yield self.cuts[self.yielded % len(self.cuts)]
                self.yielded += 1
                if self.act is not None and self.yielded == self.after:
                    self.act()
        finally:
            self.closed = True


@pytest.mark.parametrize("rhs", [0, 100], ids=["violated", "satisfied"])
def test_a_separator_that_does_not_end_is_named_after_so_many_cuts(
    monkeypatch: pytest.MonkeyPatch, rhs: int
) -> None:
    monkeypatch.setattr(calls, "MAX_CUTS", 1000)
    script = Endless(Cut([0, 1], rhs))
    message = r"separator 'scripted': separate\(\) yielded more than 1,000 cuts for one point and was stopped"
    with pytest.raises(calls.EndlessSeparatorError, match=message) as caught:
        at_work(FORMULATION, Scripted(script)).round(HALVES)
    assert script.yielded == 1000
    assert script.closed
    assert caught.value.exit_status == 5


def test_long_cuts_without_end_are_stopped_sooner(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calls, "MAX_COEFFICIENTS", 1000)
    script = Endless(Cut(list(range(COUNT)), 0))
    with pytest.raises(calls.EndlessSeparatorError, match="more than 1,000 coefficients for one point"):
        at_work(FORMULATION, Scripted(script)).round(HALVES)
    assert script.yielded == 1000 // COUNT


def test_as_many_cuts_as_are_allowed_are_fine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calls, "MAX_CUTS", 3)
    assert len(added_by(Cut([0, 1], 0), Cut([2], 0), Cut([3, 4, 5], 0))) == 3


def test_the_deadline_ends_a_round_and_keeps_the_cuts_so_far(time_is_up: Callable[[], None]) -> None:
    script, later = Endless(Cut([0, 1], 0), Cut([2, 3], 0), after=5, act=time_is_up), Watching()
    separation = Separation([Scripted(script), later], Problem(FORMULATION), deadline=time.monotonic() + 900)
    cuts = separation.round(HALVES)
    assert [cut.columns.tolist() for cut in cuts] == [[0, 1], [2, 3]]
    assert separation.cut_short
    assert script.closed
    assert later.points == []
    assert separation.statistics["watching"].calls == 0
    smaller = separation.restricted_to(np.arange(10))
    assert smaller.round(HALVES[:10]) == []
    assert smaller.cut_short


def test_without_a_deadline_that_has_passed_no_round_is_cut_short() -> None:
    for deadline in (None, time.monotonic() + 3600):
        separation = Separation([one(Cut([0, 1], 5))], Problem(FORMULATION), deadline=deadline)
        assert separation.round(HALVES) == []
        assert not separation.cut_short


def test_a_generator_that_refuses_to_be_closed_is_at_fault(time_is_up: Callable[[], None]) -> None:
    def clings(point: FractionalPoint) -> Iterator[Cut]:
        time_is_up()
        try:
            yield Cut([0], 0)
        finally:
            yield Cut([1], 0)

    separation = Separation([Scripted(clings)], Problem(FORMULATION), deadline=time.monotonic() + 900)
    with pytest.raises(SeparatorError, match=r"separator 'scripted': .*generator ignored GeneratorExit"):
        separation.round(HALVES)


@pytest.mark.parametrize("error", [SystemExit(3), GeneratorExit(), MemoryError(), StopIteration()])
def test_whatever_a_separator_raises_is_its_own(error: BaseException) -> None:
    def raises(point: FractionalPoint) -> Iterable[Cut]:
        raise error

    with pytest.raises(SeparatorError, match=f"separator 'scripted': .*{type(error).__name__}"):
        at_work(FORMULATION, Scripted(raises)).round(HALVES)


def test_ctrl_c_in_a_separator_is_no_fault_of_it() -> None:
    def raises(point: FractionalPoint) -> Iterable[Cut]:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        at_work(FORMULATION, Scripted(raises)).round(HALVES)


def test_an_error_shows_where_it_was_raised_when_printed() -> None:
    with pytest.raises(SeparatorError) as caught:
        at_work(FORMULATION, Scripted(fails_late)).round(HALVES)
    assert "fail_in_a_helper" in "".join(traceback.format_exception(caught.value))


def test_two_separators_of_one_name_are_refused() -> None:
    with pytest.raises(SeparatorLoadError, match="'watching' is given twice"):
        at_work(FORMULATION, Watching(), Watching())


def test_later_stages_are_asked_only_where_earlier_ones_have_nothing_to_add() -> None:
    class Late(Scripted):
        stage = 1

    first = Scripted(lambda point: [Cut([0], 0)] if point.x[0] > 0.4 else [], "first")
    late = Late(lambda point: [Cut([1], 0)], "late")
    separation = at_work(FORMULATION, late, first)
    assert [cut.family for cut in separation.round(HALVES)] == ["first"]
    assert separation.statistics["late"].calls == 0
    without_first = HALVES.copy()
    without_first[0] = 0.0
    assert [cut.family for cut in separation.round(without_first)] == ["late"]
    assert (separation.statistics["first"].calls, separation.statistics["late"].calls) == (2, 1)


def test_a_cut_that_is_known_already_does_not_keep_later_stages_out() -> None:
    class Late(Scripted):
        stage = 1

    first = Scripted(lambda point: [Cut([0], 0)], "first")
    separation = at_work(FORMULATION, first, Late(lambda point: [Cut([1], 0)], "late"))
    for cut in separation.round(HALVES):
        separation.confirm(cut)
    assert [cut.family for cut in separation.round(HALVES)] == ["late"]

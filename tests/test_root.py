"""The cutting-plane loop: values, exact bounds, limits, and cuts that come and go."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import highspy
import numpy as np
import pytest
from oracles import HullCuts, Scripted, Watching, at_work, incidence, with_gap
from scipy.optimize import linprog

import bcut.instances
from bcut.bounds import relaxation as relaxation_module
from bcut.bounds import root as root_module
from bcut.bounds.relaxation import InfeasibleRelaxationError, Relaxation
from bcut.bounds.root import RootBound, RootLimits, Round, root_bound
from bcut.errors import SeparatorError, SolverError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.formulation import Formulation
from bcut.instance import load_instance
from bcut.objectives.objective import Objective, make_objective
from bcut.separation.driver import IntegerCut
from bcut.separation.seam import Cut


def cut_of(columns: list[int], coefficients: list[int], rhs: int) -> IntegerCut:
    return IntegerCut("test", np.array(columns), np.array(coefficients), rhs, {})


def lp_with_cuts(formulation: Formulation, objective: Objective, cuts: list[IntegerCut]) -> float:
    """The value of the relaxation with cuts, by another way."""
    rows = np.zeros((len(cuts), formulation.size[0]))
    for row, cut in zip(rows, cuts, strict=True):
        row[cut.columns] = cut.coefficients
    solution = linprog(
        objective.sign * objective.costs,
        A_ub=rows if len(cuts) else None,
        b_ub=[cut.rhs for cut in cuts] if cuts else None,
        A_eq=formulation.matrix.astype(float),
        b_eq=formulation.lower,
        bounds=(0, 1),
        method="highs",
    )
    assert solution.status == 0
    return objective.sign * float(solution.fun)


@pytest.mark.parametrize(
    ("instance", "spanning", "value"),
    [
        ("cube:3", False, 5),
        ("cube:4", False, 16),
        ("dodecahedron", False, 22.5),
        ("random:12,3,seed=1000", True, 16.5),
        ("random:14,3,seed=1000", True, 20.5),
        ("random:16,3,seed=1000", True, 24.5),
        ("grid:3,3,3", True, 34.9091),
    ],
)
def test_values_of_known_relaxations(instance: str, spanning: bool, value: float) -> None:
    formulation = cocircuit_formulation(load_instance(instance), spanning=spanning)
    found = root_bound(formulation, make_objective("cardinality", formulation))
    assert found.lp == pytest.approx(value, abs=1e-4)
    assert found.lp == found.lp_after_cuts == found.rounds[0].lp
    assert len(found.rounds) == 1
    assert found.status in ("integral", "dry")
    assert found.first is not None
    assert float(found.first.value) == pytest.approx(found.lp, abs=1e-5)


def test_the_relaxation_of_the_paper_is_zero() -> None:
    formulation = cocircuit_formulation(load_instance("pentagon-center"))
    costs = make_objective(f"costs:{bcut.instances.path('pentagon-center-costs')}", formulation)
    assert root_bound(formulation, costs).lp == pytest.approx(0, abs=1e-9)
    found = root_bound(formulation, costs, at_work(formulation, HullCuts()))
    assert found.lp_after_cuts == pytest.approx(1, abs=1e-7)


@pytest.mark.parametrize("sense", ["min", "max"])
@pytest.mark.parametrize("number", range(6))
def test_cuts_close_the_gap_and_the_exact_bound_proves_it(number: int, sense: str) -> None:
    formulation, objective, optimum = with_gap(number, sense)
    before = root_bound(formulation, objective)
    assert abs(optimum - before.lp) > 0.4
    separation = at_work(formulation, HullCuts())
    found = root_bound(formulation, objective, separation)
    assert found.status == "integral"
    assert found.lp == pytest.approx(before.lp, abs=1e-7)
    assert found.lp_after_cuts == pytest.approx(optimum, abs=1e-7)
    assert found.last is not None
    assert found.first is not None
    assert found.first.value < found.last.value <= objective.sign * optimum
    assert float(found.last.value) == pytest.approx(objective.sign * optimum, abs=1e-5)
    # Cuts never move the bound back.
    values = [objective.sign * finished.lp for finished in found.rounds]
    assert values == pytest.approx(sorted(values), abs=1e-7)
    added = separation.statistics["hull"].added
    assert added == sum(finished.cuts.get("hull", 0) for finished in found.rounds) >= len(found.cuts) > 0
    assert found.rounds[-1].cuts == {}
    assert found.point is not None
    chosen = found.point > 0.5
    assert objective.value(np.flatnonzero(chosen)) == optimum


def test_the_value_is_that_of_the_relaxation_with_the_cuts_that_are_left() -> None:
    formulation, objective, _ = with_gap(2)
    found = root_bound(formulation, objective, at_work(formulation, HullCuts()), limits=RootLimits(rounds=15))
    assert found.status == "limit"
    assert found.lp_after_cuts == pytest.approx(lp_with_cuts(formulation, objective, found.cuts), abs=1e-7)


def test_slack_cuts_leave_and_may_come_back(monkeypatch: pytest.MonkeyPatch) -> None:
    formulation, objective, optimum = with_gap(2)
    results = {}
    for rounds in (1, 10**6):
        monkeypatch.setattr(root_module, "_ROUNDS_SLACK", rounds)
        separation = at_work(formulation, HullCuts())
        results[rounds] = root_bound(formulation, objective, separation), separation
    (eager, eager_separation), (never, never_separation) = results[1], results[10**6]
    assert len(never.cuts) == never_separation.statistics["hull"].added
    assert len(eager.cuts) < eager_separation.statistics["hull"].added
    assert eager.lp_after_cuts == pytest.approx(optimum, abs=1e-7)
    # What was dropped may be offered again; what is in may not.
    assert eager_separation.known == {cut.key for cut in eager.cuts}


@pytest.mark.parametrize("rounds", [0, 1, 3])
def test_a_limit_on_rounds_with_cuts(rounds: int) -> None:
    formulation, objective, _ = with_gap(5)
    found = root_bound(
        formulation, objective, at_work(formulation, HullCuts()), limits=RootLimits(rounds=rounds)
    )
    assert found.status == "limit"
    assert len(found.rounds) == rounds + 1
    assert [bool(finished.cuts) for finished in found.rounds] == [True] * rounds + [False]
    assert found.lp is not None


def test_a_deadline_that_has_passed() -> None:
    formulation, objective, _ = with_gap(5)
    found = root_bound(formulation, objective, limits=RootLimits(deadline=time.monotonic() - 1))
    assert found.status == "limit"
    assert (found.lp, found.lp_after_cuts, found.first, found.point) == (None, None, None, None)


def test_a_deadline_in_the_middle_keeps_what_was_found(time_is_up: Callable[[], None]) -> None:
    formulation, objective, _ = with_gap(5)

    def slow(point: Any) -> list[Cut]:
        time_is_up()
        return list(cuts.separate(point))

    cuts = HullCuts()
    cuts.setup(at_work(formulation, Watching()).problem)
    limits = RootLimits(deadline=time.monotonic() + 900)
    found = root_bound(formulation, objective, at_work(formulation, Scripted(slow)), limits=limits)
    assert found.status == "limit"
    assert found.lp == pytest.approx(7.5)
    assert len(found.rounds) == 1
    assert found.first is not None


def test_no_progress_for_some_rounds_ends_the_loop() -> None:
    formulation, objective, _ = with_gap(2)
    # No round moves the bound by a hundred times its size.
    limits = RootLimits(stall_rounds=3, stall=100.0)
    found = root_bound(formulation, objective, at_work(formulation, HullCuts()), limits=limits)
    assert found.status == "stalled"
    assert len(found.rounds) == 4


@pytest.mark.parametrize(("goal", "is_met"), [("7.4", True), ("7.6", False)])
def test_a_bound_at_the_goal_ends_the_loop_before_it_is_cut(goal: str, is_met: bool) -> None:
    formulation, objective, _ = with_gap(5)
    watching = Watching()
    limits = RootLimits(goal=Fraction(goal))
    found = root_bound(formulation, objective, at_work(formulation, watching), limits=limits)
    assert found.lp == pytest.approx(7.5)
    assert (found.status, len(watching.points)) == (("target", 0) if is_met else ("dry", 1))


def test_separators_that_find_nothing_end_the_loop() -> None:
    formulation, objective, _ = with_gap(0)
    watching = Watching()
    found = root_bound(formulation, objective, at_work(formulation, watching))
    assert found.status == "dry"
    assert len(found.rounds) == len(watching.points) == 1
    np.testing.assert_array_equal(watching.points[0], found.point)


def test_an_integral_point_is_not_shown_to_separators() -> None:
    formulation = cocircuit_formulation(load_instance("polygon:6"))
    watching = Watching()
    found = root_bound(
        formulation, make_objective("random-costs:1", formulation), at_work(formulation, watching)
    )
    assert found.status == "integral"
    assert not watching.points


def test_rounds_are_reported_as_they_finish() -> None:
    formulation, objective, _ = with_gap(0)
    seen: list[Round] = []
    found = root_bound(formulation, objective, at_work(formulation, HullCuts()), on_round=seen.append)
    assert seen == found.rounds


@pytest.mark.parametrize("below", [Fraction(0), Fraction(3, 2)])
def test_a_target_below_the_bound_ends_the_loop(below: Fraction) -> None:
    formulation, objective, optimum = with_gap(5)
    target = optimum - 1 - below
    found = root_bound(
        formulation, objective, at_work(formulation, HullCuts()), limits=RootLimits(target=Fraction(target))
    )
    assert found.status in ("target", "infeasible")


@pytest.mark.parametrize("sense", ["min", "max"])
@pytest.mark.parametrize("number", range(6))
def test_a_target_that_can_be_reached_keeps_all_that_reach_it(
    monkeypatch: pytest.MonkeyPatch, number: int, sense: str
) -> None:
    formulation, objective, optimum = with_gap(number, sense)
    monkeypatch.setattr(root_module, "_SHRINK", 1.0)
    limits = RootLimits(target=Fraction(objective.sign * optimum))
    found = root_bound(formulation, objective, at_work(formulation, HullCuts()), limits=limits)
    assert found.status == "integral"
    assert found.lp_after_cuts == pytest.approx(optimum, abs=1e-7)
    table = incidence(formulation)
    best = table[table @ objective.numerators == optimum]
    assert set(found.columns.tolist()) >= set(np.flatnonzero(best.any(axis=0)).tolist())
    assert len(found.columns) < formulation.size[0]
    assert found.point is not None
    assert len(found.point) == len(found.columns)
    assert found.separation is not None
    assert len(found.separation.problem.simplices) == len(found.columns)
    assert all(cut.columns.max() < len(found.columns) for cut in found.cuts)


@pytest.mark.parametrize("columns", [[0, 0], [0, 10**6]])
def test_rows_that_are_none_are_refused(columns: list[int]) -> None:
    """Without them the relaxation would be another one than its cuts say."""
    formulation = cocircuit_formulation(load_instance("polygon:6"))
    relaxation = Relaxation(formulation, make_objective("cardinality", formulation))
    with pytest.raises(SolverError, match="HiGHS refused the cuts"):
        relaxation.add([cut_of([1, 2], [1, 1], 1), cut_of(columns, [1, 1], 1)])
    assert not relaxation.cuts
    point = relaxation.solve()
    assert point is not None
    assert not len(point.slack)


def test_cuts_that_coincide_after_fixing_are_one_cut() -> None:
    formulation = cocircuit_formulation(load_instance("polygon:6"))
    relaxation = Relaxation(formulation, make_objective("cardinality", formulation))
    relaxation.add(
        [cut_of([0, 1], [1, 1], 1), cut_of([0, 2], [1, 1], 1), cut_of([3], [1], 1), cut_of([4], [-1], -1)]
    )
    smaller = relaxation.restricted_to(np.array([0, 5, 6]))
    assert [(cut.columns.tolist(), cut.rhs) for cut in smaller.cuts] == [([0], 1), ([], -1)]
    with pytest.raises(InfeasibleRelaxationError):
        smaller.solve()


def test_columns_without_a_triangulation_are_infeasible() -> None:
    formulation = cocircuit_formulation(load_instance("cube:3"))
    for columns in ([0, 5], []):
        part = formulation.restricted_to(np.array(columns, dtype=np.int64))
        found = root_bound(part, make_objective("cardinality", part), at_work(part, Watching()))
        assert found.status == "infeasible"
        assert found.lp is None


def test_cuts_that_contradict_each_other_refute_a_target_without_a_proof() -> None:
    # Not even the point 0 satisfies them, so that there is no greatest coverage to make a proof of.
    formulation = cocircuit_formulation(load_instance("cube:3"))
    cuts = [cut_of([0, 1], [-1, -1], -1), cut_of([0, 1], [1, 1], 0)]
    objective = make_objective("cardinality", formulation)
    found = root_bound(formulation, objective, limits=RootLimits(target=Fraction(4)), cuts=cuts)
    assert found.status == "infeasible"
    assert found.stages == []


@pytest.mark.parametrize("interior_point_from", [1, 10**9])
def test_both_algorithms_agree(monkeypatch: pytest.MonkeyPatch, interior_point_from: int) -> None:
    monkeypatch.setattr(relaxation_module, "_INTERIOR_POINT_FROM", interior_point_from)
    formulation, objective, optimum = with_gap(2)
    found = root_bound(formulation, objective, at_work(formulation, HullCuts()))
    assert found.lp == pytest.approx(lp_with_cuts(formulation, objective, []), abs=1e-7)
    assert found.lp_after_cuts == pytest.approx(optimum, abs=1e-7)
    part = formulation.restricted_to(np.array([0, 5]))
    assert root_bound(part, make_objective("cardinality", part)).status == "infeasible"


def test_cuts_can_be_added_and_dropped_in_any_order() -> None:
    formulation, objective, _ = with_gap(2)
    cuts: list[IntegerCut] = []
    relaxation = Relaxation(formulation, objective)
    rng = np.random.default_rng(8)
    for _ in range(12):
        columns = sorted(rng.choice(formulation.size[0], size=4, replace=False).tolist())
        new = [cut_of(columns, [1, 2, 1, 1], 3), cut_of(columns[:2], [1, 1], 1)]
        relaxation.add(new)
        cuts += new
        if len(cuts) > 5:
            gone = sorted(rng.choice(len(cuts), size=3, replace=False).tolist(), reverse=True)
            assert relaxation.drop(gone) == [cuts[i] for i in sorted(gone)]
            cuts = [cut for i, cut in enumerate(cuts) if i not in gone]
        assert relaxation.cuts == cuts
        point = relaxation.solve()
        assert point is not None
        assert point.value == pytest.approx(lp_with_cuts(formulation, objective, cuts), abs=1e-7)
        assert point.slack == pytest.approx([-cut.violation(point.x) for cut in cuts], abs=1e-7)
        bound = relaxation.safe_bound(point.duals).value
        assert float(bound) == pytest.approx(objective.sign * point.value, abs=1e-5)
        assert bound <= objective.sign * Fraction(point.value) + Fraction(1, 10**6)


MALFORMED = [
    (lambda point: [Cut([0, 10**6], 1)], "distinct columns from 0 to"),
    (lambda point: [Cut([0, -1], 1)], "distinct columns from 0 to"),
    (lambda point: [Cut([1, 1], 1)], "distinct columns from 0 to"),
    (lambda point: [Cut([], 1)], "non-empty list of columns"),
    (lambda point: [Cut([0.0, 1.0], 1)], "non-empty list of columns"),
    (lambda point: [Cut([[0, 1]], 1)], "non-empty list of columns"),
    (lambda point: [Cut([0, 1], 0.5)], "exact .* not float 0.5"),
    (lambda point: [Cut([0, 1], 1, [1, 0.5])], "exact .* not float 0.5"),
    (lambda point: [Cut([0, 1], 1, [1, True])], "exact .* not bool"),
    (lambda point: [Cut([0, 1], 1, [1])], "2 simplices but 1 coefficients"),
    (lambda point: [Cut([0, 1], -1, [0, 0])], "coefficients are all zero"),
    (lambda point: [([0, 1], 1)], "must yield Cut objects, not tuple"),
    (lambda point: None, "separate.. returned None; yield Cuts"),
]


@pytest.mark.parametrize(("script", "message"), MALFORMED)
def test_malformed_cuts_are_refused_with_the_name_of_the_separator(script: Any, message: str) -> None:
    formulation, objective, _ = with_gap(0)
    with pytest.raises(SeparatorError, match=f"separator 'mine': .*{message}") as caught:
        root_bound(formulation, objective, at_work(formulation, Scripted(script, "mine")))
    assert caught.value.separator == "mine"


@pytest.mark.parametrize("seed", [0, 2, 5])
@pytest.mark.parametrize("with_target", [False, True])
def test_what_is_known_at_a_relaxation_is_about_it_alone(seed: int, with_target: bool) -> None:
    formulation, objective, optimum = with_gap(seed)
    limits = RootLimits(target=Fraction(optimum) if with_target else None)
    known: list[RootBound] = []
    separation = at_work(formulation, HullCuts())
    found = root_bound(formulation, objective, separation, limits=limits, on_relaxed=known.append)
    assert len(known) == len(found.rounds) > 2
    for number, then in enumerate(known):
        assert then.status == "interrupted"
        *before, last = then.rounds
        assert before == found.rounds[:number]
        assert (last.lp, last.cuts) == (found.rounds[number].lp, {})
        assert 0 < last.seconds <= found.rounds[number].seconds
        assert then.point is not None
        assert len(then.point) == len(then.columns)
        part, costs = formulation.restricted_to(then.columns), objective.restricted_to(then.columns)
        assert then.lp_after_cuts == pytest.approx(lp_with_cuts(part, costs, then.cuts), abs=1e-7)
        assert not then.stages
    assert (len(found.columns) < len(formulation.simplices)) == with_target
    assert np.array_equal(known[0].columns, np.arange(len(formulation.simplices)))
    assert (known[0].lp, known[0].cuts) == (found.lp, [])
    assert [cut.key for cut in known[-1].cuts] == [cut.key for cut in found.cuts]


@pytest.mark.parametrize("calls", [1, 3])
def test_an_interrupted_separator_leaves_what_is_known(calls: int) -> None:
    formulation, objective, _ = with_gap(2)
    cuts = HullCuts()
    cuts.setup(at_work(formulation, Watching()).problem)
    known: list[RootBound] = []

    def press(point: Any) -> list[Cut]:
        if len(known) == calls:
            raise KeyboardInterrupt
        return list(cuts.separate(point))

    with pytest.raises(KeyboardInterrupt):
        root_bound(formulation, objective, at_work(formulation, Scripted(press)), on_relaxed=known.append)
    assert len(known) == calls
    assert known[-1].status == "interrupted"
    assert known[-1].lp_after_cuts == pytest.approx(
        lp_with_cuts(formulation, objective, known[-1].cuts), abs=1e-7
    )


def test_an_interrupt_stops_a_relaxation_in_the_middle() -> None:
    formulation = cocircuit_formulation(load_instance("random:30,3,seed=0"), spanning=True)
    relaxation = Relaxation(formulation, make_objective("cardinality", formulation))

    def press(*_: object) -> None:
        raise KeyboardInterrupt

    previous = signal.signal(signal.SIGALRM, press)
    signal.setitimer(signal.ITIMER_REAL, 0.3)
    try:
        with pytest.raises(KeyboardInterrupt):
            relaxation.solve()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
    assert relaxation._solver.getModelStatus() == highspy.HighsModelStatus.kInterrupt

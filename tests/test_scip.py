"""The SCIP host, and each of the traps around it: callbacks that raise, rows, rounds, limits, interrupts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import BARE, HullCuts, Scripted, Watching, at_work, costs_of, incidence, with_depth, with_gap
from pyscipopt import SCIP_RESULT, Sepa

from bcut.bounds.root import root_bound
from bcut.errors import SeparatorError, SolverError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.formulation import Formulation
from bcut.instance import load_instance
from bcut.objectives.objective import Objective, make_objective
from bcut.scip import host
from bcut.scip.host import TreeOptions, branch_and_cut
from bcut.scip.plugins import LpValues, SeparatorAdapter
from bcut.separation.resolve import resolve
from bcut.separation.seam import Cut, FractionalPoint

FAMILIES = ["clique", "odd-cycle", "link"]


@pytest.fixture
def branching(monkeypatch: pytest.MonkeyPatch) -> tuple[Formulation, Objective]:
    return with_depth(monkeypatch)


class Spy:
    """A SCIP model that reports the rows that are added to it."""

    def __init__(self, model: Any, rows: list[dict[str, Any]]) -> None:
        self._model, self._rows = model, rows

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)

    def addCut(self, row: Any, **options: Any) -> Any:  # noqa: N802 - SCIP's name
        infeasible = self._model.addCut(row, **options)
        self._rows.append(
            {
                "local": row.isLocal(),
                "removable": row.isRemovable(),
                "lhs": row.getLhs(),
                "rhs": row.getRhs() - row.getConstant(),
                "depth": self._model.getDepth(),
                "infeasible": bool(infeasible),
            }
        )
        return infeasible


@pytest.fixture
def rows(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Every row that an adapter adds from here on."""
    found: list[dict[str, Any]] = []
    model = Sepa.model
    spied = property(lambda self: Spy(model.__get__(self), found))
    monkeypatch.setattr(SeparatorAdapter, "model", spied, raising=False)
    return found


@pytest.fixture
def outcomes(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, Any]]:
    """Depth and outcome of every call of an adapter."""
    found: list[tuple[int, Any]] = []
    execute = SeparatorAdapter._execute

    def recording(self: SeparatorAdapter) -> Any:
        outcome = execute(self)
        found.append((self.model.getDepth(), outcome))
        return outcome

    monkeypatch.setattr(SeparatorAdapter, "_execute", recording)
    return found


# Right answers.


@pytest.mark.parametrize(
    ("instance", "spanning", "sense", "value"),
    [
        ("cube:3", False, "min", 5),
        ("cube:3", False, "max", 6),
        ("grid:3,3", True, "min", 8),
        ("moae", False, "max", 7),
    ],
)
def test_small_optima_with_all_of_scip(instance: str, spanning: bool, sense: str, value: int) -> None:
    formulation = cocircuit_formulation(load_instance(instance), spanning=spanning)
    result = branch_and_cut(formulation, make_objective("cardinality", formulation, sense=sense))
    assert result.status == "optimal"
    assert result.columns is not None
    assert len(result.columns) == value
    assert result.bound == pytest.approx(value)


@settings(max_examples=25, deadline=None)
@given(
    st.sampled_from(["random:8,2,seed=3", "polygon:7,center", "grid:3,3", "cube:3", "random:8,3,seed=1"]),
    st.booleans(),
    st.sampled_from(["min", "max"]),
    st.integers(0, 10**6),
    st.booleans(),
    st.lists(st.sampled_from([*FAMILIES, "hull"]), unique=True),
)
def test_separators_do_not_change_the_optimum(
    instance: str, spanning: bool, sense: str, seed: int, bare: bool, names: list[str]
) -> None:
    formulation = cocircuit_formulation(load_instance(instance), spanning=spanning)
    costs = np.random.default_rng(seed).integers(-3, 4, size=formulation.size[0])
    values = incidence(formulation) @ costs
    separators = [HullCuts() if name == "hull" else resolve(name) for name in names]
    result = branch_and_cut(
        formulation,
        costs_of(formulation, costs, sense),
        at_work(formulation, *separators),
        options=TreeOptions(**BARE) if bare else TreeOptions(),
    )
    assert result.status == "optimal"
    assert result.columns is not None
    assert costs[result.columns].sum() == (values.min() if sense == "min" else values.max())


@pytest.mark.parametrize("names", [[], FAMILIES, ["hull"]])
@pytest.mark.parametrize("number", range(6))
@pytest.mark.parametrize("sense", ["min", "max"])
def test_separators_do_not_change_the_optimum_where_they_have_work(
    sense: str, number: int, names: list[str]
) -> None:
    formulation, objective, optimum = with_gap(number, sense)
    separators = [HullCuts() if name == "hull" else resolve(name) for name in names]
    for options in (TreeOptions(**BARE), TreeOptions()):
        result = branch_and_cut(formulation, objective, at_work(formulation, *separators), options=options)
        assert result.status == "optimal"
        assert result.columns is not None
        assert objective.value(result.columns) == optimum


def test_known_cuts_start_in_the_relaxation() -> None:
    formulation, objective, optimum = with_gap(5)
    root = root_bound(formulation, objective, at_work(formulation, HullCuts()))
    result = branch_and_cut(formulation, objective, options=TreeOptions(**BARE), cuts=root.cuts)
    assert result.status == "optimal"
    assert result.rounds[0].lp == pytest.approx(optimum, abs=1e-6)


# A callback that raises.


def raise_in_a_helper(point: FractionalPoint) -> Iterator[Cut]:
    raise LookupError("nothing there")
    yield


def test_a_separator_that_raises_in_scip_is_named_with_its_own_traceback() -> None:
    formulation, objective, _ = with_gap(0)
    separation = at_work(formulation, Watching(), Scripted(raise_in_a_helper, "mine"))
    with pytest.raises(
        SeparatorError, match=r"separator 'mine': separate\(\) raised LookupError: nothing there"
    ) as caught:
        branch_and_cut(formulation, objective, separation, options=TreeOptions(**BARE))
    assert "raise_in_a_helper" in caught.value.trace
    assert separation.statistics["mine"].calls == 1


def test_a_malformed_cut_in_scip_is_named() -> None:
    formulation, objective, _ = with_gap(0)
    with pytest.raises(SeparatorError, match=r"'mine': .*distinct columns"):
        branch_and_cut(
            formulation, objective, at_work(formulation, Scripted(lambda point: [Cut([-1], 0)], "mine"))
        )


@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError])
def test_whatever_is_raised_while_rows_are_added_comes_out(
    monkeypatch: pytest.MonkeyPatch, error: Any
) -> None:
    def add(self: Any, cut: Any) -> bool:
        raise error

    monkeypatch.setattr(SeparatorAdapter, "_add", add)
    formulation, objective, _ = with_gap(0)
    with pytest.raises(error):
        branch_and_cut(formulation, objective, at_work(formulation, HullCuts()), options=TreeOptions(**BARE))


def test_a_progress_function_that_raises_is_heard() -> None:
    def fail(facts: dict[str, Any]) -> None:
        raise ConnectionError("nobody listens")

    formulation, objective, _ = with_gap(0)
    with pytest.raises(ConnectionError, match="nobody listens"):
        branch_and_cut(formulation, objective, on_progress=fail)


def test_a_failure_of_scip_itself_is_a_solver_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(host, "_optimize", lambda model: Exception("SCIP: unspecified error!"))
    formulation, objective, _ = with_gap(0)
    with pytest.raises(SolverError, match="SCIP failed on random:10,2,seed=2: SCIP: unspecified error"):
        branch_and_cut(formulation, objective)


# Rows and rounds.


def test_separators_are_called_at_every_depth(
    branching: tuple[Formulation, Objective], outcomes: list[tuple[int, Any]]
) -> None:
    formulation, objective = branching
    watching = Watching()
    result = branch_and_cut(
        formulation, objective, at_work(formulation, watching), options=TreeOptions(**BARE)
    )
    depths = {depth for depth, _ in outcomes}
    assert result.nodes > 4
    # SCIP's default back-off would leave out depths 2 and 3.
    assert {0, 1, 2, 3, 4} <= depths
    assert len(watching.points) > 4


@pytest.mark.parametrize(("every", "expected"), [(0, {0}), (2, {0, 2, 4, 6})])
def test_depths_between_calls(
    branching: tuple[Formulation, Objective], outcomes: list[tuple[int, Any]], every: int, expected: set[int]
) -> None:
    formulation, objective = branching
    options = TreeOptions(separate_every=every, **BARE)
    branch_and_cut(formulation, objective, at_work(formulation, Watching()), options=options)
    assert {depth for depth, _ in outcomes} == expected


def test_rows_are_global_and_have_no_left_hand_side(
    branching: tuple[Formulation, Objective], rows: list[dict[str, Any]]
) -> None:
    formulation, objective = branching

    def script(point: FractionalPoint) -> Iterator[Cut]:
        # Invalid, but violated everywhere; what matters here is how it is added.
        columns = point.fractional
        yield Cut(columns, int(np.floor(point.x[columns].sum() - 0.01)))

    options = TreeOptions(root_rounds=2, tree_rounds=1, **BARE)
    branch_and_cut(formulation, objective, at_work(formulation, Scripted(script)), options=options)
    assert any(row["depth"] > 0 for row in rows)
    assert len(rows) > 1
    assert not any(row["local"] for row in rows)
    assert all(row["lhs"] == -1e20 for row in rows)
    assert all(row["removable"] for row in rows)


def test_a_cut_with_negative_coefficients_keeps_points_with_a_negative_left_hand_side() -> None:
    # -x_t <= -1 for every simplex of one triangulation: a left-hand side of 0 would make it infeasible.
    formulation, objective, _ = with_gap(0)
    chosen = np.flatnonzero(incidence(formulation)[0])

    def script(point: FractionalPoint) -> Iterator[Cut]:
        for column in chosen.tolist():
            yield Cut([column], -1, [-1])

    result = branch_and_cut(
        formulation, objective, at_work(formulation, Scripted(script)), options=TreeOptions(**BARE)
    )
    assert result.status == "optimal"
    assert result.columns is not None
    assert result.columns.tolist() == chosen.tolist()


@pytest.mark.parametrize("sense", ["min", "max"])
def test_the_root_relaxation_is_recorded_every_round_unrounded(sense: str) -> None:
    formulation, objective, optimum = with_gap(5, sense)
    separation = at_work(formulation, HullCuts())
    result = branch_and_cut(formulation, objective, separation, options=TreeOptions(**BARE))
    values = [finished.lp for finished in result.rounds]
    assert values[0] == pytest.approx(objective.sign * 7.5, abs=1e-6)
    assert values[-1] == pytest.approx(optimum, abs=1e-6)
    # Some value in between is no integer: SCIP's own bound would be rounded.
    assert any(abs(value - round(value)) > 1e-3 for value in values[1:-1])
    signed = [objective.sign * value for value in values]
    assert signed == pytest.approx(sorted(signed), abs=1e-6)
    added = sum(finished.cuts.get("hull", 0) for finished in result.rounds)
    assert added == separation.statistics["hull"].added == len(values) - 1


def test_the_root_relaxation_is_recorded_without_separators() -> None:
    formulation = cocircuit_formulation(load_instance("random:16,3,seed=1000"), spanning=True)
    objective = make_objective("cardinality", formulation)
    result = branch_and_cut(formulation, objective)
    assert result.rounds[0].lp == pytest.approx(24.5, abs=1e-6)
    assert result.bound == pytest.approx(25)


def test_an_integral_root_relaxation_is_recorded_too() -> None:
    # SCIP separates nothing then, and is done after the first relaxation.
    formulation = cocircuit_formulation(load_instance("cube:3"))
    costs = np.random.default_rng(0).integers(0, 9, size=formulation.size[0])
    result = branch_and_cut(formulation, costs_of(formulation, costs), options=TreeOptions(**BARE))
    assert [finished.lp for finished in result.rounds] == pytest.approx(
        [(incidence(formulation) @ costs).min()]
    )


def test_rounds_per_node_are_limited() -> None:
    formulation, objective, _ = with_gap(2)
    separation = at_work(formulation, HullCuts())
    options = TreeOptions(root_rounds=3, tree_rounds=0, **BARE)
    result = branch_and_cut(formulation, objective, separation, options=options)
    assert result.status == "optimal"
    assert separation.statistics["hull"].calls == 3
    assert separation.statistics["hull"].added == 3


def test_outcomes_tell_scip_what_happened(outcomes: list[tuple[int, Any]]) -> None:
    formulation, objective, _ = with_gap(0)
    branch_and_cut(formulation, objective, at_work(formulation, Watching()), options=TreeOptions(**BARE))
    assert {outcome for _, outcome in outcomes} == {SCIP_RESULT.DIDNOTFIND}
    outcomes.clear()
    branch_and_cut(formulation, objective, at_work(formulation, HullCuts()), options=TreeOptions(**BARE))
    assert outcomes[0][1] == SCIP_RESULT.SEPARATED
    outcomes.clear()
    branch_and_cut(formulation, objective, options=TreeOptions(**BARE))
    assert {outcome for _, outcome in outcomes} == {SCIP_RESULT.DIDNOTRUN}


def test_a_cut_that_nothing_satisfies_cuts_the_node_off(
    rows: list[dict[str, Any]], outcomes: list[tuple[int, Any]]
) -> None:
    formulation, objective, _ = with_gap(0)
    nothing = Scripted(lambda point: [Cut(point.support, -1)])
    result = branch_and_cut(
        formulation, objective, at_work(formulation, nothing), options=TreeOptions(**BARE)
    )
    assert result.status == "infeasible"
    assert result.columns is None
    assert rows[0]["infeasible"]
    assert outcomes == [(0, SCIP_RESULT.CUTOFF)]


def test_variables_are_looked_up_again_after_a_restart(monkeypatch: pytest.MonkeyPatch) -> None:
    formulation, objective, optimum = with_gap(2)
    refreshed: list[int] = []
    calls: list[int] = []
    refresh, execute = LpValues.refresh, SeparatorAdapter._execute

    def counting(self: LpValues, model: Any) -> None:
        refresh(self, model)
        refreshed.append(len(self.transformed))

    def restarting(self: SeparatorAdapter) -> Any:
        calls.append(len(refreshed))
        if len(calls) == 3:
            self.model.restartSolve()
        return execute(self)

    monkeypatch.setattr(LpValues, "refresh", counting)
    monkeypatch.setattr(SeparatorAdapter, "_execute", restarting)
    # Few rounds at the root, so that there is something left after it.
    options = TreeOptions(heuristics=False, scip_separators=False, root_rounds=4)
    result = branch_and_cut(formulation, objective, at_work(formulation, HullCuts()), options=options)
    assert len(refreshed) >= 2
    assert set(refreshed) == {formulation.size[0]}
    assert max(calls) >= 2  # separation went on after the restart
    assert result.status == "optimal"
    assert result.columns is not None
    assert objective.value(result.columns) == optimum


def test_separators_see_values_of_the_original_variables_after_presolve() -> None:
    formulation, objective, _ = with_gap(2)
    watching = Watching()
    options = TreeOptions(heuristics=False, scip_separators=False)
    result = branch_and_cut(formulation, objective, at_work(formulation, watching), options=options)
    assert result.status == "optimal"
    for point in watching.points:
        activity = formulation.matrix.astype(float) @ point
        np.testing.assert_allclose(activity, formulation.lower, atol=1e-6)
        assert ((point >= -1e-9) & (point <= 1 + 1e-9)).all()

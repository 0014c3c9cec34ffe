"""The way without symmetry: bound first, fix nearly all simplices, solve the rest."""

from __future__ import annotations

import ctypes
import json
import os
import signal
import sys
import time
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from processes import BCUT, PATIENCE, finished

import bcut
from bcut.bounds.compact_bound import compact_bound, most_simplices
from bcut.bounds.safe import safe_bound
from bcut.errors import InputError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.compact import compact_program
from bcut.geometry.barycentric import barycentric_signs
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.delaunay import first_triangulation, is_triangulation
from bcut.geometry.flips import improve_by_flips
from bcut.geometry.placing import placing_triangulation
from bcut.geometry.triangulations import count_by_size
from bcut.instance import load_instance
from bcut.objectives.objective import make_objective
from bcut.objectives.syntax import read_objective
from bcut.solving.api import solve
from bcut.solving.compact_part import Budget, begin_fixing
from bcut.solving.memory import Watch, peak_memory, used_memory, watched
from bcut.solving.methods import expected_columns
from bcut.solving.search import Search

CASES = [
    ("random:12,2,seed=1", "weight", True, "min"),
    ("random:14,2,seed=2", "random-costs:5", False, "min"),
    ("random:9,3,seed=3", "weight", False, "max"),
    ("random:14,3,seed=4", "cardinality", True, "min"),
    ("random:14,3,seed=4", "cardinality", False, "max"),
    ("random:10,3,seed=5", "aspect-ratio", False, "min"),
    ("random:10,3,seed=6", "random-costs:1", True, "max"),
    ("random:8,4,seed=7", "cardinality", False, "min"),
    ("random:8,4,seed=8", "weight", True, "min"),
    ("grid:3,3,2", "cardinality", False, "min"),
    ("grid:3,3,2", "weight", True, "min"),
    ("grid:4,4", "weight", False, "max"),
    ("dodecahedron", "cardinality", False, "min"),
    ("cube:4", "cardinality", False, "min"),
    ("polygon:5,center", "cardinality", True, "min"),
]


def points(values: list[list[float]]) -> bcut.PointConfiguration:
    return bcut.PointConfiguration.from_values(values, name="points", origin="test")


@pytest.mark.parametrize(("instance", "objective", "spanning", "sense"), CASES)
def test_the_optimum_is_that_of_the_listing(
    instance: str, objective: str, spanning: bool, sense: str
) -> None:
    asked = {"objective": objective, "spanning": spanning, "sense": sense}
    expected = solve(instance, method="listing", **asked)
    found = solve(instance, method="fixing", **asked)
    assert found.status == expected.status == "optimal"
    assert found.problem.method == "fixing"
    assert found.value == pytest.approx(expected.value, rel=1e-9)
    assert found.size.columns == expected.size.columns
    assert found.size.rows == expected.size.rows
    better = found.root.lp - found.value
    assert (better if sense == "min" else -better) <= 1e-6 * abs(found.value)


SMALLEST: list[list[list[float]]] = [
    [[0, 0], [1, 0], [0, 1]],
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    [[0, 0], [1e-300, 0], [0, 1e-300], [1e-300, 1e-300]],
    [[0, 0], [10**30, 0], [0, 10**30], [10**30, 10**30 + 1], [5, 7]],
]


@pytest.mark.parametrize("values", SMALLEST)
@pytest.mark.parametrize("objective", ["cardinality", "weight"])
def test_programs_without_rows_and_extreme_coordinates(values: list[list[float]], objective: str) -> None:
    expected = solve(points(values), objective=objective, method="listing")
    found = solve(points(values), objective=objective, method="fixing")
    assert (found.status, found.value) == ("optimal", expected.value)


def test_costs_of_very_different_sizes() -> None:
    """Slivers cost 10^12 times as much as others, and are dropped before anything is bounded."""
    expected = solve("sphere:12,3,seed=2", objective="aspect-ratio", spanning=True, method="listing")
    found = solve("sphere:12,3,seed=2", objective="aspect-ratio", spanning=True, method="fixing")
    assert found.optimal
    assert found.value == pytest.approx(expected.value, rel=1e-9)
    assert found.size.columns == expected.size.columns


@pytest.mark.parametrize(
    "instance", ["random:10,3,seed=1", "grid:3,3,2", "random:9,2,seed=1", "random:7,4,seed=3"]
)
@pytest.mark.parametrize("spanning", [False, True])
def test_any_multipliers_prove_a_bound_that_all_triangulations_keep(instance: str, spanning: bool) -> None:
    configuration = load_instance(instance)
    program = compact_program(configuration, spanning=spanning)
    formulation = cocircuit_formulation(configuration, spanning=spanning)
    generator = np.random.default_rng(1)
    for name, sense in (("weight", "min"), ("weight", "max"), ("cardinality", "min"), ("cardinality", "max")):
        objective = make_objective(name, formulation, sense=sense)
        best = solve(instance, objective=name, sense=sense, spanning=spanning, method="listing")
        optimum = objective.value(formulation.columns_of(np.array(best.triangulation))) * objective.sign
        for scale in (0.0, 1e-3, 0.1, 1.0, 1e6):
            duals = scale * generator.normal(size=program.size[1])
            found = compact_bound(program, objective, duals)
            assert found.bound.value <= optimum
            if found.plain:
                again = safe_bound(
                    formulation.matrix,
                    formulation.lower,
                    formulation.upper,
                    objective,
                    np.ldexp(found.bound.multipliers.astype(float), -found.bound.shift),
                )
                assert abs(again.value - found.bound.value) <= Fraction(1, 10**6) * max(1, abs(optimum))
            # A solution is worth at least the bound and the reduced costs of what it uses.
            for column in formulation.columns_of(np.array(best.triangulation)):
                assert (
                    found.bound.value + int(found.bound.reduced_costs[column]) * found.bound.unit <= optimum
                )


@pytest.mark.parametrize(
    "instance", ["random:7,2,seed=1", "random:7,3,seed=2", "grid:3,2", "random:7,4,seed=1"]
)
def test_no_triangulation_has_more_simplices_than_the_upper_bound(instance: str) -> None:
    configuration = load_instance(instance)
    assert max(count_by_size(Chirotope.of(configuration))) <= most_simplices(
        configuration.n, configuration.dimension
    )


def test_the_upper_bound_on_the_number_of_simplices_is_that_of_cyclic_polytopes() -> None:
    # With 2n - 2 - h triangles, h >= 3; and in space C_4(n + 1) has (n + 1)(n - 2) / 2 facets.
    assert most_simplices(10, 2) == 18
    assert most_simplices(10, 3) == 44
    assert most_simplices(5, 1) == 6


@pytest.mark.parametrize(
    "instance",
    [
        "random:12,2,seed=1",
        "random:12,3,seed=1",
        "random:9,4,seed=1",
        "grid:3,3,3",
        "grid:4,4",
        "cube:4",
        "dodecahedron",
    ],
)
@pytest.mark.parametrize("spanning", [False, True])
def test_flips_lead_to_a_triangulation_that_is_no_worse(instance: str, spanning: bool) -> None:
    configuration = load_instance(instance)
    chirotope = Chirotope.of(configuration)
    formulation = cocircuit_formulation(configuration, spanning=spanning)
    for name, sense in (("weight", "min"), ("cardinality", "max"), ("cardinality", "min")):
        objective = make_objective(name, formulation, sense=sense)

        def costs_of(simplices: np.ndarray, objective=objective) -> np.ndarray:
            columns = formulation.columns_of(simplices)
            return np.where(columns >= 0, objective.sign * objective.costs[columns], np.inf)

        start = first_triangulation(configuration, chirotope)
        found = improve_by_flips(start, chirotope, costs_of, spanning=spanning)
        assert is_triangulation(found, chirotope)
        assert costs_of(found).sum() <= costs_of(start).sum() + 1e-9
        assert not spanning or len(np.unique(found)) == configuration.n


def test_flips_take_out_and_put_in_points() -> None:
    """The centre of a square saves or costs two triangles; without it there are the two diagonals."""
    configuration = points([[0, 0], [4, 0], [4, 4], [0, 4], [1, 2]])
    chirotope = Chirotope.of(configuration)
    start = placing_triangulation(configuration, chirotope)
    assert len(np.unique(start)) == 5
    few = improve_by_flips(start, chirotope, lambda simplices: np.ones(len(simplices)), spanning=False)
    assert len(few) == 2
    many = improve_by_flips(few, chirotope, lambda simplices: -np.ones(len(simplices)), spanning=False)
    assert len(many) == 4
    kept = improve_by_flips(start, chirotope, lambda simplices: np.ones(len(simplices)), spanning=True)
    assert len(kept) == 4


def test_what_is_no_triangulation_is_told() -> None:
    chirotope = Chirotope.of(load_instance("grid:3,3"))
    whole = placing_triangulation(load_instance("grid:3,3"), chirotope)
    assert is_triangulation(whole, chirotope)
    assert not is_triangulation(whole[1:], chirotope)
    assert not is_triangulation(np.array([[0, 1, 2]]), chirotope)
    # Two triangulations of the same square at once: each facet of the boundary has two simplices on the same side.
    square = Chirotope.of(load_instance("polygon:4"))
    assert not is_triangulation(np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]), square)


def test_signs_of_barycentric_coordinates() -> None:
    chirotope = Chirotope.of(points([[0, 0], [3, 0], [0, 3], [1, 1], [2, 2], [1, 0]]))
    simplices = np.array([[0, 1, 2]])
    assert [barycentric_signs(chirotope, simplices, point)[0].tolist() for point in range(6)] == [
        [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [-1, 1, 1], [1, 1, 0],
    ]  # fmt: skip


def test_large_ones_are_solved_this_way_and_verify(tmp_path: Path) -> None:
    result = solve("random:30,3,seed=1", objective="weight", spanning=True)
    assert result.problem.method == "fixing"
    assert result.optimal
    assert result.value == pytest.approx(10.403879805870424, rel=1e-12)
    assert result.size.columns == 21876
    assert result.size.columns_after_fixing < 3000
    file = tmp_path / "result.json"
    result.save(file)
    verified = bcut.verify(file)
    assert verified.exact_bound is not None
    assert float(verified.exact_bound) == pytest.approx(result.value, rel=2e-9)


def test_a_triangulation_far_from_the_bound_asks_for_a_few_more_columns_first() -> None:
    # The relaxation is fractional, and no column of the first small program leads to a better triangulation than flips.
    found = bcut.solve("random:40,3,seed=9", objective="weight", spanning=True, time_limit=100)
    assert found.status == "optimal"
    assert found.size.columns_after_fixing is not None
    assert found.size.columns_after_fixing < found.size.columns // 4


@pytest.mark.parametrize(
    ("objective", "sense"), [("cardinality", "min"), ("weight", "min"), ("weight", "max")]
)
def test_certificates_hold(objective: str, sense: str) -> None:
    result = solve("random:12,3,seed=2", objective=objective, sense=sense, spanning=True, method="fixing")
    assert result.optimal
    if result.certificate.bound is None:
        assert result.certificate.reason
        return
    verified = bcut.verify(result)
    assert verified.exact_bound is not None
    better = verified.exact_bound - Fraction(result.value)
    assert (better if sense == "min" else -better) <= Fraction(1, 10**9)


def test_small_ones_are_listed_and_symmetric_ones_counted_in_orbits() -> None:
    for instance, method in (("cube:3", "listing"), ("random:12,3", "listing"), ("cube:5", "orbits")):
        result = bcut.bound(instance, time_limit=20)
        assert result.problem.method == method
    assert expected_columns(load_instance("random:30,3"), spanning=True) > 15_000
    assert expected_columns(load_instance("random:12,3"), spanning=False) == 495


@pytest.mark.parametrize(
    "question",
    [
        {"objective": "min-max:weight"},
        {"then": ["weight"]},
        {"formulation": "chambers"},
        {"forbid": [[0, 1]]},
        {"dissection": True},
    ],
)
def test_questions_of_other_kinds_are_refused(question: dict[str, object]) -> None:
    with pytest.raises(InputError, match="method 'fixing'"):
        solve("random:8,2", method="fixing", **question)


def test_the_root_bound_is_proven_and_near_that_of_the_listing() -> None:
    expected = bcut.bound("random:16,3,seed=1000", spanning=True, method="listing")
    found = bcut.bound("random:16,3,seed=1000", spanning=True, method="fixing")
    assert found.status == "bound"
    assert found.bound <= 25
    assert found.root.lp == pytest.approx(expected.root.lp, rel=1e-3)
    assert found.triangulation is None


@pytest.mark.parametrize("seconds", [0.0, 0.3, 0.8, 1.5, 2.5])
def test_a_time_limit_leaves_a_triangulation(seconds: float) -> None:
    result = solve("random:50,3,seed=3", spanning=True, time_limit=seconds)
    assert result.status == "limit"
    assert result.triangulation is not None
    assert result.bound is None or result.bound <= result.value


def test_a_memory_limit_leaves_a_triangulation(tmp_path: Path) -> None:
    output = tmp_path / "result.json"
    command = [*BCUT, "solve", "random:70,3,seed=1", "--objective", "weight", "--spanning"]
    limit = (used_memory() + (1 << 24)) / 2**30
    command += ["--memory-limit", f"{min(limit, 0.2)}", "--output", str(output), "--quiet"]
    ended = finished(command)
    assert ended.status == 3, ended.err
    result = json.loads(output.read_text(encoding="utf-8"))
    assert result["status"] == "limit"
    assert result["triangulation"]
    assert result["problem"]["limits"]["memory"] is not None


def test_bad_memory_limits_are_refused() -> None:
    for limit in (0, -1.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match="memory limit"):
            solve("cube:2", memory_limit=limit)


def test_memory_is_measured() -> None:
    before = used_memory()
    block = np.ones(1 << 24)
    assert used_memory() - before > block.nbytes // 2
    assert peak_memory() >= used_memory() // 2


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT for one process")
def test_an_interrupt_that_arrives_in_a_callback_is_sent_again() -> None:
    def interrupted() -> None:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(1)  # the interrupt is raised here, where ctypes can only report it

    callback = ctypes.CFUNCTYPE(None)(interrupted)

    def work() -> None:
        callback()
        time.sleep(PATIENCE)
        raise AssertionError("nothing was sent again")

    with pytest.raises(KeyboardInterrupt), watched(Watch(), memory=None, deadline=None):
        work()


def test_a_watched_block_is_interrupted_in_time_and_only_then() -> None:
    watch = Watch()
    with pytest.raises(KeyboardInterrupt), watched(watch, memory=None, deadline=time.monotonic() - 2):
        time.sleep(PATIENCE)
    assert watch.reached == "time"
    quiet = Watch()
    with watched(quiet, memory=1e6, deadline=time.monotonic() + 1e6):
        time.sleep(0.15)
    assert quiet.reached == ""


def test_progress_tells_stage_columns_bound_incumbent_and_memory() -> None:
    told: list[dict[str, object]] = []
    solve("random:14,3,seed=1", objective="weight", spanning=True, method="fixing", on_progress=told.append)
    stages = [facts["stage"] for facts in told]
    for stage in ("listing", "incumbent", "multipliers", "root"):
        assert stage in stages
    last = told[-1]
    assert last["value"] is not None
    assert last["bound"] is not None
    assert last["columns"]
    assert last["memory"]
    bounds = [facts["bound"] for facts in told if facts["bound"] is not None]
    assert bounds == sorted(bounds)


def test_local_search_gets_as_much_on_a_busy_machine() -> None:
    search = Search(
        whole=begin_fixing(load_instance("cube:3"), read_objective("cardinality", None), spanning=False),
        make_separators=list,
    )
    budget = Budget(search, 0.2)
    time.sleep(0.3)
    assert not budget.is_over()
    while not budget.is_over():
        pass
    assert budget.left <= 0
    # The deadline of the search holds in any case.
    search.deadline = time.monotonic() - 1
    assert Budget(search, 100).is_over()

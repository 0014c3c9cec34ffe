"""Face-crossing cuts: which faces cross, what faces are worth, and what is found."""

from __future__ import annotations

from itertools import combinations, islice, pairwise
from pathlib import Path

import numpy as np
import pytest
from crossing_faces import all_of, anything, candidates_of, certified, cuts_at, halves, problem_of, vertex
from laboratory import ledger_file

import bcut
from bcut.errors import InputError, SeparatorLoadError
from bcut.experiments.ledger import read_ledger
from bcut.experiments.replay import check_ledger, replay
from bcut.geometry import face_crossings
from bcut.geometry.circuits import circuits
from bcut.geometry.face_crossings import FaceGraph, small_circuits
from bcut.geometry.face_values import FaceValues
from bcut.geometry.generic_point import simplices_containing_generic_point
from bcut.separation.graphs.stable_triples import sets_without_stable_triples
from bcut.separation.resolve import resolve
from bcut.separation.seam import Problem
from bcut.verification.face_cuts import check_face_crossing

GENERAL = ["random:7,2,seed=1", "random:8,3,seed=1", "random:7,4,seed=1"]
DEGENERATE = ["grid:3,3", "cube:3", "prism:5", "polygon:6,center", "cross-polytope:4", "grid:3,2,2"]


def graph_of(problem: Problem) -> FaceGraph:
    return FaceGraph(problem.chirotope, problem.simplices)


# --- faces that cross -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", GENERAL + DEGENERATE)
def test_faces_cross_where_a_circuit_has_a_part_in_each(name: str) -> None:
    problem = problem_of(name)
    graph = graph_of(problem)
    faces = [set(graph.vertices(face)) for face in range(len(graph))]
    contains = np.zeros((len(graph), problem.configuration.n), dtype=bool)
    for face, vertices in enumerate(faces):
        contains[face, list(vertices)] = True
    expected = np.zeros((len(graph), len(graph)), dtype=bool)
    for row in circuits(problem.chirotope):
        plus, minus = contains[:, row > 0].all(axis=1), contains[:, row < 0].all(axis=1)
        expected |= np.outer(plus, minus) | np.outer(minus, plus)
    found = graph.crossings(np.arange(len(graph)))
    assert (found == expected).all()
    assert found.any()
    candidates = candidates_of(problem)
    for seed in range(40):
        first, second = np.random.default_rng(seed).integers(len(graph), size=2).tolist()
        basis = next(s for s in problem.simplices.tolist() if faces[first] <= set(s))
        rest = tuple(sorted(set(basis) - faces[first]))
        one, other = graph.vertices(first), graph.vertices(second)
        assert candidates.faces_crossing(one, other, rest) == expected[first, second]


@pytest.mark.parametrize("name", GENERAL + DEGENERATE)
def test_small_circuits_are_those_of_few_points(name: str) -> None:
    chirotope = problem_of(name).chirotope
    expected = set()
    for row in circuits(chirotope):
        plus, minus = tuple(np.flatnonzero(row > 0).tolist()), tuple(np.flatnonzero(row < 0).tolist())
        if len(plus) + len(minus) <= chirotope.dimension + 1:
            expected.add((min(plus, minus), max(plus, minus)))
    found = small_circuits(chirotope)
    assert len(found) == len(set(found))
    assert set(found) == expected
    assert bool(found) == (name in DEGENERATE)


def test_faces_have_numbers() -> None:
    graph = graph_of(problem_of("grid:3,3", spanning=True))
    for face in range(len(graph)):
        assert graph.number(graph.vertices(face)) == face
        subfaces = [graph.vertices(int(number)) for number in graph.subfaces(face)]
        own = graph.vertices(face)
        assert sorted(subfaces) == sorted(
            part for size in range(1, len(own) + 1) for part in combinations(own, size)
        )
    # The middle of this edge is a point that has to be used.
    assert graph.number((0, 2)) is None
    assert graph.number((7, 8)) is not None


def test_rows_are_the_same_when_few_are_remembered(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = problem_of("prism:5")
    faces, others = np.array([3, 200, 3, 17, 354]), np.array([354, 0, 99, 17, 200])
    whole = graph_of(problem).crossings(faces)
    monkeypatch.setattr(face_crossings, "_ROW_CACHE", 1)
    monkeypatch.setattr(face_crossings, "_CHUNK", 2)
    graph = graph_of(problem)
    for _ in range(2):
        assert (graph.crossings(faces) == whole).all()
        assert (graph.crossings(faces, others) == whole[:, others]).all()


# --- what faces are worth ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["random:7,2,seed=1", "random:7,3,seed=1", *DEGENERATE[:4]])
def test_the_value_of_a_face_tells_triangulations_that_have_it(name: str) -> None:
    problem = problem_of(name)
    graph = graph_of(problem)
    values = FaceValues(graph, problem.simplices)
    around = [values.around(face)[0] for face in range(len(graph))]
    for chosen in islice(all_of(problem), 60):
        x = np.zeros(len(problem.simplices))
        x[chosen] = 1
        present = np.zeros(len(graph), dtype=bool)
        for column in chosen:
            present[graph.subfaces(int(column) + graph.starts[-2])] = True
        assert (values.at(np.asarray(chosen), x[chosen]) == present).all()
        assert [x[columns].sum() for columns in around] == present.tolist()


@pytest.mark.parametrize("name", ["random:10,2,seed=2", "random:8,3,seed=1", "cube:3", "prism:5"])
def test_in_formulation_2_values_do_not_depend_on_directions(name: str) -> None:
    problem = problem_of(name)
    graph = graph_of(problem)
    values = FaceValues(graph, problem.simplices)
    for seed in range(4):
        x = vertex(problem, seed)
        mixed = (x + vertex(problem, seed + 100)) / 2
        found = values.at(np.flatnonzero(mixed), mixed[np.flatnonzero(mixed)])
        for face in range(len(graph)):
            columns, flag = values.around(face)
            assert mixed[columns].sum() == pytest.approx(found[face], abs=1e-7)
            inside = simplices_containing_generic_point(problem.chirotope, problem.simplices, np.array(flag))
            own = np.isin(problem.simplices, graph.vertices(face)).sum(axis=1) == graph.sizes[face]
            assert np.flatnonzero(inside & own).tolist() == columns.tolist()


# --- cuts -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "spanning"),
    [
        ("random:10,2,seed=2", True),
        ("random:8,3,seed=1", False),
        ("cube:3", False),
        ("grid:3,2,2", True),
        ("random:7,4,seed=1", False),
    ],
)
def test_every_cut_follows_from_its_proof(name: str, spanning: bool) -> None:
    problem = problem_of(name, spanning=spanning)
    candidates = candidates_of(problem)
    bounds = set()
    for seed in range(2):
        cuts, _ = cuts_at(problem, anything(problem, seed), max_cuts=60, lift=6)
        for cut in cuts:
            given = certified(problem, cut)
            assert check_face_crossing(candidates, given) == given.rhs
            bounds.add(cut.rhs)
    assert len(bounds) > 1


def test_cuts_are_violated_at_an_optimum() -> None:
    problem, cuts, point = halves()
    assert len(cuts) > 4
    assert all(point.value(cut) > cut.rhs + 1e-4 for cut in cuts)
    sizes = {len(face) for cut in cuts for face, _, _ in cut.proof["faces"]}
    assert {2, 3} <= sizes, "edges and triangles take part"
    bare = cuts_at(problem, point.x, lift=0)[0]
    assert all(weight == 1 for cut in bare for _, _, weight in cut.proof["faces"])
    assert sum(len(cut.simplices) for cut in bare) < sum(len(cut.simplices) for cut in cuts)


def test_smaller_faces_make_a_stronger_cut() -> None:
    problem, _, point = halves()
    cuts = cuts_at(problem, point.x, lift=0)[0]
    pairs = 0
    for whole, small in pairwise(cuts):
        before, after = ([set(face) for face, _, _ in cut.proof["faces"]] for cut in (whole, small))
        if len(before) == len(after) and all(a <= b for a, b in zip(after, before, strict=True)):
            pairs += 1
            assert sum(map(len, after)) < sum(map(len, before))
            assert point.value(small) >= point.value(whole) - 1e-7
    assert pairs > 0


def test_sets_without_stable_triples_are_found() -> None:
    """The complement of a cycle of seven nodes: at most two are stable, and thirds weigh more."""
    nodes = np.arange(7)
    distance = np.abs(nodes[:, None] - nodes) % 7
    antihole = (distance > 1) & (distance < 6)
    assert sets_without_stable_triples(antihole, np.full(7, 1 / 3), 7) == [list(range(7))]
    assert sets_without_stable_triples(antihole, np.full(7, 2 / 7), 7) == []
    assert sets_without_stable_triples(antihole, np.full(7, 1 / 3), 0) == []
    random = np.random.default_rng(0)
    found = 0
    for _ in range(20):
        upper = np.triu(random.random((14, 14)) < 0.75, 1)
        graph, values = upper | upper.T, random.random(14) / 2
        for members in sets_without_stable_triples(graph, values, 14):
            found += 1
            assert values[members].sum() > 2
            for triple in combinations(members, 3):
                assert any(graph[a, b] for a, b in combinations(triple, 2))
    assert found > 5


@pytest.mark.parametrize(
    ("instance", "spanning", "sense", "before", "after"),
    [
        ("random:12,3,seed=23", True, "min", 17.5, 18),
        ("random:12,3,seed=29", True, "min", 17 + 2 / 3, 18),
        ("sphere:11,3,seed=8", False, "max", 25.5, 25),
    ],
)
def test_gaps_that_close(instance: str, spanning: bool, sense: str, before: float, after: float) -> None:
    result = bcut.bound(instance, spanning=spanning, sense=sense, separators=["face-crossing"])
    assert result.root.lp == pytest.approx(before)
    assert result.root.lp_after_cuts == pytest.approx(after)


def test_cliques_of_faces_close_what_pairs_leave() -> None:
    """Over the relaxation of Formulation 0 cliques count; over that of Formulation 2 they are implied here."""
    result = bcut.bound("polygon:6", formulation="0", separators=["face-crossing"])
    assert result.root.lp == pytest.approx(2.5)
    assert result.root.lp_after_cuts is not None
    assert result.root.lp_after_cuts > 3


def test_dissections_may_have_faces_that_cross() -> None:
    with pytest.raises(InputError, match="face-crossing"):
        bcut.bound("cube:3", dissection=True, separators=["face-crossing"])


def test_an_integral_point_has_no_cuts() -> None:
    problem = problem_of("cube:3")
    x = np.zeros(len(problem.simplices))
    x[next(all_of(problem))] = 1
    assert cuts_at(problem, x)[0] == []


@pytest.mark.parametrize(
    "text", ["max_cuts=0", "max_simplices=0", "max_nodes=0", "effort=0", "starts=-1", "lift=-1", "depth=3"]
)
def test_bad_parameters_are_refused(text: str) -> None:
    with pytest.raises(SeparatorLoadError, match="face-crossing"):
        resolve(f"face-crossing:{text}")


def test_ledgers_with_such_cuts_are_proven_and_replayed(tmp_path: Path) -> None:
    text = (
        '[[instances]]\ninstance = "random:14,3,seed=0"\nspanning = true\n'
        '[[variants]]\nname = "it"\nseparators = ["face-crossing:max_cuts=6"]\n'
    )
    ledger = read_ledger(ledger_file(tmp_path, text)[0])
    checks = check_ledger(ledger)
    assert not checks.refused
    assert checks.proven == {"face-crossing": len(ledger.cuts)}
    assert ledger.cuts
    assert replay(ledger).agrees

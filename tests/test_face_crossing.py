"""Face-crossing cuts: which faces cross, what faces are worth, what is found, and what the checker accepts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import combinations, islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from laboratory import ledger_file
from numpy.typing import NDArray

import bcut
from bcut.bounds.root import root_bound
from bcut.errors import InputError, SeparatorLoadError, VerificationError
from bcut.experiments.ledger import read_ledger
from bcut.experiments.replay import check_ledger, replay
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry import face_crossings
from bcut.geometry.circuits import circuits
from bcut.geometry.face_crossings import FaceGraph, small_circuits
from bcut.geometry.face_values import FaceValues
from bcut.geometry.generic_point import simplices_containing_generic_point
from bcut.geometry.triangulations import triangulations
from bcut.objectives.objective import Objective
from bcut.separation.driver import to_integers
from bcut.separation.graphs.stable_triples import sets_without_stable_triples
from bcut.separation.resolve import resolve
from bcut.separation.seam import Cut, FractionalPoint, Problem
from bcut.separators.face_crossing import FaceCrossing
from bcut.verification.cut_data import Candidates, CertificateCut
from bcut.verification.exact_points import ExactPoints
from bcut.verification.face_cuts import check_face_crossing

Change = Callable[[CertificateCut], CertificateCut]

GENERAL = ["random:7,2,seed=1", "random:8,3,seed=1", "random:7,4,seed=1"]
DEGENERATE = ["grid:3,3", "cube:3", "prism:5", "polygon:6,center", "cross-polytope:4", "grid:3,2,2"]


def problem_of(name: str, *, spanning: bool = False) -> Problem:
    return Problem(cocircuit_formulation(bcut.load_instance(name), spanning=spanning))


def graph_of(problem: Problem) -> FaceGraph:
    return FaceGraph(problem.chirotope, problem.simplices)


def all_of(problem: Problem) -> Iterator[list[int]]:
    """Yield all triangulations, as lists of columns."""
    return map(list, triangulations(problem.chirotope))


def candidates_of(problem: Problem) -> Candidates:
    points = ExactPoints(problem.configuration.scalars())
    return Candidates(points, spanning=problem.formulation.spanning)


def cuts_at(
    problem: Problem, x: NDArray[np.floating], **parameters: int
) -> tuple[list[Cut], FractionalPoint]:
    separator = FaceCrossing(**parameters)
    separator.setup(problem)
    point = FractionalPoint(problem, x)
    return list(separator.separate(point)), point


def certified(problem: Problem, cut: Cut) -> CertificateCut:
    scaled = to_integers(cut, "face-crossing", len(problem.simplices))
    return CertificateCut(
        "face-crossing",
        tuple(tuple(row) for row in problem.simplices[scaled.columns].tolist()),
        tuple(Fraction(c) for c in scaled.coefficients.tolist()),
        Fraction(scaled.rhs),
        Fraction(-1),
        scaled.proof,
    )


def vertex(problem: Problem, seed: int) -> NDArray[np.float64]:
    """Return a vertex of the relaxation."""
    costs = np.random.default_rng(seed).integers(-20, 20, len(problem.simplices))
    found = root_bound(problem.formulation, Objective("random", "min", costs)).point
    assert found is not None
    return found


def anything(problem: Problem, seed: int) -> NDArray[np.float64]:
    """Return a point that knows nothing of the relaxation."""
    random = np.random.default_rng(seed)
    return np.where(random.random(len(problem.simplices)) < 0.3, random.random(len(problem.simplices)), 0.0)


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


@cache
def halves() -> tuple[Problem, list[Cut], FractionalPoint]:
    """Return the cuts at a root optimum."""
    problem = problem_of("random:12,3,seed=23", spanning=True)
    costs = np.ones(len(problem.simplices), dtype=np.int64)
    root = root_bound(problem.formulation, Objective("cardinality", "min", costs))
    assert root.point is not None
    return problem, *cuts_at(problem, root.point)


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


# --- the checker ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["polygon:5,center", "grid:3,3", "random:7,3,seed=1", "cube:3"])
def test_what_the_checker_proves_holds_for_every_triangulation(name: str) -> None:
    problem = problem_of(name)
    candidates = candidates_of(problem)
    rows = problem.simplices.tolist()
    incidence = np.zeros((len(rows), 0), dtype=np.int64)
    for chosen in all_of(problem):
        column = np.zeros((len(rows), 1), dtype=np.int64)
        column[chosen] = 1
        incidence = np.concatenate((incidence, column), axis=1)
    random = np.random.default_rng(3)
    accepted = refused = 0
    for seed in range(4):
        for cut in cuts_at(problem, anything(problem, seed), max_cuts=8, lift=6)[0]:
            given = certified(problem, cut)
            # Anything may happen to a coefficient, on simplices of the cut and on others.
            other = random.integers(-1, 4, len(given.coefficients))
            changed = replace(given, coefficients=tuple(Fraction(int(c)) for c in other))
            columns = [rows.index(list(simplex)) for simplex in given.simplices]
            derived = check_face_crossing(candidates, replace(changed, rhs=Fraction(10**6)))
            most = int((other @ incidence[columns]).max())
            assert derived >= most
            if derived > 0:
                accepted += 1
                with pytest.raises(VerificationError, match="is all that its faces prove"):
                    check_face_crossing(candidates, replace(changed, rhs=derived - 1))
                refused += 1
    assert accepted > 20


def lifted_cut() -> CertificateCut:
    """Return a cut of more than a clique, with lifted faces."""
    problem, cuts, _ = halves()
    return certified(problem, next(cut for cut in cuts if cut.rhs > 1 and len(cut.proof["faces"]) > 9))


def with_faces(cut: CertificateCut, faces: Any) -> CertificateCut:
    return replace(cut, proof={**cut.proof, "faces": faces})


def one_more(entry: Any) -> Change:
    return lambda cut: with_faces(cut, [*cut.proof["faces"], entry])


def heavier(cut: CertificateCut) -> CertificateCut:
    face, rest, weight = cut.proof["faces"][-1]
    return with_faces(cut, [*cut.proof["faces"][:-1], [face, rest, weight + 1]])


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda cut: replace(cut, rhs=cut.rhs - 1), "is all that its faces prove"),
        (
            lambda cut: replace(cut, coefficients=(9 * cut.coefficients[0], *cut.coefficients[1:])),
            "is all that its faces prove",
        ),
        (lambda cut: with_faces(cut, cut.proof["faces"][:2]), "contains none of its faces"),
        (heavier, "faces that do not cross weigh more than 2"),
        (
            lambda cut: replace(cut, proof={**cut.proof, "bound": 1}),
            "faces that do not cross weigh more than 1",
        ),
        (lambda cut: replace(cut, proof={**cut.proof, "bound": 0}), "no integer 'bound'"),
        (lambda cut: replace(cut, proof={"faces": []}), "no integer 'bound'"),
        (lambda cut: with_faces(cut, 2 * cut.proof["faces"]), "stands twice"),
        (lambda cut: with_faces(cut, None), "has no list 'faces'"),
        (one_more([[0, 1], [2, 3]]), "which is no face"),
        (one_more([[0], [1, 2], 1]), "which is no face"),
        (one_more([[], [0, 1, 2, 3], 1]), "which is no face"),
        (one_more([[0, 1], [2, 99], 1]), "which is no face"),
        (one_more([[0, 1], [2, 3], 0]), "which is no face"),
        (one_more([[1, 0], [2, 3], 1]), "is not ascending"),
    ],
)
def test_the_checker_refuses_what_does_not_follow(change: Change, reason: str) -> None:
    candidates = candidates_of(halves()[0])
    cut = lifted_cut()
    assert check_face_crossing(candidates, cut) == cut.rhs
    with pytest.raises(VerificationError, match=reason):
        check_face_crossing(candidates, change(cut))


def test_a_flag_has_to_span_the_space() -> None:
    problem = problem_of("cube:3")
    cut = certified(problem, cuts_at(problem, anything(problem, 0))[0][0])
    # The points 0, 1, 2, 3 are a square.
    with pytest.raises(VerificationError, match="lies in a hyperplane"):
        check_face_crossing(candidates_of(problem), one_more([[0, 1], [2, 3], 1])(cut))


def test_flags_decide_which_simplices_count_for_a_face() -> None:
    """A diagonal of a square may have a simplex on either side: with both of them there would be two."""
    problem = problem_of("polygon:4")
    candidates = candidates_of(problem)
    faces = [[[0, 2], [1], 1], [[1, 3], [0], 1]]
    both = CertificateCut(
        "face-crossing", ((0, 1, 2), (0, 1, 3)), (Fraction(1),) * 2, Fraction(1), Fraction(-1), {}
    )
    one = replace(both, proof={"bound": 1, "faces": faces})
    assert check_face_crossing(candidates, one) == 1
    two = replace(one, simplices=((0, 1, 2), (0, 2, 3)))
    with pytest.raises(VerificationError, match="contains none of its faces in the direction"):
        check_face_crossing(candidates, two)


def test_simplices_with_three_points_on_a_line_count_for_no_face() -> None:
    problem = problem_of("grid:3,2,2")
    candidates = candidates_of(problem)
    flat = [s for s in combinations(range(12), 4) if not candidates.orientation(s)]
    assert any(not any(candidates[facet]) for simplex in flat for facet in combinations(simplex, 3))
    for simplex in flat:
        for vertex in simplex:
            rest = next(s for s in problem.simplices.tolist() if vertex in s)
            faces = [[[vertex], [v for v in rest if v != vertex], 1]]
            cut = CertificateCut("face-crossing", (simplex,), (Fraction(1),), Fraction(1), Fraction(-1), {})
            with pytest.raises(VerificationError, match="contains none of its faces"):
                check_face_crossing(candidates, replace(cut, proof={"bound": 1, "faces": faces}))


def test_coefficients_divided_by_a_common_factor_still_follow() -> None:
    cut = lifted_cut()
    candidates = candidates_of(halves()[0])
    doubled = replace(cut, coefficients=tuple(2 * c for c in cut.coefficients), rhs=2 * cut.rhs)
    assert check_face_crossing(candidates, doubled) == doubled.rhs
    halved = replace(cut, coefficients=tuple(c / 2 for c in cut.coefficients), rhs=cut.rhs / 2)
    assert check_face_crossing(candidates, halved) == halved.rhs
    nothing = replace(cut, coefficients=tuple(-c for c in cut.coefficients))
    assert check_face_crossing(candidates, nothing) == 0

"""Link cuts: exact separation of one star, exact lifting, validity, and what they do to the bound."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

import bcut
from bcut.errors import VerificationError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.stars import Star, Stars
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.separation.driver import to_integers
from bcut.separation.seam import Cut, FractionalPoint, Problem
from bcut.separation.small_lp import SmallLps
from bcut.separators.link import Link, lift_weights, most_violated_weights
from bcut.verification.cuts import CUT_CHECKERS, Candidates, CertificateCut
from bcut.verification.exact_points import ExactPoints

# The checker that ledgers and certificates use: it shares neither stars nor walks with the separator.
check_link = CUT_CHECKERS["link"]

SMALL = [
    ("polygon:5,center", False),
    ("moae", False),
    ("moae", True),
    ("grid:3,3", False),
    ("grid:3,3", True),
    ("cube:3", False),
    ("prism:5", False),
    ("antiprism:5", False),
    ("grid:3,2,2", True),
    ("cyclic:8,4", False),
    ("cyclic:8,5", False),
    ("hypersimplex:5,2", False),
    ("random:8,2,seed=1", False),
    ("random:8,3,seed=2", True),
]


@cache
def problem_of(name: str, spanning: bool = False) -> Problem:
    return Problem(cocircuit_formulation(load_instance(name), spanning=spanning))


def candidates_of(problem: Problem) -> Candidates:
    """All that the independent checker is told: the points, and whether all of them are to be used."""
    return Candidates(ExactPoints(problem.configuration.scalars()), spanning=problem.formulation.spanning)


def as_certified(problem: Problem, cut: Cut) -> CertificateCut:
    """A cut as ledgers and certificates have it: by vertices."""
    simplices = tuple(map(tuple, problem.simplices[np.asarray(cut.simplices)].tolist()))
    assert cut.coefficients is not None
    coefficients = tuple(Fraction(int(value)) for value in cut.coefficients)
    return CertificateCut("link", simplices, coefficients, Fraction(cut.rhs), Fraction(0), cut.proof)


@cache
def triangulation_matrix(problem: Problem) -> np.ndarray:
    rows = list(triangulations(problem.chirotope, spanning=problem.formulation.spanning))
    matrix = np.zeros((len(rows), len(problem.simplices)), dtype=np.int64)
    for number, row in enumerate(rows):
        matrix[number, list(row)] = 1
    matrix.setflags(write=False)
    return matrix


def once_winding_walks(star: Star) -> list[list[int]]:
    """List all closed walks that wind once, as lists of wedges, by plain search."""
    by_tail: dict[int, list[int]] = {}
    for wedge, tail in enumerate(star.tails.tolist()):
        by_tail.setdefault(tail, []).append(wedge)
    walks = []

    def extend(walk: list[int], start: int, at: int) -> None:
        for wedge in by_tail.get(at % star.size, []):
            end = at + (int(star.heads[wedge]) - int(star.tails[wedge])) % star.size
            if end == start + star.size:
                walks.append([*walk, wedge])
            elif end < start + star.size:
                extend([*walk, wedge], start, end)

    for wedge in np.flatnonzero(star.wraps).tolist():
        head = int(star.heads[wedge])
        extend([wedge], head - (int(star.heads[wedge]) - int(star.tails[wedge])) % star.size, head)
    return walks


def largest_packing(walks: list[list[int]], values: np.ndarray) -> float:
    """Pack walks within capacities by the plain linear program with one variable per walk."""
    if not walks:
        return 0.0
    usage = np.zeros((len(values), len(walks)))
    for number, walk in enumerate(walks):
        usage[walk, number] += 1
    return -linprog(-np.ones(len(walks)), A_ub=usage, b_ub=values).fun


@pytest.mark.parametrize(("name", "spanning"), SMALL)
def test_wedges_of_each_triangulation_wind_once_or_are_absent(name: str, spanning: bool) -> None:
    problem = problem_of(name, spanning)
    matrix = triangulation_matrix(problem)
    stars = Stars(problem.chirotope, problem.simplices)
    for number in range(len(stars.faces)):
        star = stars.star(number)
        counts = np.array([matrix[:, star.columns[over]].sum(axis=1) for over in star.over])
        assert (counts == counts[0]).all()
        assert set(np.unique(counts)) <= {0, 1}


@pytest.mark.parametrize(
    "name", ["polygon:7,center", "grid:3,3", "random:10,2,seed=1", "random:10,3,seed=4", "prism:6"]
)
def test_separation_of_a_star_is_exact(name: str) -> None:
    problem = problem_of(name)
    stars = Stars(problem.chirotope, problem.simplices)
    rng = np.random.default_rng(5)
    programs, short = SmallLps(), 0
    for number in range(min(len(stars.faces), 12)):
        star = stars.star(number)
        walks = once_winding_walks(star)
        for _ in range(25):
            values = random_circulation(star, rng)
            total = values[star.over[0]].sum()
            packed = largest_packing(walks, values)
            shortfall, weights = most_violated_weights(star, values, programs)
            assert shortfall == pytest.approx(total - packed, abs=1e-6)
            if shortfall > 1e-6:
                short += 1
                assert weights @ values == pytest.approx(packed, abs=1e-6)
                used = values > 1e-9
                for walk in walks:
                    assert not used[walk].all() or weights[walk].sum() > 1 - 1e-6
    if name.startswith(("polygon", "random")):
        assert short > 0, "none of the random circulations winds twice: the test tests nothing"


def random_circulation(star: Star, rng: np.random.Generator) -> np.ndarray:
    """Sum a few random closed walks, which may wind several times."""
    values = np.zeros(len(star.columns))
    for _ in range(3):
        at = int(rng.integers(star.size))
        walk: list[int] = []
        seen = {at: 0}
        while True:
            choices = np.flatnonzero(star.tails == at)
            if not len(choices):
                break
            # Wide wedges more often than not: narrow ones hardly ever get around twice before a node repeats.
            spans = (star.levels[star.heads[choices]] - star.levels[at]) % star.turn
            wedge = int(choices[np.argmax(spans)] if rng.random() < 0.8 else rng.choice(choices))
            walk.append(wedge)
            at = int(star.heads[wedge])
            if at in seen:
                np.add.at(values, walk[seen[at] :], 0.5)
                break
            seen[at] = len(walk)
    return values


def test_five_wedges_that_wind_twice_are_cut_off() -> None:
    # The pentagon's centre: its five triangles over two sides each, of 144 degrees, at 1/2.
    problem = problem_of("polygon:5,center")
    x = np.zeros(len(problem.simplices))
    spokes = [sorted((5, i, (i + 2) % 5)) for i in range(5)]
    x[problem.formulation.columns_of(np.array(spokes))] = 0.5
    sides = [sorted((i, (i + 1) % 5, (i + 2) % 5)) for i in range(5)]
    x[problem.formulation.columns_of(np.array(sides))] = 0.5
    assert np.allclose(problem.formulation.matrix @ x, problem.formulation.lower)
    separator = Link()
    separator.setup(problem)
    point = FractionalPoint(problem, x)
    cuts = list(separator.separate(point))
    assert len(cuts) == 1
    assert point.value(cuts[0]) > cuts[0].rhs + 0.4


def test_the_proof_holds_all_that_alpha_needs() -> None:
    problem = problem_of("polygon:7,center")
    stars = Stars(problem.chirotope, problem.simplices)
    star = stars.star(0)
    x = np.zeros(len(problem.simplices))
    # Seven wedges of three sevenths of a turn, at 1/3: one walk that winds three times.
    x[star.columns[star.spans == 3]] = 1 / 3
    separator = Link()
    separator.setup(problem)
    cuts = list(separator.separate(FractionalPoint(problem, x)))
    assert len(cuts) == 1
    proof = cuts[0].proof
    assert proof["face"] == [7]
    weights = {(tail, head): weight for tail, head, weight in proof["wedges"]}
    ends = zip(star.points[star.tails].tolist(), star.points[star.heads].tolist(), strict=True)
    by_wedge = np.array([weights[wedge] for wedge in ends])
    assert min(by_wedge[walk].sum() for walk in once_winding_walks(star)) == proof["alpha"]


@pytest.mark.parametrize(("name", "spanning"), SMALL)
@pytest.mark.parametrize("lift", [True, False])
def test_no_cut_removes_a_triangulation(name: str, spanning: bool, lift: bool) -> None:
    problem = problem_of(name, spanning)
    matrix = triangulation_matrix(problem)
    candidates = candidates_of(problem)
    separator = Link(lift=lift)
    separator.setup(problem)
    rng = np.random.default_rng(11)
    for point in affine_points(matrix, rng):
        for cut in separator.separate(FractionalPoint(problem, point)):
            exact = to_integers(cut, "link", len(point))
            assert (matrix[:, exact.columns] @ exact.coefficients <= exact.rhs).all()
            assert check_link(candidates, as_certified(problem, cut)) == 0


def affine_points(matrix: np.ndarray, rng: np.random.Generator) -> list[np.ndarray]:
    """Random points of the affine hull of the triangulations, clipped to what a relaxation could return."""
    points, matrix = [], matrix.astype(float)
    for _ in range(20):
        weights = rng.normal(size=len(matrix))
        weights[rng.random(len(matrix)) < 0.7] = 0
        if abs(weights.sum()) > 1e-3:
            points.append(np.maximum(weights / weights.sum() @ matrix, 0))
    return points


@pytest.fixture(scope="module")
def found_cuts() -> tuple[Candidates, list[CertificateCut]]:
    """Cuts of vertices of the relaxation of fewest simplices, and what the checker knows of the points."""
    problem = problem_of("random:12,3,seed=1000", spanning=True)
    separator = Link()
    separator.setup(problem)
    formulation, found = problem.formulation, []
    for seed in range(30):
        costs = 1 + 0.1 * np.random.default_rng(seed).random(len(problem.simplices))
        x = linprog(costs, A_eq=formulation.matrix, b_eq=formulation.lower).x
        found += [as_certified(problem, cut) for cut in separator.separate(FractionalPoint(problem, x))]
    assert found
    return candidates_of(problem), found


def test_the_checker_accepts_what_was_found(found_cuts: tuple[Candidates, list[CertificateCut]]) -> None:
    candidates, found = found_cuts
    for cut in found:
        # A triangulation without the face has 0 on the left, so nothing less than 0 can follow.
        assert check_link(candidates, cut) == cut.rhs == 0
        without_reasons = replace(cut, proof={"face": cut.proof["face"]})
        assert check_link(candidates, without_reasons) == 0


def raised(cut: CertificateCut) -> CertificateCut:
    """With one coefficient, that of the lightest simplex, raised by more than any walk has to spare."""
    coefficients = list(cut.coefficients)
    lowest = coefficients.index(min(coefficients))
    coefficients[lowest] += 1 + sum(map(abs, coefficients))
    return replace(cut, coefficients=tuple(coefficients))


def of_another_face(cut: CertificateCut) -> CertificateCut:
    """With the proof of a face that some of the simplices do not contain."""
    vertices = {vertex for simplex in cut.simplices for vertex in simplex}
    other = sorted(vertices - set(cut.proof["face"]))[:2]
    return replace(cut, proof={**cut.proof, "face": other})


def with_a_stranger(cut: CertificateCut) -> CertificateCut:
    """With one more simplex, which does not contain the face."""
    stranger = tuple(sorted({0, 1, 2, 3, 4} - {cut.proof["face"][0]}))[:4]
    return replace(cut, simplices=(*cut.simplices, stranger), coefficients=(*cut.coefficients, Fraction(1)))


def with_more_alpha(cut: CertificateCut) -> CertificateCut:
    """With the same inequality, but another reason: more than the lightest walk weighs."""
    return replace(cut, proof={**cut.proof, "alpha": cut.proof["alpha"] + 1})


def with_lighter_wedges(cut: CertificateCut) -> CertificateCut:
    """With weights in the proof that are all too small for its alpha."""
    wedges = [[tail, head, 0] for tail, head, _ in cut.proof["wedges"]]
    return replace(cut, proof={**cut.proof, "wedges": wedges})


@pytest.mark.parametrize(
    ("tamper", "says"),
    [
        (lambda cut: replace(cut, rhs=cut.rhs - 1), "wind around it once reach 0"),
        (
            lambda cut: replace(cut, coefficients=tuple(c + 1 for c in cut.coefficients)),
            "wind around it once reach",
        ),
        (raised, "wind around it once reach"),
        (of_another_face, "does not contain the face"),
        (with_a_stranger, "does not contain the face"),
        (with_more_alpha, "weigh at least"),
        (with_lighter_wedges, "weigh at least"),
    ],
)
def test_tampered_cuts_are_refused(
    tamper: Callable[[CertificateCut], CertificateCut],
    says: str,
    found_cuts: tuple[Candidates, list[CertificateCut]],
) -> None:
    candidates, found = found_cuts
    for cut in found:
        with pytest.raises(VerificationError, match=says):
            check_link(candidates, tamper(cut))


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_lifted_weights_leave_no_light_walk(seed: int) -> None:
    rng = np.random.default_rng(seed)
    problem = problem_of(f"random:8,2,seed={seed % 50}")
    stars = Stars(problem.chirotope, problem.simplices)
    if not len(stars.faces):
        return
    star = stars.star(int(rng.integers(len(stars.faces))))
    support = np.sort(rng.choice(len(star.columns), size=max(1, len(star.columns) // 3), replace=False))
    weights = rng.integers(0, 4, size=len(support))
    alpha, lifted = lift_weights(star, support, weights)
    assert (lifted[support] == weights).all()
    assert (lifted <= np.maximum(alpha, lifted * np.isin(np.arange(len(lifted)), support))).all()
    for walk in once_winding_walks(star):
        assert lifted[walk].sum() >= alpha


@pytest.mark.parametrize(
    ("name", "lp", "optimum"),
    [
        ("random:12,3,seed=1000", 16.5, 17),
        ("random:14,3,seed=1000", 20.5, 21),
        ("random:16,3,seed=1000", 24.5, 25),
        ("random:16,3,seed=1002", 24.5, 25),
        ("random:20,3,seed=1000", 35.5, 36),
        ("random:20,3,seed=1001", 34.3333333, 35),
        ("random:20,3,seed=1002", 35.5, 36),
    ],
)
def test_link_cuts_alone_close_the_gap_of_cardinality(name: str, lp: float, optimum: int) -> None:
    result = bcut.bound(name, spanning=True, separators=["link"])
    assert result.root.lp == pytest.approx(lp, abs=1e-6)
    assert result.root.lp_after_cuts == pytest.approx(optimum, abs=1e-6)
    values = [finished.lp for finished in result.root.rounds]
    assert all(later >= earlier - 1e-7 for earlier, later in pairwise(values))

"""Sphere cuts: the search for light stars, what the cuts close, and that the checker accepts nothing else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import Bounds, LinearConstraint, milp

import bcut
from bcut.bounds.root import RootBound, RootLimits, root_bound
from bcut.errors import VerificationError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.generic_point import contain_generic_points
from bcut.geometry.numbers import parse_coordinate
from bcut.geometry.star_triangulations import SearchLimitError, StarTriangulations
from bcut.geometry.triangulations import triangulations
from bcut.objectives.objective import make_objective
from bcut.separation.driver import IntegerCut, Separation
from bcut.separation.seam import FractionalPoint, Problem, Separator
from bcut.separators.link import Link
from bcut.separators.sphere import Sphere
from bcut.verification.cut_data import Candidates, CertificateCut
from bcut.verification.exact_points import ExactPoints
from bcut.verification.sphere_cuts import check_sphere

Change = Callable[[CertificateCut], CertificateCut]


@cache
def problem_of(name: str, spanning: bool = False) -> Problem:
    return Problem(cocircuit_formulation(bcut.load_instance(name), spanning=spanning))


@cache
def candidates_of(name: str, spanning: bool = False) -> Candidates:
    points = problem_of(name, spanning).configuration.exact_points()
    return Candidates(ExactPoints([[parse_coordinate(x) for x in p] for p in points]), spanning=spanning)


@cache
def chosen_columns(name: str, spanning: bool = False) -> list[set[int]]:
    problem = problem_of(name, spanning)
    return [set(map(int, t)) for t in triangulations(problem.chirotope, spanning=spanning)]


@cache
def incidence_of(name: str, spanning: bool = False) -> NDArray[np.int64]:
    chosen = chosen_columns(name, spanning)
    rows = np.zeros((len(chosen), len(problem_of(name, spanning).simplices)), dtype=np.int64)
    for row, columns in zip(rows, chosen, strict=True):
        row[list(columns)] = 1
    return rows


def integral(values: Sequence[Fraction]) -> NDArray[np.int64]:
    assert all(value.denominator == 1 for value in values)
    return np.array([value.numerator for value in values], dtype=np.int64)


class Star:
    """The star of a face, all of it, with a direction, and the least weights by integer programming."""

    def __init__(self, problem: Problem, face: tuple[int, ...]) -> None:
        self.problem, self.face = problem, face
        simplices = problem.simplices
        self.columns = np.flatnonzero(np.isin(simplices, face).sum(axis=1) == len(face))
        self.simplices = simplices[self.columns]
        others = [v for v in self.simplices[0].tolist() if v not in face]
        self.direction = [*face, *others]
        flags = np.tile(self.direction, (len(self.columns), 1))
        self.over = contain_generic_points(problem.chirotope, self.simplices, flags)
        self.search = StarTriangulations(
            problem.chirotope, np.array(face), self.simplices, problem.crossings(self.columns)
        )

    def by_integer_program(self, weights: list[int], fixed: int | None = None) -> float:
        """Solve Formulation 2 of the star: the cocircuit rows at the face and one coverage row."""
        formulation = self.problem.formulation
        rows = [
            row
            for row, ridge in enumerate(formulation.row_faces)
            if ridge is not None and set(self.face) <= set(ridge)
        ]
        matrix = formulation.matrix[rows][:, self.columns].toarray()
        lower = np.zeros(len(weights))
        if fixed is not None:
            lower[fixed] = 1
        solution = milp(
            weights,
            constraints=[LinearConstraint(np.vstack((matrix, self.over)), *[[0] * len(rows) + [1]] * 2)],
            bounds=Bounds(lower, np.ones(len(weights))),
            integrality=np.ones(len(weights)),
        )
        return np.inf if solution.x is None else round(solution.fun)

    def cut(self, weights: list[int], alpha: int, rhs: int = 0) -> CertificateCut:
        coefficients = alpha * self.over - np.array(weights)
        light = [[s, w] for s, w in zip(self.simplices.tolist(), weights, strict=True) if w < alpha]
        proof = {"face": list(self.face), "alpha": alpha, "direction": self.direction, "light": light}
        simplices = tuple(map(tuple, self.simplices.tolist()))
        return CertificateCut(
            "sphere",
            simplices,
            tuple(map(Fraction, coefficients.tolist())),
            Fraction(rhs),
            Fraction(-1),
            proof,
        )


FACES = [("random:8,3,seed=1", False, (v,)) for v in range(8)] + [
    ("random:10,3,seed=1000", True, (4,)),
    ("cube:3", False, (0,)),
    ("prism:5", False, (3,)),
    ("grid:3,2,2", True, (1,)),
    ("cyclic:8,4", False, (0, 1)),
    ("cyclic:8,4", False, (2, 5)),
]


@pytest.mark.parametrize(("name", "spanning", "face"), FACES)
def test_the_search_finds_the_lightest_star(name: str, spanning: bool, face: tuple[int, ...]) -> None:
    star = Star(problem_of(name, spanning), face)
    random = np.random.default_rng(sum(face))
    start = np.flatnonzero(star.over).tolist()
    for _ in range(5):
        weights = random.integers(0, 6, size=len(star.columns)).tolist()
        found = star.search.lightest(weights, np.inf, start)
        assert [w for w, _ in found] == sorted({w for w, _ in found}, reverse=True)
        for weight, chosen in found:
            assert weight == sum(weights[i] for i in chosen)
        least = found[-1][0]
        assert least == star.by_integer_program(weights)
        assert not star.search.lightest(weights, least, start)
        used = [t & set(star.columns.tolist()) for t in chosen_columns(name, spanning)]
        weight_of = dict(zip(star.columns.tolist(), weights, strict=True))
        assert least <= min(sum(weight_of[c] for c in t) for t in used if t)
    with pytest.raises(SearchLimitError):
        star.search.lightest(weights, np.inf, start, steps=0)


def test_a_search_can_be_made_to_use_a_simplex() -> None:
    star = Star(problem_of("random:8,3,seed=1"), (2,))
    weights = np.random.default_rng(3).integers(0, 6, size=len(star.columns)).tolist()
    for simplex in range(len(weights)):
        found = star.search.lightest(weights, np.inf, [simplex])
        expected = star.by_integer_program(weights, fixed=simplex)
        assert (found[-1][0] if found else np.inf) == expected
        assert all(simplex in chosen for _, chosen in found)


@pytest.mark.parametrize(("name", "spanning", "face"), FACES[::2])
@settings(max_examples=10, deadline=None)
@given(data=st.data())
def test_the_checker_accepts_the_least_weight_and_no_more(
    name: str, spanning: bool, face: tuple[int, ...], data: st.DataObject
) -> None:
    star = Star(problem_of(name, spanning), face)
    size = len(star.columns)
    weights = data.draw(st.lists(st.integers(0, 4), min_size=size, max_size=size))
    alpha = int(star.by_integer_program(weights))
    candidates = candidates_of(name, spanning)
    if alpha > 0:
        cut = star.cut(weights, alpha)
        assert check_sphere(candidates, cut) == 0
        assert (incidence_of(name, spanning)[:, star.columns] @ integral(cut.coefficients) <= 0).all()
    with pytest.raises(VerificationError, match=f"weigh at least {alpha + 1}, but one weighs {alpha}"):
        check_sphere(candidates, star.cut(weights, alpha + 1))


def bounded(separators: list[Separator]) -> tuple[RootBound, list[IntegerCut]]:
    problem = problem_of("random:20,3,seed=1")
    objective = make_objective("cardinality", problem.formulation, sense="max")
    # Only what a triangulation with 89 tetrahedra can use.
    limits = RootLimits(target=Fraction(-89))
    root = root_bound(problem.formulation, objective, Separation(separators, problem), limits=limits)
    return root, root.cuts


@cache
def closed() -> tuple[RootBound, list[IntegerCut]]:
    return bounded([Link(), Sphere()])


def test_sphere_cuts_close_what_link_cuts_leave() -> None:
    assert bounded([Link()])[0].lp_after_cuts == pytest.approx(89.5)
    root, _ = closed()
    assert root.lp_after_cuts == pytest.approx(89)
    assert root.status == "integral"


def certified() -> tuple[Candidates, list[CertificateCut]]:
    root, cuts = closed()
    assert root.separation is not None
    simplices = root.separation.problem.simplices
    made = [
        CertificateCut(
            "sphere",
            tuple(map(tuple, simplices[cut.columns].tolist())),
            tuple(map(Fraction, cut.coefficients.tolist())),
            Fraction(cut.rhs),
            Fraction(-1),
            cut.proof,
        )
        for cut in cuts
        if cut.family == "sphere"
    ]
    return candidates_of("random:20,3,seed=1").only(map(tuple, simplices.tolist())), made


def test_every_cut_of_a_bound_is_proven() -> None:
    candidates, cuts = certified()
    assert len(cuts) > 3
    for cut in cuts:
        assert check_sphere(candidates, cut) == 0


def with_proof(cut: CertificateCut, **changes: Any) -> CertificateCut:
    return replace(cut, proof={**cut.proof, **changes})


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda cut: replace(cut, rhs=Fraction(-1)), "its left side is 0, but its right-hand side is -1"),
        (
            lambda cut: replace(cut, coefficients=(cut.coefficients[0] + 1, *cut.coefficients[1:])),
            "but the proof gives",
        ),
        (
            lambda cut: replace(cut, simplices=cut.simplices[1:], coefficients=cut.coefficients[1:]),
            "is 0, but the proof gives -",
        ),
        (
            lambda cut: replace(
                cut,
                simplices=(without(cut), *cut.simplices),
                coefficients=(Fraction(-1), *cut.coefficients),
            ),
            "does not contain the face",
        ),
        (lambda cut: with_proof(cut, face=[99]), "has no good 'face'"),
        (lambda cut: with_proof(cut, face=[0.5]), "has no good 'face'"),
        (lambda cut: with_proof(cut, direction=cut.proof["direction"][::-1]), "is no direction at the face"),
        (lambda cut: with_proof(cut, direction=[]), "has no good 'direction'"),
        (lambda cut: with_proof(cut, alpha=0), "no positive integer 'alpha'"),
        (lambda cut: with_proof(cut, light=None), "with a list 'light'"),
        (lambda cut: with_proof(cut, light=[[[0, 1, 2, 3], -1]]), "is no simplex with a weight"),
        (lambda cut: with_proof(cut, light=2 * cut.proof["light"]), "or is there twice"),
    ],
)
def test_the_checker_refuses_what_does_not_follow(change: Change, reason: str) -> None:
    candidates, cuts = certified()
    # The last coefficient changes nothing but itself in a cut whose first one is negative.
    cut = next(cut for cut in cuts if cut.coefficients[0] < 0)
    with pytest.raises(VerificationError, match=reason):
        check_sphere(candidates, change(cut))


def without(cut: CertificateCut) -> tuple[int, ...]:
    """Return a simplex that does not contain the face of a cut."""
    return next(s for s in combinations(range(20), 4) if not set(s) & set(cut.proof["face"]))


def test_lighter_simplices_would_need_another_proof() -> None:
    candidates, cuts = certified()
    for cut in cuts:
        light = cut.proof["light"]
        known = {tuple(simplex) for simplex, _ in light}
        more = [[list(simplex), 0] for simplex in cut.simplices if simplex not in known]
        with pytest.raises(VerificationError, match="its stars weigh at least"):
            check_sphere(candidates, with_proof(cut, light=light + more))


def separated(name: str, x: NDArray[np.floating], **parameters: int) -> int:
    separator, problem = Sphere(**parameters), problem_of(name)
    separator.setup(problem)
    return len(list(separator.separate(FractionalPoint(problem, x))))


def test_mixtures_of_triangulations_violate_nothing() -> None:
    chosen = chosen_columns("random:8,3,seed=1")
    x = np.zeros(len(problem_of("random:8,3,seed=1").simplices))
    for t in chosen[:: len(chosen) // 7][:7]:
        x[sorted(t)] += 1 / 7
    assert separated("random:8,3,seed=1", x) == 0


def test_there_are_no_stars_of_faces_in_the_plane() -> None:
    problem = problem_of("polygon:5,center")
    assert separated("polygon:5,center", np.full(len(problem.simplices), 0.5)) == 0


def test_limits_leave_stars_alone() -> None:
    root, _ = bounded([])
    assert root.point is not None
    x = np.zeros(len(problem_of("random:20,3,seed=1").simplices))
    x[root.columns] = root.point
    assert separated("random:20,3,seed=1", x) > 1
    assert separated("random:20,3,seed=1", x, max_cuts=1) == 1
    assert separated("random:20,3,seed=1", x, max_support=1) == 0
    assert separated("random:20,3,seed=1", x, max_steps=1) == 0
    # Weaker, but still cuts.
    assert separated("random:20,3,seed=1", x, max_lifted=0) > 1
    with pytest.raises(ValueError, match="at least 1"):
        Sphere(max_steps=0)

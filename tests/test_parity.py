"""Parity cuts: what they find, that they hold, and that the checker accepts nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import bcut
from bcut.bounds.root import RootLimits, root_bound
from bcut.errors import VerificationError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.numbers import parse_coordinate
from bcut.objectives.objective import make_objective
from bcut.separation.driver import Separation
from bcut.separation.seam import Cut, FractionalPoint, Problem
from bcut.separators.parity import Parity
from bcut.verification.cut_data import Candidates, CertificateCut
from bcut.verification.exact_points import ExactPoints
from bcut.verification.parity_cuts import check_parity

Change = Callable[[CertificateCut], CertificateCut]


def problem_of(name: str, *, spanning: bool = False) -> Problem:
    return Problem(cocircuit_formulation(bcut.load_instance(name), spanning=spanning))


@cache
def thirds() -> tuple[Problem, list[Cut], FractionalPoint]:
    """Return the cuts at a root optimum whose values are thirds."""
    problem = problem_of("random:20,3,seed=1001", spanning=True)
    root = root_bound(problem.formulation, make_objective("cardinality", problem.formulation, sense="min"))
    assert root.point is not None
    return problem, *cuts_at(problem, root.point)


def cuts_at(problem: Problem, x: NDArray[np.floating]) -> tuple[list[Cut], FractionalPoint]:
    separator = Parity()
    separator.setup(problem)
    point = FractionalPoint(problem, x)
    return list(separator.separate(point)), point


def certified(problem: Problem, cut: Cut) -> CertificateCut:
    simplices = tuple(tuple(problem.simplices[column].tolist()) for column in cut.simplices)
    assert cut.coefficients is not None
    coefficients = tuple(Fraction(int(c)) for c in cut.coefficients)
    return CertificateCut("parity", simplices, coefficients, Fraction(cut.rhs), Fraction(-1), cut.proof)


def candidates_of(problem: Problem) -> Candidates:
    configuration = problem.configuration
    points = [[parse_coordinate(x) for x in point] for point in configuration.exact_points()]
    return Candidates(ExactPoints(points), spanning=problem.formulation.spanning)


def hull_triangle() -> tuple[int, ...]:
    problem, _, _ = thirds()
    return tuple(problem.chirotope.hull_facets[0])


def test_every_cut_is_violated_and_proven_by_its_rows() -> None:
    problem, cuts, point = thirds()
    assert len(cuts) == 40
    candidates = candidates_of(problem)
    for cut in cuts:
        assert point.value(cut) > cut.rhs + 1e-4
        assert check_parity(candidates, certified(problem, cut)) == cut.rhs


@pytest.mark.parametrize(("name", "whole"), [("random:12,3,seed=1000", 17), ("random:16,3,seed=1002", None)])
def test_points_with_halves_violate_checks_without_fractional_simplices(name: str, whole: int | None) -> None:
    problem = problem_of(name, spanning=True)
    root = root_bound(problem.formulation, make_objective("cardinality", problem.formulation, sense="min"))
    assert root.point is not None
    cuts, point = cuts_at(problem, root.point)
    assert np.allclose(point.x[point.fractional], 0.5)
    candidates = candidates_of(problem)
    assert cuts
    for cut in cuts:
        # Every check has an even number of halves; from two on, no choice is forbidden that a half of each comes near.
        assert not np.isin(cut.simplices, point.fractional).any()
        assert point.value(cut) == pytest.approx(cut.rhs + 1)
        assert check_parity(candidates, certified(problem, cut)) == cut.rhs
    if whole is not None:
        result = bcut.bound(name, spanning=True, separators=["parity"])
        assert result.root.lp_after_cuts == pytest.approx(whole)


def test_the_system_is_eliminated() -> None:
    problem, _, point = thirds()
    separator = Parity()
    separator.setup(problem)
    columns = point.fractional
    rows = [np.unique(separator.rows[row].indices) for row in range(len(separator.faces))]
    pivots = []
    seen = set()
    for combination in separator._combinations(columns):
        odd: set[int] = set()
        for row in combination:
            odd ^= set(rows[row].tolist())
        assert len(combination)
        seen.add(tuple(combination.tolist()))
        pivots.append(len(odd & set(columns.tolist())))
    # Nothing is lost: as many sums as rows with a fractional simplex, all different.
    assert len(seen) == len(pivots) == sum(bool(np.isin(row, columns).any()) for row in rows)
    rank = len(pivots) - pivots.count(0)
    assert rank <= len(columns)
    # A pivot row has one column of its own and those that are dependent on others.
    assert max(pivots) <= 1 + len(columns) - rank


def test_the_coverage_row_is_an_odd_check() -> None:
    problem = problem_of("grid:3,3")
    flag = problem.chirotope.bases[0].tolist()
    over = np.flatnonzero(problem.formulation.matrix[0].toarray()[0])
    cut = certified(problem, Cut(over, -1, -np.ones(len(over), dtype=np.int64), {"rows": [], "flag": flag}))
    # None of them is a wrong number: at least one is chosen.
    assert check_parity(candidates_of(problem), cut) == -1
    with pytest.raises(VerificationError, match="the simplices of the cut"):
        check_parity(candidates_of(problem), replace(cut, proof={"rows": []}))


def test_the_bound_of_random_points_moves() -> None:
    problem = problem_of("random:20,3,seed=1001", spanning=True)
    result = root_bound(
        problem.formulation,
        make_objective("cardinality", problem.formulation, sense="min"),
        Separation([Parity()], problem),
        limits=RootLimits(rounds=5),
    )
    assert result.lp == pytest.approx(34 + 1 / 3)
    assert result.lp_after_cuts is not None
    # Sums with a pivot alone run dry at 34.5.
    assert 34.55 <= result.lp_after_cuts <= 35


@pytest.mark.parametrize(("seed", "link", "optimum"), [(1, 89.5, 89), (20, 100.5, 100), (49, 91.5, 91)])
def test_maxima_that_link_cuts_leave_are_closed(seed: int, link: float, optimum: int) -> None:
    bounds = [
        bcut.bound(f"random:20,3,seed={seed}", sense="max", separators=names).root.lp_after_cuts
        for names in (["link"], ["link", "parity"])
    ]
    assert bounds == [pytest.approx(link), pytest.approx(optimum)]


def test_formulations_without_cocircuit_rows_have_no_parity() -> None:
    result = bcut.bound("random:8,2,seed=1", formulation="0", spanning=True, separators=["parity"])
    assert result.separators["parity"]["found"] == 0


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda cut: replace(cut, rhs=cut.rhs - 1), "is proven, but its right-hand side"),
        (
            lambda cut: replace(cut, simplices=cut.simplices[1:], coefficients=cut.coefficients[1:]),
            "is not among the simplices of the cut",
        ),
        (
            lambda cut: replace(cut, coefficients=(-cut.coefficients[0], *cut.coefficients[1:])),
            "so .* of them are not forbidden",
        ),
        (
            lambda cut: replace(cut, coefficients=(2 * cut.coefficients[0], *cut.coefficients[1:])),
            "its coefficients are 1 and -1 only",
        ),
        (
            lambda cut: replace(cut, proof={**cut.proof, "rows": cut.proof["rows"][1:]}),
            "the simplices of the cut",
        ),
        (lambda cut: replace(cut, proof={**cut.proof, "rows": [[0, 1]]}), "has no good 'rows'"),
        (
            lambda cut: replace(cut, proof={**cut.proof, "rows": [[0, 1, 2]]}),
            "no points strictly on both sides",
        ),
        (lambda cut: replace(cut, proof={**cut.proof, "flag": 3}), "has no good 'flag'"),
        (lambda cut: replace(cut, proof={**cut.proof, "flag": [0, 1, 2, "3"]}), "has no good 'flag'"),
    ],
)
def test_the_checker_refuses_what_does_not_follow(change: Change, reason: str) -> None:
    problem, cuts, _ = thirds()
    with pytest.raises(VerificationError, match=reason):
        check_parity(candidates_of(problem), change(certified(problem, cuts[0])))

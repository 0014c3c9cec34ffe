"""The checker of face-crossing cuts: what it proves holds, and what does not follow is refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from crossing_faces import all_of, anything, candidates_of, certified, cuts_at, halves, problem_of

from bcut.errors import VerificationError
from bcut.verification.cut_data import CertificateCut
from bcut.verification.face_cuts import check_face_crossing

Change = Callable[[CertificateCut], CertificateCut]


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

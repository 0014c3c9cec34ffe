"""Certificates with cuts: they strengthen a bound where they are valid, and others are refused."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from square import square_result

from bcut.errors import ResultError, VerificationError
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.crossings import crossing_matrix
from bcut.instance import load_instance
from bcut.verification.cuts import CUT_CHECKERS, CertificateCut, UncheckedError, check_clique, cross
from bcut.verification.exact_points import ExactPoints, SideTable
from bcut.verification.verify import verify


def clique(simplices: Sequence[Sequence[int]], /, **changes: Any) -> dict[str, Any]:
    cut = {
        "family": "clique",
        "simplices": simplices,
        "coefficients": [1] * len(simplices),
        "rhs": 1,
        "multiplier": "-1",
        "proof": {},
    }
    return {**cut, **changes}


def two_overlapping(**certificate: Any) -> dict[str, Any]:
    """Maximise the number of triangles among 012 and 013, which overlap: at most 1, but 2 without a cut."""
    data = square_result(multipliers=[], **certificate)
    costs = {"default": 0, "costs": [[[0, 1, 2], 1], [[0, 1, 3], 1]]}
    data["problem"] = {"objective": "costs:x", "sense": "max", "spanning": False, "costs": costs}
    return {**data, "value": 1, "bound": 1}


def test_clique_cut_strengthens_the_bound() -> None:
    assert verify(two_overlapping(bound="2")).exact_bound == 2
    verification = verify(two_overlapping(bound="1", cuts=[clique([[0, 1, 2], [0, 1, 3]])]))
    assert (verification.exact_bound, verification.proven_optimal) == (1, True)


@pytest.mark.parametrize(
    ("cut", "reason"),
    [
        (clique([[0, 1, 2], [1, 2, 3]]), r"\[0, 1, 2\] and \[1, 2, 3\] meet in a common face"),
        (
            clique([[0, 1, 2], [0, 1, 3]], coefficients=[1, 2]),
            "one simplex alone can exceed its right-hand side 1",
        ),
        (clique([[0, 1, 2], [0, 1, 3]], rhs=-1), "one simplex alone can exceed"),
        (clique([[0, 1, 2], [0, 1, 3]], multiplier="1"), "multiplier 1 of a '<=' row must not be positive"),
        (clique([[0, 1, 2], [0, 1, 4]]), r"\[0, 1, 4\] does not name 3 points"),
        (clique([[0, 1, 2], [0, 1]]), r"\[0, 1\] does not name 3 points"),
    ],
)
def test_invalid_cuts_are_refused(cut: dict[str, Any], reason: str) -> None:
    with pytest.raises(VerificationError, match=r"cut 0 of the certificate \(clique\).*" + reason):
        verify(two_overlapping(bound="1", cuts=[cut]))


def test_flat_simplex_in_a_clique_is_refused() -> None:
    sides = SideTable(ExactPoints([[0, 0], [1, 0], [2, 0], [0, 1]]))
    cut = CertificateCut("clique", ((0, 1, 2), (0, 1, 3)), (Fraction(1),) * 2, Fraction(1), Fraction(-1), {})
    with pytest.raises(VerificationError, match=r"\[0, 1, 2\] is flat"):
        check_clique(sides, cut)


def test_cuts_of_unknown_families_are_not_believed() -> None:
    cut = clique([[0, 1, 2], [1, 2, 3]], family="magic")
    verification = verify(two_overlapping(bound="1", cuts=[cut]))
    assert verification.exact_bound is None
    assert not verification.proven_optimal
    assert "was not re-checked: it uses cuts that cannot be re-checked (magic)" in verification.statement


def test_a_cut_that_takes_too_long_leaves_the_bound_unchecked(monkeypatch: pytest.MonkeyPatch) -> None:
    def tired(sides: SideTable, cut: CertificateCut) -> Fraction:
        raise UncheckedError("it takes more than 5 steps")

    monkeypatch.setitem(CUT_CHECKERS, "clique", tired)
    verification = verify(two_overlapping(bound="1", cuts=[clique([[0, 1, 2], [0, 1, 3]])]))
    assert (verification.exact_bound, verification.proven_optimal) == (None, False)
    assert verification.statement == (
        "triangulation verified, value 1; the bound of its certificate was not re-checked: "
        "cut 0 of the certificate (clique): it takes more than 5 steps; optimality rests on the run itself"
    )
    # A target beyond the bound that rows alone prove is left open in the same way.
    data = two_overlapping(bound="2")
    stage = {"multipliers": [], "cuts": [clique([[0, 1, 2], [0, 1, 3]])]}
    data["certificate"]["refutes"] = {"target": "2", "stages": [stage]}
    verification = verify(data)
    assert verification.exact_bound == 2
    assert not verification.proven_optimal
    assert (
        "bound 2 proven exactly; what its certificate proves beyond that was not re-checked: stage 0 of the "
        "certificate's refutation of 2: cut 0 of the certificate (clique): it takes more than 5 steps"
    ) in verification.statement


def test_cuts_without_multiplier_do_not_matter() -> None:
    cut = clique([[0, 1, 2], [1, 2, 3]], family="magic", multiplier="0")
    assert verify(two_overlapping(bound="2", cuts=[cut])).exact_bound == 2


@pytest.mark.parametrize(
    "changes", [{"coefficients": [1]}, {"simplices": [], "coefficients": []}, {"simplices": [[0, 1, 2]] * 2}]
)
def test_malformed_cuts(changes: dict[str, Any]) -> None:
    with pytest.raises(ResultError, match="different simplices, and a coefficient for each"):
        verify(two_overlapping(bound="1", cuts=[clique([[0, 1, 2], [0, 1, 3]], **changes)]))


@pytest.mark.parametrize("name", ["grid:3,2", "polygon:6", "cube:3", "prism:5", "cross-polytope:4"])
def test_crossings_agree_with_the_geometry_of_the_model(name: str) -> None:
    configuration = load_instance(name)
    chirotope = Chirotope.of(configuration)
    generator = np.random.default_rng(1)
    chosen = generator.permutation(len(chirotope.bases))[:40]
    expected = crossing_matrix(chirotope, chirotope.bases[chosen])
    sides = SideTable(ExactPoints(configuration.scalars()))
    simplices = [tuple(simplex) for simplex in chirotope.bases[chosen].tolist()]
    for i, j in combinations(range(len(simplices)), 2):
        assert cross(sides, simplices[i], simplices[j]) == expected[i, j]
    assert not any(cross(sides, simplex, simplex) for simplex in simplices)

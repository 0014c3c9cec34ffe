"""Proofs about regions: verification refuses what was changed, and the tree refutes what relaxations leave."""

from __future__ import annotations

import copy
import json
from itertools import combinations
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from polyhedra import CUBE, EVEN

import bcut
from bcut.bounds.proof_tree import Branch, ExactProgram, least
from bcut.errors import ResultError, VerificationError

# Verification refuses what was changed.


@pytest.fixture(scope="module")
def infeasible() -> dict[str, Any]:
    return json.loads(bcut.region("twisted-prism:4").to_json())


@pytest.fixture(scope="module")
def optimal() -> dict[str, Any]:
    return json.loads(bcut.region((CUBE, EVEN)).to_json())


def changed(data: dict[str, Any], path: str, value: Any) -> dict[str, Any]:
    data = copy.deepcopy(data)
    *parents, last = path.split(".")
    inner = data
    for key in parents:
        inner = inner[key]
    inner[last] = value
    return data


CHANGES = [
    ("volume", "1", "volume"),
    ("covered", "7/3", "cover"),
    ("status", "optimal", "status"),
    ("triangulation", [[0, 1, 2, 3]], "flat"),
    ("certificate.infeasible", {"multipliers": []}, "bound of 0"),
    ("certificate.infeasible", None, "status"),
    ("certificate.covered", {"multipliers": []}, "bound of"),
    ("certificate.covered", None, "status"),
    ("instance.digest", "0" * 64, "digest"),
]


@pytest.mark.parametrize(("path", "value", "message"), CHANGES)
def test_changed_results_are_refused(infeasible: dict[str, Any], path: str, value: Any, message: str) -> None:
    assert bcut.verify(infeasible).proven_optimal
    with pytest.raises(VerificationError, match=message):
        bcut.verify(changed(infeasible, path, value))


def test_rows_of_a_proof_must_hold(infeasible: dict[str, Any]) -> None:
    everything = list(combinations(range(8), 4))
    row = [[list(t) for t in everything], "-100000000000"]
    with pytest.raises(VerificationError, match="do not cross"):
        bcut.verify(changed(infeasible, "certificate.covered", {"multipliers": [row]}))
    multipliers = infeasible["certificate"]["covered"]["multipliers"]
    turned = [[row, value.removeprefix("-")] for row, value in multipliers]
    with pytest.raises(VerificationError, match="wrong sign"):
        bcut.verify(changed(infeasible, "certificate.covered", {"multipliers": turned}))


def test_changed_triangulations_are_refused(optimal: dict[str, Any]) -> None:
    listed = optimal["triangulation"]
    for triangulation, message in (
        (listed[1:], "cover"),
        ([*listed, listed[0]], "face to face"),
        ([*listed[1:], [0, 1, 2, 7]], "face to face|crosses the surface"),
    ):
        with pytest.raises(VerificationError, match=message):
            bcut.verify(changed(optimal, "triangulation", triangulation))
    with pytest.raises(VerificationError, match="exceed"):
        bcut.verify(changed(optimal, "certificate.cardinality", {"multipliers": []}))
    with pytest.raises(VerificationError, match="says that there is no triangulation"):
        bcut.verify(changed(optimal, "certificate.infeasible", {"multipliers": []}))
    flipped = [optimal["instance"]["faces"][0][::-1], *optimal["instance"]["faces"][1:]]
    for faces, message in (
        (flipped, "not oriented"),
        (optimal["instance"]["faces"][1:], "not closed"),
        ([face[::-1] for face in optimal["instance"]["faces"]], "wrongly oriented"),
    ):
        with pytest.raises(VerificationError, match=message):
            bcut.verify(changed(optimal, "instance.faces", faces))


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("instance.faces", 7),
        ("triangulation", [[0, 0, 1, 2]]),
        ("certificate", None),
        ("certificate.infeasible", 3),
        ("certificate.infeasible", {"multipliers": [3]}),
        ("certificate.infeasible", {"multipliers": [[[0, 1, 2], "x"]]}),
        ("volume", 3),
        ("schema", 2),
    ],
)
def test_malformed_results_are_told_as_such(infeasible: dict[str, Any], path: str, value: Any) -> None:
    with pytest.raises(ResultError):
        bcut.verify(changed(infeasible, path, value))


# The tree.


def cycle_rows(equations: bool) -> tuple[sp.csr_matrix, np.ndarray[Any, Any]]:
    matrix = np.zeros((5, 5), dtype=np.int64)
    for k in range(5):
        matrix[k, [k, (k + 1) % 5]] = 1
    crossing = (matrix.T @ matrix > 0) & ~np.eye(5, dtype=bool)
    return sp.csr_matrix(matrix), crossing


def test_an_odd_cycle_takes_a_branch() -> None:
    matrix, crossing = cycle_rows(False)
    program = ExactProgram(matrix, np.ones(5, dtype=np.int64), False, crossing, [-3] * 5)
    best, tree = least(program)
    assert best is not None
    assert len(best) == 2
    assert isinstance(tree, Branch)
    assert program.nodes > 1


def test_equations_without_integral_points_are_refuted() -> None:
    matrix, crossing = cycle_rows(True)
    program = ExactProgram(matrix, np.ones(5, dtype=np.int64), True, crossing, [1] * 5)
    best, tree = least(program)
    assert best is None
    assert isinstance(tree, Branch)

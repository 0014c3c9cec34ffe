"""Certificates that go beyond the root bound: targets that relaxations with cuts refute, stage by stage."""

from __future__ import annotations

import copy
from collections.abc import Callable
from fractions import Fraction
from functools import cache
from typing import Any

import pytest

import bcut
from bcut.errors import ResultError, VerificationError

Data = dict[str, Any]
COSTS = "costs:instances/pentagon-center-costs.json"


def pyritohedron() -> bcut.PointConfiguration:
    """Return a dodecahedron that has rational vertices and planar faces; its largest root LP is 45."""
    h = Fraction(1, 2)
    points = [[x, y, z] for x in (1, -1) for y in (1, -1) for z in (1, -1)]
    for a in (1 + h, -1 - h):
        for b in (1 - h * h, h * h - 1):
            points += [[0, a, b], [a, b, 0], [b, 0, a]]  # type: ignore[list-item]
    return bcut.PointConfiguration.from_values(points, name="pyritohedron")


@cache
def pentagon() -> bcut.Result:
    return bcut.solve("pentagon-center", objective=COSTS)


def tampered(change: Callable[[Data], None]) -> Data:
    data = copy.deepcopy(pentagon().to_dict())
    change(data["certificate"]["refutes"])
    return data


def test_a_gap_of_a_whole_unit_is_closed_exactly() -> None:
    result = pentagon()
    assert (result.root.lp, result.value) == (0, 1)
    assert result.certificate.refutes is not None
    assert result.certificate.refutes["target"] == "0"
    verification = bcut.verify(result)
    assert verification.proven_optimal
    assert any("no triangulation reaches 0" in check for check in verification.checks)


@pytest.mark.parametrize("separators", [["link"], ["clique", "odd-cycle"], ["link", "clique", "odd-cycle"]])
def test_every_family_takes_part(separators: list[str]) -> None:
    result = bcut.solve("pentagon-center", objective=COSTS, separators=separators)
    families = {
        cut["family"]
        for stage in (result.certificate.refutes or {"stages": []})["stages"]
        for cut in stage["cuts"]
    }
    assert result.value == 1
    assert families <= set(separators)
    assert bcut.verify(result).proven_optimal


def test_a_maximum_below_the_root_bound_is_proven_without_the_tree() -> None:
    result = bcut.solve(pyritohedron(), sense="max", method="listing")
    assert (result.value, result.status) == (44, "optimal")
    assert result.root.rounds[0].lp == pytest.approx(45)
    assert result.certificate.refutes is not None
    assert result.certificate.refutes["target"] == "45"
    assert bcut.verify(result).proven_optimal


def without_cuts(refutes: Data) -> None:
    for stage in refutes["stages"]:
        stage["cuts"] = []


def without_stages(refutes: Data) -> None:
    refutes["stages"] = []


def beyond_the_optimum(refutes: Data) -> None:
    refutes["target"] = "1"


def with_a_stronger_cut(refutes: Data) -> None:
    refutes["stages"][-1]["cuts"][0]["rhs"] = -1


def with_another_multiplier(refutes: Data) -> None:
    row = refutes["stages"][-1]["multipliers"][0]
    row[1] = str(Fraction(row[1]) - 3)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (without_cuts, "its stages prove the bound .* only"),
        (without_stages, "its stages prove the bound .* only"),
        (beyond_the_optimum, "stage .* refutation of 1|its stages prove the bound .* only"),
        (with_a_stronger_cut, "stage 0 of the certificate's refutation of 0: cut 0 .* is not valid"),
        (with_another_multiplier, "its stages prove the bound .* only"),
    ],
)
def test_tampering_is_refused(change: Callable[[Data], None], reason: str) -> None:
    with pytest.raises(VerificationError, match=reason):
        bcut.verify(tampered(change))


def test_a_malformed_refutation_is_named() -> None:
    with pytest.raises(ResultError, match=r"certificate\.refutes\.stages"):
        bcut.verify(tampered(lambda refutes: refutes.update(stages=3)))


def test_stages_prove_nothing_of_dissections() -> None:
    # Their rows and cuts are those of triangulations, which dissections need not satisfy.
    data = copy.deepcopy(bcut.solve("pentagon-center", objective=COSTS, dissection=True).to_dict())
    bcut.verify(data)
    data["certificate"]["refutes"] = copy.deepcopy(pentagon().to_dict())["certificate"]["refutes"]
    with pytest.raises(VerificationError, match="rows that triangulations satisfy"):
        bcut.verify(data)

"""Regular triangulations: known counts, heights checked by hand, proofs that there are none."""

from __future__ import annotations

import json
import re
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import bcut
from bcut.cli.main import run
from bcut.errors import ResultError, VerificationError
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.solving.regularity import regularity
from bcut.verification.exact_points import ExactPoints, Simplex
from bcut.verification.regularity import check_heights, check_irregularity, folds

NESTED = [[4, 0, 0], [0, 4, 0], [0, 0, 4], [2, 1, 1], [1, 2, 1], [1, 1, 2]]


def every(configuration: PointConfiguration) -> list[list[Simplex]]:
    chirotope = Chirotope.of(configuration)
    return [
        [tuple(simplex) for simplex in chirotope.bases[list(chosen)].tolist()]
        for chosen in triangulations(chirotope)
    ]


def lower_hull(points: np.ndarray, heights: list[float]) -> set[Simplex]:
    """The lower facets of lifted points, by another program in floating point."""
    hull = ConvexHull(np.column_stack((points, heights)))
    return {
        tuple(sorted(simplex))
        for simplex, plane in zip(hull.simplices.tolist(), hull.equations, strict=True)
        if plane[-2] < -1e-9
    }


@pytest.mark.parametrize(
    ("instance", "regular", "all_of_them"),
    [
        ("moae", 16, 18),
        ("cube:3", 74, 74),
        ("polygon:6", 14, 14),
        ("polygon:5,center", 16, 16),
        ("cyclic:7,3", 25, 25),
        ("cross-polytope:3", 3, 3),
        ("simplex-product:2,2", 108, 108),
    ],
)
def test_known_numbers_of_regular_triangulations(instance: str, regular: int, all_of_them: int) -> None:
    """Of the mother of all examples' 18 triangulations 16 are regular (De Loera, Rambau, Santos, Sec. 2.2)."""
    configuration = load_instance(instance)
    points = ExactPoints(configuration.scalars())
    listed = every(configuration)
    assert len(listed) == all_of_them
    found = [regularity(points, simplices) for simplices in listed]
    assert sum(answer.regular for answer in found) == regular
    for simplices, answer in zip(listed, found, strict=True):
        assert (answer.heights is None) == (answer.multipliers is not None)
        if answer.heights is not None and len(simplices) > 1:
            lifted = lower_hull(configuration.floats, [float(height) for height in answer.heights])
            assert lifted == set(simplices)


def twisted(simplices: list[Simplex]) -> bool:
    """Whether all three quadrilaterals between the nested triangles are cut in the same turning sense."""
    edges = {edge for s in simplices for edge in ((s[0], s[1]), (s[0], s[2]), (s[1], s[2]))}
    return {(0, 4), (1, 5), (2, 3)} <= edges or {(0, 5), (1, 3), (2, 4)} <= edges


def test_the_two_that_are_not_are_the_twisted_ones() -> None:
    configuration = load_instance("moae")
    points = ExactPoints(configuration.scalars())
    for simplices in every(configuration):
        uses_all = {v for simplex in simplices for v in simplex} == set(range(6))
        expected = not (uses_all and twisted(simplices) and len(simplices) == 7)
        assert regularity(points, simplices).regular == expected


def test_irregularity_in_a_number_field() -> None:
    """An affine image of the nested triangles with irrational coordinates: multipliers are in the field."""
    plane = [[a, b] for a, b, _ in NESTED]
    values = [[f"{a}*sqrt(2)", f"({b})*(1+sqrt(5))/2"] for a, b in plane]
    configuration = PointConfiguration.from_values(values)
    assert configuration.field.degree == 4
    points = ExactPoints(configuration.scalars())
    answers = [regularity(points, simplices) for simplices in every(configuration)]
    assert [answer.regular for answer in answers].count(False) == 2


def test_a_broken_symmetry_makes_the_twisted_ones_regular() -> None:
    """Turning the inner triangle one way makes one of the two regular, and leaves the other as it is."""
    values = [[4, 0], [0, 4], [0, 0], [2, "5/4"], [1, 2], ["3/4", 1]]
    configuration = PointConfiguration.from_values(values)
    points = ExactPoints(configuration.scalars())
    answers = [regularity(points, simplices).regular for simplices in every(configuration)]
    assert len(answers) == 18
    assert answers.count(False) == 1


def test_checks_refuse_wrong_heights_and_wrong_proofs() -> None:
    points = ExactPoints([[Fraction(x) for x in point] for point in ([0, 0], [1, 0], [0, 1], [1, 1])])
    simplices = [(0, 1, 2), (1, 2, 3)]
    check_heights(points, simplices, [Fraction(1), Fraction(0), Fraction(0), Fraction(1)])
    for heights in ([0, 0, 0, 0], [0, 1, 1, 0]):
        with pytest.raises(VerificationError, match=r"not strictly convex at \[1, 2\]"):
            check_heights(points, simplices, [Fraction(h) for h in heights])
    (fold,) = folds(points, simplices)
    assert fold.facet == (1, 2)
    assert fold.dependence[0] == fold.dependence[3] == -fold.dependence[1] == -fold.dependence[2] > 0
    for multipliers, message in (
        ({}, "nothing is proven"),
        ({(1, 2): Fraction(1)}, "do not cancel"),
        ({(1, 2): Fraction(-1)}, "not negative"),
        ({(0, 1): Fraction(1)}, "no inner facet"),
    ):
        with pytest.raises(VerificationError, match=message):
            check_irregularity(points, simplices, multipliers)


def test_unused_points_are_lifted_above_everything() -> None:
    found = bcut.regular(bcut.solve("moae"))
    assert found.regular
    assert found.heights is not None
    assert found.heights[3:] == (found.heights[0] + 1,) * 3
    points = ExactPoints([[Fraction(x) for x in point[:2]] for point in NESTED])
    with pytest.raises(VerificationError, match="point 3 is no vertex"):
        check_heights(points, [(0, 1, 2)], [Fraction(0)] * 6)


def irregular_result() -> Any:
    """The mother of all examples, with the triangles of a twisted triangulation required."""
    return bcut.solve("moae", spanning=True, require=[(0, 4), (1, 5), (2, 3)])


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "result.json"
    irregular_result().save(file)
    assert run(["regular", str(file)]) == 0
    assert "not regular" in capsys.readouterr().out
    assert run(["regular", str(file), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["regular"] is False
    assert data["heights"] is None
    assert {tuple(facet) for facet, _ in data["multipliers"]} >= {(0, 4), (1, 5), (2, 3)}
    bcut.solve("cube:3").save(file)
    assert run(["regular", str(file)]) == 0
    assert "regular, with the heights" in capsys.readouterr().out


def test_the_readme_has_an_irregular_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")
    solve, regular = re.findall(r"^bcut (solve moae .*|regular .*)$", text, re.MULTILINE)
    monkeypatch.chdir(tmp_path)
    assert run(solve.split()) == 0
    assert run(regular.split()) == 0
    assert "twisted.json: not regular" in capsys.readouterr().out


def test_a_result_about_a_region_is_refused_as_one() -> None:
    with pytest.raises(ResultError, match="is about a region"):
        bcut.regular(bcut.region("chazelle:1").to_dict())


def test_results_without_a_triangulation() -> None:
    with pytest.raises(ResultError, match="no triangulation in it"):
        bcut.regular(bcut.bound("cube:3"))
    data = bcut.solve("cube:3").to_dict()
    data["triangulation"] = data["triangulation"][1:]
    with pytest.raises(VerificationError, match="only triangulations can be regular"):
        bcut.regular(data)

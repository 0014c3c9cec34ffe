"""The one entry for all instances: names before files, suggestions, and what is bundled."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from point_files import written

from bcut import instances
from bcut.errors import InputError
from bcut.families import build
from bcut.files import SUFFIXES
from bcut.geometry.numbers import AlgebraicNumber, parse_number
from bcut.instance import load_instance


def test_names_are_found_before_files_without_a_suffix(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "moae").mkdir()
    (tmp_path / "cube:3").write_text("no points")
    assert load_instance("moae") == build("moae")
    assert load_instance(" cube:3 ").n == 8
    written(tmp_path, "own.csv", "0,0\n1,0\n0,1\n")
    assert load_instance("own.csv").name == load_instance(Path("own.csv")).name == "own"
    for suffix in SUFFIXES:
        with pytest.raises(InputError, match="no such file"):
            load_instance(f"cube:3{suffix}")


@pytest.mark.parametrize(
    ("text", "fragment"),
    [
        ("", "there is no instance ''; an instance is a file"),
        ("icosahedrn", "did you mean icosahedron"),
        ("cub:3", "did you mean cube"),
        ("pentagon-centre", "did you mean pentagon-center"),
        ("known-optima", "there is no instance"),
        ("no/such/file", "no such file"),
    ],
)
def test_unknown_instances_are_refused_with_suggestions(text: str, fragment: str) -> None:
    with pytest.raises(InputError, match=fragment):
        load_instance(text)


def test_every_bundled_instance_loads_under_its_name() -> None:
    assert "pentagon-center" in instances.names()
    for name in instances.names():
        assert load_instance(name).name == name
        assert load_instance(instances.path(name)).name == name
    with pytest.raises(KeyError, match="pentagon-center"):
        instances.path("nothing")


def test_the_pentagon_is_regular_and_its_costs_cover_it_once() -> None:
    configuration = load_instance("pentagon-center")
    points = configuration.scalars()
    assert points[0] == (0, 0)
    for k in range(1, 6):
        x, y = points[k]
        following = points[k % 5 + 1]
        assert x * x + y * y == 1
        assert x * following[0] + y * following[1] == parse_number("cos(2*pi/5)")
        assert x * following[1] - y * following[0] > 0

    def doubled_area(triangle: list[int]) -> AlgebraicNumber:
        (ax, ay), (bx, by), (cx, cy) = (points[i] for i in triangle)
        return abs((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))

    document = json.loads(instances.path("pentagon-center-costs").read_text(encoding="utf-8"))
    assert document["default"] == 1
    triangles = [triangle for triangle, cost in document["costs"] if cost == 0]
    assert len(triangles) == len(document["costs"]) == 10
    # Section 2.5: the ten triangles at 1/2 are a point of Formulation 2, so they cover the pentagon once.
    pentagon = sum(doubled_area([0, k, k % 5 + 1]) for k in range(1, 6))
    assert sum(doubled_area(triangle) for triangle in triangles) / 2 == pentagon

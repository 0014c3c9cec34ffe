"""What the library hands back: short texts, and results that are read again."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from own_objective import perimeter

import bcut
from bcut.cli.main import run
from bcut.errors import ResultError
from bcut.separation.cases import CASES, case
from bcut.solving.region import RegionResult

Captured = pytest.CaptureFixture[str]


# Texts.


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: bcut.solve("cube:4"), "<Result cube:4: min cardinality 16, optimal>"),
        (lambda: bcut.bound("cube:3"), "<Result cube:3: min cardinality, bound 5>"),
        (
            lambda: bcut.solve("cube:3", objective="max-min:volume", then=["cardinality"]),
            "<Result cube:3: max-min:volume 0.1666666667, then min cardinality 5, optimal>",
        ),
        (
            lambda: bcut.solve("moae", require=[[0, 4], [1, 5], [2, 3]], forbid=[[0, 1]]),
            "<Result moae: min cardinality, infeasible>",
        ),
        (lambda: bcut.load_instance("cube:4"), "<PointConfiguration cube:4: 16 points in dimension 4>"),
        (
            lambda: bcut.region("schoenhardt"),
            "<RegionResult schoenhardt: volume 866000000, covered 0, infeasible>",
        ),
        (lambda: bcut.regular(bcut.solve("cube:4")), "<Regularity: regular, by 16 heights>"),
    ],
)
def test_short_texts(call: Callable[[], object], text: str) -> None:
    assert repr(call()) == text


def test_the_value_at_a_limit_stands_beside_its_bound() -> None:
    result = bcut.solve("cube:3")
    result.status, result.value, result.bound = "limit", 6, 5
    assert repr(result) == "<Result cube:3: min cardinality 6, bound 5, stopped by a limit>"


def test_nothing_prints_pages() -> None:
    result = bcut.solve("random:12,3,seed=1", objective=perimeter, separators=["clique", "link"])
    problem = case(CASES[3]).problem
    point = bcut.FractionalPoint(problem, np.full(len(problem.simplices), 0.5))
    verified = bcut.verify(result)
    parts = (result.instance, result.problem, result.root, result.size, result.certificate)
    for thing in (result, *parts, problem, problem.formulation, point, verified, bcut.regular(result)):
        assert len(repr(thing)) < 1000
        assert "\n" not in repr(thing)
    assert len(str(result).splitlines()) < 20
    assert repr(problem) == "<Problem of polygon:7: 35 simplices>"
    assert repr(point) == "<FractionalPoint of polygon:7: 35 of 35 simplices in its support, 35 fractional>"
    assert verified.statement in repr(verified)
    assert "digest=" in repr(result.instance)


def test_a_result_reads_as_on_the_command_line(capsys: Captured, tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    assert run(["solve", "cube:3", "--then", "max:weight", "--output", str(path)]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed.pop().split() == ["written", str(path)]
    assert str(bcut.Result.load(path)).splitlines() == printed
    assert run(["region", "schoenhardt", "--output", str(path)]) == 0
    *printed, written = capsys.readouterr().out.splitlines()
    assert written == f"written to {path}"
    assert str(RegionResult.load(path)).splitlines() == printed


# Results read again.


@pytest.mark.parametrize(
    ("instance", "options"),
    [
        ("cube:4", {}),
        ("cube:4", {"method": "orbits"}),
        ("cube:3", {"method": "scip"}),
        ("cube:3", {"method": "orbits", "invariant_under": 2}),
        ("cube:4", {"time_limit": 0}),
        ("random:9,2,seed=1", {"then": [perimeter], "separators": ["clique", "odd-cycle"]}),
        ("random:10,2,seed=4", {"objective": "max-min:min-angle"}),
        ("random:30,2,seed=1", {"spanning": True, "objective": "weight", "method": "elimination"}),
        ("random:12,3,seed=1000", {"spanning": True, "separators": ["clique", "parity", "link"]}),
        ("random:12,3,seed=1000", {"spanning": True, "objective": "weight", "method": "fixing"}),
        ("moae", {"require": [[0, 4], [1, 5], [2, 3]], "forbid": [[0, 1]]}),
        ("moae", {"spanning": True, "dissection": True}),
    ],
)
def test_a_result_is_read_back_as_it_was(instance: str, options: dict[str, Any], tmp_path: Path) -> None:
    result = bcut.solve(instance, **options)
    path = tmp_path / "result.json"
    result.save(path)
    for source in (path, str(path), result.to_dict()):
        loaded = bcut.Result.load(source)
        assert loaded == result
        assert loaded.to_dict() == result.to_dict()
        assert loaded.to_json() == path.read_text()
    assert repr(loaded) == repr(result)
    assert bcut.verify(loaded).statement == bcut.verify(result).statement


def test_a_bound_and_a_region_are_read_back() -> None:
    result = bcut.bound("cube:3")
    assert bcut.Result.load(result.to_dict()) == result
    region = bcut.region("schoenhardt")
    assert RegionResult.load(region.to_dict()) == region


def test_what_was_read_is_a_copy() -> None:
    data = bcut.solve("cube:3").to_dict()
    loaded = bcut.Result.load(data)
    assert loaded.triangulation is not None
    loaded.triangulation.clear()
    loaded.certificate.multipliers = None
    assert data["triangulation"]
    assert data["certificate"]["multipliers"]


def test_entries_that_older_files_lack_have_their_defaults() -> None:
    data = bcut.solve("cube:3").to_dict()
    del data["problem"]["then"], data["then"], data["problem"]["star"]
    assert bcut.Result.load(data).problem.then == []


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("data.clear()", "has no entry 'schema'; take the file as"),
        ("data['schema'] = 2", "has schema 2, but this version of bcut reads schema 1"),
        ("del data['instance']", "has no entry 'instance'"),
        ("del data['problem']['sense']", "has no entry 'problem.sense'"),
        ("data['instance'] = []", r"'instance': this is a JSON object, not \[\]"),
        ("data['status'] = 'fine'", "'status': this is one of optimal, infeasible, .*, not \"fine\""),
        ("data['nodes'] = 'many'", "'nodes': this is an integer, not \"many\""),
        ("data['nodes'] = True", "'nodes': this is an integer, not true"),
        ("data['value'] = '5'", "'value': this is a number, not \"5\""),
        ("data['problem']['spanning'] = 0", "'problem.spanning': this is true or false, not 0"),
        ("data['triangulation'][1][0] = 0.5", r"'triangulation\[1\]\[0\]': this is an integer, not 0.5"),
        ("data['triangulation'] = {}", "'triangulation': this is a list"),
        ("data['seconds']['total'] = None", "'seconds.total': this is a number, not null"),
        ("data['seconds'] = []", "'seconds': this is a JSON object"),
        ("data['root']['rounds'] = [3]", r"'root.rounds\[0\]': this is a JSON object, not 3"),
        (
            "data['certificate']['colour'] = 1",
            "'certificate.colour', which this version of bcut does not know",
        ),
        ("data['kind'] = 'region'", "is not about a triangulation"),
    ],
)
def test_what_is_no_result_file_is_refused(change: str, message: str, tmp_path: Path) -> None:
    data = json.loads(bcut.solve("cube:3").to_json())
    exec(change, {"data": data})
    path = tmp_path / "result.json"
    path.write_text(json.dumps(data))
    with pytest.raises(ResultError, match=message) as refused:
        bcut.Result.load(path)
    assert str(refused.value).startswith(f"result file {path}: ")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "there is no such file"),
        ("{", "is not JSON"),
        ("[]", "a result is a JSON object"),
        ("NaN", "no number"),
    ],
)
def test_files_that_hold_no_result_are_refused(content: str | None, message: str, tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(ResultError, match=message):
        bcut.Result.load(path)
    with pytest.raises(ResultError, match="is not about a region"):
        RegionResult.load(bcut.solve("cube:2").to_dict())

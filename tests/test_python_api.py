"""What the library is handed: points, functions, wrong arguments."""

from __future__ import annotations

import copy
import inspect
import json
import pickle
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from own_objective import perimeter

import bcut
from bcut.cli.main import run
from bcut.errors import InputError, ObjectiveError, ResultError, SeparatorLoadError
from bcut.geometry.configuration import PointConfiguration
from bcut.objectives.syntax import FunctionText, objective_text, read_level, read_objective
from bcut.separation.cases import CASES
from bcut.separation.resolve import resolve
from bcut.separation.template import write_template
from bcut.solving.arguments import _ACCEPTED

Captured = pytest.CaptureFixture[str]

SQUARE = [[0, 0], [1, 0], [0, 1], [1, 1]]


class Table:
    """What other libraries have: not an array, but willing to become one."""

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        return np.array(SQUARE, dtype=dtype)


# Points.


@pytest.mark.parametrize(
    "points",
    [
        SQUARE,
        tuple(map(tuple, SQUARE)),
        [["0", 0], [1.0, Fraction(0)], np.array([0, 1]), (np.int8(1), "2/2")],
        np.array(SQUARE),
        np.array(SQUARE, dtype=np.float32),
        Table(),
    ],
    ids=["lists", "tuples", "mixed", "integers", "floats", "table"],
)
def test_points_are_instances(points: Any, tmp_path: Path) -> None:
    expected = PointConfiguration.from_values(SQUARE)
    assert bcut.load_instance(points) == expected
    assert bcut.solve(points).value == bcut.bound(points).bound == 2
    assert bcut.info(points).digest == expected.digest
    bcut.export(points, tmp_path / "model.lp")
    assert "x_0_1_2" in (tmp_path / "model.lp").read_text()


def test_a_configuration_is_its_own_instance() -> None:
    configuration = PointConfiguration.from_values(SQUARE, name="square")
    assert bcut.load_instance(configuration) is configuration


def test_random_points_are_the_family_of_that_name() -> None:
    points = np.random.default_rng(0).random((8, 2))
    assert bcut.load_instance(points) == bcut.load_instance("random:8,2,seed=0")
    assert bcut.solve(points).value == bcut.solve("random:8,2,seed=0").value


@pytest.mark.parametrize("call", [bcut.solve, bcut.bound, bcut.info, bcut.load_instance])
@pytest.mark.parametrize("thing", [None, 5, {"points": SQUARE}, {(0, 0), (1, 0), (0, 1)}, object()])
def test_anything_else_is_refused(call: Callable[[Any], object], thing: Any) -> None:
    with pytest.raises(
        InputError, match=rf"an instance is a family .* shape \(n, d\).*, not {type(thing).__name__}"
    ):
        call(thing)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([], "there are no points"),
        ([1, 2, 3], "point 0 .* is 1, not a list of coordinates"),
        (["cube:3"], "not a list of coordinates"),
        (np.zeros(3), r"an array of shape \(3,\) holds no points"),
        (b"cube:3", "points must be a list of coordinate lists, not bytes"),
        ([[0, 0], [1, 0], [0, None]], "coordinate 1 of point 2"),
    ],
)
def test_points_that_are_none_are_refused(points: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        bcut.load_instance(points)


# Arguments.


def test_every_argument_is_read() -> None:
    parameters = {
        *inspect.signature(bcut.solve).parameters,
        *inspect.signature(bcut.bound).parameters,
        *inspect.signature(bcut.export).parameters,
    }
    assert parameters - {"instance", "path"} == set(_ACCEPTED) - {"only_bound"}


@pytest.mark.parametrize(
    ("argument", "value", "message"),
    [
        ("objective", 5, "objective 5: give a measure such as 'weight', a function"),
        ("objective", ["weight"], "give a measure"),
        ("objective", ("max-min", "weight"), "give a measure"),
        ("objective", ("max", perimeter), "in front of a function stands min-max or max-min"),
        ("sense", 1, "sense=1: give 'min' or 'max'"),
        ("then", 5, r"then=5: give a list of objectives, such as \['cardinality', 'max:weight'\]"),
        ("then", [5], "objective 5"),
        ("then", [("best", perimeter)], "in front of a function"),
        ("formulation", 7, "unknown formulation '7': known are 0, 1, 2, chambers"),
        ("formulation", "", "unknown formulation ''"),
        ("formulation", 2.0, "formulation=2.0: give '0', '1', '2' or 'chambers'"),
        ("formulation", True, "formulation=True"),
        ("spanning", "no", "spanning='no': give True or False"),
        ("spanning", 1, "spanning=1"),
        ("dissection", None, "dissection=None: give True or False"),
        ("require", 5, r"require=5: give a list of faces, .* such as \[\[0, 1, 4\]\]"),
        ("require", [0, 1], r"require=\[0, 1\]: give a list of faces"),
        ("forbid", "0,1", "forbid='0,1': give a list of faces"),
        ("forbid", [["a"]], r"forbid \['a'\]: name points by their numbers"),
        ("star", "a", "star='a': give the number of a point"),
        ("star", 1.5, "star=1.5"),
        ("separators", 5, "separators=5: give a list of separators"),
        ("separators", "clik", "unknown separator 'clik': did you mean"),
        ("time_limit", "5", "time_limit='5': give a number of seconds"),
        ("time_limit", True, "time_limit=True"),
        ("memory_limit", "1 GB", "memory_limit='1 GB': give a number of GiB"),
        ("seed", None, "seed=None: give an integer that is not negative"),
        ("seed", 1.5, "seed=1.5"),
        ("seed", True, "seed=True"),
        ("method", None, "method=None: give the name of a method"),
        ("symmetries", 5, r"symmetries=5: give the path of a file, or a list of permutations"),
        ("symmetries", [5], r"symmetries=\[5\]"),
        ("symmetries", [[1.0, 0.0]], r"symmetries=\[\[1.0, 0.0\]\]"),
        ("invariant_under", 2.5, "invariant_under=2.5: give the order of a group, the path"),
        ("on_progress", 5, "on_progress=5: give a function that takes a dict"),
        ("cut_observer", 5, "cut_observer=5: give an object with the methods relaxed, separated and took"),
        ("cut_observer", print, "cut_observer="),
    ],
)
def test_arguments_of_the_wrong_type_are_refused_by_name(argument: str, value: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        bcut.solve("cube:2", **{argument: value})


def test_long_values_are_cut_short_in_messages() -> None:
    with pytest.raises(InputError) as refused:
        bcut.solve("cube:2", seed=list(range(10_000)))  # type: ignore[arg-type]
    assert len(str(refused.value)) < 200


@pytest.mark.parametrize("call", [bcut.verify, bcut.regular, lambda thing: bcut.plot(thing, "a.png")])
@pytest.mark.parametrize("thing", [3, None, SQUARE])
def test_what_is_no_result_is_refused(call: Callable[[Any], object], thing: Any) -> None:
    with pytest.raises(ResultError, match=f"a result is the path .*, not {type(thing).__name__}"):
        call(thing)


@pytest.mark.parametrize("thing", [5, SQUARE, (SQUARE, [], [])])
def test_what_is_no_region_is_refused(thing: Any) -> None:
    with pytest.raises(InputError, match=r"a region is a file with faces, .*\(points, triangles\)"):
        bcut.region(thing)
    with pytest.raises(InputError, match="time_limit='5'"):
        bcut.region("schoenhardt", time_limit="5")  # type: ignore[arg-type]


def test_export_refuses_as_solve_does(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="spanning='no'"):
        bcut.export("cube:2", tmp_path / "model.lp", spanning="no")  # type: ignore[arg-type]
    bcut.export("cube:2", tmp_path / "model.lp", formulation=2)
    assert (tmp_path / "model.lp").exists()


@pytest.mark.parametrize("formulation", [0, 1, 2, np.int64(2)])
def test_formulations_may_be_numbers(formulation: Any) -> None:
    result = bcut.solve("cube:2", formulation=formulation)
    assert result.problem.formulation == str(int(formulation))
    assert result.value == 2


def test_numbers_of_numpy_become_plain() -> None:
    result = bcut.solve(
        "cube:2",
        seed=np.int64(3),
        star=np.int8(2),
        time_limit=np.float32(9),
        memory_limit=np.int64(100),
        spanning=np.True_,
        require=np.array([[0, 1]]),
        then=np.array(["max:weight"]),
    )
    data = json.loads(result.to_json())["problem"]
    assert (data["seed"], data["star"], data["spanning"], data["require"]) == (3, 2, True, [[0, 1]])
    assert data["limits"] == {"time": 9.0, "memory": 100}
    assert [level["objective"] for level in data["then"]] == ["weight"]
    assert bcut.verify(json.loads(result.to_json())).value == 2


def test_what_is_one_may_stand_alone() -> None:
    alone = bcut.solve("cube:3", separators="clique", then="max:weight")
    listed = bcut.solve("cube:3", separators=["clique"], then=["max:weight"])
    assert alone.problem == listed.problem
    assert alone.problem.separators == ["clique"]
    assert alone.then[0].value == listed.then[0].value
    assert bcut.bound("cube:3", separators="clique").problem.separators == ["clique"]
    with pytest.raises(SeparatorLoadError, match="link,clique"):
        bcut.solve("cube:3", separators="link,clique")


def test_a_separator_is_checked_by_its_name_or_file(tmp_path: Path) -> None:
    few = CASES[:3]
    by_name, by_class = bcut.check_separator("link", few), bcut.check_separator(type(resolve("link")), few)
    by_name.seconds = by_class.seconds = 0
    assert by_name == by_class
    assert by_name.ok
    assert repr(by_name) == f"<CheckReport link: passed, {by_name.cuts} cuts>"
    assert str(by_name) == by_name.summary
    path = write_template("my-cuts", tmp_path)
    assert bcut.check_separator(f"{path}:max_cuts=3", few).ok


@pytest.mark.parametrize(
    ("thing", "message"),
    [
        ("clik", "unknown separator 'clik'"),
        (5, "5: give a name, a file or a subclass of bcut.Separator"),
        (resolve("link"), "not one that is made already"),
        (dict, "makes dict, no bcut.Separator"),
    ],
)
def test_what_is_no_separator_is_not_checked(thing: Any, message: str) -> None:
    with pytest.raises(SeparatorLoadError, match=message):
        bcut.check_separator(thing)


# Functions as objectives.


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.py"
    path.write_text(f"import numpy as np\nfrom typing import Any\n\n{inspect.getsource(perimeter)}")
    return path


@pytest.mark.parametrize("prefix", [None, "min-max", "max-min"])
def test_a_function_is_worth_what_its_file_is(prefix: str | None, file: Path, tmp_path: Path) -> None:
    objective = perimeter if prefix is None else (prefix, perimeter)
    found = bcut.solve("random:8,2,seed=1", objective=objective)
    from_file = bcut.solve("random:8,2,seed=1", objective=f"{prefix or ''}:{file}".lstrip(":"))
    assert found.status == "optimal"
    assert (found.value, found.bound) == (from_file.value, from_file.bound)
    assert found.triangulation == from_file.triangulation
    assert found.problem.costs == from_file.problem.costs
    assert found.problem.objective == (f"{prefix}:" if prefix else "") + "python:perimeter"
    found.save(tmp_path / "result.json")
    # The table of costs is in the file, so that the function is not called again.
    verified = bcut.verify(tmp_path / "result.json")
    assert verified.value == pytest.approx(found.value)
    assert verified.exact_bound == pytest.approx(found.value)


def test_a_function_may_decide_among_the_best() -> None:
    best = bcut.solve("random:8,2,seed=1", then=[("max", perimeter)])
    worst = bcut.solve("random:8,2,seed=1", then=perimeter)
    assert best.value == worst.value
    assert best.then[0].value > worst.then[0].value  # type: ignore[operator]
    for result, sense in ((best, "max"), (worst, "min")):
        level = result.problem.then[0]
        assert (level.objective, level.sense) == ("python:perimeter", sense)
        assert bcut.verify(result.to_dict()).further[0].value == pytest.approx(result.then[0].value)


def test_functions_of_one_name_are_not_mixed_up() -> None:
    first, second = (lambda points: points[:, 0, 0]), (lambda points: points[:, 0, 1])
    assert objective_text(first) == objective_text(second)  # type: ignore[arg-type]
    values = [
        bcut.solve("random:8,2,seed=1", objective=function).value for function in (first, second, first)
    ]
    assert values[0] == values[2] != values[1]


def test_a_function_may_be_bounded_and_exported(tmp_path: Path) -> None:
    result = bcut.bound("random:8,2,seed=1", objective=perimeter)
    assert result.bound == pytest.approx(bcut.solve("random:8,2,seed=1", objective=perimeter).value)
    bcut.export("random:8,2,seed=1", tmp_path / "model.lp", objective=perimeter)
    with pytest.raises(InputError, match="a model file takes sums only; write python:perimeter"):
        bcut.export("random:8,2,seed=1", tmp_path / "model.lp", objective=("max-min", perimeter))


def test_what_a_function_does_wrong_is_told_as_its_own() -> None:
    with pytest.raises(
        ObjectiveError, match=r"'python:.*<lambda>': <lambda>\(\) raised ZeroDivisionError"
    ) as raised:
        bcut.solve("cube:2", objective=lambda points: 1 / 0)
    assert "ZeroDivisionError" in raised.value.trace
    with pytest.raises(ObjectiveError, match=r"returned an array of shape \(\) for 4 simplices"):
        bcut.solve("cube:2", objective=lambda points: 1)


def test_a_name_alone_is_no_function(capsys: Captured) -> None:
    with pytest.raises(
        InputError, match=r"'python:perimeter' .* only the name is known here; .* ./mine.py:perimeter"
    ):
        bcut.solve("cube:2", objective="python:perimeter")
    assert run(["solve", "cube:2", "--objective", "min-max:python:perimeter"]) == 2
    assert "only the name is known here" in capsys.readouterr().err


def test_the_text_of_a_function_carries_it_and_is_plain_in_copies() -> None:
    text = FunctionText.of(perimeter, "max-min")
    name = read_objective(text)
    assert (name.text, name.measure, name.sense) == ("max-min:python:perimeter", "python:perimeter", "max")
    assert isinstance(name.measure, FunctionText)
    assert name.measure.function is perimeter
    level = read_level(("max", perimeter))
    assert (level.text, level.sense) == ("python:perimeter", "max")
    assert isinstance(level.measure, FunctionText)
    for copied in (copy.deepcopy(text), pickle.loads(pickle.dumps(text)), str(text)):
        assert type(copied) is str
        assert copied == text

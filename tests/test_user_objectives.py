"""A user's objective: one function in one file, from any folder; what goes wrong in it is told as its own."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bcut
from bcut.cli.main import run
from bcut.errors import InputError, ObjectiveError, ObjectiveLoadError, ResultError, VerificationError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.objectives.objective import Bottleneck, make_objective
from bcut.objectives.syntax import MeasureName, read_level, read_objective
from bcut.solving import embedding

Captured = pytest.CaptureFixture[str]

PERIMETER = """
import numpy as np

def _length(a, b):
    return np.sqrt(((a - b) ** 2).sum(axis=-1))

def perimeter(points):
    k = points.shape[1]
    return sum(_length(points[:, i], points[:, j]) for i in range(k) for j in range(i))
"""


@pytest.fixture
def perimeter(tmp_path: Path) -> Path:
    file = tmp_path / "mine.py"
    file.write_text(PERIMETER)
    return file


def perimeters(points: Any) -> Any:
    k = points.shape[1]
    lengths = [np.linalg.norm(points[:, i] - points[:, j], axis=1) for i in range(k) for j in range(i)]
    return sum(lengths)


@pytest.mark.parametrize("form", ["{}", "min-max:{}", "max-min:{}", "{}:perimeter", "max-min:{}:perimeter"])
def test_a_function_in_sums_and_bottlenecks(form: str, perimeter: Path) -> None:
    configuration = load_instance("random:7,2,seed=4")
    formulation = cocircuit_formulation(configuration)
    costs = perimeters(configuration.floats[formulation.simplices])
    found = [costs[list(columns)] for columns in triangulations(formulation.chirotope)]
    if form.startswith("min-max"):
        best = min(part.max() for part in found)
    elif form.startswith("max-min"):
        best = max(part.min() for part in found)
    else:
        best = min(part.sum() for part in found)
    result = bcut.solve(configuration, objective=form.format(perimeter))
    assert result.status == "optimal"
    assert result.value == pytest.approx(best, rel=1e-12)
    perimeter.unlink()
    checked = bcut.verify(result)
    assert checked.value is not None
    assert float(checked.value) == result.value
    assert checked.exact_bound is not None


def test_a_file_from_another_folder(
    perimeter: Path, tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert run(["solve", "random:8,2,seed=1", "--objective", "max-min:../mine.py", "--output", "r.json"]) == 0
    assert "max-min:../mine.py over all triangulations" in capsys.readouterr().out
    perimeter.write_text("raise RuntimeError('verification must not run this')")
    assert run(["verify", "r.json"]) == 0
    assert "optimal, proven exactly" in capsys.readouterr().out


def test_new_writes_a_measure_that_works(
    tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["objectives", "new", "longest-edge"]) == 0
    path = capsys.readouterr().out.strip()
    assert Path(path) == tmp_path / "longest_edge.py"
    assert run(["objectives", "new", "longest-edge"]) == 2
    assert "exists already" in capsys.readouterr().err
    configuration = load_instance("random:8,3,seed=1")
    formulation = cocircuit_formulation(configuration)
    costs = make_objective(f"min-max:{path}", formulation).costs
    corners = configuration.floats[formulation.simplices]
    longest = [max(np.linalg.norm(a - b) for a in simplex for b in simplex) for simplex in corners]
    np.testing.assert_allclose(costs, longest, rtol=1e-14)


@pytest.mark.parametrize("name", ["Weight", "a_b", "", "weight", "-x", "../x"])
def test_bad_names_for_a_new_measure(name: str, capsys: Captured, tmp_path: Path) -> None:
    assert run(["objectives", "new", "--", name]) == 2
    assert f"objective name '{name}'" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_list_of_measures(capsys: Captured) -> None:
    assert run(["objectives", "list", "--json"]) == 0
    entries = {entry["name"]: entry["description"] for entry in json.loads(capsys.readouterr().out)}
    assert {"cardinality", "weight", "volume", "aspect-ratio", "min-angle"} < set(entries)
    assert run(["objectives", "list"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    for name, description in entries.items():
        assert description.endswith("."), name
        assert f"{name} {description}" in text


# What goes wrong.

RAISING = "def cost(points):\n    raise RuntimeError('no idea')\n"
BAD = [
    ("cost", RAISING, r"cost\(\) raised RuntimeError: no idea"),
    (
        "cost",
        "def cost(points):\n    return 3\n",
        r"returned an array of shape \(\) for 4 simplices; expected",
    ),
    ("cost", "def cost(points):\n    return points[:, 0]\n", r"returned an array of shape \(4, 2\)"),
    ("cost", "def cost(points):\n    return [1, 2]\n", r"returned an array of shape \(2,\)"),
    ("cost", "def cost(points):\n    return points[:, 0, 0] * float('nan')\n", r"returned nan for simplex"),
    (
        "cost",
        "import numpy\ndef cost(points):\n    return numpy.array([1, 2, numpy.inf, 3])\n",
        r"returned inf for simplex \[0, 2, 3\]",
    ),
    ("cost", "def cost(points):\n    return ['a'] * len(points)\n", r"returned entries of type <U1"),
    ("cost", "def cost(points):\n    return points[:, 0, 0] * 1j\n", r"returned entries of type complex128"),
    ("cost", "import sys\nsys.exit(3)\n", r"loading it raised SystemExit: 3"),
    ("cost", "def cost(points):\n    import sys\n    sys.exit(3)\n", r"cost\(\) raised SystemExit: 3"),
    ("cost", "def cost(points):\n    return [[1], [2, 3]] * 2\n", r"cost\(\) raised ValueError"),
]


@pytest.mark.parametrize(("name", "text", "message"), BAD)
@pytest.mark.parametrize("form", ["{}", "min-max:{}"])
def test_what_a_function_does_wrong(name: str, text: str, message: str, form: str, tmp_path: Path) -> None:
    file = tmp_path / "bad.py"
    file.write_text(text)
    with pytest.raises(ObjectiveError, match=message) as caught:
        bcut.solve("cube:2", objective=form.format(file))
    assert str(file) in str(caught.value)
    assert ("raised" in message) == bool(caught.value.trace)


def test_a_function_that_raises_is_named_with_its_own_traceback(tmp_path: Path, capsys: Captured) -> None:
    file, output = tmp_path / "raising.py", tmp_path / "result.json"
    file.write_text(RAISING)
    assert run(["solve", "cube:2", "--objective", str(file), "--output", str(output)]) == 5
    captured = capsys.readouterr()
    assert not captured.out
    assert "raise RuntimeError('no idea')" in captured.err
    assert captured.err.strip().splitlines()[-1] == (
        f"Error: objective '{file}': cost() raised RuntimeError: no idea"
    )
    assert not output.exists()


@pytest.mark.parametrize(
    ("file", "text", "wanted", "message"),
    [
        ("none.py", None, "", r"none\.py: there is no such file"),
        ("mine.txt", "x", "", r"mine\.txt: not a Python file"),
        ("mine.py", "x = 3\n", "", r"mine\.py: it defines no function; write one that takes"),
        (
            "mine.py",
            "def a(x): ...\ndef b(x): ...\n",
            "",
            r"it defines a, b; say which by .*mine\.py:FUNCTION",
        ),
        ("mine.py", "def a(x): ...\n", ":c", r"mine\.py: it has no function 'c'; it has a"),
        ("mine.py", "c = 3\n", ":c", r"mine\.py: it has no function 'c'$"),
    ],
)
def test_files_without_a_function(
    file: str, text: str | None, wanted: str, message: str, tmp_path: Path
) -> None:
    path = tmp_path / file
    if text is not None:
        path.write_text(text)
    with pytest.raises(ObjectiveLoadError, match=message):
        bcut.solve("cube:2", objective=f"{path}{wanted}")


def test_integers_stay_integers(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(
        "def three(points):\n    return [3] * len(points)\n\ndef large(points):\n    return [2**50] * len(points)\n"
    )
    formulation = cocircuit_formulation(load_instance("cube:2"))
    three, large = (make_objective(f"{file}:{name}", formulation) for name in ("three", "large"))
    assert three.fits_64_bits
    assert three.value([0, 1]) == 6
    assert not large.fits_64_bits
    assert large.value([0, 1]) == 2**51
    result = bcut.solve("cube:2", objective=f"{file}:three")
    assert (result.value, result.bound) == (6, 6)
    assert bcut.verify(result).proven_optimal


def test_a_function_may_change_what_it_is_given(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text("def first(points):\n    points *= 0\n    return points[:, 0, 0] + 1\n")
    configuration = load_instance("random:6,2,seed=1")
    before = configuration.floats.copy()
    assert bcut.solve(configuration, objective=str(file)).value is not None
    assert np.array_equal(configuration.floats, before)


# Result files hold the costs.


def test_costs_in_the_file_are_those_that_count(perimeter: Path) -> None:
    data = bcut.solve("random:6,2,seed=1", objective=str(perimeter)).to_dict()
    simplex = data["triangulation"][0]
    entry = next(entry for entry in data["problem"]["costs"]["costs"] if entry[0] == simplex)
    entry[1] += 1
    with pytest.raises(VerificationError, match="claims the value"):
        bcut.verify(data)
    data["problem"]["costs"]["costs"].remove(entry)
    with pytest.raises(VerificationError, match=r"the cost of simplex \[.*\] is not in the file"):
        bcut.verify(data)
    data["problem"]["costs"] = None
    with pytest.raises(ResultError, match=r"problem\.costs is missing"):
        bcut.verify(data)


@pytest.mark.parametrize("form", ["{}", "max-min:{}"])
def test_of_many_simplices_only_those_of_the_triangulation_are_written(
    form: str, perimeter: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(embedding, "MAX_COSTS", 10)
    result = bcut.solve("random:7,2,seed=1", objective=form.format(perimeter))
    assert result.problem.costs is not None
    assert [entry[0] for entry in result.problem.costs["costs"]] == sorted(
        result.triangulation or [], key=lambda simplex: simplex[::-1]
    )
    checked = bcut.verify(result)
    assert not checked.proven_optimal
    assert checked.exact_bound is None
    assert "was not re-checked: the cost of simplex" in checked.statement


# How objectives are written.


@pytest.mark.parametrize(
    ("text", "source", "argument"),
    [
        ("cardinality", "cardinality", ""),
        ("costs:a:b.json", "costs", "a:b.json"),
        ("costs:./mine.py", "costs", "./mine.py"),
        ("random-costs:7", "random-costs", "7"),
        ("mine.py", "mine.py", ""),
        ("./mine.py:f", "./mine.py", "f"),
        ("/a:b/mine.py:f", "/a:b/mine.py", "f"),
        ("C:\\mine.py:f", "C:\\mine.py", "f"),
    ],
)
def test_measures_are_split(text: str, source: str, argument: str) -> None:
    name = MeasureName.parse(text)
    assert (name.source, name.argument) == (source, argument)
    assert name.is_file == ("mine.py" in source)


def test_senses() -> None:
    assert read_objective("weight").sense == "min"
    assert read_objective("weight", "max").sense == "max"
    assert read_objective("min-max:weight").sense == read_objective("min-max:weight", "min").sense == "min"
    assert read_objective("max-min:weight").sense == read_objective("max-min:weight", "max").sense == "max"
    assert (read_level("max:weight").text, read_level("max:weight").sense) == ("weight", "max")
    assert read_level("max:max-min:volume").measure == "volume"
    formulation = cocircuit_formulation(load_instance("cube:2"))
    assert isinstance(make_objective("min-max:weight", formulation), Bottleneck)


@pytest.mark.parametrize(
    ("text", "sense", "message"),
    [
        ("min-max:weight", "max", r"contradict each other: min-max is a minimum.*write max-min:weight"),
        ("max-min:weight", "min", r"contradict each other: max-min is a maximum.*write min-max:weight"),
        ("min-max", None, r"name the measure behind the colon, as in min-max:aspect-ratio"),
        ("min-max:", None, r"name the measure"),
        ("max-min:min-max:weight", None, r"name the measure"),
        ("weight", "least", r"sense 'least': it is 'min' or 'max'"),
    ],
)
def test_contradictions_are_refused(text: str, sense: str | None, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_objective(text, sense)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--objective", "max-min:weight", "--sense", "min"], "contradict each other"),
        (["--objective", "min-max:beauty"], "unknown objective 'beauty'"),
        (["--objective", "min-angle"], "is for triangles"),
        (["--objective", "weight", "--then", "cardinality"], "too close to each other"),
        (["--then", "max:min-max:weight"], "contradict each other"),
        (["--then", "beauty"], "unknown objective 'beauty'"),
        (
            ["--objective", "min-max:weight", "--method", "scip"],
            "method 'scip' does not work with a bottleneck",
        ),
        (
            ["--then", "weight", "--method", "orbits"],
            "method 'orbits' does not work with one objective after",
        ),
    ],
)
def test_the_command_line_refuses(arguments: list[str], message: str, capsys: Captured) -> None:
    assert run(["solve", "random:7,3,seed=1", *arguments]) == 2
    captured = capsys.readouterr()
    assert not captured.out
    assert message in captured.err


def test_a_model_file_needs_a_sum(tmp_path: Path, capsys: Captured) -> None:
    file = tmp_path / "model.lp"
    assert run(["export", "cube:3", str(file), "--objective", "min-max:weight"]) == 2
    assert "a model file takes sums only; write weight" in capsys.readouterr().err
    assert run(["export", "cube:3", str(file), "--objective", "weight", "--sense", "max"]) == 0
    assert "x_0_1_2_4" in file.read_text()

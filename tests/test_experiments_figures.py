"""Figures of experiments: the plan of one, its runs and their measures, its tables and its drawing."""

from __future__ import annotations

import csv
import json
import re
import xml.etree.ElementTree as ElementTree
from fractions import Fraction
from itertools import combinations
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pytest
from laboratory import carried_out, plan_file, tasks_from

import bcut
from bcut.cli.main import run
from bcut.experiments.measuring import value_at
from bcut.experiments.plan import read_plan
from bcut.experiments.reporting.measures import figures
from bcut.experiments.reporting.report import write_report
from bcut.experiments.reporting.runs import load_experiment
from bcut.experiments.reporting.tables import all_tables
from bcut.instance import load_instance
from bcut.solving.delaunay import delaunay_triangulation

MEASURES = ("cardinality", "weight", "min-max:aspect-ratio")
OBJECTIVES = {"W": "weight", "C": "cardinality", "AR": "min-max:aspect-ratio"}

PLAN = """
name = "four triangulations"
measures = ["cardinality", "weight", "min-max:aspect-ratio"]
preset = "solve"
spanning = true
[[instances]]
instance = "random:{n},3,seed={s}"
class = "{n} points"
for = { n = [7, 8], s = "0..1" }
[[variants]]
name = "D"
preset = "delaunay"
[[variants]]
name = "W"
objective = "weight"
[[variants]]
name = "C"
[[variants]]
name = "AR"
objective = "min-max:aspect-ratio"
[[figures]]
name = "weights"
measure = "weight"
label = "total area"
caption = "Weight & more."
[[figures]]
name = "worst"
measure = "min-max:aspect-ratio"
variants = ["AR", "D"]
scale = "log"
"""

Table = list[dict[str, Any]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return carried_out(tmp_path_factory.mktemp("figures"), PLAN).folder


@pytest.fixture(scope="module")
def tables(folder: Path) -> dict[str, Table]:
    return all_tables(load_experiment(folder))


@pytest.fixture(scope="module")
def by_run(folder: Path) -> dict[tuple[str, str], dict[str, Any]]:
    return {(r.entry["instance"], r.variant): r.record for r in load_experiment(folder).runs}


# Runs.


def area(points: np.ndarray, triangle: tuple[int, ...]) -> float:
    a, b, c = points[list(triangle)]
    return float(np.linalg.norm(np.cross(b - a, c - a)) / 2)


def ratio_of_radii(corners: np.ndarray) -> float:
    edges = corners[1:] - corners[0]
    centre = np.linalg.solve(2 * edges, (edges**2).sum(axis=1))
    surface = sum(area(corners, triangle) for triangle in combinations(range(4), 3))
    return float(np.linalg.norm(centre) * surface / (abs(np.linalg.det(edges)) / 2))


def test_measures_are_those_of_the_triangulation_in_the_record(
    by_run: dict[tuple[str, str], dict[str, Any]],
) -> None:
    assert len(by_run) == 16
    for (instance, _), record in by_run.items():
        points = load_instance(instance).floats
        simplices = record["triangulation"]
        triangles = {face for simplex in simplices for face in combinations(simplex, 3)}
        assert list(record["measures"]) == list(MEASURES)
        assert record["measures"]["cardinality"] == len(simplices)
        assert record["measures"]["weight"] == pytest.approx(sum(area(points, t) for t in triangles))
        worst = max(ratio_of_radii(points[simplex]) for simplex in simplices)
        assert record["measures"]["min-max:aspect-ratio"] == pytest.approx(worst)
        assert {vertex for simplex in simplices for vertex in simplex} == set(range(len(points)))


def test_each_variant_is_the_optimum_that_solve_finds(
    by_run: dict[tuple[str, str], dict[str, Any]],
) -> None:
    for (instance, variant), record in by_run.items():
        outcome = record["outcome"]
        if variant == "D":
            assert (outcome["status"], outcome["bound"]) == ("verified", None)
            assert outcome["value"] == record["measures"]["cardinality"]
            continue
        objective = OBJECTIVES[variant]
        direct = bcut.solve(instance, objective=objective, spanning=True)
        assert (outcome["status"], record["problem"]["objective"]) == ("optimal", objective)
        assert outcome["value"] == record["measures"][objective] == pytest.approx(direct.value, rel=1e-12)
        assert outcome["bound"] == pytest.approx(direct.value, rel=1e-9)
        # Nothing is better than the optimum.
        for other in "D", *OBJECTIVES:
            assert by_run[instance, other]["measures"][objective] >= outcome["value"]


def lifted_sign(points: list[tuple[Fraction, ...]], simplex: list[int], other: int) -> int:
    """Tell whether a point is inside the sphere through four others (1), on it (0) or outside."""
    rows = [[x - y for x, y in zip(points[i], points[other], strict=True)] for i in simplex]
    lifted = [[*row, sum(x * x for x in row)] for row in rows]
    turn = determinant([[a - b for a, b in zip(row, rows[3], strict=True)] for row in rows[:3]])
    value = determinant(lifted) * (1 if turn > 0 else -1)
    return (value > 0) - (value < 0)


def determinant(rows: list[list[Fraction]]) -> Fraction:
    if len(rows) == 1:
        return rows[0][0]
    minors = ([row[:k] + row[k + 1 :] for row in rows[1:]] for k in range(len(rows)))
    return sum(((-1) ** k * rows[0][k] * determinant(minor) for k, minor in enumerate(minors)), Fraction(0))


def test_no_point_is_inside_a_sphere_of_the_delaunay_triangulation(
    by_run: dict[tuple[str, str], dict[str, Any]],
) -> None:
    seen = []
    for (instance, variant), record in by_run.items():
        points = [tuple(Fraction(x) for x in row) for row in load_instance(instance).floats.tolist()]
        signs = [
            lifted_sign(points, simplex, other)
            for simplex in record["triangulation"]
            for other in range(len(points))
            if other not in simplex
        ]
        if variant == "D":
            assert set(signs) == {-1}
        seen += [variant] * (1 in signs)
    # The test can tell: some of the others are not Delaunay.
    assert set(seen) == {"W", "C", "AR"}


def test_plans_that_differ_in_their_figures_share_their_runs(tmp_path: Path) -> None:
    first = [task.fingerprint for task in tasks_from(tmp_path, PLAN)]
    other = PLAN[: PLAN.index("[[figures]]")]
    assert [task.fingerprint for task in tasks_from(tmp_path, other)] == first
    fewer = other.replace('["cardinality", "weight", "min-max:aspect-ratio"]', '["cardinality"]')
    assert not set(first) & {task.fingerprint for task in tasks_from(tmp_path, fewer)}


def test_the_figures_of_the_paper_share_their_runs() -> None:
    place = Path(__file__).resolve().parent.parent / "experiments"
    plans = [read_plan(place / f"figure-{number}.toml") for number in (5, 6, 7)]
    first = plans[0]
    for plan, measure in zip(plans, MEASURES, strict=True):
        assert (plan.cases, plan.variants, plan.measures) == (first.cases, first.variants, MEASURES)
        assert [drawing.measure for drawing in plan.drawings] == [measure]
    assert len(first.cases) * len(first.variants) == 120
    assert all(case.spanning for case in first.cases)


# Report.


def row(table: Table, **wanted: Any) -> dict[str, Any]:
    (found,) = [r for r in table if all(r[key] == value for key, value in wanted.items())]
    return found


def test_the_table_has_mean_median_range_and_ratio(
    tables: dict[str, Table], by_run: dict[tuple[str, str], dict[str, Any]]
) -> None:
    assert len(tables["measures"]) == 3 * 2 * 4
    assert len(tables["measured"]) == 3 * 16
    for found in tables["measures"]:
        points = found["class"].split()[0]
        names = [f"random:{points},3,seed={seed}" for seed in (0, 1)]
        values = [by_run[name, found["variant"]]["measures"][found["measure"]] for name in names]
        least = [
            min(by_run[name, other]["measures"][found["measure"]] for other in ("D", *OBJECTIVES))
            for name in names
        ]
        assert (found["runs"], found["proven"]) == (2, None if found["variant"] == "D" else 2)
        assert found["mean"] == pytest.approx(sum(values) / 2)
        assert found["median"] == pytest.approx(median(values))
        assert (found["smallest"], found["largest"]) == (min(values), max(values))
        ratios = [value / smallest for value, smallest in zip(values, least, strict=True)]
        assert (found["ratio"], found["largest_ratio"]) == (pytest.approx(sum(ratios) / 2), max(ratios))
    assert row(tables["measures"], measure="weight", variant="W", **{"class": "8 points"})["ratio"] == 1


def test_the_report_has_the_figures_that_the_plan_asks_for(folder: Path, tmp_path: Path) -> None:
    written = {path.name: path for path in write_report(folder, tmp_path)}
    page = written["report.html"].read_text(encoding="utf-8")
    assert "Weight &amp; more. A line for each instance" in page
    for name, panels, variants in (("weights", 2, ["D", "W", "C", "AR"]), ("worst", 2, ["AR", "D"])):
        text = written[f"{name}.svg"].read_text(encoding="utf-8")
        assert text in page
        root = ElementTree.fromstring(text)
        assert root.tag.endswith("svg")
        labels = [element.text for element in root.iter() if element.tag.endswith("text")]
        assert [label for label in labels if label in ("D", "W", "C", "AR")] == variants * panels
        assert {"7 points", "8 points"} <= set(labels)
    assert {"measures.csv", "measured.parquet"} <= set(written)


def test_what_is_not_proven_is_hollow(folder: Path, tmp_path: Path) -> None:
    experiment = load_experiment(folder)
    proven = figures(experiment)
    assert "Hollow" not in proven[0].caption
    for found in experiment.runs:
        if found.variant == "W":
            found.record["outcome"]["status"] = "limit"
    hollow = figures(experiment)
    assert hollow[0].caption.endswith("Hollow: not proven optimal.")
    assert hollow[0].svg != proven[0].svg
    # The second figure does not show this variant.
    assert (hollow[1].caption, hollow[1].svg) == (proven[1].caption, proven[1].svg)


def test_the_commands_go_from_a_plan_to_a_figure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    small = PLAN.replace("n = [7, 8]", "n = [6]").replace('name = "weights"', 'name = "areas"')
    path, out = plan_file(tmp_path, small), tmp_path / "out"
    assert run(["experiment", "run", str(path), "--output", str(out)]) == 0
    assert "8 runs, 0 stored before, 8 done, 0 failed" in capsys.readouterr().out
    assert run(["experiment", "report", str(out)]) == 0
    assert (out / "report" / "areas.svg").exists()
    path.write_text(small.replace('name = "areas"', 'name = "again"'), encoding="utf-8")
    assert run(["experiment", "run", str(path), "--output", str(out)]) == 0
    assert "8 runs, 8 stored before, 0 done, 0 failed" in capsys.readouterr().out
    assert json.loads((out / "experiment.json").read_text())["figures"][0]["name"] == "again"


# The page.

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "docs" / "figures.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def published() -> dict[tuple[str, str], dict[str, str]]:
    with (ROOT / "docs" / "figures.csv").open(encoding="utf-8", newline="") as stream:
        return {(line["instance"], line["variant"]): line for line in csv.DictReader(stream)}


def test_all_optima_of_the_page_are_proven(published: dict[tuple[str, str], dict[str, str]]) -> None:
    names = [f"random:{n},3,seed={s}" for n in (10, 20, 30) for s in range(10)]
    assert set(published) == {(name, variant) for name in names for variant in ("D", *OBJECTIVES)}
    for (_, variant), line in published.items():
        assert line["status"] == ("verified" if variant == "D" else "optimal")
        if variant != "D":
            assert float(line[OBJECTIVES[variant]]) == pytest.approx(float(line["bound"]), rel=1e-9)
    assert "**90 of the 90 optima of W, C and AR are proven**" in " ".join(PAGE.split())


def test_the_tables_of_the_page_are_those_of_the_runs(
    published: dict[tuple[str, str], dict[str, str]],
) -> None:
    tables = re.findall(r"\| points \|.*\n\|--:.*\n((?:\| \d+ \|.*\n)+)", PAGE)
    assert len(tables) == 3
    for measure, text in zip(MEASURES, tables, strict=True):
        lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines()]
        assert len(lines) == 12
        for points, variant, *cells in lines:
            values = [
                float(line[measure])
                for (name, kind), line in published.items()
                if kind == variant and name.startswith(f"random:{points},")
            ]
            assert len(values) == 10
            wanted = (sum(values) / 10, median(values), min(values), max(values))
            for cell, value in zip(cells[:4], wanted, strict=True):
                digits = len(cell.partition(".")[2])
                assert float(cell.replace(",", "")) == pytest.approx(value, abs=0.51 * 10**-digits)
            assert cells[4] == ("" if variant == "D" else "10 of 10")


@pytest.mark.parametrize("instance", ["random:10,3,seed=4", "random:10,3,seed=8", "random:20,3,seed=1"])
def test_runs_of_the_page_can_be_repeated(
    published: dict[tuple[str, str], dict[str, str]], instance: str
) -> None:
    for variant, objective in OBJECTIVES.items():
        value = bcut.solve(instance, objective=objective, spanning=True).value
        assert value == pytest.approx(float(published[instance, variant][objective]), rel=1e-12)
    configuration = load_instance(instance)
    delaunay = delaunay_triangulation(configuration)
    for measure in MEASURES:
        assert value_at(configuration, delaunay, measure) == pytest.approx(
            float(published[instance, "D"][measure]), rel=1e-12
        )

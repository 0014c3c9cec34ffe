"""Objectives that variants bring, and measures of every triangulation, wherever it comes from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from laboratory import carried_out, plan_file, tasks_from

import bcut
from bcut.errors import InputError, PlanError, SolverError, VerificationError
from bcut.experiments.execute import carry_out
from bcut.experiments.measuring import measured_at, value_at
from bcut.experiments.plan import read_plan
from bcut.experiments.reporting.measures import figures
from bcut.experiments.reporting.report import write_report
from bcut.experiments.reporting.runs import load_experiment
from bcut.geometry.configuration import PointConfiguration
from bcut.instance import load_instance
from bcut.objectives.template import template
from bcut.solving.delaunay import delaunay_triangulation
from bcut.verification.delaunay import check_delaunay

# Variants with an objective of their own.


def test_a_variant_brings_its_objective_with_its_sense(tmp_path: Path) -> None:
    text = """
    sense = "max"
    objective = "volume"
    [[instances]]
    instance = "random:7,3,seed=1"
    optimum = 3
    spanning = true
    [[variants]]
    name = "of the plan"
    preset = "solve"
    [[variants]]
    name = "fewest"
    preset = "solve"
    objective = "cardinality"
    [[variants]]
    name = "most"
    preset = "solve"
    objective = "cardinality"
    sense = "max"
    [[variants]]
    name = "the same"
    preset = "solve"
    objective = "volume"
    sense = "max"
    [[variants]]
    name = "angles"
    preset = "solve"
    objective = "max-min:dihedral-angle"
    """
    tasks = tasks_from(tmp_path, text)
    assert [(t.case.objective, t.case.sense, t.case.optimum) for t in tasks] == [
        ("volume", "max", 3),
        ("cardinality", "min", None),
        ("cardinality", "max", None),
        ("volume", "max", 3),
        ("max-min:dihedral-angle", "max", None),
    ]
    assert tasks[0].fingerprint == tasks[3].fingerprint
    assert len({task.fingerprint for task in tasks}) == 4
    for task in (tasks[1], tasks[2], tasks[4]):
        record, _ = carry_out(task.data)
        direct = bcut.solve(
            "random:7,3,seed=1", objective=task.case.objective, sense=task.case.sense, spanning=True
        )
        assert (record["outcome"]["status"], record["outcome"]["value"]) == ("optimal", direct.value)
        # Nobody asked for measures.
        assert not {"measures", "triangulation"} & set(record)


def test_an_objective_of_a_variant_has_no_optimum_to_cut_off_at(tmp_path: Path) -> None:
    text = '[[instances]]\ninstance = "cube:3"\noptimum = 5\n[[variants]]\nname = "a"\ncutoff = true\n'
    assert tasks_from(tmp_path, text)[0].data["problem"]["cutoff"] == "5"
    with pytest.raises(InputError, match=r"that of cube:3 is not known"):
        tasks_from(tmp_path, text + 'objective = "weight"\n')


def test_an_ablation_keeps_the_objective_of_its_plan(tmp_path: Path) -> None:
    text = """
    objective = "weight"
    sense = "max"
    protocol = "ablation"
    separators = ["link", "clique"]
    [[instances]]
    instance = "cube:3"
    """
    plan = read_plan(plan_file(tmp_path, text))
    assert {(v.objective, v.sense) for v in plan.variants} == {("", "")}
    assert {(t.case.objective, t.case.sense) for t in tasks_from(tmp_path, text)} == {("weight", "max")}


GOOD = '[[instances]]\ninstance = "cube:3"\n[[variants]]\nname = "a"\n'
FIGURE = '[[figures]]\nname = "f"\nmeasure = "weight"\n'
MEASURED = 'measures = ["weight"]\n'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('measures = ["wait"]\n' + GOOD, r"line 1: 'measures' cannot be used: unknown .* 'wait': did you mean 'weigh"),
        ('measures = ["max:weight"]\n' + GOOD, r"line 1: 'measures' cannot be used: unknown objective 'max'"),
        ('measures = ["min-max:"]\n' + GOOD, r"line 1: 'measures' cannot be used: .*name the measure behind the colon"),
        ('measures = "weight"\n' + GOOD, r"line 1: 'measures' is a list of texts"),
        ('measures = ["weight", "weight"]\n' + GOOD, r"line 1: 'measures' has 'weight' twice"),
        (GOOD + 'objective = "wait"\n', r"line 5: .*variants.* number 1, 'objective' cannot be used: unknown obj"),
        (GOOD + 'sense = "max"\n', r"line 5: .*'sense' belongs to an objective of this variant: write 'objective'"),
        (
            GOOD + 'preset = "solve"\nobjective = "min-max:volume"\nsense = "max"\n',
            r"line 7: .*'sense' cannot be used: .*contradict each other",
        ),
        (GOOD + 'objective = "min-max:volume"\n', r"line 5: .*for presets solve and delaunay, not 'loop'"),
        (
            '[[instances]]\ninstance = "cube:3"\nobjective = "wait"\n[[variants]]\nname = "a"\n',
            r"line 3: .*instances.* number 1, 'objective' cannot be used: unknown objective 'wait'",
        ),
        (
            '[[instances]]\ninstance = "cube:3"\nsense = "max"\nobjective = "min-max:volume"\n'
            '[[variants]]\nname = "a"\n',
            r"line 3: .*instances.* number 1, 'sense' cannot be used: .*contradict each other",
        ),
        (GOOD + 'preset = "delaunay"\nseparators = ["link"]\n', r"line 6: .*no meaning with preset 'delaunay'"),
        ('protocol = "ablation"\npreset = "delaunay"\n' + GOOD, r"line 2: 'preset' 'delaunay' has no separators"),
        (GOOD + FIGURE, r"line 7: .*figures.* number 1, 'measure' needs 'measures'"),
        (MEASURED + GOOD + FIGURE.replace("weight", "volume"), r"line 8: .*'measure' is one of the plan's .*weight"),
        (MEASURED + GOOD + FIGURE.replace('"f"', '"../f"'), r"line 7: .*'name' is for a file, of small letters"),
        (MEASURED + GOOD + FIGURE + FIGURE, r"line 10: .*number 2, 'name' 'f' has been given to another figure"),
        (MEASURED + GOOD + FIGURE + 'variants = ["b"]\n', r"line 9: .*'variants' names 'b', but the variants are a"),
        (MEASURED + GOOD + FIGURE + 'scale = "square"\n', r"line 9: .*'scale' is one of linear, log, not 'square'"),
        (MEASURED + GOOD + FIGURE + 'colour = "red"\n', r"line 9: .*'colour' is no known key"),
    ],
)  # fmt: skip
def test_a_bad_plan_is_refused_with_the_place(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(PlanError, match=says):
        read_plan(plan_file(tmp_path, text))


# Measures, wherever a triangulation comes from.


def test_every_preset_that_ends_with_a_triangulation_is_measured(tmp_path: Path) -> None:
    text = """
    measures = ["max-min:volume", "./mine.py"]
    spanning = true
    [[instances]]
    instance = "random:8,3,seed=3"
    [[variants]]
    name = "loop"
    [[variants]]
    name = "root"
    preset = "root"
    [[variants]]
    name = "plain"
    preset = "plain"
    [[variants]]
    name = "limit"
    preset = "solve"
    time_limit = 0
    """
    user = tmp_path / "mine.py"
    user.write_text(template("mine"))
    loop, *others = tasks_from(tmp_path, text)
    assert loop.data["measures"] == [] == list(loop.data["files"])
    assert "measures" not in carry_out(loop.data)[0]
    for task in others:
        assert list(task.data["files"]) == [str(user)]
        record, _ = carry_out(task.data)
        found, configuration = record["triangulation"], load_instance("random:8,3,seed=3")
        volumes = [
            abs(np.linalg.det(configuration.floats[s[1:]] - configuration.floats[s[0]])) for s in found
        ]
        assert record["measures"]["max-min:volume"] == pytest.approx(min(volumes) / 6)
        assert record["measures"][str(user)] == value_at(configuration, found, str(user))
    before = others[0].fingerprint
    user.write_text(template("mine") + "\n# better\n")
    assert tasks_from(tmp_path, text)[1].fingerprint != before


def test_what_is_no_triangulation_has_no_measures() -> None:
    configuration = load_instance("cube:3")
    with pytest.raises(SolverError, match=r"the run ended with no triangulation: .*flat"):
        measured_at(configuration, [[0, 1, 2, 3]], ["cardinality"])


# Delaunay's.


def test_the_check_tells_delaunay_triangulations_from_others() -> None:
    scalars = load_instance("random:8,3,seed=0").scalars()
    delaunay = delaunay_triangulation(load_instance("random:8,3,seed=0"))
    check_delaunay(scalars, delaunay)
    best = bcut.solve("random:8,3,seed=0", spanning=True).triangulation
    assert best is not None
    with pytest.raises(VerificationError, match="contains the vertex beyond that facet"):
        check_delaunay(scalars, best)
    with pytest.raises(VerificationError):
        check_delaunay(scalars, delaunay[1:])


def test_points_on_a_common_sphere_have_one_of_several_or_a_clear_error() -> None:
    assert len(delaunay_triangulation(load_instance("grid:3,3"))) == 8
    with pytest.raises(InputError, match=r"prism:5: what Qhull finds .* there are points on a common sphere"):
        delaunay_triangulation(load_instance("prism:5"))


def test_algebraic_points_have_delaunay_triangulations_too() -> None:
    rows = [["0", "0"], ["sqrt(2)", "0"], ["0", "sqrt(3)"], ["sqrt(2)", "sqrt(3)"], ["1", "1/3"]]
    configuration = PointConfiguration.from_values(rows, name="rectangle")
    # Four of the points lie on a circle, with the fifth inside.
    assert delaunay_triangulation(configuration) == [[0, 1, 4], [0, 2, 4], [1, 3, 4], [2, 3, 4]]


def test_a_figure_without_values_is_left_out(tmp_path: Path) -> None:
    text = MEASURED + '[[instances]]\ninstance = "cube:3"\n[[variants]]\nname = "loop"\n' + FIGURE
    store = carried_out(tmp_path, text)
    assert figures(load_experiment(store.folder)) == []
    names = {path.name for path in write_report(store.folder)}
    assert "report.html" in names
    assert not {"f.svg", "measures.csv"} & names

"""Plans of experiments: read strictly, with every combination that they name, and refused with the place."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from laboratory import plan_file, tasks_from

from bcut.cli.main import run
from bcut.errors import InputError, PlanError
from bcut.experiments.cases import collection_names, read_collection
from bcut.experiments.plan import read_plan
from bcut.experiments.ranges import values_of

Captured = pytest.CaptureFixture[str]


@pytest.mark.parametrize(
    ("given", "values"),
    [
        ([3, 1], [3, 1]),
        (["a", "b"], ["a", "b"]),
        (7, [7]),
        ("0..3", [0, 1, 2, 3]),
        (" 12 .. 24 : 4 ", [12, 16, 20, 24]),
        ("12..23:4", [12, 16, 20]),
        ("5..5", [5]),
    ],
)
def test_a_range_is_a_list_or_a_text_with_both_ends(given: Any, values: list[Any]) -> None:
    assert values_of(given) == values


def test_a_plan_names_every_combination(tmp_path: Path) -> None:
    (tmp_path / "points.json").write_text('{"points": [[0, 0], [1, 0], [0, 1], [1, 1]]}')
    plan = read_plan(
        plan_file(
            tmp_path,
            """
            objective = "random-costs:1"
            [[instances]]
            instance = "random:{n},3,seed={s}"
            class = "n = {n}"
            objective = "random-costs:{s}"
            sense = "max"
            for = { n = [10, 12], s = "4..5" }
            [[instances]]
            file = "points.json"
            optimum = "7/2"
            [[variants]]
            name = "a"
            """,
        )
    )
    random = plan.cases[:4]
    assert [(c.instance, c.label, c.objective) for c in random] == [
        ("random:10,3,seed=4", "n = 10", "random-costs:4"),
        ("random:10,3,seed=5", "n = 10", "random-costs:5"),
        ("random:12,3,seed=4", "n = 12", "random-costs:4"),
        ("random:12,3,seed=5", "n = 12", "random-costs:5"),
    ]
    assert {c.sense for c in random} == {"max"}
    last = plan.cases[4]
    assert last.instance == str(tmp_path / "points.json")
    assert (last.objective, last.sense, last.optimum) == ("random-costs:1", "min", Fraction(7, 2))
    assert len(plan.cases) == 5


def test_settings_at_the_top_are_for_all_variants_that_they_can_concern(tmp_path: Path) -> None:
    plan = read_plan(
        plan_file(
            tmp_path,
            """
            time_limit = 7
            cutoff = true
            scip = ["zerohalf:unlimited", "gomory"]
            method = "listing"
            [[instances]]
            instance = "cube:3"
            optimum = 5
            [[variants]]
            name = "loop"
            [[variants]]
            name = "root"
            preset = "root"
            [[variants]]
            name = "solve"
            preset = "solve"
            time_limit = 3
            [[variants]]
            name = "plain"
            preset = "plain"
            """,
        )
    )
    loop, root, solve, plain = plan.variants
    assert (loop.cutoff, loop.scip, loop.time_limit, loop.method, loop.ledger) == (
        True,
        (),
        7,
        "listing",
        True,
    )
    assert (root.cutoff, root.scip, root.method) == (True, ("zerohalf:unlimited", "gomory"), "")
    assert (solve.cutoff, solve.scip, solve.time_limit, solve.ledger) == (False, (), 3, False)
    assert (plain.cutoff, plain.separators, plain.time_limit) == (False, (), 7)


def test_an_ablation_is_none_all_each_and_all_but_each(tmp_path: Path) -> None:
    plan = read_plan(
        plan_file(
            tmp_path,
            """
            protocol = "ablation"
            preset = "root"
            separators = ["link", "odd-cycle:max_cuts=40", "./mine.py"]
            [[instances]]
            instance = "cube:3"
            [[variants]]
            name = "zero-half"
            preset = "root"
            scip = ["zerohalf"]
            """.replace('"./mine.py"', '"clique"'),
        )
    )
    cycles = "odd-cycle:max_cuts=40"
    assert {v.name: v.separators for v in plan.variants} == {
        "none": (),
        "all": ("link", cycles, "clique"),
        "only link": ("link",),
        "only odd-cycle": (cycles,),
        "only clique": ("clique",),
        "without link": (cycles, "clique"),
        "without odd-cycle": ("link", "clique"),
        "without clique": ("link", cycles),
        "zero-half": (),
    }
    assert {v.preset for v in plan.variants} == {"root"}
    assert [v.role for v in plan.variants].count("only") == 3
    assert plan.variants[-1].role == ""


GOOD_INSTANCES = '[[instances]]\ninstance = "cube:3"\n'
GOOD_VARIANTS = '[[variants]]\nname = "a"\n'
GOOD = GOOD_INSTANCES + GOOD_VARIANTS


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("name = 3 4", r"plan\.toml: is no TOML: .*line 1"),
        ("", r"'instances' is missing"),
        (GOOD_INSTANCES, r"'variants' is missing"),
        (GOOD + "seperators = []\n", r"plan\.toml, line 5: .*variants.* number 1, 'seperators'.* mean 'separators'"),
        ("objektive = 1\n" + GOOD, r"line 1: 'objektive' is no known key; did you mean 'objective'"),
        (GOOD + 'preset = "rot"\n', r"line 5: .*'preset' is one of loop, root, solve, plain, .*, not 'rot'"),
        (GOOD + 'separators = ["linc"]\n', r"line 5: .*unknown separator 'linc': did you mean 'link'"),
        (GOOD + 'separators = ["clique:size=3"]\n', r"line 5: .*no parameter 'size'"),
        (GOOD + 'separators = ["./none.py"]\n', r"none\.py: there is no such file"),
        (GOOD + 'separators = "link"\n', r"'separators' is a list of texts"),
        (GOOD + 'preset = "root"\nscip = ["zerohlf"]\n', r"line 6: .*'zerohlf', but SCIP's separators are .*zerohalf"),
        (GOOD + 'scip = ["zerohalf"]\n', r"for preset 'root' only, not 'loop'"),
        (GOOD + 'preset = "solve"\ncutoff = true\n', r"'cutoff' is for presets 'loop' and 'root', not 'solve'"),
        (GOOD + 'preset = "plain"\nseparators = ["link"]\n', r"has no meaning with preset 'plain'"),
        (GOOD + "time_limit = -1\n", r"'time_limit' is a number from 0 on, not -1"),
        (GOOD + 'time_limit = "5"\n', r"'time_limit' is a number from 0 on"),
        (GOOD + "seed = 1.5\n", r"'seed' is an integer"),
        (GOOD + "ledger = 1\n", r"'ledger' is true or false, not 1"),
        (GOOD + GOOD_VARIANTS, r"has the name 'a' twice"),
        ('separators = ["link"]\n' + GOOD, r"line 1: .*'separators' is about the protocol 'ablation'; without one"),
        (GOOD_INSTANCES + "[[variants]]\n", r"line 3: .*'name' is missing"),
        ("[[instances]]\n" + GOOD_VARIANTS, r"names one of instance, file and collection"),
        ('[[instances]]\ninstance = "cube:{n}"\n' + GOOD_VARIANTS, r"line 2: .*placeholder \{n\} without a range"),
        ('[[instances]]\ninstance = "cube:{n"\n' + GOOD_VARIANTS, r"braces that do not pair"),
        (
            '[[instances]]\ninstance = "cube:3"\nfor = { n = [3] }\n' + GOOD_VARIANTS,
            r"line 3: .*range to 'n', which no pattern uses",
        ),
        (
            '[[instances]]\ninstance = "cube:{n}"\nfor = { n = "3-4" }\n' + GOOD_VARIANTS,
            r"line 3: .*range such as \"0\.\.29\"",
        ),
        ('[[instances]]\ncollection = "gab-set"\n' + GOOD_VARIANTS, r"'gab-set' is neither bundled"),
        ('[[instances]]\ninstance = "cube:3"\nsense = "least"\n' + GOOD_VARIANTS, r"one of min, max, not 'least'"),
        ('[[instances]]\ninstance = "cube:3"\noptimum = "x"\n' + GOOD_VARIANTS, r"'optimum' is a number or a rational"),
        ('instances = "cube:3"\n' + GOOD_VARIANTS, r"write \[\[instances\]\]"),
        ('protocol = "ablasion"\n' + GOOD, r"'protocol' is one of ablation"),
        ('protocol = "ablation"\n' + GOOD, r"an ablation says which separators"),
    ],
)  # fmt: skip
def test_a_bad_plan_is_refused_with_the_place(tmp_path: Path, text: str, says: str, capsys: Captured) -> None:
    path = plan_file(tmp_path, text)
    with pytest.raises(PlanError, match=says):
        read_plan(path)
    assert run(["experiment", "run", str(path), "--output", str(tmp_path / "out")]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("Error: ")
    assert not captured.out
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('[[instances]]\ninstance = "cub:3"\n' + GOOD_VARIANTS, "did you mean cube"),
        (GOOD_INSTANCES + GOOD_VARIANTS + "cutoff = true\n", "that of cube:3 is not known"),
    ],
)
def test_what_a_plan_asks_for_has_to_exist(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        tasks_from(tmp_path, text)


def test_the_plans_of_the_repository_can_be_read() -> None:
    plans = sorted((Path(__file__).resolve().parent.parent / "experiments").glob("*.toml"))
    assert plans
    for path in plans:
        plan = read_plan(path)
        assert plan.description
        assert plan.cases


def test_the_bundled_collections_can_be_read() -> None:
    import bcut.instances

    assert {"gap-set", "hard-set"} <= set(collection_names())
    assert not set(collection_names()) & set(bcut.instances.names())
    for name in collection_names():
        members = read_collection(bcut.instances.path(name))
        keys = [(m.instance, m.objective, m.sense, m.spanning) for m in members]
        assert len(set(keys)) == len(keys) > 0
    gap_set = read_collection(bcut.instances.path("gap-set"))
    assert all(member.optimum is not None for member in gap_set)
    data = json.loads(bcut.instances.path("gap-set").read_text())
    for member in data["members"]:
        sign = 1 if member["sense"] == "min" else -1
        assert sign * (Fraction(member["optimum"]) - Fraction(member["lp"])) > 1e-7

"""Sizes of formulations: counted without writing their rows, and the tables about them in a report."""

from __future__ import annotations

from math import comb
from pathlib import Path
from typing import Any

import pytest
from laboratory import carried_out, plan_file, tasks_from

from bcut.errors import PlanError
from bcut.experiments import sizes
from bcut.experiments.execute import carry_out
from bcut.experiments.plan import read_plan
from bcut.experiments.reporting.report import write_report
from bcut.experiments.reporting.runs import load_experiment
from bcut.experiments.reporting.tables import all_tables
from bcut.experiments.sizes import full_size
from bcut.formulations.formulation import Formulation
from bcut.geometry.chirotope import Chirotope
from bcut.instance import load_instance
from bcut.solving.programs import make_formulation

Tables = dict[str, list[dict[str, Any]]]

PLAN = """
name = "sizes"
[[instances]]
instance = "polygon:{n}"
class = "polygons"
for = { n = [5, 6, 8, 12, 16] }
orders = { columns = 3, rows = 2 }
[[instances]]
instance = "random:{n},2,seed={s}"
class = "Formulation 0"
formulation = "0"
for = { n = [7, 8], s = "1..3" }
[[instances]]
instance = "random:8,3,seed=1"
class = "solved"
spanning = true
[[variants]]
name = "count"
preset = "sizes"
[[variants]]
name = "LP"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return carried_out(tmp_path_factory.mktemp("sizes"), PLAN).folder


@pytest.fixture(scope="module")
def tables(folder: Path) -> Tables:
    return all_tables(load_experiment(folder))


def rows(table: list[dict[str, Any]], **wanted: Any) -> list[dict[str, Any]]:
    return [row for row in table if all(row[key] == value for key, value in wanted.items())]


def written(name: str, instance: str, spanning: bool) -> Formulation:
    options = {"lazy": False} if name in ("0", "1") else {}
    return make_formulation(name, load_instance(instance), spanning=spanning, **options)


# Counting.


@pytest.mark.parametrize("name", ["0", "1", "2", "chambers"])
@pytest.mark.parametrize("spanning", [False, True])
@pytest.mark.parametrize(
    "instance", ["random:9,2,seed=1", "random:8,3,seed=2", "random:7,4,seed=1", "cube:3", "grid:3,3"]
)
def test_counted_rows_are_those_that_would_be_written(
    name: str, spanning: bool, instance: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Several blocks of crossings.
    monkeypatch.setattr(sizes, "_AT_ONCE", 300)
    found = full_size(name, load_instance(instance), spanning=spanning)
    formulation = written(name, instance, spanning)
    assert found is not None
    assert found.columns == formulation.width
    if name == "chambers" and not formulation.lazy:
        assert set(found.kinds) == {"chamber"}
    if name != "chambers" or not formulation.lazy:
        assert (found.rows, found.nonzeros) == (formulation.matrix.shape[0], formulation.matrix.nnz)
    else:
        # Triangulations need pairs beside chambers in degenerate position.
        crossing = full_size("0", load_instance(instance), spanning=spanning)
        assert crossing is not None
        assert found.kinds["pair"] == crossing.kinds["pair"]


@pytest.mark.parametrize(("n", "dimension"), [(9, 2), (9, 3), (9, 4)])
def test_sizes_in_general_position_follow_the_binomial_coefficients(n: int, dimension: int) -> None:
    points = load_instance(f"random:{n},{dimension},seed=5")
    hull = len(Chirotope.of(points).hull_facets)
    one, two = (full_size(name, points, spanning=False) for name in ("1", "2"))
    assert one is not None
    assert two is not None
    assert (two.columns, two.rows) == (comb(n, dimension + 1), comb(n, dimension) - hull + 1)
    assert one.columns == sum(comb(n, k) for k in range(1, dimension + 2))
    lattice = sum(k * comb(n, k) for k in range(2, dimension + 2))
    assert one.kinds == {"face": lattice, "pair": comb(n, dimension + 2), "volume": 2}


def test_counting_ends_at_the_deadline(tmp_path: Path) -> None:
    points = load_instance("random:8,2,seed=1")
    assert full_size("0", points, spanning=False, deadline=0.0) is None
    (task,) = tasks_from(
        tmp_path,
        'time_limit = 1e-9\n[[instances]]\ninstance = "random:8,2,seed=1"\nformulation = "0"\n'
        '[[variants]]\nname = "count"\npreset = "sizes"\n',
    )
    outcome = carry_out(task.data)[0]["outcome"]
    assert (outcome["status"], outcome["rows"], outcome["kinds"]) == ("limit", None, None)


# Plans.


def test_a_run_counts_and_solves_nothing(tmp_path: Path) -> None:
    (task,) = tasks_from(
        tmp_path, '[[instances]]\ninstance = "cube:3"\n[[variants]]\nname = "count"\npreset = "sizes"\n'
    )
    record, ledger = carry_out(task.data)
    outcome = record["outcome"]
    assert ledger is None
    assert (outcome["status"], outcome["columns"], outcome["value"]) == ("counted", 58, None)
    assert outcome["kinds"] == {"cocircuit": outcome["rows"] - 1, "coverage": 1}


@pytest.mark.parametrize(
    ("entry", "problem"),
    [
        ("orders = 3", "is a table of exponents"),
        ("orders = { points = 2 }", "speaks of 'points', but what grows is columns, rows, nonzeros, per_row"),
        ('orders = { rows = "n" }', "gives 'rows' an exponent, not 'n'"),
    ],
)
def test_bad_orders_are_refused(tmp_path: Path, entry: str, problem: str) -> None:
    text = f'[[instances]]\ninstance = "cube:3"\n{entry}\n[[variants]]\nname = "count"\npreset = "sizes"\n'
    with pytest.raises(PlanError, match=problem):
        read_plan(plan_file(tmp_path, text))


def test_counting_knows_no_separators(tmp_path: Path) -> None:
    text = '[[instances]]\ninstance = "cube:3"\n[[variants]]\nname = "count"\npreset = "sizes"\nseparators = ["link"]\n'
    with pytest.raises(PlanError, match="preset 'sizes': it solves nothing"):
        read_plan(plan_file(tmp_path, text))


def test_orders_make_no_other_run(tmp_path: Path) -> None:
    other = PLAN.replace("columns = 3", "columns = 4")
    assert [t.fingerprint for t in tasks_from(tmp_path, PLAN)] == [
        t.fingerprint for t in tasks_from(tmp_path, other)
    ]


@pytest.mark.parametrize("method", ["listing", "fixing"])
def test_the_loop_takes_the_method_that_the_plan_names(tmp_path: Path, method: str) -> None:
    text = '[[instances]]\ninstance = "random:14,3,seed=1"\nspanning = true\nobjective = "weight"\n'
    (task,) = tasks_from(tmp_path, f'{text}[[variants]]\nname = "LP"\nmethod = "{method}"\n')
    record, ledger = carry_out(task.data)
    outcome = record["outcome"]
    assert (outcome["columns_after_fixing"] < outcome["columns"]) == (method == "fixing")
    assert (ledger is None) == (method == "fixing")


# Tables.


def test_sizes_are_means_over_the_instances_of_a_size(tables: Tables) -> None:
    (seven,) = rows(tables["sizes"], **{"class": "Formulation 0", "points": 7})
    found = [full_size("0", load_instance(f"random:7,2,seed={s}"), spanning=False) for s in (1, 2, 3)]
    assert seven["instances"] == 3
    assert seven["rows"] == pytest.approx(sum(size.rows for size in found if size) / 3)
    assert seven["per_row"] == pytest.approx(sum(size.nonzeros / size.rows for size in found if size) / 3)
    assert (seven["columns"], seven["columns_error"]) == (35, 0)
    assert seven["rows_by_kind"].endswith("volume 2")
    assert len(tables["sizes"]) == 5 + 2 + 1


def test_growth_is_fitted_over_the_larger_half(tables: Tables) -> None:
    from math import log

    growth = {row["measure"]: row for row in rows(tables["growth"], **{"class": "polygons"})}
    columns = growth["columns"]
    assert (columns["from_points"], columns["to_points"], columns["order"]) == (8, 16, 3)
    # Least squares through three points, by hand.
    x, y = [log(n) for n in (8, 12, 16)], [log(comb(n, 3)) for n in (8, 12, 16)]
    middle, level = sum(x) / 3, sum(y) / 3
    slope = sum((a - middle) * (b - level) for a, b in zip(x, y, strict=True)) / sum(
        (a - middle) ** 2 for a in x
    )
    assert columns["exponent"] == pytest.approx(slope)
    assert growth["nonzeros"]["order"] is None
    # One number of points does not grow.
    assert not rows(tables["growth"], **{"class": "solved"})


def test_classes_tell_what_was_solved(tables: Tables) -> None:
    (solved,) = rows(tables["classes"], **{"class": "solved"})
    formulation = written("2", "random:8,3,seed=1", True)
    assert (solved["variant"], solved["runs"], solved["points"], solved["integral"]) == ("LP", 1, 8, 1)
    assert (solved["columns"], solved["rows"]) == formulation.size
    assert solved["nonzeros"] == formulation.matrix.nnz
    assert solved["longest"] == solved["processor_seconds"] > 0


def test_what_was_counted_stands_in_no_table_of_what_was_solved(tables: Tables) -> None:
    for name in ("variants", "times", "runs", "classes"):
        assert {row["variant"] for row in tables[name]} == {"LP"}, name


def test_the_page_shows_both(folder: Path, tmp_path: Path) -> None:
    page, *files = write_report(folder, tmp_path / "report")
    text = page.read_text(encoding="utf-8")
    for name in ("sizes", "growth", "classes"):
        assert f'<section id="{name}">' in text
        assert tmp_path / "report" / f"{name}.parquet" in files


def test_a_page_about_sizes_alone_speaks_of_no_times(tmp_path: Path) -> None:
    place = carried_out(
        tmp_path, '[[instances]]\ninstance = "cube:3"\n[[variants]]\nname = "count"\npreset = "sizes"\n'
    ).folder
    text = write_report(place)[0].read_text(encoding="utf-8")
    assert '<section id="sizes">' in text
    assert '<section id="time">' not in text

"""Reports: tables with the right numbers, one page without other files, looked at in a real browser."""

from __future__ import annotations

import csv
import html.parser
import json
import re
import runpy
import shutil
import subprocess
from math import exp, log
from pathlib import Path
from typing import Any

import pytest
from laboratory import carried_out

from bcut.cli.main import run
from bcut.experiments.reporting.report import write_report
from bcut.experiments.reporting.runs import Experiment, Run, load_experiment, shifted_geometric_mean
from bcut.experiments.reporting.tables import all_tables

Captured = pytest.CaptureFixture[str]
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

# The second instance has the optimum of the plan, those of the others come from the variant that solves.
PLAN = """
name = "a <b>small</b> experiment"
description = "All tables & figures."
protocol = "ablation"
separators = ["link", "odd-cycle:max_cuts=8"]
[[instances]]
instance = "random:{n},3,seed={s}"
class = "space"
spanning = true
for = { n = [12], s = [1000, 3] }
[[instances]]
instance = "random:16,3,seed=9"
class = "space"
spanning = true
optimum = 28
[[instances]]
instance = "random:30,2,seed=2"
class = "plane"
objective = "random-costs:2"
spanning = true
[[variants]]
name = "zero-half"
preset = "root"
scip = ["zerohalf"]
[[variants]]
name = "solve"
preset = "solve"
separators = ["link"]
[[variants]]
name = "plain"
preset = "plain"
[[variants]]
name = "broken"
preset = "root"
separators = ["./broken.py"]
"""

BROKEN = """
from bcut import Separator

class Broken(Separator):
    \"\"\"Raises <&>.\"\"\"
    name = "broken"

    def separate(self, point):
        raise RuntimeError("<broken> & lost")
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("experiment")
    (place / "broken.py").write_text(BROKEN)
    return carried_out(place, PLAN).folder


@pytest.fixture(scope="module")
def page(folder: Path) -> Path:
    return write_report(folder)[0]


@pytest.fixture(scope="module")
def tables(folder: Path) -> dict[str, list[dict[str, Any]]]:
    return all_tables(load_experiment(folder))


def row(table: list[dict[str, Any]], **wanted: Any) -> dict[str, Any]:
    (found,) = [r for r in table if all(r[key] == value for key, value in wanted.items())]
    return found


# Numbers.


def test_the_gap_is_between_the_root_lp_and_the_optimum(tables: dict[str, list[dict[str, Any]]]) -> None:
    runs = tables["runs"]
    first = "random:12,3,seed=1000"
    none = row(runs, instance=first, variant="none")
    assert (none["lp"], none["optimum"]) == (pytest.approx(16.5), 17)
    assert none["gap_closed"] == pytest.approx(0, abs=1e-9)
    assert row(runs, instance=first, variant="only link")["gap_closed"] == pytest.approx(1)
    assert row(runs, instance=first, variant="plain")["gap_closed"] is None
    # Given by the plan, though no variant proves it.
    assert row(runs, instance="random:16,3,seed=9", variant="none")["optimum"] == 28
    without_gap = row(runs, instance="random:12,3,seed=3", variant="none")
    assert without_gap["gap_closed"] is None
    assert without_gap["lp"] == pytest.approx(without_gap["optimum"])


def test_means_are_over_the_instances_with_a_gap(tables: dict[str, list[dict[str, Any]]]) -> None:
    for variant in ("none", "all", "only link", "zero-half"):
        shares = [r["gap_closed"] for r in tables["runs"] if r["variant"] == variant]
        with_gap = [share for share in shares if share is not None]
        found = row(tables["variants"], variant=variant)
        assert (found["runs"], found["with_gap"]) == (4, len(with_gap)) == (4, 3)
        assert found["gap_closed"] == pytest.approx(sum(with_gap) / 3)
    space = row(tables["gap"], **{"class": "space", "variant": "only link"})
    assert (space["instances"], space["entirely"], space["settled"]) == (2, 2, 2)
    assert space["least"] == pytest.approx(1)


def test_the_ablation_compares_with_all_and_with_none(tables: dict[str, list[dict[str, Any]]]) -> None:
    table = tables["ablation"]
    link, cycles = row(table, separators="link"), row(table, separators="odd-cycle")
    # With two separators, all but one is the other one.
    assert link["alone"] == pytest.approx(cycles["without"])
    assert link["gain_alone"] == pytest.approx(link["alone"] - row(table, separators="none")["alone"])
    assert link["loss_without"] == pytest.approx(row(table, separators="all")["alone"] - link["without"])
    assert link["alone"] == pytest.approx(1)
    assert row(table, separators="none")["alone"] == pytest.approx(0, abs=1e-9)


def test_cuts_and_times_add_up(folder: Path, tables: dict[str, list[dict[str, Any]]]) -> None:
    records = [json.loads(path.read_text()) for path in (folder / "runs").glob("*.json")]
    own = [
        r for r in records if r["settings"]["separators"] == ["link"] and r["settings"]["preset"] == "loop"
    ]
    found = row(tables["families"], variant="only link", family="link")
    for key, name in (("found", "found"), ("taken", "added"), ("final", "final"), ("active", "active")):
        assert found[name] == sum(r["cuts"].get("link", {}).get(key, 0) for r in own)
    assert found["found"] >= found["added"] >= found["final"] >= found["active"] > 0
    times = row(tables["times"], variant="only link")
    parts = times["seconds_lp"] + times["seconds_separation"] + times["seconds_elsewhere"]
    assert parts == pytest.approx(times["seconds"])
    assert times["seconds"] == pytest.approx(sum(r["outcome"]["seconds"]["total"] for r in own))
    rounds = [
        r
        for r in tables["rounds"]
        if r["variant"] == "only link" and r["instance"] == "random:12,3,seed=1000"
    ]
    assert [r["round"] for r in rounds] == list(range(len(rounds)))
    assert rounds[-1]["gap_closed"] == pytest.approx(1)
    assert rounds[0]["cuts"] > 0 == rounds[-1]["cuts"]


def test_profiles_begin_with_the_fastest_and_end_with_what_is_settled(
    tables: dict[str, list[dict[str, Any]]],
) -> None:
    solving = [r for r in tables["profile"] if r["kind"] == "solve"]
    assert {r["variant"] for r in solving} == {"solve", "plain"}
    assert sum(r["factor"] == 1 for r in solving) >= 4
    for variant in ("solve", "plain"):
        own = [r for r in solving if r["variant"] == variant]
        assert [r["share"] for r in own] == [0.25, 0.5, 0.75, 1.0]
        assert [r["factor"] for r in own] == sorted(r["factor"] for r in own)


def test_times_of_older_records_do_not_spoil_the_tables(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder, tmp_path / "old")
    for number, path in enumerate(sorted((tmp_path / "old" / "runs").glob("*.json"))):
        record = json.loads(path.read_text())
        if number % 2:
            record["outcome"]["seconds"]["processor"] = -2.5
        else:
            del record["outcome"]["seconds"]["processor"]
        path.write_text(json.dumps(record))
    experiment = load_experiment(tmp_path / "old")
    assert {run.processor_seconds for run in experiment.runs} == {0.0} | {
        run.seconds for run in experiment.runs if "processor" not in run.outcome["seconds"]
    }
    assert {"variants", "times", "profile"} <= all_tables(experiment).keys()
    path = Path(__file__).resolve().parent.parent / "experiments" / "laboratory_tables.py"
    script = runpy.run_path(str(path))
    for maker in ("roots", "solves", "instances", "totals", "foot"):
        assert script[maker](experiment)


def test_root_lps_that_no_run_tells_are_those_of_the_collection() -> None:
    path = Path(__file__).resolve().parent.parent / "experiments" / "laboratory_tables.py"
    script = runpy.run_path(str(path))
    lps = script["known_lps"]()
    assert len(lps) == 21
    assert lps["cardinality", "random:30,3,seed=9", "min", True] == pytest.approx(63.58122)
    entry = {"instance": "random:30,3,seed=9", "objective": "cardinality", "sense": "min", "spanning": True}
    outcome = {"status": "optimal", "nodes": 0, "seconds": {"total": 9.0, "processor": 7.0}}
    record = {"outcome": outcome, "settings": {"preset": "solve"}}
    shown = [Run({**entry, "variant": "it"}, record, 66.0, lp) for lp in (None, 60.25)]
    for run_, lp in zip(shown, ("63.581", "60.25"), strict=True):
        experiment = Experiment({"variants": [{"name": "it"}]}, [run_], 0, [])
        assert f"| `random:30,3,seed=9`, minimum | {lp} | 66 | 7.0 s, 0 nodes |" in script["instances"](
            experiment
        )


def test_shifted_geometric_means() -> None:
    assert shifted_geometric_mean([], 1.0) is None
    assert shifted_geometric_mean([3.0], 10.0) == pytest.approx(3)
    assert shifted_geometric_mean([0.0, 3.0], 1.0) == pytest.approx(1)
    # Without the noise of the logarithms.
    assert [shifted_geometric_mean([0.0] * count, 10.0) for count in range(1, 9)] == [0.0] * 8
    assert shifted_geometric_mean([-2.0, 3.0], 1.0) == pytest.approx(1)
    values = [0.5, 2.0, 90.0]
    assert shifted_geometric_mean(values, 1.0) == pytest.approx(exp(sum(log(v + 1) for v in values) / 3) - 1)


# Files.


def test_tables_are_the_same_as_csv_and_as_parquet(
    page: Path, tables: dict[str, list[dict[str, Any]]]
) -> None:
    import pyarrow.parquet

    for name, table in tables.items():
        with (page.parent / f"{name}.csv").open(newline="") as stream:
            read = list(csv.DictReader(stream))
        columns = pyarrow.parquet.read_table(page.parent / f"{name}.parquet").to_pylist()
        assert len(read) == len(columns) == len(table)
        for text, typed, wanted in zip(read, columns, table, strict=True):
            assert list(text) == list(typed) == list(wanted)
            for key, value in wanted.items():
                assert text[key] == ("" if value is None else str(value))
                assert typed[key] == (pytest.approx(value) if isinstance(value, float) else value)


class Reader(html.parser.HTMLParser):
    """Collects what a page refers to, and whether its elements are closed."""

    def __init__(self) -> None:
        super().__init__()
        self.opened: list[str] = []
        self.refers: list[str] = []
        self.ids: list[str] = []
        self.seen: dict[str, int] = {}

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen[tag] = self.seen.get(tag, 0) + 1
        self.refers += [str(v) for k, v in attrs if k in ("src", "href", "xlink:href", "data")]
        self.ids += [str(v) for k, v in attrs if k == "id"]
        if tag not in ("meta", "link", "br"):
            self.opened.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in ("meta", "link", "br"):
            self.opened.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.opened.pop() == tag


def test_the_page_needs_no_other_file(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    reader = Reader()
    reader.feed(text)
    assert not reader.opened
    assert reader.seen["svg"] >= 8
    assert "script" not in reader.seen
    assert all(link.startswith(("#", "data:")) for link in reader.refers), set(reader.refers)
    assert {link[1:] for link in reader.refers if link.startswith("#")} <= set(reader.ids)
    assert len(set(reader.ids)) == len(reader.ids)
    assert "url(http" not in text


def test_the_page_tells_what_failed_and_escapes_what_it_shows(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert "<h1>a &lt;b&gt;small&lt;/b&gt; experiment</h1>" in text
    assert "&lt;broken&gt; &amp; lost" in text
    assert "Runs that failed" in text
    assert "of value 27.5" in text or "of value 16.5" in text
    assert len(re.findall(r"with a (link|odd-cycle) cut that it violates by", text)) == 2


def test_a_report_of_less_is_a_report(tmp_path: Path, capsys: Captured) -> None:
    text = '[[instances]]\ninstance = "cube:3"\n[[variants]]\nname = "solve"\npreset = "solve"\n'
    store = carried_out(tmp_path, text)
    assert run(["experiment", "report", str(store.folder), "--output", str(tmp_path / "elsewhere")]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == str(tmp_path / "elsewhere" / "report.html")
    assert all(Path(line).exists() for line in printed)
    for path in (store.folder / "runs").iterdir():
        path.unlink()
    assert run(["experiment", "report", str(store.folder)]) == 2
    assert "none of its runs is stored yet" in capsys.readouterr().err


def test_a_missing_library_is_named(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    assert run(["experiment", "report", str(folder)]) == 2
    assert "pip install 'bcut[experiments]'" in capsys.readouterr().err


# In a browser.


@pytest.mark.skipif(CHROMIUM is None, reason="needs chromium")
@pytest.mark.parametrize("width", [1280, 540])
def test_a_browser_shows_the_page(page: Path, tmp_path: Path, width: int) -> None:
    from matplotlib.image import imread

    # A copy that measures itself: what overflows, which figures have no extent, and what went wrong.
    probe = """<script>
    const wrong = [];
    window.onerror = (message) => wrong.push(message);
    window.onload = () => {
      const flat = [...document.querySelectorAll("svg")].filter((s) => s.getBoundingClientRect().height < 40);
      document.title = JSON.stringify({wide: document.documentElement.scrollWidth, flat: flat.length, wrong,
        high: document.documentElement.scrollHeight});
    };
    </script></head>"""
    copy = tmp_path / "page.html"
    copy.write_text(page.read_text(encoding="utf-8").replace("</head>", probe, 1), encoding="utf-8")
    picture = tmp_path / "page.png"
    assert CHROMIUM is not None
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
    command += [f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={width},2400"]
    done = subprocess.run(
        [*command, "--enable-logging=stderr", f"--screenshot={picture}", f"file://{copy}"],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert "CONSOLE" not in done.stderr
    shown = subprocess.run(
        [*command, "--dump-dom", f"file://{copy}"], capture_output=True, text=True, timeout=60, check=True
    ).stdout
    title = re.search(r"<title>(.*?)</title>", shown)
    assert title is not None
    measured = json.loads(title[1])
    assert measured["wide"] <= width
    assert (measured["flat"], measured["wrong"]) == (0, [])
    assert measured["high"] > 2400
    pixels = imread(picture)
    assert pixels.shape[1] == width
    shades = pixels[..., :3].mean(axis=2)
    # Mostly white, with text and figures all the way down.
    assert 0.5 < (shades > 0.98).mean() < 0.98
    bands = [band for band in range(0, 2400, 600) if (shades[band : band + 600] < 0.7).mean() > 0.002]
    assert len(bands) == 4

"""`write_report`: one page with figures and tables, and the tables as files."""

from __future__ import annotations

import csv
import datetime
import importlib.resources
import io
from pathlib import Path
from typing import Any

from bcut.errors import ExperimentError, InputError
from bcut.experiments.reporting.measures import Figure, figures
from bcut.experiments.reporting.runs import Experiment, load_experiment
from bcut.experiments.reporting.tables import Row, Table, all_tables
from bcut.files.atomic import replacing, write_text

_TEMPLATE = "report.html.j2"
# Long tables stand in the files only.
_ON_PAGE = 400
# Contradictions in a message.
_LISTED = 20

_TITLES = {
    "variants": "Variants",
    "measures": "Triangulations",
    "measured": "Measures of each run",
    "classes": "Classes",
    "sizes": "Sizes",
    "growth": "Growth",
    "gap": "Gap closed, by class of instances",
    "ablation": "Ablation",
    "families": "Cuts",
    "times": "Time",
    "profile": "Performance profiles",
    "rounds": "Bound per round",
    "runs": "Runs",
    "failures": "Runs that failed",
    "contradictions": "Contradictions",
}
# How columns are shown; others as they are.
_SHARES = {"gap_closed", "least", "alone", "without", "gain_alone", "loss_without", "share"}
_TIMES = {
    "seconds", "processor_seconds", "seconds_lp", "seconds_separation", "seconds_elsewhere", "seconds_alone",
    "seconds_without", "factor", "longest",
}  # fmt: skip
_HIDDEN = {"fingerprint", "other_fingerprint", "trace"}


def write_report(folder: Path | str, output: Path | str | None = None) -> list[Path]:
    """Write the report about the runs of an experiment.

    Parameters
    ----------
    folder : path
        Of the experiment.
    output : path, optional
        Where to write; the folder "report" in it when omitted.

    Returns
    -------
    list of Path
        What was written: report.html, each table as CSV and Parquet, and each figure of the plan as SVG.

    Raises
    ------
    ExperimentError
        There is no experiment, or no run of it is stored. Also where runs contradict each other: then the report
        has been written, and says which.
    InputError
        The folder cannot be written to, or a library is missing.
    """
    _check_libraries()
    folder = Path(folder)
    experiment = load_experiment(folder)
    if not experiment.runs and not experiment.failures:
        raise ExperimentError(f"{folder}: none of its runs is stored yet; run the experiment first")
    target = folder / "report" if output is None else Path(output)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{target}: cannot be made a folder ({error.strerror}); choose another place"
        ) from None
    tables = all_tables(experiment)
    written = []
    for name, table in tables.items():
        written += [
            _write_csv(target / f"{name}.csv", table),
            _write_parquet(target / f"{name}.parquet", table),
        ]
    drawn = figures(experiment)
    for figure in drawn:
        path = target / f"{figure.name}.svg"
        write_text(path, figure.svg)
        written.append(path)
    page = target / "report.html"
    write_text(page, render(experiment, tables, drawn))
    _refuse_contradictions(experiment, page)
    return [page, *written]


def _refuse_contradictions(experiment: Experiment, page: Path) -> None:
    """Raise where two claims about an optimum cannot both be true: this must not pass unseen."""
    if not experiment.contradictions:
        return
    listed = [
        f"{found.instance}, {found.second.who}: {found.told_of(found.second)}"
        for found in experiment.contradictions[:_LISTED]
    ]
    more = len(experiment.contradictions) - _LISTED
    lines = "\n".join([*listed, *([f"and {more} more"] if more > 0 else [])])
    raise ExperimentError(f"{page}: is written, but runs contradict each other:\n{lines}")


def _check_libraries() -> None:
    try:
        import jinja2
        import matplotlib
        import pyarrow
    except ImportError as error:
        raise InputError(
            f"a report needs {error.name}, which is not installed: pip install 'bcut[experiments]'"
        ) from None
    del jinja2, matplotlib, pyarrow


def render(experiment: Experiment, tables: dict[str, Table], drawn: list[Figure]) -> str:
    """Return the page as text; it needs no other file."""
    from jinja2 import Environment, StrictUndefined

    from bcut.experiments.reporting.charts import (
        ablation_chart,
        gap_chart,
        profile_chart,
        rounds_chart,
        times_chart,
    )
    from bcut.experiments.reporting.pictures import pictures

    profile = tables.get("profile", [])
    charts = {
        "gap": gap_chart(tables.get("variants", [])),
        "rounds": rounds_chart(experiment),
        "ablation": ablation_chart(tables.get("ablation", [])),
        "times": times_chart(tables.get("times", [])),
        "profile_root": profile_chart(profile, "root"),
        "profile_solve": profile_chart(profile, "solve"),
    }
    source = importlib.resources.files(__package__).joinpath(_TEMPLATE).read_text(encoding="utf-8")
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    manifest = experiment.manifest
    return environment.from_string(source).render(
        name=manifest["name"],
        description=manifest["description"],
        date=datetime.datetime.fromtimestamp(manifest["written"], datetime.UTC).strftime(
            "%Y-%m-%d %H:%M UTC"
        ),
        code=manifest["code"],
        machines=_machines(experiment),
        plan=manifest["plan"],
        stored=len(experiment.runs),
        missing=experiment.missing,
        failures=experiment.failures,
        disputes=len(experiment.contradictions),
        charts={name: chart for name, chart in charts.items() if chart},
        drawn=drawn,
        heat=_heat(experiment, tables.get("gap", [])),
        tables={
            name: {
                "title": _TITLES[name],
                "head": _head(table),
                "rows": _shown(table),
                "more": len(table) - _ON_PAGE,
            }
            for name, table in tables.items()
        },
        pictures=pictures(experiment),
    )


def _machines(experiment: Experiment) -> list[str]:
    found: dict[str, int] = {}
    for run in experiment.runs:
        machine = run.record["machine"]
        text = f"{machine['processor']}, {machine['cores']} cores, {machine['system']}, Python {machine['python']}"
        found[text] = found.get(text, 0) + 1
    return [f"{text}: {count} runs" for text, count in found.items()]


def _heat(experiment: Experiment, gap: Table) -> dict[str, Any] | None:
    """Return the shares of the gap closed as a table of classes by variants, with a shade for each."""
    if not gap:
        return None
    cells = {(row["class"], row["variant"]): row for row in gap}
    variants = [name for name in experiment.variants if any(row["variant"] == name for row in gap)]
    labels = [label for label in experiment.labels if any(row["class"] == label for row in gap)]
    rows = []
    for label in labels:
        shown = []
        for name in variants:
            row = cells.get((label, name))
            share = None if row is None else max(0.0, min(1.0, row["gap_closed"]))
            shown.append(
                {
                    "text": "" if row is None else f"{100 * row['gap_closed']:.1f}",
                    "title": "" if row is None else f"{row['settled']} of {row['instances']} settled",
                    "shade": None if share is None else f"{0.06 + 0.6 * share:.2f}",
                }
            )
        counts = [cells[label, name]["instances"] for name in variants if (label, name) in cells]
        rows.append({"class": label, "instances": max(counts), "cells": shown})
    return {"variants": variants, "rows": rows}


def _head(table: Table) -> list[str]:
    shown = (name for name in table[0] if name not in _HIDDEN)
    return [name.replace("_", " ").replace("lp", "LP") for name in shown]


def _shown(table: Table) -> list[list[dict[str, Any]]]:
    numeric = {name for name in table[0] if any(_is_number(row[name]) for row in table)}
    return [
        [
            {"text": _cell(name, value), "number": name in numeric}
            for name, value in row.items()
            if name not in _HIDDEN
        ]
        for row in table[:_ON_PAGE]
    ]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _cell(name: str, value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if name in _SHARES:
        return f"{100 * value:.1f} %"
    if name in _TIMES:
        return f"{value:.2f}"
    if name == "nodes" and isinstance(value, float):
        return f"{value:.1f}"
    if isinstance(value, float):
        return f"{value:.7g}"
    return f"{value:,}" if isinstance(value, int) else str(value)


def _write_csv(path: Path, table: Table) -> Path:
    stream = io.StringIO()
    writer = csv.DictWriter(stream, fieldnames=list(table[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(table)
    write_text(path, stream.getvalue())
    return path


def _write_parquet(path: Path, table: Table) -> Path:
    import pyarrow
    import pyarrow.parquet

    columns = {name: _column(table, name) for name in table[0]}
    with replacing(path) as temporary:
        pyarrow.parquet.write_table(pyarrow.table(columns), temporary)
    return path


def _column(table: list[Row], name: str) -> list[Any]:
    """Return a column with one type: a number that is sometimes integral is a float everywhere."""
    values = [row[name] for row in table]
    if any(isinstance(value, float) for value in values):
        return [None if value is None else float(value) for value in values]
    return values

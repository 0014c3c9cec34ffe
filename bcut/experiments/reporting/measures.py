"""Measures of the triangulations that runs ended with: their tables, and the figures that a plan asks for."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING, Any

from bcut.experiments.reporting.runs import Experiment, Run, mean

if TYPE_CHECKING:
    from bcut.experiments.reporting.tables import Table

# Panels beside each other.
_ACROSS = 4
# Largest over smallest value on a logarithmic axis with ticks at 1, 2, 5, 10, ...
_PLAIN_UP_TO = 1e3
_UNPROVEN = "Hollow: not proven optimal."


@dataclass(frozen=True)
class Figure:
    """A figure of a plan.

    Attributes
    ----------
    name : str
        Of its file, without the ending.
    svg : str
    caption : str
    """

    name: str
    svg: str
    caption: str


def measured_table(experiment: Experiment) -> Table:
    """One row for each run and measure: the value at the triangulation that the run ended with."""
    return [
        {
            "class": run.label,
            "instance": run.entry["instance"],
            "variant": run.variant,
            "objective": run.entry["objective"],
            "sense": run.entry["sense"],
            "measure": measure,
            "value": run.measures[measure],
            "status": run.outcome["status"],
            "objective_value": run.outcome["value"],
            "bound": run.outcome["bound"],
        }
        for measure in experiment.measures
        for run in experiment.runs
        if measure in run.measures
    ]


def measures_table(experiment: Experiment) -> Table:
    """One row for each measure, class and variant: mean, median and range, and how far above the least of all variants.

    "ratio" is the mean over the instances of the value divided by the smallest that any variant has there. A Delaunay
    triangulation has no optimum to prove: then "proven" is None.
    """
    rows = []
    for measure in experiment.measures:
        smallest = _smallest(experiment, measure)
        for label in experiment.labels:
            for name in experiment.variants:
                runs = _runs(experiment, measure, label, name)
                if not runs:
                    continue
                values = [run.measures[measure] for run in runs]
                ratios = [
                    value / smallest[run.entry["instance"]]
                    for run, value in zip(runs, values, strict=True)
                    if smallest[run.entry["instance"]] > 0
                ]
                rows.append(
                    {
                        "measure": measure,
                        "class": label,
                        "variant": name,
                        "runs": len(runs),
                        "proven": None if _is_given(runs[0]) else sum(map(_is_proven, runs)),
                        "mean": mean(values),
                        "median": float(median(values)),
                        "smallest": min(values),
                        "largest": max(values),
                        "ratio": mean(ratios),
                        "largest_ratio": max(ratios, default=None),
                    }
                )
    return rows


def _smallest(experiment: Experiment, measure: str) -> dict[str, float]:
    """Return the smallest value of a measure at the triangulations of each instance."""
    found: dict[str, float] = {}
    for run in experiment.runs:
        if measure in run.measures:
            name, value = run.entry["instance"], run.measures[measure]
            found[name] = min(value, found.get(name, value))
    return found


def _runs(experiment: Experiment, measure: str, label: str, variant: str) -> list[Run]:
    return [
        run
        for run in experiment.runs
        if (run.label, run.variant) == (label, variant) and measure in run.measures
    ]


def _is_proven(run: Run) -> bool:
    return bool(run.outcome["status"] == "optimal")


def _is_given(run: Run) -> bool:
    """Whether the triangulation was no optimum of anything to begin with."""
    return bool(run.record["settings"]["preset"] == "delaunay")


def figures(experiment: Experiment) -> list[Figure]:
    """Draw the figures that the plan asks for; those without a single value are left out."""
    found = (_figure(experiment, drawing) for drawing in experiment.drawings)
    return [figure for figure in found if figure is not None]


def _figure(experiment: Experiment, drawing: dict[str, Any]) -> Figure | None:
    """Draw a panel for each class, in it the variants from left to right, and a line through them for each instance."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure as Canvas

    from bcut.experiments.reporting.charts import STYLE, svg

    measure, variants = drawing["measure"], drawing["variants"]
    panels = {
        label: runs
        for label in experiment.labels
        if any(runs := [_runs(experiment, measure, label, name) for name in variants])
    }
    if not panels:
        return None
    across = min(_ACROSS, len(panels))
    down = -(-len(panels) // across)
    with rc_context(STYLE):
        canvas = Canvas(figsize=(max(4.0, 2.7 * across), 3.2 * down), layout="constrained")
        grid = canvas.subplots(down, across, squeeze=False)
        for position, axes in enumerate(grid.flat):
            if position >= len(panels):
                axes.set_axis_off()
        for axes, (label, runs) in zip(grid.flat, panels.items(), strict=False):
            _panel(axes, measure, runs)
            axes.set_title(label, fontsize=10)
            axes.set_xticks(range(len(variants)), variants)
            axes.set_xlim(-0.5, len(variants) - 0.5)
            axes.grid(axis="x", visible=False)
            if drawing["scale"] == "log":
                _logarithmic(axes)
        for row in grid:
            row[0].set_ylabel(drawing["label"])
    shown = [run for by_variant in panels.values() for runs in by_variant for run in runs]
    open_runs = any(not _is_proven(run) and not _is_given(run) for run in shown)
    caption = f"{drawing['caption']} {_UNPROVEN}" if open_runs else drawing["caption"]
    return Figure(drawing["name"], svg(canvas, drawing["name"]), caption)


def _panel(axes: Any, measure: str, runs: list[list[Run]]) -> None:
    from bcut.experiments.reporting.charts import COLOURS

    lines: dict[str, list[tuple[int, float]]] = {}
    for place, own in enumerate(runs):
        for run in own:
            lines.setdefault(run.entry["instance"], []).append((place, run.measures[measure]))
    for points in lines.values():
        axes.plot(*zip(*points, strict=True), color="#b9bec8", linewidth=0.8, zorder=1)
    for place, own in enumerate(runs):
        colour = COLOURS[place % len(COLOURS)]
        for is_filled in (True, False):
            values = [
                run.measures[measure] for run in own if (_is_proven(run) or _is_given(run)) == is_filled
            ]
            axes.scatter(
                [place] * len(values),
                values,
                s=20,
                facecolor=colour if is_filled else "white",
                edgecolor=colour,
                linewidth=1.0,
                zorder=2,
            )
        if own:
            middle = median(run.measures[measure] for run in own)
            axes.plot([place - 0.3, place + 0.3], [middle] * 2, color=colour, linewidth=2.2, zorder=3)


def _logarithmic(axes: Any) -> None:
    """Make the vertical axis logarithmic: plain numbers at 1, 2, 5, 10, ..., or powers of ten where these are many."""
    from matplotlib.ticker import FuncFormatter, LogFormatterMathtext, LogLocator, NullLocator

    axes.set_yscale("log")
    low, high = axes.get_ylim()
    if high <= _PLAIN_UP_TO * low:
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    else:
        axes.yaxis.set_major_locator(LogLocator())
        axes.yaxis.set_major_formatter(LogFormatterMathtext())
    axes.yaxis.set_minor_locator(NullLocator())

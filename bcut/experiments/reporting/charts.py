"""The figures of a report, as SVG that stands inside a page."""

from __future__ import annotations

import io
import re
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from bcut.experiments.reporting.runs import Experiment, mean
from bcut.experiments.reporting.tables import Table

# Told apart by colour and by the pattern of their lines, also in print.
COLOURS = (
    "#33658a",
    "#d1603d",
    "#4f9d69",
    "#8a5a9e",
    "#c9a227",
    "#5b5f66",
    "#b23a6b",
    "#2a9d8f",
    "#7a4b2a",
    "#8d99ae",
)
_DASHES = ("-", "--", "-.", ":")
_LP, _SEPARATION, _ELSEWHERE = "#33658a", "#d1603d", "#c9ccd3"
_WIDTH = 8.0
STYLE: Any = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.sans-serif": ["Helvetica", "Arial", "DejaVu Sans"],
    "font.size": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e5ea",
    "axes.axisbelow": True,
}


def svg(figure: Figure, name: str) -> str:
    """Return a figure as an SVG element; `name` keeps its ids apart from those of other figures on the page."""
    stream = io.StringIO()
    with rc_context({**STYLE, "svg.hashsalt": name}):
        figure.savefig(stream, format="svg", metadata={"Date": None}, bbox_inches="tight", pad_inches=0.08)
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    # Groups are numbered anew in every figure, and nothing refers to them.
    text = re.sub(r'<g id="[^"]*">', "<g>", text)
    # The page decides on the size.
    head, bracket, rest = text.partition(">")
    return re.sub(r' (width|height)="[^"]*"', "", head) + bracket + rest


def _axes(height: float) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(_WIDTH, height))
    return figure, figure.add_subplot()


def _logarithmic(axes: Axes) -> None:
    """Make the horizontal axis logarithmic, with plain numbers at 1, 2, 5, 10, ..."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_locator(NullLocator())


def _line(position: int) -> dict[str, Any]:
    return {
        "color": COLOURS[position % len(COLOURS)],
        "linestyle": _DASHES[position // len(COLOURS) % len(_DASHES)],
        "linewidth": 1.8,
    }


def _bars_height(count: int) -> float:
    return 1.0 + 0.34 * count


def gap_chart(variants: Table) -> str | None:
    """Draw the mean share of the gap that each variant closes."""
    rows = [row for row in variants if row["gap_closed"] is not None][::-1]
    if not rows:
        return None
    with rc_context(STYLE):
        figure, axes = _axes(_bars_height(len(rows)))
        shares = [100 * row["gap_closed"] for row in rows]
        bars = axes.barh([row["variant"] for row in rows], shares, color=_LP, height=0.7)
        axes.bar_label(bars, fmt="%.1f %%", padding=4, fontsize=9)
        axes.set_xlim(min(0.0, *shares), 112)
        axes.set_xlabel("share of the gap between root LP and optimum that is closed, mean, %")
        axes.grid(axis="y", visible=False)
    return svg(figure, "gap")


def rounds_chart(experiment: Experiment) -> str | None:
    """Draw how the mean share of the gap closed grows from round to round."""
    curves = {}
    for name in experiment.variants:
        runs = [run for run in experiment.runs if run.variant == name and run.is_root and run.has_gap]
        shares = [[run.closed(lp) or 0.0 for lp, _ in run.outcome["rounds"]] for run in runs]
        shares = [values for values in shares if values]
        longest = max((len(values) for values in shares), default=0)
        if longest > 1:
            # A run that has ended keeps its bound.
            curves[name] = [
                mean([values[min(number, len(values) - 1)] for values in shares]) or 0.0
                for number in range(longest)
            ]
    if not curves:
        return None
    with rc_context(STYLE):
        figure, axes = _axes(4.2)
        for position, (name, shares_by_round) in enumerate(curves.items()):
            numbers = range(1, len(shares_by_round) + 1)
            axes.plot(numbers, [100 * share for share in shares_by_round], label=name, **_line(position))
        _logarithmic(axes)
        axes.set_xlabel("relaxation, in order")
        axes.set_ylabel("gap closed, mean, %")
        axes.legend(frameon=False, fontsize=9, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return svg(figure, "rounds")


def times_chart(times: Table) -> str | None:
    """Draw where the time of each variant went."""
    rows = [row for row in times if row["seconds"] > 0][::-1]
    if not rows:
        return None
    with rc_context(STYLE):
        figure, axes = _axes(_bars_height(len(rows)) + 0.5)
        names = [row["variant"] for row in rows]
        left = [0.0] * len(rows)
        for key, label, colour in (
            ("seconds_lp", "linear programs", _LP),
            ("seconds_separation", "separation", _SEPARATION),
            ("seconds_elsewhere", "elsewhere", _ELSEWHERE),
        ):
            values = [row[key] / row["runs"] for row in rows]
            axes.barh(names, values, left=left, color=colour, height=0.7, label=label)
            left = [a + b for a, b in zip(left, values, strict=True)]
        axes.set_xlabel("seconds per run, mean")
        axes.grid(axis="y", visible=False)
        axes.legend(frameon=False, fontsize=9, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return svg(figure, "times")


def profile_chart(profile: Table, kind: str) -> str | None:
    """Draw the performance profile of the variants of one kind: "root" or "solve"."""
    names = list(dict.fromkeys(row["variant"] for row in profile if row["kind"] == kind))
    if not names:
        return None
    with rc_context(STYLE):
        figure, axes = _axes(4.2)
        most = max(row["factor"] for row in profile if row["kind"] == kind)
        for position, name in enumerate(names):
            rows = [row for row in profile if (row["kind"], row["variant"]) == (kind, name)]
            factors = [1.0, *(row["factor"] for row in rows), max(2.0, 1.1 * most)]
            shares = [0.0, *(100 * row["share"] for row in rows)]
            axes.step(factors, [*shares, shares[-1]], where="post", label=name, **_line(position))
        _logarithmic(axes)
        axes.set_ylim(0, 103)
        axes.set_xlabel("within this factor of the fastest variant")
        axes.set_ylabel("settled, % of the problems")
        axes.legend(frameon=False, fontsize=9, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return svg(figure, f"profile-{kind}")


def ablation_chart(ablation: Table) -> str | None:
    """Draw what each separator closes alone, and what is lost without it."""
    rows = [row for row in ablation if row["gain_alone"] is not None or row["loss_without"] is not None][::-1]
    if not rows:
        return None
    with rc_context(STYLE):
        figure, axes = _axes(_bars_height(2 * len(rows)) + 0.3)
        places = range(len(rows))
        for key, label, colour, shift in (
            ("gain_alone", "closed by it alone", _LP, 0.19),
            ("loss_without", "lost without it", _SEPARATION, -0.19),
        ):
            values = [100 * (row[key] or 0.0) for row in rows]
            bars = axes.barh([p + shift for p in places], values, height=0.36, color=colour, label=label)
            axes.bar_label(bars, fmt="%.1f", padding=3, fontsize=8)
        axes.set_yticks(list(places), [row["separators"] for row in rows])
        axes.set_xlabel("share of the gap, mean, %")
        axes.grid(axis="y", visible=False)
        axes.margins(x=0.12)
        axes.legend(frameon=False, fontsize=9, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return svg(figure, "ablation")

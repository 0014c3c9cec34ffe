"""Tables about sizes: what was counted, how it grows with the number of points, and what classes of problems took."""

from __future__ import annotations

from collections.abc import Iterable
from math import log, sqrt
from typing import Any

import numpy as np

from bcut.experiments.cases import MEASURES
from bcut.experiments.reporting.runs import Experiment, Run, mean

Row = dict[str, Any]
Key = tuple[str, str, str, bool]


def sizes_table(experiment: Experiment) -> list[Row]:
    """One row for each class, variant and number of points: means over the instances, of all rows by kind."""
    rows = []
    for key, by_points in _counted(experiment).items():
        for points, runs in sorted(by_points.items()):
            columns = [float(run.outcome["columns"]) for run in runs]
            kinds = dict.fromkeys(kind for run in runs for kind in run.outcome["kinds"])
            counts = {kind: mean([run.outcome["kinds"].get(kind, 0) for run in runs]) for kind in kinds}
            rows.append(
                {
                    **_named(key),
                    "points": points,
                    "instances": len(runs),
                    **{measure: mean(_values(runs, measure)) for measure in MEASURES},
                    "least_columns": min(columns),
                    "most_columns": max(columns),
                    "columns_error": _standard_error(columns),
                    "rows_by_kind": ", ".join(f"{kind} {count:,.0f}" for kind, count in counts.items()),
                    "seconds": mean([run.seconds for run in runs]),
                }
            )
    return rows


def growth_table(experiment: Experiment) -> list[Row]:
    """One row for each class, variant and measure: the exponent of the number of points that it grows with.

    It is that of the power of the number of points which is closest to the means over the larger half of the
    numbers of points, in logarithms (least squares). Beside it stands the exponent that the plan gives as
    ``orders``.
    """
    rows = []
    for key, by_points in _counted(experiment).items():
        sizes = sorted(by_points)
        sizes = sizes[min(len(sizes) // 2, max(0, len(sizes) - 2)) :]
        if len(sizes) < 2:
            continue
        orders = by_points[sizes[0]][0].entry.get("orders", {})
        for measure in MEASURES:
            means = [mean(_values(by_points[points], measure)) for points in sizes]
            rows.append(
                {
                    **_named(key),
                    "measure": measure,
                    "from_points": sizes[0],
                    "to_points": sizes[-1],
                    "exponent": _slope(sizes, [value for value in means if value is not None]),
                    "order": orders.get(measure),
                }
            )
    return rows


def classes_table(experiment: Experiment) -> list[Row]:
    """One row for each class and variant of runs that solve: sizes, integral relaxations and processor time."""
    rows = []
    for label in experiment.labels:
        for variant in experiment.variants:
            runs = [run for run in experiment.runs if (run.label, run.variant) == (label, variant)]
            if not runs:
                continue
            seconds = [run.processor_seconds for run in runs]
            rows.append(
                {
                    "class": label,
                    "variant": variant,
                    "runs": len(runs),
                    "points": mean([run.record["instance"]["points"] for run in runs]),
                    **{measure: mean(_values(runs, measure)) for measure in MEASURES[:3]},
                    "integral": sum(bool(run.outcome["integral"]) for run in runs),
                    "settled": sum(run.settled for run in runs),
                    "processor_seconds": mean(seconds),
                    "longest": max(seconds),
                }
            )
    return rows


def _counted(experiment: Experiment) -> dict[Key, dict[int, list[Run]]]:
    """Return the runs that counted to the end: by class, variant, formulation and spanning, then by points."""
    found: dict[Key, dict[int, list[Run]]] = {}
    for run in experiment.runs:
        if run.only_counts and run.outcome["rows"] is not None:
            key = (run.label, run.variant, run.entry["formulation"], run.entry["spanning"])
            found.setdefault(key, {}).setdefault(run.record["instance"]["points"], []).append(run)
    return found


def _named(key: Key) -> Row:
    return dict(zip(("class", "variant", "formulation", "spanning"), key, strict=True))


def _values(runs: Iterable[Run], measure: str) -> list[float]:
    """Return a measure of each run that knows it."""
    if measure == "per_row":
        pairs = [(run.outcome["nonzeros"], run.outcome["rows"]) for run in runs]
        return [nonzeros / rows for nonzeros, rows in pairs if rows]
    values = [run.outcome.get(measure) for run in runs]
    return [float(value) for value in values if value is not None]


def _standard_error(values: list[float]) -> float | None:
    """Return the standard error of the mean; None of fewer than two values."""
    if len(values) < 2:
        return None
    return float(np.std(values, ddof=1)) / sqrt(len(values))


def _slope(sizes: list[int], values: list[float]) -> float | None:
    """Return the slope of the line of least squares through the logarithms; None where something is not positive."""
    if len(values) != len(sizes) or min(values) <= 0:
        return None
    return float(np.polyfit([log(size) for size in sizes], [log(value) for value in values], 1)[0])

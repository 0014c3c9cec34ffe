"""Pictures of fractional points with a violated cut, taken from the ledgers of an experiment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from bcut.experiments.ledger import Ledger, read_ledger
from bcut.experiments.reporting.charts import svg
from bcut.experiments.reporting.runs import Experiment, Run
from bcut.geometry.configuration import PointConfiguration
from bcut.plotting.fractional import draw_violated_cut

# Ledgers to look into, smallest instances first, before giving up on a dimension.
_TRIES = 12
_SIZE = 5.6


@dataclass(frozen=True)
class Picture:
    """A figure with its caption."""

    svg: str
    caption: str


def pictures(experiment: Experiment) -> list[Picture]:
    """Draw a fractional point with a cut that it violates, in the plane and in space, as far as there are ledgers."""
    found = (_picture(experiment, dimension) for dimension in (2, 3))
    return [picture for picture in found if picture is not None]


def _picture(experiment: Experiment, dimension: int) -> Picture | None:
    runs = [
        run
        for run in experiment.runs
        if run.entry["fingerprint"] in experiment.ledgers
        and run.record["instance"]["dimension"] == dimension
        and any(counts["taken"] for family, counts in run.record["cuts"].items() if ":" not in family)
    ]
    runs.sort(key=lambda run: run.record["instance"]["points"])
    for run in runs[:_TRIES]:
        ledger = read_ledger(experiment.ledgers[run.entry["fingerprint"]])
        chosen = _choose(ledger)
        if chosen is not None:
            return _draw(run, ledger, *chosen)
    return None


def _choose(ledger: Ledger) -> tuple[dict[str, Any], dict[str, Any]] | None:
    """Return a cut that was taken, violated much by few simplices, and the point it was found for."""
    points = {(point["node"], point["round"]): point for point in ledger.points}
    best: tuple[float, dict[str, Any], dict[str, Any]] | None = None
    for cut in ledger.cuts:
        point = points.get((cut["node"], cut["round"]))
        if not cut["taken"] or point is None or cut["violation"] is None:
            continue
        support = {tuple(simplex) for simplex in point["simplices"]}
        seen = sum(tuple(simplex) in support for simplex in cut["simplices"])
        score = cut["violation"] / max(1, seen)
        if seen and (best is None or score > best[0]):
            best = (score, cut, point)
    return None if best is None else (best[1], best[2])


def _draw(run: Run, ledger: Ledger, cut: dict[str, Any], point: dict[str, Any]) -> Picture:
    instance = ledger.header["instance"]
    configuration = PointConfiguration.from_values(instance["points"], name=instance["name"])
    coefficients = {
        tuple(simplex): value for simplex, value in zip(cut["simplices"], cut["coefficients"], strict=True)
    }
    simplices = np.array(point["simplices"], dtype=np.int64)
    weights = np.array([coefficients.get(tuple(simplex), 0) for simplex in point["simplices"]], dtype=float)
    proof = cut["proof"]
    face = proof.get("face", []) if isinstance(proof, dict) else []
    with rc_context({"font.family": "sans-serif"}):
        figure = Figure(figsize=(_SIZE, _SIZE))
        draw_violated_cut(
            figure,
            configuration.floats,
            simplices,
            np.array(point["values"], dtype=float),
            weights,
            face=face,
        )
    after = (
        "" if cut["lp_after"] is None else f"; with the cuts of this round it becomes {cut['lp_after']:.6g}"
    )
    caption = (
        f"{instance['name']}, variant {run.variant}: the point of relaxation {point['round']}, of value "
        f"{point['lp']:.6g}, with a {cut['family']} cut that it violates by {cut['violation']:.4g}{after}. "
        f"{int((weights != 0).sum())} of the {len(cut['simplices'])} simplices of the cut are in the point."
    )
    return Picture(svg(figure, f"point-{configuration.dimension}"), caption)

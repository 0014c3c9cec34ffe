"""The tables of a report, as lists of rows with the same keys: for the page, for CSV and for Parquet."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from bcut.experiments.reporting.measures import measured_table, measures_table
from bcut.experiments.reporting.runs import Experiment, Run, mean, shifted_geometric_mean
from bcut.experiments.reporting.sizes import classes_table, growth_table, sizes_table

Row = dict[str, Any]
Table = list[Row]

# Shifts of the geometric means, in seconds and nodes.
SHIFT_SECONDS, SHIFT_NODES = 1.0, 10.0


def all_tables(experiment: Experiment) -> dict[str, Table]:
    """Return every table by its name; those without rows are left out."""
    makers: dict[str, Callable[[Experiment], Table]] = {
        "variants": variants_table,
        "measures": measures_table,
        "classes": classes_table,
        "gap": gap_table,
        "ablation": ablation_table,
        "families": families_table,
        "times": times_table,
        "profile": profile_table,
        "rounds": rounds_table,
        "measured": measured_table,
        "runs": runs_table,
        "failures": lambda found: found.failures,
        "contradictions": lambda found: [contradiction.row() for contradiction in found.contradictions],
    }
    solving = replace(experiment, runs=[run for run in experiment.runs if not run.only_counts])
    tables = {name: make(solving) for name, make in makers.items()}
    tables |= {"sizes": sizes_table(experiment), "growth": growth_table(experiment)}
    return {name: table for name, table in tables.items() if table}


def runs_table(experiment: Experiment) -> Table:
    """One row for each run."""
    rows = []
    for run in experiment.runs:
        outcome = run.outcome
        own = outcome["separators"].values()
        rows.append(
            {
                "class": run.label,
                "instance": run.entry["instance"],
                "objective": run.entry["objective"],
                "sense": run.entry["sense"],
                "spanning": run.entry["spanning"],
                "variant": run.variant,
                "status": outcome["status"],
                "columns": outcome["columns"],
                "lp": outcome["lp"],
                "lp_after_cuts": outcome["lp_after_cuts"],
                "optimum": run.optimum,
                "gap_closed": run.gap_closed,
                "integral": outcome["integral"],
                "value": outcome["value"],
                "bound": outcome["bound"],
                "rounds": len(outcome["rounds"]),
                "nodes": outcome["nodes"],
                "cuts_found": sum(entry["found"] for entry in own),
                "cuts_added": sum(entry["added"] for entry in own),
                "seconds": run.seconds,
                "seconds_lp": outcome["seconds"]["lp"],
                "seconds_separation": outcome["seconds"]["separation"],
                "processor_seconds": run.processor_seconds,
                "fingerprint": run.entry["fingerprint"],
            }
        )
    return rows


def variants_table(experiment: Experiment) -> Table:
    """One row for each variant: what it closed and settled, and what it took."""
    rows = []
    for name in experiment.variants:
        runs = [run for run in experiment.runs if run.variant == name]
        if not runs:
            continue
        closed = [run.gap_closed for run in runs if run.gap_closed is not None]
        in_root = all(run.is_root for run in runs)
        rows.append(
            {
                "variant": name,
                "preset": runs[0].record["settings"]["preset"],
                "runs": len(runs),
                "with_gap": len(closed),
                "gap_closed": mean(closed),
                "settled": sum(run.settled for run in runs),
                "seconds": shifted_geometric_mean([run.seconds for run in runs], SHIFT_SECONDS),
                "processor_seconds": shifted_geometric_mean(
                    [run.processor_seconds for run in runs], SHIFT_SECONDS
                ),
                "nodes": None
                if in_root
                else shifted_geometric_mean([float(run.outcome["nodes"]) for run in runs], SHIFT_NODES),
                "failed": sum(failure["variant"] == name for failure in experiment.failures),
            }
        )
    return rows


def gap_table(experiment: Experiment) -> Table:
    """One row for each class and variant: the mean share of the gap closed at the root."""
    rows = []
    for label in experiment.labels:
        for name in experiment.variants:
            runs = [run for run in experiment.runs if (run.label, run.variant) == (label, name)]
            closed = [run.gap_closed for run in runs if run.gap_closed is not None]
            if closed:
                with_gap = [run for run in runs if run.gap_closed is not None]
                rows.append(
                    {
                        "class": label,
                        "variant": name,
                        "instances": len(closed),
                        "gap_closed": mean(closed),
                        "least": min(closed),
                        "entirely": sum(share >= 1 - 1e-6 for share in closed),
                        "settled": sum(run.settled for run in with_gap),
                        "seconds": shifted_geometric_mean([run.seconds for run in with_gap], SHIFT_SECONDS),
                    }
                )
    return rows


def ablation_table(experiment: Experiment) -> Table:
    """One row for each separator: what it closes alone, and what is lost without it."""
    roles = {variant["name"]: variant for variant in experiment.manifest["variants"] if variant["role"]}
    if not roles:
        return []
    closed: dict[tuple[str, str], float | None] = {}
    seconds: dict[tuple[str, str], float | None] = {}
    for name, variant in roles.items():
        runs = [run for run in experiment.runs if run.variant == name and run.gap_closed is not None]
        key = (variant["role"], variant["family"])
        closed[key] = mean([run.gap_closed for run in runs if run.gap_closed is not None])
        seconds[key] = shifted_geometric_mean([run.seconds for run in runs], SHIFT_SECONDS)
    everything, nothing = closed.get(("all", "")), closed.get(("none", ""))
    rows = [
        {
            "separators": name,
            "alone": value,
            "without": None,
            "gain_alone": None,
            "loss_without": None,
            "seconds_alone": seconds.get((role, "")),
            "seconds_without": None,
        }
        for name, role, value in (("none", "none", nothing), ("all", "all", everything))
    ]
    for family in dict.fromkeys(variant["family"] for variant in roles.values() if variant["family"]):
        alone, without = closed.get(("only", family)), closed.get(("without", family))
        rows.append(
            {
                "separators": family,
                "alone": alone,
                "without": without,
                "gain_alone": _difference(alone, nothing),
                "loss_without": _difference(everything, without),
                "seconds_alone": seconds.get(("only", family)),
                "seconds_without": seconds.get(("without", family)),
            }
        )
    return rows


def _difference(larger: float | None, smaller: float | None) -> float | None:
    return None if larger is None or smaller is None else round(larger - smaller, 9) + 0.0


def families_table(experiment: Experiment) -> Table:
    """One row for each variant and family: cuts found, added, in the last relaxation, tight there."""
    rows = []
    for name in experiment.variants:
        runs = [run for run in experiment.runs if run.variant == name]
        families = dict.fromkeys(family for run in runs for family in run.outcome["separators"])
        for family in families:
            entries = [
                run.outcome["separators"][family] for run in runs if family in run.outcome["separators"]
            ]
            counts = [run.record["cuts"].get(family, {}) for run in runs]
            recorded = any(run.record["settings"]["ledger"] and run.is_root for run in runs)
            rows.append(
                {
                    "variant": name,
                    "family": family,
                    "runs": len(entries),
                    "calls": sum(entry["calls"] for entry in entries),
                    "found": sum(entry["found"] for entry in entries),
                    "added": sum(entry["added"] for entry in entries),
                    "final": sum(count.get("final", 0) for count in counts) if recorded else None,
                    "active": sum(count.get("active", 0) for count in counts) if recorded else None,
                    "seconds": sum(entry["seconds"] for entry in entries),
                }
            )
    return rows


def times_table(experiment: Experiment) -> Table:
    """One row for each variant: seconds in linear programs, in separators, and elsewhere, over all runs."""
    rows = []
    for name in experiment.variants:
        runs = [run for run in experiment.runs if run.variant == name]
        if not runs:
            continue
        total = sum(run.seconds for run in runs)
        lp = sum(run.outcome["seconds"]["lp"] for run in runs)
        separation = sum(run.outcome["seconds"]["separation"] for run in runs)
        rows.append(
            {
                "variant": name,
                "runs": len(runs),
                "seconds_lp": lp,
                "seconds_separation": separation,
                "seconds_elsewhere": max(0.0, total - lp - separation),
                "seconds": total,
            }
        )
    return rows


def rounds_table(experiment: Experiment) -> Table:
    """One row for each relaxation at the root: its value, the share of the gap closed, and the cuts then added."""
    return [
        {
            "class": run.label,
            "instance": run.entry["instance"],
            "objective": run.entry["objective"],
            "variant": run.variant,
            "round": number,
            "lp": lp,
            "gap_closed": run.closed(lp),
            "cuts": sum(cuts.values()),
        }
        for run in experiment.runs
        if run.is_root
        for number, (lp, cuts) in enumerate(run.outcome["rounds"])
    ]


def profile_table(experiment: Experiment) -> Table:
    """Return performance profiles (Dolan and Moré): the share of problems settled within a factor of the fastest.

    Variants of the root and those that solve are compared among themselves. Only problems that all of them have run
    count, and only those that some variant settled.
    """
    rows: Table = []
    for in_root in (True, False):
        names = [
            name
            for name in experiment.variants
            if any(run.variant == name and run.is_root == in_root for run in experiment.runs)
        ]
        times = _times(experiment, names)
        if len(names) < 2 or not times:
            continue
        ratios: dict[str, list[float]] = {name: [] for name in names}
        for settled in times:
            best = min(settled.values())
            for name, seconds in settled.items():
                ratios[name].append(seconds / best)
        kind = "root" if in_root else "solve"
        for name in names:
            ordered = sorted(ratios[name])
            rows.extend(
                {"kind": kind, "variant": name, "factor": ratio, "share": (position + 1) / len(times)}
                for position, ratio in enumerate(ordered)
            )
    return rows


def _times(experiment: Experiment, names: list[str]) -> list[dict[str, float]]:
    """Return processor seconds of the variants that settled each problem, for problems that all have run."""
    by_problem: dict[tuple[str, str, str, bool], dict[str, Run]] = {}
    for run in experiment.runs:
        entry = run.entry
        key = (entry["instance"], entry["objective"], entry["sense"], entry["spanning"])
        by_problem.setdefault(key, {})[run.variant] = run
    found = []
    for runs in by_problem.values():
        if all(name in runs for name in names):
            settled = {name: max(runs[name].processor_seconds, 1e-3) for name in names if runs[name].settled}
            if settled:
                found.append(settled)
    return found

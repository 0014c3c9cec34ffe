"""The tables of the cut laboratory as they stand in the documentation, from stored runs.

    python experiments/laboratory_tables.py results

Looks into the folders ``ablation-root``, ``parity``, ``strategy``, ``hard``, ``symmetric-root`` and
``min-cardinality`` of the one given, which are the results of the plans of these names, and puts a table for each that
is there between the lines ``<!-- NAME -->`` and ``<!-- end of NAME -->`` of the pages in ``docs/``. Where no page has
such lines it prints the table.
"""

from __future__ import annotations

import argparse
import functools
import json
import math
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from bcut.experiments.reporting.runs import Experiment, Run, load_experiment, mean, shifted_geometric_mean

HOME = Path(__file__).resolve().parent.parent
DOCS = HOME / "docs"
# Shifts of geometric means, in seconds and in nodes.
SECONDS, NODES = 1.0, 10.0


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numbers_from: int = 1) -> str:
    """Return a Markdown table whose columns are flushed right from some on."""
    marks = ["---"] * numbers_from + ["---:"] * (len(head) - numbers_from)
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, marks, *rows))


def share(value: float | None) -> str:
    """Show a share in per cent; no more digits than it has, and 100 only where it is that."""
    if value is None:
        return ""
    if value > 0.9995 and value < 1:
        return "99.9 %"
    return f"{number(round(100 * value, 1))} %"


def number(value: float | None) -> str:
    """Show a bound or a value."""
    return "" if value is None else f"{value + 0.0:.3f}".rstrip("0").rstrip(".")


def of_variant(experiment: Experiment, name: str) -> list[Run]:
    """Return the runs of a variant."""
    return [run for run in experiment.runs if run.variant == name]


def foot(experiment: Experiment) -> str:
    """Say with what, on what, and over how many runs a table was measured."""
    codes = {tuple(sorted(run.record["code"].items())) for run in experiment.runs}
    machines = {
        (run.record["machine"]["processor"], run.record["machine"]["cores"]) for run in experiment.runs
    }
    limits = {run.record["settings"]["time_limit"] or math.inf for run in experiment.runs}
    versions = " / ".join(
        f"bcut {code['bcut']} (sources {code['sources'][:8]}), SCIP {code['scip']}, HiGHS {code['highs']}"
        for code in map(dict, sorted(codes))
    )
    where = " / ".join(f"{processor}, {cores} cores" for processor, cores in sorted(machines))
    missing = f"; {experiment.missing} runs not done" if experiment.missing else ""
    failed = f"; {len(experiment.failures)} failed" if experiment.failures else ""
    plan = f"`experiments/{experiment.manifest['name']}.toml`"
    seconds = ", ".join("none" if limit == math.inf else f"{limit:g} s" for limit in sorted(limits))
    return (
        f"{len(experiment.runs)} runs of {plan}{missing}{failed}; {versions}; a shared {where}; "
        f"limit {seconds} a run; seconds are processor time unless called wall time, and means of them geometric, "
        "shifted by one."
    )


def roots(experiment: Experiment) -> str:
    """Compare variants by the share of the root gap that they close."""
    rows = []
    for name in experiment.variants:
        runs = [run for run in of_variant(experiment, name) if run.gap_closed is not None]
        if not runs:
            continue
        closed = [run.gap_closed for run in runs if run.gap_closed is not None]
        stopped = [run for run in runs if run.outcome["status"] == "limit" and _is_loop(run)]
        rows.append(
            (
                name,
                share(mean(closed)),
                f"{sum(value >= 1 - 1e-6 for value in closed)} of {len(closed)}",
                f"{sum(bool(run.outcome['integral']) for run in runs)}",
                number(shifted_geometric_mean([run.seconds for run in runs], SECONDS)),
                f"{len(stopped)}",
            )
        )
    head = ("variant", "gap closed, mean", "entirely", "integral", "wall seconds", "at the limit")
    return table(head, rows)


def _is_loop(run: Run) -> bool:
    # SCIP's root always ends at a limit: that of one node.
    return bool(run.record["settings"]["preset"] == "loop")


def classes(experiment: Experiment) -> str:
    """Compare the variants with one family, or none of ours, class by class."""
    roles = {variant["name"]: variant["role"] for variant in experiment.manifest["variants"]}
    shown = [name for name in experiment.variants if roles[name] in ("only", "all", "")]
    rows = []
    for label in experiment.labels:
        cells = []
        for name in shown:
            closed = [run.gap_closed for run in of_variant(experiment, name) if run.label == label]
            known = [value for value in closed if value is not None]
            cells.append(share(mean(known)).removesuffix(" %"))
        count = sum(run.label == label for run in of_variant(experiment, shown[0]))
        rows.append((f"{label} ({count})", *cells))
    return table(
        ("class (instances), per cent closed", *(name.removeprefix("only ") for name in shown)), rows
    )


def solves(experiment: Experiment) -> str:
    """Compare variants that solve, class by class: how many they settle, and in what time."""
    rows = []
    for label in (*experiment.labels, ""):
        cells = []
        for name in experiment.variants:
            runs = [run for run in of_variant(experiment, name) if label in ("", run.label)]
            seconds = shifted_geometric_mean([run.processor_seconds for run in runs], SECONDS)
            solved = sum(run.settled for run in runs)
            open_ = "" if solved == len(runs) else f" ({len(runs) - solved} open)"
            cells.append(f"{seconds:.2f}{open_}" if seconds is not None else "")
        count = sum(label in ("", run.label) for run in of_variant(experiment, experiment.variants[0]))
        rows.append((f"{label or 'all'} ({count})", *cells))
    return table(("class (instances), seconds", *experiment.variants), rows)


def instances(experiment: Experiment) -> str:
    """Put the variants side by side, instance by instance."""
    rows = []
    keys = dict.fromkeys(
        (run.entry["instance"], run.entry["sense"], run.entry["spanning"]) for run in experiment.runs
    )
    for key in keys:
        runs = {
            run.variant: run
            for run in experiment.runs
            if (run.entry["instance"], run.entry["sense"], run.entry["spanning"]) == key
        }
        first = next(iter(runs.values()))
        cells = [_outcome(runs.get(name)) for name in experiment.variants]
        name = f"`{key[0]}`, {'minimum' if key[1] == 'min' else 'maximum'}"
        # Where bounds come from multipliers, or from SCIP after its presolve, no run tells the value of the relaxation.
        lp = first.lp if first.lp is not None else known_lps().get((first.entry["objective"], *key))
        rows.append((name, number(lp), number(first.optimum) or "open", *cells))
    return table(("instance", "root LP", "optimum", *experiment.variants), rows)


@functools.cache
def known_lps() -> dict[tuple[str, str, str, bool], float]:
    """Return the root LPs of the members of the hard set, by objective, instance, sense, and "spanning"."""
    members = json.loads((HOME / "instances" / "hard-set.json").read_text(encoding="utf-8"))["members"]
    asked = ("objective", "instance", "sense", "spanning")
    return {tuple(member[key] for key in asked): member["lp"] for member in members}


def _outcome(run: Run | None) -> str:
    if run is None:
        return "–"
    outcome, seconds = run.outcome, run.processor_seconds
    if run.is_root:
        stopped = ", limit" if outcome["status"] == "limit" and seconds > 5 else ""
        return f"{number(outcome['lp_after_cuts'])} ({seconds:.1f} s{stopped})"
    nodes = "1 node" if outcome["nodes"] == 1 else f"{outcome['nodes']} nodes"
    if run.settled:
        return f"{seconds:.1f} s, {nodes}"
    value, bound = number(outcome["value"]) or "–", outcome["bound"]
    pair = (value, number(bound)) if run.entry["sense"] == "max" else (number(bound), value)
    return f"{pair[0]}..{pair[1]} at {seconds:.0f} s, {nodes}"


def totals(experiment: Experiment) -> str:
    """Sum up what whole solves took: for each variant, instances settled, nodes, and seconds."""
    rows = []
    for name in experiment.variants:
        runs = of_variant(experiment, name)
        nodes = shifted_geometric_mean([float(run.outcome["nodes"]) for run in runs], NODES)
        rows.append(
            (
                name,
                f"{sum(run.settled for run in runs)} of {len(runs)}",
                number(shifted_geometric_mean([run.processor_seconds for run in runs], SECONDS)),
                f"{sum(run.processor_seconds for run in runs):,.0f}",
                number(nodes),
            )
        )
    return table(("variant", "settled", "seconds, mean", "seconds, sum", "nodes, mean"), rows)


TABLES: dict[str, tuple[str, Sequence[Callable[[Experiment], str]]]] = {
    "ablation": ("ablation-root", (roots, foot)),
    "ablation by class": ("ablation-root", (classes,)),
    "parity": ("parity", (roots, foot)),
    "strategy": ("strategy", (solves, foot)),
    "hard": ("hard", (totals, foot)),
    "hard instances": ("hard", (instances,)),
    "symmetric roots": ("symmetric-root", (instances, foot)),
    "minimum cardinality": ("min-cardinality", (solves, instances, foot)),
}


def main(arguments: Any = None) -> None:
    """Fill in every table whose experiment is there."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("results", type=Path, help="the folder with the folders of the experiments")
    folder = parser.parse_args(arguments).results
    for name, (plan, makers) in TABLES.items():
        if not (folder / plan / "experiment.json").exists():
            continue
        experiment = load_experiment(folder / plan)
        if not experiment.runs:
            continue
        text = "\n\n".join(maker(experiment) for maker in makers)
        if not _fill(name, text):
            print(f"{name}\n\n{text}\n")


def _fill(name: str, text: str) -> bool:
    """Put a table between its lines; tell whether there is such a place."""
    place = re.compile(rf"(<!-- {re.escape(name)} -->\n).*?(\n?<!-- end of {re.escape(name)} -->)", re.DOTALL)
    found = False
    for page in sorted(DOCS.glob("*.md")):
        before = page.read_text(encoding="utf-8")
        after = place.sub(lambda match: f"{match[1]}{text}\n{match[2].lstrip()}", before)
        found = found or place.search(before) is not None
        if after != before:
            page.write_text(after, encoding="utf-8")
    return found


if __name__ == "__main__":
    main()

"""Choose the gap set, or the hard set, from the stored runs of an experiment that solved candidates to the optimum.

    bcut experiment run experiments/gap-set-candidates.toml --output results/candidates
    python experiments/find_gap_set.py results/candidates --output instances/gap-set.json

The gap set has the candidates whose root LP differs from the optimum. The hard set (``--hard``) has those among them
whose optimum is not the root LP rounded, those that the experiment did not solve within its limit, and whatever is
given by ``--with FILE``, a collection of the same form.
"""

from __future__ import annotations

import argparse
import json
from math import ceil, floor
from pathlib import Path
from typing import Any

from bcut.experiments.reporting.runs import Experiment, Run, load_experiment

# Of a gap, relative to the optimum: smaller ones are rounding.
_SMALLEST = 1e-6


def member(run: Run) -> dict[str, Any]:
    """Describe a problem as a member of a collection."""
    entry, outcome = run.entry, run.outcome
    described = {
        "instance": entry["instance"],
        "class": entry["class"],
        "objective": entry["objective"],
        "sense": entry["sense"],
        "spanning": entry["spanning"],
        "columns": outcome["columns"],
        "lp": outcome["lp"],
    }
    if outcome["status"] == "optimal":
        return {**described, "optimum": outcome["value"]}
    return {**described, "bound": outcome["bound"], "note": f"best known {outcome['value']}"}


def has_gap(run: Run) -> bool:
    """Tell whether the root LP is below the optimum (above it, for a maximum)."""
    lp, value = run.outcome["lp"], run.outcome["value"]
    return lp is not None and value is not None and abs(value - lp) > _SMALLEST * max(1.0, abs(value))


def is_hard(run: Run) -> bool:
    """Tell whether rounding the root LP does not give the optimum of a problem that counts simplices."""
    lp, value = run.outcome["lp"], run.outcome["value"]
    if run.outcome["status"] != "optimal":
        return True
    if run.entry["objective"] != "cardinality" or lp is None:
        return False
    rounded = ceil(lp - _SMALLEST) if run.entry["sense"] == "min" else floor(lp + _SMALLEST)
    return bool(rounded != value)


def choose(experiment: Experiment, *, hard: bool) -> list[dict[str, Any]]:
    """Return the members, in the order of the plan."""
    chosen = [run for run in experiment.runs if (is_hard(run) if hard else has_gap(run))]
    return [member(run) for run in chosen if hard or run.outcome["status"] == "optimal"]


def write(path: Path, head: dict[str, Any], members: list[dict[str, Any]]) -> None:
    """Write a collection, one member a line."""
    lines = ",\n".join("  " + json.dumps(entry) for entry in members)
    top = json.dumps(head, indent=1)[:-2]
    path.write_text(f'{top},\n "members": [\n{lines}\n ]\n}}\n', encoding="utf-8")


def main() -> None:
    """Choose, and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="folder of the experiment")
    parser.add_argument("--output", type=Path, required=True, help="the collection to write")
    parser.add_argument("--hard", action="store_true", help="choose the hard set")
    parser.add_argument("--with", dest="further", type=Path, help="a collection with further members")
    options = parser.parse_args()
    experiment = load_experiment(options.folder)
    members = choose(experiment, hard=options.hard)
    if options.further is not None:
        members += json.loads(options.further.read_text(encoding="utf-8"))["members"]
    code = experiment.manifest["code"]
    counted: dict[str, list[int]] = {}
    for run in experiment.runs:
        counted.setdefault(run.label, [0, 0])[1] += 1
    for entry in members:
        counted.setdefault(entry["class"], [0, 0])[0] += 1
    kind = "root LP rounded is not the optimum" if options.hard else "root LP differs from the optimum"
    head = {
        "name": options.output.stem,
        "description": f"Problems whose {kind}"
        + (", and larger ones." if options.further is not None else "."),
        "found_by": "python experiments/find_gap_set.py; lp is the root LP of formulation 2 without cuts, the optimum "
        f"was proven by bcut solve {code['bcut']} with SCIP {code['scip']} and HiGHS {code['highs']}",
        "chosen": {
            label: f"{some} of {all_}" if all_ else str(some) for label, (some, all_) in counted.items()
        },
    }
    write(options.output, head, members)
    for label, chosen in head["chosen"].items():
        print(f"{label}: {chosen}")


if __name__ == "__main__":
    main()

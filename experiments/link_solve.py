"""Minimum cardinality of random points to a proven optimum: `bcut` beside SCIP alone on the exported model.

Spanning triangulations of ``random:n,3,seed=s``. Each run is a process of its own. SCIP reads the model that
``bcut export`` wrote and runs with its defaults.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

from runs import run_all

SIZES = (24, 30)
SEEDS = range(10)

SCIP_ALONE = """
import json, sys
from pyscipopt import Model
model = Model()
model.hideOutput()
model.readProblem(sys.argv[1])
model.setParam("limits/time", float(sys.argv[2]))
model.optimize()
value = model.getObjVal() if model.getNSols() else None
facts = {"status": model.getStatus(), "value": value, "bound": model.getDualbound(), "nodes": model.getNTotalNodes()}
print(json.dumps(facts))
"""


def run(command: list[str]) -> tuple[dict[str, Any], float]:
    """Run a process that prints one JSON object; return it with the seconds that the process took."""
    started = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    seconds = time.perf_counter() - started
    if done.returncode not in (0, 3):
        raise RuntimeError(f"{' '.join(command)} ended with {done.returncode}: {done.stderr}")
    return json.loads(done.stdout), seconds


def with_bcut(instance: str, limit: float) -> dict[str, Any]:
    """Solve with the program's defaults."""
    command = [
        sys.executable,
        "-m",
        "bcut",
        "solve",
        instance,
        "--spanning",
        "--json",
        "--time-limit",
        str(limit),
    ]
    result, seconds = run(command)
    where = None
    if result["status"] == "optimal":
        where = "tree" if result["nodes"] > 1 else "root of SCIP" if result["nodes"] else "root"
    return {
        "status": result["status"],
        "value": result["value"],
        "bound": result["bound"],
        "lp": result["root"]["lp"],
        "proven": where,
        "nodes": result["nodes"],
        "separation_seconds": sum(family["seconds"] for family in result["separators"].values()),
        "seconds": seconds,
    }


def with_scip(instance: str, limit: float) -> dict[str, Any]:
    """Solve the exported model with SCIP's defaults."""
    with tempfile.TemporaryDirectory() as folder:
        model = str(Path(folder) / "model.lp")
        subprocess.run([sys.executable, "-m", "bcut", "export", instance, model, "--spanning"], check=True)
        result, seconds = run([sys.executable, "-c", SCIP_ALONE, model, str(limit)])
    return {**result, "seconds": seconds}


def measure(n: int, seed: int, *, limit: float, scip_limit: float) -> dict[str, Any]:
    """Run both on one instance."""
    instance = f"random:{n},3,seed={seed}"
    return {"bcut": with_bcut(instance, limit), "scip": with_scip(instance, scip_limit)}


def table(records: list[dict[str, Any]]) -> str:
    """Write one row per instance."""
    head = "| n | seed | root LP | bcut | proven at | seconds | separating | SCIP alone | seconds |"
    lines = [head, "|" + "---|" * 9]
    for record in records:
        n, seed = record["key"]
        ours, scip = record["bcut"], record["scip"]
        found = "–" if scip["value"] is None else f"{scip['value']:.0f}"
        theirs = found if scip["status"] == "optimal" else f"{found}, bound {scip['bound']:.2f}"
        value = ours["value"] if ours["status"] == "optimal" else f"{ours['value']}, bound {ours['bound']}"
        share = 100 * ours["separation_seconds"] / ours["seconds"]
        lines.append(
            f"| {n} | {seed} | {ours['lp']:.4f} | {value} | {ours['proven'] or '–'} | {ours['seconds']:.1f} "
            f"| {share:.0f} % | {theirs} | {scip['seconds']:.1f} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Run the experiment and print its table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True, help="folder for the results")
    parser.add_argument("--limit", type=float, default=1800.0, help="seconds for bcut on each instance")
    parser.add_argument(
        "--scip-limit", type=float, default=1800.0, help="seconds for SCIP alone on each instance"
    )
    options = parser.parse_args()
    keys = [(n, seed) for n in SIZES for seed in SEEDS]
    job = partial(measure, limit=options.limit, scip_limit=options.scip_limit)
    print(table(run_all(keys, job, options.output / "runs.jsonl")))


if __name__ == "__main__":
    main()

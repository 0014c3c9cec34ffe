"""How much of the root gap link cuts close, and how much zero-half, clique and odd-cycle cuts.

Minimum cardinality of spanning triangulations of ``random:n,3,seed=s``. An instance counts when its root LP is
fractional in value: below the optimum by more than 1e-6. All variants start from the same LP over all empty simplices;
no branching, no presolve, no heuristics.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from runs import run_all

import bcut
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.instance import load_instance
from bcut.objectives.objective import make_objective
from bcut.scip.host import TreeOptions, branch_and_cut

SIZES = (16, 18, 20, 22, 24)
SEEDS = range(30)


def bound_with(instance: str, separators: list[str], limit: float) -> dict[str, Any]:
    """Run the plain cutting-plane loop."""
    result = bcut.bound(instance, spanning=True, separators=separators, time_limit=limit)
    cuts = sum(family["added"] for family in result.separators.values())
    return {
        "lp": result.root.lp_after_cuts,
        "rounds": len(result.root.rounds),
        "cuts": cuts,
        "separation_seconds": sum(family["seconds"] for family in result.separators.values()),
        "integral": result.root.integral,
    }


def zero_half(instance: str, limit: float) -> dict[str, Any]:
    """Run SCIP's zero-half separator at the root without limits on rounds or cuts."""
    formulation = cocircuit_formulation(load_instance(instance), spanning=True)
    objective = make_objective("cardinality", formulation)
    options = TreeOptions(
        nodes=1,
        presolve=False,
        heuristics=False,
        scip_separators=False,
        unlimited=("zerohalf",),
        seconds=limit,
    )
    tree = branch_and_cut(formulation, objective, options=options)
    values = [finished.lp for finished in tree.rounds]
    return {"lp": max(values, default=None), "rounds": len(values), "integral": tree.status == "optimal"}


VARIANTS: dict[str, Callable[[str, float], dict[str, Any]]] = {
    "link": lambda instance, limit: bound_with(instance, ["link"], limit),
    "zero-half": zero_half,
    "clique + odd-cycle": lambda instance, limit: bound_with(instance, ["clique", "odd-cycle"], limit),
}


def measure(n: int, seed: int, limit: float) -> dict[str, Any]:
    """Solve one instance; where its root LP is fractional, run every variant."""
    instance = f"random:{n},3,seed={seed}"
    solved = bcut.solve(instance, spanning=True)
    assert solved.optimal
    assert isinstance(solved.value, int)
    assert solved.root.lp is not None
    record: dict[str, Any] = {"lp": solved.root.lp, "optimum": solved.value, "variants": {}}
    if solved.value - solved.root.lp > 1e-6:
        for name, variant in VARIANTS.items():
            started = time.perf_counter()
            found = variant(instance, limit)
            share = (found["lp"] - solved.root.lp) / (solved.value - solved.root.lp)
            record["variants"][name] = {**found, "share": share, "seconds": time.perf_counter() - started}
    return record


def table(records: list[dict[str, Any]]) -> str:
    """Write the means by size as a table."""
    lines = [
        "| n | fractional | "
        + " | ".join(f"{name}: gap closed, integral, seconds" for name in VARIANTS)
        + " |"
    ]
    lines.append("|---|---|" + "---|" * len(VARIANTS))
    for n in (*SIZES, "all"):
        group = [r for r in records if r["variants"] and n in (r["key"][0], "all")]
        if not group:
            continue
        cells = []
        for name in VARIANTS:
            found = [record["variants"][name] for record in group]
            share = sum(f["share"] for f in found) / len(found)
            seconds = sum(f["seconds"] for f in found) / len(found)
            cells.append(
                f"{100 * share:.1f} %, {sum(f['integral'] for f in found)} of {len(found)}, {seconds:.1f}"
            )
        total = sum(n in (r["key"][0], "all") for r in records)
        lines.append(f"| {n} | {len(group)} of {total} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Run the experiment and print its table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True, help="folder for the results")
    parser.add_argument(
        "--limit", type=float, default=120.0, help="seconds for each variant on each instance"
    )
    options = parser.parse_args()
    keys = [(n, seed) for n in SIZES for seed in SEEDS]
    records = run_all(keys, lambda n, seed: measure(n, seed, options.limit), options.output / "runs.jsonl")
    print(table(records))


if __name__ == "__main__":
    main()

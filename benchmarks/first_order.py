"""The linear relaxation of millions of columns: `bcut.bounds.first_order` beside HiGHS, one process for each run.

Everybody gets the same program (Formulation 2, all points used) and is asked for a relative accuracy of 1e-4. Seconds
are processor seconds of one thread, from the arrays or the loaded model to the multipliers; ours include loading the
compiled kernels and making the coverage rows. "Gap" is what the multipliers prove, after the same repair for all, below
the best value known.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from typing import Any

import numpy as np

from bcut.bounds.columns import Columns
from bcut.bounds.coverage_points import coverage_points
from bcut.bounds.first_order import first_order_bound
from bcut.bounds.repair import Program, Repair
from bcut.formulations.compact import CompactProgram, compact_program
from bcut.instance import load_instance
from bcut.objectives.objective import make_objective

# Instance, objective, and whether HiGHS is given a try.
CASES = [
    ("random:160,2,seed=1", "weight", True),
    ("random:320,2,seed=1", "weight", True),
    ("random:640,2,seed=1", "weight", False),
    ("random:30,3,seed=1", "weight", True),
    ("random:40,3,seed=1", "weight", True),
    ("random:50,3,seed=1", "weight", True),
    ("random:80,3,seed=1", "weight", False),
    ("random:100,3,seed=1", "weight", False),
    ("random:120,3,seed=1", "weight", False),
    ("random:30,3,seed=1", "cardinality", True),
    ("random:40,3,seed=1", "cardinality", True),
    ("random:50,3,seed=1", "cardinality", True),
    ("random:20,4,seed=1", "cardinality", True),
]
WAYS = ("first-order", "pdlp", "ipm", "without")
TOLERANCE = 1e-4


def linear_program(listed: CompactProgram, costs: np.ndarray) -> Program:
    """Return the relaxation."""
    columns = Columns.of_facets(listed.facet_rows, listed.facet_signs, listed.coverage, len(listed.row_faces))
    sides = np.zeros(columns.rows)
    sides[0] = 1.0
    return Program(columns, costs, sides, sides.copy(), 1.0)


def by_highs(listed: CompactProgram, costs: np.ndarray, solver: str, limit: float) -> dict[str, Any]:
    """Let one of HiGHS's methods find multipliers, without presolve, which finds nothing to remove."""
    import highspy

    matrix = listed.matrix()
    model = highspy.HighsLp()
    model.num_row_, model.num_col_ = matrix.shape
    model.col_cost_ = costs
    model.col_lower_, model.col_upper_ = np.zeros(len(costs)), np.full(len(costs), np.inf)
    sides = np.zeros(matrix.shape[0])
    sides[0] = 1.0
    model.row_lower_, model.row_upper_ = sides, sides
    model.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    model.a_matrix_.start_, model.a_matrix_.index_ = matrix.indptr, matrix.indices
    model.a_matrix_.value_ = matrix.data.astype(float)
    highs = highspy.Highs()
    options = {
        "output_flag": False,
        "threads": 1,
        "presolve": "off",
        "solver": solver,
        "run_crossover": "off",
        "kkt_tolerance": TOLERANCE,
        "time_limit": limit,
    }
    for name, value in options.items():
        highs.setOptionValue(name, value)
    highs.passModel(model)
    started = time.process_time()
    highs.run()
    seconds = time.process_time() - started
    finished = highs.getModelStatus() != highspy.HighsModelStatus.kTimeLimit
    duals = np.array(highs.getSolution().row_dual)
    bound, _ = (
        Repair(linear_program(listed, costs)).repaired(duals) if len(duals) == len(sides) else (0, None)
    )
    iterations = highs.getInfo().pdlp_iteration_count if solver == "pdlp" else 0
    return {"seconds": seconds, "finished": finished, "bound": bound, "iterations": iterations}


def by_first_order(listed: CompactProgram, costs: np.ndarray, points: bool, limit: float) -> dict[str, Any]:
    """Find multipliers, with or without coverage points."""
    started = time.process_time()
    program = linear_program(listed, costs)
    if points:
        program = program.with_combinations(coverage_points(listed))
    found = first_order_bound(program, tolerance=TOLERANCE, seconds=limit)
    seconds = time.process_time() - started
    finished = found.status == "converged"
    return {"seconds": seconds, "finished": finished, "bound": found.bound, "iterations": found.iterations}


def measure(name: str, objective: str, way: str, limit: float) -> dict[str, Any]:
    """Measure one way in this process."""
    listed = compact_program(load_instance(name), spanning=True)
    costs = make_objective(objective, listed).costs
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    if way in ("first-order", "without"):
        result = by_first_order(listed, costs, way == "first-order", limit)
    else:
        result = by_highs(listed, costs, way, limit)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    return {**result, "columns": len(costs), "rows": listed.size[1], "bytes": 1024 * peak / len(costs)}


def in_process(*arguments: str) -> dict[str, Any]:
    """Call `measure` in a process of its own, with one thread."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, __file__, "--one", *arguments]
    finished = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    answer: dict[str, Any] = json.loads(finished.stdout)
    return answer


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--limit", type=float, default=300.0, help="seconds for each run")
    parser.add_argument("--only", help="only instances whose name or objective contains this")
    parser.add_argument(
        "--one", nargs=4, metavar=("NAME", "OBJECTIVE", "WAY", "LIMIT"), help=argparse.SUPPRESS
    )
    options = parser.parse_args()
    if options.one:
        name, objective, way, limit = options.one
        print(json.dumps(measure(name, objective, way, float(limit))))
        return
    # The machine code of the kernels is made once for each installation.
    for name in ("random:8,2", "random:8,3", "random:9,4"):
        in_process(name, "cardinality", "first-order", "60")
    print("| instance | objective | columns | rows | first-order | iterations | bytes | gap |", end="")
    print(" without points | PDLP | gap | interior point | gap | ratios |")
    print("|---" * 14 + "|")
    for name, objective, everybody in CASES:
        if options.only and options.only not in name + objective:
            continue
        ways = WAYS if everybody else WAYS[:1]
        found = {way: in_process(name, objective, way, str(options.limit)) for way in ways}
        print(row(name, objective, found), flush=True)


def row(name: str, objective: str, found: dict[str, dict[str, Any]]) -> str:
    """Return a row of the table."""
    best = max(result["bound"] for result in found.values())
    first = found["first-order"]

    def gap(way: str) -> str:
        # The best value known is its own where nobody else was asked.
        return f"{(best - found[way]['bound']) / best:.0e}" if len(found) > 1 else "–"

    def cells(way: str) -> str:
        if way not in found:
            return "– | –"
        return f"{seconds(found[way])} | {gap(way)}"

    def seconds(result: dict[str, Any]) -> str:
        return f"{'' if result['finished'] else '> '}{result['seconds']:.1f}"

    without = (
        f"{seconds(found['without'])} ({found['without']['iterations']:,})" if "without" in found else "–"
    )
    ratios = ", ".join(
        f"{'' if found[way]['finished'] else '> '}{found[way]['seconds'] / first['seconds']:.0f}"
        for way in ("pdlp", "ipm")
        if way in found
    )
    return (
        f"| `{name}` | {objective} | {first['columns']:,} | {first['rows']:,} | {seconds(first)} "
        f"| {first['iterations']:,} | {first['bytes']:.0f} | {gap('first-order')} | {without} "
        f"| {cells('pdlp')} | {cells('ipm')} | {ratios or '–'} |"
    )


if __name__ == "__main__":
    main()

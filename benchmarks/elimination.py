"""Minimum weight triangulations of the plane: with elimination of edges, and without it.

Every line is one instance. Times are processor seconds of whole processes, `bcut solve INSTANCE --objective weight
--spanning --method METHOD`, Python's start and the exact check of the triangulation included; medians of some runs. A
run that the time limit ends counts as a lower bound, marked with ">". All methods that end must find the same value.

The columns before them say what elimination leaves: pairs of points, edges after the diamond test, possible and
certain edges after the LMT-skeleton; empty triangles after the one and after the other; faces solved by dynamic
programming, and those left to the integer program.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from bcut.instance import load_instance
from bcut.solving.by_elimination import minimum_weight_triangulation_2d

SIDE_BY_SIDE = [f"random:{n},2,seed=1" for n in (80, 160, 320)]
ALONE = ["random:1000,2,seed=1", "random:10000,2,seed=1", "grid:40,40"]
OTHERS = ("listing", "fixing")


def run(instance: str, method: str, limit: float) -> tuple[float, float, float | None, float]:
    """Solve in a process of its own; return processor seconds, seconds, the value, GiB. No value at the limit."""
    command = [sys.executable, "-m", "bcut", "solve", instance, "--objective", "weight", "--spanning"]
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "result.json"
        command += ["--method", method, "--time-limit", str(limit), "--quiet", "--output", str(output)]
        process = subprocess.Popen(command)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode not in (0, 3):
            raise SystemExit(f"{' '.join(command)} ended with status {process.returncode}")
        result = json.loads(output.read_text())
    value = result["value"] if result["status"] == "optimal" else None
    return usage.ru_utime + usage.ru_stime, result["seconds"]["total"], value, usage.ru_maxrss / 2**20


def median(instance: str, method: str, limit: float, repeat: int) -> tuple[float, float | None, float]:
    """Return the median of processor seconds, the value, and GiB."""
    runs = [run(instance, method, limit)]
    while len(runs) < repeat and runs[0][2] is not None:
        runs.append(run(instance, method, limit))
    return statistics.median(seconds for seconds, *_ in runs), runs[0][2], max(gib for *_, gib in runs)


def what_is_left(instance: str) -> list[str]:
    """Return the columns that count edges, triangles and faces."""
    found = minimum_weight_triangulation_2d(load_instance(instance)).statistics
    return [
        f"{found.pairs:,}",
        f"{found.edges:,}",
        f"{found.possible_edges:,}",
        f"{found.certain_edges:,}",
        f"{found.triangles:,}",
        f"{found.possible_triangles:,}",
        f"{found.programmed_faces:,}",
        f"{found.integer_faces:,}",
    ]


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--time-limit", type=float, default=150.0, metavar="S")
    parser.add_argument("--instance", action="append", help="only these, repeatable; side by side")
    arguments = parser.parse_args()
    counts = ["pairs", "diamond", "possible", "certain", "triangles", "left", "faces", "integer"]
    head = [
        "instance",
        *counts,
        "elimination",
        "GiB",
        *(column for other in OTHERS for column in (other, "ratio")),
    ]
    print(*head, sep=" | ")
    print("|".join(["---"] * len(head)))
    for instance in arguments.instance or [*SIDE_BY_SIDE, *ALONE]:
        seconds, value, gib = median(instance, "elimination", arguments.time_limit, arguments.repeat)
        row = [instance, *what_is_left(instance), f"{seconds:.2f}", f"{gib:.2f}"]
        for other in OTHERS:
            if instance in ALONE:
                row += ["–", "–"]
                continue
            theirs, reached, _ = median(instance, other, arguments.time_limit, arguments.repeat)
            if reached is not None and (value is None or abs(reached - value) > 1e-9 * abs(value)):
                raise SystemExit(f"{instance}: {other} found {reached}, elimination {value}")
            mark = "" if reached is not None else ">"
            row += [f"{mark}{theirs:.2f}", f"{mark}{theirs / seconds:.1f}"]
        print(*row, sep=" | ", flush=True)


if __name__ == "__main__":
    main()

"""`bcut solve` beside SCIP's defaults and HiGHS's LP methods on the exported model: whole processes, in turn.

    python benchmarks/scale.py [random:40,3,seed=1 ...] [--limit 100]

Minimum weight, all points used. `bcut` reads the points and ends with a proven optimum; SCIP reads the model that
`bcut export` has written and solves it; HiGHS reads the same model and solves its linear relaxation only. Everyone has
one thread. Ratios are of processor time, which other work on the machine disturbs least, reading the file included;
"bcut" is the mean of a run before the others and a run after them. A run that the limit ends counts with the time
that it took until then, so its ratio is a lower bound; with `>`.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

INSTANCES = (
    "random:30,3,seed=1",
    "random:40,3,seed=1",
    "random:50,3,seed=1",
    "random:160,2,seed=1",
    "random:320,2,seed=1",
)

_SCIP = """
import sys
from pyscipopt import Model
model = Model()
model.hideOutput()
model.readProblem(sys.argv[1])
model.setParam("limits/time", float(sys.argv[2]))
model.optimize()
print(model.getStatus(), model.getPrimalbound() if model.getNSols() else None)
"""
_HIGHS = """
import sys
import highspy
solver = highspy.Highs()
solver.setOptionValue("output_flag", False)
solver.readModel(sys.argv[1])
program = solver.getLp()
program.integrality_ = []
solver.passModel(program)
for name, value in (("threads", 1), ("time_limit", float(sys.argv[2])), *OPTIONS):
    solver.setOptionValue(name, value)
solver.run()
print(solver.modelStatusToString(solver.getModelStatus()), solver.getInfo().objective_function_value)
"""
_METHODS = {
    "HiGHS dual simplex": (("solver", "simplex"),),
    "HiGHS interior point, no crossover": (("solver", "ipm"), ("run_crossover", "off")),
    "HiGHS PDLP": (("solver", "pdlp"),),
}


@dataclass(frozen=True)
class Run:
    """A finished process: seconds by the clock and of the processor, its peak of memory, and what it printed."""

    wall: float
    processor: float
    memory: int
    said: str
    ended: bool


def run(command: list[str], limit: float) -> Run:
    """Run a command as a whole process, killed somewhat after the limit that it has been told."""
    started = time.perf_counter()
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.DEVNULL)
        while True:
            found, status, used = os.wait4(process.pid, os.WNOHANG)
            if found:
                break
            if time.perf_counter() - started > 1.2 * limit + 10:
                process.kill()
            time.sleep(0.01)
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        said = " ".join(output.read().split())
    wall = time.perf_counter() - started
    return Run(wall, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024, said, wall >= limit)


def compare(instance: str, limit: float) -> None:
    """Run everyone on one instance and print the lines of the table."""
    with tempfile.TemporaryDirectory() as folder:
        model, result = Path(folder) / "model.mps", Path(folder) / "result.json"
        question = [instance, "--objective", "weight", "--spanning"]
        bcut = [sys.executable, "-m", "bcut"]
        subprocess.run([*bcut, "export", *question, str(model)], check=True, stdout=subprocess.DEVNULL)
        solve = [*bcut, "solve", *question, "--output", str(result), "--time-limit", str(limit)]
        first = run(solve, limit)
        others = {"SCIP, defaults": run([sys.executable, "-c", _SCIP, str(model), str(limit)], limit)}
        for label, options in _METHODS.items():
            script = _HIGHS.replace("OPTIONS", repr(options))
            others[label] = run([sys.executable, "-c", script, str(model), str(limit)], limit)
        second = run(solve, limit)
    own = (first.processor + second.processor) / 2
    show(instance, "bcut solve", second, own, 1.0)
    for label, other in others.items():
        show(instance, label, other, other.processor, other.processor / own)


def show(instance: str, label: str, done: Run, processor: float, ratio: float) -> None:
    """Print a line of the table."""
    more = ">" if done.ended else ""
    said = done.said[:60].replace("|", " ")
    print(
        f"| {instance} | {label} | {more}{processor:.1f} | {more}{done.wall:.1f} | {done.memory / 2**20:,.0f} "
        f"| {more}{ratio:.1f} | {said} |",
        flush=True,
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("instances", nargs="*", default=INSTANCES)
    parser.add_argument("--limit", type=float, default=100.0, help="seconds for each run")
    arguments = parser.parse_args()
    print("| instance | | CPU s | wall s | MiB | CPU ratio | it says |")
    print("|---|---|--:|--:|--:|--:|---|")
    for instance in arguments.instances:
        compare(instance, arguments.limit)


if __name__ == "__main__":
    main()

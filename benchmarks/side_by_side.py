"""`bcut solve` beside TOPCOM's minimum triangulations, `bcut bound` beside polymake's bound: whole processes, in turn.

    python benchmarks/side_by_side.py

Times are those of whole processes, the start of Python and its imports included; ratios are of processor time, which
other work on the machine disturbs least. TOPCOM reads the points exactly as `bcut generate --format dat` writes them:
the doubles of the sphere as the rationals that they are. Of irrational points it gets the chirotope, which `bcut`
computes for it. Where the points have affine symmetries, TOPCOM also runs with generators of their group; `bcut solve`
is told of none. polymake, where it is installed, computes its lower bound for rational points.

A run that the limit on processor time ends counts with the time that it took until then, so its ratio is a lower bound;
with `>`.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from bcut import PointConfiguration, load_instance
from bcut.files import format_points
from bcut.geometry.determinants import orientation_signs
from bcut.geometry.symmetry import symmetry_group

# What TOPCOM's programs are called, by their input.
PROGRAMS = {
    "points": ("topcom-points2mintriang", "points2mintriang"),
    "chirotope": ("topcom-chiro2mintriang", "chiro2mintriang"),
}
# One TOPCOM triangulation is printed as {{0,1,2,4},{1,2,3,7},...}.
_SIMPLEX = re.compile(r"\{\d[\d,]*\}")


@dataclass
class Contestant:
    """One command and what its runs gave.

    Attributes
    ----------
    label : str
    command : list of str
    stdin : str
    wall, processor : list of float
        Seconds of each run: by the clock, and used by the process in user and system mode.
    value : int or None
        The number of simplices that the last run found.
    ended : bool
        Whether the time limit ended some run.
    """

    label: str
    command: list[str]
    stdin: str = ""
    wall: list[float] = field(default_factory=list)
    processor: list[float] = field(default_factory=list)
    value: int | None = None
    ended: bool = False

    def run(self, limit: int) -> None:
        """Run once, as a whole process; its output goes to a file, which survives the end that a limit brings."""
        with tempfile.TemporaryFile("w+") as stdin, tempfile.TemporaryFile("w+") as stdout:
            stdin.write(self.stdin)
            stdin.seek(0)
            started, used = time.perf_counter(), _processor_time()
            finished = subprocess.run(
                self.command,
                stdin=stdin,
                stdout=stdout,
                stderr=subprocess.DEVNULL,
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 1)),
            )
            self.ended = finished.returncode in (-signal.SIGXCPU, -signal.SIGKILL)
            self.wall.append(time.perf_counter() - started)
            self.processor.append(_processor_time() - used)
            if not self.ended and finished.returncode:
                raise RuntimeError(f"{' '.join(self.command)} ended with status {finished.returncode}")
            stdout.seek(0)
            self.value = _simplices(stdout.read())


def _processor_time() -> float:
    """Return the processor time of all finished child processes."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _simplices(output: str) -> int | None:
    """Return the size of the triangulation in the output: `bcut`'s JSON object, or TOPCOM's last line."""
    if output.startswith("{"):
        result = json.loads(output)
        value: int = result["bound" if result["status"] == "bound" else "value"]
        return value
    if output.strip().isdecimal():
        return int(output)
    sizes = [len(_SIMPLEX.findall(line)) for line in output.splitlines() if line.rstrip().endswith("}};")]
    return min(sizes, default=None)


def contestants(instance: str) -> list[Contestant]:
    """Return the commands that look for a smallest triangulation; `bcut` first."""
    configuration = load_instance(instance)
    kind = "points" if configuration.field.degree == 1 else "chirotope"
    topcom = next((path for name in PROGRAMS[kind] if (path := shutil.which(name))), None)
    found = [
        Contestant(f"bcut solve {instance}", [sys.executable, "-m", "bcut", "solve", instance, "--json"])
    ]
    if topcom is None:
        print(f"# TOPCOM's {PROGRAMS[kind][1]} is not installed (Debian: apt install topcom)", flush=True)
        return found
    text = format_points(configuration, "dat") if kind == "points" else _chirotope(configuration)
    label = PROGRAMS[kind][1]
    found.append(Contestant(label, [topcom], text))
    group = symmetry_group(configuration)
    if not group.is_trivial:
        generators = [generator.tolist() for generator in group.generators]
        found.append(Contestant(f"{label} with symmetries", [topcom], f"{text}{generators}\n"))
    return found


def bounds(instance: str) -> list[Contestant]:
    """Return the commands that compute a lower bound; `bcut` first, and none where polymake cannot run."""
    configuration = load_instance(instance)
    polymake = shutil.which("polymake")
    if polymake is None or configuration.field.degree > 1:
        return []
    rows = ",".join(f"[1,{','.join(point)}]" for point in configuration.exact_points())
    script = f"print new Polytope(POINTS=>[{rows}])->SIMPLEXITY_LOWER_BOUND;"
    return [
        Contestant(f"bcut bound {instance}", [sys.executable, "-m", "bcut", "bound", instance, "--json"]),
        Contestant("polymake SIMPLEXITY_LOWER_BOUND", [polymake, script]),
    ]


def _chirotope(configuration: PointConfiguration) -> str:
    """Return TOPCOM's form of the chirotope: one sign for each (d+1)-subset, in lexicographic order."""
    n, size = configuration.n, configuration.dimension + 1
    subsets = np.array(list(combinations(range(n), size)), dtype=np.int64)
    signs = "".join("-0+"[sign + 1] for sign in orientation_signs(configuration, subsets).tolist())
    return f"{n},{size}:\n{signs}\n"


def compare(instance: str, entrants: list[Contestant], *, runs: int, limit: int) -> None:
    """Run all commands in turn, several times; print medians, and ratios of processor time to that of `bcut`."""
    for _ in range(runs):
        for entrant in entrants:
            # A run that the limit ends says the same every time.
            if not entrant.ended:
                entrant.run(limit)
    base = statistics.median(entrants[0].processor)
    for entrant in entrants:
        more = ">" if entrant.ended else ""
        wall, processor = statistics.median(entrant.wall), statistics.median(entrant.processor)
        found = "nothing printed" if entrant.value is None else f"{entrant.value} simplices"
        if entrant.ended and entrant.value is not None:
            found += " so far"
        print(
            f"{instance}: {entrant.label}: {found}, {more}{wall:.2f} s, of the processor {more}{processor:.2f} s "
            f"(medians of {len(entrant.wall)}), ratio {more}{processor / base:.3g}",
            flush=True,
        )


def main() -> None:
    """Read the options and run the comparisons."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "instances",
        nargs="*",
        default=["cube:4", "sphere:16,3,seed=1", "icosahedron", "hypersimplex:6,2", "24-cell"],
        help="what to compare on",
    )
    parser.add_argument("--runs", type=int, default=5, help="runs of every command (default 5)")
    parser.add_argument(
        "--time-limit", type=int, default=300, help="seconds of processor time per run (default 300)"
    )
    options = parser.parse_args()
    print(f"# at most {options.time_limit} s of processor time a run", flush=True)
    for instance in options.instances:
        for entrants in (contestants(instance), bounds(instance)):
            if len(entrants) > 1:
                compare(instance, entrants, runs=options.runs, limit=options.time_limit)


if __name__ == "__main__":
    main()

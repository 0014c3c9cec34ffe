"""`bcut solve` beside TOPCOM's `points2mintriang`, whole processes in turn, on the same points.

    python benchmarks/side_by_side.py

Times are those of whole processes, the start of Python and its imports included; ratios are of processor time, which
other work on the machine disturbs least. TOPCOM reads the points exactly as
`bcut generate --format dat` writes them: the doubles of the sphere as the rationals that they are. Where the points
have affine symmetries, TOPCOM also runs with generators of their group; `bcut solve` is told of none.

A run that the time limit ends counts with the time that it took until then, so its ratio is a lower bound; with `>`.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

from bcut import load_instance
from bcut.files import format_points
from bcut.geometry.symmetry import symmetry_group

PROGRAMS = ("topcom-points2mintriang", "points2mintriang")
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

    def run(self, limit: float) -> None:
        """Run once, as a whole process; its output goes to a file, which survives the end that a limit brings."""
        with tempfile.TemporaryFile("w+") as stdin, tempfile.TemporaryFile("w+") as stdout:
            stdin.write(self.stdin)
            stdin.seek(0)
            started, used = time.perf_counter(), _processor_time()
            with subprocess.Popen(
                self.command, stdin=stdin, stdout=stdout, stderr=subprocess.DEVNULL
            ) as process:
                try:
                    process.wait(limit)
                except subprocess.TimeoutExpired:
                    process.kill()
                    self.ended = True
            self.wall.append(time.perf_counter() - started)
            self.processor.append(_processor_time() - used)
            if not self.ended and process.returncode:
                raise RuntimeError(f"{' '.join(self.command)} ended with status {process.returncode}")
            stdout.seek(0)
            self.value = _simplices(stdout.read())


def _processor_time() -> float:
    """Return the processor time of all finished child processes."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _simplices(output: str) -> int | None:
    """Return the size of the triangulation in the output: `bcut`'s JSON object, or TOPCOM's last line."""
    if output.startswith("{"):
        value: int = json.loads(output)["value"]
        return value
    sizes = [len(_SIMPLEX.findall(line)) for line in output.splitlines() if line.rstrip().endswith("}};")]
    return min(sizes, default=None)


def contestants(instance: str, topcom: str) -> list[Contestant]:
    """Return the commands to compare; `bcut` first."""
    configuration = load_instance(instance)
    points = format_points(configuration, "dat")
    found = [
        Contestant(f"bcut solve {instance}", [sys.executable, "-m", "bcut", "solve", instance, "--json"]),
        Contestant("points2mintriang", [topcom], points),
    ]
    group = symmetry_group(configuration)
    if not group.is_trivial:
        generators = [generator.tolist() for generator in group.generators]
        found.append(Contestant("points2mintriang with symmetries", [topcom], f"{points}{generators}\n"))
    return found


def compare(instance: str, topcom: str, *, runs: int, limit: float) -> None:
    """Run all commands in turn, several times; print medians, and ratios of processor time to that of `bcut`."""
    entrants = contestants(instance, topcom)
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
        "instances", nargs="*", default=["cube:4", "sphere:16,3,seed=1"], help="what to compare on"
    )
    parser.add_argument("--runs", type=int, default=5, help="runs of every command (default 5)")
    parser.add_argument("--time-limit", type=float, default=300, help="seconds per run (default 300)")
    options = parser.parse_args()
    topcom = next((path for name in PROGRAMS if (path := shutil.which(name))), None)
    if topcom is None:
        sys.exit(
            f"TOPCOM is missing: none of {', '.join(PROGRAMS)} is on the path (Debian: apt install topcom)"
        )
    print(f"# {Path(topcom).name}, at most {options.time_limit:g} s a run", flush=True)
    for instance in options.instances:
        compare(instance, topcom, runs=options.runs, limit=options.time_limit)


if __name__ == "__main__":
    main()

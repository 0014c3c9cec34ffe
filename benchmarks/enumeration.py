"""All empty simplices with their cocircuit matrix: compiled kernels beside tables of all signs, one process each.

Every line is the median of some runs, each in a process of its own. "Seconds" are processor seconds from the points to
`bcut.formulations.compact.CompactProgram` and its sparse matrix; for the kernels, "start" is what importing numba
and loading the kept machine code cost on top, once for each process. "Peak" is how far the process's largest
resident set grew in that time, per column. Tables are tried up to a number of (d+1)-subsets.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import time
from math import comb

import numpy as np

from bcut.formulations.compact import compact_program
from bcut.geometry.configuration import PointConfiguration
from bcut.instance import load_instance

RANDOM = [
    *("random:160,2", "random:320,2", "random:640,2", "random:1280,2"),
    *("random:50,3", "random:80,3", "random:100,3", "random:120,3", "random:40,4"),
]
# N random points of the grid {0, ..., 2^B - 1}^D; points within EPS of a plane or a line; lattice points moved by EPS.
ADVERSARIAL = [
    *("sphere:80,3", "integers:80,3,20", "integers:80,3,30", "integers:80,3,53", "integers:320,2,31"),
    *("grid:20,20", "grid:5,5,5", "flat:80,3,1e-9", "flat:80,3,1e-13", "flat:80,3,1e-16", "flat:320,2,1e-16"),
    *("shaken:4,3,1e-15", "shaken:18,2,1e-15"),
]


def configuration_of(name: str) -> PointConfiguration:
    """Return the points of a family or of one of the names above."""
    kind, _, arguments = name.partition(":")
    generator = np.random.default_rng(0)
    if kind == "integers":
        n, d, bits = map(int, arguments.split(","))
        # Another seed: the generator makes the same bits for every width.
        points = np.random.default_rng(bits).integers(0, 2**bits, size=(n, d))
        return PointConfiguration.from_values(points, name=name)
    if kind == "flat":
        n, d, distance = (
            kind(text) for kind, text in zip((int, int, float), arguments.split(","), strict=True)
        )
        points = generator.random((n, d))
        points[:, -1] = points[:, :-1] @ (0.5 ** np.arange(1, d)) + distance * points[:, -1]
        return PointConfiguration.from_values(points, name=name)
    if kind == "shaken":
        k, d, distance = (
            kind(text) for kind, text in zip((int, int, float), arguments.split(","), strict=True)
        )
        points = np.stack(np.meshgrid(*[np.arange(1.0, k + 1)] * d), axis=-1).reshape(-1, d)
        points += distance * generator.integers(-3, 4, size=points.shape)
        return PointConfiguration.from_values(points, name=name)
    return load_instance(name)


def measure(name: str, compiled: bool) -> dict[str, float]:
    """Build the program of one instance in this process."""
    import scipy.sparse  # noqa: F401

    configuration = configuration_of(name)
    started = time.process_time()
    if compiled:
        # The same kernels, in the same types, on next to nothing.
        small = np.random.default_rng(0).random((configuration.dimension + 3, configuration.dimension))
        compact_program(PointConfiguration.from_values(small), spanning=True, compiled=True)
    start = time.process_time() - started
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    started = time.process_time()
    program = compact_program(configuration, spanning=True, compiled=compiled)
    matrix = program.matrix()
    seconds = time.process_time() - started
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    return {
        "columns": matrix.shape[1],
        "rows": matrix.shape[0],
        "start": start,
        "seconds": seconds,
        "kept": program.bytes_per_column,
        # Linux counts kilobytes.
        "peak": 1024 * peak / matrix.shape[1],
    }


def median_of(name: str, way: str, runs: int) -> dict[str, float]:
    """Measure in processes of their own, and return the median of every figure."""
    found = []
    for _ in range(runs):
        command = [sys.executable, __file__, "--one", name, "--way", way]
        found.append(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))
    return {key: statistics.median(one[key] for one in found) for key in found[0]}


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("instances", nargs="*", default=[*RANDOM, *ADVERSARIAL])
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--most-subsets", type=int, default=6_000_000, help="for the tables of all signs")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    parser.add_argument("--way", choices=["kernels", "tables"], help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure(options.one, options.way == "kernels")))
        return
    median_of("random:12,3", "kernels", 1)
    print(
        "| instance | columns | rows | seconds | start | ns per column | bytes kept, peak | tables | ratio |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for name in options.instances:
        configuration = configuration_of(name)
        fast = median_of(name, "kernels", options.runs)
        tables, ratio = "–", "–"
        if comb(configuration.n, configuration.dimension + 1) <= options.most_subsets:
            slow = median_of(name, "tables", options.runs)
            assert (slow["columns"], slow["rows"]) == (fast["columns"], fast["rows"])
            tables, ratio = f"{slow['seconds']:.2f}", f"{slow['seconds'] / fast['seconds']:.1f}"
        print(
            f"| `{name}` | {fast['columns']:,.0f} | {fast['rows']:,.0f} | {fast['seconds']:.2f} "
            f"| {fast['start']:.2f} | {1e9 * fast['seconds'] / fast['columns']:.0f} "
            f"| {fast['kept']:.0f}, {fast['peak']:.0f} | {tables} | {ratio} |",
            flush=True,
        )


if __name__ == "__main__":
    main()

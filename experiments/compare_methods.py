"""Solve many small configurations by fixing and by listing, and compare: optima, and every bound on the way.

    python experiments/compare_methods.py [--count 240] [--seed 0] [--seconds 250]

Random points in 2D, 3D and 4D, grids and points rounded to few bits; every objective there is a sum of; all points used
or not; minima and maxima. Ends with a failure at the first difference.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from itertools import count
from typing import Any

import numpy as np

import bcut
from bcut import PointConfiguration

OBJECTIVES = {
    2: ("weight", "cardinality", "random-costs:{}", "aspect-ratio", "min-angle", "volume"),
    3: ("weight", "cardinality", "random-costs:{}", "aspect-ratio", "dihedral-angle", "solid-angle"),
    4: ("weight", "cardinality", "random-costs:{}", "aspect-ratio", "dihedral-angle"),
}
#: Points, at least and at most.
SIZES = {2: (6, 16), 3: (7, 13), 4: (7, 9)}


def configuration(generator: np.random.Generator, dimension: int) -> PointConfiguration:
    """Return points in general position, or with many on common lines and planes."""
    low, high = SIZES[dimension]
    n = int(generator.integers(low, high + 1))
    if generator.random() < 0.6:
        return PointConfiguration.from_values(generator.random((n, dimension)), name=f"{n} points")
    while True:
        points = np.unique(generator.integers(0, 4, size=(n, dimension)), axis=0)
        if np.linalg.matrix_rank(points[1:] - points[0]) == dimension:
            return PointConfiguration.from_values(points, name=f"{len(points)} points of a grid")


def compare(generator: np.random.Generator) -> tuple[str, str]:
    """Solve one configuration both ways; return what kind it was and how it ended."""
    dimension = int(generator.choice([2, 3, 4]))
    points = configuration(generator, dimension)
    objective = str(generator.choice(OBJECTIVES[dimension])).format(int(generator.integers(1000)))
    question: dict[str, Any] = {
        "objective": objective,
        "sense": str(generator.choice(["min", "max"])),
        "spanning": bool(generator.random() < 0.5),
    }
    expected = bcut.solve(points, method="listing", **question)
    bounds: list[float] = []
    found = bcut.solve(
        points,
        method="fixing",
        on_progress=lambda facts: bounds.append(facts["bound"]) if facts["bound"] is not None else None,
        **question,
    )
    sign = 1 if question["sense"] == "min" else -1
    size = max(1.0, abs(expected.value))
    same = found.status == expected.status == "optimal" and abs(found.value - expected.value) <= 2e-9 * size
    valid = all(sign * (bound - expected.value) <= 1e-9 * size for bound in bounds)
    if not same or not valid:
        raise SystemExit(
            f"{points.exact_points()} {question}: listing {expected.status} {expected.value}, "
            f"fixing {found.status} {found.value}, bounds {bounds}"
        )
    return (
        f"{dimension}D {objective.split(':')[0]}",
        "certificate" if found.certificate.bound else "no certificate",
    )


def main() -> None:
    """Compare until there are enough."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=240)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=250.0)
    arguments = parser.parse_args()
    started, kinds, ends = time.monotonic(), Counter[str](), Counter[str]()
    for number in count():
        if number == arguments.count or time.monotonic() - started > arguments.seconds:
            break
        kind, end = compare(np.random.default_rng([arguments.seed, number]))
        kinds[kind] += 1
        ends[end] += 1
    for kind, times in sorted(kinds.items()):
        print(f"{kind}: {times}")
    print(f"{sum(kinds.values())} configurations, no difference; {dict(ends)}")


if __name__ == "__main__":
    main()

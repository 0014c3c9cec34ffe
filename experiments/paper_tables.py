"""Tables 1 to 3 of the paper and the counts of Section 2.4.2 as they stand in the documentation.

    python experiments/paper_tables.py results

Reads the reports of the plans ``table-1``, ``table-2``, ``table-3`` and ``expectations`` from folders of these names,
and prints a table for each that is there.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator
from functools import cache
from math import comb, factorial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Row = dict[str, str]

#: Columns of the paper's tables, and the seconds of both their rows together, by number of points.
PAPER = {
    "table-2": {
        10: (71, 0.55), 20: (482, 2.61), 30: (1220, 7.99), 40: (2328, 18.49), 80: (11209, 177.26),
        160: (47837, 2073.18), 240: (109998, 9239.35), 320: (197883, 27571.76),
    },
    "table-3": {
        10: (194, 1.11), 20: (3771, 19.37), 30: (19638, 196.94), 40: (57735, 6520.11), 50: (139982, 67171.16),
    },
}  # fmt: skip
#: Random simplices that expectations are computed from.
SAMPLES = 1_000_000


def read(folder: Path, table: str) -> list[Row]:
    """Read a table of a report; nothing where there is none."""
    path = folder / "report" / f"{table}.csv"
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def growth(folder: Path) -> Iterator[str]:
    """Yield Table 1: the largest sizes, and measured exponents beside those of the paper."""
    sizes, rows = read(folder, "sizes"), read(folder, "growth")
    yield "| formulation | n | columns | rows | growth of columns | of rows | of nonzeros a row | orders in the paper |"
    yield "|---|---:|---:|---:|---:|---:|---:|---|"
    for label in dict.fromkeys(row["class"] for row in rows):
        own = {row["measure"]: row for row in rows if row["class"] == label}
        last = [row for row in sizes if row["class"] == label][-1]
        # Adding zero turns -0.0 into 0.0.
        exponents = [round(float(own[name]["exponent"]), 2) + 0.0 for name in ("columns", "rows", "per_row")]
        measured = [f"n^{exponent:.2f}" for exponent in exponents]
        orders = [own[name]["order"] for name in ("columns", "rows", "per_row")]
        stated = ", ".join({"0": "1", "1": "n"}.get(order, f"n^{order}") for order in orders if order) or "–"
        numbers = [f"{float(last[name]):,.0f}" for name in ("columns", "rows")]
        cells = [
            label,
            f"{own['rows']['from_points']}–{own['rows']['to_points']}",
            *numbers,
            *measured,
            stated,
        ]
        yield "| " + " | ".join(cells) + " |"


def solves(folder: Path) -> Iterator[str]:
    """Yield Table 2 or 3: sizes, integral relaxations, and processor time of the relaxation and of ``bcut solve``."""
    rows = read(folder, "classes")
    yield (
        "| points | rows | columns | nonzeros | integral | relaxation, s | `bcut solve`, s | columns in the paper "
        "| its seconds |"
    )
    yield "|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
    for label in dict.fromkeys(row["class"] for row in rows):
        own = {row["variant"]: row for row in rows if row["class"] == label}
        some, alone = next(iter(own.values())), own.get("LP")
        points = int(float(some["points"]))
        cells = [str(points), *(f"{float(some[name]):,.0f}" for name in ("rows", "columns"))]
        cells += ["–", "–"] if alone is None else [
            f"{float(alone['nonzeros']):,.0f}", f"{alone['integral']} of {alone['runs']}"
        ]  # fmt: skip
        for name in ("LP", "bcut"):
            cells.append(f"{float(own[name]['processor_seconds']):.2f}" if name in own else "–")
        columns, seconds = PAPER[folder.name][points]
        yield "| " + " | ".join([*cells, f"{columns:,}", f"{seconds:,.2f}"]) + " |"


@cache
def volumes(dimension: int) -> NDArray[np.float64]:
    """Return the volumes of random simplices in the unit cube."""
    corners = np.random.default_rng(0).random((SAMPLES, dimension + 1, dimension))
    return np.asarray(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / factorial(dimension))


def expected(dimension: int, n: int) -> float:
    """Return the expected number of empty simplices of n uniform points in a cube: C(n, d + 1) E (1 - V)^(n - d - 1).

    V is the volume of a random simplex; the other points are outside of it independently of each other.
    """
    return comb(n, dimension + 1) * float(((1 - volumes(dimension)) ** (n - dimension - 1)).mean())


def counts(folder: Path) -> Iterator[str]:
    """Yield the numbers of empty simplices beside what is expected and the bounds."""
    yield "| points | n | sets | empty simplices | expected | over n^d | C(n − 1, d) | C(n, d + 1) |"
    yield "|---|---:|---:|---:|---:|---:|---:|---:|"
    dimensions = {"square": 2, "cube": 3, "4-cube": 4, "on a sphere": 3}
    for row in read(folder, "sizes"):
        label, n, mean = row["class"], int(row["points"]), float(row["columns"])
        d = dimensions[label]
        error = f" ± {float(row['columns_error']):,.1f}" if row["columns_error"] else ""
        formula = f"{expected(d, n):,.1f}" if label != "on a sphere" else f"{comb(n, d + 1):,}"
        cells = [label, str(n), row["instances"], f"{mean:,.1f}{error}", formula, f"{mean / n**d:.3f}"]
        yield "| " + " | ".join([*cells, f"{comb(n - 1, d):,}", f"{comb(n, d + 1):,}"]) + " |"


def main() -> None:
    """Print what is there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path, help="folder of the plans' results")
    results = parser.parse_args().results
    makers = {"table-1": growth, "table-2": solves, "table-3": solves, "expectations": counts}
    for name, make in makers.items():
        if (results / name / "report").is_dir():
            print(f"{name}\n")
            print("\n".join(make(results / name)) + "\n")


if __name__ == "__main__":
    main()

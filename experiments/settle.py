"""Solve the famous configurations over their orbits, and keep a result file of each.

    python experiments/settle.py --output instances/results

A result that is there already is kept, unless ``--again`` asks for a better one: then the instance is solved once more,
and the new result replaces the old one where its value or its bound is better. `results_table.py` makes the table.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import bcut
from bcut.result import Result

# Name, whether only triangulations with all points count, senses.
INSTANCES: list[tuple[str, bool, str]] = [
    ("polygon:6", False, "min max"),
    ("polygon:5,center", False, "min max"),
    ("moae", False, "min max"),
    ("grid:3,3", False, "min max"),
    ("grid:3,3", True, "min max"),
    ("grid:4,4", True, "min max"),
    ("grid:3,2,2", True, "min max"),
    ("grid:3,3,3", True, "min max"),
    *[(f"cross-polytope:{d}", False, "min max") for d in range(3, 9)],
    *[(f"cube:{d}", False, "min max") for d in range(3, 7)],
    *[(f"prism:{m}", False, "min max") for m in range(3, 9)],
    *[(f"antiprism:{m}", False, "min max") for m in range(3, 9)],
    *[(f"cyclic:{n},{d}", False, "min max") for n, d in ((9, 3), (12, 3), (9, 4), (12, 4), (8, 5), (10, 5))],
    *[
        (f"simplex-product:{factors}", False, "min max")
        for factors in ("2,1,1", "2,2", "2,2,1", "3,2", "3,3", "4,3", "2,2,2", "3,1,1", "3,2,1", "2,1,1,1")
    ],
    *[
        (f"hypersimplex:{n},{k}", False, "min max")
        for n, k in ((4, 2), (5, 2), (6, 2), (6, 3), (7, 2), (7, 3))
    ],
    ("icosahedron", False, "min max"),
    ("dodecahedron", False, "min max"),
    ("truncated-tetrahedron", False, "min max"),
    ("cuboctahedron", False, "min max"),
    ("truncated-cube", False, "min max"),
    ("truncated-octahedron", False, "min max"),
    ("rhombicuboctahedron", False, "min max"),
    ("icosidodecahedron", False, "min max"),
    ("truncated-cuboctahedron", False, "min max"),
    ("truncated-dodecahedron", False, "min max"),
    ("truncated-icosahedron", False, "min max"),
    ("rhombicosidodecahedron", False, "min max"),
    ("truncated-icosidodecahedron", False, "min max"),
    ("24-cell", False, "min max"),
    ("600-cell", False, "min max"),
]

# Averaged link cuts of this one name thousands of simplices each: minutes a round, and files of many megabytes.
WITHOUT_CUTS = ("600-cell",)


def file_of(folder: Path, name: str, spanning: bool, sense: str) -> Path:
    """Where the result of one question is kept."""
    kind = "-spanning" if spanning else ""
    return folder / f"{name.replace(':', '-').replace(',', '-')}{kind}-{sense}.json"


def improves(new: Result, old: Path) -> bool:
    """Whether a result has a better value or a better bound than the one in a file, and none that is worse."""
    before = bcut.verify(old)
    after = bcut.verify(new)
    sign = 1 if new.problem.sense == "min" else -1

    def rank(value: object, worst: float) -> float:
        return worst if value is None else sign * float(value)  # type: ignore[arg-type]

    values = rank(after.value, float("inf")), rank(before.value, float("inf"))
    bounds = rank(after.rounded_bound, -float("inf")), rank(before.rounded_bound, -float("inf"))
    return (
        values[0] <= values[1] and bounds[0] >= bounds[1] and (values[0], bounds[0]) != (values[1], bounds[1])
    )


def main() -> None:
    """Solve what is missing."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("instances/results"))
    parser.add_argument("--limit", type=float, default=120.0, help="seconds for each")
    parser.add_argument("--only", default="", help="names that begin with this")
    parser.add_argument("--again", action="store_true", help="solve again what is not optimal yet")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    for name, spanning, senses in INSTANCES:
        for sense in senses.split():
            file = file_of(arguments.output, name, spanning, sense)
            if not name.startswith(arguments.only) or (file.exists() and not arguments.again):
                continue
            result = bcut.solve(
                name,
                sense=sense,
                spanning=spanning,
                method="orbits",
                separators=[] if name in WITHOUT_CUTS else None,
                time_limit=arguments.limit,
            )
            print(
                f"{name} {sense}: value {result.value}, bound {result.bound}, {result.status}, "
                f"{result.seconds['total']:.1f} s",
                flush=True,
            )
            if not file.exists() or improves(result, file):
                result.save(file)


if __name__ == "__main__":
    main()

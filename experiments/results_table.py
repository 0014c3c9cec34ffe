"""Verify every result that is kept, and write the table of what is settled.

    python experiments/results_table.py

Reads ``instances/results/*.json``, checks each file with `bcut.verify`, from scratch and exactly, and writes
``docs/results.md`` and ``instances/results/table.csv``. Nothing in the table rests on what a file says of itself.
"""

from __future__ import annotations

import argparse
import csv
import json
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from settle import INSTANCES, file_of

import bcut

MARKS = {
    "exact": "proven exactly",
    "solver": "proven by the solver",
    "bounds": "bounds only",
}

HEAD = """# Settled configurations

Smallest and largest numbers of simplices of triangulations. Every row comes from a result file in `instances/results`,
which `bcut verify` re-checks in exact arithmetic, without any solver: the triangulation, the symmetries, the
multipliers and what they prove. This page is written by `python experiments/results_table.py`, which does just that;
`python experiments/settle.py` makes the files.

* **proven exactly**: the triangulation is verified, and its size meets the bound that the multipliers in the file
  prove;
* *proven by the solver*: the triangulation and a weaker bound are verified; that there is nothing in between rests on
  the floating-point search of SCIP;
* bounds only: the best triangulation found, and the best bound that is proven exactly.

"Root LP" is the optimum of the linear relaxation, "with cuts" that with averaged link cuts
([link-cuts.md](link-cuts.md)). The number of simplices counts all affinely independent sets of d + 1 points (for
spanning triangulations, those that contain no other point).

| configuration | points | dim | simplices | | size | root LP | with cuts | |
|---|--:|--:|--:|---|--:|--:|--:|---|
"""


@dataclass(frozen=True)
class Row:
    """One question and what is known of it."""

    name: str
    points: int
    dimension: int
    simplices: int
    sense: str
    spanning: bool
    value: int | None
    bound: int
    lp: float
    lp_after_cuts: float
    mark: str

    def text(self) -> str:
        """Return the row of the page."""
        if self.mark == "bounds":
            low, high = sorted((self.bound, self.value if self.value is not None else self.bound))
            size, mark = f"{low} … {high}", MARKS["bounds"]
        else:
            size = f"{self.value}"
            mark = f"**{MARKS['exact']}**" if self.mark == "exact" else f"*{MARKS['solver']}*"
        name = self.name + (", spanning" if self.spanning else "")
        lps = (
            f"{self.lp:.6g}",
            "" if abs(self.lp - self.lp_after_cuts) < 1e-6 else f"{self.lp_after_cuts:.6g}",
        )
        cells = (name, self.points, self.dimension, f"{self.simplices:,}", self.sense, size, *lps, mark)
        return "| " + " | ".join(map(str, cells)) + " |"


def row_of(file: Path, spanning: bool) -> Row:
    """Verify one result file."""
    verification = bcut.verify(file)
    data = json.loads(file.read_text(encoding="utf-8"))
    if verification.proven_optimal:
        mark = "exact"
    else:
        mark = "solver" if data["status"] == "optimal" else "bounds"
    bound = verification.rounded_bound
    if bound is None:
        raise SystemExit(f"{file}: its bound was not re-checked: {verification.statement}")
    return Row(
        data["instance"]["name"],
        len(data["instance"]["points"]),
        data["instance"]["dimension"],
        data["size"]["columns"],
        data["problem"]["sense"],
        spanning,
        None if verification.value is None else _integer(verification.value),
        _integer(bound),
        data["root"]["lp"],
        data["root"]["lp_after_cuts"],
        mark,
    )


def _integer(value: Fraction) -> int:
    assert value.denominator == 1
    return value.numerator


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--results", type=Path, default=Path("instances/results"))
    parser.add_argument("--page", type=Path, default=Path("docs/results.md"))
    arguments = parser.parse_args()
    rows = []
    for name, spanning, senses in INSTANCES:
        for sense in senses.split():
            file = file_of(arguments.results, name, spanning, sense)
            if file.exists():
                rows.append(row_of(file, spanning))
                print(rows[-1].text(), flush=True)
    arguments.page.write_text(HEAD + "\n".join(row.text() for row in rows) + "\n", encoding="utf-8")
    with (arguments.results / "table.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([*Row.__dataclass_fields__])
        for row in rows:
            writer.writerow([getattr(row, column) for column in Row.__dataclass_fields__])


if __name__ == "__main__":
    main()

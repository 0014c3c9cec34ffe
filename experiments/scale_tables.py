"""Tables 2 and 3 of the paper with today's figures, further than the paper went, and the same for cardinality in 3D.

    python experiments/scale_tables.py [--only 3D] [--limit 300]

Every row is one run of `bcut solve` as a whole process on uniform random points, all of which are used; its processor
time and its peak of memory are those of the process, as the operating system counts them. Runs are stored in
``runs/scale.jsonl`` as they finish, and are not run twice; ``docs/scale.md`` is written from what is stored.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from runs import run_all

SEED = 1
#: Points, by dimension and objective.
SIZES = {
    ("weight", 2): (10, 20, 30, 40, 80, 160, 240, 320, 640, 1280, 10_000),
    ("weight", 3): (10, 20, 30, 40, 50, 80, 100, 120),
    ("cardinality", 3): (20, 30, 40, 50),
}
#: Seconds of Tables 2 and 3 of the paper: the integer program and the rest, on an IBM RS/6000 model 990.
PAPER = {
    2: {10: 0.24 + 0.31, 20: 0.72 + 1.89, 30: 1.78 + 6.21, 40: 4.25 + 14.24, 80: 45.91 + 131.35,
        160: 727.99 + 1345.19, 240: 3956.20 + 5283.15, 320: 13801.49 + 13770.27},
    3: {10: 0.42 + 0.69, 20: 9.08 + 10.29, 30: 148.27 + 48.67, 40: 6374.83 + 145.28, 50: 66798.32 + 372.84},
}  # fmt: skip

HEAD = """# Large configurations

Minimum weight and minimum cardinality of uniform random points, `random:N,D,seed=1`, all of which are used
(`--spanning`), by `bcut solve` with its ordinary settings. Every row is a whole process, the start of Python included;
"CPU" is its processor time, "memory" its peak, per column beyond 150 MiB, which Python and its libraries take. The
paper's figures are the sums of both rows of its tables, for other random points on a machine of 1993, so only their
growth can be compared. A row is proven optimal, or its gap is stated. This page is written by
`python experiments/scale_tables.py`.

How it works: flips improve the Delaunay triangulation; a first-order method finds multipliers for all rows of the
cocircuit form, whose bound is proven in integers; only the simplices whose reduced costs that bound allows ever get
into a linear program or into SCIP, and those left out are accounted for exactly (`bcut/solving/by_fixing.py`). For
cardinality, flips that the reduced costs guide find the triangulation. In the plane, theorems about edges leave few
triangles to begin with ([elimination.md](elimination.md)). `bcut verify` re-computes the multipliers' bound from the
result file alone, without any solver.

"Alive" are the simplices that the bound and the best triangulation left for solvers. Weights are sums of doubles:
proven means that the bound is within 1e-9 of the value.
"""
_START = 150 * 2**20


def measure(objective: str, dimension: int, points: int, limit: float) -> dict[str, Any]:
    """Solve one configuration in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "result.json"
        command = [
            sys.executable,
            "-m",
            "bcut",
            "solve",
            f"random:{points},{dimension},seed={SEED}",
            "--spanning",
        ]
        command += ["--objective", objective, "--time-limit", str(limit), "--output", str(output), "--quiet"]
        process = subprocess.Popen(command)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if not output.exists():
            return {"status": f"exit {process.returncode}"}
        result = json.loads(output.read_text(encoding="utf-8"))
    return {
        "status": result["status"],
        "method": result["problem"]["method"],
        "columns": result["size"]["columns"],
        "rows": result["size"]["rows"],
        "alive": result["size"]["columns_after_fixing"],
        "lp": result["root"]["lp"],
        "value": result["value"],
        "bound": result["bound"],
        "gap": result["gap"],
        "nodes": result["nodes"],
        "seconds": result["seconds"]["total"],
        "processor": used.ru_utime + used.ru_stime,
        "memory": used.ru_maxrss * 1024,
    }


def exponent(records: Iterable[dict[str, Any]], least: float = 2.0) -> float | None:
    """Fit the exponent of the processor time in the number of columns, over runs that are no mere start of Python."""
    pairs = [
        (r["columns"], r["processor"]) for r in records if r.get("processor", 0) >= least and r["columns"]
    ]
    if len(pairs) < 3:
        return None
    logarithms = np.log(np.array(pairs))
    return float(np.polyfit(logarithms[:, 0], logarithms[:, 1], 1)[0])


def table(objective: str, dimension: int, records: list[dict[str, Any]]) -> Iterator[str]:
    """Yield the lines of one table."""
    names = {("weight", 2): "Table 2", ("weight", 3): "Table 3"}
    name = names.get((objective, dimension))
    yield f"## Minimum {objective} in {dimension}D" + (f" ({name} of the paper)" if name else "")
    yield ""
    paper = " paper's seconds |" if name else ""
    head = "| points | columns | rows | method | alive | LP | value | | CPU s | wall s | memory MiB | bytes a column |"
    yield head + paper
    yield "|--:|--:|--:|---|--:|--:|--:|---|--:|--:|--:|--:|" + ("--:|" if name else "")
    for record in records:
        points = record["key"][2]
        if "columns" not in record:
            yield f"| {points} | | | | | | | {record['status']} | | | | |" + (" |" if name else "")
            continue
        proven = "proven" if record["status"] == "optimal" else f"gap {record['gap']:.2g}"
        if record["value"] is None:
            proven = f"bound {record['bound']}"
        share = max(0, record["memory"] - _START) / record["columns"] if record["columns"] > 50_000 else None
        cells = [
            points,
            f"{record['columns']:,}",
            f"{record['rows']:,}",
            record["method"],
            "" if record["alive"] is None else f"{record['alive']:,}",
            "" if record["lp"] is None else f"{record['lp']:.6f}",
            f"{record['value']:.6f}" if isinstance(record["value"], float) else record["value"],
            proven,
            f"{record['processor']:.1f}",
            f"{record['seconds']:.1f}",
            f"{record['memory'] / 2**20:,.0f}",
            "" if share is None else f"{share:.0f}",
        ]
        if name:
            seconds = PAPER[dimension].get(points)
            cells.append("" if seconds is None else f"{seconds:,.2f}")
        yield "| " + " | ".join(map(str, cells)) + " |"
    yield ""
    found = exponent(records)
    if found is not None:
        yield f"Processor time grows like columns^{found:.2f}, fitted over the rows of two seconds and more."
        yield ""


def main() -> None:
    """Run what is missing, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", action="append", metavar="weight-3D", help="some tables, repeatable")
    parser.add_argument("--most", type=int, default=10**9, help="no more points than this")
    parser.add_argument("--limit", type=float, default=280.0, help="seconds for each run")
    parser.add_argument("--runs", type=Path, default=Path("runs/scale.jsonl"))
    parser.add_argument("--page", type=Path, default=Path("docs/scale.md"))
    arguments = parser.parse_args()
    lines = [HEAD]
    for (objective, dimension), sizes in SIZES.items():
        stored = {tuple(json.loads(line)["key"]) for line in _lines(arguments.runs)}
        wanted = arguments.only is None or f"{objective}-{dimension}D" in arguments.only
        keys = [(objective, dimension, points) for points in sizes]
        keys = [key for key in keys if key in stored or (wanted and key[2] <= arguments.most)]
        records = run_all(keys, lambda *key: measure(*key, arguments.limit), arguments.runs)
        if records:
            lines.extend(table(objective, dimension, records))
    arguments.page.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


def _lines(file: Path) -> list[str]:
    return file.read_text(encoding="utf-8").splitlines() if file.exists() else []


if __name__ == "__main__":
    main()

"""A combinatorial algorithm for stable sets beside the integer program (docs/paper.md).

The paper ends with the wish to compare its programs with graph algorithms for the stable set problem. `networkx` has
an exact branch and bound for cliques of largest weight; here it runs on the graph of pairs that do not cross.
Triangulations of least cost are stable sets of the largest weight ``M v_t - c_t``, v_t being exact volumes and M
larger than all costs together; the largest volume of a region that can be covered is one as it is. Each run has a
process of its own, which is ended when its time is up.
"""

from __future__ import annotations

import argparse
import multiprocessing
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from runs import run_all

import bcut
from bcut.formulations.region import tetrahedra_crossing
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.crossings import crossing_matrix
from bcut.geometry.simplices import candidate_simplices
from bcut.geometry.surface import Region
from bcut.geometry.volumes import volumes
from bcut.instance import load_instance
from bcut.solving.region import load_surface

INSTANCES = [
    *(("triangulation", f"random:{n},2,seed=1", n >= 9) for n in (6, 8, 10, 12, 14, 16)),
    *(("triangulation", f"random:{n},3,seed=1", n >= 8) for n in (6, 8, 10, 11, 12)),
    ("triangulation", "cyclic:8,3", False),
    ("triangulation", "cube:3", False),
    *(
        ("region", name, False)
        for name in ("twisted-prism:4", "twisted-prism:5", "twisted-prism:6", "chazelle:2")
    ),
]


def problem(kind: str, instance: str, spanning: bool) -> tuple[np.ndarray[Any, Any], list[int]]:
    """Return which pairs cross, and integer weights."""
    if kind == "region":
        region = Region.of(*load_surface(instance))
        return tetrahedra_crossing(region), region.volumes
    configuration = load_instance(instance)
    chirotope = Chirotope.of(configuration)
    simplices = candidate_simplices(chirotope, spanning=spanning)
    sizes = [int(size) for size in volumes(configuration, simplices)[:, 0]]
    return crossing_matrix(chirotope, simplices), [size * (len(simplices) + 1) - 1 for size in sizes]


def clique(crossing: np.ndarray[Any, Any], weights: list[int], pipe: Connection) -> None:
    """Send a stable set of the largest weight, and the seconds that it took."""
    import networkx as nx

    graph = nx.from_numpy_array(~crossing & ~np.eye(len(crossing), dtype=bool))
    for column, weight in enumerate(weights):
        graph.nodes[column]["weight"] = weight
    started = time.perf_counter()
    found, _ = nx.max_weight_clique(graph, weight="weight")
    pipe.send((sorted(map(int, found)), time.perf_counter() - started))


def measure(kind: str, instance: str, spanning: bool, limit: float) -> dict[str, Any]:
    """Run both, and compare what they find."""
    crossing, weights = problem(kind, instance, spanning)
    started = time.perf_counter()
    if kind == "region":
        result: Any = bcut.region(instance)
        ours = sum(weights[column] for column in columns_of_region(instance, result.triangulation))
    else:
        result = bcut.solve(instance, spanning=spanning)
        ours = result.value
    seconds = time.perf_counter() - started
    near, far = multiprocessing.get_context("spawn").Pipe(duplex=False)
    process = multiprocessing.get_context("spawn").Process(target=clique, args=(crossing, weights, far))
    process.start()
    found, taken = near.recv() if near.poll(limit) else (None, 0.0)
    process.kill()
    process.join()
    theirs: int | None = None
    if found is not None:
        theirs = sum(weights[column] for column in found) if kind == "region" else len(found)
    pairs = len(crossing) * (len(crossing) - 1) // 2
    return {
        "nodes": len(crossing),
        "density": float(np.triu(crossing).sum() / max(1, pairs)),
        "program": ours,
        "graph": theirs,
        "seconds of the program": round(seconds, 2),
        "seconds of the graph": None if found is None else round(taken, 2),
    }


def columns_of_region(instance: str, triangulation: list[list[int]]) -> list[int]:
    """Return the numbers of some tetrahedra of a region."""
    listed = Region.of(*load_surface(instance)).tetrahedra.tolist()
    return [listed.index(tetrahedron) for tetrahedron in triangulation]


def main() -> None:
    """Run what is not stored, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument(
        "--limit", type=float, default=20.0, metavar="S", help="seconds for the graph algorithm"
    )
    options = parser.parse_args()
    keys = [(*instance, options.limit) for instance in INSTANCES]
    records = run_all(keys, measure, options.output / "stable-set.jsonl")
    print(
        "\n| instance | simplices | pairs that cross | optimum | integer program, s | `max_weight_clique`, s |"
    )
    print("|---|---:|---:|---:|---:|---:|")
    for record in records:
        kind, name, spanning, limit = record["key"]
        agree = record["graph"] in (None, record["program"])
        taken = record["seconds of the graph"]
        print(
            f"| `{name}`{' spanning' if spanning else ''}{', volume' if kind == 'region' else ''} | {record['nodes']} "
            f"| {100 * record['density']:.0f} % | {record['program'] if agree else 'DIFFERENT'} "
            f"| {record['seconds of the program']:.2f} | {f'over {limit:.0f}' if taken is None else f'{taken:.2f}'} |"
        )


if __name__ == "__main__":
    main()

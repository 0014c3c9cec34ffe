"""Conjecture 1 of the paper, and what is left of it in space, on fractional points of P2 (docs/paper.md).

In the plane: no convex polygon cut may be violated, whatever the point of P2: vertices for random objectives and in the
direction of cuts, and mixtures of them. In space: the number of tetrahedra over P2 is not bounded by that of the
largest triangulation, while the angle inequalities that replace it hold.
"""

from __future__ import annotations

import argparse
import json
from fractions import Fraction
from itertools import chain, combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from runs import run_all

import bcut
from bcut.bounds.linear_program import LinearProgram, solve_linear_program
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.formulation import Formulation
from bcut.geometry.configuration import PointConfiguration
from bcut.instance import load_instance

PLANE = [
    *(f"random:{n},2,seed={seed}" for n in (7, 8, 9) for seed in range(1, 5)),
    *("polygon:5,center", "polygon:8", "polygon:7,center", "moae", "grid:3,3"),
]
SPACE = [*(f"random:7,3,seed={seed}" for seed in range(1, 5)), "prism:3", "cyclic:7,3"]
LARGEST = [f"random:{n},3,seed={seed}" for n in (9, 10, 11, 12) for seed in range(1, 11)]
FRACTIONAL = 1e-6


def points_of(
    formulation: Formulation, cuts: list[tuple[int, ...]], vertices: int, mixtures: int, seed: int
) -> NDArray[np.float64]:
    """Return points of P2, one a row: vertices for random objectives and in the direction of cuts, then mixtures."""
    rng = np.random.default_rng(seed)
    width = formulation.width
    found = []
    for number in range(vertices):
        costs = rng.normal(size=width)
        if number % 3 == 1:
            costs = rng.integers(0, 2, size=width).astype(float)
        elif number % 3 == 2:
            chosen = cuts[rng.integers(len(cuts))]
            costs = 1e-3 * costs - np.isin(formulation.simplices, chosen).all(axis=1)
        program = LinearProgram(
            costs, formulation.matrix, formulation.lower.astype(float), formulation.upper.astype(float)
        )
        found.append(solve_linear_program(program).x)
    corners = np.array(found)
    shares = rng.dirichlet(np.full(4, 0.7), size=mixtures)
    chosen = rng.integers(0, len(corners), size=(mixtures, 4))
    return np.concatenate((corners, np.einsum("ij,ijk->ik", shares, corners[chosen])))


def closed_sets(configuration: PointConfiguration, formulation: Formulation) -> list[tuple[int, ...]]:
    """List the sets V of at least d + 2 points that contain all points in their hull."""
    n, d = configuration.n, configuration.dimension
    sides = formulation.chirotope.sides
    found = []
    for size in range(d + 2, n + 1):
        for chosen in combinations(range(n), size):
            part = sides[:, chosen]
            # What is beyond some hyperplane that has all of V on its other side is outside.
            above, below = (part >= 0).all(axis=1), (part <= 0).all(axis=1)
            out = (sides[above] < 0).any(axis=0) | (sides[below] > 0).any(axis=0)
            if set(np.flatnonzero(~out).tolist()) <= set(chosen) and (part != 0).any():
                found.append(chosen)
    return found


def in_the_plane(instance: str, spanning: bool, vertices: int, mixtures: int) -> dict[str, Any]:
    """Compare every convex polygon cut with every point."""
    configuration = load_instance(instance)
    formulation = cocircuit_formulation(configuration, spanning=spanning)
    cuts = closed_sets(configuration, formulation)
    x = points_of(formulation, cuts, vertices, mixtures, 7)
    fractional = (np.minimum(x, 1 - x) > FRACTIONAL).any(axis=1)
    least, tight = np.inf, 0
    for chosen in cuts:
        boundary = sum(on_boundary(formulation, chosen, point) for point in chosen)
        room = 2 * (len(chosen) - boundary) + boundary - 2
        inside = np.isin(formulation.simplices, chosen).all(axis=1)
        slack = room - x[:, inside].sum(axis=1)
        least, tight = min(least, float(slack.min())), tight + int((slack[fractional] < 1e-6).sum())
    return {
        "points": len(x),
        "fractional": int(fractional.sum()),
        "non-vertices": int(fractional[vertices:].sum()),
        "cuts": len(cuts),
        "tight": tight,
        "least slack": least,
    }


def on_boundary(formulation: Formulation, chosen: tuple[int, ...], point: int) -> bool:
    """Tell whether a point is on the boundary of the hull of a set that it belongs to."""
    sides = formulation.chirotope.sides[:, chosen]
    supporting = ((sides >= 0).all(axis=1) | (sides <= 0).all(axis=1)) & (sides != 0).any(axis=1)
    return bool((formulation.chirotope.sides[supporting, point] == 0).any())


def in_space(instance: str, vertices: int, mixtures: int) -> dict[str, Any]:
    """Compare the angle inequalities of all edges of all closed sets, and Gram's count, with every point."""
    configuration = load_instance(instance)
    formulation = cocircuit_formulation(configuration)
    cuts = closed_sets(configuration, formulation)
    x = points_of(formulation, cuts, vertices, mixtures, 7)
    simplices = formulation.simplices.tolist()
    wedges = {
        edge: np.array(
            [wedge(configuration.floats, edge, t) if set(edge) <= set(t) else 0.0 for t in simplices]
        )
        for edge in combinations(range(configuration.n), 2)
    }
    whole = tuple(range(configuration.n))
    covered = {edge: x @ angles / span(configuration.floats, edge, whole) for edge, angles in wedges.items()}
    least, count = np.inf, np.inf
    for chosen in cuts:
        inside = np.isin(formulation.simplices, chosen).all(axis=1)
        bound = np.zeros(len(x))
        for edge in combinations(chosen, 2):
            angle = span(configuration.floats, edge, chosen)
            slack = angle * covered[edge] - x[:, inside] @ wedges[edge][inside]
            bound += angle * covered[edge] / (2 * np.pi)
            least = min(least, float(slack.min()))
        count = min(count, float((bound - x[:, inside].sum(axis=1)).min()))
    return {
        "points": len(x),
        "fractional": int((np.minimum(x, 1 - x) > FRACTIONAL).any(axis=1).sum()),
        "cuts": len(cuts),
        "least slack at an edge": least,
        "least slack of the count": count,
    }


def directions(points: NDArray[np.float64], edge: tuple[int, int], others: list[int]) -> NDArray[np.float64]:
    """Return the angles of other points around an edge; points on its line are left out."""
    axis = points[edge[1]] - points[edge[0]]
    axis /= np.linalg.norm(axis)
    first = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    first /= np.linalg.norm(first)
    rows = points[others] - points[edge[0]]
    flat = np.column_stack((rows @ first, rows @ np.cross(axis, first)))
    flat = flat[np.linalg.norm(flat, axis=1) > 1e-9]
    return np.arctan2(flat[:, 1], flat[:, 0])


def wedge(points: NDArray[np.float64], edge: tuple[int, int], simplex: list[int]) -> float:
    """Return the dihedral angle of a tetrahedron at an edge."""
    a, b = directions(points, edge, [v for v in simplex if v not in edge])
    turn = abs(a - b)
    return float(min(turn, 2 * np.pi - turn))


def span(points: NDArray[np.float64], edge: tuple[int, int], chosen: tuple[int, ...]) -> float:
    """Return the angle of the hull of some points at a pair of them: a whole turn where the pair is interior."""
    around = np.sort(directions(points, edge, [v for v in chosen if v not in edge]))
    gaps = np.diff(np.append(around, around[0] + 2 * np.pi))
    return float(2 * np.pi - gaps.max()) if gaps.max() > np.pi - 1e-9 else 2 * np.pi


def largest(instance: str) -> dict[str, Any]:
    """Compare the largest number of tetrahedra over P2 with that of a triangulation."""
    root = bcut.bound(instance, sense="max", separators=[]).root.lp
    found = bcut.solve(instance, sense="max", time_limit=30)
    return {"lp": root, "optimum": found.value, "status": found.status}


def main() -> None:
    """Run everything that is not stored, and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--vertices", type=int, default=90, help="random objectives per instance")
    parser.add_argument("--mixtures", type=int, default=200, help="mixtures of vertices per instance")
    options = parser.parse_args()
    sizes = options.vertices, options.mixtures
    plane = run_all(
        chain.from_iterable(((name, False, *sizes), (name, True, *sizes)) for name in PLANE),
        in_the_plane,
        options.output / "plane.jsonl",
    )
    space = run_all([(name, *sizes) for name in SPACE], in_space, options.output / "space.jsonl")
    gaps = run_all([(name,) for name in LARGEST], largest, options.output / "largest.jsonl")

    def total(records: list[dict[str, Any]], key: str) -> int:
        return sum(int(record[key]) for record in records)

    comparisons = sum(record["points"] * record["cuts"] for record in plane)
    print(
        f"\nplane: {len(plane)} problems, {total(plane, 'cuts'):,} convex polygon cuts, {comparisons:,} comparisons"
    )
    print(
        f"{total(plane, 'points'):,} points of P2, {total(plane, 'fractional'):,} fractional, "
        f"{total(plane, 'non-vertices'):,} of these mixtures; "
        f"{total(plane, 'tight'):,} times equality at a fractional point, least slack "
        f"{min(record['least slack'] for record in plane):.1e}"
    )
    print(
        f"space: {total(space, 'points'):,} points, {total(space, 'fractional'):,} fractional, least slack at an edge "
        f"{min(record['least slack at an edge'] for record in space):.1e}, of the count "
        f"{min(record['least slack of the count'] for record in space):.1e}"
    )
    beyond = [
        record
        for record in gaps
        if record["status"] == "optimal" and Fraction(record["lp"]) > record["optimum"] + Fraction(1, 10**4)
    ]
    print(
        f"space: the largest number over P2 exceeds that of a triangulation in {len(beyond)} of {len(gaps)}:"
    )
    print("\n".join(json.dumps(record) for record in beyond))


if __name__ == "__main__":
    main()

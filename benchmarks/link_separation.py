"""One round of link separation beside one ``scipy.optimize.linprog`` call per face, on the same points.

The reference solves, for every face whose star carries a fractional value, the separation problem as it is
first written down: variables alpha, weights in [0, 1] and shortest-path potentials for every tail of a wedge
over the direction; maximise ``alpha * y_e - w x``. The column "separation" does the same work for the same
points: it finds the most violated weights of every face; both agree, which is checked. "With lifting" is the
whole round of the separator: exact cuts, lifted to all simplices.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import scipy.sparse as sp
from scipy.optimize import linprog

from bcut.bounds.relaxation import Relaxation
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.stars import Star
from bcut.instance import load_instance
from bcut.objectives.objective import make_objective
from bcut.separation.driver import to_integers
from bcut.separation.seam import FractionalPoint, Problem
from bcut.separators.link import Link, most_violated_weights


def reference(star: Star, x: np.ndarray) -> float:
    """Return the violation of the best cut with weights in [0, 1] and alpha at most 1."""
    support = np.flatnonzero(x > 1e-9)
    tails, heads, values = star.tails[support], star.heads[support], x[support]
    over = star.wraps[support]
    sinks, count, size = np.unique(tails[over]), len(support), star.size
    # Columns: alpha, weights, potentials of each commodity at each node; rows as A z <= 0.
    rows, columns, entries, number = [], [], [], 0

    def add(*terms: tuple[int, float]) -> None:
        nonlocal number
        for column, entry in terms:
            rows.append(number)
            columns.append(column)
            entries.append(entry)
        number += 1

    for commodity, sink in enumerate(sinks.tolist()):
        base = 1 + count + commodity * size
        for wedge in range(count):
            tail, head = int(tails[wedge]), int(heads[wedge])
            if not over[wedge]:
                add((base + head, 1.0), (base + tail, -1.0), (1 + wedge, -1.0))
            elif tail == sink:
                add((base + head, 1.0), (1 + wedge, -1.0))
        add((0, 1.0), (base + sink, -1.0))
    total = 1 + count + len(sinks) * size
    costs = np.zeros(total)
    costs[0] = -values[over].sum()
    costs[1 : 1 + count] = values
    bounds = [(0, 1)] * (1 + count) + [(None, 2)] * (len(sinks) * size)
    matrix = sp.csr_matrix((entries, (rows, columns)), shape=(number, total))
    return -linprog(costs, A_ub=matrix, b_ub=np.zeros(number), bounds=bounds).fun


def main() -> None:
    """Time both on the first relaxation points of an instance."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("instance", nargs="?", default="random:30,3,seed=0")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    formulation = cocircuit_formulation(load_instance(options.instance), spanning=True)
    objective = make_objective("cardinality", formulation)
    relaxation = Relaxation(formulation, objective)
    problem = Problem(formulation)
    separator = Link()
    separator.setup(problem)
    print("round | LP | separation | with lifting | faces | linprog | ratio | ratio with lifting")
    for number in range(1, options.rounds + 1):
        started = time.perf_counter()
        solution = relaxation.solve()
        assert solution is not None
        lp_seconds = time.perf_counter() - started
        point = FractionalPoint(problem, solution.x)
        # Angular orders are computed once per face and kept, for both.
        wedges = np.isin(separator.stars.columns, point.fractional)
        faces = np.unique(separator.stars.face_of[wedges]).tolist()
        stars = {face: separator.stars.star(face) for face in faces}
        started = time.perf_counter()
        found = {
            face: most_violated_weights(stars[face], point.x[stars[face].columns], separator.programs)[0]
            for face in separator.faces_to_try(point.x)
        }
        separation_seconds = time.perf_counter() - started
        started = time.perf_counter()
        cuts = list(separator.separate(point))
        seconds = time.perf_counter() - started
        started = time.perf_counter()
        expected = [reference(star, point.x[star.columns]) for star in stars.values()]
        reference_seconds = time.perf_counter() - started
        assert np.allclose([found.get(face, 0.0) for face in faces], expected, atol=1e-5)
        print(
            f"{number} | {lp_seconds:.2f} | {separation_seconds:.3f} | {seconds:.3f} | {len(stars)} "
            f"| {reference_seconds:.3f} | {reference_seconds / separation_seconds:.1f} "
            f"| {reference_seconds / seconds:.1f}",
            flush=True,
        )
        relaxation.add([to_integers(cut, "link", len(point.x)) for cut in cuts])


if __name__ == "__main__":
    main()

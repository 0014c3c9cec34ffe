"""Odd-cycle cuts: shortest walks, cycles without chords, lifting, and what they do to a bound."""

from __future__ import annotations

import numpy as np
import pytest
from cut_families import loop, problem, random_graph, ready
from numpy.typing import NDArray

from bcut.bounds.root import root_bound
from bcut.families import build
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.objectives.objective import Objective, make_objective
from bcut.separation.graphs.odd_cycles import (
    chordless_cycle,
    heaviest_stable,
    hole_gains,
    odd_closed_walks,
    sequential_lifting,
)
from bcut.separation.seam import FractionalPoint, Problem
from bcut.separators.odd_cycle import OddCycle


def stable_sets(graph: NDArray[np.bool_]) -> list[list[int]]:
    """All stable sets: those of the nodes before one, and the same with it where it has no neighbour in them."""
    found: list[list[int]] = [[]]
    for node, row in enumerate(graph.tolist()):
        found += [[*nodes, node] for nodes in found if not any(row[other] for other in nodes)]
    return found


def cycle_graph(size: int) -> NDArray[np.bool_]:
    nodes = np.arange(size)
    return (np.abs(nodes[:, None] - nodes) % (size - 2)) == 1


def least_odd_walks(graph: NDArray[np.bool_], values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Lengths of shortest odd closed walks through each node, by repeated (min, +) products of all walk lengths."""
    size = len(values)
    lengths = np.where(graph, np.maximum(0, 1 - values[:, None] - values), np.inf)
    odd, even = lengths, np.where(np.eye(size, dtype=bool), 0.0, np.inf)
    for _ in range(2 * size):
        even = np.minimum(even, (odd[:, :, None] + lengths[None]).min(axis=1))
        odd = np.minimum(odd, (even[:, :, None] + lengths[None]).min(axis=1))
    return odd.diagonal()


@pytest.mark.parametrize("seed", range(8))
def test_both_backends_find_walks_of_the_least_length(seed: int) -> None:
    random = np.random.default_rng(seed)
    graph = random_graph(15, random.choice([0.2, 0.4]), random)
    values = random.choice([0.1, 0.25, 0.4, 0.5], 15)
    least = least_odd_walks(graph, values)
    lengths = []
    for backend in ("scipy", "networkx"):
        found = {}
        for walk in odd_closed_walks(graph, values, backend):
            assert len(walk) % 2 == 1
            steps = list(zip(walk, [*walk[1:], walk[0]], strict=True))
            assert all(graph[u, v] for u, v in steps)
            found[walk[0]] = sum(max(0.0, 1 - values[u] - values[v]) for u, v in steps)
        assert set(found) >= set(np.flatnonzero(least < 1.1 - 1e-9).tolist())
        for node, length in found.items():
            assert length == pytest.approx(least[node])
        lengths.append(found)
    assert lengths[0] == pytest.approx(lengths[1])


@pytest.mark.parametrize("backend", ["scipy", "networkx"])
def test_both_backends_cut_the_same_point_as_deeply(backend: str) -> None:
    given = problem("random:12,3,seed=1000", spanning=True)
    x = root_bound(given.formulation, make_objective("cardinality", given.formulation)).point
    assert x is not None
    point = FractionalPoint(given, x)
    cuts = list(ready(OddCycle(backend=backend, lift=0), given).separate(point))
    assert cuts
    assert max(point.value(cut) - float(cut.rhs) for cut in cuts) == pytest.approx(0.5)


def test_a_walk_becomes_a_cycle_without_chords_that_is_no_less_violated() -> None:
    random = np.random.default_rng(3)
    lengths = []
    for _ in range(200):
        graph = random_graph(14, 0.3, random)
        # Edges are satisfied: the values of two neighbours add up to 1 at most.
        values = random.choice([0.3, 0.4, 0.5], 14)
        for walk in odd_closed_walks(graph, values):
            cycle = chordless_cycle(walk, graph)
            size = len(cycle)
            assert size % 2 == 1
            assert len(set(cycle)) == size
            among = graph[np.ix_(cycle, cycle)]
            assert (among == (cycle_graph(size) if size > 3 else ~np.eye(3, dtype=bool))).all()
            assert values[cycle].sum() - (size - 1) / 2 >= values[walk].sum() - (len(walk) - 1) / 2 - 1e-9
            lengths.append(size)
    assert {3, 5} <= set(lengths)


def test_a_long_walk_with_repetitions_and_chords_is_cut_down() -> None:
    graph = np.zeros((9, 9), dtype=bool)
    for u, v in [(0, 1), (1, 2), (2, 0), (2, 3), (3, 4), (4, 5), (5, 6), (6, 2), (5, 7)]:
        graph[u, v] = graph[v, u] = True
    # There and back again, then round the triangle.
    assert sorted(chordless_cycle([3, 2, 1, 0, 2], graph)) == [0, 1, 2]
    assert sorted(chordless_cycle([7, 5, 6, 2, 3, 4, 5], graph)) == [2, 3, 4, 5, 6]


@pytest.mark.parametrize("size", [3, 5, 7, 9])
def test_gains_count_what_a_column_takes_away(size: int) -> None:
    graph = cycle_graph(size) if size > 3 else ~np.eye(3, dtype=bool)
    patterns = np.array([[mask >> i & 1 for mask in range(1 << size)] for i in range(size)], dtype=bool)
    stable = stable_sets(graph)
    gains = hole_gains(patterns)
    for pattern, gain in zip(patterns.T, gains.tolist(), strict=True):
        most = max(len(nodes) for nodes in stable if not pattern[nodes].any())
        assert gain == (size - 1) // 2 - most


def test_the_heaviest_stable_set_is_exact_up_to_the_cap() -> None:
    random = np.random.default_rng(5)
    for _ in range(40):
        graph = random_graph(9, 0.4, random)
        weights = dict(enumerate(random.integers(1, 4, 9).tolist()))
        adjacent = [sum(1 << int(j) for j in np.flatnonzero(row)) for row in graph]
        best = max(sum(weights[i] for i in nodes) for nodes in stable_sets(graph))
        for cap in (1, 3, 100):
            assert heaviest_stable((1 << 9) - 1, adjacent, weights, cap) == min(cap, best)


@pytest.mark.parametrize("size", [3, 5, 7])
def test_lifted_cycles_are_valid_and_no_coefficient_can_grow(size: int) -> None:
    random = np.random.default_rng(size)
    grown = 0
    for _ in range(25):
        graph = random_graph(size + 5, 0.75, random)
        graph[:size, :size] = cycle_graph(size) if size > 3 else ~np.eye(3, dtype=bool)
        coefficients = np.concatenate((np.ones(size, dtype=int), sequential_lifting(size, graph, 5)))
        left_sides = [(sum(coefficients[node] for node in nodes), nodes) for nodes in stable_sets(graph)]
        assert max(left for left, _ in left_sides) == (size - 1) // 2
        last = size + 4
        with_last = [left for left, nodes in left_sides if last in nodes]
        assert max(with_last) == (size - 1) // 2 or coefficients[last] == 0
        grown += int((coefficients[size:] > 0).sum())
    assert grown > 0


def test_a_hub_gets_the_whole_right_hand_side_and_lifting_stops_when_told() -> None:
    graph = np.zeros((9, 9), dtype=bool)
    graph[:7, :7] = cycle_graph(7)
    graph[7:, :7] = graph[:7, 7:] = True
    assert sequential_lifting(7, graph, 2).tolist() == [3, 0], "two hubs that do not cross share it"
    graph[7, 8] = graph[8, 7] = True
    assert sequential_lifting(7, graph, 2).tolist() == [3, 3]
    assert sequential_lifting(7, graph, 1).tolist() == [3, 0]


def test_the_pentagon_with_centre_of_the_paper() -> None:
    """Sec. 2.5: the relaxation gives 0; odd-cycle cuts raise it to 1; the convex polygon cut is redundant."""
    formulation = cocircuit_formulation(build("polygon:5,center"))
    # The paper's corners 1..5 are 0..4 here, and its centre 0 is 5.
    free = ["123", "234", "345", "145", "125", "013", "024", "035", "014", "025"]
    simplices = {tuple(sorted((int(v) - 1) % 6 for v in text)) for text in free}
    costs = np.array([int(tuple(simplex) not in simplices) for simplex in formulation.simplices.tolist()])
    assert costs.sum() == 10
    bound, separation = loop(formulation, Objective("paper", "min", costs), "odd-cycle", "convex-polygon")
    assert bound.lp == pytest.approx(0)
    assert bound.lp_after_cuts == pytest.approx(1)
    assert separation.statistics["odd-cycle"].added > 0
    assert separation.statistics["convex-polygon"].calls > 0
    assert separation.statistics["convex-polygon"].found == 0


def test_the_fractional_point_of_the_paper_is_cut_off() -> None:
    formulation = cocircuit_formulation(build("polygon:5,center"))
    without_centre = formulation.columns_of(np.array([[0, 1, 2], [1, 2, 3], [2, 3, 4], [0, 3, 4], [0, 1, 4]]))
    with_centre = formulation.columns_of(np.array([[0, 2, 5], [1, 3, 5], [2, 4, 5], [0, 3, 5], [1, 4, 5]]))
    given = Problem(formulation)
    x = np.zeros(20)
    x[without_centre] = 0.5
    (cut,) = ready(OddCycle(lift=0), given).separate(FractionalPoint(given, x))
    assert sorted(np.asarray(cut.simplices).tolist()) == sorted(without_centre.tolist())
    assert cut.rhs == 2
    x[with_centre] = 0.5
    assert (formulation.matrix @ x == formulation.lower).all(), "it is a point of Formulation 2"
    point = FractionalPoint(given, x)
    cuts = list(ready(OddCycle(), given).separate(point))
    assert len(cuts) > 1
    assert all(point.value(cut) >= 2.5 and cut.rhs == 2 for cut in cuts)


@pytest.mark.parametrize(
    ("instance", "before", "after"),
    [
        ("random:12,3,seed=1000", 16.5, 17),
        ("random:14,3,seed=1000", 20.5, 21),
        ("random:16,3,seed=1000", 24.5, 25),
    ],
)
def test_lifted_odd_cycles_close_the_gap(instance: str, before: float, after: float) -> None:
    formulation = cocircuit_formulation(build(instance), spanning=True)
    bound, _ = loop(formulation, make_objective("cardinality", formulation), "clique", "odd-cycle")
    assert bound.lp == pytest.approx(before)
    assert bound.lp_after_cuts == pytest.approx(after)

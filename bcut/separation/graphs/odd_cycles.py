"""Odd cycles of a graph, and lifting nodes into their inequalities: what cuts from pairs that exclude each other share.

Of the k nodes of an odd cycle a stable set has at most (k - 1) / 2. `odd_closed_walks` finds violated cycles,
`chordless_cycle` cuts them down, `sequential_lifting` adds other nodes with the largest coefficients that are valid.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Cycles up to this length are looked at: those not shorter than 1 may be violated once they are lifted.
_REACH = 1.1


def most_useful_first(
    candidates: NDArray[np.integer], gains: NDArray[np.integer], values: NDArray[np.floating]
) -> NDArray[np.integer]:
    """Sort candidates by what they may add to a cut, coefficient times value, then by their possible coefficients."""
    gains, added = gains[candidates], gains[candidates] * values[candidates]
    return candidates[np.lexsort((np.arange(len(candidates)), -gains, -added))]


def lifted_violation(cycle: list[int], crossings: NDArray[np.bool_], values: NDArray[np.floating]) -> float:
    """Return by how much the cut of a chordless odd cycle is violated when other nodes are lifted into it."""
    gains = hole_gains(crossings[cycle])
    gains[cycle] = 0
    candidates = most_useful_first(np.flatnonzero(gains), gains, values)
    nodes = np.concatenate((cycle, candidates)).astype(np.intp)
    coefficients = sequential_lifting(len(cycle), crossings[np.ix_(nodes, nodes)], len(candidates))
    left_side = values[cycle].sum() + coefficients @ values[candidates]
    return float(left_side) - (len(cycle) - 1) / 2


def odd_closed_walks(
    crossings: NDArray[np.bool_], values: NDArray[np.floating], backend: str = "scipy"
) -> Iterator[list[int]]:
    """Find, through each node of a graph, a shortest odd closed walk, if it is no longer than 1, about.

    Parameters
    ----------
    crossings : ndarray of bool, shape (k, k)
        A graph: symmetric, without loops.
    values : ndarray of float, shape (k,)
        The length of an edge is ``max(0, 1 - values[u] - values[v])``.
    backend : {"scipy", "networkx"}

    Yields
    ------
    list of int
        Nodes in the order of the walk, the first one not repeated at the end.
    """
    rows, columns = np.nonzero(crossings)
    lengths = np.maximum(0.0, 1.0 - values[rows] - values[columns])
    yield from BACKENDS[backend](len(values), rows, columns, lengths)


def _walks_by_scipy(
    count: int, rows: NDArray[np.intp], columns: NDArray[np.intp], lengths: NDArray[np.float64]
) -> Iterator[list[int]]:
    import scipy.sparse as sp
    from scipy.sparse.csgraph import dijkstra

    ends = (np.concatenate((rows, rows + count)), np.concatenate((columns + count, columns)))
    cover = sp.csr_matrix((np.concatenate((lengths, lengths)), ends), shape=(2 * count, 2 * count))
    batch = 64  # distances and predecessors of a batch are dense
    for start in range(0, count, batch):
        sources = np.arange(start, min(start + batch, count))
        distances, before = dijkstra(cover, indices=sources, return_predecessors=True, limit=_REACH)
        for source, reached, previous in zip(sources.tolist(), distances, before, strict=True):
            if np.isfinite(reached[source + count]):
                walk = [source + count]
                while walk[-1] != source:
                    walk.append(int(previous[walk[-1]]))
                yield [node % count for node in walk[:0:-1]]


def _walks_by_networkx(
    count: int, rows: NDArray[np.intp], columns: NDArray[np.intp], lengths: NDArray[np.float64]
) -> Iterator[list[int]]:
    import networkx as nx

    cover = nx.Graph()
    for u, v, length in zip(rows.tolist(), columns.tolist(), lengths.tolist(), strict=True):
        cover.add_edge(u, v + count, weight=length)
    for source in range(count):
        if source in cover and source + count in cover:
            paths = nx.single_source_dijkstra(cover, source, cutoff=_REACH)[1]
            if source + count in paths:
                yield [node % count for node in paths[source + count][:-1]]


BACKENDS: dict[str, Any] = {"scipy": _walks_by_scipy, "networkx": _walks_by_networkx}


def chordless_cycle(walk: Sequence[int], crossings: NDArray[np.bool_]) -> list[int]:
    """Cut an odd closed walk down to an odd cycle without repeated nodes and without chords.

    A repeated node splits a closed walk into two, a chord a cycle, and one of the two parts is odd.
    """
    cycle: list[int] = []
    for node in [*walk, walk[0]]:
        if node in cycle:
            closed = cycle[cycle.index(node) :]
            if len(closed) % 2:
                cycle = closed
                break
            del cycle[-len(closed) :]
        cycle.append(node)
    while (split := _shortest_odd_part(cycle, crossings)) is not None:
        cycle = split
    return cycle


def _shortest_odd_part(cycle: list[int], crossings: NDArray[np.bool_]) -> list[int] | None:
    """Return the shortest odd cycle made of a chord and a part of an odd cycle; None if there is no chord."""
    size = len(cycle)
    among = crossings[np.ix_(cycle, cycle)]
    for part in range(3, size, 2):  # an odd number of consecutive nodes, closed by a chord
        starts = np.arange(size)
        closed = among[starts, (starts + part - 1) % size]
        if closed.any():
            start = int(np.argmax(closed))
            return [cycle[(start + step) % size] for step in range(part)]
    return None


def turned_cycle(cycle: Sequence[int]) -> tuple[int, ...]:
    """Return a cycle from its least node on, in the direction of that node's smaller neighbour."""
    start = cycle.index(min(cycle))
    turned = [*cycle[start:], *cycle[:start]]
    return tuple(turned if turned[1] < turned[-1] else [turned[0], *turned[:0:-1]])


def hole_gains(crossing: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the coefficient that each column gets when it alone is lifted into a chordless odd cycle.

    Parameters
    ----------
    crossing : ndarray of bool, shape (k, m)
        Which nodes of the cycle, in its order, each column crosses; k odd.

    Returns
    -------
    ndarray of int, shape (m,)
        (k - 1) / 2 minus the most pairwise non-crossing nodes of the cycle that the column does not cross:
        each run of r such nodes between two crossed ones has (r + 1) // 2.
    """
    size, count = crossing.shape
    most = np.zeros(count, dtype=np.int64)
    # Runs are counted once round the cycle, from the first crossed node on.
    first = np.argmax(crossing, axis=0)
    run = np.zeros(count, dtype=np.int64)
    everything = np.arange(count)
    for step in range(size + 1):
        crossed = crossing[(first + step) % size, everything]
        most += np.where(crossed, (run + 1) // 2, 0)
        run = np.where(crossed, 0, run + 1)
    most[~crossing.any(axis=0)] = (size - 1) // 2
    return (size - 1) // 2 - most


def sequential_lifting(
    size: int, crossings: NDArray[np.bool_], most: int, rhs: int | None = None
) -> NDArray[np.int64]:
    """Lift nodes, one after another, into the inequality of an odd cycle or another set of nodes.

    Parameters
    ----------
    size : int
        Length k of the cycle, which the first k nodes of the graph are; or the size of another set.
    crossings : ndarray of bool, shape (k + c, k + c)
        The graph, with c candidates in the order in which they are tried.
    most : int
        Stop when that many have a positive coefficient.
    rhs : int, optional
        At most so many nodes of the set are in a stable set; (k - 1) / 2 if left out.

    Returns
    -------
    ndarray of int, shape (c,)
        Coefficients of the candidates, zero where one is left out.
    """
    packed = np.packbits(crossings, axis=1, bitorder="little")
    adjacent = [int.from_bytes(row.tobytes(), "little") for row in packed]
    weights = dict.fromkeys(range(size), 1)
    rhs = (size - 1) // 2 if rhs is None else rhs
    inside = (1 << size) - 1
    for node in range(size, len(crossings)):
        coefficient = rhs - heaviest_stable(inside & ~adjacent[node], adjacent, weights, rhs)
        if coefficient > 0:
            weights[node] = coefficient
            inside |= 1 << node
            if len(weights) == size + most:
                break
    return np.array([weights.get(node, 0) for node in range(size, len(crossings))], dtype=np.int64)


def heaviest_stable(nodes: int, adjacent: Sequence[int], weights: dict[int, int], cap: int) -> int:
    """Return the largest weight of a stable set among some nodes of a graph, or `cap` if that is less.

    Parameters
    ----------
    nodes : int
        A bit mask.
    adjacent : sequence of int
        The neighbours of each node, as masks.
    weights : dict of int to int
        Positive weights.
    cap : int
        Positive; the search stops as soon as it is reached.
    """
    best = 0
    while nodes:
        lowest = nodes & -nodes
        nodes ^= lowest
        node = lowest.bit_length() - 1
        weight, rest = weights[node], nodes & ~adjacent[node]
        if rest and weight < cap:
            weight += heaviest_stable(rest, adjacent, weights, cap - weight)
        if weight >= cap:
            return cap
        best = max(best, weight)
    return best

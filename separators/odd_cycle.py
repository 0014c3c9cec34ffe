"""Odd-cycle cuts: of k simplices that cross in a cycle, k odd, at most (k - 1) / 2 are in a triangulation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from bcut.separation.seam import Cut, FractionalPoint, Separator

# Cuts count as violated from this much on.
_MARGIN = 1e-4

# Cycles up to this length are looked at: those not shorter than 1 may be violated once they are lifted.
_REACH = 1.1

# Candidates for lifting that are tried, per simplex that is lifted.
_POOL = 4


class OddCycle(Separator):
    """Of k simplices that cross in a cycle, k odd, at most (k - 1) / 2: odd holes, lifted.

    The cuts are ``sum of x over the cycle <= (k - 1) / 2`` (the paper, Sec. 2.5). With edge lengths ``1 - x_u
    - x_v`` the cut is violated exactly when the cycle is shorter than 1. A shortest odd closed walk through a
    node v is a shortest path between the two copies of v in the bipartite double cover of the graph. Such a
    walk is cut down to a cycle without chords, which is violated at least as much: the rest of the walk is
    even, and edges cover it. Three simplices that cross pairwise are a cycle, too.

    Each cycle is then lifted, one simplex after another: a simplex w gets the coefficient ``rhs - (the most
    that the cut's left side can be on pairwise non-crossing simplices that do not cross w)``, which is what
    is valid for any triangulation that contains w, by the definition of that maximum. For a simplex that
    crosses the whole cycle it is (k - 1) / 2: an odd wheel.

    Parameters
    ----------
    max_cuts : int
        At most this many cuts per point, most violated first.
    backend : {"scipy", "networkx"}
        What finds the shortest paths; the cycles' lengths are the same.
    max_nodes : int
        Only that many fractional simplices, those of largest value, are looked at. Where no crossing pair is
        violated, a cycle through v is violated by x_v at most, because edges cover the rest of it: little is
        lost.
    lift : int
        At most this many simplices are lifted into each cycle.
    """

    name: ClassVar[str] = "odd-cycle"
    dissections: ClassVar[bool] = True

    def __init__(
        self, *, max_cuts: int = 50, backend: str = "scipy", max_nodes: int = 500, lift: int = 150
    ) -> None:
        if min(max_cuts, max_nodes) < 1 or lift < 0:
            raise ValueError("max_cuts and max_nodes are at least 1, lift at least 0")
        if backend not in _BACKENDS:
            raise ValueError(f"backend is scipy or networkx, not '{backend}'")
        self.max_cuts, self.backend, self.max_nodes, self.lift = max_cuts, backend, max_nodes, lift

    def separate(self, point: FractionalPoint) -> Iterator[Cut]:
        """Yield violated odd cycles, at most one per fractional simplex, most violated first."""
        columns = point.heaviest(self.max_nodes)
        values, crossings = point.x[columns], point.crossings_among(columns)
        cycles: dict[tuple[int, ...], float] = {}
        for walk in odd_closed_walks(crossings, values, self.backend):
            cycle = chordless_cycle(walk, crossings)
            violation = float(values[cycle].sum()) - (len(cycle) - 1) / 2
            if violation <= _MARGIN and self.lift:
                violation = _lifted_violation(cycle, crossings, values)
            if violation > _MARGIN:
                cycles.setdefault(_turned(cycle), violation)
        ranked = sorted(cycles, key=lambda cycle: (-cycles[cycle], cycle))
        for nodes in ranked[: self.max_cuts]:
            members = columns[list(nodes)]
            lifted, coefficients = self.lifted(members, point)
            simplices = self.problem.simplices
            yield Cut(
                np.concatenate((members, lifted)),
                (len(members) - 1) // 2,
                [1] * len(members) + coefficients,
                proof={"cycle": simplices[members].tolist(), "lifted": simplices[lifted].tolist()},
            )

    def lifted(
        self, cycle: NDArray[np.integer], point: FractionalPoint
    ) -> tuple[NDArray[np.int64], list[int]]:
        """Return simplices to add to a chordless cycle, and their coefficients, all positive."""
        if not self.lift:
            return np.empty(0, dtype=np.int64), []
        gains = hole_gains(self.problem.crossing_rows(cycle))
        gains[cycle] = 0
        candidates = self.problem.nearest_first(np.flatnonzero(gains), cycle)
        candidates = _most_useful(candidates, gains, point.x)[: _POOL * self.lift]
        nodes = np.concatenate((cycle, candidates))
        coefficients = sequential_lifting(len(cycle), self.problem.crossings(nodes), self.lift)
        chosen = np.flatnonzero(coefficients)
        return candidates[chosen].astype(np.int64), coefficients[chosen].tolist()


def _most_useful(
    candidates: NDArray[np.integer], gains: NDArray[np.integer], values: NDArray[np.floating]
) -> NDArray[np.integer]:
    """Sort candidates by what they may add to the cut at the point, then by their possible coefficients."""
    gains, added = gains[candidates], gains[candidates] * values[candidates]
    return candidates[np.lexsort((np.arange(len(candidates)), -gains, -added))]


def _lifted_violation(cycle: list[int], crossings: NDArray[np.bool_], values: NDArray[np.floating]) -> float:
    """Return by how much the cycle's cut is violated when simplices of positive value are lifted into it."""
    gains = hole_gains(crossings[cycle])
    gains[cycle] = 0
    candidates = _most_useful(np.flatnonzero(gains), gains, values)
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
    yield from _BACKENDS[backend](len(values), rows, columns, lengths)


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


_BACKENDS: dict[str, Any] = {"scipy": _walks_by_scipy, "networkx": _walks_by_networkx}


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


def _turned(cycle: Sequence[int]) -> tuple[int, ...]:
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


def sequential_lifting(size: int, crossings: NDArray[np.bool_], most: int) -> NDArray[np.int64]:
    """Lift nodes, one after another, into the inequality of an odd cycle.

    Parameters
    ----------
    size : int
        Length k of the cycle, which the first k nodes of the graph are.
    crossings : ndarray of bool, shape (k + c, k + c)
        The graph, with c candidates in the order in which they are tried.
    most : int
        Stop when that many have a positive coefficient.

    Returns
    -------
    ndarray of int, shape (c,)
        Coefficients of the candidates, zero where one is left out.
    """
    packed = np.packbits(crossings, axis=1, bitorder="little")
    adjacent = [int.from_bytes(row.tobytes(), "little") for row in packed]
    weights = dict.fromkeys(range(size), 1)
    rhs = (size - 1) // 2
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

"""Odd-cycle cuts: of k simplices that cross in a cycle, k odd, at most (k - 1) / 2 are in a triangulation."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bcut.separation.graphs.odd_cycles import (
    BACKENDS,
    chordless_cycle,
    hole_gains,
    lifted_violation,
    most_useful_first,
    odd_closed_walks,
    sequential_lifting,
    turned_cycle,
)
from bcut.separation.seam import Cut, FractionalPoint, Separator

# Cuts count as violated from this much on.
_MARGIN = 1e-4

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
        if backend not in BACKENDS:
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
                violation = lifted_violation(cycle, crossings, values)
            if violation > _MARGIN:
                cycles.setdefault(turned_cycle(cycle), violation)
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
        candidates = most_useful_first(candidates, gains, point.x)[: _POOL * self.lift]
        nodes = np.concatenate((cycle, candidates))
        coefficients = sequential_lifting(len(cycle), self.problem.crossings(nodes), self.lift)
        chosen = np.flatnonzero(coefficients)
        return candidates[chosen].astype(np.int64), coefficients[chosen].tolist()

"""Heavy cliques of a graph with weights on its nodes."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

# Weights in the search are integers, so that its result does not depend on the order of summation.
_UNIT = 1 << 30
# A clique counts as violated from this much above 1 on.
_MARGIN = _UNIT // 10_000

# What is spent on making a violated clique heavier, in members of colour classes.
_POLISH = 2000


def heavy_cliques(crossings: NDArray[np.bool_], values: NDArray[np.floating], effort: int) -> list[list[int]]:
    """Find cliques of weight above 1 that cover as many nodes as possible.

    Parameters
    ----------
    crossings : ndarray of bool, shape (k, k)
        A graph: symmetric, without loops.
    values : ndarray of float, shape (k,)
        Weights of the nodes, at least 0.
    effort : int
        Members of all colour classes together, about; what one search leaves over, the next ones get.

    Returns
    -------
    list of list of int
        Each ascending, none twice.
    """
    order = np.lexsort((np.arange(len(values)), -values))
    crossings, values = crossings[np.ix_(order, order)], values[order]
    search = _Search(crossings, values)
    cliques: dict[tuple[int, ...], None] = {}
    covered = 0
    # Nodes with little around them first: those in no heavy clique are done with, and leave the graph.
    for done, node in enumerate(np.argsort(crossings @ values, kind="stable").tolist()):
        if not effort:
            break
        if covered >> node & 1:
            continue
        share = effort // (len(values) - done)
        clique = search.heaviest_through(node, share)
        effort -= min(effort, search.spent)
        if clique:
            covered |= clique
            cliques.setdefault(tuple(sorted(order[list(_bits(clique))].tolist())))
        elif search.spent <= share:
            search.remaining &= ~(1 << node)
    return [list(clique) for clique in cliques]


class _Search:
    """Branch and bound for heaviest cliques; sets of nodes are bit masks."""

    def __init__(self, crossings: NDArray[np.bool_], values: NDArray[np.floating]) -> None:
        packed = np.packbits(crossings, axis=1, bitorder="little")
        self.adjacent = [int.from_bytes(row.tobytes(), "little") for row in packed]
        self.weight = np.rint(values * _UNIT).astype(np.int64).tolist()
        self.remaining = everything = (1 << len(values)) - 1
        # Those that may stand in one stable set with a node.
        self.apart = [everything & ~(near | 1 << node) for node, near in enumerate(self.adjacent)]
        self.spent = self.share = 0
        self.dived = False
        self.best = self.best_weight = 0

    def heaviest_through(self, node: int, share: int) -> int:
        """Return the heaviest clique through a node as a mask, 0 if none is found that weighs more than 1.

        The search ends when it has used its share up, but not before it got to the bottom once.
        """
        self.spent, self.share, self.dived = 0, share, False
        self.best, self.best_weight = 0, _UNIT + _MARGIN
        self._grow(1 << node, self.weight[node], self.adjacent[node] & self.remaining)
        return self.best

    def _grow(self, clique: int, weight: int, candidates: int) -> None:
        if not candidates:
            self.dived = True
            if weight > self.best_weight:
                self.best, self.best_weight = clique, weight
                # What counts is that it is violated: little is spent on making it more so.
                self.share = min(self.share, self.spent + _POLISH)
            return
        listed = self._coloured(candidates, self.best_weight - weight)
        self.dived |= not listed
        for node, bound in listed:
            if weight + bound <= self.best_weight or (self.dived and self.spent > self.share):
                return
            self._grow(clique | 1 << node, weight + self.weight[node], candidates & self.adjacent[node])
            candidates &= ~(1 << node)

    def _coloured(self, candidates: int, slack: int) -> list[tuple[int, int]]:
        """List nodes with a bound on the weight of a clique in the nodes listed after them and themselves.

        Nodes are covered by stable sets with multiplicities; a clique has at most one node of each. Nodes
        within the first `slack` of the cover cannot lead to anything better and are left out.
        """
        weight, apart = self.weight, self.apart
        listed: list[tuple[int, int]] = []
        if sum([weight[node] for node in _bits(candidates)]) <= slack:
            return listed
        residual = weight.copy()
        total = 0
        while candidates:
            stable, open_nodes, share = [], candidates, _UNIT
            while open_nodes:
                node = (open_nodes & -open_nodes).bit_length() - 1
                stable.append(node)
                if residual[node] < share:
                    share = residual[node]
                open_nodes &= apart[node]
            total += share
            self.spent += len(stable)
            for node in stable:
                residual[node] -= share
                if not residual[node]:
                    candidates ^= 1 << node
                    if total > slack:
                        listed.append((node, total))
        listed.reverse()
        return listed


def _bits(mask: int) -> Iterable[int]:
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low

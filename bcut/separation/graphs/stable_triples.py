"""Heavy sets of nodes of a graph without three that are pairwise not adjacent: a stable set has two of them at most.

Two cliques together are such a set; of more interest are those that two cliques do not cover, such as odd antiholes (of
seven nodes of weight 1/3 each, for one) and the odd hole of five nodes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# A set counts as violated from this much above 2 on.
_MARGIN = 1e-4

# So many nodes, the heaviest ones, are tried as the next one of a set.
_TRIED = 60


def sets_without_stable_triples(
    adjacent: NDArray[np.bool_], values: NDArray[np.floating], starts: int
) -> list[list[int]]:
    """Find sets of weight above 2 of which no three nodes are pairwise not adjacent.

    Sets are grown greedily, each from another node: the next one is that which leaves the largest weight of nodes that
    can still be added.

    Parameters
    ----------
    adjacent : ndarray of bool, shape (k, k)
        A graph: symmetric, without loops.
    values : ndarray of float, shape (k,)
        Weights of the nodes, positive.
    starts : int
        So many nodes, the heaviest ones, are begun with.

    Returns
    -------
    list of list of int
        Each ascending, none twice.
    """
    weights = np.round(values, 6)  # so that noise in the last digits does not choose between equal ones
    order = np.argsort(-weights, kind="stable")
    apart = ~adjacent
    np.fill_diagonal(apart, False)
    found: dict[tuple[int, ...], None] = {}
    for start in order[:starts].tolist():
        members = _grown(start, apart, apart.astype(np.float32), weights, order)
        if values[members].sum() > 2 + _MARGIN:
            found.setdefault(tuple(sorted(members)))
    return [list(members) for members in found]


def _grown(
    start: int,
    apart: NDArray[np.bool_],
    counted: NDArray[np.float32],
    weights: NDArray[np.float64],
    order: NDArray[np.intp],
) -> list[int]:
    members = [start]
    allowed = np.ones(len(weights), dtype=bool)
    allowed[start] = False
    while allowed.any():
        tried = order[allowed[order]][:_TRIED]
        # With a tried node, another one is excluded if both are apart from each other and from some member.
        excluded = (counted[tried][:, members] @ counted[members] > 0) & apart[tried]
        left = allowed & ~excluded
        left[np.arange(len(tried)), tried] = False
        best = int(np.argmax(np.round(left @ weights + weights[tried], 6)))
        members.append(int(tried[best]))
        allowed = left[best]
    return members

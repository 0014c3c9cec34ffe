"""The symmetries that an objective leaves in force."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.permutations import PermutationGroup, Permutations
from bcut.geometry.subsets import ranks

# Images of simplices that are looked up at once.
_CHUNK = 4_000_000


def symmetries_of_table(
    group: PermutationGroup, default: Fraction, table: Mapping[tuple[int, ...], Fraction]
) -> PermutationGroup:
    """Return the subgroup that leaves a table of costs invariant.

    Parameters
    ----------
    group : PermutationGroup
    default : Fraction
        What simplices cost that are not in the table.
    table : mapping
        Costs of simplices, by their ascending vertices.
    """
    others = sorted(simplex for simplex, cost in table.items() if cost != default)
    if not others:
        return group
    costs = np.array([table[simplex] for simplex in others], dtype=object)
    return symmetries_of_costs(group, np.array(others, dtype=np.int64), costs)


def symmetries_of_costs(
    group: PermutationGroup, simplices: NDArray[np.integer], costs: NDArray[np.int64] | NDArray[np.object_]
) -> PermutationGroup:
    """Return the subgroup that maps every simplex to one of the same cost.

    Parameters
    ----------
    group : PermutationGroup
    simplices : ndarray of int, shape (m, k)
        Ascending vertices. All simplices, or those whose costs differ from what all others cost.
    costs : ndarray of int64 or of Python integers, shape (m,)
        Exact.
    """
    if not len(simplices) or group.is_trivial:
        return group
    classes = np.unique(np.array(costs), return_inverse=True)[1].reshape(-1)
    known = ranks(np.asarray(simplices), group.n)
    order = np.argsort(known)
    known, known_classes = known[order], classes[order]
    simplices = np.asarray(simplices)[order]

    def keeps(elements: Permutations) -> NDArray[np.bool_]:
        alive = np.arange(len(elements))
        start, step = 0, 1
        # A few simplices refute most elements; the others are asked about more and more of them.
        while start < len(simplices) and len(alive):
            part = simplices[start : start + step]
            images = np.sort(elements[alive][:, part], axis=2)
            found = ranks(images.astype(np.int64), group.n)
            place = np.minimum(np.searchsorted(known, found), len(known) - 1)
            same = (known[place] == found) & (known_classes[place] == known_classes[start : start + step])
            alive = alive[same.all(axis=1)]
            start += step
            step = max(1, min(4 * step, _CHUNK // max(1, len(alive))))
        result = np.zeros(len(elements), dtype=bool)
        result[alive] = True
        return result

    return group.subgroup(keeps)

"""Whether nodes of a graph, no two of them neighbours, can weigh more than a limit: an exact search.

Nodes are simplices or faces, and neighbours cross. A set without neighbours has at most one node of each clique, so a
cover by cliques bounds its weight by the largest weights in these. The search covers, greedily, as many nodes as the
limit has room for. A set that is too heavy has a node outside of that cover; for each of these, all sets are searched
that have it but none of those after it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import combinations
from math import floor, lcm

from bcut.verification.cut_data import UncheckedError

# For all nodes of a cut together. Measured: 20,000 for odd cycles over 60 points in the plane with 380 simplices lifted
# or not, 5,000 with the usual 160; none for faces that cross, whose covers are enough.
_MOST_STEPS = 500_000


class HeavySets:
    """A graph with weights; those that are not positive do not count.

    Parameters
    ----------
    weights : sequence of Fraction or int
    crossing : callable
        Tells of two nodes, the lower number first, whether they are neighbours.
    """

    def __init__(self, weights: Sequence[Fraction | int], crossing: Callable[[int, int], bool]) -> None:
        # By falling weight, so that the lowest bit of a set of nodes is the heaviest of them.
        self._order = sorted(
            (node for node, weight in enumerate(weights) if weight > 0), key=lambda node: -weights[node]
        )
        # Over one denominator.
        self._scale = lcm(*(weights[node].denominator for node in self._order))
        self._weights = [int(weights[node] * self._scale) for node in self._order]
        self._neighbours = [0] * len(self._order)
        for (first, a), (second, b) in combinations(enumerate(self._order), 2):
            if crossing(min(a, b), max(a, b)):
                self._neighbours[first] |= 1 << second
                self._neighbours[second] |= 1 << first
        self.steps = 0

    def first_excess(self, start: int, limit: Fraction | int) -> int | None:
        """Return the first node, from one on, that weighs more than a limit together with some nodes before it.

        Raises
        ------
        UncheckedError
            The search takes too long.
        """
        most = floor(limit * self._scale)
        before = 0
        for node, place in sorted((node, place) for place, node in enumerate(self._order)):
            if node >= start and self._exceed(before & ~self._neighbours[place], most - self._weights[place]):
                return node
            before |= 1 << place
        return None

    def _exceed(self, free: int, room: int) -> bool:
        """Tell whether some of the free nodes, no two of them neighbours, weigh more than there is room for."""
        if room < 0:
            return True
        # Nodes that the search may use, nodes of which it has to use one, and the room for both.
        open_sets = [(*self._covered(free, room), room)]
        while open_sets:
            covered, further, room = open_sets.pop()
            if not further:
                continue
            self.steps += 1
            if self.steps > _MOST_STEPS:
                raise UncheckedError(
                    f"it takes more than {_MOST_STEPS:,} steps to check a cut over {len(self._order)} "
                    "simplices or faces"
                )
            lowest = further & -further
            place = lowest.bit_length() - 1
            open_sets.append((covered | lowest, further ^ lowest, room))
            left = room - self._weights[place]
            if left < 0:
                return True
            open_sets.append((*self._covered(covered & ~self._neighbours[place], left), left))
        return False

    def _covered(self, free: int, room: int) -> tuple[int, int]:
        """Return nodes that cliques cover whose largest weights there is room for, and the others."""
        covered = others = 0
        while free:
            lowest = free & -free
            free ^= lowest
            place = lowest.bit_length() - 1
            if self._weights[place] > room:
                others |= lowest
                continue
            room -= self._weights[place]
            covered |= lowest
            fitting = free & self._neighbours[place]
            while fitting:
                lowest = fitting & -fitting
                free ^= lowest
                covered |= lowest
                fitting &= self._neighbours[lowest.bit_length() - 1]
        return covered, others

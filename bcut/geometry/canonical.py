"""Least images of point sets under a permutation group, for many sets at once.

The least image of a set S is the lexicographically first among the sets g(S), written in ascending order. It
is found element by element: its first element is the least point in the orbits of the points of S; of the
ways to get there, those survive that lead to the least second element under the stabiliser of the first; and
so on, as in S. Linton, "Finding the smallest image of a set" (ISSAC 2004), but breadth first, with arrays
over all sets and all ways.

The stabilisers are nodes of a tree: the children of the node of (s_0, ..., s_j) stabilise one point more.
Each node is a table of the least point in every point's orbit, and of an element that takes the point there.
Nodes are made when they are first needed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.permutations import PermutationGroup, index_type

# The node of the trivial stabiliser: every point is alone in its orbit.
_TRIVIAL = 0
_UNKNOWN = -1
# Sets that are worked on at once.
_CHUNK = 20_000


@dataclass(frozen=True, eq=False)
class LeastImages:
    """The least images of some sets, and all ways that lead to them.

    Attributes
    ----------
    images : ndarray of int, shape (m, k)
        Ascending.
    stabilisers : ndarray of int64, shape (m,)
        Number of group elements that map each set to itself.
    owners : ndarray of int, shape (w,)
        The set of each way, ascending. Ways that agree on the set and on the extra point are merged.
    extras : ndarray of int, shape (w,)
        Where the way takes the set's extra point; where the pointwise stabiliser of the image is not trivial,
        further elements may take it elsewhere.
    fixing : ndarray of int64, shape (m,)
        Order of the pointwise stabiliser of each image.
    """

    images: NDArray[np.int64]
    stabilisers: NDArray[np.int64]
    owners: NDArray[np.int64]
    extras: NDArray[np.int64]
    fixing: NDArray[np.int64]


class CanonicalForms:
    """Least images under one group.

    Parameters
    ----------
    group : PermutationGroup
        The stabilisers of the points are listed: a group of order 10**7 on 100 points is no trouble.

    Raises
    ------
    TooLargeError
        If the stabiliser of a point is too large to be listed.
    """

    def __init__(self, group: PermutationGroup) -> None:
        self.group = group
        self.n = n = group.n
        self.dtype = index_type(n)
        self._tables: list[NDArray[np.integer]] = [np.arange(n, dtype=self.dtype)[None, :]]
        self._table_size = 1
        self._elements = self._tables[0]
        # By node: least point of every point's orbit, element that leads there, members of the stabiliser,
        # children.
        self._least = np.empty((64, n), dtype=self.dtype)
        self._moves = np.empty((64, n), dtype=np.int64)
        self._members: list[NDArray[np.int64]] = []
        self._children = np.full((64, n), _UNKNOWN, dtype=np.int64)
        self._add_node(np.arange(n), np.zeros(n, dtype=np.int64), np.zeros(1, dtype=np.int64))
        self._children[_TRIVIAL] = _TRIVIAL
        moves = self._store(group.transporters())
        self._root = self._add_node(group.point_orbits(), moves, np.empty(0, dtype=np.int64))

    @property
    def roots(self) -> NDArray[np.int64]:
        """The least point of each orbit."""
        return np.unique(self._least[self._root]).astype(np.int64)

    def of(self, sets: NDArray[np.integer], extras: NDArray[np.integer] | None = None) -> LeastImages:
        """Return the least images of some sets.

        Parameters
        ----------
        sets : ndarray of int, shape (m, k)
            Different points in each row.
        extras : ndarray of int, shape (m,), optional
            One more point for each set, to be followed on all ways to the least image.
        """
        parts = []
        for start in range(0, max(1, len(sets)), _CHUNK):
            part = slice(start, start + _CHUNK)
            walk = _Walk(self, np.asarray(sets[part]), None if extras is None else np.asarray(extras[part]))
            for _ in range(sets.shape[1]):
                walk.step(None)
            parts.append(walk.finish())
        return _joined(parts)

    def are_least(self, sets: NDArray[np.integer]) -> tuple[NDArray[np.intp], LeastImages]:
        """Tell which of some sets, in ascending order, are their own least images.

        Returns
        -------
        least : ndarray of int
            The rows of these.
        ways : LeastImages
            Of these alone.
        """
        rows, parts = [], []
        for start in range(0, max(1, len(sets)), _CHUNK):
            walk = _Walk(self, np.asarray(sets[start : start + _CHUNK]), None)
            for position in range(sets.shape[1]):
                walk.step(position)
            rows.append(start + walk.kept)
            parts.append(walk.finish())
        return np.concatenate(rows), _joined(parts)

    def least_in_orbit(self, prefixes: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the least point in every point's orbit under the stabilisers of points, shape (m, k) to (m, n).

        Each row must be the beginning of a least image.
        """
        nodes = np.full(len(prefixes), self._root)
        for column in prefixes.T:
            nodes = self.children(nodes, column.astype(np.int64))
        return self._least[nodes].astype(np.int64)

    def tables(self) -> tuple[NDArray[np.integer], NDArray[np.int64]]:
        """Return the least points and the elements that lead to them, for all nodes, shape (nodes, n)."""
        return self._least, self._moves

    def elements(self) -> NDArray[np.integer]:
        """Return the permutations that `tables` refers to."""
        if len(self._tables) > 1:
            self._elements = np.concatenate(self._tables)
            self._tables = [self._elements]
        return self._elements

    def orders(self) -> NDArray[np.int64]:
        """Return the orders of the stabilisers of all nodes; 0 for the root."""
        return np.array([len(members) for members in self._members])

    def children(self, nodes: NDArray[np.int64], points: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the nodes that stabilise one point more; makes those that are not there yet."""
        found = self._children[nodes, points]
        missing = found == _UNKNOWN
        if missing.any():
            for node, point in np.unique(np.column_stack((nodes[missing], points[missing])), axis=0).tolist():
                self._children[node, point] = self._make_child(node, point)
            found = self._children[nodes, points]
        return found

    def _make_child(self, node: int, point: int) -> int:
        if node == self._root:
            members = self._store(self.group.stabiliser(point))
        else:
            members = self._members[node]
            members = members[self.elements()[members, point] == point]
        if len(members) == 1:
            return _TRIVIAL
        images = self.elements()[members]
        least = images.min(axis=0).astype(np.int64)
        return self._add_node(least, members[images.argmin(axis=0)], members)

    def _add_node(
        self, least: NDArray[np.int64], moves: NDArray[np.int64], members: NDArray[np.int64]
    ) -> int:
        number = len(self._members)
        if number == len(self._children):
            self._least = np.concatenate((self._least, np.empty_like(self._least)))
            self._moves = np.concatenate((self._moves, np.empty_like(self._moves)))
            self._children = np.concatenate((self._children, np.full_like(self._children, _UNKNOWN)))
        self._least[number], self._moves[number] = least, moves
        self._members.append(members)
        return number

    def _store(self, elements: NDArray[np.integer]) -> NDArray[np.int64]:
        numbers = np.arange(self._table_size, self._table_size + len(elements))
        self._tables.append(elements.astype(self.dtype))
        self._table_size += len(elements)
        return numbers


def _joined(parts: list[LeastImages]) -> LeastImages:
    """Put the least images of parts of a list together."""
    first = np.cumsum([0, *(len(part.images) for part in parts[:-1])])
    return LeastImages(
        np.concatenate([part.images for part in parts]),
        np.concatenate([part.stabilisers for part in parts]),
        np.concatenate([start + part.owners for start, part in zip(first, parts, strict=True)]),
        np.concatenate([part.extras for part in parts]),
        np.concatenate([part.fixing for part in parts]),
    )


class _Walk:
    """All ways from some sets towards their least images, one element further with every step.

    Attributes
    ----------
    kept : ndarray of int
        The sets that are still in the race, by number; all arrays below are about them.
    nodes : ndarray of int, shape (kept,)
        Stabiliser of the elements so far.
    rest : ndarray of int, shape (ways, k - steps)
        Images of the other elements.
    """

    def __init__(
        self, forms: CanonicalForms, sets: NDArray[np.integer], extras: NDArray[np.integer] | None
    ) -> None:
        self.forms = forms
        self.sets = sets.astype(np.int64)
        count = len(sets)
        self.kept = np.arange(count)
        self.nodes = np.full(count, forms._root)
        self.prefix = np.empty((count, 0), dtype=np.int64)
        self.owners = np.arange(count)
        self.rest = sets.astype(forms.dtype)
        self.extras = np.zeros(count, dtype=forms.dtype) if extras is None else extras.astype(forms.dtype)
        self.weights = np.ones(count, dtype=np.int64)

    def step(self, position: int | None) -> None:
        """Find the next element of every least image; with a position, give up sets that do not have it there."""
        least, moves = self.forms.tables()
        reps = least[self.nodes[self.owners][:, None], self.rest]
        starts = np.searchsorted(self.owners, np.arange(len(self.kept)))
        best = np.minimum.reduceat(reps.min(axis=1), starts) if len(starts) else reps[:, 0]
        best = best.astype(np.int64)
        if position is not None:
            # The identity is one of the ways, so nothing greater than the set's own element can be the least.
            stay = best == self.sets[self.kept, position]
            best, reps = best[stay], reps[stay[self.owners]]
            self._keep(stay)
        ways, places = np.nonzero(reps == best[self.owners][:, None])
        chosen = self.rest[ways, places]
        moves_of = moves[self.nodes[self.owners[ways]], chosen]
        others = np.ones((len(ways), self.rest.shape[1]), dtype=bool)
        others[np.arange(len(ways)), places] = False
        rest = self.rest[ways][others].reshape(len(ways), self.rest.shape[1] - 1)
        elements = self.forms.elements()
        self.rest = elements[moves_of[:, None], rest]
        self.extras = elements[moves_of, self.extras[ways]]
        self.owners, self.weights = self.owners[ways], self.weights[ways]
        self.nodes = self.forms.children(self.nodes, best)
        self.prefix = np.column_stack((self.prefix, best))
        if len(self.owners) > 4 * len(self.kept):
            self._merge()

    def _keep(self, stay: NDArray[np.bool_]) -> None:
        """Go on with some of the sets only."""
        ways = stay[self.owners]
        self.owners = (np.cumsum(stay) - 1)[self.owners[ways]]
        self.rest, self.extras, self.weights = self.rest[ways], self.extras[ways], self.weights[ways]
        self.kept, self.nodes, self.prefix = self.kept[stay], self.nodes[stay], self.prefix[stay]

    def _merge(self) -> None:
        """Merge ways that agree from here on: a set with many symmetries of its own has many of these."""
        rest = np.sort(self.rest, axis=1)
        keys = np.ascontiguousarray(np.column_stack((rest, self.extras)))
        width = keys.shape[1] * keys.itemsize
        words = -(-width // 8)
        padded = np.zeros((len(keys), words * 8), dtype=np.uint8)
        padded[:, :width] = keys.view(np.uint8).reshape(len(keys), width)
        columns = padded.view(np.uint64).reshape(len(keys), words)
        order = np.lexsort((*columns.T, self.owners))
        changed = (np.diff(columns[order], axis=0) != 0).any(axis=1) | (np.diff(self.owners[order]) != 0)
        first = np.concatenate(([0], np.flatnonzero(changed) + 1))
        if len(first) == len(order):
            return
        self.weights = np.add.reduceat(self.weights[order], first)
        chosen = order[first]
        self.owners, self.rest, self.extras = self.owners[chosen], rest[chosen], self.extras[chosen]

    def finish(self) -> LeastImages:
        fixing = self.forms.orders()[self.nodes]
        ways = np.bincount(self.owners, weights=self.weights, minlength=len(self.kept)).astype(np.int64)
        return LeastImages(self.prefix, ways * fixing, self.owners, self.extras.astype(np.int64), fixing)

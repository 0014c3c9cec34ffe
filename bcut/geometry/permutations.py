"""Permutation groups on the points of a configuration, as stabiliser chains of arrays.

A permutation is an array g of images: point i goes to ``g[i]``, and ``g[h]`` is "first h, then g". Elements
are listed only where their number allows it; everything else works with the chain.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.errors import TooLargeError

Permutations = NDArray[np.integer]

# Elements that are listed at once, at most: images of all points, one or two bytes each.
MAX_ELEMENTS = 4_000_000


@dataclass(frozen=True, eq=False)
class Level:
    """One step of a stabiliser chain.

    Attributes
    ----------
    point : int
        The base point b; the group of this level fixes the base points before it.
    orbit : ndarray of int, shape (k,)
        Images of b under the group of this level, b first.
    transversal : ndarray of int, shape (k, n)
        Elements of the group of this level; row j takes b to ``orbit[j]``, row 0 is the identity.
    """

    point: int
    orbit: NDArray[np.int64]
    transversal: Permutations


class PermutationGroup:
    """A group of permutations of n points.

    Made by `bcut.geometry.symmetry.symmetry_group`, or by one of the class methods.

    Parameters
    ----------
    n : int
    generators : ndarray of int, shape (g, n)
        Generate the group; strong generators relative to the base of the chain, where they come from a
        search.
    levels : sequence of Level
        The chain; the group after the last level is trivial.

    Attributes
    ----------
    order : int
    """

    def __init__(self, n: int, generators: Permutations, levels: Sequence[Level]) -> None:
        self.n = n
        self.generators = np.asarray(generators, dtype=index_type(n)).reshape(-1, n)
        self.levels = tuple(level for level in levels if len(level.orbit) > 1)
        self.order = prod(len(level.orbit) for level in self.levels)

    @classmethod
    def trivial(cls, n: int) -> PermutationGroup:
        """Return the group of the identity alone."""
        return cls(n, np.empty((0, n), dtype=np.int64), ())

    @classmethod
    def from_elements(cls, elements: Permutations) -> PermutationGroup:
        """Make a group from all its elements, shape (order, n); they must be closed under products."""
        n = elements.shape[1]
        levels = []
        rest = elements
        for point in range(n):
            if len(rest) == 1:
                break
            images, first = np.unique(rest[:, point], return_index=True)
            # The point itself first.
            order = np.argsort(images != point, kind="stable")
            transversal = rest[first[order]].copy()
            transversal[0] = np.arange(n)
            levels.append(Level(point, images[order].astype(np.int64), transversal))
            rest = rest[rest[:, point] == point]
        group = cls(n, np.empty((0, n), dtype=np.int64), levels)
        group.generators = _generators_of(group)
        return group

    @classmethod
    def generated_by(cls, generators: Permutations, n: int, *, limit: int = MAX_ELEMENTS) -> PermutationGroup:
        """Make the group that some permutations generate, by listing its elements.

        Raises
        ------
        TooLargeError
            If there are more than `limit` elements.
        """
        steps = np.asarray(generators, dtype=index_type(n)).reshape(-1, n)
        frontier = np.arange(n, dtype=index_type(n))[None, :]
        levels, known = [frontier], {frontier.tobytes()}
        row = np.dtype((np.void, frontier.nbytes))
        while len(steps):
            products = np.concatenate([step[frontier] for step in steps])
            # Sets of rows as bytes are much faster than `np.unique` with an axis where groups are small.
            listed: list[Any] = products.view(row).ravel().tolist()
            new = set(listed) - known
            if not new:
                break
            known |= new
            if len(known) > limit:
                raise TooLargeError(f"the permutations generate a group of more than {limit:,} elements")
            frontier = np.frombuffer(b"".join(new), dtype=frontier.dtype).reshape(-1, n)
            frontier = frontier[np.lexsort(frontier.T[::-1])]
            levels.append(frontier)
        return cls.from_elements(np.concatenate(levels))

    def reduced(self, limit: int) -> PermutationGroup:
        """Return the largest group of the chain with at most `limit` elements: it fixes the first base points.

        Of a group from `symmetry_group` or `from_elements`, whose generators are strong ones.
        """
        levels = list(self.levels)
        generators = self.generators
        while prod(len(level.orbit) for level in levels) > limit:
            gone = levels.pop(0)
            generators = generators[generators[:, gone.point] == gone.point]
        return self if len(levels) == len(self.levels) else PermutationGroup(self.n, generators, levels)

    @property
    def base(self) -> tuple[int, ...]:
        """Base points: only the identity fixes them all."""
        return tuple(level.point for level in self.levels)

    @property
    def is_trivial(self) -> bool:
        """Whether the identity is the only element."""
        return self.order == 1

    def blocks(self) -> Iterator[Permutations]:
        """Yield all elements, each once, in arrays of shape (some, n) that are not too large."""
        dtype = index_type(self.n)
        inner = np.arange(self.n, dtype=dtype)[None, :]
        outer = list(self.levels)
        # Products of the deepest levels make a block; the levels above run through it.
        while outer and len(inner) * len(outer[-1].orbit) <= max(1, 8_000_000 // self.n):
            level = outer.pop()
            inner = level.transversal.astype(dtype)[:, inner].reshape(-1, self.n)
        yield from _products(outer, inner, dtype)

    def elements(self, *, limit: int = MAX_ELEMENTS) -> Permutations:
        """Return all elements, shape (order, n), in the smallest unsigned type.

        Raises
        ------
        TooLargeError
            If the order exceeds `limit`.
        """
        if self.order > limit:
            raise TooLargeError(
                f"a group of order {self.order:,} is not listed; at most {limit:,} elements are"
            )
        return np.concatenate(list(self.blocks()))

    def point_orbits(self) -> NDArray[np.int64]:
        """Return the least point of each point's orbit, shape (n,)."""
        least = np.arange(self.n)
        while True:
            previous = least
            for generator in self.generators:
                least = np.minimum(least, least[generator])
                reached = np.empty_like(least)
                reached[generator] = least
                least = np.minimum(least, reached)
            if np.array_equal(previous, least):
                return least

    def transporters(self) -> Permutations:
        """Return for each point an element that takes it to the least point of its orbit, shape (n, n)."""
        least = self.point_orbits()
        found = np.tile(np.arange(self.n, dtype=index_type(self.n)), (self.n, 1))
        known = least == np.arange(self.n)
        steps = [*self.generators, *(inverse(generator) for generator in self.generators)]
        while not known.all():
            for step in steps:
                # A new point p whose image under the step is known already: step first, then the known
                # element.
                new = np.flatnonzero(~known & known[step])
                found[new] = np.take_along_axis(
                    found[step[new]], np.tile(step, (len(new), 1)).astype(np.int64), axis=1
                )
                known[new] = True
        return found

    def stabiliser(self, point: int, *, limit: int = MAX_ELEMENTS) -> Permutations:
        """List the elements that fix a point, shape (order / orbit length, n).

        Raises
        ------
        TooLargeError
            If there are more than `limit` of them, or so many elements altogether that they cannot be looked
            through.
        """
        least = self.point_orbits()
        size = self.order // int((least == least[point]).sum())
        if size > limit or (self.order > 50 * limit and self.base[:1] != (point,)):
            raise TooLargeError(
                f"the stabiliser of point {point} has {size:,} elements; at most {limit:,} are listed"
            )
        if self.base[:1] == (point,):
            return PermutationGroup(self.n, self.generators[:0], self.levels[1:]).elements(limit=limit)
        return np.concatenate([block[block[:, point] == point] for block in self.blocks()])

    def subgroup(self, keeps: Any) -> PermutationGroup:
        """Return the subgroup of the elements for which a predicate holds.

        Parameters
        ----------
        keeps : callable
            Takes an array of elements, shape (k, n), and returns k truth values. The elements for which it
            holds must be closed under products, as those that fix something are.
        """
        if not len(self.generators) or np.all(keeps(self.generators)):
            return self
        return PermutationGroup.from_elements(
            np.concatenate([block[keeps(block)] for block in self.blocks()])
        )

    def orbit(self, subset: Sequence[int]) -> NDArray[np.int64]:
        """Return all images of a set of points, shape (length, k), ascending rows in lexicographic order."""
        points = np.asarray(subset, dtype=np.int64)
        images = np.empty((0, len(points)), dtype=index_type(self.n))
        for block in self.blocks():
            images = np.unique(np.concatenate((images, np.sort(block[:, points], axis=1))), axis=0)
        return images.astype(np.int64)

    def __contains__(self, permutation: object) -> bool:
        rest = np.asarray(permutation)
        if rest.shape != (self.n,) or not np.array_equal(np.sort(rest), np.arange(self.n)):
            return False
        for level in self.levels:
            place = np.flatnonzero(level.orbit == rest[level.point])
            if not len(place):
                return False
            rest = inverse(level.transversal[place[0]])[rest]
        return bool(np.array_equal(rest, np.arange(self.n)))

    def __repr__(self) -> str:
        return f"<PermutationGroup of order {self.order} on {self.n} points>"


def index_type(n: int) -> type[np.unsignedinteger[Any]]:
    """Return the smallest unsigned type that holds the numbers below n."""
    return np.uint8 if n <= 1 << 8 else np.uint16 if n <= 1 << 16 else np.uint32


def inverse(permutation: NDArray[np.integer]) -> NDArray[np.integer]:
    """Return the inverse permutation."""
    result = np.empty_like(permutation)
    result[permutation] = np.arange(len(permutation), dtype=permutation.dtype)
    return result


def _products(outer: list[Level], inner: Permutations, dtype: Any) -> Iterator[Permutations]:
    if not outer:
        yield inner
        return
    for element in outer[0].transversal.astype(dtype):
        for block in _products(outer[1:], inner, dtype):
            yield element[block]


def _generators_of(group: PermutationGroup) -> Permutations:
    """Return few elements that generate a group given by its chain, deepest level first."""
    n = group.n
    chosen: list[Permutations] = []
    for depth in reversed(range(len(group.levels))):
        level = group.levels[depth]
        reached = {level.point}
        for image, element in zip(level.orbit.tolist(), level.transversal, strict=True):
            if image not in reached:
                chosen.append(element)
                reached = _orbit_of(level.point, chosen)
    return np.array(chosen, dtype=index_type(n)).reshape(-1, n)


def _orbit_of(point: int, generators: Sequence[Permutations]) -> set[int]:
    reached, frontier = {point}, [point]
    while frontier:
        frontier = [int(g[p]) for p in frontier for g in generators]
        frontier = [p for p in dict.fromkeys(frontier) if p not in reached]
        reached.update(frontier)
    return reached


def level_of(point: int, generators: Sequence[Permutations], n: int) -> Level:
    """Return the orbit of a point under some permutations, with products of them as its transversal."""
    orbit = [point]
    rows: dict[int, Permutations] = {point: np.arange(n, dtype=index_type(n))}
    for current in orbit:
        for generator in generators:
            image = int(generator[current])
            if image not in rows:
                rows[image] = np.asarray(generator, dtype=index_type(n))[rows[current]]
                orbit.append(image)
    return Level(point, np.array(orbit, dtype=np.int64), np.array([rows[p] for p in orbit]))

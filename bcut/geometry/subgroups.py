"""Small subgroups of a permutation group, one of each kind, to look for symmetric triangulations with.

Conjugate subgroups leave triangulations invariant that are images of each other, so one of them is enough.
Subgroups are drawn at random, and told apart by what conjugation does not change: how many elements of each
cycle type they have.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from bcut.errors import TooLargeError
from bcut.geometry.permutations import PermutationGroup, index_type

Kind = tuple[tuple[tuple[tuple[int, int], ...], int], ...]


def some_subgroups(
    group: PermutationGroup, *, largest: int = 256, draws: int = 400, seed: int = 0
) -> list[PermutationGroup]:
    """Return small nontrivial subgroups, largest first, no two of the same kind.

    Parameters
    ----------
    group : PermutationGroup
    largest : int
        Orders up to this.
    draws : int
        Pairs of elements that are drawn.
    seed : int
    """
    rng = np.random.default_rng(seed)
    found: dict[Kind, PermutationGroup] = {}
    draws = 0 if group.is_trivial else draws
    for _ in range(draws):
        pair = [random_element(group, rng) for _ in range(2)]
        # Powers have small orders, and so generate small groups with a better chance.
        pair = [_power(element, int(rng.integers(1, 5))) for element in pair]
        for generators in (pair[:1], pair):
            try:
                subgroup = PermutationGroup.generated_by(np.array(generators), group.n, limit=largest)
            except TooLargeError:
                continue
            if subgroup.order > 1:
                found.setdefault(_kind(subgroup), subgroup)
    return sorted(found.values(), key=lambda subgroup: subgroup.order, reverse=True)


def random_element(group: PermutationGroup, rng: np.random.Generator) -> NDArray[np.integer]:
    """Draw an element, each with the same probability."""
    element = np.arange(group.n, dtype=index_type(group.n))
    for level in reversed(group.levels):
        chosen = level.transversal[rng.integers(len(level.orbit))]
        element = chosen[element].astype(element.dtype)
    return element


def cycle_type(permutation: NDArray[np.integer]) -> tuple[tuple[int, int], ...]:
    """Return the lengths of the cycles with their numbers, ascending."""
    rest = set(range(len(permutation)))
    lengths: Counter[int] = Counter()
    images = permutation.tolist()
    while rest:
        point = rest.pop()
        length, image = 1, images[point]
        while image != point:
            rest.discard(image)
            length, image = length + 1, images[image]
        lengths[length] += 1
    return tuple(sorted(lengths.items()))


def _kind(group: PermutationGroup) -> Kind:
    return tuple(sorted(Counter(cycle_type(element) for element in group.elements()).items()))


def _power(permutation: NDArray[np.integer], exponent: int) -> NDArray[np.integer]:
    result = permutation
    for _ in range(exponent - 1):
        result = permutation[result]
    return result

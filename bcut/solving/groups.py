"""The groups that a user asks for: symmetries to work with, and those that triangulations are to be invariant under.

Nothing that a user or a file says is a symmetry is used before it has been proven to be one.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bcut.errors import InputError
from bcut.files.permutations import read_permutations
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.permutations import PermutationGroup
from bcut.geometry.subgroups import some_subgroups
from bcut.geometry.symmetry import is_symmetry, symmetry_group

# A file of generators, or the generators themselves.
GroupLike = str | os.PathLike[str] | Sequence[Sequence[int]] | NDArray[np.integer]


def group_of(configuration: PointConfiguration, source: GroupLike) -> PermutationGroup:
    """Return the group that given permutations generate.

    Parameters
    ----------
    configuration : PointConfiguration
    source : path, or sequence of permutations
        A path names a file as `bcut.files.permutations.read_permutations` reads it.

    Raises
    ------
    InputError
        There is a permutation that is no affine symmetry of the configuration.
    """
    n = configuration.n
    if isinstance(source, str | os.PathLike):
        label = str(source)
        permutations = read_permutations(Path(source), n)
    else:
        label, permutations = "symmetries", [list(map(int, images)) for images in source]
    for number, images in enumerate(permutations):
        if not is_symmetry(configuration, np.array(images, dtype=np.int64)):
            raise InputError(
                f"{label}: permutation {number} (counted from 0) is no affine symmetry of {configuration.name}: "
                "no affine map takes each point to its image"
            )
    return PermutationGroup.generated_by(np.array(permutations, dtype=np.int64).reshape(-1, n), n)


def subgroups_to_try(
    configuration: PointConfiguration, group: PermutationGroup, source: int | GroupLike, *, seed: int
) -> list[PermutationGroup]:
    """Return the subgroups that `source` means.

    Parameters
    ----------
    configuration : PointConfiguration
    group : PermutationGroup
        The symmetries that the objective has, too.
    source : int, path, or sequence of permutations
        An order: subgroups of that order, one of each kind that a random search finds. Or generators.
    seed : int
        Of the random search.

    Raises
    ------
    InputError
        There are none.
    """
    if not isinstance(source, int) and not (isinstance(source, str) and source.isdecimal()):
        subgroup = group_of(configuration, source)
        if not all(generator in group for generator in subgroup.generators):
            raise InputError(
                f"{configuration.name}: the objective is not invariant under the permutations given"
            )
        return [subgroup]
    order = int(source)
    if order < 2:
        raise InputError(
            f"invariant under order {order}: give an order of at least 2, or a file of generators"
        )
    found = some_subgroups(group, largest=order, seed=seed)
    chosen = [subgroup for subgroup in found if subgroup.order == order]
    if not chosen:
        orders = ", ".join(map(str, sorted({subgroup.order for subgroup in found}))) or "none"
        raise InputError(
            f"{configuration.name}: no subgroup of order {order} was found; orders up to that: {orders}"
        )
    return chosen


def symmetries_of(configuration: PointConfiguration, source: GroupLike | None) -> PermutationGroup:
    """Return the given symmetries, or all that there are."""
    return symmetry_group(configuration) if source is None else group_of(configuration, source)

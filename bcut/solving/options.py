"""What `bcut.solve` and `bcut.bound` can be asked."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from bcut.errors import InputError
from bcut.geometry.configuration import PointConfiguration
from bcut.separation.seam import Separator
from bcut.solving.groups import GroupLike

DEFAULT_SEPARATORS = ("link",)
# Relaxations of stable sets are so weak that cliques close most of their gaps; link cuts are not valid for dissections.
SEPARATORS_FOR_STABLE_SETS = ("clique", "link")
SEPARATORS_FOR_DISSECTIONS = ("clique", "odd-cycle")

InstanceLike = str | os.PathLike[str] | PointConfiguration
SeparatorLike = str | Separator | type[Separator]


@dataclass(frozen=True)
class Options:
    """What a run is asked about an instance.

    Attributes
    ----------
    only_bound : bool
        Whether the bound at the root is all that is wanted.

    Notes
    -----
    The others are the parameters of `bcut.solve`, and are explained there.
    """

    objective: str = "cardinality"
    sense: str | None = None
    then: Sequence[str] = ()
    formulation: str | None = None
    spanning: bool = False
    dissection: bool = False
    require: Sequence[Sequence[int]] = ()
    forbid: Sequence[Sequence[int]] = ()
    star: int | None = None
    separators: Sequence[SeparatorLike] | None = None
    time_limit: float | None = None
    memory_limit: float | None = None
    seed: int = 0
    method: str = "auto"
    symmetries: GroupLike | None = None
    invariant_under: int | GroupLike | None = None
    only_bound: bool = False

    def check(self) -> None:
        """Refuse limits and seeds that make no sense.

        Raises
        ------
        InputError
        """
        seconds, memory = self.time_limit, self.memory_limit
        if seconds is not None and not 0 <= seconds < inf:
            raise InputError(f"time limit {seconds}: give a finite number of seconds that is not negative")
        if memory is not None and not 0 < memory < inf:
            raise InputError(f"memory limit {memory}: give a finite positive number of GiB")
        if self.seed < 0:
            raise InputError(f"seed {self.seed}: give an integer that is not negative")

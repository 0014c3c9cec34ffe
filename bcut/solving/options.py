"""What `bcut.solve` and `bcut.bound` can be asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

from bcut.errors import InputError
from bcut.instance import InstanceLike as InstanceLike
from bcut.separation.seam import Separator
from bcut.solving.arguments import read_argument
from bcut.solving.groups import GroupLike

DEFAULT_SEPARATORS = ("link",)
# Relaxations of stable sets are so weak that cliques close most of their gaps; link cuts are not valid for dissections.
SEPARATORS_FOR_STABLE_SETS = ("clique", "link")
SEPARATORS_FOR_DISSECTIONS = ("clique", "odd-cycle")

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
    The others are the parameters of `bcut.solve`, and are explained there. Whatever form they were given in, here they
    are plain: an objective is a text, which may carry a function, and separators are a tuple.
    """

    objective: str = "cardinality"
    sense: str | None = None
    then: tuple[str, ...] = ()
    formulation: str | None = None
    spanning: bool = False
    dissection: bool = False
    require: Sequence[Sequence[int]] = ()
    forbid: Sequence[Sequence[int]] = ()
    star: int | None = None
    separators: tuple[SeparatorLike, ...] | None = None
    time_limit: float | None = None
    memory_limit: float | None = None
    seed: int = 0
    method: str = "auto"
    symmetries: GroupLike | None = None
    invariant_under: int | GroupLike | None = None
    only_bound: bool = False

    @classmethod
    def of(cls, **given: Any) -> Options:
        """Take the parameters as a user gave them.

        Raises
        ------
        InputError
            If one of them is of another type than `bcut.solve` says.
        """
        return cls(**{name: read_argument(name, value) for name, value in given.items()})

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

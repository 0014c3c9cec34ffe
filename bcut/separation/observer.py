"""Watching separators at work: what a cut ledger is written from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from bcut.separation.driver import IntegerCut
    from bcut.separation.seam import Problem


class CutObserver(Protocol):
    """Is told of relaxations, of the cuts found for them, and of those that a solver took.

    Nodes are numbered as SCIP does, from 1 for the root; 0 is the cutting-plane loop before the tree.
    """

    def relaxed(self, value: float, node: int) -> None:
        """Note the unrounded value of a relaxation that was solved, before separators look at its point."""
        ...

    def separated(
        self,
        problem: Problem,
        x: NDArray[np.floating],
        found: Sequence[IntegerCut],
        chosen: Sequence[IntegerCut],
    ) -> None:
        """Note what a round of separation found for a point, and which of the cuts the host chose to offer."""
        ...

    def took(self, cut: IntegerCut) -> None:
        """Note that the solver took a cut of the last round."""
        ...

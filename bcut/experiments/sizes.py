"""How large a program is with all its rows: columns, rows by kind, nonzeros; rows that are many are counted only."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from bcut.formulations.formulation import Formulation
from bcut.formulations.lazy_rows import ListedPairs, PairRows
from bcut.geometry.configuration import PointConfiguration
from bcut.solving.programs import make_formulation

# These need not write their pairs to have them counted.
_WITH_PAIRS = ("0", "1")
# Pairs of simplices that are compared at once.
_AT_ONCE = 1 << 24


@dataclass(frozen=True)
class FullSize:
    """Size of an integer program with all its rows.

    Attributes
    ----------
    columns : int
        The d-simplices, and in Formulation 1 their faces.
    kinds : dict of str to int
        How many rows of each kind there are, by the words that row names in a model file begin with: "volume"
        (two rows where one row would need rounding), "face", "pair", "coverage", "cocircuit" or "chamber".
    nonzeros : int
    """

    columns: int
    kinds: dict[str, int]
    nonzeros: int

    @property
    def rows(self) -> int:
        """Number of rows of all kinds."""
        return sum(self.kinds.values())


def full_size(
    name: str, configuration: PointConfiguration, *, spanning: bool, deadline: float | None = None
) -> FullSize | None:
    """Count what a formulation consists of when all its rows are written.

    The rows ``x_s + x_t <= 1`` are counted from the crossings, a block of them at a time. The coverage rows that
    formulations with an inexact volume row are checked against at 0/1 points are no part of the program.

    Parameters
    ----------
    name : str
        Of the formulation.
    configuration : PointConfiguration
    spanning : bool
    deadline : float, optional
        Value of `time.monotonic`.

    Returns
    -------
    FullSize or None
        None if the deadline came first.
    """
    options: dict[str, Any] = {"lazy": True} if name in _WITH_PAIRS else {}
    formulation = make_formulation(name, configuration, spanning=spanning, **options)
    kinds = Counter(formulation.row_name(row).partition("_")[0] for row in range(formulation.matrix.shape[0]))
    pairs = _pairs(formulation, deadline)
    if pairs is None:
        return None
    if pairs:
        kinds["pair"] += pairs
    return FullSize(
        columns=formulation.width,
        kinds=dict(sorted(kinds.items())),
        nonzeros=int(formulation.matrix.nnz) + 2 * pairs,
    )


def _pairs(formulation: Formulation, deadline: float | None) -> int | None:
    """Count the pairs of columns that exclude each other and have no row in the matrix; None at the deadline."""
    total = 0
    for rows in formulation.lazy:
        if isinstance(rows, ListedPairs):
            total += len(rows.pairs)
        elif isinstance(rows, PairRows):
            twice, step = 0, max(1, _AT_ONCE // max(1, len(rows.simplices)))
            for start in range(0, len(rows.simplices), step):
                if deadline is not None and time.monotonic() > deadline:
                    return None
                part = rows.simplices[start : start + step]
                twice += int(np.count_nonzero(rows.relation(rows.chirotope, part, rows.simplices)))
            total += twice // 2
    return total

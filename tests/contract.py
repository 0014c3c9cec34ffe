"""What the tests of the contract suite share: a few cases, a separator that is right, readers of reports."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bcut.separation.cases import CaseName
from bcut.separation.check import RULES, CheckReport
from bcut.separation.seam import Cut, FractionalPoint, Separator

FEW = (
    CaseName("hypersimplex:3,1"),
    CaseName("polygon:5,center"),
    CaseName("grid:3,3", spanning=True),
    CaseName("cube:3"),
    CaseName("random:8,3,seed=1"),
    CaseName("cyclic:9,4"),
)


class Pairs(Separator):
    """Right: of two simplices that cross, at most one."""

    name = "pairs"

    def separate(self, point: FractionalPoint) -> Iterator[Cut]:
        rows, others = np.nonzero(np.triu(point.crossings))
        for i, j in zip(point.fractional[rows].tolist(), point.fractional[others].tolist(), strict=True):
            if point.x[i] + point.x[j] > 1.001:
                yield Cut([i, j], 1)


def rules(report: CheckReport, found: str) -> set[str]:
    """The rules of which the summary says so."""
    return {rule for rule, text in RULES.items() if f"\n  {found:11}  {text}\n" in report.summary}


def broken(report: CheckReport) -> set[str]:
    assert not report.ok
    assert "FAILED" in report.summary
    return {failure.rule for failure in report.failures}

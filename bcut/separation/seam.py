"""The separator seam: `Separator`, `Cut`, and the read-only view of a problem that a separator is shown.

A separator knows no solver. It is told about the problem once (`Separator.setup`), and is then shown
fractional points (`Separator.separate`) and yields inequalities over d-simplices. The host does everything
else: it checks violations, scales, filters duplicates, limits, times and counts, and names the separator when
it raises. The same class runs inside SCIP, in the plain cutting-plane loop of ``bcut bound``, and in a test
on a hand-made point.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from math import factorial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from bcut.formulations.formulation import Formulation
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.crossings import CrossingTable, crossing_matrix
from bcut.geometry.overlaps import overlap_matrix

# Values closer than this to 0 or 1 count as integral: SCIP's feasibility tolerance.
TOLERANCE = 1e-6

# Up to this many columns the whole crossing graph is computed once, and kept.
_SMALL = 4096

# Rows of the crossing graph that a problem remembers, in bytes: a row is one bit per column.
_ROW_CACHE = 1 << 27


@dataclass(frozen=True)
class Cut:
    """The inequality ``sum of coefficients[i] * x[simplices[i]] <= rhs``.

    Attributes
    ----------
    simplices : sequence of int
        Columns, that is, rows of `Problem.simplices`; none twice.
    rhs : int or Fraction
        Exact right-hand side.
    coefficients : sequence of int or Fraction, optional
        Exact, one for each simplex; all 1 when omitted.
    proof : mapping
        What makes the inequality valid, as JSON-ready data (the clique, the cycle, the face and its weights,
        ...). Numbers and arrays of numpy, tuples and Fractions may be among it.
    """

    simplices: Sequence[int] | NDArray[np.integer]
    rhs: int | Fraction
    coefficients: Sequence[int | Fraction] | NDArray[np.integer] | None = None
    proof: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Problem:
    """What a separator may know: the geometry and the program, no solver.

    Attributes
    ----------
    formulation : Formulation
        The program whose relaxation is cut.
    """

    formulation: Formulation

    def __repr__(self) -> str:
        return f"<Problem of {self.configuration.name}: {len(self.simplices)} simplices>"

    @property
    def configuration(self) -> PointConfiguration:
        """The point configuration."""
        return self.formulation.configuration

    @property
    def chirotope(self) -> Chirotope:
        """Orientations of all (d+1)-subsets, sides of all (d-1)-simplices."""
        return self.formulation.chirotope

    @property
    def simplices(self) -> NDArray[np.int64]:
        """The d-simplices, one row per variable, shape (m, d + 1), each ascending."""
        return self.formulation.simplices

    @property
    def dissection(self) -> bool:
        """Whether dissections are wanted, so that simplices which merely touch do not cross."""
        return self.formulation.dissection and not self.chirotope.is_general

    @property
    def dimension(self) -> int:
        """The dimension d of the configuration."""
        return self.chirotope.dimension

    def crossings(
        self, columns: NDArray[np.integer], others: NDArray[np.integer] | None = None
    ) -> NDArray[np.bool_]:
        """Tell which simplices cross, shape (len(columns), len(others)); `others` defaults to `columns`.

        Of two that do, a solution has one at most. Where dissections are wanted, they are those that overlap.
        """
        if len(self.simplices) <= _SMALL:
            return self._all_crossings[np.ix_(columns, columns if others is None else others)]
        rest = None if others is None else self.simplices[others]
        if self.dissection:
            return overlap_matrix(
                self.chirotope, self.simplices[columns], self.simplices[columns] if rest is None else rest
            )
        return crossing_matrix(self.chirotope, self.simplices[columns], rest)

    def crossing_rows(self, columns: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Tell which of all simplices cross each of some, shape (len(columns), m).

        Rows are remembered, because separators come back to the same simplices from round to round.
        """
        if len(self.simplices) <= _SMALL:
            return self._all_crossings[columns]
        asked = np.asarray(columns).tolist()
        missing = [column for column in dict.fromkeys(asked) if column not in self._rows]
        if missing:
            fresh = self.simplices[missing]
            if self.dissection:
                table = overlap_matrix(self.chirotope, fresh, self.simplices)
            else:
                table = self._crossing_table.rows(fresh)
            computed = np.packbits(table, axis=1)
            self._rows.update(zip(missing, computed, strict=True))
        for column in asked:
            self._rows.move_to_end(column)
        width = (len(self.simplices) + 7) // 8
        packed = np.array([self._rows[column] for column in asked], dtype=np.uint8).reshape(-1, width)
        while len(self._rows) > max(1, _ROW_CACHE // width):
            self._rows.popitem(last=False)
        return np.unpackbits(packed, axis=1, count=len(self.simplices)).view(np.bool_)

    @cached_property
    def volumes(self) -> NDArray[np.float64]:
        """Volumes of all simplices in floating point, shape (m,): to rank them, never to decide."""
        corners = self.configuration.floats[self.simplices]
        edges = corners[:, 1:] - corners[:, :1]
        # Far from 1, all may be infinite, or zero.
        with np.errstate(over="ignore"):
            return np.abs(np.linalg.det(edges)) / factorial(self.dimension)

    def nearest_first(
        self, candidates: NDArray[np.integer], columns: NDArray[np.integer]
    ) -> NDArray[np.integer]:
        """Sort candidates by how often their vertices occur among `columns`; of equals, larger ones first.

        A good order for lifting: the simplices that a relaxation turns to next are made of the same points.
        """
        occurrences = np.bincount(self.simplices[columns].ravel(), minlength=self.configuration.n)
        shared = occurrences[self.simplices[candidates]].sum(axis=1)
        return candidates[np.lexsort((candidates, -self.volumes[candidates], -shared))]

    @cached_property
    def _all_crossings(self) -> NDArray[np.bool_]:
        relation = overlap_matrix if self.dissection else crossing_matrix
        return relation(self.chirotope, self.simplices)

    @cached_property
    def _crossing_table(self) -> CrossingTable:
        return CrossingTable(self.chirotope, self.simplices)

    @cached_property
    def _rows(self) -> OrderedDict[int, NDArray[np.uint8]]:
        return OrderedDict()


class FractionalPoint:
    """A point x of the relaxation, seen on its support.

    Parameters
    ----------
    problem : Problem
    x : ndarray of float, shape (m,)
        A value for each d-simplex.

    Attributes
    ----------
    x : ndarray of float, shape (m,)
    support : ndarray of int
        Columns with a value above the tolerance, ascending.
    fractional : ndarray of int
        Those of the support whose value is also below 1 by the tolerance.
    """

    def __init__(self, problem: Problem, x: NDArray[np.floating]) -> None:
        self.problem = problem
        self.x = np.array(x, dtype=float)
        self.x.setflags(write=False)
        self.support: NDArray[np.intp] = np.flatnonzero(self.x > TOLERANCE)
        self.fractional: NDArray[np.intp] = self.support[self.x[self.support] < 1 - TOLERANCE]

    def __repr__(self) -> str:
        return (
            f"<FractionalPoint of {self.problem.configuration.name}: {len(self.support)} of {len(self.x)} simplices in "
            f"its support, {len(self.fractional)} fractional>"
        )

    @property
    def is_integral(self) -> bool:
        """Whether every value is 0 or 1 up to the tolerance."""
        return len(self.fractional) == 0

    @cached_property
    def crossings(self) -> NDArray[np.bool_]:
        """The crossing graph on `fractional`, as a symmetric matrix without loops."""
        return self.problem.crossings(self.fractional)

    def heaviest(self, count: int) -> NDArray[np.intp]:
        """Return the `count` fractional columns of largest value (all, if there are no more), ascending."""
        order = np.argsort(-self.x[self.fractional], kind="stable")
        return np.sort(self.fractional[order[:count]])

    def crossings_among(self, columns: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Return the crossing graph on some columns, taken from `crossings` where it has them all."""
        if len(columns) == len(self.fractional) and np.array_equal(columns, self.fractional):
            return self.crossings
        return self.problem.crossings(columns)

    def value(self, cut: Cut) -> float:
        """Return the left-hand side of a cut at this point."""
        values = self.x[np.asarray(cut.simplices, dtype=np.intp)]
        if cut.coefficients is None:
            return float(values.sum())
        return float(values @ np.asarray([float(c) for c in cut.coefficients]))


class Separator(ABC):
    """Base class of all cut families.

    A family is a subclass with a `name`. Its parameters are the keyword arguments of its constructor, each
    with a default; on the command line they are written ``name:parameter=value,...``.

    Examples
    --------
    >>> class NoTwoOf(Separator):
    ...     name = "no-two-of"
    ...     def separate(self, point):
    ...         columns = point.fractional
    ...         rows, others = point.crossings.nonzero()
    ...         for i, j in zip(columns[rows], columns[others]):
    ...             if i < j and point.x[i] + point.x[j] > 1:
    ...                 yield Cut([i, j], 1, proof={"crossing": [int(i), int(j)]})
    """

    name: ClassVar[str] = ""
    #: Whether the cuts are valid for all dissections too, not only for triangulations.
    dissections: ClassVar[bool] = False
    #: When the family is asked: those of later stages, the costly ones, only where earlier ones leave nothing to add.
    stage: ClassVar[int] = 0
    problem: Problem

    def setup(self, problem: Problem) -> None:
        """Prepare for one problem; called once, before the first point."""
        self.problem = problem

    @abstractmethod
    def separate(self, point: FractionalPoint) -> Iterable[Cut]:
        """Yield valid inequalities that the point violates, most useful ones first.

        A host stops listening when its time is over, which it sees between two cuts only, and refuses more than
        100,000 of them for one point. No cut at all is a fine answer; None is not.
        """

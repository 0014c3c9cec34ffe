"""What a host does around separators: exact scaling, violation, filters, limits, statistics, error capture."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from fractions import Fraction
from math import gcd, lcm
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.errors import SeparatorError, SeparatorLoadError
from bcut.separation.calls import cuts_of, guard, shown
from bcut.separation.observer import CutObserver
from bcut.separation.proofs import plain_proof
from bcut.separation.seam import Cut, FractionalPoint, Problem, Separator

# SCIP's own threshold at the root: violation divided by the Euclidean norm of the coefficients.
MIN_EFFICACY = 1e-4
# Larger coefficients make an LP row numerically useless; such cuts are dropped, and counted as found only.
MAX_COEFFICIENT = 10_000


@dataclass(frozen=True, eq=False)
class IntegerCut:
    """A cut with coprime integer coefficients, ready for a solver: ``coefficients @ x[columns] <= rhs``."""

    family: str
    columns: NDArray[np.int64]
    coefficients: NDArray[np.int64]
    rhs: int
    proof: Mapping[str, Any]

    @property
    def key(self) -> tuple[bytes, bytes, int]:
        """What makes two cuts the same inequality."""
        return self.columns.tobytes(), self.coefficients.tobytes(), self.rhs

    def restricted_to(self, place: NDArray[np.integer]) -> IntegerCut:
        """Return the cut after other columns were fixed to 0.

        Parameters
        ----------
        place : ndarray of int, shape (old number of columns,)
            New column of each old one, -1 for those that were fixed.
        """
        kept = place[self.columns] >= 0
        columns = place[self.columns[kept]].astype(np.int64)
        return replace(self, columns=columns, coefficients=self.coefficients[kept])

    def violation(self, x: NDArray[np.floating]) -> float:
        """Return by how much x violates the cut (negative when it satisfies it)."""
        return float(self.coefficients @ x[self.columns] - self.rhs)

    def efficacy(self, x: NDArray[np.floating]) -> float:
        """Return the distance from x to the hyperplane of the cut."""
        return self.violation(x) / float(np.linalg.norm(self.coefficients.astype(float)))


@dataclass
class FamilyStatistics:
    """What one family did: the entry under ``separators`` of a result file."""

    calls: int = 0
    found: int = 0
    added: int = 0
    seconds: float = 0.0


@dataclass(frozen=True)
class Limits:
    """Limits that the host sets on every round.

    Attributes
    ----------
    cuts_per_round : int
        At most this many cuts are handed to the solver per round, the most efficacious first.
    min_efficacy : float
        Cuts with a smaller efficacy are dropped.
    max_parallelism : float
        A cut whose cosine with an already accepted one of the round exceeds this is dropped.
    """

    cuts_per_round: int = 500
    min_efficacy: float = MIN_EFFICACY
    max_parallelism: float = 0.999


def to_integers(cut: Cut, family: str, columns: int) -> IntegerCut:
    """Scale a cut to coprime integers and sort it by column.

    Over 0/1 points the left-hand side is then an integer, so the right-hand side is rounded down.

    Raises
    ------
    SeparatorError
        If the cut is malformed: unknown or repeated columns, inexact numbers, lengths that differ, a proof that JSON
        does not hold.
    UnusableCutError
        If the integers do not fit into 64 bits.
    """
    try:
        indices = np.asarray(cut.simplices)
    except ValueError:  # lists of different lengths
        indices = np.empty(0)
    if indices.ndim != 1 or not len(indices) or not np.issubdtype(indices.dtype, np.integer):
        raise SeparatorError(
            family, f"a cut's simplices must be a non-empty list of columns, not {shown(cut.simplices)}"
        )
    if indices.min() < 0 or indices.max() >= columns or len(np.unique(indices)) != len(indices):
        raise SeparatorError(
            family,
            f"a cut's simplices must be distinct columns from 0 to {columns - 1}, not {shown(cut.simplices)}",
        )
    if not (cut.coefficients is None or isinstance(cut.coefficients, Iterable)):
        raise SeparatorError(
            family,
            f"a cut's coefficients must be a list of numbers, or left out, not {shown(cut.coefficients)}",
        )
    given = [1] * len(indices) if cut.coefficients is None else list(cut.coefficients)
    if len(given) != len(indices):
        raise SeparatorError(family, f"a cut has {len(indices)} simplices but {len(given)} coefficients")
    rhs = _exact(cut.rhs, family)
    exact = [_exact(value, family) for value in given]
    scale = lcm(*(value.denominator for value in exact))
    integers = [int(value * scale) for value in exact]
    divisor = gcd(*integers)
    if divisor == 0:
        raise SeparatorError(family, "a cut's coefficients are all zero")
    order = np.argsort(indices)
    keep = [int(i) for i in order if integers[i] != 0]
    right = rhs * scale // divisor
    coprime = [integers[i] // divisor for i in keep]
    if max(abs(value) for value in (right, *coprime)) >= 2**62:
        message = "a cut has numbers of more than 62 bits as coprime integers; no solver can use it"
        raise UnusableCutError(family, message)
    coefficients = np.array(coprime, dtype=np.int64)
    return IntegerCut(
        family, indices[keep].astype(np.int64), coefficients, right, plain_proof(cut.proof, family)
    )


class UnusableCutError(SeparatorError):
    """A well-formed cut with numbers that no solver can use; a host drops it."""


def _exact(value: Any, family: str) -> int | Fraction:
    if type(value) is int or isinstance(value, Fraction):
        return value
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        return int(value)
    raise SeparatorError(
        family,
        f"coefficients and right-hand sides are exact (int or Fraction), not {type(value).__name__} {value!r}",
    )


class Separation:
    """Some separators at work on one problem.

    Parameters
    ----------
    separators : sequence of Separator
        In the order in which they are asked; names must differ.
    problem : Problem
    limits : Limits, optional
    statistics : dict of str to FamilyStatistics, optional
        Counts to go on from, changed in place.
    observer : CutObserver, optional
        Is told of every round.
    deadline : float, optional
        Value of `time.monotonic` after which no separator is asked any further; the cuts found by then are kept. Only
        between two cuts can a separator be stopped.

    Attributes
    ----------
    statistics : dict of str to FamilyStatistics
        Live counts, by family.
    cut_short : bool
        Whether the deadline ended the last round, so that no cuts do not mean that there are none.
    """

    def __init__(
        self,
        separators: Sequence[Separator],
        problem: Problem,
        limits: Limits | None = None,
        *,
        statistics: dict[str, FamilyStatistics] | None = None,
        observer: CutObserver | None = None,
        deadline: float | None = None,
    ) -> None:
        self.observer, self.deadline = observer, deadline
        self.cut_short = False
        self.separators = list(separators)
        self.problem = problem
        self.limits = limits or Limits()
        self.statistics = {} if statistics is None else statistics
        check_names(self.separators)
        for separator in self.separators:
            self.statistics.setdefault(separator.name, FamilyStatistics())
        self.known: set[tuple[bytes, bytes, int]] = set()
        for separator in self.separators:
            with guard(separator, "setup", self.statistics[separator.name]):
                separator.setup(problem)

    def restricted_to(self, columns: NDArray[np.integer]) -> Separation:
        """Put the same separators to work on some of the columns; the statistics go on."""
        problem = Problem(self.problem.formulation.restricted_to(columns))
        return Separation(
            self.separators,
            problem,
            self.limits,
            statistics=self.statistics,
            observer=self.observer,
            deadline=self.deadline,
        )

    def relaxed(self, value: float, *, node: int = 0) -> None:
        """Tell the observer of a relaxation, before its point is separated."""
        if self.observer is not None:
            self.observer.relaxed(value, node)

    def round(self, x: NDArray[np.floating]) -> list[IntegerCut]:
        """Ask the separators about a point, stage by stage, and return the cuts worth adding.

        Those of a later stage are asked only where the earlier ones left nothing to add.

        Parameters
        ----------
        x : ndarray of float, shape (m,)

        Returns
        -------
        list of IntegerCut
            Violated, new, not nearly parallel, most efficacious first. The caller confirms what the solver took
            by `confirm`.

        Raises
        ------
        SeparatorError
            If a separator raises, yields something that is no cut, or yields cuts without end.
        """
        self.cut_short = False
        point = FractionalPoint(self.problem, x)
        if point.is_integral:
            return []
        candidates: list[IntegerCut] = []
        chosen: list[IntegerCut] = []
        for stage in sorted({separator.stage for separator in self.separators}):
            for separator in self.separators:
                if separator.stage == stage:
                    candidates.extend(self._ask(separator, point))
            chosen = self._select(candidates, x)
            if chosen or self.cut_short:
                break
        if self.observer is not None:
            self.observer.separated(self.problem, x, candidates, chosen)
        return chosen

    def _ask(self, separator: Separator, point: FractionalPoint) -> list[IntegerCut]:
        """Return the cuts of one separator that are violated enough; where the time is over, those so far."""
        asked: list[IntegerCut] = []
        if self._out_of_time():
            return asked
        statistics = self.statistics[separator.name]
        statistics.calls += 1
        with guard(separator, "separate", statistics), closing(cuts_of(separator, point)) as cuts:
            for cut in cuts:
                try:
                    scaled = to_integers(cut, separator.name, len(point.x))
                except UnusableCutError:
                    statistics.found += 1
                else:
                    if scaled.efficacy(point.x) > self.limits.min_efficacy:
                        statistics.found += 1
                        asked.append(scaled)
                if self._out_of_time():
                    break
        return asked

    def _out_of_time(self) -> bool:
        if self.deadline is not None and time.monotonic() > self.deadline:
            self.cut_short = True
        return self.cut_short

    def confirm(self, cut: IntegerCut) -> None:
        """Record that the solver took a cut: it counts as added and is not offered again."""
        self.statistics[cut.family].added += 1
        self.known.add(cut.key)
        if self.observer is not None:
            self.observer.took(cut)

    def forget(self, cut: IntegerCut) -> None:
        """Allow a cut to be offered again, after the solver dropped it."""
        self.known.discard(cut.key)

    def _select(self, candidates: list[IntegerCut], x: NDArray[np.floating]) -> list[IntegerCut]:
        usable = [cut for cut in candidates if np.abs(cut.coefficients).max() <= MAX_COEFFICIENT]
        usable.sort(key=lambda cut: cut.efficacy(x), reverse=True)
        accepted: list[IntegerCut] = []
        seen = set(self.known)
        directions = _Directions(len(x))
        for cut in usable:
            if len(accepted) >= self.limits.cuts_per_round:
                break
            if cut.key in seen or directions.parallel(cut) > self.limits.max_parallelism:
                continue
            seen.add(cut.key)
            directions.add(cut)
            accepted.append(cut)
        return accepted


def check_names(separators: Sequence[Separator]) -> None:
    """Refuse two separators of one name: their statistics could not be told apart."""
    names = [separator.name for separator in separators]
    for name in names:
        if names.count(name) > 1:
            raise SeparatorLoadError(
                f"separator '{name}' is given twice; give it once, or rename one of the two"
            )


class _Directions:
    """Unit normals of the accepted cuts, indexed by column, so that a cosine costs only shared entries."""

    def __init__(self, columns: int) -> None:
        self.by_column: dict[int, list[tuple[int, float]]] = {}
        self.count = 0

    def _unit(self, cut: IntegerCut) -> list[tuple[int, float]]:
        values = cut.coefficients / np.linalg.norm(cut.coefficients.astype(float))
        return list(zip(cut.columns.tolist(), values.tolist(), strict=True))

    def add(self, cut: IntegerCut) -> None:
        for column, value in self._unit(cut):
            self.by_column.setdefault(column, []).append((self.count, value))
        self.count += 1

    def parallel(self, cut: IntegerCut) -> float:
        """Return the largest cosine between the cut and an accepted one."""
        products = [0.0] * self.count
        for column, value in self._unit(cut):
            for other, entry in self.by_column.get(column, ()):
                products[other] += value * entry
        return max(products, default=0.0)

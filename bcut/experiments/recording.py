"""From what a host tells about separators at work to the entries of a ledger."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bcut.errors import SolverError
from bcut.experiments.ledger import LedgerWriter
from bcut.formulations.formulation import Formulation

if TYPE_CHECKING:
    from bcut.bounds.root import RootBound
    from bcut.scip.root_lp import RootLp, RootRow
    from bcut.separation.driver import IntegerCut
    from bcut.separation.seam import Problem

# Cuts whose slack is at most this are tight.
_TIGHT = 1e-6
# SCIP's root; the loop before the tree is node 0.
SCIP_ROOT = 1

Inequality = tuple[bytes, bytes, float]


@dataclass
class CutCounts:
    """What became of the cuts of one family.

    Attributes
    ----------
    found : int
    chosen : int
        Offered to the solver by the host.
    taken : int
        By the solver.
    final, active : int
        In the last relaxation, and tight there.
    """

    found: int = 0
    chosen: int = 0
    taken: int = 0
    final: int = 0
    active: int = 0


@dataclass
class _Open:
    """A cut of the current round: its entry, and the cut over the columns of the whole formulation."""

    entry: dict[str, Any]
    columns: NDArray[np.int64] | None
    coefficients: NDArray[np.float64]


class Recorder:
    """Writes a ledger while a run is going on; a `bcut.separation.observer.CutObserver`.

    Parameters
    ----------
    writer : LedgerWriter
    whole : Formulation, optional
        The formulation that a root bound is about: with it, the last relaxation is recorded.

    Attributes
    ----------
    counts : dict of str to CutCounts
    seconds, processor : float
        What recording took while separators were at work, as wall and as processor time: no part of that of a run.
    torn : bool
        Whether it was interrupted itself: then the ledger may lack a part of something, and is of no use.
    """

    def __init__(self, writer: LedgerWriter, whole: Formulation | None = None) -> None:
        self.writer, self.whole = writer, whole
        self.counts: dict[str, CutCounts] = {}
        self.seconds, self.processor = 0.0, 0.0
        self.torn = False
        self._node, self._round, self._value = -1, 0, 0.0
        self._stirred = True
        self._open: list[_Open] = []
        self._by_key: dict[tuple[bytes, bytes, int], _Open] = {}
        self._taken: list[tuple[int, _Open]] = []
        self._number = 0
        self._problem: Problem | None = None
        self._part = 0
        self._known_rows: dict[Inequality, int] = {}
        self._last_lp: RootLp | None = None

    # What a host tells.

    def relaxed(self, value: float, node: int) -> None:
        """Note a relaxation: cuts of the one before at this node now have a value after them."""
        if (
            node == self._node
            and not self._stirred
            and abs(value - self._value) <= 1e-12 * max(1.0, abs(value))
        ):
            return
        with self._timed():
            self._close(value if node == self._node else None)
        self._round = self._round + 1 if node == self._node else 1
        self._node, self._value, self._stirred = node, value, False

    def separated(
        self,
        problem: Problem,
        x: NDArray[np.floating],
        found: Sequence[IntegerCut],
        chosen: Sequence[IntegerCut],
    ) -> None:
        """Note the cuts found for a point."""
        if found:
            with self._timed():
                self._found(problem, x, found, chosen)

    def took(self, cut: IntegerCut) -> None:
        """Note that the solver took a cut of this round."""
        self.torn = True
        opened = self._by_key[cut.key]
        opened.entry["taken"] = True
        self._count(cut.family).taken += 1
        self._taken.append((opened.entry["number"], opened))
        self._stirred = True
        self.torn = False

    def root_lp(self, lp: RootLp) -> None:
        """Note a relaxation of SCIP's root, and the rows that SCIP's own separators added to it."""
        before, spent = self._last_lp, (self.seconds, self.processor)
        if before is None or not np.array_equal(before.x, lp.x):
            self._stirred = True
        self.relaxed(lp.value, SCIP_ROOT)
        self.torn = True
        for row in lp.rows:
            key = _key(row.columns, row.coefficients, row.rhs)
            if row.family.startswith("scip:") and key not in self._known_rows:
                self._known_rows[key] = self._write_row(row, before, lp.value)
        self._last_lp = lp
        self.torn = False
        # The host knows what this took.
        self.seconds, self.processor = spent

    # The end.

    def finish_loop(self, bound: RootBound) -> bytes:
        """Write the last relaxation of a root bound; returns the file."""
        assert self.whole is not None
        kept, lp = bound.columns, bound.lp_after_cuts
        # Where a limit came before the cuts of the last round were solved with, the value is that without them; and
        # unknown where columns were fixed meanwhile. An interrupted loop tells of the relaxation before.
        unsolved = {opened.entry["number"] for opened in self._open}
        if unsolved and bound.status != "interrupted" and len(kept) < len(self.whole.simplices):
            lp = None
        fixed = np.setdiff1d(np.arange(len(self.whole.simplices)), kept)
        place = np.full(len(self.whole.simplices), -1)
        place[kept] = np.arange(len(kept))
        taken: dict[Inequality, int] = {}
        for number, opened in self._taken:
            assert opened.columns is not None
            stays = place[opened.columns] >= 0
            taken[
                _key(place[opened.columns][stays], opened.coefficients[stays], float(opened.entry["rhs"]))
            ] = number
        final: list[int] = []
        for cut in bound.cuts:
            found = taken.get(_key(cut.columns, cut.coefficients.astype(float), float(cut.rhs)))
            if found is None:
                # A row of a formulation whose rows are written when they are needed.
                found = self._write_late(cut, kept)
            if found in unsolved:
                continue
            final.append(found)
            active = bound.point is not None and cut.violation(bound.point) >= -_TIGHT
            self._count_final(cut.family, active=active)
        return self._finish(lp, final, fixed, np.array([], dtype=int))

    def finish_scip(self) -> bytes:
        """Write the last relaxation of SCIP's root; returns the file."""
        assert self.whole is not None
        lp = self._last_lp
        nothing = np.array([], dtype=int)
        if lp is None:
            return self._finish(None, [], nothing, nothing)
        numbers = dict(self._known_rows)
        for number, opened in self._taken:
            assert opened.columns is not None
            numbers[_key(opened.columns, opened.coefficients, float(opened.entry["rhs"]))] = number
        final = []
        for row in lp.rows:
            found = numbers.get(_key(row.columns, row.coefficients, row.rhs))
            if found is None:
                raise SolverError(f"a '{row.family}' row of SCIP's last relaxation is missing in the ledger")
            final.append(found)
            slack = row.rhs - float(row.coefficients @ lp.x[row.columns])
            self._count_final(row.family, active=slack <= _TIGHT)
        return self._finish(lp.value, final, lp.at_zero, lp.at_one)

    def finish(self) -> bytes:
        """Write a ledger that is about no single relaxation; returns the file."""
        return self._finish(None, [], np.array([], dtype=int), np.array([], dtype=int))

    def _finish(
        self, lp: float | None, final: list[int], at_zero: NDArray[np.integer], at_one: NDArray[np.integer]
    ) -> bytes:
        self._close(None)
        simplices = np.empty((0, 0)) if self.whole is None else self.whole.simplices
        self.writer.write(
            {
                "record": "end",
                "lp": lp,
                "final": sorted(final),
                "at_zero": simplices[at_zero].tolist() if len(at_zero) else [],
                "at_one": simplices[at_one].tolist() if len(at_one) else [],
            }
        )
        return self.writer.finish()

    @contextmanager
    def _timed(self) -> Iterator[None]:
        started, processor = time.perf_counter(), time.process_time()
        self.torn = True
        try:
            yield
        finally:
            self.seconds += time.perf_counter() - started
            self.processor += time.process_time() - processor
        self.torn = False

    # Entries.

    def _found(
        self,
        problem: Problem,
        x: NDArray[np.floating],
        found: Sequence[IntegerCut],
        chosen: Sequence[IntegerCut],
    ) -> None:
        self._enter(problem)
        if self._node <= SCIP_ROOT:
            self._write_point(problem.simplices, x)
        offered = {id(cut) for cut in chosen}
        for cut in found:
            entry = self._entry(
                cut.family,
                problem.simplices[cut.columns],
                cut.coefficients.tolist(),
                cut.rhs,
                violation=cut.violation(x),
                efficacy=cut.efficacy(x),
                proof=dict(cut.proof),
            )
            counts = self._count(cut.family)
            counts.found += 1
            columns = None
            if id(cut) in offered:
                counts.chosen += 1
                columns = self._in_whole(problem, cut.columns)
            opened = _Open(entry, columns, cut.coefficients.astype(float))
            self._open.append(opened)
            if id(cut) in offered:
                self._by_key[cut.key] = opened

    def _enter(self, problem: Problem) -> None:
        """Write down which simplices are left, where that is a part of all."""
        if problem is self._problem:
            return
        self._problem = problem
        self._part += 1
        if self.whole is None or len(problem.simplices) < len(self.whole.simplices):
            self.writer.write({"record": "part", "part": self._part, "simplices": problem.simplices.tolist()})

    def _in_whole(self, problem: Problem, columns: NDArray[np.int64]) -> NDArray[np.int64] | None:
        if self.whole is None or len(problem.simplices) == len(self.whole.simplices):
            return columns
        found: NDArray[np.int64] = self.whole.columns_of(problem.simplices[columns]).astype(np.int64)
        return found

    def _write_point(self, simplices: NDArray[np.int64], x: NDArray[np.floating]) -> None:
        support = np.flatnonzero(x > 1e-9)
        self.writer.write(
            {
                "record": "point",
                "node": self._node,
                "round": self._round,
                "lp": self._value,
                "simplices": simplices[support].tolist(),
                "values": np.round(x[support], 12).tolist(),
            }
        )

    def _write_row(self, row: RootRow, before: RootLp | None, value: float) -> int:
        """Write a row that one of SCIP's own separators made; its proof is SCIP's affair."""
        assert self.whole is not None
        x = None if before is None else before.x
        violation = None if x is None else float(row.coefficients @ x[row.columns]) - row.rhs
        norm = float(np.linalg.norm(row.coefficients)) or 1.0
        entry = self._entry(
            row.family,
            self.whole.simplices[row.columns],
            [_plain(value) for value in row.coefficients.tolist()],
            _plain(row.rhs),
            violation=violation,
            efficacy=None if violation is None else violation / norm,
            proof={},
        )
        # It was found for the relaxation before the one that has it.
        entry["round"] = max(1, self._round - 1)
        entry["lp_before"] = None if before is None else before.value
        entry["lp_after"] = value
        entry["taken"] = True
        counts = self._count(row.family)
        counts.found, counts.chosen, counts.taken = counts.found + 1, counts.chosen + 1, counts.taken + 1
        self.writer.write(entry)
        return int(entry["number"])

    def _write_late(self, cut: IntegerCut, kept: NDArray[np.integer]) -> int:
        """Write a row that no separator made, over the columns that are left."""
        assert self.whole is not None
        entry = self._entry(
            cut.family,
            self.whole.simplices[kept[cut.columns]],
            cut.coefficients.tolist(),
            cut.rhs,
            violation=None,
            efficacy=None,
            proof=dict(cut.proof),
        )
        self.writer.write({**entry, "taken": True, "lp_before": None})
        return int(entry["number"])

    def _entry(
        self,
        family: str,
        simplices: NDArray[np.int64],
        coefficients: list[Any],
        rhs: float,
        *,
        violation: float | None,
        efficacy: float | None,
        proof: dict[str, Any],
    ) -> dict[str, Any]:
        self._number += 1
        return {
            "record": "cut",
            "number": self._number,
            "family": family,
            "node": self._node,
            "round": self._round,
            "part": self._part,
            "simplices": simplices.tolist(),
            "coefficients": coefficients,
            "rhs": rhs,
            "violation": violation,
            "efficacy": efficacy,
            "taken": False,
            "lp_before": self._value,
            "lp_after": None,
            "proof": proof,
        }

    def _close(self, value: float | None) -> None:
        """Write the cuts of the round, with the value after it."""
        for opened in self._open:
            opened.entry["lp_after"] = value
            self.writer.write(opened.entry)
            # Only what the last relaxation may need stays in memory.
            opened.entry = {key: opened.entry[key] for key in ("number", "family", "rhs")}
        self._open, self._by_key = [], {}

    def _count(self, family: str) -> CutCounts:
        return self.counts.setdefault(family, CutCounts())

    def _count_final(self, family: str, *, active: bool) -> None:
        counts = self._count(family)
        counts.final += 1
        counts.active += active


def _key(columns: NDArray[np.integer], coefficients: NDArray[np.float64], rhs: float) -> Inequality:
    return columns.astype(np.int64).tobytes(), coefficients.tobytes(), rhs + 0.0


def _plain(value: float) -> int | float:
    """Return a number as an integer where it is one."""
    return int(value) if value == int(value) else value

"""Solving a root relaxation again with exactly the cuts of a ledger, and proving its cuts again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bcut.errors import BcutError, LedgerError, VerificationError
from bcut.experiments.ledger import Ledger
from bcut.verification.cuts import CUT_CHECKERS, Candidates, CertificateCut, UncheckedError
from bcut.verification.exact_points import ExactPoints

if TYPE_CHECKING:
    from bcut.geometry.configuration import PointConfiguration

# Relative to the larger of the bound and 1.
REPLAY_TOLERANCE = 1e-9
_MOST_REASONS = 10


@dataclass(frozen=True)
class Replay:
    """A root relaxation that was solved again.

    Attributes
    ----------
    recorded, found : float
        Its value in the ledger and now.
    before : float
        Without cuts.
    cuts : int
    """

    recorded: float
    found: float
    before: float
    cuts: int

    @property
    def agrees(self) -> bool:
        """Whether the two values are the same up to 1e-9."""
        return abs(self.recorded - self.found) <= REPLAY_TOLERANCE * max(1.0, abs(self.recorded))


def replay(ledger: Ledger) -> Replay:
    """Solve the relaxation with the cuts that a run ended with.

    Raises
    ------
    LedgerError
        The ledger is not about one root relaxation.
    """
    from bcut.bounds.relaxation import Relaxation
    from bcut.objectives.objective import make_objective
    from bcut.separation.driver import IntegerCut
    from bcut.solving.programs import formulation_name, make_formulation

    end, problem = ledger.end, ledger.header["problem"]
    if end["lp"] is None:
        raise LedgerError(
            f"{ledger.label}: records no last relaxation of a root; take one of a run with preset 'loop' or 'root' "
            "that solved one within its time limit"
        )
    configuration = _configuration(ledger)
    name = formulation_name(problem["formulation"], dissection=False)
    formulation = make_formulation(name, configuration, spanning=problem["spanning"])
    objective = make_objective(problem["objective"], formulation, sense=problem["sense"])
    relaxation = Relaxation(formulation, objective)
    plain = relaxation.solve()
    place = {tuple(simplex): column for column, simplex in enumerate(formulation.simplices.tolist())}

    def columns(simplices: list[list[int]]) -> NDArray[np.int64]:
        try:
            return np.array([place[tuple(simplex)] for simplex in simplices], dtype=np.int64)
        except (KeyError, TypeError):
            strange = next(s for s in simplices if not isinstance(s, list) or tuple(s) not in place)
            raise LedgerError(
                f"{ledger.label}: speaks of {json.dumps(strange)}, which is no candidate simplex of its points"
            ) from None

    rows: list[IntegerCut] = []
    for cut in ledger.cuts:
        if cut["final"]:
            _check_form(cut, configuration.n, configuration.dimension, ledger.label)
            coefficients = np.array(cut["coefficients"])
            rows.append(IntegerCut(cut["family"], columns(cut["simplices"]), coefficients, cut["rhs"], {}))
    # A column that SCIP fixed at 1 is one more row.
    rows += [IntegerCut("fixed", columns([simplex]), np.array([-1]), -1, {}) for simplex in end["at_one"]]
    relaxation.add(rows)
    fixed = columns(end["at_zero"])
    if len(fixed):
        relaxation = relaxation.restricted_to(np.setdiff1d(np.arange(len(formulation.simplices)), fixed))
    point = relaxation.solve()
    assert plain is not None
    assert point is not None
    return Replay(float(end["lp"]), point.value, plain.value, len(rows) - len(end["at_one"]))


def _configuration(ledger: Ledger) -> PointConfiguration:
    from bcut.geometry.configuration import PointConfiguration

    instance = ledger.header["instance"]
    configuration = PointConfiguration.from_values(instance["points"], name=instance["name"])
    if configuration.digest != instance["digest"]:
        raise LedgerError(
            f"{ledger.label}: its points do not have the digest that stands beside them: one of the two was changed"
        )
    return configuration


@dataclass
class CutChecks:
    """What became of proving the cuts of a ledger again.

    Attributes
    ----------
    proven : dict of str to int
        Cuts whose right-hand side follows from their proof, by family.
    without_checker : dict of str to int
        Cuts of families that nobody can check, such as SCIP's own.
    refused : list of (int, str)
        Number and reason of those that do not hold.
    unchecked : list of (int, str)
        Number and reason of those that take too long to check: nothing is known of them.
    """

    proven: dict[str, int] = field(default_factory=dict)
    without_checker: dict[str, int] = field(default_factory=dict)
    refused: list[tuple[int, str]] = field(default_factory=list)
    unchecked: list[tuple[int, str]] = field(default_factory=list)


class UncheckedCutsError(BcutError):
    """Cuts of a ledger that take too long to check, while none is refused.

    Attributes
    ----------
    checks : CutChecks
        With what became of the others.
    """

    exit_status = 3

    def __init__(self, checks: CutChecks, label: str) -> None:
        self.checks = checks
        named = "; ".join(f"cut {number}: {reason}" for number, reason in checks.unchecked[:_MOST_REASONS])
        more = len(checks.unchecked) - _MOST_REASONS
        proven = ", ".join(f"{count} {family}" for family, count in sorted(checks.proven.items()))
        super().__init__(
            f"{label}: {len(checks.unchecked)} of the cuts were not checked ({named}"
            + (f"; and {more} more" if more > 0 else "")
            + f"); none is refused, {proven or 'none'} proven again"
        )


def check_ledger(ledger: Ledger) -> CutChecks:
    """Derive the right-hand side of every cut again, exactly, from its proof and the points alone.

    A cut found when columns had been fixed is about the simplices that were left; those are its candidates.

    Returns
    -------
    CutChecks
        With all refusals, and what was not checked beside these. A right-hand side is refused as well where a smaller
        one follows: it is not the one that the proof gives.

    Raises
    ------
    LedgerError
        A cut is malformed.
    UncheckedCutsError
        No cut is refused, but some take too long to check.
    """
    problem = ledger.header["problem"]
    points = ExactPoints(_configuration(ledger).scalars())
    whole = Candidates(points, spanning=problem["spanning"])
    tables: dict[int, Candidates] = {}
    checks = CutChecks()
    for entry in ledger.cuts:
        family, number = entry["family"], entry["number"]
        if family not in CUT_CHECKERS:
            checks.without_checker[family] = checks.without_checker.get(family, 0) + 1
            continue
        cut = _certificate_cut(entry, points, ledger.label)
        part = entry["part"]
        if part not in tables:
            tables[part] = whole
            if part in ledger.parts:
                tables[part] = whole.only(tuple(simplex) for simplex in ledger.parts[part])
        try:
            rhs = CUT_CHECKERS[family](tables[part], cut)
            if rhs != cut.rhs:
                raise VerificationError(
                    f"{family} cut: its right-hand side is {cut.rhs}, but its proof gives {rhs}"
                )
        except VerificationError as error:
            checks.refused.append((number, str(error)))
        except UncheckedError as error:
            checks.unchecked.append((number, str(error)))
        else:
            checks.proven[family] = checks.proven.get(family, 0) + 1
    if checks.unchecked and not checks.refused:
        raise UncheckedCutsError(checks, ledger.label)
    return checks


def _certificate_cut(entry: Mapping[str, Any], points: ExactPoints, label: str) -> CertificateCut:
    _check_form(entry, points.n, points.dimension, label)
    return CertificateCut(
        entry["family"],
        tuple(tuple(simplex) for simplex in entry["simplices"]),
        tuple(Fraction(value) for value in entry["coefficients"]),
        Fraction(entry["rhs"]),
        Fraction(0),
        entry["proof"],
    )


def _check_form(entry: Mapping[str, Any], n: int, dimension: int, label: str) -> None:
    """Refuse an entry that is no cut for n points."""
    simplices, coefficients, rhs = entry["simplices"], entry["coefficients"], entry["rhs"]
    wrong = ""
    if not simplices:
        wrong = "it has no simplices"
    elif not all(_is_simplex(simplex, n, dimension) for simplex in simplices):
        strange = next(simplex for simplex in simplices if not _is_simplex(simplex, n, dimension))
        wrong = f"{json.dumps(strange)} is no list of {dimension + 1} ascending points below {n}"
    elif len({tuple(simplex) for simplex in simplices}) != len(simplices):
        wrong = "it has the same simplex twice"
    elif len(coefficients) != len(simplices):
        wrong = f"it has {len(coefficients)} coefficients for {len(simplices)} simplices"
    elif not all(type(value) is int for value in coefficients):
        wrong = "its coefficients are not all integers"
    elif type(rhs) is not int:
        wrong = f"its right-hand side is {rhs!r}, where an integer belongs"
    if wrong:
        raise LedgerError(f"{label}: cut {entry['number']} is malformed: {wrong}")


def _is_simplex(value: Any, n: int, dimension: int) -> bool:
    return (
        isinstance(value, list)
        and len(value) == dimension + 1
        and all(type(vertex) is int and 0 <= vertex < n for vertex in value)
        and sorted(set(value)) == value
    )

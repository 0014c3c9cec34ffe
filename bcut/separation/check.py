"""The contract that every separator keeps, as a suite of checks; its heart is validity.

A separator is set up on small configurations, shown points of their relaxations and others, and every cut
that it yields is compared with *every* triangulation, in integer arithmetic. A family that declares its cuts
valid for dissections is shown problems about these as well, and its cuts there are compared with every one of
them. Points are vertices of the relaxation, before and after the separator's own cuts, the same with noise,
mixtures of solutions, and points far outside: a valid cut is valid wherever it was found.
"""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

import numpy as np

from bcut.errors import SeparatorError, SeparatorLoadError
from bcut.separation.calls import MAX_CUTS, EndlessSeparatorError, cuts_of, guard
from bcut.separation.cases import CASES, Case, CaseName, Point, case, disturbed
from bcut.separation.driver import MIN_EFFICACY, IntegerCut, to_integers
from bcut.separation.resolve import resolve
from bcut.separation.seam import FractionalPoint, Separator

Result = TypeVar("Result")

# Rounds of a separator's own cuts on each objective.
_ROUNDS = 3
# A separator that is this much at fault is not asked any further.
_ENOUGH_FAILURES = 5

RULES = {
    "name": "it has a name",
    "parameters": "every parameter has a default",
    "runs": "it never raises, nor exits",
    "ends": f"it comes to an end: at most {MAX_CUTS:,} cuts for a point",
    "cuts": "it yields cuts: distinct columns, exact numbers, proofs that JSON holds",
    "read-only": "it leaves the point as it is",
    "deterministic": "the same points give the same cuts",
    "valid": "no cut cuts off a triangulation",
    "dissections": "no cut cuts off a dissection, as it declares",
}


@dataclass(frozen=True)
class InvalidCut:
    """A cut that a triangulation violates, or a dissection.

    Attributes
    ----------
    instance : str
    cut : str
        The inequality, written out with vertices.
    solution : list of list of int
        The simplices of the triangulation or dissection.
    dissection : bool
        Whether dissections were asked for.
    left, rhs : int
        Left-hand side of the cut for the solution, and its right-hand side.
    """

    instance: str
    cut: str
    solution: list[list[int]]
    dissection: bool
    left: int
    rhs: int

    def __str__(self) -> str:
        simplices = " ".join(str(simplex) for simplex in self.solution)
        kind = "dissection" if self.dissection else "triangulation"
        return (
            f"{self.instance}: the cut {self.cut} cuts off a {kind}, "
            f"for which the left side is {self.left}: {simplices}"
        )


@dataclass(frozen=True)
class Failure:
    """One broken rule: its key in `RULES`, and what happened."""

    rule: str
    text: str
    invalid: InvalidCut | None = None


@dataclass
class CheckReport:
    """What the suite found.

    Attributes
    ----------
    separator : str
        The name of the family.
    failures : list of Failure
    reached : set of str
        The rules that were put to the test at least once: without a cut, nothing is known of validity.
    configurations, triangulations, points : int
        How many there were; where a configuration has several cases, it counts for each.
    dissections : int or None
        How many there were; None for a family that does not declare its cuts valid for them.
    cuts, violated : int
        Cuts that were compared with all triangulations, or dissections, of their configuration, each once; and
        how many of them were violated at the point at which they were found.
    seconds : float
    """

    separator: str
    failures: list[Failure] = field(default_factory=list)
    reached: set[str] = field(default_factory=set)
    configurations: int = 0
    triangulations: int = 0
    dissections: int | None = None
    points: int = 0
    cuts: int = 0
    violated: int = 0
    seconds: float = 0.0

    def __repr__(self) -> str:
        return f"<CheckReport {self.separator}: {'passed' if self.ok else 'FAILED'}, {self.cuts} cuts>"

    def __str__(self) -> str:
        return self.summary

    @property
    def ok(self) -> bool:
        """Whether no rule was broken."""
        return not self.failures

    @property
    def invalid_cuts(self) -> list[InvalidCut]:
        """The cuts that cut off a triangulation or a dissection."""
        return [failure.invalid for failure in self.failures if failure.invalid]

    @property
    def summary(self) -> str:
        """The report as lines of text."""
        broken = {failure.rule for failure in self.failures}
        lines = [f"separator '{self.separator}': {'passed' if self.ok else 'FAILED'}"]
        for rule, text in RULES.items():
            if rule != "dissections" or self.dissections:
                found = "FAILED" if rule in broken else "ok" if rule in self.reached else "not reached"
                lines.append(f"  {found:11}  {text}")
        solutions = f"{self.triangulations} triangulations"
        if self.dissections is not None:
            solutions += f" and {self.dissections} dissections"
        where = f"at {self.points} points of {self.configurations} configurations"
        if self.cuts:
            compared = f"{self.cuts} cuts ({self.violated} violated where they were found) {where}, against"
        else:
            compared = f"no cut {where}, which have"
        lines.append(f"  {compared} {solutions}, {self.seconds:.1f} s")
        if self.ok and not self.cuts:
            lines.append("  It yielded no cut at any point: that its cuts are valid was not tested.")
        elif self.ok and not self.violated:
            lines.append("  No cut was violated anywhere: validity was hardly put to the test.")
        if self.ok and self.cuts and self.dissections == 0:
            lines.append(
                "  No case had dissections: that cuts are valid for them, as declared, was not tested."
            )
        for failure in self.failures:
            lines += ["", f"{failure.rule}: {failure.text}"]
        return "\n".join(lines)


def check_separator(
    separator: str | Callable[[], Separator], cases: Sequence[CaseName] = CASES
) -> CheckReport:
    """Check that a separator keeps its contract.

    Parameters
    ----------
    separator : str or callable
        A name or a file, as for `bcut.solve`: ``"link"``, ``"./my_cuts.py:depth=3"``. Or what makes a new separator,
        such as the class ``MyCuts`` or ``lambda: MyCuts(depth=3)``.
    cases : sequence of CaseName, optional
        On which configurations. Those about dissections are left out where the family is not for dissections.

    Returns
    -------
    CheckReport

    Raises
    ------
    BcutError
        If there is no such separator, or it cannot be made; what it raises later is in the report.
    """
    started = time.perf_counter()
    make = _maker(separator)
    first = make()
    if not isinstance(first, Separator):
        raise SeparatorLoadError(f"{separator!r} makes {type(first).__name__}, no bcut.Separator")
    report = CheckReport(str(first.name) or type(first).__name__)
    _check_declaration(first, report)
    if first.dissections:
        report.dissections = 0
    for name in cases:
        endless = any(failure.rule == "ends" for failure in report.failures)
        if endless or len(report.failures) >= _ENOUGH_FAILURES:
            break
        if name.dissection and report.dissections is None:
            continue
        small = case(name)
        report.configurations += 1
        solutions = small.incidence.shape[1]
        if name.dissection:
            report.dissections = (report.dissections or 0) + solutions
        else:
            report.triangulations += solutions
        _CaseCheck(small, make, report).run()
    report.seconds = time.perf_counter() - started
    return report


def _maker(separator: Any) -> Callable[[], Separator]:
    """Return what makes a new separator: the suite sets up one for each case, and compares two."""
    if isinstance(separator, str):
        return partial(resolve, separator)
    if isinstance(separator, Separator) or not callable(separator):
        raise SeparatorLoadError(
            f"{separator!r}: give a name, a file or a subclass of bcut.Separator, not one that is made already; with "
            "parameters, write 'link:parameter=value' or lambda: MyCuts(depth=3)"
        )
    return separator


def _check_declaration(separator: Separator, report: CheckReport) -> None:
    report.reached |= {"name", "parameters"}
    family = type(separator)
    if not (isinstance(family.name, str) and family.name):
        report.failures.append(
            Failure("name", f'class {family.__name__} has no name; set `name = "my-cuts"` in it')
        )
    for parameter in inspect.signature(family).parameters.values():
        variadic = parameter.kind in (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
        if parameter.default is inspect.Parameter.empty and not variadic:
            text = f"parameter '{parameter.name}' of {family.__name__} has no default; give it one"
            report.failures.append(Failure("parameters", text))


class _BrokenRuleError(Exception):
    """Ends the check of one case."""

    def __init__(self, rule: str, text: str, invalid: InvalidCut | None = None) -> None:
        self.failure = Failure(rule, text, invalid)


class _CaseCheck:
    """The checks of one separator on one configuration."""

    def __init__(self, small: Case, make: Callable[[], Separator], report: CheckReport) -> None:
        self.case, self.report = small, report
        self.separator, self.second = make(), make()
        self.known: set[tuple[bytes, bytes, int]] = set()

    def run(self) -> None:
        try:
            for separator in (self.separator, self.second):
                self._call(separator, "setup", partial(separator.setup, self.case.problem))
            for x in self._points():
                self._look(x)
        except _BrokenRuleError as broken:
            self.report.failures.append(broken.failure)

    def _points(self) -> Iterator[Point]:
        """Yield points; those of the rounds with the separator's own cuts are looked at on the way."""
        random = np.random.default_rng(2)
        yield from self.case.other_points()
        for costs in self.case.objectives():
            cuts: list[IntegerCut] = []
            for _ in range(_ROUNDS):
                x = self.case.optimal_vertex(costs, cuts)
                if x is None:
                    # No valid cuts leave nothing; and the invalid one among them has been reported by now.
                    break
                new = [cut for cut in self._look(x) if cut.efficacy(x) > MIN_EFFICACY]
                if not cuts:
                    yield from disturbed(x, random)
                if not new:
                    break
                cuts += new

    def _look(self, x: Point) -> list[IntegerCut]:
        """Show a point to the separator, check what it yields and return it."""
        self.report.points += 1
        cuts = self._cuts(self.separator, x)
        for cut in cuts:
            self._compare(cut, x)
        if [cut.key for cut in self._cuts(self.second, x)] != [cut.key for cut in cuts]:
            text = f"{self.case.name}: two new separators, shown the same points, yielded different cuts"
            raise _BrokenRuleError("deterministic", text)
        if cuts:
            self.report.reached.add("deterministic")
        return cuts

    def _cuts(self, separator: Separator, x: Point) -> list[IntegerCut]:
        point = FractionalPoint(self.case.problem, x)
        before = _contents(point)
        cuts = self._call(
            separator,
            "separate",
            lambda: [to_integers(cut, separator.name, len(x)) for cut in cuts_of(separator, point)],
        )
        self.report.reached |= {"runs", "ends", "read-only"}
        for name, content in _contents(point).items():
            if content != before[name]:
                raise _BrokenRuleError(
                    "read-only", f"{self.case.name}: separate() changed the point's {name}; work on a copy"
                )
        if cuts:
            self.report.reached.add("cuts")
        return cuts

    def _call(self, separator: Separator, call: str, action: Callable[[], Result]) -> Result:
        try:
            with guard(separator, call):
                return action()
        except SeparatorError as error:
            # Only what was raised has a traceback; the other errors are about what was handed back.
            rule = "ends" if isinstance(error, EndlessSeparatorError) else "runs" if error.trace else "cuts"
            raise _BrokenRuleError(rule, f"{self.case.name}: {error}\n{error.trace}".rstrip()) from None

    def _compare(self, cut: IntegerCut, x: Point) -> None:
        if cut.key in self.known:
            return
        self.known.add(cut.key)
        self.report.reached.add("dissections" if self.case.name.dissection else "valid")
        self.report.cuts += 1
        self.report.violated += bool(cut.efficacy(x) > MIN_EFFICACY)
        left_sides = self.case.left_sides(cut)
        worst = int(np.argmax(left_sides))
        if left_sides[worst] > cut.rhs:
            invalid = InvalidCut(
                str(self.case.name),
                _written(cut, self.case),
                self.case.solution(worst),
                self.case.name.dissection,
                int(left_sides[worst]),
                cut.rhs,
            )
            raise _BrokenRuleError("dissections" if invalid.dissection else "valid", str(invalid), invalid)


def _contents(point: FractionalPoint) -> dict[str, bytes]:
    """Return all that a separator is shown, frozen."""
    shown = {
        "x": point.x,
        "support": point.support,
        "fractional": point.fractional,
        "crossings": point.crossings,
    }
    return {name: values.tobytes() for name, values in shown.items()}


def _written(cut: IntegerCut, small: Case) -> str:
    """Write an inequality out with vertices: ``x[0 1 4] + 2 x[1 3 4] <= 2``."""
    text = ""
    for column, coefficient in zip(cut.columns.tolist(), cut.coefficients.tolist(), strict=True):
        sign = ("- " if coefficient < 0 else "") if not text else (" - " if coefficient < 0 else " + ")
        factor = "" if abs(coefficient) == 1 else f"{abs(coefficient)} "
        text += f"{sign}{factor}x[{' '.join(map(str, small.problem.simplices[column].tolist()))}]"
    return f"{text} <= {cut.rhs}"

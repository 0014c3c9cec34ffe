"""The contract suite: it passes what is right, and names what is wrong with what a separator does."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from contract import FEW, Pairs, broken, rules

from bcut.errors import SeparatorLoadError
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.triangulations import triangulations
from bcut.separation import calls
from bcut.separation.cases import CASES, CaseName, case
from bcut.separation.check import RULES, check_separator
from bcut.separation.driver import to_integers
from bcut.separation.resolve import resolve
from bcut.separation.seam import Cut, FractionalPoint, Problem, Separator


@pytest.mark.parametrize(
    "name", ["clique", "odd-cycle", "convex-polygon", "parity", "face-crossing", "sphere"]
)
def test_the_built_in_families_pass(name: str) -> None:
    report = check_separator(lambda: resolve(name), FEW)
    assert report.ok, report.summary
    assert report.separator == name
    assert report.configurations == len(FEW)
    assert report.triangulations == 1 + 16 + 64 + 74 + 133 + 357
    assert report.violated > 10
    assert "passed" in report.summary
    assert all(
        f"ok           {text}" in report.summary for rule, text in RULES.items() if rule != "dissections"
    )
    assert RULES["dissections"] not in report.summary


def test_a_separator_of_a_few_lines_passes() -> None:
    report = check_separator(Pairs, FEW)
    assert report.ok, report.summary
    assert report.cuts > 100


def test_a_separator_that_finds_nothing_passes_with_a_remark() -> None:
    class Nothing(Separator):
        name = "nothing"

        def separate(self, point: FractionalPoint) -> list[Cut]:
            return []

    report = check_separator(Nothing, FEW[:2])
    assert report.ok
    assert "It yielded no cut at any point: that its cuts are valid was not tested." in report.summary
    assert "no cut at" in report.summary
    assert rules(report, "not reached") == {"cuts", "deterministic", "valid"}
    assert rules(report, "ok") == {"name", "parameters", "runs", "ends", "read-only"}


def test_a_separator_whose_cuts_are_satisfied_passes_with_a_remark() -> None:
    class Trivial(Separator):
        name = "trivial"

        def separate(self, point: FractionalPoint) -> list[Cut]:
            return [Cut([0], 1)]

    report = check_separator(Trivial, FEW[:2])
    assert report.ok
    assert report.cuts == 2
    assert "hardly put to the test" in report.summary
    assert rules(report, "not reached") == set()


def test_a_separator_that_raises_is_named_with_its_traceback() -> None:
    class Raises(Separator):
        name = "raises"

        def separate(self, point: FractionalPoint) -> Iterator[Cut]:
            yield Cut([int(point.support[3])], 1)

    report = check_separator(Raises, FEW)
    assert broken(report) == {"runs"}
    assert "separator 'raises': FAILED" in report.summary
    assert "IndexError" in report.summary
    assert "yield Cut([int(point.support[3])], 1)" in report.summary
    assert "hypersimplex:3,1" in report.failures[0].text
    assert "check.py" not in report.summary.replace("test_separator_check.py", "")
    assert rules(report, "not reached") == {"ends", "cuts", "read-only", "deterministic", "valid"}
    assert rules(report, "ok") == {"name", "parameters"}


@pytest.mark.parametrize("call", ["setup", "separate"])
@pytest.mark.parametrize("status", [0, 7])
def test_a_separator_that_exits_does_not_end_the_check(call: str, status: int) -> None:
    def exits(*_: Any) -> None:
        raise SystemExit(status)

    exiting = type("Exiting", (Pairs,), {"name": "exiting", call: exits})
    report = check_separator(exiting, FEW)
    assert broken(report) == {"runs"}
    text = f"separator 'exiting': {call}() raised SystemExit: {status}; it must return, not exit"
    assert text in report.summary


def test_ctrl_c_ends_the_check() -> None:
    class Interrupted(Separator):
        name = "interrupted"

        def separate(self, point: FractionalPoint) -> list[Cut]:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        check_separator(Interrupted, FEW)


@pytest.mark.parametrize("returned", [None, 42, Cut([0], 0)])
def test_a_separator_that_returns_no_list_is_told_so(returned: Any) -> None:
    class Returns(Separator):
        name = "returns"

        def separate(self, point: FractionalPoint) -> Any:
            return returned

    report = check_separator(Returns, FEW[:1])
    assert broken(report) == {"cuts"}
    shown = "None" if returned is None else type(returned).__name__
    assert f"cuts: hypersimplex:3,1: separator 'returns': separate() returned {shown}" in report.summary
    assert "yield Cuts or return a list of them" in report.summary
    assert "Traceback" not in report.summary


def test_a_separator_that_does_not_end_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calls, "MAX_CUTS", 1000)

    class Endless(Separator):
        name = "endless"

        def separate(self, point: FractionalPoint) -> Iterator[Cut]:
            while True:
                yield Cut([0], 1)

    report = check_separator(Endless, FEW)
    assert broken(report) == {"ends"}
    assert len(report.failures) == 1, "once takes long enough"
    assert (
        "separate() yielded more than 1,000 cuts for one point and was stopped; end its loop"
        in report.summary
    )


def test_a_separator_that_raises_in_setup_is_named() -> None:
    class Unprepared(Pairs):
        name = "unprepared"

        def setup(self, problem: Problem) -> None:
            raise RuntimeError("no table for this dimension")

    report = check_separator(Unprepared, FEW)
    assert broken(report) == {"runs"}
    assert "setup() raised RuntimeError: no table for this dimension" in report.summary
    assert len(report.failures) == 5, "enough is enough"


def test_columns_that_are_missing_after_fixing_are_a_case() -> None:
    class AllThere(Separator):
        name = "all-there"

        def separate(self, point: FractionalPoint) -> list[Cut]:
            columns = self.problem.formulation.columns_of(Chirotope.of(self.problem.configuration).bases)
            assert (columns >= 0).all()
            return []

    thinned = [name for name in CASES if name.thinned]
    assert thinned
    assert broken(check_separator(AllThere, thinned)) == {"runs"}


@pytest.mark.parametrize(
    "yielded",
    [
        Cut([0, 1], 1.0),  # type: ignore[arg-type]
        Cut([0, 1], 1, [1, 0.5]),  # type: ignore[list-item]
        Cut([0, 0], 1),
        Cut([0, 10**6], 1),
        Cut([0, 1], 1, [1]),
        Cut([0, 1], 1, [10**30, 1]),
        Cut([0, 1], 1, 5),  # type: ignore[arg-type]
        Cut([[0], [0, 1]], 1),
        Cut([0, 1], 1, proof=[3]),  # type: ignore[arg-type]
        Cut([0, 1], 1, proof={"set": {3}}),
        ([0, 1], 1),
        None,
    ],
)
def test_what_is_no_cut_is_refused(yielded: Any) -> None:
    class Sloppy(Separator):
        name = "sloppy"

        def separate(self, point: FractionalPoint) -> list[Any]:
            return [yielded]

    assert broken(check_separator(Sloppy, (CaseName("cube:3"),))) == {"cuts"}


def test_exact_fractions_are_cuts() -> None:
    class Halves(Separator):
        name = "halves"

        def separate(self, point: FractionalPoint) -> Iterator[Cut]:
            for cut in Pairs.separate(self, point):  # type: ignore[arg-type]
                yield replace(cut, coefficients=[Fraction(1, 2)] * 2, rhs=Fraction(3, 4))

    report = check_separator(Halves, FEW)
    assert report.ok, report.summary
    scaled = to_integers(Cut([0, 1], Fraction(3, 4), [Fraction(1, 2)] * 2), "halves", 2)
    assert scaled.rhs == 1


def test_a_point_that_is_changed_is_noticed() -> None:
    class Greedy(Separator):
        name = "greedy"

        def separate(self, point: FractionalPoint) -> list[Cut]:
            point.support[:1] = 0
            point.support.sort()
            point.fractional[:] = 0
            return []

    report = check_separator(Greedy, (CaseName("cube:3"),))
    assert broken(report) == {"read-only"}

    class Writes(Separator):
        name = "writes"

        def separate(self, point: FractionalPoint) -> list[Cut]:
            point.x[0] = 1
            return []

    assert broken(check_separator(Writes, (CaseName("cube:3"),))) == {"runs"}


def test_cuts_that_depend_on_chance_are_noticed() -> None:
    class Random(Pairs):
        name = "random"

        def separate(self, point: FractionalPoint) -> list[Cut]:
            cuts = list(super().separate(point))
            return [cuts[i] for i in np.random.default_rng().permutation(len(cuts))]

    assert broken(check_separator(Random, (CaseName("cube:3"),))) == {"deterministic"}


def test_a_name_and_defaults_are_asked_for() -> None:
    class Undeclared(Separator):
        def __init__(self, depth: int) -> None:
            self.depth = depth

        def separate(self, point: FractionalPoint) -> list[Cut]:
            return []

    report = check_separator(lambda: Undeclared(3), FEW[:1])
    assert broken(report) == {"name", "parameters"}
    assert report.separator == "Undeclared"
    assert "'depth'" in report.summary


def test_what_cannot_be_made_is_not_checked() -> None:
    with pytest.raises(SeparatorLoadError, match="cliqu"):
        check_separator(lambda: resolve("cliqu"))


@pytest.mark.parametrize("name", CASES, ids=str)
def test_cases_have_all_their_solutions(name: CaseName) -> None:
    """Each column of the incidence matrix is a 0/1 point of the program, none twice."""
    small = case(name)
    formulation = small.problem.formulation
    count = small.incidence.shape[1]
    assert count > 0
    assert len(np.unique(small.incidence, axis=1).T) == count
    assert set(np.unique(small.incidence).tolist()) <= {0, 1}
    assert small.problem.dissection == name.dissection
    if name.dissection and not name.thinned:
        assert count > len(list(triangulations(small.problem.chirotope, spanning=name.spanning)))
    activity = formulation.matrix.astype(np.int64) @ small.incidence.astype(np.int64)
    assert (activity == formulation.lower[:, None]).all()
    if name.thinned:
        assert len(formulation.simplices) < len(case(replace(name, thinned=False)).problem.simplices)


def test_cases_lead_to_fractional_vertices_in_most_dimensions() -> None:
    found = set()
    for name in CASES:
        small = case(name)
        for costs in small.objectives():
            x = small.optimal_vertex(costs)
            assert x is not None
            if not FractionalPoint(small.problem, x).is_integral:
                found.add((small.problem.dimension, name.dissection))
    assert found >= {(2, False), (3, False), (4, False), (2, True), (3, True)}


def test_left_sides_are_exact_for_any_size_of_coefficient() -> None:
    small = case(CaseName("cube:3"))
    for scale in (1, 2**40):
        cut = to_integers(Cut(list(range(58)), 5, [scale * (1 + i % 7) + i for i in range(58)]), "large", 58)
        expected = [
            sum(int(cut.coefficients[i]) for i in np.flatnonzero(column)) for column in small.incidence.T
        ]
        assert small.left_sides(cut).tolist() == expected

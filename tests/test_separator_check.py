"""The contract suite: it passes what is right, and names what is wrong with what is not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bcut.errors import InputError, SeparatorLoadError, VerificationError
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.crossings import crossing_matrix
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.separation import calls
from bcut.separation.cases import CASES, CaseName, case
from bcut.separation.check import RULES, CheckReport, check_separator
from bcut.separation.driver import to_integers
from bcut.separation.resolve import built_in_names, resolve
from bcut.separation.seam import Cut, FractionalPoint, Problem, Separator
from bcut.separation.template import template, write_template
from bcut.separators.clique import Clique
from bcut.separators.convex_polygon import ConvexPolygon
from bcut.separators.odd_cycle import OddCycle
from bcut.verification.dissection import check_dissection
from bcut.verification.triangulation import check_triangulation

FEW = (
    CaseName("hypersimplex:3,1"),
    CaseName("polygon:5,center"),
    CaseName("grid:3,3", spanning=True),
    CaseName("cube:3"),
    CaseName("random:8,3,seed=1"),
    CaseName("cyclic:9,4"),
)
DISSECTIONS = tuple(name for name in CASES if name.dissection)
FOR_DISSECTIONS = [name for name in built_in_names() if resolve(name).dissections]


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


class TooFew(Separator):
    """Wrong: at most one of two simplices, whether they cross or not."""

    name = "too-few"

    def separate(self, point: FractionalPoint) -> Iterator[Cut]:
        if len(point.support) > 1:
            yield Cut(point.support[:2].tolist(), 1)


def test_an_invalid_cut_is_shown_with_the_triangulation_that_it_cuts_off() -> None:
    report = check_separator(TooFew, (CaseName("cube:3"),))
    assert broken(report) == {"valid"}
    (invalid,) = report.invalid_cuts
    assert invalid.instance == "cube:3"
    assert not invalid.dissection
    assert (invalid.left, invalid.rhs) == (2, 1)
    small = case(CaseName("cube:3"))
    columns = small.problem.formulation.columns_of(np.array(invalid.solution))
    assert tuple(columns.tolist()) in set(triangulations(small.problem.chirotope))
    named = [f"x[{' '.join(map(str, simplex))}]" for simplex in invalid.solution]
    assert sum(name in invalid.cut for name in named) == 2
    assert "<= 1" in invalid.cut
    assert str(invalid.solution[0]) in report.summary


class Overlifted(OddCycle):
    """Wrong in one coefficient only."""

    name = "overlifted"

    def separate(self, point: FractionalPoint) -> Iterator[Cut]:
        for cut in super().separate(point):
            coefficients = list(cut.coefficients or [])
            if coefficients[5:]:
                coefficients[-1] += 1
                yield replace(cut, coefficients=coefficients)


class Tightened(OddCycle):
    """Wrong in the right-hand side only."""

    name = "tightened"

    def separate(self, point: FractionalPoint) -> Iterator[Cut]:
        for cut in super().separate(point):
            yield replace(cut, rhs=cut.rhs - 1)


class OneTooMany(Clique):
    """Wrong by one member that does not cross the others."""

    name = "one-too-many"

    def separate(self, point: FractionalPoint) -> Iterator[Cut]:
        for cut in super().separate(point):
            members = np.asarray(cut.simplices)
            others = np.flatnonzero(~self.problem.crossing_rows(members).any(axis=0))
            others = others[~np.isin(others, members)]
            yield Cut([*members.tolist(), *others[:1].tolist()], 1)


class NoCollinearPoints(ConvexPolygon):
    """Wrong in degenerate position only: points inside an edge are not counted."""

    name = "no-collinear-points"

    def separate(self, point: FractionalPoint) -> Iterator[Cut]:
        if self.problem.dimension == 2 and not self.problem.chirotope.is_general:
            for cut in super().separate(point):
                yield replace(cut, rhs=min(cut.rhs, 3))


@pytest.mark.parametrize("family", [Overlifted, Tightened, OneTooMany, NoCollinearPoints])
def test_small_mistakes_in_good_separators_are_caught(family: type[Separator]) -> None:
    report = check_separator(family, (*FEW, CaseName("grid:3,3")))
    assert "valid" in broken(report)
    for invalid in report.invalid_cuts:
        assert invalid.left > invalid.rhs


def test_some_built_in_families_are_for_dissections() -> None:
    assert {"clique", "odd-cycle"} <= set(FOR_DISSECTIONS)
    assert "link" not in FOR_DISSECTIONS


@pytest.mark.parametrize("name", FOR_DISSECTIONS)
def test_the_built_in_families_for_dissections_are_compared_with_all_of_them(name: str) -> None:
    report = check_separator(lambda: resolve(name), DISSECTIONS)
    assert report.ok, report.summary
    assert (report.configurations, report.triangulations) == (len(DISSECTIONS), 0)
    assert report.dissections == sum(case(name).incidence.shape[1] for name in DISSECTIONS) > 1500
    assert report.violated > 10
    assert f"ok           {RULES['dissections']}" in report.summary
    assert f"0 triangulations and {report.dissections} dissections" in report.summary


class NoCrossings(Separator):
    """Right for triangulations; wrong to say that dissections have no simplices that merely cross, either."""

    name = "no-crossings"
    dissections = True

    def separate(self, point: FractionalPoint) -> Iterator[Cut]:
        columns = point.support
        crossing = crossing_matrix(self.problem.chirotope, self.problem.simplices[columns])
        for i, j in zip(*np.triu(crossing).nonzero(), strict=True):
            if point.x[columns[i]] + point.x[columns[j]] > 1.001:
                yield Cut([int(columns[i]), int(columns[j])], 1)


def test_cuts_that_only_triangulations_satisfy_are_refused_for_dissections() -> None:
    report = check_separator(NoCrossings, (*FEW, *DISSECTIONS))
    assert broken(report) == {"dissections"}
    assert f"FAILED       {RULES['dissections']}" in report.summary
    assert f"ok           {RULES['valid']}" in report.summary
    assert len(report.invalid_cuts) == len(report.failures) == 5
    for invalid in report.invalid_cuts:
        assert invalid.dissection
        assert (invalid.left, invalid.rhs) == (2, 1)
        assert f"{invalid.cut} cuts off a dissection" in report.summary
        points = load_instance(invalid.instance.partition(" ")[0]).scalars()
        check_dissection(points, invalid.solution)
        with pytest.raises(VerificationError):
            check_triangulation(points, invalid.solution)


@pytest.mark.parametrize("name", DISSECTIONS, ids=str)
def test_every_case_of_dissections_tells_crossing_from_overlapping(name: CaseName) -> None:
    assert broken(check_separator(NoCrossings, [name])) == {"dissections"}


def test_families_for_triangulations_are_not_asked_about_dissections() -> None:
    class ForTriangulations(NoCrossings):
        dissections = False

    report = check_separator(ForTriangulations, (FEW[1], *DISSECTIONS))
    assert report.ok, report.summary
    assert report.configurations == 1
    assert report.dissections is None
    assert "dissection" not in report.summary


def test_a_check_without_dissections_says_that_they_were_not_tested() -> None:
    report = check_separator(NoCrossings, FEW[:2])
    assert report.ok
    assert report.dissections == 0
    assert "as declared, was not tested" in report.summary


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


def test_the_template_is_a_separator_that_passes(tmp_path: Path) -> None:
    path = write_template("two-words", tmp_path)
    assert path == tmp_path / "two_words.py"
    separator = resolve(f"{path}:max_cuts=3")
    assert separator.name == "two-words"
    assert type(separator).__name__ == "TwoWords"
    report = check_separator(lambda: resolve(str(path)), FEW)
    assert report.ok, report.summary
    assert report.violated > 0


def test_the_template_never_overwrites(tmp_path: Path) -> None:
    path = write_template("mine", tmp_path)
    path.write_text("precious")
    with pytest.raises(InputError, match="exists already"):
        write_template("mine", tmp_path)
    assert path.read_text() == "precious"
    with pytest.raises(InputError, match="cannot be written"):
        write_template("mine", tmp_path / "nowhere")


@pytest.mark.parametrize(
    "name", ["", "Mine", "two words", "-x", "x-", "clique", "odd-cycle", "../x", "x_y", "9x"]
)
def test_the_template_refuses_names(name: str) -> None:
    with pytest.raises(InputError, match="separator name"):
        template(name)

"""The contract suite: small mistakes in cuts are caught, for triangulations and for dissections."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from contract import FEW, broken

from bcut.errors import VerificationError
from bcut.geometry.crossings import crossing_matrix
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.separation.cases import CASES, CaseName, case
from bcut.separation.check import RULES, check_separator
from bcut.separation.resolve import built_in_names, resolve
from bcut.separation.seam import Cut, FractionalPoint, Separator
from bcut.separators.clique import Clique
from bcut.separators.convex_polygon import ConvexPolygon
from bcut.separators.odd_cycle import OddCycle
from bcut.verification.dissection import check_dissection
from bcut.verification.triangulation import check_triangulation

DISSECTIONS = tuple(name for name in CASES if name.dissection)
FOR_DISSECTIONS = [name for name in built_in_names() if resolve(name).dissections]


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

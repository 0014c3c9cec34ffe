"""Branching over orbits of faces: parts, their bounds, and the proofs that certificates hold."""

from __future__ import annotations

import copy
import json
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import combinations, permutations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bcut
from bcut.bounds import averaged_root as loop
from bcut.bounds.averaged import AveragedPart
from bcut.bounds.averaged_root import averaged_root
from bcut.errors import ResultError, VerificationError
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.generic_point import simplices_containing_generic_point
from bcut.geometry.permutations import PermutationGroup
from bcut.solving import by_orbits, orbit_branching
from bcut.solving.certificates import case_data
from bcut.solving.orbit_branching import (
    Branching,
    Case,
    branch_over_faces,
    undecided_faces,
    with_face,
    without_face,
)
from bcut.solving.orbit_stage import OrbitStage, orbit_stage
from bcut.solving.search import Part, Search
from bcut.verification import case_split, certificate_reading

Data = dict[str, Any]


@pytest.fixture(autouse=True)
def little_time_for_the_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    # Whatever it achieves before faces are branched over, every second of it is spent here in vain.
    monkeypatch.setattr(by_orbits, "_SECONDS_FOR_SMALL", 0.3)


def pyritohedron() -> bcut.PointConfiguration:
    """Return a dodecahedron that has rational vertices and planar faces: its largest root LP is 45, its maximum 44."""
    h = Fraction(1, 2)
    points = [[x, y, z] for x in (1, -1) for y in (1, -1) for z in (1, -1)]
    for a in (1 + h, -1 - h):
        for b in (1 - h * h, h * h - 1):
            points += [[0, a, b], [a, b, 0], [b, 0, a]]  # type: ignore[list-item]
    return bcut.PointConfiguration.from_values(points, name="pyritohedron")


def part_of(stage: OrbitStage, target: Fraction) -> AveragedPart:
    formulation, objective = stage.residual(target)
    signs = Chirotope.of(stage.configuration)
    columns = np.arange(len(formulation.simplices))
    return AveragedPart(replace(formulation, chirotope=signs), objective, stage.flag, stage.group, columns)


def whole_of(name: str, sense: str, *, spanning: bool = False) -> AveragedPart:
    stage = orbit_stage(bcut.load_instance(name), sense=sense, spanning=spanning)
    return part_of(stage, stage.target_for(10**6))


def lp_of(part: AveragedPart) -> float | None:
    return part.relaxed([], "simplex").lp


def all_cases(case: Case) -> Iterator[Case]:
    yield case
    if case.split is not None:
        yield from all_cases(case.split.chosen)
        yield from all_cases(case.split.excluded)


@pytest.mark.parametrize(
    ("name", "spanning"),
    [("cuboctahedron", False), ("grid:3,2,2", True), ("cube:4", False), ("prism:6", False)],
)
@pytest.mark.parametrize("sense", ["min", "max"])
def test_parts_have_the_bounds_of_the_same_questions_without_symmetries(
    name: str, spanning: bool, sense: str
) -> None:
    whole = whole_of(name, sense, spanning=spanning)
    face = undecided_faces(whole, None)[-1]
    images = [image.tolist() for image in whole.group.orbit(face)]
    ways: list[tuple[AveragedPart, Data]] = [
        (whole, {}),
        (with_face(whole, face), {"require": [face]}),
        (without_face(whole, face), {"forbid": images}),
        (without_face(with_face(whole, face), images[-1]), {}),
    ]
    inner = ways[2][0].group if len(images) == 1 else with_face(whole, face).group
    again = [image.tolist() for image in inner.orbit(images[-1])]
    if tuple(images[-1]) != face:
        ways[3] = (ways[3][0], {"require": [face], "forbid": again})
    else:
        ways.pop()
    for part, restrictions in ways:
        listed = bcut.bound(
            name, sense=sense, spanning=spanning, separators=[], method="listing", **restrictions
        )
        if listed.root.lp is None:
            assert lp_of(part) is None
        else:
            assert lp_of(part) == pytest.approx(listed.root.lp, abs=1e-6)


def test_the_symmetries_of_a_part_take_its_face_to_itself() -> None:
    whole = whole_of("cuboctahedron", "min")
    for face in undecided_faces(whole, None):
        part = with_face(whole, face)
        assert part.group.order * len(whole.group.orbit(face)) == whole.group.order == 48
        assert all(sorted(generator[list(face)]) == list(face) for generator in part.group.generators)


@pytest.mark.parametrize(
    ("name", "sense", "best"),
    [
        ("cuboctahedron", "max", 17),
        ("cuboctahedron", "min", 13),
        ("dodecahedron", "min", 23),
        ("cube:4", "max", 24),
    ],
)
def test_the_optimum_is_found_and_nothing_beyond_it(name: str, sense: str, best: int) -> None:
    stage = orbit_stage(bcut.load_instance(name), sense=sense)
    sign = stage.objective.sign
    part = part_of(stage, Fraction(sign * best))
    found = branch_over_faces(part, Fraction(sign * best), separating=False)
    assert found.status == "found"
    assert found.columns is not None
    assert part.objective.value(found.columns) == best
    # Just beyond the optimum, all other simplices stay: the relaxation alone does not tell.
    beyond = branch_over_faces(part, sign * best - Fraction(1, 10), separating=False)
    assert (beyond.status, beyond.columns) == ("refuted", None)
    assert beyond.case is not None


@cache
def refuted(separating: bool) -> tuple[OrbitStage, Branching]:
    """Refute 22.9 for the dodecahedron, whose root LP is 22.5."""
    stage = orbit_stage(bcut.load_instance("dodecahedron"))
    target = Fraction(229, 10)
    return stage, branch_over_faces(part_of(stage, target), target, separating=separating)


def test_link_cuts_need_no_cases_where_the_relaxation_alone_does() -> None:
    _, alone = refuted(False)
    _, cut = refuted(True)
    assert alone.case is not None
    assert cut.case is not None
    assert alone.parts > cut.parts == 1
    assert cut.case.split is None
    assert any(stage.cuts for stage in cut.case.stages)
    assert not any(stage.cuts for case in all_cases(alone.case) for stage in case.stages)


def test_no_time_leaves_it_open() -> None:
    stage, _ = refuted(False)
    found = branch_over_faces(part_of(stage, Fraction(23)), Fraction(23), seconds=lambda: 0.0)
    assert (found.status, found.case, found.columns) == ("limit", None, None)


def test_the_time_may_end_between_parts() -> None:
    stage, _ = refuted(False)
    end = time.monotonic() + 3600
    parts: list[int] = []

    def seconds() -> float:
        return end - time.monotonic() if len(parts) < 2 else 0.0

    target = Fraction(229, 10)
    found = branch_over_faces(
        part_of(stage, target), target, separating=False, seconds=seconds, on_part=parts.append
    )
    assert (found.status, found.case, parts) == ("limit", None, [1, 2, 3])


def test_a_proof_that_nobody_would_read_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    stage, _ = refuted(False)
    monkeypatch.setattr(orbit_branching, "MAX_DEPTH", 0)
    target = Fraction(229, 10)
    found = branch_over_faces(part_of(stage, target), target, separating=False)
    assert (found.status, found.parts) == ("limit", 1)


def test_a_part_without_simplices_over_the_generic_point_is_refuted_exactly() -> None:
    whole = replace(whole_of("cuboctahedron", "max"), group=PermutationGroup.trivial(12))
    covering = simplices_containing_generic_point(whole.whole.chirotope, whole.simplices, whole.flag)
    for part in (
        whole.restricted_to(~covering),
        whole.restricted_to(np.zeros(len(whole.columns), dtype=bool)),
    ):
        root = averaged_root(part, Fraction(-17))
        assert root.status == "refuted"
        assert root.stages[-1].bound.value > -17


def test_many_orbits_are_bounded_by_interior_points(monkeypatch: pytest.MonkeyPatch) -> None:
    stage, branching = refuted(False)
    monkeypatch.setattr(loop, "_INTERIOR_FROM", 1)
    target = Fraction(229, 10)
    inside = branch_over_faces(part_of(stage, target), target, separating=False)
    assert inside.status == branching.status == "refuted"
    assert branch_over_faces(part_of(stage, Fraction(23)), Fraction(23)).status == "found"


def test_a_point_of_columns_that_have_been_given_up_is_no_triangulation(tmp_path: Path) -> None:
    """Just above the target, an exact bound may give up the very columns that the relaxation's point consists of."""
    near, far, inner, crossing = 5e-12, 8e-12, 5e-12, 7e-12
    table: list[Any] = []
    for simplex in combinations(range(6), 3):
        steps = {(b - a) % 5 for a, b in permutations([v for v in simplex if v < 5], 2)}
        if simplex[-1] == 5:
            table.append([simplex, inner if steps == {1, 4} else crossing])
        else:
            table.append(
                [
                    simplex,
                    near
                    if (simplex[1] - simplex[0], simplex[2] - simplex[1]) in ((1, 1), (1, 3), (3, 1))
                    else far,
                ]
            )
    file = tmp_path / "costs.json"
    file.write_text(json.dumps({"costs": table}))
    result = bcut.solve("polygon:5,center", objective=f"costs:{file}", method="orbits")
    assert (result.status, result.value) == ("optimal", pytest.approx(near + near + far, rel=1e-9))
    assert bcut.verify(result).value == Fraction(near) + Fraction(near) + Fraction(far)


@cache
def solved() -> bcut.Result:
    return bcut.solve(pyritohedron(), sense="max", method="orbits", separators=[])


def test_a_gap_of_a_whole_unit_is_closed_exactly_by_cases() -> None:
    result = solved()
    assert (result.status, result.value) == ("optimal", 44)
    assert result.root.lp_after_cuts == pytest.approx(45)
    refutes = result.certificate.refutes
    assert refutes is not None
    assert refutes["target"] == "45"
    assert "face" in refutes["case"]
    verification = bcut.verify(result)
    assert verification.proven_optimal
    assert any("no triangulation reaches 45" in check for check in verification.checks)


def test_what_has_too_many_signs_is_left_to_the_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(by_orbits, "_MOST_SIGNS", 10)
    monkeypatch.setattr(by_orbits, "_SECONDS_FOR_SMALL", 0.0)
    result = bcut.solve("cuboctahedron", method="orbits", separators=[])
    assert (result.status, result.value) == ("optimal", 13)
    assert "faces" not in result.seconds


def test_faces_decide_what_the_solver_has_no_time_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(by_orbits, "_SECONDS_FOR_SMALL", 0.0)
    result = bcut.solve(pyritohedron(), sense="max", method="orbits", separators=[])
    assert (result.status, result.value) == ("optimal", 44)
    assert result.nodes > 1
    assert result.seconds["faces"] > 0
    assert bcut.verify(result).proven_optimal


@pytest.mark.parametrize("seconds", [60.0, 0.0])
def test_what_the_solver_refutes_gets_a_proof_if_there_is_time(
    seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Fraction] = []
    branch = by_orbits._branch

    def refute_first(search: Search, part: Part, cutoff: Fraction, *, seconds: float | None = None) -> str:
        asked.append(cutoff)
        return "infeasible" if len(asked) == 1 else branch(search, part, cutoff, seconds=seconds)

    monkeypatch.setattr(by_orbits, "_branch", refute_first)
    monkeypatch.setattr(by_orbits, "_SECONDS_FOR_PROOF", seconds)
    result = bcut.solve(pyritohedron(), sense="max", method="orbits", separators=[])
    assert (result.status, result.value) == ("optimal", 44)
    verification = bcut.verify(result)
    assert verification.proven_optimal == (seconds > 0)
    assert verification.statement.endswith("optimality rests on the solver's tree") == (seconds == 0)


def tampered(change: Callable[[Data], None], data: Data | None = None) -> Data:
    data = copy.deepcopy(solved().to_dict() if data is None else data)
    change(data["certificate"]["refutes"])
    return data


def leaves(case: Data) -> Iterator[Data]:
    if "face" in case:
        yield from leaves(case["chosen"])
        yield from leaves(case["excluded"])
    else:
        yield case


def drop_a_case(refutes: Data) -> None:
    next(leaves(refutes["case"]))["stages"] = []


def take_another_face(refutes: Data) -> None:
    refutes["case"]["face"] = [0]


def take_no_face(refutes: Data) -> None:
    refutes["case"]["face"] = []


def take_a_face_that_is_none(refutes: Data) -> None:
    refutes["case"]["face"] = [0, 99]


def go_too_far(refutes: Data) -> None:
    refutes["target"] = "44"


def change_multipliers(refutes: Data) -> None:
    for leaf in leaves(refutes["case"]):
        for row in leaf["stages"][-1]["multipliers"][:2]:
            row[1] = str(Fraction(row[1]) + 3)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (drop_a_case, r"no triangulation reaches 45, but .* proves nothing"),
        (take_another_face, r"case\.chosen, stage 0: .* has a multiplier already|sides of"),
        (take_no_face, "is no set of 1 to 4 of the 20 points"),
        (take_a_face_that_is_none, "is no set of 1 to 4 of the 20 points"),
        (go_too_far, "no triangulation reaches 44, but .* proves"),
        (change_multipliers, "proves the bound .* only"),
    ],
)
def test_tampering_is_refused(change: Callable[[Data], None], reason: str) -> None:
    with pytest.raises(VerificationError, match=reason):
        bcut.verify(tampered(change))


def with_cuts() -> Data:
    """Return the dodecahedron's minimum with a proof, by averaged cuts, that there is none below 22.9."""
    branching = refuted(True)[1]
    data = bcut.bound("dodecahedron", method="orbits", separators=[]).to_dict()
    assert branching.case is not None
    data["certificate"]["refutes"] = {"target": "229/10", "case": case_data(branching.case)}
    return data


def last_cuts(refutes: Data) -> list[Data]:
    cuts: list[Data] = refutes["case"]["stages"][-1]["cuts"]
    return cuts


def strengthen_a_cut(refutes: Data) -> None:
    last_cuts(refutes)[0]["rhs"] = -1


def drop_cuts(refutes: Data) -> None:
    refutes["case"]["stages"][-1]["cuts"] = []


def take_a_group_that_is_none(refutes: Data) -> None:
    last_cuts(refutes)[0]["group"] = 1


def rename_a_cut(refutes: Data) -> None:
    last_cuts(refutes)[0]["family"] = "guess"


def test_averaged_cuts_of_a_case_are_checked() -> None:
    assert any("no triangulation reaches 229/10" in check for check in bcut.verify(with_cuts()).checks)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (strengthen_a_cut, r"case, stage \d: cut 0 .* is not valid"),
        (drop_cuts, "proves the bound .* only"),
        (take_a_group_that_is_none, "a group that is none of the 1 there are"),
    ],
)
def test_tampered_cuts_are_refused(change: Callable[[Data], None], reason: str) -> None:
    with pytest.raises(VerificationError, match=reason):
        bcut.verify(tampered(change, with_cuts()))


def test_unknown_cuts_leave_the_refutation_unchecked() -> None:
    verification = bcut.verify(tampered(rename_a_cut, with_cuts()))
    assert verification.exact_bound == pytest.approx(22.5)


def test_a_group_too_large_to_list_leaves_the_refutation_unchecked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(case_split, "MAX_ELEMENTS", 20)
    assert not bcut.verify(solved()).proven_optimal


def test_malformed_cases_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for change, where in (
        (lambda refutes: refutes.update(case=3), r"refutes\.case"),
        (lambda refutes: refutes["case"].update(stages=3), r"refutes\.case\.stages"),
        (lambda refutes: refutes["case"].pop("excluded"), r"refutes\.case\.excluded"),
    ):
        with pytest.raises(ResultError, match=where):
            bcut.verify(tampered(change))
    monkeypatch.setattr(certificate_reading, "MAX_DEPTH", 0)
    with pytest.raises(ResultError, match="at most 0 within each other"):
        bcut.verify(solved())


def test_cases_need_symmetries_and_symmetries_cases() -> None:
    def without_symmetries(data: Data) -> Data:
        listed = bcut.bound(pyritohedron(), sense="max", method="listing", separators=[]).to_dict()
        listed["certificate"]["refutes"] = data["certificate"]["refutes"]
        return listed

    def in_stages(refutes: Data) -> None:
        refutes["stages"] = []
        del refutes["case"]

    with pytest.raises(VerificationError, match="splits cases by symmetries, but has none"):
        bcut.verify(without_symmetries(solved().to_dict()))
    with pytest.raises(VerificationError, match="has symmetries, but its refutation does not use them"):
        bcut.verify(tampered(in_stages))


@cache
def settled() -> str:
    """Return the kept result of the rhombicuboctahedron's maximum, whose proof has cuts of all groups on the way."""
    return (Path(__file__).parent.parent / "instances/results/rhombicuboctahedron-max.json").read_text()


def inherited(refutes: Data) -> list[Data]:
    """Return cuts that are averaged over more symmetries than their case has."""
    case, found = refutes["case"], []
    for depth in range(1, 20):
        if "face" not in case:
            break
        case = case["chosen"]
        found += [cut for stage in case["stages"] for cut in stage["cuts"] if cut["group"] < depth]
    return found


def test_a_maximum_that_needs_cases_within_cases_is_proven_from_its_file() -> None:
    data = json.loads(settled())
    assert {cut["group"] for cut in inherited(data["certificate"]["refutes"])} >= {0, 1}
    verification = bcut.verify(data)
    assert (verification.value, verification.rounded_bound) == (56, 56)
    assert verification.proven_optimal


def test_inherited_cuts_stand_for_the_mean_over_their_own_group() -> None:
    def take_the_group_of_the_case(refutes: Data) -> None:
        for cut in inherited(refutes):
            cut["group"] += 1

    with pytest.raises(VerificationError, match=r"proves the bound .* only|is not valid"):
        bcut.verify(tampered(take_the_group_of_the_case, json.loads(settled())))

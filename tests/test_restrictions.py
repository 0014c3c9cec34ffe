"""Required and forbidden faces and stars: the same as filtering all triangulations; contradictions are proven."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from reference import configuration_or_none

import bcut
from bcut.cli.main import run
from bcut.errors import InputError, VerificationError
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.restrictions import Restrictions
from bcut.geometry.simplices import candidate_simplices
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.solving.programs import make_formulation
from bcut.verification.cut_data import Candidates
from bcut.verification.exact_points import ExactPoints
from bcut.verification.restrictions import RestrictionData
from bcut.verification.verify import verify

Face = tuple[int, ...]


def listed(configuration: PointConfiguration, spanning: bool) -> list[set[Face]]:
    """All triangulations, each as the set of all its faces."""
    chirotope = Chirotope.of(configuration)
    simplices = candidate_simplices(chirotope, spanning=spanning).tolist()
    found = []
    for chosen in triangulations(chirotope, spanning=spanning):
        faces: set[Face] = set()
        for column in chosen:
            for size in range(1, configuration.dimension + 2):
                faces.update(combinations(simplices[column], size))
        found.append(faces)
    return found


def satisfying(
    every: list[set[Face]], dimension: int, require: list[Face], forbid: list[Face], star: int | None
) -> list[int]:
    """Sizes of the triangulations that have what is required and nothing that is forbidden."""
    sizes = []
    for faces in every:
        simplices = [face for face in faces if len(face) == dimension + 1]
        if (
            all(face in faces for face in require)
            and not any(face in faces for face in forbid)
            and (star is None or all(star in simplex for simplex in simplices))
        ):
            sizes.append(len(simplices))
    return sizes


CASES: list[tuple[str, bool, dict[str, Any]]] = [
    ("cube:3", False, {"require": [(0, 7)]}),
    ("cube:3", False, {"require": [(0, 3), (0, 5)], "forbid": [(0, 7)]}),
    ("cube:3", False, {"forbid": [(0, 3, 5, 6), (1, 2, 4, 7)]}),
    ("cube:3", False, {"star": 3}),
    ("cube:3", False, {"require": [(0, 1, 2, 4)]}),
    ("grid:3,3", False, {"require": [(4,)]}),
    ("grid:3,3", False, {"forbid": [(4,), (1,), (3,)]}),
    ("grid:3,3", True, {"require": [(0, 4), (2, 4)], "forbid": [(4, 6)]}),
    ("grid:3,3", False, {"require": [(0, 2)]}),
    ("grid:3,3", False, {"star": 4}),
    ("random:8,3,seed=1", False, {"require": [(0, 1, 2)]}),
    ("random:8,2,seed=1", False, {"star": 2, "forbid": [(0, 1)]}),
    ("polygon:5,center", False, {"forbid": [(5,)]}),
    ("random:7,4,seed=1", False, {"forbid": [(0, 1)]}),
]


@pytest.mark.parametrize("sense", ["min", "max"])
@pytest.mark.parametrize(("instance", "spanning", "asked"), CASES, ids=str)
def test_optima_among_those_that_satisfy(
    instance: str, spanning: bool, asked: dict[str, Any], sense: str
) -> None:
    configuration = load_instance(instance)
    sizes = satisfying(
        listed(configuration, spanning),
        configuration.dimension,
        asked.get("require", []),
        asked.get("forbid", []),
        asked.get("star"),
    )
    result = bcut.solve(instance, spanning=spanning, sense=sense, **asked)
    if not sizes:
        assert result.status == "infeasible"
        assert result.triangulation is None
        assert verify(result).statement.startswith("infeasible, proven exactly")
        return
    assert result.status == "optimal"
    assert result.value == (min(sizes) if sense == "min" else max(sizes))
    assert verify(result).value == result.value
    assert "they have the faces that are required, and none that is forbidden" in verify(result).checks


@pytest.mark.parametrize("name", ["0", "1", "chambers"])
def test_every_formulation_takes_restrictions(name: str) -> None:
    options: dict[str, Any] = {"require": [(0, 3), (0, 5)], "forbid": [(0, 7)], "sense": "max"}
    assert bcut.solve("cube:3", formulation=name, **options).value == bcut.solve("cube:3", **options).value
    assert bcut.solve("cube:3", formulation=name, require=[(0, 7), (1, 6)]).status == "infeasible"


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
@given(
    st.integers(2, 3).flatmap(
        lambda d: st.lists(
            st.lists(st.integers(0, 2), min_size=d, max_size=d), min_size=d + 2, max_size=7, unique_by=tuple
        )
    ),
    st.booleans(),
    st.data(),
)
def test_a_face_is_there_unless_something_meets_it_improperly(
    values: list[list[int]], spanning: bool, data: st.DataObject
) -> None:
    """The theorem of `bcut.geometry.restrictions`, for random faces of random degenerate points."""
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    assert configuration is not None
    chirotope = Chirotope.of(configuration)
    simplex = data.draw(st.sampled_from(chirotope.bases.tolist()))
    size = data.draw(st.integers(1, configuration.dimension + 1))
    face = tuple(sorted(data.draw(st.permutations(simplex))[:size]))
    simplices = candidate_simplices(chirotope, spanning=spanning)
    every = listed(configuration, spanning)
    own = RestrictionData(require=(face,))
    sides = Candidates(ExactPoints(configuration.scalars()), restrictions=own)
    for asked in ({"require": [face]}, {"forbid": [face]}, {"star": face[0]}):
        restrictions = Restrictions.of(configuration, **asked)
        allowed = restrictions.allowed(configuration, chirotope, simplices)
        kept = {tuple(row) for row in simplices[allowed].tolist()}
        if "require" in asked:
            # Verification decides the same by circuits of its own.
            assert kept == {tuple(row) for row in simplices.tolist() if tuple(row) in sides}
        for faces in every:
            chosen = {f for f in faces if len(f) == configuration.dimension + 1}
            wanted = {
                "require": face in faces,
                "forbid": face not in faces,
                "star": all(face[0] in f for f in chosen),
            }[next(iter(asked))]
            assert (chosen <= kept) == wanted


def test_infeasible_without_a_proof_by_the_relaxation() -> None:
    """Whatever the relaxation allows, "infeasible" is the answer where no triangulation is left."""
    configuration = load_instance("polygon:5,center")
    chirotope = Chirotope.of(configuration)
    half = [(1, 2, 3), (2, 3, 4), (0, 3, 4), (0, 1, 4), (0, 1, 2)]
    half += [(0, 2, 5), (1, 3, 5), (2, 4, 5), (0, 3, 5), (1, 4, 5)]
    others = [s for s in map(tuple, chirotope.bases.tolist()) if s not in half]
    assert not satisfying(listed(configuration, False), 2, [], others, None)
    result = bcut.solve(configuration, forbid=others)
    assert result.status == "infeasible"
    assert result.certificate.reason == "that there is no triangulation rests on the solver's tree"
    assert verify(result).statement == "infeasible according to the solver: its proof is not in this file"
    assert bcut.solve(configuration, forbid=others, method="scip").status == "infeasible"
    assert bcut.solve(configuration, forbid=others, formulation="0").status == "infeasible"
    assert bcut.solve(configuration, forbid=others, objective="random-costs:1").status == "infeasible"


def test_bounds_of_contradictions() -> None:
    assert bcut.bound("cube:3", require=[(0, 7), (1, 6)]).status == "infeasible"
    assert bcut.bound("cube:3", require=[(0, 7)]).bound == 6


def test_nothing_is_left() -> None:
    result = bcut.solve("hypersimplex:3,1", forbid=[(0,)])
    assert (result.status, result.size.columns) == ("infeasible", 0)
    assert verify(result).statement.startswith("infeasible, proven exactly")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"require": [[0, 1, 2, 4], [0, 7]]}, "requires the face .0, 1, 2, 4."),
        ({"forbid": [[0, 7]]}, "forbids the face .0, 7."),
        ({"star": 1}, "asks for a star of point 1"),
        ({"require": [[0, 9]]}, "which is no set of 1 to 4 of the 8 points"),
    ],
)
def test_verification_refuses_what_does_not_satisfy(change: dict[str, Any], message: str) -> None:
    data = bcut.solve("cube:3", require=[(0, 7)]).to_dict()
    assert verify(data).proven_optimal
    data["problem"].update(change)
    with pytest.raises(VerificationError, match=message):
        verify(data)


def test_verification_refuses_a_bound_of_fewer_candidates() -> None:
    """The bound 6 holds for triangulations with the diagonal, not for all."""
    data = bcut.solve("cube:3", require=[(0, 7)]).to_dict()
    data["problem"]["require"] = []
    with pytest.raises(VerificationError, match="multipliers prove"):
        verify(data)


def test_verification_refuses_false_proofs_of_infeasibility() -> None:
    data = bcut.solve("cube:3", require=[(0, 7), (1, 6)]).to_dict()
    assert verify(data).statement.startswith("infeasible, proven exactly")
    with pytest.raises(VerificationError):
        verify({**data, "problem": {**data["problem"], "require": [[0, 7]]}})
    with pytest.raises(VerificationError, match="every point configuration has"):
        verify({**data, "problem": {**data["problem"], "require": []}})
    weak = {**data["certificate"], "multipliers": [["coverage", "0"]], "bound": "0"}
    with pytest.raises(VerificationError, match="proves nothing"):
        verify({**data, "certificate": weak})
    with pytest.raises(VerificationError, match="the rest of the result does not"):
        verify({**data, "status": "limit"})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--require", "0,99"], "there is no point 99; points are numbered from 0 to 7"),
        (["--forbid", "-1"], "there is no point -1"),
        (["--require", "zero"], "'zero' is no list of points such as 0,1,4"),
        (["--require", "0,1,"], "is no list of points"),
        (["--forbid", "0,0"], "a face has from 1 to 4 different points"),
        (["--require", "0,1,2,3,4"], "a face has from 1 to 4 different points"),
        (["--require", "0,1,2,3"], "affinely dependent"),
        (["--star", "8"], "there is no point 8"),
        (["--require", "0,1", "--method", "orbits"], "use the method listing"),
        (["--require", "0,1", "--dissection"], "only simplices with 4 points can be required"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_bad_faces_are_refused(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["solve", "cube:3", *arguments]) == 2
    captured = capsys.readouterr()
    assert message in " ".join(captured.err.split())
    assert not captured.out


def test_the_command_line_takes_restrictions(capsys: pytest.CaptureFixture[str], tmp_path: Any) -> None:
    file = tmp_path / "result.json"
    arguments = ["--require", "0,7", "--require", "0,3", "--forbid", "1,7", "--star", "0"]
    assert run(["solve", "cube:3", *arguments, "--output", str(file)]) == 0
    assert run(["verify", str(file)]) == 0
    assert "they have the faces that are required" in capsys.readouterr().out
    assert run(["solve", "cube:3", "--require", "0,7", "--forbid", "0,7", "--output", str(file)]) == 0
    assert "infeasible" in capsys.readouterr().out
    assert run(["verify", str(file)]) == 0
    assert "infeasible, proven exactly" in capsys.readouterr().out


def test_required_simplices_of_dissections() -> None:
    simplex = (0, 3, 5, 6)
    result = bcut.solve("cube:3", dissection=True, require=[simplex])
    assert result.triangulation is not None
    assert list(simplex) in result.triangulation
    assert verify(result).value == 5
    formulation = make_formulation("chambers", load_instance("cube:3"), dissection=True)
    assert formulation.size[0] == len(np.unique(formulation.simplices, axis=0))
    with pytest.raises(InputError, match="can be required of it"):
        bcut.solve("cube:3", dissection=True, require=[(0, 3)])


@pytest.mark.parametrize("instance", ["random:7,2,seed=3", "random:6,3,seed=1", "polygon:6"])
def test_required_faces_of_dissections_in_general_position(instance: str) -> None:
    """There every dissection is a triangulation, so faces of all dimensions mean what they mean elsewhere."""
    configuration = load_instance(instance)
    for size in range(1, configuration.dimension + 1):
        for face in list(combinations(range(configuration.n), size))[::3]:
            wanted = bcut.solve(configuration, require=[face], objective="random-costs:1")
            found = bcut.solve(configuration, require=[face], objective="random-costs:1", dissection=True)
            assert (found.status, found.value) == (wanted.status, wanted.value), face
            if found.triangulation is not None:
                checked = verify(found)
                assert found.value is not None
                assert checked.exact_bound is not None
                assert checked.exact_bound <= found.value


def test_faces_of_dissections_say_nothing_to_a_verifier_in_degenerate_position() -> None:
    """A simplex may cross a required edge of another one there, so no candidate may be left out for it."""
    for instance, general in (("cube:3", False), ("random:6,3,seed=1", True)):
        sides = Candidates(ExactPoints(load_instance(instance).scalars()), spanning=False)
        assert sides.is_general is general
        candidates = [
            simplex for simplex in combinations(range(sides.points.n), 4) if sides.orientation(simplex)
        ]
        restrictions = RestrictionData(require=((1, 4),), dissection=True)
        as_triangulation = RestrictionData(require=((1, 4),))
        admitted = [restrictions.admit(sides, simplex) for simplex in candidates]
        elsewhere = [as_triangulation.admit(sides, simplex) for simplex in candidates]
        assert not all(elsewhere)
        assert admitted == (elsewhere if general else [True] * len(candidates))

"""Regions inside closed surfaces: what can be triangulated, what cannot, and proofs of both."""

from __future__ import annotations

import copy
import json
from fractions import Fraction
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

import bcut
from bcut.bounds.proof_tree import Branch, ExactProgram, least
from bcut.cli.main import run
from bcut.errors import BcutError, InputError, ResultError, SurfaceError, TooLargeError, VerificationError
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.surface import Region
from bcut.instance import load_instance
from bcut.solving.region import RegionResult, load_surface, region
from bcut.verification.surface import SurfaceCheck

Captured = pytest.CaptureFixture[str]
Faces = list[list[int]]

CUBE = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
# Each square is divided by a diagonal between two of the vertices 0, 3, 5, 6.
EVEN: Faces = [
    *([0, 3, 2], [0, 1, 3], [4, 6, 5], [6, 7, 5], [0, 5, 1], [0, 4, 5]),
    *([2, 3, 6], [3, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 3], [3, 5, 7]),
]


def boundary(tetrahedra: list[list[int]], points: list[list[int]]) -> Faces:
    """Outward triangles of a union of tetrahedra that meet face to face."""
    once: dict[tuple[int, ...], list[int]] = {}
    for tetrahedron in tetrahedra:
        for apex in tetrahedron:
            a, b, c = (vertex for vertex in tetrahedron if vertex != apex)
            rows = np.array([points[v] for v in (b, c, apex)]) - np.array(points[a])
            face = [a, b, c] if np.linalg.det(rows.astype(float)) < 0 else [a, c, b]
            key = tuple(sorted(face))
            if once.pop(key, None) is None:
                once[key] = face
    return list(once.values())


def l_prism(*, turning: bool) -> tuple[list[list[int]], Faces]:
    """A prism over an L; the diagonals of its sides begin at the lower number, or all turn the same way."""
    outline = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    points = [[x, y, z] for z in (0, 1) for x, y in outline]
    base = [(0, 1, 3), (1, 2, 3), (0, 3, 5), (3, 4, 5)]
    faces = [[a, c, b] for a, b, c in base] + [[a + 6, b + 6, c + 6] for a, b, c in base]
    for k in range(6):
        after = (k + 1) % 6
        if turning or k < after:
            faces += [[k, after, after + 6], [k, after + 6, k + 6]]
        else:
            faces += [[k, after, k + 6], [after, after + 6, k + 6]]
    return points, faces


def star(n: int, seed: int) -> tuple[list[list[int]], Faces]:
    """A random polyhedron that is star-shaped, with integer vertices; seldom convex."""
    from scipy.spatial import ConvexHull

    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(n, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    hull = ConvexHull(directions)
    faces = []
    for (a, b, c), normal in zip(hull.simplices.tolist(), hull.equations[:, :3], strict=True):
        outward = np.cross(directions[b] - directions[a], directions[c] - directions[a]) @ normal > 0
        faces.append([a, b, c] if outward else [a, c, b])
    radii = rng.uniform(20, 60, size=(n, 1))
    return np.rint(directions * radii).astype(int).tolist(), faces


def brute_force(points: Any, faces: Faces) -> tuple[Fraction, int | None]:
    """The largest volume that tetrahedra can cover, and the least size of a triangulation, from all sets of them."""
    check = SurfaceCheck([[Fraction(x) for x in point] for point in points], list(map(tuple, faces)))
    check.check()
    inside = [t for t in combinations(range(len(points)), 4) if check.fits(t)]
    sizes = [check.points.volume(t) for t in inside]
    free = [[not check.sides.crossing(s, t) for t in inside] for s in inside]
    best, fewest, whole = 0, None, check.volume()

    def extend(chosen: list[int], volume: int, rest: list[int]) -> None:
        nonlocal best, fewest
        best = max(best, volume)
        if volume == whole:
            fewest = len(chosen) if fewest is None else min(fewest, len(chosen))
        for place, column in enumerate(rest):
            extend(
                [*chosen, column],
                volume + sizes[column],
                [other for other in rest[place + 1 :] if free[column][other]],
            )

    extend([], 0, list(range(len(inside))))
    return best * check.points.volume_unit, fewest


def settled(found: RegionResult) -> RegionResult:
    verification = bcut.verify(found)
    assert verification.proven_optimal
    assert found.status in ("optimal", "infeasible")
    assert verification.statement.startswith("triangulable" if found.status == "optimal" else "infeasible")
    return found


@pytest.mark.parametrize("name", ["schoenhardt", "twisted-prism:3,twist=10", "twisted-prism:3,seed=4"])
def test_schoenhardt_has_no_triangulation_and_nothing_of_it_can_be_covered(name: str) -> None:
    found = settled(bcut.region(name))
    assert (found.status, found.covered, found.triangulation) == ("infeasible", "0", [])
    assert found.tetrahedra == 0
    assert found.value is None


def test_schoenhardt_with_one_more_point_has_a_triangulation() -> None:
    configuration, faces = load_surface("schoenhardt")
    points = [*configuration.exact_points(), (0, 0, 500)]
    found = settled(bcut.region((points, faces)))
    assert (found.status, found.value) == ("optimal", 8)
    assert all(6 in tetrahedron for tetrahedron in found.triangulation or ())


def test_a_point_outside_or_on_the_surface_changes_nothing() -> None:
    configuration, faces = load_surface("schoenhardt")
    for point in ([5000, 0, 0], [0, 0, 0]):
        found = settled(bcut.region(([*configuration.exact_points(), point], faces)))
        assert (found.status, found.covered) == ("infeasible", "0")


@pytest.mark.parametrize("seed", range(4))
def test_convex_polyhedra_have_the_optimum_of_their_vertices(seed: int) -> None:
    configuration = load_instance(f"sphere:8,3,seed={seed}")
    chirotope = Region(configuration, (), bcut_chirotope(configuration)).chirotope
    points = configuration.floats
    faces = []
    for a, b, c in chirotope.hull_facets:
        inner = points.mean(axis=0) - points[a]
        outward = np.cross(points[b] - points[a], points[c] - points[a]) @ inner < 0
        faces.append([a, b, c] if outward else [a, c, b])
    found = settled(bcut.region((configuration, faces)))
    assert found.status == "optimal"
    assert found.covered == found.volume
    assert found.value == bcut.solve(configuration).value


def bcut_chirotope(configuration: PointConfiguration) -> Any:
    from bcut.geometry.chirotope import Chirotope

    return Chirotope.of(configuration)


def test_the_surface_of_a_cube_decides_how_many_tetrahedra_it_takes() -> None:
    assert settled(bcut.region((CUBE, EVEN))).value == 5
    turned = [face for face in EVEN if set(face) not in ({0, 2, 3}, {0, 1, 3})] + [[0, 1, 2], [1, 3, 2]]
    found = settled(bcut.region((CUBE, turned)))
    assert found.status == "optimal"
    assert found.value == 6


def test_an_l_shaped_prism_is_triangulated_without_its_notch() -> None:
    points, faces = l_prism(turning=False)
    found = settled(bcut.region((points, faces)))
    assert (found.status, found.volume, found.covered) == ("optimal", "3", "3")
    # Four triangular prisms of three tetrahedra each are a triangulation.
    assert (found.value or 99) <= 12
    for tetrahedron in found.triangulation or ():
        middle = np.mean([points[v] for v in tetrahedron], axis=0)
        assert middle[0] < 1 or middle[1] < 1


def test_the_diagonals_of_an_l_shaped_prism_can_make_it_impossible() -> None:
    points, faces = l_prism(turning=True)
    found = settled(bcut.region((points, faces)))
    assert (found.status, found.volume) == ("infeasible", "3")
    assert Fraction(found.covered or 0) == brute_force(points, faces)[0] < 3


def test_a_cavity_is_not_inside() -> None:
    inner = [[4 * x + 3 for x in point] for point in CUBE]
    outer = [[10 * x for x in point] for point in CUBE]
    faces = EVEN + [[a + 8, c + 8, b + 8] for a, b, c in EVEN]
    found = Region.of(PointConfiguration.from_values(outer + inner), faces)
    assert found.volume == 6 * (1000 - 64)
    hollow = frozenset(range(8, 16))
    assert not any(hollow.issuperset(tetrahedron) for tetrahedron in found.tetrahedra.tolist())


@pytest.mark.parametrize("seed", range(6))
def test_brute_force_agrees_on_random_polyhedra(seed: int) -> None:
    points, faces = star(6 + seed % 2, seed)
    covered, fewest = brute_force(points, faces)
    found = settled(bcut.region((points, faces)))
    assert Fraction(found.covered or 0) == covered
    assert found.value == fewest
    assert (found.status == "optimal") == (fewest is not None)


@pytest.mark.parametrize(
    "name", ["twisted-prism:4", "twisted-prism:4,seed=2", "chazelle:1", "twisted-prism:5"]
)
def test_brute_force_agrees_on_families(name: str) -> None:
    configuration, faces = load_surface(name)
    covered, fewest = brute_force(configuration.numerators[:, :, 0].tolist(), [list(face) for face in faces])
    found = settled(bcut.region(name))
    assert (found.status, fewest) == ("infeasible", None)
    assert Fraction(found.covered or 0) == covered
    assert 0 < covered < Fraction(found.volume)


@pytest.mark.parametrize(
    ("name", "seed"), [("twisted-prism:4", 1), ("twisted-prism:4", 2), ("chazelle:1", 1)]
)
def test_doubles_are_settled_exactly_and_without_many_branches(name: str, seed: int) -> None:
    configuration, faces = load_surface(name)
    noise = np.random.default_rng(seed).normal(size=(configuration.n, 3))
    points = configuration.floats + noise * (0.001 if name == "chazelle:1" else 1)
    covered, fewest = brute_force(
        [[Fraction(x) for x in row] for row in points.tolist()], list(map(list, faces))
    )
    found = settled(bcut.region((points, faces)))
    assert (found.status, fewest) == ("infeasible", None)
    assert Fraction(found.covered or 0) == covered
    assert found.nodes < 15


def test_gluing_tetrahedra_gives_regions_that_have_a_triangulation() -> None:
    points = [[0, 0, 0], [9, 1, 0], [1, 8, 0], [2, 1, 7], [8, 9, 6], [-3, 7, 5], [1, -6, 4]]
    tetrahedra = [[0, 1, 2, 3], [1, 2, 3, 4], [0, 2, 3, 5], [0, 1, 3, 6]]
    found = settled(bcut.region((points, boundary(tetrahedra, points))))
    assert found.status == "optimal"
    assert (found.value or 9) <= 4


BROKEN: list[tuple[Any, Faces, str]] = [
    (CUBE, EVEN[1:], "not closed"),
    (CUBE, [*EVEN, EVEN[0]], "share the edge"),
    (CUBE, [EVEN[0][::-1], *EVEN[1:]], "same direction"),
    (CUBE, [face[::-1] for face in EVEN], "wrongly oriented"),
    (CUBE, [], "no faces"),
    (CUBE, [[0, 1, 3, 2], *EVEN[2:]], "4 vertices"),
    (CUBE, [[0, 1, 8], *EVEN[1:]], "no set of three"),
    (CUBE, [[0, 1, 1], *EVEN[1:]], "no set of three"),
    (CUBE, [["a", 1, 1], *EVEN[1:]], "not three point numbers"),
    ([*CUBE, [2, 0, 0]], [[0, 4, 8], *EVEN[1:]], "on a line"),
    ([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], "dimension 3"),
    ([["sqrt(2)", 0, 0], *CUBE[1:]], EVEN, "rational"),
    (CUBE, [[0, 1, 2], [0, 2, 1]], "wrongly oriented"),
]


@pytest.mark.parametrize(("points", "faces", "message"), BROKEN)
def test_what_bounds_no_region_is_refused(points: Any, faces: Faces, message: str) -> None:
    with pytest.raises(SurfaceError, match=message):
        bcut.region((points, faces))


TETRAHEDRON = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]]
CROSSING = {
    "edges through triangles": [[1, 1, 1], [5, 1, 1], [1, 5, 1], [1, 1, 5]],
    "a vertex on an edge": [[2, 0, 0], [2, -3, 1], [2, -3, -5], [5, -4, 0]],
    "a vertex on a triangle": [[1, 1, 0], [1, 1, -3], [2, 1, -3], [1, 2, -3]],
    "edges that cross": [[2, 1, 0], [2, -1, 0], [2, 0, -3], [3, 0, -3]],
}


@pytest.mark.parametrize("second", CROSSING.values(), ids=CROSSING)
def test_a_surface_that_crosses_itself_is_refused(second: list[list[int]]) -> None:
    points = TETRAHEDRON + second
    faces = boundary([[0, 1, 2, 3]], points) + boundary([[4, 5, 6, 7]], points)
    with pytest.raises(SurfaceError, match="crosses itself"):
        bcut.region((points, faces))
    check = SurfaceCheck([[Fraction(x) for x in point] for point in points], list(map(tuple, faces)))
    with pytest.raises(VerificationError, match="cross"):
        check.check()


def test_two_polyhedra_may_touch_in_a_vertex() -> None:
    points = [[0, 0, 0], *(p for p in CUBE[1:]), *([-x, -y, -z] for x, y, z in CUBE[1:])]
    mirrored = [[v + 7 if v else 0 for v in face][::-1] for face in EVEN]
    found = settled(bcut.region((points, EVEN + mirrored)))
    assert (found.status, found.value) == ("optimal", 10)


def test_too_many_points_are_refused() -> None:
    points = np.random.default_rng(1).random((41, 3))
    with pytest.raises(TooLargeError, match="41 points"):
        bcut.region((points, [[0, 1, 2]]))


def test_no_time_leaves_a_result_that_verifies() -> None:
    found = bcut.region("twisted-prism:5", time_limit=1e-9)
    assert (found.status, found.bound) == ("limit", None)
    verification = bcut.verify(found)
    assert not verification.proven_optimal
    assert "nothing was proven" in verification.statement
    with pytest.raises(InputError, match="time limit"):
        bcut.region("schoenhardt", time_limit=0)


def test_ctrl_c_keeps_what_was_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    import bcut.solving.region as module

    def interrupted(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "least", interrupted)
    result = tmp_path / "r.json"
    assert run(["region", "twisted-prism:5", "--output", str(result)]) == 130
    assert "interrupted" in capsys.readouterr().out
    data = json.loads(result.read_text())
    assert data["status"] == "interrupted"
    # The greedy choice is there from the beginning.
    assert data["triangulation"]
    assert not bcut.verify(result).proven_optimal


# Verification refuses what was changed.


@pytest.fixture(scope="module")
def infeasible() -> dict[str, Any]:
    return json.loads(bcut.region("twisted-prism:4").to_json())


@pytest.fixture(scope="module")
def optimal() -> dict[str, Any]:
    return json.loads(bcut.region((CUBE, EVEN)).to_json())


def changed(data: dict[str, Any], path: str, value: Any) -> dict[str, Any]:
    data = copy.deepcopy(data)
    *parents, last = path.split(".")
    inner = data
    for key in parents:
        inner = inner[key]
    inner[last] = value
    return data


CHANGES = [
    ("volume", "1", "volume"),
    ("covered", "7/3", "cover"),
    ("status", "optimal", "status"),
    ("triangulation", [[0, 1, 2, 3]], "flat"),
    ("certificate.infeasible", {"multipliers": []}, "bound of 0"),
    ("certificate.infeasible", None, "status"),
    ("certificate.covered", {"multipliers": []}, "bound of"),
    ("certificate.covered", None, "status"),
    ("instance.digest", "0" * 64, "digest"),
]


@pytest.mark.parametrize(("path", "value", "message"), CHANGES)
def test_changed_results_are_refused(infeasible: dict[str, Any], path: str, value: Any, message: str) -> None:
    assert bcut.verify(infeasible).proven_optimal
    with pytest.raises(VerificationError, match=message):
        bcut.verify(changed(infeasible, path, value))


def test_rows_of_a_proof_must_hold(infeasible: dict[str, Any]) -> None:
    everything = list(combinations(range(8), 4))
    row = [[list(t) for t in everything], "-100000000000"]
    with pytest.raises(VerificationError, match="do not cross"):
        bcut.verify(changed(infeasible, "certificate.covered", {"multipliers": [row]}))
    multipliers = infeasible["certificate"]["covered"]["multipliers"]
    turned = [[row, value.removeprefix("-")] for row, value in multipliers]
    with pytest.raises(VerificationError, match="wrong sign"):
        bcut.verify(changed(infeasible, "certificate.covered", {"multipliers": turned}))


def test_changed_triangulations_are_refused(optimal: dict[str, Any]) -> None:
    listed = optimal["triangulation"]
    for triangulation, message in (
        (listed[1:], "cover"),
        ([*listed, listed[0]], "face to face"),
        ([*listed[1:], [0, 1, 2, 7]], "face to face|crosses the surface"),
    ):
        with pytest.raises(VerificationError, match=message):
            bcut.verify(changed(optimal, "triangulation", triangulation))
    with pytest.raises(VerificationError, match="exceed"):
        bcut.verify(changed(optimal, "certificate.cardinality", {"multipliers": []}))
    with pytest.raises(VerificationError, match="says that there is no triangulation"):
        bcut.verify(changed(optimal, "certificate.infeasible", {"multipliers": []}))
    flipped = [optimal["instance"]["faces"][0][::-1], *optimal["instance"]["faces"][1:]]
    for faces, message in (
        (flipped, "not oriented"),
        (optimal["instance"]["faces"][1:], "not closed"),
        ([face[::-1] for face in optimal["instance"]["faces"]], "wrongly oriented"),
    ):
        with pytest.raises(VerificationError, match=message):
            bcut.verify(changed(optimal, "instance.faces", faces))


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("instance.faces", 7),
        ("triangulation", [[0, 0, 1, 2]]),
        ("certificate", None),
        ("certificate.infeasible", 3),
        ("certificate.infeasible", {"multipliers": [3]}),
        ("certificate.infeasible", {"multipliers": [[[0, 1, 2], "x"]]}),
        ("volume", 3),
        ("schema", 2),
    ],
)
def test_malformed_results_are_told_as_such(infeasible: dict[str, Any], path: str, value: Any) -> None:
    with pytest.raises(ResultError):
        bcut.verify(changed(infeasible, path, value))


# Files and the command line.


def test_a_family_goes_through_files(tmp_path: Path, capsys: Captured) -> None:
    surface, result = tmp_path / "s.off", tmp_path / "s.json"
    assert run(["generate", "twisted-prism:4", "--output", str(surface)]) == 0
    assert run(["region", str(surface), "--output", str(result), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads(result.read_text())
    assert (printed["status"], printed["covered"]) == ("infeasible", bcut.region("twisted-prism:4").covered)
    assert run(["verify", str(result)]) == 0
    assert "infeasible, proven exactly" in capsys.readouterr().out
    assert run(["region", str(surface)]) == 0
    assert "not triangulable" in capsys.readouterr().out
    assert run(["region", "twisted-prism:5", "--time-limit", "1e-9", "--quiet"]) == 3


def test_surfaces_are_read_from_json_and_ply(tmp_path: Path) -> None:
    native = tmp_path / "cube.json"
    native.write_text(json.dumps({"schema": 1, "name": "block", "points": CUBE, "faces": EVEN}))
    assert settled(region(native)).instance["name"] == "block"
    head = ["ply", "format ascii 1.0", "element vertex 8", *(f"property float {c}" for c in "xyz")]
    head += ["element face 12", "property list uchar int vertex_indices", "end_header"]
    rows = [" ".join(map(str, point)) for point in CUBE] + [f"3 {a} {b} {c}" for a, b, c in EVEN]
    ply = tmp_path / "cube.ply"
    ply.write_text("\n".join([*head, *rows]) + "\n")
    assert settled(region(ply)).value == 5


def test_unusable_files_are_told(tmp_path: Path) -> None:
    quads = tmp_path / "quads.off"
    rows = [" ".join(map(str, point)) for point in CUBE]
    quads.write_text("\n".join(["OFF", "8 2 0", *rows, "4 0 1 3 2", "3 0 1 2"]) + "\n")
    cloud = tmp_path / "cloud.off"
    cloud.write_text("\n".join(["OFF", "8 0 0", *rows]) + "\n")
    native = tmp_path / "points.json"
    native.write_text(json.dumps(CUBE))
    for source, message in (
        (quads, "not all triangles"),
        (cloud, "only points"),
        (native, "faces"),
        (tmp_path / "missing.off", "no such file"),
        (tmp_path / "points.csv", "no such file"),
        ("cube:3", "without a surface"),
        ("schonhardt", "is unknown"),
        ("twisted-prism:5,twist=36", "twist"),
        ("chazelle:0", "K must"),
    ):
        with pytest.raises(BcutError, match=message):
            bcut.region(source)
    assert run(["generate", "cube:3", "--format", "off"]) == 2


def test_off_refuses_what_it_cannot_hold(tmp_path: Path) -> None:
    native = tmp_path / "thirds.json"
    points = [["1/3", 0, 0], *CUBE[1:]]
    native.write_text(json.dumps({"points": points, "faces": EVEN}))
    assert run(["generate", str(native), "--format", "off"]) == 2
    assert settled(bcut.region(native)).status in ("optimal", "infeasible")


# The tree.


def cycle_rows(equations: bool) -> tuple[sp.csr_matrix, np.ndarray[Any, Any]]:
    matrix = np.zeros((5, 5), dtype=np.int64)
    for k in range(5):
        matrix[k, [k, (k + 1) % 5]] = 1
    crossing = (matrix.T @ matrix > 0) & ~np.eye(5, dtype=bool)
    return sp.csr_matrix(matrix), crossing


def test_an_odd_cycle_takes_a_branch() -> None:
    matrix, crossing = cycle_rows(False)
    program = ExactProgram(matrix, np.ones(5, dtype=np.int64), False, crossing, [-3] * 5)
    best, tree = least(program)
    assert best is not None
    assert len(best) == 2
    assert isinstance(tree, Branch)
    assert program.nodes > 1


def test_equations_without_integral_points_are_refuted() -> None:
    matrix, crossing = cycle_rows(True)
    program = ExactProgram(matrix, np.ones(5, dtype=np.int64), True, crossing, [1] * 5)
    best, tree = least(program)
    assert best is None
    assert isinstance(tree, Branch)

"""Regions inside closed surfaces: what can be triangulated, and what cannot."""

from __future__ import annotations

import json
from fractions import Fraction
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from polyhedra import CUBE, EVEN, Faces, boundary, settled

import bcut
from bcut.cli.main import run
from bcut.errors import InputError
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.surface import Region
from bcut.instance import load_instance
from bcut.solving.region import load_surface
from bcut.verification.surface import SurfaceCheck

Captured = pytest.CaptureFixture[str]


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


def test_two_polyhedra_may_touch_in_a_vertex() -> None:
    points = [[0, 0, 0], *(p for p in CUBE[1:]), *([-x, -y, -z] for x, y, z in CUBE[1:])]
    mirrored = [[v + 7 if v else 0 for v in face][::-1] for face in EVEN]
    found = settled(bcut.region((points, EVEN + mirrored)))
    assert (found.status, found.value) == ("optimal", 10)


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

"""Convex-polygon cuts: exact separation, where they fire and where they never do."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from cut_families import problem, ready

from bcut.bounds.root import root_bound
from bcut.families import build
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.chirotope import Chirotope
from bcut.objectives.objective import Objective
from bcut.separation.seam import FractionalPoint, Problem
from bcut.separators.convex_polygon import ConvexPolygon, Lines, violated_polygons


def polygons_by_trying_all(chirotope: Chirotope) -> list[set[int]]:
    """All sets of points that are all points of their hull, with none inside it, from orientations alone."""

    def turn(a: int, b: int, c: int) -> int:
        if len({a, b, c}) < 3:
            return 0
        order = sorted((a, b, c))
        swaps = (a > b) + (a > c) + (b > c)
        return int(chirotope.orientations(np.array(order))) * (-1) ** swaps

    def inside(point: int, corners: tuple[int, ...]) -> bool:
        """Strictly inside the hull: every line through the point has corners strictly on both sides."""
        others = [q for q in corners if q != point]
        signs = [{turn(point, q, r) for r in others} for q in others]
        return all({1, -1} <= found for found in signs)

    def in_hull(point: int, corners: tuple[int, ...]) -> bool:
        for a, b, c in combinations(corners, 3):
            side = turn(a, b, c)
            if side and all(turn(*edge, point) * side >= 0 for edge in ((a, b), (b, c), (c, a))):
                return True
        return False

    result = []
    for size in range(3, chirotope.n + 1):
        for corners in combinations(range(chirotope.n), size):
            if not any(turn(*triple) for triple in combinations(corners, 3)):
                continue
            contained = [p for p in range(chirotope.n) if p in corners or in_hull(p, corners)]
            if tuple(contained) == corners and not any(inside(p, corners) for p in corners):
                result.append(set(corners))
    return result


@pytest.mark.parametrize(
    "instance",
    [
        "random:8,2,seed=1",
        "random:8,2,seed=2",
        "grid:3,3",
        "grid:4,2",
        "polygon:7",
        "moae",
        "polygon:6,center",
    ],
)
def test_polygon_separation_is_exact(instance: str) -> None:
    given = problem(instance)
    lines, polygons = Lines(given.chirotope), polygons_by_trying_all(given.chirotope)
    random = np.random.default_rng(7)
    count, fired = len(given.simplices), 0
    for _ in range(15):
        x = np.where(random.random(count) < random.choice([0.2, 0.5, 1.0]), random.random(count), 0.0)
        x *= random.choice([0.2, 0.5, 1.0])
        best = max(
            sum(x[i] for i, simplex in enumerate(given.simplices.tolist()) if set(simplex) <= polygon)
            - len(polygon)
            + 2
            for polygon in polygons
        )
        support = np.flatnonzero(x)
        found = violated_polygons(lines, given.simplices[support], x[support], effort=10**6)
        assert all(set(polygon) in polygons for polygon, _ in found)
        if best > 1e-3:
            fired += 1
            assert found[0][1] == pytest.approx(best, abs=1e-4)
        elif best < 0:
            assert found == []
    assert fired


def test_points_in_convex_position_need_no_branching() -> None:
    """24 points have 2**24 polygons; minimum cuts find the best at once."""
    given = problem("polygon:24")
    x = np.where(np.random.default_rng(0).random(len(given.simplices)) < 0.1, 0.3, 0.0)
    support = np.flatnonzero(x)
    found = violated_polygons(
        Lines(given.chirotope), given.simplices[support], x[support], effort=len(support)
    )
    assert found[0][0] == list(range(24))
    assert found[0][1] == pytest.approx(x.sum() - 22)


@pytest.mark.parametrize(
    ("instance", "spanning"),
    [
        ("random:12,2,seed=1", True),
        ("random:9,2,seed=2", False),
        ("grid:4,4", True),
        ("grid:3,3", False),
        ("polygon:9", False),
        ("polygon:5,center", False),
        ("random:25,2,seed=3", True),
    ],
)
def test_polygon_cuts_never_fire_in_formulation_2(instance: str, spanning: bool) -> None:
    """Conjecture 1 of the paper, at vertices of the relaxation and at mixtures of them."""
    given = problem(instance, spanning=spanning)
    separator = ready(ConvexPolygon(), given)
    random = np.random.default_rng(11)
    vertices = []
    for _ in range(6):
        costs = random.integers(-20, 20, len(given.simplices))
        found = root_bound(given.formulation, Objective("random", "min", costs)).point
        assert found is not None
        vertices.append(found)
    mixtures = [random.dirichlet(np.ones(6)) @ np.array(vertices) for _ in range(6)]
    for x in [*vertices, *mixtures]:
        assert list(separator.separate(FractionalPoint(given, x))) == []


def test_polygon_cuts_fire_outside_formulation_2() -> None:
    """Half of every triangle of a pentagon satisfies all crossings (Formulation 0), but is 5 triangles where 3 fit."""
    given = problem("polygon:5")
    x = np.full(10, 0.5)
    rows, columns = np.nonzero(given.crossings(np.arange(10)))
    assert (x[rows] + x[columns] <= 1).all()
    cut = next(iter(ready(ConvexPolygon(), given).separate(FractionalPoint(given, x))))
    assert sorted(np.asarray(cut.simplices).tolist()) == list(range(10))
    assert cut.rhs == 3
    assert cut.proof == {"polygon": [0, 1, 2, 3, 4]}


def test_polygon_cuts_count_points_inside_an_edge() -> None:
    """A triangle with a point in the middle of each edge has room for four triangles, not for one."""
    formulation = cocircuit_formulation(build("grid:3,3"))
    given = Problem(formulation)
    # Corners 0, 2, 6 and the points between them: the lower left half of the grid.
    corners = {0, 1, 2, 3, 4, 6}
    inside = [set(simplex) <= corners for simplex in formulation.simplices.tolist()]
    point = FractionalPoint(given, np.where(inside, 0.45, 0.0))
    cuts = {tuple(cut.proof["polygon"]): cut for cut in ready(ConvexPolygon(), given).separate(point)}
    assert tuple(sorted(corners)) in cuts
    assert cuts[tuple(sorted(corners))].rhs == 4


def test_polygon_cuts_are_for_the_plane() -> None:
    given = problem("cube:3")
    point = FractionalPoint(given, np.full(len(given.simplices), 0.9))
    assert list(ready(ConvexPolygon(), given).separate(point)) == []


def test_small_effort_ends_the_polygon_search() -> None:
    given = problem("grid:4,4", spanning=True)
    point = FractionalPoint(given, np.full(len(given.simplices), 0.9))
    separator = ready(ConvexPolygon(effort=1, max_cuts=3), given)
    assert len(list(separator.separate(point))) <= 3

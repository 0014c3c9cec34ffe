"""Edges that minimum weight triangulations of the plane cannot have, and what solving without them gives."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

import bcut
from bcut.errors import BcutError, ConfigurationError, InputError
from bcut.geometry.boundary import lie_in_boundary
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.determinants import orientation_signs
from bcut.geometry.elimination import BASE_ANGLE, all_pairs, diamond_edges, lmt_skeleton
from bcut.geometry.placing import placing_triangulation
from bcut.geometry.plane import PlanePoints
from bcut.geometry.simplices import candidate_simplices
from bcut.geometry.sweep import sweep_triangulation
from bcut.geometry.triangulations import triangulations
from bcut.objectives.measures import measured
from bcut.solving.by_elimination import minimum_weight_triangulation_2d
from bcut.verification.triangulation import check_triangulation

KINDS = ("uniform", "clusters", "lattice", "tenths", "cocircular", "wheel", "rings", "nearly", "line")


def circle(count: int) -> np.ndarray:
    turns = np.arange(count) * (2 * np.pi / count)
    return np.stack((np.cos(turns), np.sin(turns)), axis=1)


def sample(kind: str, rng: np.random.Generator, n: int) -> list[list[object]]:
    """Draw points of some kind; lattices may come with fewer than n."""
    if kind == "uniform":
        points = rng.random((n, 2))
    elif kind == "clusters":
        points = rng.random((n, 2)) * 1e-3 + rng.integers(0, 2, (n, 2))
    elif kind == "lattice":
        points = np.unique(rng.integers(0, 6, (n, 2)), axis=0)
    elif kind == "tenths":
        # Nearly on lines, but as doubles not on them.
        points = np.unique(rng.integers(0, 6, (n, 2)), axis=0) * 0.1
    elif kind == "cocircular":
        turns = rng.random(n) * 6.28
        points = np.stack((np.cos(turns), np.sin(turns)), axis=1)
    elif kind == "wheel":
        points = np.concatenate((circle(n - 1), rng.random((1, 2)) * 0.1))
    elif kind == "rings":
        points = np.concatenate((circle(n // 2), circle(n // 2) * rng.uniform(0.05, 0.9)))
    elif kind == "line":
        points = np.concatenate(
            (np.stack((np.arange(n - 2), np.zeros(n - 2)), axis=1), rng.random((2, 2)) * 5)
        )
    else:
        # Closer to a lattice than doubles can tell.
        lattice = np.unique(rng.integers(0, 6, (n, 2)), axis=0).tolist()
        return [
            [Fraction(int(x)) + Fraction(int(rng.integers(0, 3)), 3 * 10**18) for x in row] for row in lattice
        ]
    return points.tolist()


def configurations(kind: str, count: int, largest: int) -> Iterator[PointConfiguration]:
    rng = np.random.default_rng(sum(map(ord, kind)))
    while count:
        points = sample(kind, rng, int(rng.integers(6, largest + 1)))
        try:
            configuration = PointConfiguration.from_values(points, name=kind)
        except ConfigurationError:
            continue
        count -= 1
        yield configuration


def as_set(edges: np.ndarray) -> set[tuple[int, ...]]:
    return set(map(tuple, edges.tolist()))


def edges_of(simplices: np.ndarray) -> set[tuple[int, ...]]:
    return {pair for simplex in simplices.tolist() for pair in combinations(simplex, 2)}


@pytest.mark.parametrize("kind", KINDS)
def test_the_optimum_is_that_of_all_simplices(kind: str) -> None:
    integer_faces = 0
    for configuration in configurations(kind, 14, 25):
        found = minimum_weight_triangulation_2d(configuration)
        listed = bcut.solve(configuration, objective="weight", spanning=True, method="listing")
        assert (found.status, listed.status) == ("optimal", "optimal")
        assert found.value is not None
        assert found.bound is not None
        assert float(found.value) == pytest.approx(listed.value, rel=1e-9)
        assert found.bound <= found.value <= found.bound * (1 + Fraction(1, 10**9))
        integer_faces += found.statistics.integer_faces or 0
    if kind == "wheel":
        assert integer_faces > 0


@pytest.mark.parametrize("kind", KINDS)
def test_no_edge_of_an_optimum_is_struck_out_and_certain_ones_are_in_all_optima(kind: str) -> None:
    for configuration in configurations(kind, 5, 9):
        chirotope = Chirotope.of(configuration)
        simplices = candidate_simplices(chirotope, spanning=True)
        costs = np.array(measured("weight", configuration, simplices))
        all_of_them = [list(columns) for columns in triangulations(chirotope, spanning=True)]
        weights = np.array([costs[columns].sum() for columns in all_of_them])
        passed = as_set(diamond_edges(configuration))
        skeleton = lmt_skeleton(configuration)
        best = [
            edges_of(simplices[all_of_them[number]])
            for number in np.flatnonzero(weights <= weights.min() * (1 + 1e-13))
        ]
        assert all(edges <= passed for edges in best)
        left = [edges for edges in best if edges <= as_set(skeleton.possible)]
        # Weights that differ by less than doubles can tell may be those of others than the optima.
        assert len(left) == len(best) or (left and kind in ("tenths", "rings", "wheel", "nearly"))
        assert all(as_set(skeleton.certain) <= edges for edges in left)


@pytest.mark.parametrize("kind", ["lattice", "line", "rings", "nearly", "uniform"])
def test_the_diamond_test_changes_no_optimum(kind: str) -> None:
    for configuration in configurations(kind, 4, 30):
        with_it = minimum_weight_triangulation_2d(configuration)
        without = minimum_weight_triangulation_2d(configuration, diamond=False)
        assert with_it.value is not None
        assert without.value is not None
        assert float(with_it.value) == pytest.approx(float(without.value), rel=1e-12)
        assert without.statistics.edges == without.statistics.pairs


@pytest.mark.parametrize(
    "name", ["polygon:7", "polygon:9,center", "grid:4,5", "random:60,2,seed=5", "polygon:12"]
)
def test_named_configurations(name: str) -> None:
    found = minimum_weight_triangulation_2d(bcut.load_instance(name))
    listed = bcut.solve(name, objective="weight", spanning=True, method="listing")
    assert found.value is not None
    assert float(found.value) == pytest.approx(listed.value, rel=1e-9)


def occupied_halves(points: np.ndarray, p: int, q: int, base: float) -> tuple[bool, bool]:
    """Whether a point is inside the triangle on the left and on the right, by angles."""
    plane = np.delete(points @ np.array([1, 1j]), [p, q])
    start, end = points[[p, q]] @ np.array([1, 1j])
    here = np.angle((plane - start) / (end - start))
    there = np.angle((plane - end) / (start - end))
    inside = (np.abs(here) < base) & (np.abs(there) < base)
    return bool((inside & (here > 0)).any()), bool((inside & (here < 0)).any())


@pytest.mark.parametrize("n", [12, 80, 400])
def test_the_diamond_test_takes_away_what_has_points_on_both_sides(n: int) -> None:
    configuration = PointConfiguration.from_values(np.random.default_rng(n).random((n, 2)))
    passed = as_set(diamond_edges(configuration))
    rng = np.random.default_rng(0)
    pairs = all_pairs(configuration)
    for p, q in pairs[rng.permutation(len(pairs))[:300]].tolist():
        assert all(occupied_halves(configuration.floats, p, q, BASE_ANGLE)) == ((p, q) not in passed)


def test_edges_beyond_the_first_neighbours_are_found() -> None:
    # Two dense clusters: the long edges between them are farther away than all first neighbours.
    rng = np.random.default_rng(4)
    points = np.concatenate((rng.random((300, 2)), rng.random((300, 2)) + np.array([40, 3])))
    configuration = PointConfiguration.from_values(points)
    passed = as_set(diamond_edges(configuration))
    for p in range(0, 300, 60):
        for q in range(300, 600):
            if not all(occupied_halves(points, p, q, BASE_ANGLE)):
                assert (p, q) in passed
    between = [pair for pair in passed if pair[0] < 300 <= pair[1]]
    assert 300 < len(between) < 90_000
    skeleton = lmt_skeleton(configuration)
    assert any(p < 300 <= q for p, q in skeleton.certain.tolist())


@pytest.mark.parametrize("kind", ["uniform", "lattice", "nearly", "tenths"])
def test_triangles_are_the_empty_ones_and_crossings_are_those(kind: str) -> None:
    for configuration in configurations(kind, 3, 14):
        skeleton = lmt_skeleton(configuration)
        possible = as_set(skeleton.possible)
        empty = candidate_simplices(Chirotope.of(configuration), spanning=True)
        expected = [row for row in empty.tolist() if edges_of(np.array([row])) <= possible]
        assert skeleton.triangles.tolist() == expected
        edges = skeleton.possible
        crossing = np.array([[cross(configuration, one, other) for one in edges] for other in edges])
        assert (skeleton.is_certain == ~crossing.any(axis=1)).all()
        groups = connected_components(crossing, directed=False)[1]
        same = groups[:, None] == groups
        assert (same == (skeleton.crossing_group[:, None] == skeleton.crossing_group)).all()
        for triangle, sides in zip(skeleton.triangles, skeleton.edge_sides, strict=True):
            for position in range(3):
                edge = skeleton.possible[sides[position] // 2]
                apex = triangle[position]
                assert set(triangle.tolist()) == {*edge.tolist(), int(apex)}
                sign = orientation_signs(configuration, np.array([[*edge, apex]]))[0]
                assert sign == (-1 if sides[position] % 2 else 1)


def cross(configuration: PointConfiguration, one: np.ndarray, other: np.ndarray) -> bool:
    tuples = np.array([[*one, c] for c in other] + [[*other, a] for a in one])
    signs = orientation_signs(configuration, tuples)
    return bool(signs[0] * signs[1] < 0 and signs[2] * signs[3] < 0)


def test_edges_struck_out_are_locally_minimal_for_no_pair_of_triangles() -> None:
    configuration = PointConfiguration.from_values(np.random.default_rng(8).random((60, 2)))
    points = configuration.floats
    skeleton = lmt_skeleton(configuration)
    starts, members = skeleton.sides
    apexes = skeleton.triangles.reshape(-1)[members]
    on_hull = lie_in_boundary(configuration, skeleton.possible)
    for e, (a, b) in enumerate(skeleton.possible.tolist()):
        left, right = (apexes[starts[s] : starts[s + 1]] for s in (2 * e, 2 * e + 1))
        if on_hull[e]:
            assert len(left) + len(right) > 0
            continue
        length = np.linalg.norm(points[a] - points[b])
        assert any(
            length <= np.linalg.norm(points[c] - points[d])
            or not cross(configuration, np.array([a, b]), np.array([c, d]))
            for c in left
            for d in right
        )


@pytest.mark.parametrize("kind", KINDS)
def test_a_sweep_places_the_points(kind: str) -> None:
    for configuration in configurations(kind, 3, 12):
        placed = placing_triangulation(configuration, Chirotope.of(configuration))
        assert sweep_triangulation(configuration).tolist() == placed.tolist()


def test_errors_of_coordinates_are_bounded() -> None:
    third = PointConfiguration.from_values([["1/3", "0"], ["1000000007/3", "1/7"], ["5", "123456789123/11"]])
    heptagon = bcut.load_instance("polygon:7")
    for configuration in (third, heptagon):
        plane = PlanePoints.of(configuration)
        assert plane.delta > 0
        exact = np.array([[float(x) for x in row] for row in configuration.scalars()])
        exact -= exact[0]
        scale = np.linalg.norm(exact[1]) / np.linalg.norm(plane.points[1] - plane.points[0])
        assert np.abs(exact / scale - (plane.points - plane.points[0])).max() < 1e-14
        assert np.ptp(plane.points, axis=0).max() <= 2
    assert PlanePoints.of(bcut.load_instance("grid:4,5")).delta < 0
    assert PlanePoints.of(bcut.load_instance("random:20,2,seed=1")).delta == 0


def test_no_time_leaves_a_triangulation() -> None:
    configuration = bcut.load_instance("random:300,2,seed=1")
    found = minimum_weight_triangulation_2d(configuration, time_limit=0.0)
    best = minimum_weight_triangulation_2d(configuration)
    assert (found.status, best.status) == ("limit", "optimal")
    assert found.value is not None
    assert best.value is not None
    assert found.value > best.value
    assert found.bound is None
    assert found.simplices is not None
    check_triangulation(configuration.scalars(), found.simplices.tolist(), spanning=True)


def test_only_the_plane() -> None:
    with pytest.raises(InputError, match="dimension 3"):
        diamond_edges(bcut.load_instance("cube:3"))


def test_solving_by_elimination_gives_a_result_that_verifies() -> None:
    result = bcut.solve("random:400,2,seed=2", objective="weight", spanning=True, method="elimination")
    assert (result.status, result.problem.method) == ("optimal", "elimination")
    assert result.size.columns_after_fixing is not None
    assert 0 < result.size.columns_after_fixing < result.size.columns
    assert "theorems" in str(result.certificate.reason)
    checked = bcut.verify(result)
    assert checked.value is not None
    assert float(checked.value) == result.value


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("grid:3,3", {"objective": "weight"}),
        ("grid:3,3", {"objective": "weight", "spanning": True, "sense": "max"}),
        ("grid:3,3", {"spanning": True}),
        ("cube:3", {"objective": "weight", "spanning": True}),
        ("grid:3,3", {"objective": "weight", "spanning": True, "forbid": [[0, 4]]}),
        ("grid:3,3", {"objective": "weight", "spanning": True, "formulation": "0"}),
    ],
)
def test_other_questions_are_refused(name: str, options: dict[str, object]) -> None:
    with pytest.raises(BcutError, match="method 'elimination'"):
        bcut.solve(name, method="elimination", **options)  # type: ignore[arg-type]


def test_larger_problems_of_this_kind_are_solved_so_by_themselves() -> None:
    def method(name: str, **options: object) -> str:
        return bcut.solve(name, objective="weight", **options).problem.method  # type: ignore[arg-type]

    assert method("random:100,2,seed=1", spanning=True) == "elimination"
    assert method("random:20,2,seed=1", spanning=True) == "listing"
    assert method("random:100,2,seed=1", spanning=True, separators=["clique"]) != "elimination"
    assert (
        bcut.bound("random:100,2,seed=1", objective="weight", spanning=True).problem.method != "elimination"
    )

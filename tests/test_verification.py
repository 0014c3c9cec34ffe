"""Exact verification of triangulations: what is right passes, and what is wrong is named."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from itertools import combinations, permutations
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from bcut.errors import ConfigurationError, VerificationError
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.crossings import crossing_matrix
from bcut.geometry.numbers import AlgebraicNumber, parse_number
from bcut.verification import triangulation as triangulation_module
from bcut.verification.exact_points import ExactPoints
from bcut.verification.hull import hull_volume
from bcut.verification.triangulation import check_triangulation

Points = Sequence[Sequence[Any]]

CUBE = [[k & 1, k >> 1 & 1, k >> 2 & 1] for k in range(8)]
# One tetrahedron on alternate vertices, and the four corners that it leaves.
CUBE_5 = [[0, 3, 5, 6], [0, 1, 3, 5], [0, 2, 3, 6], [0, 4, 5, 6], [3, 5, 6, 7]]
# The paths from 0 to 7 along the edges.
CUBE_6 = [[0, a, a | b, 7] for a, b in permutations((1, 2, 4), 2)]

# y
# 1  3---4---5
# 0  0---1---2   with x = 0, 1, 2
GRID = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]]

PENTAGON = [
    ["1", "0"],
    ["cos(2*pi/5)", "cos(2*pi/20)"],
    ["cos(4*pi/5)", "cos(6*pi/20)"],
    ["cos(6*pi/5)", "-cos(6*pi/20)"],
    ["cos(8*pi/5)", "-cos(2*pi/20)"],
    ["0", "0"],
]
FAN = [[0, 1, 2], [0, 2, 3], [0, 3, 4]]
WHEEL = [[0, 1, 5], [1, 2, 5], [2, 3, 5], [3, 4, 5], [0, 4, 5]]


def numbers(points: Sequence[Sequence[str]]) -> list[list[Any]]:
    """Each coordinate in the smallest field of its own."""
    return [[parse_number(text) for text in point] for point in points]


def shuffled_cube(dimension: int) -> list[list[int]]:
    """Kuhn's triangulation of the cube with d! simplices."""
    simplices = []
    for order in permutations(range(dimension)):
        corner, simplex = 0, [0]
        for axis in order:
            corner |= 1 << axis
            simplex.append(corner)
        simplices.append(simplex)
    return simplices


@pytest.mark.parametrize("simplices", [CUBE_5, CUBE_6])
def test_triangulations_of_the_cube(simplices: list[list[int]]) -> None:
    report = check_triangulation(CUBE, simplices, spanning=True)
    assert report.volume == 1
    assert report.boundary_facets == 12
    assert report.unused == ()
    assert set(report.simplices) == {tuple(sorted(simplex)) for simplex in simplices}


def test_order_of_simplices_and_vertices_does_not_matter() -> None:
    reordered = [simplex[::-1] for simplex in reversed(CUBE_5)]
    assert check_triangulation(CUBE, reordered) == check_triangulation(CUBE, CUBE_5)


def test_rational_coordinates_scale_the_volume() -> None:
    points = [[Fraction(x, 3) + Fraction(1, 7) for x in point] for point in CUBE]
    assert check_triangulation(points, CUBE_6).volume == Fraction(1, 27)


@pytest.mark.parametrize(("dimension", "count"), [(4, 24), (5, 120), (6, 720)])
def test_kuhn_triangulation_of_the_cube(dimension: int, count: int) -> None:
    points = [[k >> i & 1 for i in range(dimension)] for k in range(1 << dimension)]
    report = check_triangulation(points, shuffled_cube(dimension), spanning=True)
    assert (len(report.simplices), report.volume) == (count, 1)


@pytest.mark.parametrize(("simplices", "unused"), [(FAN, (5,)), (WHEEL, ())])
def test_regular_pentagon_with_irrational_coordinates(
    simplices: list[list[int]], unused: tuple[int, ...]
) -> None:
    report = check_triangulation(numbers(PENTAGON), simplices)
    assert report.unused == unused
    assert isinstance(report.volume, AlgebraicNumber)
    assert float(report.volume) == pytest.approx(2.5 * np.sin(2 * np.pi / 5), rel=1e-15)


def test_dropped_simplex_leaves_facets_without_partner() -> None:
    with pytest.raises(VerificationError) as caught:
        check_triangulation(CUBE, CUBE_6[:-1])
    message = str(caught.value)
    assert "2 facets belong to one simplex only" in message
    assert "[0, 4, 7]" in message
    assert "5/6" in message
    assert "1/6 is missing" in message


def test_dropped_simplex_with_irrational_volume() -> None:
    with pytest.raises(
        VerificationError, match=r"facet \[0, 2\] of \[0, 2, 3\] .*0\.723607 of the hull's: 0\.276393"
    ):
        check_triangulation(numbers(PENTAGON)[:5], FAN[1:])


def test_corner_simplex_dropped_names_its_only_inner_facet() -> None:
    with pytest.raises(
        VerificationError, match=r"inside the hull a facet belongs .* facet \[3, 5, 6\] of \[0, 3, 5, 6\]"
    ):
        check_triangulation(CUBE, CUBE_5[:-1])


def test_changed_vertex_is_refused() -> None:
    changed = copy.deepcopy(CUBE_5)
    changed[1] = [0, 1, 3, 4]
    with pytest.raises(VerificationError, match="overlap"):
        check_triangulation(CUBE, changed)


def test_simplices_on_the_same_side_of_their_facet_overlap() -> None:
    with pytest.raises(
        VerificationError, match=r"\[0, 1, 3\] and \[0, 1, 4\] lie on the same side .* \[0, 1\]"
    ):
        check_triangulation(GRID, [[0, 1, 3], [0, 1, 4]])


def test_duplicated_simplex_is_refused() -> None:
    with pytest.raises(
        VerificationError, match=r"simplex 5, \[6, 5, 4, 0\]: it is in the list twice, as simplex 3"
    ):
        check_triangulation(CUBE, [*CUBE_5, [6, 5, 4, 0]])


def test_flat_simplex_is_refused() -> None:
    with pytest.raises(VerificationError, match=r"simplex 5, \[0, 1, 2, 3\], is flat"):
        check_triangulation(CUBE, [*CUBE_5, [0, 1, 2, 3]])


def test_flat_simplex_with_irrational_coordinates_is_refused() -> None:
    points = numbers([["0", "0"], ["1", "sqrt(2)"], ["1+sqrt(2)", "2+sqrt(2)"], ["1", "0"]])
    with pytest.raises(VerificationError, match=r"\[0, 1, 2\], is flat"):
        check_triangulation(points, [[0, 1, 2], [0, 1, 3]])


@pytest.mark.parametrize(
    ("simplices", "reason"),
    [
        ([], "there are no simplices"),
        ([[0, 1, 3]], r"simplex 0, \[0, 1, 3\]: it has 3 vertices, not 4"),
        ([[0, 3, 5, 8]], "there is no point 8; points are numbered from 0 to 7"),
        ([[0, 3, 5, -1]], "there is no point -1"),
        ([[0, 3, 5, 5]], "vertex 5 occurs twice"),
    ],
)
def test_malformed_simplices(simplices: list[list[int]], reason: str) -> None:
    with pytest.raises(VerificationError, match=reason):
        check_triangulation(CUBE, simplices)


@pytest.mark.parametrize("points", [[], [[1], [2]], [[0, 0], [1, 0, 0], [0, 1]]])
def test_malformed_points(points: Points) -> None:
    with pytest.raises(VerificationError, match="same number of coordinates"):
        check_triangulation(points, [[0, 1, 2]])


def test_dissection_of_a_grid_that_is_not_face_to_face() -> None:
    # Vertex 3 sits inside the edge 2-4 that the lower half does not cut.
    stacked = [[0, 0], [2, 0], [0, 1], [1, 1], [2, 1], [0, 2], [2, 2]]
    simplices = [[0, 1, 2], [1, 2, 4], [2, 3, 5], [3, 5, 6], [3, 4, 6]]
    with pytest.raises(VerificationError) as caught:
        check_triangulation(stacked, simplices)
    assert "facet [2, 4] of [1, 2, 4]" in str(caught.value)
    assert "volumes add up to the hull's" in str(caught.value)
    assert "do not meet face to face" in str(caught.value)


def test_dissection_of_a_prism_with_mismatched_diagonals() -> None:
    # Two triangular prisms make a cube; the square between them is cut along different diagonals.
    left = [[0, 1, 3, 7], [0, 1, 5, 7], [0, 4, 5, 7]]
    right = [[0, 2, 3, 6], [0, 3, 4, 6], [3, 4, 6, 7]]
    with pytest.raises(VerificationError, match="do not meet face to face") as caught:
        check_triangulation(CUBE, left + right)
    for facet in ("[0, 3, 7]", "[0, 4, 7]", "[0, 3, 4]"):
        assert f"facet {facet}" in str(caught.value)


def test_overlapping_simplices_with_the_right_volume() -> None:
    # As many triangles of area 1/2 as the grid needs, but two of them lie over the same half of a square.
    simplices = [[0, 1, 3], [1, 3, 4], [1, 2, 4], [1, 2, 5]]
    with pytest.raises(
        VerificationError, match=r"lie on the same side .* add up to the hull's, so some overlap"
    ):
        check_triangulation(GRID, simplices)


def test_two_layers_over_the_hull_are_refused() -> None:
    # Each layer alone is a triangulation, so every facet inside is matched; the barycentre tells.
    square = [[0, 0], [4, 0], [0, 4], [4, 4], [1, 2], [2, 1]]
    layers = [
        [[0, 1, 4], [1, 3, 4], [2, 3, 4], [0, 2, 4]],
        [[0, 1, 5], [1, 3, 5], [2, 3, 5], [0, 2, 5]],
    ]
    for layer in layers:
        check_triangulation(square, layer)
    with pytest.raises(VerificationError, match="overlap"):
        check_triangulation(square, layers[0] + layers[1])


def test_two_layers_with_all_facets_matched_are_refused() -> None:
    # A triangle, and over it again a triangulation that cuts each of its edges in two: every facet inside has
    # its partner, and every facet on the boundary is alone. Only the barycentre (and the volume) tells.
    points = [[0, 0], [4, 0], [0, 4], [2, 0], [2, 2], [0, 2]]
    fine = [[0, 3, 5], [1, 3, 4], [2, 4, 5], [3, 4, 5]]
    check_triangulation(points, fine, spanning=True)
    check_triangulation(points, [[0, 1, 2]])
    with pytest.raises(
        VerificationError, match=r"the barycentre of \[0, 3, 5\] lies in \[0, 1, 2\] too; .* up to 2 of"
    ):
        check_triangulation(points, [*fine, [0, 1, 2]])


def test_spanning_names_the_points_left_out() -> None:
    assert check_triangulation(GRID, [[0, 2, 3], [2, 3, 5]]).unused == (1, 4)
    with pytest.raises(VerificationError, match=r"not spanning: 2 of 6 points are in no simplex, 1, 4"):
        check_triangulation(GRID, [[0, 2, 3], [2, 3, 5]], spanning=True)


def test_volumes_are_compared_with_an_independent_hull(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(triangulation_module, "hull_volume", lambda points, start: 7)
    with pytest.raises(
        VerificationError, match=r"volumes do not add up: .* 6/7 of the hull's: 1/7 is missing"
    ):
        check_triangulation(CUBE, CUBE_6)


@pytest.mark.parametrize("tail", [200, 201])
def test_sides_that_approximations_cannot_decide(tail: int) -> None:
    # p/q is a convergent of sqrt(2), above and below it in turn: (q, p) misses the line by less than 2^-250.
    p, q = 1, 1
    for _ in range(tail):
        p, q = p + 2 * q, p + q
    points = numbers([["0", "0"], ["1", "sqrt(2)"], [str(q), str(p)], ["2", "2*sqrt(2)"]])
    exact = ExactPoints(points)
    line = exact.hyperplane((0, 1))
    assert exact.side(line, 2) == (1 if p * p > 2 * q * q else -1)
    assert exact.side(line, 3) == 0
    assert exact.sides(line) == ((0b100, 0) if p * p > 2 * q * q else (0, 0b100))


PRISM = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]]
OCTAHEDRON = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
NESTED = [[4, 0], [0, 4], [0, 0], [2, 1], [1, 2], [1, 1]]


def determinant(rows: Sequence[Sequence[int]]) -> int:
    """By expansion along the first row."""
    if not rows:
        return 1
    return sum(
        (-1) ** j * a * determinant([[*row[:j], *row[j + 1 :]] for row in rows[1:]])
        for j, a in enumerate(rows[0])
        if a
    )


class Judge:
    """Knows by definition which sets of simplices are triangulations, for integer points.

    Simplices are a triangulation when no two of them cross (as the model's geometry sees it, which
    verification does not use) and their volumes add up to the hull's (as Qhull measures it).
    """

    def __init__(self, points: Points) -> None:
        from scipy.spatial import ConvexHull

        self.points = points
        self.dimension = len(points[0])
        configuration = PointConfiguration.from_values(np.array(points))
        subsets = combinations(range(len(points)), self.dimension + 1)
        self.volumes: dict[tuple[int, ...], int] = {}
        self.full = [simplex for simplex in subsets if self.volume(simplex)]
        crossing = crossing_matrix(Chirotope.of(configuration), np.array(self.full))
        self.crossing = {
            (self.full[i], self.full[j])
            for i, j in zip(*(axis.tolist() for axis in crossing.nonzero()), strict=True)
        }
        self.hull = round(ConvexHull(np.array(points)).volume * [1, 1, 2, 6][self.dimension])

    def volume(self, simplex: Sequence[int]) -> int:
        key = tuple(simplex)
        if key not in self.volumes:
            first, *rest = (self.points[v] for v in key)
            self.volumes[key] = abs(
                determinant([[a - b for a, b in zip(point, first, strict=True)] for point in rest])
            )
        return self.volumes[key]

    def is_triangulation(self, simplices: Sequence[tuple[int, ...]]) -> bool:
        if any(not self.volume(simplex) for simplex in simplices) or len(set(simplices)) != len(simplices):
            return False
        if any(pair in self.crossing for pair in combinations(simplices, 2)):
            return False
        return sum(map(self.volume, simplices)) == self.hull

    def placing(self) -> list[tuple[int, ...]]:
        """Place the points in their order; points inside the hull so far are left out."""
        simplices = [self.full[0]]
        for point in range(len(self.points)):
            for facet, vertex in self._boundary(simplices):
                if self._side(facet, point) * self._side(facet, vertex) < 0:
                    simplices.append(tuple(sorted((*facet, point))))
        return simplices

    def _boundary(self, simplices: Sequence[tuple[int, ...]]) -> list[tuple[tuple[int, ...], int]]:
        owners: dict[tuple[int, ...], list[int]] = {}
        for simplex in simplices:
            for vertex in simplex:
                owners.setdefault(tuple(v for v in simplex if v != vertex), []).append(vertex)
        return [(facet, vertices[0]) for facet, vertices in owners.items() if len(vertices) == 1]

    def _side(self, facet: Sequence[int], point: int) -> int:
        first, *rest = (self.points[v] for v in (*facet, point))
        return determinant([[a - b for a, b in zip(other, first, strict=True)] for other in rest])


@pytest.mark.parametrize(
    ("points", "sizes", "count"),
    [
        (PRISM, range(1, 13), 6),
        (OCTAHEDRON, range(1, 13), 3),
        (GRID, range(1, 5), 14),
        (NESTED, (1, 3, 5), 10),
    ],
    ids=["prism", "octahedron", "grid", "nested-triangles"],
)
def test_of_all_sets_of_simplices_the_triangulations_pass(
    points: Points, sizes: Sequence[int], count: int
) -> None:
    class Remembering(ExactPoints):
        hyperplane = cache(ExactPoints.hyperplane)

    judge, exact = Judge(points), Remembering(points)
    accepted = 0
    for simplices in (chosen for size in sizes for chosen in combinations(judge.full, size)):
        try:
            check_triangulation(exact, simplices)
        except VerificationError:
            assert not judge.is_triangulation(simplices)
        else:
            assert judge.is_triangulation(simplices)
            accepted += 1
    assert accepted == count


def point_sets(dimension: int, most: int) -> st.SearchStrategy[list[tuple[int, ...]]]:
    """Few points of a small grid, so that many are in special position."""
    point = st.tuples(*[st.integers(-2, 2)] * dimension)
    return st.lists(point, min_size=dimension + 1, max_size=most, unique=True)


@settings(max_examples=150, deadline=None)
@given(st.one_of(point_sets(2, 9), point_sets(3, 8)), st.data())
def test_placing_triangulations_pass_and_their_mutations_are_judged_right(
    points: list[tuple[int, ...]], data: st.DataObject
) -> None:
    try:
        judge = Judge(points)
    except ConfigurationError:  # the points lie in a hyperplane
        assume(False)
    simplices = judge.placing()
    report = check_triangulation(points, simplices)
    assert report.volume == Fraction(judge.hull, [1, 1, 2, 6][judge.dimension])

    number = data.draw(st.integers(0, len(simplices) - 1))
    changed = list(simplices[number])
    changed[data.draw(st.integers(0, judge.dimension))] = data.draw(st.integers(0, len(points) - 1))
    assume(len(set(changed)) == len(changed))
    mutated = [tuple(sorted(changed)) if i == number else simplex for i, simplex in enumerate(simplices)]
    assume(set(mutated) != set(simplices))
    if judge.is_triangulation(mutated):
        check_triangulation(points, mutated)
    else:
        with pytest.raises(VerificationError):
            check_triangulation(points, mutated)


@settings(max_examples=100, deadline=None)
@given(point_sets(3, 9), st.randoms(use_true_random=False))
def test_hull_volume_does_not_depend_on_where_it_starts(points: list[tuple[int, ...]], random: Any) -> None:
    exact = ExactPoints(points)
    full = [simplex for simplex in combinations(range(len(points)), 4) if exact.volume(simplex)]
    assume(len(full) > 1)
    first, second = random.sample(full, 2)
    assert hull_volume(exact, first) == hull_volume(exact, second)

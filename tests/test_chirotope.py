from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from reference import configuration_or_none, integral, on_hull, orientation

from bcut.errors import TooLargeError
from bcut.geometry import chirotope as chirotope_module
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.instance import load_instance


def small_points(d: int, most: int = 3) -> st.SearchStrategy[list[list[int]]]:
    point = st.lists(st.integers(0, most), min_size=d, max_size=d)
    return st.lists(point, min_size=d + 1, max_size=d + 5, unique_by=tuple)


@settings(max_examples=60, deadline=None)
@given(st.integers(2, 4).flatmap(small_points))
def test_sides_and_facets_of_degenerate_points(values: list[list[int]]) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    points = integral(configuration.scalars())
    chirotope = Chirotope.of(configuration)
    n, d = configuration.n, configuration.dimension
    planes = set()
    for facet, row, interior in zip(
        chirotope.facets.tolist(), chirotope.sides.tolist(), chirotope.facet_is_interior, strict=True
    ):
        expected = [0 if a in facet else orientation(points, (*facet, a)) for a in range(n)]
        assert row == expected
        if any(expected):
            assert bool(interior) is not on_hull(points, facet)
            if not interior:
                planes.add(tuple(a for a in range(n) if expected[a] == 0))
        else:
            assert not interior
    assert chirotope.hull_facets == tuple(sorted(planes))
    subsets = list(combinations(range(n), d + 1))
    independent = [s for s in subsets if orientation(points, s)]
    assert {tuple(row) for row in chirotope.bases.tolist()} == set(independent)
    assert chirotope.is_general is (len(independent) == len(subsets))


@settings(max_examples=40, deadline=None)
@given(st.integers(2, 4).flatmap(small_points), st.data())
def test_three_term_grassmann_pluecker_relations(values: list[list[int]], data: st.DataObject) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None and configuration.n >= configuration.dimension + 3)
    chirotope = Chirotope.of(configuration)
    d = configuration.dimension
    order = data.draw(st.permutations(range(configuration.n)))
    common, (a, b, c, e) = order[: d - 1], order[d - 1 : d + 3]

    def chi(*two: int) -> int:
        whole = [*common, *two]
        inversions = sum(x > y for i, x in enumerate(whole) for y in whole[i + 1 :])
        return int(chirotope.orientations(np.array(sorted(whole)))) * (-1) ** inversions

    terms = {chi(a, b) * chi(c, e), -chi(a, c) * chi(b, e), chi(a, e) * chi(b, c)}
    assert terms == {0} or {1, -1} <= terms


@pytest.mark.parametrize(
    ("instance", "facets"),
    [
        ("cube:3", [4] * 6),
        ("cube:4", [8] * 8),
        ("cross-polytope:4", [4] * 16),
        ("icosahedron", [3] * 20),
        ("dodecahedron", [5] * 12),
        ("cuboctahedron", [3] * 8 + [4] * 6),
        ("truncated-tetrahedron", [3] * 4 + [6] * 4),
        ("prism:7", [4] * 7 + [7] * 2),
        ("antiprism:5", [3] * 10 + [5] * 2),
        ("grid:3,3,3", [9] * 6),
        ("polygon:7", [2] * 7),
        ("moae", [2] * 3),
        ("cyclic:7,4", [4] * 14),
        ("hypersimplex:5,2", [4] * 5 + [6] * 5),
        ("24-cell", [6] * 24),
        ("simplex-product:2,1,1", [6] * 4 + [8] * 3),
    ],
)
def test_hull_facets_of_known_polytopes(instance: str, facets: list[int]) -> None:
    chirotope = Chirotope.of(load_instance(instance))
    assert sorted(map(len, chirotope.hull_facets)) == sorted(facets)


@pytest.mark.parametrize(
    ("instance", "general"),
    [
        ("polygon:8", True),
        ("cyclic:8,4", True),
        ("random:12,3,seed=1", True),
        ("icosahedron", False),
        ("cube:3", False),
        ("grid:3,3", False),
        ("moae", True),
    ],
)
def test_general_position(instance: str, general: bool) -> None:
    assert Chirotope.of(load_instance(instance)).is_general is general


@settings(max_examples=25, deadline=None)
@given(small_points(3), st.data())
def test_relabelling_permutes_orientations(values: list[list[int]], data: st.DataObject) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    order = data.draw(st.permutations(range(configuration.n)))
    before, after = Chirotope.of(configuration), Chirotope.of(configuration.relabelled(order))
    for subset in combinations(range(configuration.n), 4):
        old = [order[v] for v in subset]
        inversions = sum(x > y for i, x in enumerate(old) for y in old[i + 1 :])
        expected = before.orientations(np.array(sorted(old))) * (-1) ** inversions
        assert after.orientations(np.array(subset)) == expected


def test_a_reflection_turns_every_orientation() -> None:
    configuration = load_instance("random:9,3,seed=5")
    mirrored = configuration.affine_image([[-1, 0, 0], [0, 2, 0], [0, 0, 3]], [7, 0, 1])
    np.testing.assert_array_equal(Chirotope.of(mirrored).signs, -Chirotope.of(configuration).signs)


def test_too_many_subsets_are_refused_before_anything_is_allocated() -> None:
    points = np.random.default_rng(0).random((1000, 3))
    with pytest.raises(
        TooLargeError, match=r"1000 points in dimension 3 .* at most 60,000,000 .*fewer points"
    ):
        Chirotope.of(PointConfiguration.from_values(points, name="many"))


def test_a_dimension_beyond_reach_is_refused() -> None:
    d = chirotope_module.MAX_DIMENSION + 1
    simplex = [[int(i == j) for j in range(d)] for i in range(d + 1)]
    with pytest.raises(TooLargeError, match=f"high: dimension {d}; .* smaller dimension"):
        Chirotope.of(PointConfiguration.from_values(simplex, name="high"))

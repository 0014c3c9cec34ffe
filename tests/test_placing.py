from __future__ import annotations

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from reference import assert_triangulation, configuration_or_none

from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.placing import placing_triangulation
from bcut.geometry.subsets import ranks
from bcut.instance import load_instance


def assert_placed(configuration: PointConfiguration) -> None:
    chirotope = Chirotope.of(configuration)
    simplices = placing_triangulation(configuration, chirotope)
    assert_triangulation(configuration.scalars(), simplices.tolist(), spanning=True)
    order = ranks(simplices, configuration.n)
    assert (order[1:] > order[:-1]).all()


@pytest.mark.parametrize(
    "instance",
    [
        "cube:3",
        "cube:4",
        "cross-polytope:4",
        "grid:4,4",
        "grid:3,3,3",
        "grid:2,2,2,2",
        "moae",
        "polygon:7,center",
        "prism:7",
        "icosahedron",
        "dodecahedron",
        "cuboctahedron",
        "24-cell",
        "simplex-product:2,1,1",
        "hypersimplex:5,2",
        "cyclic:8,5",
        "random:20,3,seed=1",
        "random:12,4,seed=1",
        "sphere:14,3,seed=1",
    ],
)
def test_placing_triangulates_and_uses_every_point(instance: str) -> None:
    assert_placed(load_instance(instance))


@settings(max_examples=80, deadline=None)
@given(
    st.integers(2, 4).flatmap(
        lambda d: st.lists(
            st.lists(st.integers(0, 2), min_size=d, max_size=d), min_size=d + 1, max_size=12, unique_by=tuple
        )
    )
)
def test_placing_on_subsets_of_a_grid_in_any_order(values: list[list[int]]) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    assert_placed(configuration)


def test_placing_starts_with_many_collinear_and_coplanar_points() -> None:
    line = [[0, 0, z] for z in range(5)]
    plane = [[0, y, z] for y in (1, 2) for z in range(3)]
    assert_placed(PointConfiguration.from_values([*line, *plane, [1, 0, 0], [2, 5, 1]]))


def test_placing_orders_algebraic_coordinates_exactly() -> None:
    # The three abscissas differ by less than floating point resolves.
    near = ["3363/2378", "sqrt(2)", "47321/33461"]
    points = [
        [near[0], 0],
        [near[1], 1],
        [near[2], 0],
        [near[1], -1],
        [near[1], 0],
        ["2*sqrt(2)-3363/2378", 0],
    ]
    assert_placed(PointConfiguration.from_values(points))


def test_a_single_simplex() -> None:
    configuration = PointConfiguration.from_values([[0, 0], [1, 0], [0, 1]])
    assert placing_triangulation(configuration, Chirotope.of(configuration)).tolist() == [[0, 1, 2]]

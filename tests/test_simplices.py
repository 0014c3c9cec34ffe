from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from reference import configuration_or_none, full_simplices, is_empty

from bcut.geometry import simplices as simplices_module
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.simplices import candidate_simplices, empty
from bcut.instance import load_instance

INSTANCES = [
    "grid:3,3",
    "grid:4,3",
    "moae",
    "polygon:5,center",
    "cube:3",
    "cross-polytope:3",
    "random:8,3,seed=2",
]


def as_tuples(table: np.ndarray) -> list[tuple[int, ...]]:
    return [tuple(row) for row in table.tolist()]


@pytest.mark.parametrize("instance", INSTANCES)
def test_all_full_dimensional_simplices_are_candidates(instance: str) -> None:
    configuration = load_instance(instance)
    expected = full_simplices(configuration.scalars())
    assert as_tuples(candidate_simplices(Chirotope.of(configuration))) == expected


@pytest.mark.parametrize("instance", [*INSTANCES, "grid:3,2,2", "random:9,4,seed=1", "hypersimplex:5,2"])
def test_spanning_candidates_are_the_empty_simplices(instance: str) -> None:
    configuration = load_instance(instance)
    points = configuration.scalars()
    expected = [s for s in full_simplices(points) if is_empty(points, s)]
    assert as_tuples(candidate_simplices(Chirotope.of(configuration), spanning=True)) == expected


@settings(max_examples=50, deadline=None)
@given(
    st.integers(2, 4).flatmap(
        lambda d: st.lists(
            st.lists(st.integers(0, 3), min_size=d, max_size=d), min_size=d + 2, max_size=9, unique_by=tuple
        )
    )
)
def test_empty_simplices_of_degenerate_points(values: list[list[int]]) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    points = configuration.scalars()
    chirotope = Chirotope.of(configuration)
    simplices = candidate_simplices(chirotope)
    assert empty(chirotope, simplices).tolist() == [is_empty(points, s) for s in simplices.tolist()]


def test_a_point_on_the_boundary_of_a_simplex_makes_it_nonempty() -> None:
    # Vertex 3 on an edge, vertex 4 in a facet, of the tetrahedron 0, 1, 2, 5.
    points = [[0, 0, 0], [6, 0, 0], [0, 6, 0], [3, 0, 0], [2, 2, 0], [0, 0, 6]]
    chirotope = Chirotope.of(PointConfiguration.from_values(points))
    spanning = as_tuples(candidate_simplices(chirotope, spanning=True))
    assert (0, 1, 2, 5) not in spanning
    assert (0, 3, 4, 5) in spanning


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.int32])
def test_simplices_of_any_integer_type(dtype: type) -> None:
    chirotope = Chirotope.of(load_instance("random:12,3,seed=3"))
    simplices = candidate_simplices(chirotope)
    expected = empty(chirotope, simplices)
    np.testing.assert_array_equal(empty(chirotope, simplices.astype(dtype)), expected)
    np.testing.assert_array_equal(empty(chirotope, np.asfortranarray(simplices)), expected)


@pytest.mark.parametrize("n", [7, 8, 9, 16, 17])
def test_padding_bits_count_for_nothing(n: int) -> None:
    configuration = load_instance(f"polygon:{n}")
    assert len(candidate_simplices(Chirotope.of(configuration), spanning=True)) == n * (n - 1) * (n - 2) // 6


def test_chunks_make_no_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    chirotope = Chirotope.of(load_instance("random:14,3,seed=4"))
    simplices = candidate_simplices(chirotope)
    expected = empty(chirotope, simplices)
    monkeypatch.setattr(simplices_module, "_CHUNK", 7)
    np.testing.assert_array_equal(empty(chirotope, simplices), expected)

"""Formulation 2: its 0/1 points are exactly the triangulations, and it depends on the geometry only."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from reference import configuration_or_none, on_hull, orientation
from scipy.optimize import linprog

from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.formulation import Formulation
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance


def zero_one_points(formulation: Formulation) -> Iterator[frozenset[int]]:
    """All 0/1 points of a formulation, by branching on rows with interval propagation: no geometry."""
    matrix = formulation.matrix.toarray().astype(int)
    lower, upper = formulation.lower, formulation.upper

    def search(fixed: np.ndarray) -> Iterator[frozenset[int]]:
        fixed = fixed.copy()
        while True:
            free = fixed < 0
            base = matrix @ np.where(free, 0, fixed)
            least, most = (
                base + np.minimum(matrix[:, free], 0).sum(1),
                base + np.maximum(matrix[:, free], 0).sum(1),
            )
            if (least > upper).any() or (most < lower).any():
                return
            # A free variable whose value 1 (or 0) breaks a row must be 0 (or 1).
            entries = matrix[:, free]
            one_breaks = (least[:, None] + np.maximum(entries, 0) > upper[:, None]) | (
                most[:, None] + np.minimum(entries, 0) < lower[:, None]
            )
            zero_breaks = (most[:, None] - np.maximum(entries, 0) < lower[:, None]) | (
                least[:, None] - np.minimum(entries, 0) > upper[:, None]
            )
            to_zero, to_one = one_breaks.any(0), zero_breaks.any(0)
            if not (to_zero | to_one).any():
                break
            if (to_zero & to_one).any():
                return
            columns = np.flatnonzero(free)
            fixed[columns[to_zero]] = 0
            fixed[columns[to_one]] = 1
        columns = np.flatnonzero(fixed < 0)
        if not len(columns):
            yield frozenset(np.flatnonzero(fixed).tolist())
            return
        for value in (0, 1):
            fixed[columns[0]] = value
            yield from search(fixed)

    yield from search(np.full(matrix.shape[1], -1))


def assert_points_are_triangulations(configuration: PointConfiguration, *, spanning: bool) -> None:
    chirotope = Chirotope.of(configuration)
    formulation = cocircuit_formulation(configuration, spanning=spanning, chirotope=chirotope)
    expected = {frozenset(columns) for columns in triangulations(chirotope, spanning=spanning)}
    assert expected
    points = list(zero_one_points(formulation))
    assert len(points) == len(set(points))
    assert set(points) == expected


@pytest.mark.parametrize("spanning", [False, True])
@pytest.mark.parametrize(
    "instance",
    [
        "polygon:6",
        "polygon:5,center",
        "moae",
        "grid:3,2",
        "grid:4,2",
        "cube:3",
        "cross-polytope:3",
        "cross-polytope:4",
        "prism:3",
        "cyclic:7,3",
        "cyclic:7,4",
        "simplex-product:2,2",
        "random:7,2,seed=1",
        "random:7,3,seed=1",
    ],
)
def test_the_0_1_points_are_the_triangulations(instance: str, spanning: bool) -> None:
    assert_points_are_triangulations(load_instance(instance), spanning=spanning)


def test_the_0_1_points_on_the_grid_of_nine_points() -> None:
    assert_points_are_triangulations(load_instance("grid:3,3"), spanning=True)


@settings(max_examples=15, deadline=None)
@given(
    st.integers(2, 3).flatmap(
        lambda d: st.lists(
            st.lists(st.integers(0, 2), min_size=d, max_size=d), min_size=d + 2, max_size=7, unique_by=tuple
        )
    ),
    st.booleans(),
)
def test_the_0_1_points_for_degenerate_points(values: list[list[int]], spanning: bool) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    assert_points_are_triangulations(configuration, spanning=spanning)


@pytest.mark.parametrize(
    ("instance", "spanning"),
    [
        ("grid:3,3", False),
        ("grid:3,2,2", True),
        ("antiprism:5", False),
        ("prism:5", False),
        ("icosahedron", False),
    ],
)
def test_every_triangulation_satisfies_every_row(instance: str, spanning: bool) -> None:
    formulation = cocircuit_formulation(load_instance(instance), spanning=spanning)
    found = list(triangulations(formulation.chirotope, spanning=spanning))
    points = np.zeros((len(formulation.simplices), len(found)), dtype=np.int64)
    for column, chosen in enumerate(found):
        points[list(chosen), column] = 1
    activity = formulation.matrix.astype(np.int64) @ points
    assert (activity == formulation.lower[:, None]).all()
    assert (activity == formulation.upper[:, None]).all()


@pytest.mark.parametrize("instance", ["cube:3", "moae", "grid:3,3", "random:8,3,seed=2"])
def test_cocircuit_rows_are_orientations_at_interior_facets(instance: str) -> None:
    configuration = load_instance(instance)
    points = configuration.scalars()
    formulation = cocircuit_formulation(configuration)
    assert formulation.row_faces[0] is None
    assert len(formulation.row_faces) == formulation.size[1]
    rows = {
        face: dict(zip(row.indices, row.data, strict=True))
        for face, row in zip(formulation.row_faces, formulation.matrix, strict=True)
    }
    expected: dict[tuple[int, ...], dict[int, int]] = {}
    for column, simplex in enumerate(formulation.simplices.tolist()):
        for vertex in simplex:
            facet = tuple(v for v in simplex if v != vertex)
            if not on_hull(points, facet):
                expected.setdefault(facet, {})[column] = orientation(points, (*facet, vertex))
    assert {face: row for face, row in rows.items() if face is not None} == expected
    assert formulation.lower.tolist() == formulation.upper.tolist() == [1] + [0] * len(expected)


def lp_value(formulation: Formulation, costs: np.ndarray) -> float:
    solution = linprog(
        costs, A_eq=formulation.matrix.astype(float), b_eq=formulation.lower, bounds=(0, 1), method="highs"
    )
    assert solution.status == 0
    return float(solution.fun)


def optimum(formulation: Formulation, costs: np.ndarray) -> int:
    return min(
        int(costs[list(chosen)].sum())
        for chosen in triangulations(formulation.chirotope, spanning=formulation.spanning)
    )


@settings(max_examples=25, deadline=None)
@given(
    st.integers(2, 3).flatmap(
        lambda d: st.tuples(
            st.lists(
                st.lists(st.integers(0, 4), min_size=d, max_size=d),
                min_size=d + 2,
                max_size=8,
                unique_by=tuple,
            ),
            st.lists(st.lists(st.integers(-3, 3), min_size=d, max_size=d), min_size=d, max_size=d),
            st.lists(st.integers(-5, 5), min_size=d, max_size=d),
        )
    ),
    st.booleans(),
    st.data(),
)
def test_affine_maps_and_relabelling_keep_the_lp_value_and_the_optimum(
    drawn: tuple[Any, Any, Any], spanning: bool, data: st.DataObject
) -> None:
    values, matrix, shift = drawn
    configuration = configuration_or_none(values)
    assume(configuration is not None and round(np.linalg.det(matrix)) != 0)
    order = data.draw(st.permutations(range(configuration.n)))
    image = configuration.affine_image(matrix, shift).relabelled(order)
    before = cocircuit_formulation(configuration, spanning=spanning)
    after = cocircuit_formulation(image, spanning=spanning)
    assert before.size == after.size
    costs = np.random.default_rng(len(values)).integers(0, 10, size=before.size[0])
    # Simplex t of the image is simplex order[t] of the original.
    old_columns = before.columns_of(np.sort(np.array(order)[after.simplices], axis=1))
    assert sorted(old_columns.tolist()) == list(range(before.size[0]))
    moved = costs[old_columns]
    assert lp_value(after, moved) == pytest.approx(lp_value(before, costs), abs=1e-7)
    assert optimum(after, moved) == optimum(before, costs)


def test_columns_of_finds_simplices_and_tells_what_is_none() -> None:
    formulation = cocircuit_formulation(load_instance("grid:3,3"), spanning=True)
    assert formulation.columns_of(formulation.simplices).tolist() == list(range(formulation.size[0]))
    # Points 0, 1, 2 are collinear; 0, 2, 6 span a triangle with others in it; 6, 7, 8 come last of all.
    strangers = np.array([[0, 1, 2], [0, 2, 6], [6, 7, 8]])
    assert formulation.columns_of(strangers).tolist() == [-1, -1, -1]


def test_a_restriction_keeps_rows_with_entries_and_the_coverage_row() -> None:
    formulation = cocircuit_formulation(load_instance("cube:3"))
    columns = np.array([0, 5, 9, 20])
    part = formulation.restricted_to(columns)
    assert part.simplices.tolist() == formulation.simplices[columns].tolist()
    assert part.row_faces[0] is None
    assert part.lower[0] == part.upper[0] == 1
    dense = formulation.matrix.toarray()[:, columns]
    kept = [row for row, face in enumerate(formulation.row_faces) if face is None or dense[row].any()]
    assert part.matrix.toarray().tolist() == dense[kept].tolist()
    assert part.row_faces == tuple(formulation.row_faces[row] for row in kept)
    assert part.columns_of(formulation.simplices[[5, 6]]).tolist() == [1, -1]


def test_a_restriction_to_nothing_has_no_points() -> None:
    formulation = cocircuit_formulation(load_instance("cube:3"))
    part = formulation.restricted_to(np.array([], dtype=np.int64))
    assert part.size == (0, 1)
    assert part.columns_of(formulation.simplices[:2]).tolist() == [-1, -1]


def test_a_single_simplex_has_one_triangulation() -> None:
    formulation = cocircuit_formulation(PointConfiguration.from_values([[0, 0], [1, 0], [0, 1]]))
    assert formulation.size == (1, 1)
    assert list(zero_one_points(formulation)) == [frozenset({0})]

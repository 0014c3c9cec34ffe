"""Crossings against the definition, decided by exact linear programming on coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from reference import integral, signed_volume

from bcut.families import build
from bcut.geometry import crossings as crossings_module
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.crossings import CrossingTable, FaceTable, crossing_matrix
from bcut.geometry.subsets import all_subsets, ranks
from bcut.geometry.triangulations import triangulations


def largest(objective: list[int], rows: list[list[Any]], rhs: list[Any]) -> Any:
    """Maximise over ``rows x = rhs``, x >= 0, by the simplex method with Bland's rule; None if infeasible.

    Integers remain integers: the table is then kept over one denominator, the last pivot.
    """
    columns = len(objective)
    table = [
        [*row, value] if value >= 0 else [-v for v in (*row, value)]
        for row, value in zip(rows, rhs, strict=True)
    ]
    for i, row in enumerate(table):
        row[columns:columns] = [int(i == j) for j in range(len(table))]
    basis = list(range(columns, columns + len(table)))
    whole = all(isinstance(value, int) for row in table for value in row)
    if not whole:
        table = [[Fraction(value) if isinstance(value, int) else value for value in row] for row in table]
    denominator = 1

    def enter(i: int, column: int) -> None:
        nonlocal denominator
        pivot, basis[i] = table[i][column], column
        if whole:
            chosen = table[i] = table[i] if pivot > 0 else [-value for value in table[i]]
            pivot = abs(pivot)
        else:
            inverse = 1 / pivot
            chosen = table[i] = [value * inverse for value in table[i]]
        for k, row in enumerate(table):
            share = row[column]
            if k != i and whole:
                table[k] = [(pivot * a - share * b) // denominator for a, b in zip(row, chosen, strict=True)]
            elif k != i and share:
                table[k] = [a - share * b for a, b in zip(row, chosen, strict=True)]
        denominator = pivot if whole else 1

    def optimise(costs: list[int], usable: int) -> Any:
        while True:
            priced = [(costs[b], row) for b, row in zip(basis, table, strict=True) if costs[b]]
            entering = next(
                (j for j in range(usable) if costs[j] * denominator > sum(c * row[j] for c, row in priced)),
                None,
            )
            if entering is None:
                return sum(c * row[-1] for c, row in priced) / Fraction(denominator)
            ratios = [
                ((Fraction(row[-1], row[entering]) if whole else row[-1] / row[entering]), basis[i], i)
                for i, row in enumerate(table)
                if row[entering] > 0
            ]
            assert ratios, "the program is bounded"
            enter(min(ratios)[2], entering)

    artificial = [0] * columns + [-1] * len(table)
    if optimise(artificial, columns + len(table)) < 0:
        return None
    # Artificial columns stay at 0: a pivot in their rows is free.
    for i, row in enumerate(table):
        if basis[i] >= columns:
            entering = next((j for j in range(columns) if row[j]), None)
            if entering is not None:
                enter(i, entering)
    return optimise([*objective, *[0] * len(table)], columns)


def meet_badly(points: Sequence[Sequence[Any]], first: Sequence[int], second: Sequence[int]) -> bool:
    """Whether a common point of two simplices is not in the convex hull of their common vertices.

    Barycentric coordinates in a simplex are unique: ask for the largest weight, in a common point, of the vertices that
    only the first simplex has.
    """
    dimension = len(points[0])
    rows = [[points[v][i] for v in first] + [-points[v][i] for v in second] for i in range(dimension)]
    rows.append([1] * len(first) + [0] * len(second))
    rows.append([0] * len(first) + [1] * len(second))
    rhs = [0] * dimension + [1, 1]
    objective = [int(v not in second) for v in first] + [0] * len(second)
    value = largest(objective, rows, rhs)
    return value is not None and value > 0


@pytest.mark.parametrize(
    "instance",
    [
        "cube:3",
        "grid:3,3",
        "prism:6",
        "cross-polytope:4",
        "polygon:5,center",
        "moae",
        "random:8,2,seed=3",
        "random:8,3,seed=3",
        "random:8,4,seed=3",
        "cyclic:8,5",
    ],
)
def test_crossing_is_meeting_outside_a_common_face(instance: str) -> None:
    configuration = build(instance)
    points = integral(configuration.scalars())
    simplices = Chirotope.of(configuration).bases
    crossing = crossing_matrix(Chirotope.of(configuration), simplices)
    pairs = list(combinations(range(len(simplices)), 2))
    chosen = np.random.default_rng(0).permutation(len(pairs))[:250]
    answers = []
    for number in chosen.tolist():
        i, j = pairs[number]
        expected = meet_badly(points, simplices[i].tolist(), simplices[j].tolist())
        answers.append(expected)
        assert crossing[i, j] == expected, (simplices[i], simplices[j])
    assert any(answers)
    assert not all(answers)


@pytest.mark.parametrize("instance", ["cube:3", "grid:3,3", "random:9,4,seed=1", "cross-polytope:4"])
def test_the_crossing_graph_is_symmetric_without_loops(instance: str) -> None:
    chirotope = Chirotope.of(build(instance))
    crossing = crossing_matrix(chirotope, chirotope.bases)
    assert (crossing == crossing.T).all()
    assert not crossing.diagonal().any()


def test_points_shared_by_touching_simplices_decide_in_degenerate_position() -> None:
    # Two triangles on both sides of an edge of three points: only the halves of the edge fit together.
    points = [[0, 0], [1, 0], [2, 0], [1, 1], [1, -1]]
    chirotope = Chirotope.of(PointConfiguration.from_values(points))
    simplices = np.array([[0, 2, 3], [0, 2, 4], [0, 1, 4], [0, 1, 3]])
    expected = np.array([[0, 0, 1, 1], [0, 0, 1, 1], [1, 1, 0, 0], [1, 1, 0, 0]], dtype=bool)
    assert (crossing_matrix(chirotope, simplices) == expected).all()


def test_a_part_of_the_matrix_is_computed_on_its_own() -> None:
    chirotope = Chirotope.of(build("random:10,3,seed=1"))
    simplices = chirotope.bases
    whole = crossing_matrix(chirotope, simplices)
    assert (crossing_matrix(chirotope, simplices[5:9], simplices[::3]) == whole[5:9, ::3]).all()
    assert CrossingTable(chirotope, simplices).rows(simplices[:0]).shape == (0, len(simplices))


@pytest.mark.parametrize(
    "instance", ["random:9,3,seed=1", "cube:3", "random:9,5,seed=1", "random:8,4,seed=1"]
)
def test_large_configurations_do_without_tables(instance: str, monkeypatch: pytest.MonkeyPatch) -> None:
    chirotope = Chirotope.of(build(instance))
    simplices = chirotope.bases[::2]
    with_tables = crossing_matrix(chirotope, simplices)
    monkeypatch.setattr(crossings_module, "_LARGEST_TABLE", 0)
    monkeypatch.setattr(crossings_module, "_CHUNK", 64)
    assert (crossing_matrix(chirotope, simplices) == with_tables).all()


@pytest.mark.parametrize(
    ("instance", "size"), [("cube:3", 2), ("random:8,4,seed=2", 2), ("random:8,4,seed=2", 3)]
)
def test_joined_orientations_are_those_of_the_concatenation(instance: str, size: int) -> None:
    configuration = build(instance)
    chirotope, points = Chirotope.of(configuration), configuration.scalars()
    d = chirotope.dimension
    first, second = all_subsets(chirotope.n, size), all_subsets(chirotope.n, d + 1 - size)
    table = chirotope.joined(size)
    assert table.shape == (len(first), len(second))
    random = np.random.default_rng(0)
    for _ in range(200):
        i, j = int(random.integers(len(first))), int(random.integers(len(second)))
        volume = signed_volume(points, [*first[i].tolist(), *second[j].tolist()])
        assert table[i, j] == (volume > 0) - (volume < 0)


def test_joined_with_a_single_point_is_its_side() -> None:
    chirotope = Chirotope.of(build("random:8,3,seed=1"))
    assert (chirotope.joined(3) == chirotope.sides).all()


def test_the_face_table_lists_each_face_once() -> None:
    simplices = np.array([[0, 1, 2], [0, 1, 3], [1, 2, 4]])
    table = FaceTable(simplices, 5)
    assert table.faces[2].tolist() == [[0, 1], [0, 2], [1, 2], [0, 3], [1, 3], [1, 4], [2, 4]]
    for size in (1, 2, 3):
        listed = table.faces[size][table.incidence[size]]
        for simplex, faces in zip(simplices.tolist(), listed.tolist(), strict=True):
            assert sorted(map(tuple, faces)) == sorted(combinations(simplex, size))
        boundary = table.boundary(size)
        for face, rows in zip(table.faces[size].tolist(), boundary.tolist(), strict=True):
            for position, row in enumerate(rows):
                assert table.faces[size - 1][row].tolist() == [v for i, v in enumerate(face) if i != position]


@pytest.mark.parametrize("instance", ["polygon:5,center", "moae", "cyclic:6,3", "cube:2", "polygon:6"])
def test_triangulations_are_the_stable_sets_that_fill_the_hull(instance: str) -> None:
    """The enumerator against sets of pairwise non-crossing simplices whose volumes add up."""
    configuration = build(instance)
    chirotope, points = Chirotope.of(configuration), configuration.scalars()
    simplices = chirotope.bases
    crossing = crossing_matrix(chirotope, simplices)
    volumes = [abs(signed_volume(points, simplex)) for simplex in simplices.tolist()]
    listed = list(triangulations(chirotope))
    whole = sum(volumes[i] for i in listed[0])
    found = []

    def extend(chosen: tuple[int, ...], candidates: list[int], missing: Any) -> None:
        if not missing:
            found.append(chosen)
        for position, i in enumerate(candidates):
            if volumes[i] <= missing:
                rest = [j for j in candidates[position + 1 :] if not crossing[i, j]]
                extend((*chosen, i), rest, missing - volumes[i])

    extend((), list(range(len(simplices))), whole)
    assert sorted(found) == sorted(listed)


def test_ranks_of_faces_place_them() -> None:
    simplices = Chirotope.of(build("cube:3")).bases
    table = FaceTable(simplices, 8)
    assert (np.diff(ranks(table.faces[3], 8)) > 0).all()

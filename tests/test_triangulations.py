"""The enumerator finds every triangulation, once, and nothing else."""

from __future__ import annotations

import json
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from reference import assert_triangulation, configuration_or_none, full_simplices, is_empty

import bcut.instances
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.simplices import candidate_simplices
from bcut.geometry.triangulations import count_by_size, triangulations
from bcut.instance import load_instance

OPTIMA = json.loads(bcut.instances.path("known-optima").read_text(encoding="utf-8"))
COUNTED = [row for row in OPTIMA if row["triangulations"] and row["triangulations"] <= 100_000]


def label(row: dict[str, Any]) -> str:
    return row["instance"] + (" spanning" if row["spanning"] else "")


def test_the_table_of_known_optima_is_not_empty() -> None:
    assert len(COUNTED) >= 30


@pytest.mark.parametrize("row", COUNTED, ids=label)
def test_known_numbers_and_sizes_of_triangulations(row: dict[str, Any]) -> None:
    counts = count_by_size(Chirotope.of(load_instance(row["instance"])), spanning=row["spanning"])
    assert sum(counts.values()) == row["triangulations"]
    assert (min(counts), max(counts)) == (row["min"], row["max"])
    if row["by_size"] is not None:
        assert counts == {int(size): count for size, count in row["by_size"].items()}


@pytest.mark.parametrize("n", [3, 4, 5, 6, 7, 8, 9])
def test_polygons_have_catalan_numbers_of_triangulations(n: int) -> None:
    catalan = [1, 1, 2, 5, 14, 42, 132, 429]
    assert count_by_size(Chirotope.of(load_instance(f"polygon:{n}"))) == {n - 2: catalan[n - 2]}


@pytest.mark.parametrize("spanning", [False, True])
@pytest.mark.parametrize("instance", ["cube:3", "moae", "grid:3,3", "random:8,2,seed=1", "random:7,3,seed=3"])
def test_all_that_is_found_are_different_triangulations(instance: str, spanning: bool) -> None:
    configuration = load_instance(instance)
    chirotope = Chirotope.of(configuration)
    simplices = candidate_simplices(chirotope, spanning=spanning)
    found = list(triangulations(chirotope, spanning=spanning))
    assert len(set(found)) == len(found) > 0
    for columns in found:
        assert list(columns) == sorted(columns)
        assert_triangulation(configuration.scalars(), simplices[list(columns)].tolist(), spanning=spanning)


def number_by_exhaustion(points: list[list[int]], *, spanning: bool) -> int:
    """Count the sets of simplices that are triangulations, by trying all sets of at most the possible sizes."""
    candidates = [s for s in full_simplices(points) if not spanning or is_empty(points, s)]
    count = 0
    for size in range(1, 2 * len(points)):
        for chosen in combinations(candidates, size):
            try:
                assert_triangulation(points, chosen, spanning=spanning)
            except AssertionError:
                continue
            count += 1
    return count


@settings(max_examples=8, deadline=None)
@given(
    st.lists(st.lists(st.integers(0, 2), min_size=2, max_size=2), min_size=4, max_size=5, unique_by=tuple),
    st.booleans(),
)
def test_exhaustion_over_all_sets_of_simplices_finds_no_more(values: list[list[int]], spanning: bool) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    chirotope = Chirotope.of(configuration)
    expected = number_by_exhaustion(configuration.scalars(), spanning=spanning)
    assert sum(count_by_size(chirotope, spanning=spanning).values()) == expected


@settings(max_examples=20, deadline=None)
@given(
    st.lists(st.lists(st.integers(0, 3), min_size=3, max_size=3), min_size=5, max_size=7, unique_by=tuple),
    st.data(),
)
def test_the_number_does_not_depend_on_labels_or_coordinates(
    values: list[list[int]], data: st.DataObject
) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    order = data.draw(st.permutations(range(configuration.n)))
    image = configuration.relabelled(order).affine_image([[1, 2, 0], [0, -1, 3], [1, 0, 1]], [1, 2, 3])
    assert count_by_size(Chirotope.of(image)) == count_by_size(Chirotope.of(configuration))


def test_spanning_triangulations_are_those_that_use_every_point() -> None:
    chirotope = Chirotope.of(load_instance("random:7,2,seed=2"))
    every = candidate_simplices(chirotope)
    using_all = {
        frozenset(map(tuple, every[list(columns)].tolist()))
        for columns in triangulations(chirotope)
        if len(np.unique(every[list(columns)])) == chirotope.n
    }
    empty_ones = candidate_simplices(chirotope, spanning=True)
    spanning = {
        frozenset(map(tuple, empty_ones[list(columns)].tolist()))
        for columns in triangulations(chirotope, spanning=True)
    }
    assert spanning == using_all
    assert len(spanning) > 1

from __future__ import annotations

from itertools import combinations
from math import comb

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bcut.geometry.subsets import all_subsets, face_positions, ranks, without

SIZES = [(n, k) for n in range(9) for k in range(n + 1)]


@pytest.mark.parametrize(("n", "k"), SIZES)
def test_every_subset_is_listed_once_in_colexicographic_order(n: int, k: int) -> None:
    listed = all_subsets(n, k)
    assert listed.shape == (comb(n, k), k)
    expected = sorted(combinations(range(n), k), key=lambda subset: subset[::-1])
    assert [tuple(row) for row in listed.tolist()] == expected


@pytest.mark.parametrize(("n", "k"), SIZES)
def test_the_rank_of_a_subset_is_its_row(n: int, k: int) -> None:
    assert ranks(all_subsets(n, k), n).tolist() == list(range(comb(n, k)))


@given(st.lists(st.integers(0, 200), unique=True, min_size=1, max_size=5), st.integers(0, 50))
def test_ranks_do_not_depend_on_the_size_of_the_ground_set(members: list[int], more: int) -> None:
    subset = np.array(sorted(members))
    n = max(members) + 1
    expected = sum(comb(value, place + 1) for place, value in enumerate(sorted(members)))
    assert ranks(subset, n) == ranks(subset, n + more) == expected


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.int32, np.int64])
def test_ranks_beyond_the_range_of_the_members_type(dtype: type) -> None:
    subset = np.array([[97, 98, 99, 100, 101]], dtype=dtype)
    assert ranks(subset, 102).tolist() == [comb(102, 5) - 1]


def test_ranks_keep_leading_dimensions() -> None:
    table = all_subsets(6, 3).reshape(4, 5, 3)
    assert ranks(table, 6).tolist() == np.arange(20).reshape(4, 5).tolist()


@pytest.mark.parametrize("position", range(4))
def test_without_drops_one_position(position: int) -> None:
    listed = all_subsets(7, 4)
    expected = [[v for j, v in enumerate(row) if j != position] for row in listed.tolist()]
    assert without(listed, position).tolist() == expected


def test_face_positions_pick_every_face_of_a_simplex_once() -> None:
    simplex = np.array([2, 3, 5, 7])
    faces = {tuple(simplex[row].tolist()) for row in face_positions(4, 2)}
    assert faces == set(combinations((2, 3, 5, 7), 2))

"""Symmetry groups: complete, exact, and closed; their subgroups."""

from __future__ import annotations

from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest
from reference import determinant

import bcut
from bcut.errors import TooLargeError
from bcut.geometry.permutations import PermutationGroup
from bcut.geometry.subgroups import cycle_type, some_subgroups
from bcut.geometry.subsets import all_subsets
from bcut.geometry.symmetry import is_symmetry, symmetry_group
from bcut.objectives.invariance import symmetries_of_costs


@pytest.mark.parametrize(
    ("name", "order"),
    [
        ("dodecahedron", 120),
        ("icosidodecahedron", 120),
        ("24-cell", 1152),
        ("600-cell", 14_400),
        ("cube:5", 3840),
        ("cube:6", 46_080),
        ("cube:7", 645_120),
        ("cross-polytope:8", 10_321_920),
        ("hypersimplex:6,3", 1440),
        ("hypersimplex:7,3", 5040),
        ("simplex-product:2,2", 72),
        ("simplex-product:2,1,1", 48),
        ("polygon:5,center", 10),
        ("polygon:7", 14),
        ("prism:6", 24),
        ("antiprism:4", 16),
        ("grid:3,3,3", 48),
        ("grid:4,3", 4),
        ("moae", 6),
        ("cyclic:9,3", 2),
        ("random:30,3,seed=1", 1),
    ],
)
def test_orders_are_the_known_ones_and_generators_are_affine_maps(name: str, order: int) -> None:
    configuration = bcut.load_instance(name)
    group = symmetry_group(configuration)
    assert group.order == order
    assert all(is_symmetry(configuration, generator) for generator in group.generators)


@pytest.mark.parametrize(
    "points",
    [
        [(0, 0), (1, 0), (0, 1), (1, 1)],
        [(0, 0), (2, 0), (0, 1), (1, 1), (2, 3)],
        [(0, 0), (3, 0), (0, 3), (1, 1), (2, 2)],
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (-1, -1, -1)],
        [(-1, 0), (0, 0), (1, 0), (2, 0), (0, 1), (0, -1)],
        [(0, 0), (4, 1), (7, 3), (5, 9), (1, 6)],
    ],
)
def test_group_is_every_permutation_that_keeps_all_volumes_up_to_one_factor(
    points: list[tuple[int, ...]],
) -> None:
    """An affine map multiplies all determinants by its own; on few points all permutations can be tried."""
    n, d = len(points), len(points[0])
    subsets = all_subsets(n, d + 1).tolist()

    def volumes(order: tuple[int, ...]) -> list[Fraction]:
        rows = [[points[order[v]] for v in subset] for subset in subsets]
        return [
            determinant([[Fraction(a - b) for a, b in zip(p, r[0], strict=True)] for p in r[1:]])
            for r in rows
        ]

    identity = volumes(tuple(range(n)))

    def proportional(values: list[Fraction]) -> bool:
        place = next(i for i, v in enumerate(identity) if v)
        factor = values[place] / identity[place]
        return factor != 0 and all(v == factor * w for v, w in zip(values, identity, strict=True))

    expected = {order for order in permutations(range(n)) if proportional(volumes(order))}
    configuration = bcut.PointConfiguration.from_values(points)
    assert set(map(tuple, symmetry_group(configuration).elements().tolist())) == expected
    assert {
        order for order in permutations(range(n)) if is_symmetry(configuration, np.array(order))
    } == expected


def test_affine_images_and_new_orders_have_the_same_group() -> None:
    configuration = bcut.load_instance("prism:5")
    group = symmetry_group(configuration)
    sheared = configuration.affine_image(
        [[1, 5, Fraction(1, 3)], [0, 2, 7], [0, 0, Fraction(-3, 11)]], [1, 2, 3]
    )
    assert symmetry_group(sheared).order == group.order
    order = np.random.default_rng(4).permutation(configuration.n)
    moved = symmetry_group(configuration.relabelled(order))
    assert moved.order == group.order
    places = np.argsort(order)
    assert all(places[element[order]] in moved for element in group.elements())


def test_a_tiny_move_breaks_the_symmetry() -> None:
    points = bcut.load_instance("cube:3").floats.copy()
    points[0, 0] += 2.0**-50
    configuration = bcut.PointConfiguration.from_values(points)
    assert symmetry_group(configuration).order == 2
    assert not is_symmetry(configuration, symmetry_group(bcut.load_instance("cube:3")).generators[-1])


def test_what_is_no_permutation_is_no_symmetry() -> None:
    square = bcut.load_instance("cube:2")
    assert is_symmetry(square, np.array([1, 0, 3, 2]))
    assert not is_symmetry(square, np.array([1, 0, 2, 3]))
    assert not is_symmetry(square, np.array([0, 0, 2, 3]))
    assert not is_symmetry(square, np.array([0, 1, 2]))


@pytest.mark.parametrize("name", ["dodecahedron", "hypersimplex:5,2", "grid:3,3", "polygon:6"])
def test_elements_are_a_group_of_the_right_order(name: str) -> None:
    group = symmetry_group(bcut.load_instance(name))
    elements = group.elements()
    assert len(np.unique(elements, axis=0)) == len(elements) == group.order
    rng = np.random.default_rng(0)
    for _ in range(50):
        first, second = elements[rng.integers(len(elements), size=2)]
        assert first[second] in group
    assert rng.permutation(group.n) not in group
    assert [1, 2] not in group


def test_transporters_lead_to_the_least_point_of_each_orbit() -> None:
    group = symmetry_group(bcut.load_instance("grid:4,3,2"))
    least = group.point_orbits()
    elements = group.elements()
    assert np.array_equal(least, elements.min(axis=0))
    for point, element in enumerate(group.transporters()):
        assert element[point] == least[point]
        assert element in group


@pytest.mark.parametrize("name", ["24-cell", "grid:3,3,3"])
def test_stabilisers_are_the_elements_that_fix_the_point(name: str) -> None:
    group = symmetry_group(bcut.load_instance(name))
    elements = group.elements()
    for point in range(0, group.n, 5):
        found = group.stabiliser(point)
        expected = elements[elements[:, point] == point]
        assert set(map(bytes, found)) == set(map(bytes, expected))


def test_too_large_groups_are_not_listed_but_reduced() -> None:
    group = symmetry_group(bcut.load_instance("cross-polytope:8"))
    with pytest.raises(TooLargeError):
        group.elements()
    smaller = group.reduced(50_000)
    assert 1 < smaller.order <= 50_000
    assert len(smaller.elements()) == smaller.order
    assert all(element in group for element in smaller.elements()[:100])
    assert PermutationGroup.generated_by(smaller.generators, group.n).order == smaller.order
    assert group.reduced(group.order) is group


def test_generated_groups_have_all_products() -> None:
    group = symmetry_group(bcut.load_instance("cube:4"))
    again = PermutationGroup.generated_by(group.generators, group.n)
    assert again.order == group.order
    assert PermutationGroup.generated_by(again.generators, group.n).order == group.order
    with pytest.raises(TooLargeError):
        PermutationGroup.generated_by(group.generators, group.n, limit=100)
    assert PermutationGroup.generated_by(group.generators[:0], group.n).is_trivial


def test_costs_leave_the_symmetries_that_fix_them() -> None:
    group = symmetry_group(bcut.load_instance("cube:3"))
    simplices = all_subsets(8, 4)
    assert symmetries_of_costs(group, simplices, np.ones(len(simplices), dtype=np.int64)) is group
    # One simplex is marked: what is left fixes it as a set.
    marked = np.array([[0, 1, 2, 4]])
    left = symmetries_of_costs(group, marked, np.array([5]))
    assert left.order == 6
    assert np.array_equal(np.unique(np.sort(left.elements()[:, marked[0]], axis=1), axis=0), marked)
    costs = np.array([hash(tuple(s)) % 1000 for s in simplices.tolist()], dtype=np.int64)
    assert symmetries_of_costs(group, simplices, costs).order == 1


def test_subgroups_are_of_different_kinds_and_within_the_group() -> None:
    group = symmetry_group(bcut.load_instance("cube:4"))
    subgroups = some_subgroups(group, largest=48, seed=3)
    orders = [subgroup.order for subgroup in subgroups]
    assert orders == sorted(orders, reverse=True)
    assert {2, 3, 4, 6, 8} <= set(orders)
    kinds = [sorted(map(cycle_type, subgroup.elements())) for subgroup in subgroups]
    assert all(kinds[i] != kinds[j] for i in range(len(kinds)) for j in range(i))
    assert all(element in group for subgroup in subgroups for element in subgroup.generators)
    assert some_subgroups(PermutationGroup.trivial(5)) == []

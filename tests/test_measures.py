"""Measures of simplices against formulas of other kinds, and what must not change them."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from reference import configuration_or_none, signed_volume
from slow_measures import SLOW, one, volume_by_cayley_and_menger, weight_of

from bcut.errors import InputError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.objectives.geometric import facet_volumes
from bcut.objectives.measures import exact, measured
from bcut.objectives.objective import make_objective

# One simplex with known shape each.
REGULAR = {
    2: [[0, 0], [1, 0], ["1/2", "sqrt(3)/2"]],
    3: [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]],
    4: [
        [1, 1, 1, "-1/sqrt(5)"],
        [1, -1, -1, "-1/sqrt(5)"],
        [-1, 1, -1, "-1/sqrt(5)"],
        [-1, -1, 1, "-1/sqrt(5)"],
        [0, 0, 0, "4/sqrt(5)"],
    ],
}
CORNER = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]


def known_in(measure: str, d: int) -> bool:
    return {"min-angle": d == 2, "solid-angle": d == 3}.get(measure, True)


@pytest.mark.parametrize(("d", "points"), REGULAR.items())
def test_regular_simplices(d: int, points: Any) -> None:
    assert one(points, "aspect-ratio") == pytest.approx(d, rel=1e-14)
    assert one(points, "dihedral-angle") == pytest.approx(math.acos(1 / d), rel=1e-14)
    if d == 2:
        assert one(points, "min-angle") == pytest.approx(math.pi / 3, rel=1e-14)
    if d == 3:
        assert one(points, "solid-angle") == pytest.approx(3 * math.acos(1 / 3) - math.pi, rel=1e-13)


def test_the_corner_of_a_cube() -> None:
    assert one(CORNER, "volume") == Fraction(1, 6)
    assert one(CORNER, "weight") == pytest.approx(1.5 + math.sqrt(3) / 2, rel=1e-15)
    inradius = 0.5 / (1.5 + math.sqrt(3) / 2)
    assert one(CORNER, "aspect-ratio") == pytest.approx(math.sqrt(3) / 2 / inradius, rel=1e-14)
    assert one(CORNER, "dihedral-angle") == pytest.approx(math.acos(1 / math.sqrt(3)), rel=1e-14)
    # The other three vertices share what eight such corners leave of the full angles: by Girard again.
    assert one(CORNER, "solid-angle") == pytest.approx(
        math.pi / 2 + 2 * math.acos(1 / math.sqrt(3)) - math.pi, rel=1e-13
    )


def test_a_right_triangle() -> None:
    points = [[0, 0], [3, 0], [0, 4]]
    assert one(points, "aspect-ratio") == pytest.approx(2.5, rel=1e-15)
    assert one(points, "min-angle") == pytest.approx(math.atan2(3, 4), rel=1e-15)
    assert one(points, "weight") == 12
    assert one(points, "volume") == 6


@pytest.mark.parametrize("d", [2, 3, 4, 5])
def test_random_simplices_against_slow_formulas(d: int) -> None:
    configuration = PointConfiguration.from_values(np.random.default_rng(d).random((d + 5, d)))
    simplices = Chirotope.of(configuration).bases
    points = configuration.floats
    for measure, slow in SLOW.items():
        if known_in(measure, d):
            found = measured(measure, configuration, simplices)
            expected = [slow(points[simplex].tolist()) for simplex in simplices]
            np.testing.assert_allclose(found, expected, rtol=1e-6)
    facets = simplices[:, 1:]
    expected = [volume_by_cayley_and_menger(points[facet].tolist()) for facet in facets]
    np.testing.assert_allclose(facet_volumes(configuration, facets), expected, rtol=1e-6)


@pytest.mark.parametrize("instance", ["icosahedron", "prism:5", "moae", "grid:3,3", "polygon:7,center"])
def test_named_configurations_against_slow_formulas(instance: str) -> None:
    configuration = load_instance(instance)
    simplices = Chirotope.of(configuration).bases
    scalars = configuration.scalars()
    for measure, slow in SLOW.items():
        if known_in(measure, configuration.dimension):
            found = measured(measure, configuration, simplices)
            expected = [slow(configuration.floats[simplex].tolist()) for simplex in simplices]
            np.testing.assert_allclose(found, expected, rtol=1e-9)
    volumes = exact(measured("volume", configuration, simplices))
    d = configuration.dimension
    for simplex, volume in zip(simplices.tolist(), volumes, strict=True):
        expected_volume = abs(float_of(signed_volume(scalars, simplex))) / math.factorial(d)
        assert float(volume) == pytest.approx(expected_volume, rel=1e-14)


def float_of(value: Any) -> float:
    if isinstance(value, Fraction):
        return float(value)
    return value.field.nearest_float(*value.integers())


@pytest.mark.parametrize(
    ("instance", "spanning"),
    [
        ("random:7,2,seed=3", False),
        ("grid:3,3", True),
        ("polygon:6,center", False),
        ("random:7,3,seed=1", False),
        ("prism:4", True),
        ("random:7,4,seed=2", True),
        ("moae", False),
    ],
)
def test_the_costs_of_a_triangulation_add_up_to_its_weight(instance: str, spanning: bool) -> None:
    configuration = load_instance(instance)
    formulation = cocircuit_formulation(configuration, spanning=spanning)
    objective = make_objective("weight", formulation)
    for number, columns in enumerate(triangulations(formulation.chirotope, spanning=spanning)):
        simplices = formulation.simplices[list(columns)].tolist()
        assert float(objective.value(columns)) == pytest.approx(weight_of(configuration, simplices), rel=1e-7)
        if number == 30:
            break


def test_volumes_of_rational_points_are_exact_and_add_up() -> None:
    configuration = PointConfiguration.from_values(
        [["1/3", 0], [1, "1/7"], [0, 1], ["2/5", "1/2"], [2, 2], ["1/9", "3/4"]]
    )
    formulation = cocircuit_formulation(configuration)
    objective = make_objective("volume", formulation)
    assert len({objective.value(t) for t in triangulations(formulation.chirotope)}) == 1
    scalars = configuration.scalars()
    expected = [abs(signed_volume(scalars, simplex)) / 2 for simplex in formulation.simplices.tolist()]
    assert objective.exact_costs(range(len(expected))) == expected


# What must not change a measure.

MEASURES = ["weight", "aspect-ratio", "dihedral-angle", "solid-angle", "min-angle", "volume"]


@given(st.integers(2, 4), st.integers(0, 10**6), st.randoms())
def test_a_cost_does_not_depend_on_the_other_simplices(d: int, seed: int, random: Any) -> None:
    rng = np.random.default_rng(seed)
    configuration = PointConfiguration.from_values(rng.random((d + 4, d)))
    simplices = Chirotope.of(configuration).bases
    order = list(range(len(simplices)))
    random.shuffle(order)
    some = order[: random.randint(1, len(order))]
    for measure in MEASURES:
        if known_in(measure, d):
            whole = exact(measured(measure, configuration, simplices))
            assert exact(measured(measure, configuration, simplices[some])) == [whole[i] for i in some]


@given(
    st.integers(2, 3),
    st.integers(0, 10**6),
    st.lists(st.integers(-(2**20), 2**20), min_size=3, max_size=3),
    st.integers(-40, 40),
)
def test_translations_and_powers_of_two_change_no_bit(d: int, seed: int, shift: Any, power: int) -> None:
    values = np.random.default_rng(seed).integers(0, 2**20, size=(d + 4, d)).tolist()
    before = configuration_or_none(values)
    assume(before is not None)
    scale = Fraction(2) ** power
    after = before.affine_image(np.diag([scale] * d).tolist(), shift[:d])
    simplices = Chirotope.of(before).bases
    factors = {"weight": scale ** (d - 1), "volume": scale**d}
    for measure in MEASURES:
        if known_in(measure, d):
            old, new = (exact(measured(measure, points, simplices)) for points in (before, after))
            factor = factors.get(measure, 1)
            assert [cost * factor for cost in old] == new


# Rational rotations.
TURNS = {
    2: [["3/5", "-4/5"], ["4/5", "3/5"]],
    3: [["2/3", "-1/3", "2/3"], ["2/3", "2/3", "-1/3"], ["-1/3", "2/3", "2/3"]],
}


@given(st.integers(2, 3), st.integers(0, 10**6), st.fractions("1/1000", 1000))
def test_rotations_and_scalings(d: int, seed: int, scale: Fraction) -> None:
    before = PointConfiguration.from_values(np.random.default_rng(seed).random((d + 3, d)))
    matrix = [[Fraction(entry) * scale for entry in row] for row in TURNS[d]]
    after = before.affine_image(matrix)
    simplices = Chirotope.of(before).bases
    factors = {"weight": scale ** (d - 1), "volume": scale**d}
    for measure in MEASURES:
        if known_in(measure, d):
            old, new = (exact(measured(measure, points, simplices)) for points in (before, after))
            expected = [float(cost * factors.get(measure, 1)) for cost in old]
            np.testing.assert_allclose([float(cost) for cost in new], expected, rtol=1e-8)


@given(st.integers(2, 3), st.integers(0, 10**6), st.randoms())
def test_relabelling(d: int, seed: int, random: Any) -> None:
    before = PointConfiguration.from_values(np.random.default_rng(seed).random((d + 3, d)))
    permutation = list(range(before.n))
    random.shuffle(permutation)
    after = before.relabelled(permutation)
    simplices = Chirotope.of(after).bases
    images = np.sort(np.array(permutation)[simplices], axis=1)
    for measure in MEASURES:
        if known_in(measure, d):
            old, new = exact(measured(measure, before, images)), exact(measured(measure, after, simplices))
            np.testing.assert_allclose([float(c) for c in new], [float(c) for c in old], rtol=1e-8)


@pytest.mark.parametrize(
    ("text", "instance", "message"),
    [
        ("min-angle", "cube:3", r"min-angle.* is for triangles, .*dimension 3; take dihedral-angle or solid"),
        ("min-angle", "cube:4", r"dimension 4; take dihedral-angle$"),
        ("solid-angle", "cube:2", r"solid-angle.* is for tetrahedra, .*dimension 2; take min-angle"),
        ("solid-angle", "cube:4", r"dimension 4; take dihedral-angle"),
        *[(f"{name}:3", "cube:3", f"'{name}' takes no argument, but got '3'") for name in MEASURES],
        ("wieght", "cube:2", "did you mean 'weight'"),
    ],
)
def test_bad_measures_are_refused(text: str, instance: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make_objective(text, cocircuit_formulation(load_instance(instance)))

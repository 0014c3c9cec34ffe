"""Signs of determinants are exact on every tier, and the filter's error bound holds."""

from __future__ import annotations

from fractions import Fraction
from itertools import permutations
from math import nextafter
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from reference import configuration_or_none, determinant, integral, orientation, sign

from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.determinants import _differences, _Kernel, determinants, orientation_signs
from bcut.geometry.subsets import all_subsets


def assert_exact(configuration: PointConfiguration) -> None:
    points = integral(configuration.scalars())
    tuples = all_subsets(configuration.n, configuration.dimension + 1)
    expected = [orientation(points, row) for row in tuples.tolist()]
    assert orientation_signs(configuration, tuples).tolist() == expected


@st.composite
def integer_points(draw: st.DrawFn, bits: int) -> list[list[int]]:
    """Some points, and some more on lines and planes through them, or nearly so."""
    d = draw(st.integers(2, 5))
    coordinate = st.integers(-(2**bits), 2**bits)
    free = draw(st.lists(st.lists(coordinate, min_size=d, max_size=d), min_size=d + 1, max_size=d + 2))
    for _ in range(draw(st.integers(0, 2))):
        weights = draw(st.lists(st.integers(-2, 2), min_size=d - 1, max_size=d - 1))
        origin, *others = free[:d]
        nudge = draw(st.lists(st.integers(-1, 1), min_size=d, max_size=d))
        free.append(
            [
                origin[j]
                + sum(w * (p[j] - origin[j]) for w, p in zip(weights, others, strict=True))
                + nudge[j]
                for j in range(d)
            ]
        )
    return free


@pytest.mark.parametrize("bits", [3, 5, 9, 15, 20, 30, 31, 40, 53, 61, 62, 63, 64, 80])
def test_signs_of_integers_of_any_size(bits: int) -> None:
    @settings(max_examples=25, deadline=None)
    @given(integer_points(bits))
    def check(values: list[list[int]]) -> None:
        configuration = configuration_or_none(values)
        assume(configuration is not None)
        assert_exact(configuration)

    check()


@settings(max_examples=60, deadline=None)
@given(
    st.integers(2, 4),
    st.integers(0, 2**32),
    st.lists(st.tuples(st.integers(0, 5), st.floats(-2, 2), st.integers(-3, 3)), min_size=2, max_size=4),
)
def test_signs_of_doubles_that_are_collinear_up_to_a_few_units_in_the_last_place(
    d: int, seed: int, nearly: list[tuple[int, float, int]]
) -> None:
    points = np.random.default_rng(seed).random((d + 1, d)).tolist()
    for start, step, ulps in nearly:
        a, b = points[start % len(points)], points[(start + 1) % len(points)]
        new = [x + step * (y - x) for x, y in zip(a, b, strict=True)]
        for _ in range(abs(ulps)):
            new[start % d] = nextafter(new[start % d], np.inf if ulps > 0 else -np.inf)
        points.append(new)
    configuration = configuration_or_none(points)
    assume(configuration is not None)
    assert_exact(configuration)


def test_a_grid_of_doubles_a_few_units_apart_near_one_half() -> None:
    unit = 2.0**-53
    points = [[0.5 + i * unit, 0.5 + j * unit] for i in range(4) for j in range(4)]
    points += [[12.0, 12.0], [24.0, 24.0]]
    assert_exact(PointConfiguration.from_values(points))


@settings(max_examples=40, deadline=None)
@given(
    st.lists(
        st.tuples(*[st.floats(allow_nan=False, allow_infinity=False, min_value=-1e200, max_value=1e200)] * 2),
        min_size=4,
        max_size=5,
        unique=True,
    )
)
def test_signs_of_doubles_of_any_exponent(points: list[tuple[float, float]]) -> None:
    configuration = configuration_or_none([list(p) for p in points])
    assume(configuration is not None)
    assert_exact(configuration)


def test_signs_of_coordinates_on_very_different_scales() -> None:
    rng = np.random.default_rng(5)
    points = rng.integers(-9, 10, size=(7, 3)).astype(float) * np.array([1e-200, 1.0, 1e200])
    assert_exact(PointConfiguration.from_values(points))


ALGEBRAIC = [
    ["1", "sqrt(2)"],
    ["1", "sqrt(2)", "sqrt(3)", "sqrt(6)"],
    ["1", "cos(2*pi/5)"],
    ["1", "cos(2*pi/7)", "cos(4*pi/7)"],
    ["1/3", "cos(2*pi/9)", "sqrt(5)"],
]


@pytest.mark.parametrize("terms", ALGEBRAIC)
@pytest.mark.parametrize("size", [3, 10**4, 10**12, 2**70])
def test_signs_of_algebraic_coordinates(terms: list[str], size: int) -> None:
    rng = np.random.default_rng(len(terms) * 1000 + size % 997)

    def text(factor: int) -> str:
        return "+".join(f"{factor * int(rng.integers(-3, 4)) + int(rng.integers(-2, 3))}*{t}" for t in terms)

    for d in (2, 3):
        points: list[Any] = [[text(size) for _ in range(d)] for _ in range(d + 2)]
        scalars = PointConfiguration.from_values(points).scalars()
        # Points on a line, and just beside it.
        on_line = [2 * b - a for a, b in zip(scalars[0], scalars[1], strict=True)]
        beside = [3 * b - 2 * a for a, b in zip(scalars[0], scalars[1], strict=True)]
        beside[0] = beside[0] + Fraction(1, 7)
        assert_exact(PointConfiguration.from_values([*map(list, scalars), on_line, beside]))


def test_an_algebraic_determinant_that_nearly_vanishes() -> None:
    # 3363/2378 is a convergent of sqrt(2): the determinant of (2378, 3363), (1, sqrt(2)) is 7.4e-5, that of the
    # convergents' next powers smaller by factors of 34.
    p, q = 3363, 2378
    for _ in range(4):
        p, q = p * p + 2 * q * q, 2 * p * q
        configuration = PointConfiguration.from_values([[0, 0], [q, p], ["1", "sqrt(2)"], [0, 1]])
        assert orientation_signs(configuration, np.array([[0, 1, 2], [0, 2, 1]])).tolist() == [-1, 1]


@pytest.mark.parametrize("d", [2, 3, 4, 5])
@pytest.mark.parametrize("bits", [6, 70])
def test_an_odd_permutation_turns_the_sign(d: int, bits: int) -> None:
    rng = np.random.default_rng(d * bits)
    points = [[int(v) << (bits - 6) for v in row] for row in rng.integers(-30, 31, size=(d + 1, d))]
    configuration = PointConfiguration.from_values(points)
    orders = np.array(list(permutations(range(d + 1))))
    parity = [1 - 2 * (sum(a > b for i, a in enumerate(row) for b in row[i + 1 :]) % 2) for row in orders]
    found = orientation_signs(configuration, orders)
    assert found[0] != 0
    assert found.tolist() == [found[0] * p for p in parity]


@pytest.mark.parametrize("d", [1, 2, 3, 4, 5, 6])
def test_determinants_by_expansion(d: int) -> None:
    rng = np.random.default_rng(d)
    matrices = rng.integers(-9, 10, size=(20, d, d))
    matrices[0, -1] = matrices[0, 0]
    expected = [determinant([[Fraction(int(v)) for v in row] for row in matrix]) for matrix in matrices]
    rows = [[matrices[:, i, j] for j in range(d)] for i in range(d)]
    assert determinants(rows).tolist() == expected


def test_more_tuples_than_one_chunk() -> None:
    points = np.random.default_rng(3).integers(-3, 4, size=(9, 2))
    configuration = PointConfiguration.from_values(np.unique(points, axis=0))
    few = all_subsets(configuration.n, 3)
    many = np.tile(few, (300_000 // len(few), 1))
    expected = np.tile(orientation_signs(configuration, few), 300_000 // len(few))
    np.testing.assert_array_equal(orientation_signs(configuration, many), expected)


@pytest.mark.parametrize(
    ("values", "integers"),
    [
        ([[0, 0], [2**29, 0], [0, 2**29]], True),
        ([[0, 0], [2**31, 0], [0, 2**31]], False),
        ([[0, 0], [2**40, 0], [0, 2**18]], True),
        ([[2**61, 0], [2**61 + 3, 1], [2**61 + 1, 5]], True),
        ([[0, 0, 0], [2**20, 0, 0], [0, 2**20, 0], [0, 0, 2**20]], False),
    ],
)
def test_64_bits_decide_exactly_where_no_minor_can_overflow(values: Any, integers: bool) -> None:
    assert _Kernel(PointConfiguration.from_values(values)).integers_decide is integers


def test_the_bound_on_field_products_is_not_computed_in_64_bits() -> None:
    # The structure constants of this field sum to more than 2**63.
    p, q, r = 2147483647, 2147483629, 2147483587
    values = [[0, 0], [f"sqrt({p * q})", 1], [f"sqrt({q * r})", f"sqrt({p * r})"], [1, 0]]
    kernel = _Kernel(PointConfiguration.from_values(values))
    assert kernel.numerators.dtype == object
    assert_exact(PointConfiguration.from_values(values))


@settings(max_examples=60, deadline=None)
@given(
    st.integers(2, 6), st.integers(0, 2**32), st.sampled_from(["1", "sqrt(2)", "cos(2*pi/7)"]), st.booleans()
)
def test_the_filter_errs_by_less_than_its_bound(d: int, seed: int, term: str, flat: bool) -> None:
    rng = np.random.default_rng(seed)
    if term == "1":
        values: list[list[Any]] = (rng.random((d + 1, d)) * 10.0 ** rng.integers(-9, 9, size=d)).tolist()
    else:
        low, high = rng.integers(-(2**60), 2**60, size=(2, d + 1, d)).tolist()
        values = [
            [f"{a}+{b}*{term}" for a, b in zip(*rows, strict=True)] for rows in zip(low, high, strict=True)
        ]
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    if flat:
        # The last point, moved into the hyperplane of the others up to rounding.
        scalars = [list(row) for row in configuration.scalars()]
        scalars[-1] = [sum(p[j] for p in scalars[:-1]) * Fraction(1, d) for j in range(d)]
        scalars[-1][0] = scalars[-1][0] * (1 + Fraction(1, 2**50))
        configuration = configuration_or_none(scalars)
        assume(configuration is not None)
    kernel = _Kernel(configuration)
    assert not kernel.integers_decide
    floating = determinants(_differences(kernel.scaled, np.arange(d + 1)[None]))[0]
    points = configuration.scalars()
    # The scale of a coordinate, as the kernel chose it, from the point where it is largest.
    exact = determinant([[a - b for a, b in zip(p, points[0], strict=True)] for p in points[1:]])
    for j in range(d):
        at = int(np.argmax(np.abs(kernel.scaled[:, j])))
        exact = exact * Fraction(float(kernel.scaled[at, j])) / (points[at][j] - points[0][j])
    # The scales are known up to the rounding of one coordinate each.
    slack = abs(exact) * (d * 4 * (configuration.field.degree + 4)) * Fraction(1, 2**53)
    assert abs(exact - Fraction(float(floating))) <= Fraction(kernel.error_bound) + slack
    assert sign(floating) == sign(exact) or abs(floating) <= kernel.error_bound

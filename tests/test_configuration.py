"""Point configurations: exactness, identity, checks."""

from __future__ import annotations

import pickle
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from bcut.errors import ConfigurationError
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.numbers import RATIONALS, parse_number

SQUARE = [[0, 0], [1, 0], [0, 1], [1, 1]]
FLOATS = st.floats(allow_nan=False, allow_infinity=False, width=64)


def configured(values: Any) -> PointConfiguration:
    """A configuration, dropping the examples that are none."""
    try:
        return PointConfiguration.from_values(values)
    except ConfigurationError as error:
        assume(("equal" not in str(error)) and ("hyperplane" not in str(error)))
        raise


def rebuilt(configuration: PointConfiguration) -> list[list[Fraction]]:
    """The coordinates from the documented meaning of numerators and denominator, for rational ones."""
    numerators = configuration.numerators[:, :, 0].tolist()
    return [[Fraction(value, configuration.denominator) for value in row] for row in numerators]


@settings(max_examples=150, deadline=None)
@given(hnp.arrays(np.float64, st.tuples(st.integers(4, 7), st.integers(2, 3)), elements=FLOATS))
def test_floats_are_taken_exactly(values: np.ndarray) -> None:
    configuration = configured(values)
    assert rebuilt(configuration) == [[Fraction(x) for x in row] for row in values.tolist()]
    np.testing.assert_array_equal(configuration.floats, values)
    assert configuration == configured(values.tolist())
    limit = max(abs(v) for v in configuration.numerators.ravel().tolist())
    assert (configuration.numerators.dtype == np.int64) == (limit < 2**62)


@settings(max_examples=80, deadline=None)
@given(hnp.arrays(np.float64, (6, 2), elements=st.floats(-4, 4, width=16)))
def test_the_digest_depends_on_the_points_alone(values: np.ndarray) -> None:
    values = np.round(values * 4)
    configuration = configured(values)
    others = [
        values.astype(np.int32),
        values.astype(np.float32),
        values.astype(int).tolist(),
        values.astype(object),
        [[Fraction(int(x)) for x in row] for row in values],
        [[f"{int(x)}/1" for x in row] for row in values],
        [[np.int8(x), float(y)] for x, y in values],
    ]
    for index, other in enumerate(others):
        again = PointConfiguration.from_values(other, name=f"other {index}")
        assert again.digest == configuration.digest
        assert again == configuration
        assert hash(again) == hash(configuration)
        assert again.exact_points() == configuration.exact_points()
    moved = values + np.array([1.0, 0.0])
    assert configured(moved).digest != configuration.digest


def test_mixed_coordinates_share_one_field() -> None:
    points = [[0, 0.5], ["1/3", Fraction(1, 7)], [parse_number("sqrt(3)/2"), "cos(2*pi/7)"], [1, "-1"]]
    configuration = PointConfiguration.from_values(points, name="mixed")
    assert configuration.field.degree == 6
    assert configuration.numerators.shape == (4, 2, 6)
    assert configuration.denominator == 42
    basis = configuration.field.basis_floats
    np.testing.assert_allclose(
        configuration.numerators @ basis / configuration.denominator, configuration.floats, rtol=1e-15
    )
    np.testing.assert_allclose(configuration.floats[2], [3**0.5 / 2, np.cos(2 * np.pi / 7)], rtol=1e-15)
    assert configuration.exact_points()[2] == ("1/2*sqrt(3)", "cos(2*pi/7)")
    again = PointConfiguration.from_values(configuration.exact_points())
    assert again.digest == configuration.digest
    assert again.field == configuration.field
    np.testing.assert_array_equal(again.numerators, configuration.numerators)
    assert [[float(x) for x in row] for row in again.scalars()] == configuration.floats.tolist()


def test_configurations_in_different_fields_are_compared_exactly() -> None:
    plain = PointConfiguration.from_values([[0, 0], ["sqrt(13)", 0], [0, 1]])
    cosines = PointConfiguration.from_values(
        [[0, 0], ["1+4*(cos(2*pi/13)+cos(6*pi/13)+cos(8*pi/13))", 0], [0, 1]]
    )
    assert cosines.field != plain.field
    assert cosines == plain
    assert hash(cosines) == hash(plain)
    assert plain != PointConfiguration.from_values([[0, 0], [13**0.5, 0], [0, 1]])


def test_rational_configurations_have_degree_one_and_lowest_terms() -> None:
    configuration = PointConfiguration.from_values(
        [["2/4", 0], [0, "6/4"], ["sqrt(2)**2", "sqrt(2)*sqrt(2)/2"]]
    )
    assert configuration.field is RATIONALS
    assert configuration.denominator == 2
    assert configuration.numerators[:, :, 0].tolist() == [[1, 0], [0, 3], [4, 2]]
    assert configuration.scalars()[0] == (Fraction(1, 2), Fraction(0))
    assert type(configuration.scalars()[0][0]) is Fraction


def test_large_integers_stay_exact() -> None:
    big = 2**62
    configuration = PointConfiguration.from_values([[big, 0], [big + 1, 0], [big, 1]])
    assert configuration.numerators.dtype == object
    assert configuration.numerators[1, 0, 0] == big + 1
    # Shifted down it fits, and equality is that of the points.
    small = configuration.affine_image([[1, 0], [0, 1]], [-big, 0])
    assert small.numerators.dtype == np.int64
    assert small == PointConfiguration.from_values([[0, 0], [1, 0], [0, 1]])
    unsigned = PointConfiguration.from_values(np.array([[2**63, 0], [0, 1], [5, 5]], dtype=np.uint64))
    assert unsigned.numerators[0, 0, 0] == 2**63


def test_thirty_thousand_points_are_read_and_identified() -> None:
    points = np.random.default_rng(7).random((30_000, 3))
    configuration = PointConfiguration.from_values(points)
    assert configuration.n == len(configuration) == 30_000
    assert configuration.denominator == 2**53
    assert configuration.numerators.dtype == np.int64
    np.testing.assert_array_equal(configuration.floats, points)


def test_arrays_are_read_only_and_attributes_fixed() -> None:
    configuration = PointConfiguration.from_values(SQUARE, name="square")
    with pytest.raises(ValueError, match="read-only"):
        configuration.numerators[0, 0, 0] = 5
    with pytest.raises(ValueError, match="read-only"):
        configuration.floats[0, 0] = 5
    with pytest.raises(AttributeError):
        configuration.name = "other"  # type: ignore[misc]
    assert repr(configuration) == "<PointConfiguration square: 4 points in dimension 2>"


def test_the_callers_array_is_not_shared() -> None:
    for kind in (np.int64, np.float64):
        points = np.array([[0, 0], [4, 0], [0, 4]], dtype=kind)
        configuration = PointConfiguration.from_values(points)
        points[0, 0] = 2
        assert configuration.exact_points()[0] == ("0", "0")


def test_configurations_survive_pickling() -> None:
    configuration = PointConfiguration.from_values([[0, 0], [1, "sqrt(2)"], ["cos(2*pi/7)", 5]], name="x")
    again = pickle.loads(pickle.dumps(configuration))
    assert (again, again.name, again.field) == (configuration, "x", configuration.field)


def test_relabelling_moves_points() -> None:
    configuration = PointConfiguration.from_values(SQUARE)
    moved = configuration.relabelled([3, 1, 0, 2])
    assert moved.exact_points() == tuple(configuration.exact_points()[i] for i in (3, 1, 0, 2))
    assert moved != configuration
    with pytest.raises(ValueError, match="permutation"):
        configuration.relabelled([0, 0, 1, 2])


def test_affine_images_are_exact() -> None:
    configuration = PointConfiguration.from_values([[0, 0], [1, "sqrt(2)"], ["1/3", 1]])
    image = configuration.affine_image([[2, 1], ["1/2", -1]], ["1/7", 0])
    expected = [["1/7", 0], ["15/7+sqrt(2)", "1/2-sqrt(2)"], ["38/21", "-5/6"]]
    assert image == PointConfiguration.from_values(expected)
    back = image.affine_image([["2/5", "2/5"], ["1/5", "-4/5"]]).affine_image(
        [[1, 0], [0, 1]], ["-2/35", "-1/35"]
    )
    assert back == configuration
    with pytest.raises(ConfigurationError, match="hyperplane"):
        configuration.affine_image([[1, 2], [2, 4]])
    with pytest.raises(ValueError, match="2 x 2"):
        configuration.affine_image([[1, 2, 3]])


def test_nearly_degenerate_points_are_decided_exactly() -> None:
    tiny = Fraction(1, 2**200)
    PointConfiguration.from_values([[0, 0], [1, 1], [2, 2 + tiny]])
    PointConfiguration.from_values([[0.1, 0.1], [0.2, 0.2], [0.3, np.nextafter(0.3, 1)]])
    with pytest.raises(ConfigurationError, match="dimension 1 of 2"):
        PointConfiguration.from_values([[0.1, 0.1], [0.2, 0.2], [0.3, 0.3]])
    # All nearest floats are equal here; the points are neither equal nor on a line.
    PointConfiguration.from_values([[1 + tiny, 1], [1, 1], [1, 1 + tiny]])
    with pytest.raises(ConfigurationError, match="dimension 1 of 2"):
        PointConfiguration.from_values([[1 + tiny, 1 + tiny], [1, 1], [1 - tiny, 1 - tiny]])
    # sqrt(6) = sqrt(2) sqrt(3) makes these lie on a line, which no precision shows.
    line = [[0, 0], ["sqrt(2)", "sqrt(3)"], [2, "sqrt(6)"]]
    with pytest.raises(ConfigurationError, match="dimension 1 of 2"):
        PointConfiguration.from_values(line)
    PointConfiguration.from_values([*line[:2], [2, parse_number("sqrt(6)") + tiny]])


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 3), st.integers(0, 2**32 - 1), st.booleans())
def test_the_rank_of_flat_points_is_reported(rank: int, seed: int, scaled: bool) -> None:
    rng = np.random.default_rng(seed)
    points = rng.integers(-5, 6, size=(12, rank)) @ rng.integers(-5, 6, size=(rank, 4))
    points = np.unique(points + rng.integers(-100, 100, size=4), axis=0)
    assume(len(points) >= 5)
    true_rank = int(np.linalg.matrix_rank(points - points[0]))  # small integers: no doubt about it
    values: Any = [[parse_number("sqrt(5)") * int(x) for x in row] for row in points] if scaled else points
    with pytest.raises(ConfigurationError, match=f"dimension {true_rank} of 4"):
        PointConfiguration.from_values(values)


@pytest.mark.parametrize(
    ("values", "fragment"),
    [
        ([], "no points"),
        (np.zeros((0, 3)), "no points"),
        (5, "must be a list"),
        ("abc", "must be a list"),
        (None, "must be a list"),
        ([1, 2, 3], "point 0 .* is 1, not a list"),
        ([[0, 0], "01", [1, 1]], "point 1 .* not a list"),
        ([{"x": 1}], "not a list"),
        ([[0], [1], [2]], "dimension must be at least 2"),
        ([[], [], []], "dimension must be at least 2"),
        ([[0, 0], [1, 0]], "at least 3 are needed"),
        ([[0, 0], [1, 0, 0], [0, 1]], "point 1 has 3 coordinates but point 0 has 2"),
        ([[0, 0], [1, 0], [0, 1], [1.0, "0"]], "points 1 and 3 .* equal"),
        (np.array([[0, 0], [1, 0], [0, 1], [0, 0]]), "points 0 and 3 .* equal"),
        ([[0, 0], ["sqrt(2)", 1], [1, 0], ["2/sqrt(2)", 1]], "points 1 and 3 .* equal"),
        ([[10**30, 0], [1, 0], [0, 1], [10**30, 0]], "points 0 and 3 .* equal"),
        ([[0, 0], [1, 1], [2, 2], [5, 5]], "dimension 1 of 2"),
        ([[0, 0, 7], [1, 0, 7], [0, 1, 7], [3, 4, 7]], "dimension 2 of 3"),
        ([[0, 0], [1, float("nan")], [0, 1]], "coordinate 1 of point 1 .* nan"),
        (np.array([[0, 0], [1, 0], [np.inf, 1]]), "coordinate 0 of point 2 .* inf"),
        ([[0, 0], [1, "Infinity"], [0, 1]], "finite"),
        ([[0, 0], [1, 10**309], [0, 1]], "coordinate 1 of point 1 .* range of float64"),
        ([[0, 0], [1, "sqrt(2)*10**320"], [0, 1]], "range of float64"),
        ([[0, 0], [1, True], [0, 1]], "coordinate 1 of point 1 .* True"),
        ([[0, 0], [1, None], [0, 1]], "None, not an integer"),
        ([[0, 0], [1, [2]], [0, 1]], r"is \[2\], not an integer"),
        ([[0, 0], [1, 1j], [0, 1]], "not an integer"),
        (np.array([[0, 1j], [1, 0], [0, 1]]), "complex"),
        (np.zeros((2, 2), dtype=bool), "bool"),
        (np.zeros(3), "shape"),
        (np.zeros((2, 2, 2)), "shape"),
        ([[0, 0], [1, "x"], [0, 1]], "coordinate 1 of point 1 .*'x'"),
        ([[f"1/{2**13000 + k}", 1] for k in (1, 3, 7)], "common denominator"),
    ],
)
def test_bad_points_are_refused_with_what_and_where(values: Any, fragment: str) -> None:
    with pytest.raises(ConfigurationError, match=fragment) as caught:
        PointConfiguration.from_values(values, name="mine")
    assert str(caught.value).startswith("mine: ")
    assert len(str(caught.value)) < 400
    with pytest.raises(ConfigurationError, match=r"^points\.csv: "):
        PointConfiguration.from_values(values, name="mine", origin="points.csv")

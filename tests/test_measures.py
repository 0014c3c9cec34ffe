"""Measures of simplices against formulas of other kinds, and what must not change them."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from reference import configuration_or_none, signed_volume

from bcut.bounds.safe import safe_bound
from bcut.errors import InputError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.boundary import lie_in_boundary
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.determinants import determinants, minors
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.objectives.arctangent import arctangent2
from bcut.objectives.geometric import facet_volumes
from bcut.objectives.measures import exact, measured
from bcut.objectives.objective import Objective, from_fractions, make_objective

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


def one(values: Any, measure: str) -> Any:
    """The measure of the simplex on d + 1 points, exact where it is."""
    configuration = PointConfiguration.from_values(values)
    simplex = np.arange(configuration.n)[None, :]
    return exact(measured(measure, configuration, simplex))[0]


# Slow formulas in floating point, on the points of one simplex.


def distances(points: Any) -> list[float]:
    return [math.dist(a, b) for a, b in combinations(points, 2)]


def volume_by_cayley_and_menger(points: Any) -> float:
    """Volume of a simplex of any dimension from its edge lengths."""
    k = len(points) - 1
    matrix = np.ones((k + 2, k + 2))
    matrix[0, 0] = 0
    for i, a in enumerate(points):
        for j, b in enumerate(points):
            matrix[i + 1, j + 1] = math.dist(a, b) ** 2
    square = (-1) ** (k + 1) * np.linalg.det(matrix) / (2**k * math.factorial(k) ** 2)
    return math.sqrt(max(square, 0.0))


def facets_of(points: Any) -> list[Any]:
    return [[p for j, p in enumerate(points) if j != i] for i in range(len(points))]


def ratio_of_radii(points: Any) -> float:
    base, others = np.array(points[0]), np.array(points[1:])
    edges = others - base
    centre = np.linalg.solve(2 * edges, (edges**2).sum(axis=1))
    surface = sum(volume_by_cayley_and_menger(facet) for facet in facets_of(points))
    volume = abs(np.linalg.det(edges)) / math.factorial(len(edges))
    return float(np.linalg.norm(centre) / (len(edges) * volume / surface))


def dihedral_angles(points: Any) -> list[float]:
    """Angles between facets, by projecting the two other vertices along the ridge."""
    points = np.array(points)
    found = []
    for i, j in combinations(range(len(points)), 2):
        ridge = [k for k in range(len(points)) if k not in (i, j)]
        base = points[ridge[0]]
        span = np.linalg.qr((points[ridge[1:]] - base).T)[0] if len(ridge) > 1 else np.zeros((len(base), 0))
        first, second = (v - span @ (span.T @ v) for v in (points[i] - base, points[j] - base))
        cosine = first @ second / np.linalg.norm(first) / np.linalg.norm(second)
        found.append(math.acos(max(-1.0, min(1.0, cosine))))
    return found


def solid_angles(points: Any) -> list[float]:
    """Girard: the three dihedral angles at a vertex exceed pi by the solid angle."""
    angles = dict(zip(combinations(range(4), 2), dihedral_angles(points), strict=True))
    found = []
    for vertex in range(4):
        # The facets at a vertex are those opposite to the others.
        others = [k for k in range(4) if k != vertex]
        found.append(sum(angles[i, j] for i, j in combinations(others, 2)) - math.pi)
    return found


SLOW = {
    "aspect-ratio": ratio_of_radii,
    "dihedral-angle": lambda points: min(dihedral_angles(points)),
    "solid-angle": lambda points: min(solid_angles(points)),
    "min-angle": lambda points: min(dihedral_angles(points)),
}


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


def weight_of(configuration: PointConfiguration, simplices: Any) -> float:
    """Sum over the set of all facets, each once."""
    facets = {facet for simplex in simplices for facet in combinations(simplex, configuration.dimension)}
    return math.fsum(
        volume_by_cayley_and_menger(configuration.floats[list(facet)].tolist()) for facet in facets
    )


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


# Where doubles alone would fail.


@pytest.mark.parametrize("bits", [10, 30, 60, 200])
def test_slivers_are_measured_to_nine_digits(bits: int) -> None:
    """Four corners of a square, one lifted by h: all that matters is a power series in h."""
    h = Fraction(1, 2**bits)
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, h]]
    # The circumcentre is (1/2, 1/2, h/2).
    radius = math.sqrt(Fraction(1, 2) + h * h / 4)
    surface = 0.5 + 2 * 0.5 * math.sqrt(1 + h * h) + 0.5 * math.sqrt(1 + 2 * h * h)
    inradius = Fraction(1, 2) * h / Fraction(surface)
    assert one(points, "aspect-ratio") == pytest.approx(float(Fraction(radius) / inradius), rel=1e-9)
    # Facets 013 and 123, with normals (0, -h, 1) and (h, h, -1), meet at the smallest angle.
    assert one(points, "dihedral-angle") == pytest.approx(math.atan(h / math.sqrt(1 + h * h)), rel=1e-9)
    assert one(points, "volume") == h / 6
    assert 0 < one(points, "solid-angle") < 1.1 * float(h)


def test_points_close_to_each_other_far_from_the_origin() -> None:
    tiny = Fraction(1, 2**70)
    near = [[0, 0], [tiny, 0], [0, tiny], [5, 7]]
    far = [[Fraction(x) + 10**9, Fraction(y) - 10**9] for x, y in near]
    simplices = np.array([[0, 1, 2], [0, 1, 3]])
    for points in (near, far):
        configuration = PointConfiguration.from_values([*points])
        assert measured("aspect-ratio", configuration, simplices)[0] == pytest.approx(
            1 + math.sqrt(2), rel=1e-12
        )
        assert measured("min-angle", configuration, simplices)[0] == pytest.approx(math.pi / 4, rel=1e-14)
        assert facet_volumes(configuration, np.array([[1, 2]]))[0] == pytest.approx(
            float(tiny) * math.sqrt(2), rel=1e-14
        )


@pytest.mark.parametrize("scale", [1e-150, 1e-100, 1e100, 1e150])
def test_shapes_at_the_ends_of_the_range_of_doubles(scale: float) -> None:
    points = (np.random.default_rng(5).random((4, 3)) * scale).tolist()
    plain = np.random.default_rng(5).random((4, 3)).tolist()
    for measure in ("aspect-ratio", "dihedral-angle", "solid-angle"):
        assert one(points, measure) == pytest.approx(float(one(plain, measure)), rel=1e-12)


def test_weights_beyond_the_range_of_doubles_are_refused() -> None:
    points = (np.random.default_rng(5).random((4, 3)) * 1e200).tolist()
    with pytest.raises(InputError, match=r"objective 'weight': the cost of simplex \[0, 1, 2, 3\] .* scale"):
        one(points, "weight")


def test_collinear_points_among_others() -> None:
    # The table of all facets has triples on a line here, which no simplex has.
    formulation = cocircuit_formulation(load_instance("grid:3,3,2"), spanning=True)
    weights = make_objective("weight", formulation)
    assert weights.are_doubles
    columns = next(triangulations(formulation.chirotope, spanning=True))
    simplices = formulation.simplices[list(columns)].tolist()
    expected = weight_of(formulation.configuration, simplices)
    assert float(weights.value(columns)) == pytest.approx(expected, rel=1e-7)


# Parts.


@given(st.floats(0, 1e300), st.floats(-1e300, 1e300))
def test_arctangents_agree_with_the_library_to_some_bits(y: float, x: float) -> None:
    found = float(arctangent2(np.array([y]), np.array([x]))[0])
    assert found == pytest.approx(math.atan2(y, abs(x) if x == 0 else x), rel=4e-15, abs=1e-320)


@settings(deadline=None)
@given(
    st.integers(2, 4).flatmap(
        lambda d: st.lists(
            st.lists(st.integers(0, 3), min_size=d, max_size=d), min_size=d + 1, max_size=9, unique_by=tuple
        )
    )
)
def test_facets_in_the_boundary_are_those_of_the_chirotope(values: Any) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    chirotope = Chirotope.of(configuration)
    found = lie_in_boundary(configuration, chirotope.facets)
    assert found.tolist() == (~chirotope.facet_is_interior).tolist()


def test_minors_of_matrices_that_are_not_square() -> None:
    matrix = np.random.default_rng(0).integers(-9, 10, size=(3, 5))
    found = minors([[np.array([entry]) for entry in row] for row in matrix.tolist()])
    assert len(found) == math.comb(5, 3)
    for columns, value in found.items():
        chosen = [j for j in range(5) if columns >> j & 1]
        assert value[0] == round(np.linalg.det(matrix[:, chosen]))
    square = [[np.array([entry]) for entry in row] for row in matrix[:, :3].tolist()]
    assert determinants(square)[0] == found[0b111][0]


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


# Doubles as costs, without a Python number for each.

FLOATS = st.floats(-1e300, 1e300, allow_nan=False).filter(lambda x: not x or abs(x) > 1e-290)


@given(st.lists(FLOATS, min_size=1, max_size=9), st.sampled_from(["min", "max"]))
def test_doubles_are_taken_exactly(costs: list[float], sense: Any) -> None:
    compact = Objective("x", sense, np.array(costs))
    plain = from_fractions("x", sense, [Fraction(cost) for cost in costs])
    assert compact.are_doubles
    assert not plain.are_doubles
    assert compact.unit == plain.unit
    assert compact.counts_units == plain.counts_units
    assert compact.value(range(len(costs))) == plain.value(range(len(costs)))
    assert compact.costs.tolist() == plain.costs.tolist()
    assert compact.solver_costs.tolist() == plain.solver_costs.tolist()
    assert compact.exact_costs([0]) == [Fraction(costs[0])]
    columns, factors = np.array([0, 0]), np.array([3, -1])
    assert compact.times(columns, factors).value([0, 1]) == plain.times(columns, factors).value([0, 1])


@given(
    st.lists(FLOATS, min_size=4, max_size=4),
    st.sampled_from(["min", "max"]),
    st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3),
)
def test_exact_bounds_of_doubles_are_those_of_the_same_fractions(
    costs: list[float], sense: Any, duals: Any
) -> None:
    square = cocircuit_formulation(load_instance("cube:2"))
    assert square.size == (4, 3)
    compact = Objective("x", sense, np.array(costs))
    plain = from_fractions("x", sense, [Fraction(cost) for cost in costs])
    matrix = square.matrix.tocsr()
    first, second = (
        safe_bound(matrix, square.lower, square.upper, objective, np.array(duals))
        for objective in (compact, plain)
    )
    assert first.value == second.value
    assert first.reduced_costs.tolist() == second.reduced_costs.tolist()

"""Measures of simplices where doubles alone would fail, and doubles as exact costs."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from reference import configuration_or_none
from slow_measures import one, weight_of

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
from bcut.objectives.measures import measured
from bcut.objectives.objective import Objective, from_fractions, make_objective


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

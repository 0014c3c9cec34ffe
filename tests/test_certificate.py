"""Certificates: the bound of exact multipliers is re-computed, and what is not proven is not believed."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import listed
from square import square_result

from bcut.bounds.root import root_bound
from bcut.errors import ResultError, VerificationError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.objectives.objective import make_objective
from bcut.solving.certificates import make_certificate
from bcut.verification.certificate import certified_bound
from bcut.verification.certificate_data import CertificateData
from bcut.verification.costs import Costs
from bcut.verification.exact_points import ExactPoints
from bcut.verification.verify import verify


def test_certificate_written_by_hand_proves_optimality() -> None:
    verification = verify(square_result())
    assert verification.statement == (
        "optimal, proven exactly: the triangulation is verified, and its value 2 meets the bound 2"
    )
    assert verification.exact_bound == verification.rounded_bound == 2
    assert verification.proven_optimal


def test_limit_result_is_still_proven_optimal_by_its_certificate() -> None:
    assert verify({**square_result(), "status": "limit"}).proven_optimal


def test_infeasible_side_of_the_sense_is_seen() -> None:
    # The same multipliers with the other sign bound the maximum from above.
    turned = [["coverage", "-2"], [[0, 3], "-1"], [[1, 2], "1"]]
    data = square_result(multipliers=turned)
    data["problem"]["sense"] = "max"
    assert verify(data).exact_bound == 2
    data["certificate"]["bound"] = "1"
    with pytest.raises(VerificationError, match="claims the bound 1, but its multipliers prove 2 only"):
        verify(data)


@pytest.mark.parametrize(
    ("row", "multiplier", "proven"),
    [(0, "1", 1), (0, "3", 1), (1, "0", 1), (1, "3/2", "3/2"), (2, "1", 0), (2, "-1/3", "4/3")],
)
def test_changed_multiplier_proves_less(row: int, multiplier: str, proven: int | str) -> None:
    data = square_result()
    data["certificate"]["multipliers"][row][1] = multiplier
    with pytest.raises(
        VerificationError, match=f"claims the bound 2, but its multipliers prove {proven} only"
    ):
        verify(data)
    data["certificate"]["bound"] = str(proven)
    verification = verify(data)
    assert verification.exact_bound == Fraction(proven)
    # Integral costs: whatever is above 1 proves 2.
    assert verification.proven_optimal == (Fraction(proven) > 1)


def test_bounds_are_not_rounded_where_costs_are_no_integers() -> None:
    halved = [["coverage", "1"], [[0, 3], "3/4"], [[1, 2], "-1/2"]]
    data = {**square_result(bound="3/4", multipliers=halved), "value": 1, "bound": 1}
    data["problem"] = {**data["problem"], "objective": "costs:x", "costs": {"default": "1/2", "costs": []}}
    verification = verify(data)
    assert (verification.exact_bound, verification.rounded_bound) == (Fraction(3, 4), Fraction(3, 4))
    assert not verification.proven_optimal
    with pytest.raises(VerificationError, match="'optimal', but its bound 3/4 leaves room"):
        verify({**data, "bound": "3/4", "gap": 0.25})


def small_square(default: str, costs: list[Any], proven: str) -> dict[str, Any]:
    """Two triangles of cost 1e-12 each, and the bound that the multiplier of the coverage row proves."""
    data = square_result(bound=proven, multipliers=[["coverage", proven]])
    table = {"default": default, "costs": costs}
    value = "2/1000000000000"
    data["problem"] = {**data["problem"], "objective": "costs:x", "costs": table}
    return {**data, "value": value, "bound": value}


def test_a_bound_that_is_half_of_a_small_value_does_not_make_it_optimal() -> None:
    tiny = "1/1000000000000"
    verification = verify(small_square(tiny, [], tiny))
    assert verification.exact_bound == Fraction(tiny)
    assert verification.statement == (
        "triangulation verified, value 2e-12; bound 1e-12 proven exactly; optimality rests on the solver's tree"
    )


def test_the_statement_says_what_a_gap_is_relative_to() -> None:
    tiny = "1/1000000000000"
    used = [[[0, 1, 2], tiny], [[1, 2, 3], tiny]]
    statement = verify(small_square("1/2", used, tiny)).statement
    assert statement.endswith(
        "bound 1e-12 proven exactly; so the value is optimal up to 2.0e-12 of the largest cost"
    )
    nearly = str(2 - Fraction(tiny))
    data = square_result(bound=nearly, multipliers=[["coverage", nearly], [[0, 3], "1"], [[1, 2], "-1"]])
    table = {"default": 1, "costs": [[[0, 1, 3], "3/2"]]}
    data["problem"] = {**data["problem"], "objective": "costs:x", "costs": table}
    assert verify(data).statement.endswith("so the value is optimal up to a relative gap of 5.0e-13")


def test_weaker_claim_than_proven_is_improved() -> None:
    verification = verify(square_result(bound="-7"))
    assert (verification.exact_bound, verification.proven_optimal) == (2, True)


def test_loose_bound_leaves_optimality_to_the_solver() -> None:
    statement = verify(square_result(bound="1", multipliers=[["coverage", "1"]])).statement
    assert statement == (
        "triangulation verified, value 2; bound 1 proven exactly; optimality rests on the solver's tree"
    )


def test_bound_without_triangulation() -> None:
    data = {
        **square_result(),
        "status": "bound",
        "triangulation": None,
        "value": None,
        "gap": None,
        "bound": 3,
    }
    assert verify(data).statement == (
        "there is no triangulation in this result (status 'bound'); bound 2 proven exactly; "
        "the bound 3 rests on the solver's tree"
    )


def test_large_configurations_are_left_out_and_the_statement_says_so() -> None:
    verification = verify(square_result(), max_subsets=3)
    assert verification.exact_bound is None
    assert not verification.proven_optimal
    assert "not re-checked: there are 4 subsets of 3 points" in verification.statement


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"flag": [0, 1]}, r"flag \[0, 1\] is not a list of 3 different points"),
        ({"flag": [0, 1, 1]}, "is not a list of 3 different points"),
        ({"flag": [0, 1, 4]}, "is not a list of 3 different points"),
        ({"multipliers": [[[0, 1], "1"]]}, r"\[0, 1\], which has no points strictly on both sides"),
        ({"multipliers": [[[0, 1, 2], "1"]]}, r"row \[0, 1, 2\] does not name 2 points"),
        ({"multipliers": [[[], "1"]]}, r"row \[\] does not name 2 points"),
        ({"multipliers": [[[3, 7], "1"]]}, r"row \[3, 7\] does not name 2 points"),
    ],
)
def test_rows_that_do_not_exist(changes: dict[str, Any], reason: str) -> None:
    with pytest.raises(VerificationError, match=reason):
        verify(square_result(**changes))


def test_flag_in_a_hyperplane_is_refused() -> None:
    points = ExactPoints([[0, 0], [1, 0], [2, 0], [0, 1]])
    certificate = CertificateData(Fraction(0), flag=(0, 1, 2))
    with pytest.raises(VerificationError, match="lies in a hyperplane"):
        certified_bound(points, certificate, ones(), sense="min", spanning=False)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"bound": 2}, "'certificate.bound': this is a rational as text"),
        ({"bound": "2 "}, "'certificate.bound': this is a rational as text"),
        ({"bound": "2/0"}, "'certificate.bound': this is a rational as text"),
        ({"flag": None}, "'certificate.flag': this is a list of vertices"),
        ({"multipliers": [["coverage"]]}, r"'certificate.multipliers\[0\]': this is a pair"),
        ({"multipliers": [["volume", "1"]]}, "this is a list of vertices"),
        ({"multipliers": [[[3, 0], "1"]]}, "vertices are ascending here"),
        ({"multipliers": [[[0, 3], 0.5]]}, "this is a rational as text"),
        ({"multipliers": [[[0, 3], "1"], [[0, 3], "1"]]}, "each row has one multiplier"),
        ({"multipliers": [["coverage", "0"], ["coverage", "1"]]}, "each row has one multiplier"),
        ({"cuts": {}}, "'certificate.cuts': this is a list of cuts"),
        ({"cuts": [{"family": "clique"}]}, r"has no entry 'certificate.cuts\[0\].simplices'"),
    ],
)
def test_malformed_certificates(changes: dict[str, Any], reason: str) -> None:
    with pytest.raises(ResultError, match=reason):
        verify(square_result(**changes))


# Against the program that makes certificates, which shares nothing with the one that checks them.


def ones() -> Costs:
    return Costs(lambda simplices: [1] * len(simplices), integral=True)


@pytest.mark.parametrize("sense", ["min", "max"])
@pytest.mark.parametrize(
    ("name", "objective", "spanning"),
    [
        ("cube:3", "cardinality", False),
        ("cube:4", "cardinality", False),
        ("polygon:5,center", "cardinality", False),
        ("polygon:7", "random-costs:5", False),
        ("grid:3,3", "cardinality", True),
        ("grid:3,3", "random-costs:1", False),
        ("moae", "random-costs:2", False),
        ("icosahedron", "cardinality", False),
        ("prism:5", "random-costs:4", False),
        ("random:14,3,seed=1000", "cardinality", True),
    ],
)
def test_certificates_prove_exactly_what_they_claim(
    name: str, objective: str, spanning: bool, sense: str
) -> None:
    configuration = load_instance(name)
    formulation = cocircuit_formulation(configuration, spanning=spanning)
    goal = make_objective(objective, formulation, sense=sense)
    root = root_bound(formulation, goal)
    assert root.first is not None
    certificate = make_certificate(formulation, goal, root.first)
    best = next(triangulations(formulation.chirotope, spanning=spanning))
    simplices = formulation.simplices[list(best)].tolist()
    value = goal.value(best)
    data = {
        "schema": 1,
        "instance": {
            "name": name,
            "dimension": configuration.dimension,
            "points": [list(point) for point in configuration.exact_points()],
            "digest": configuration.digest,
        },
        "problem": {"objective": objective, "sense": sense, "spanning": spanning},
        "status": "limit",
        "value": str(value),
        "bound": None,
        "gap": None,
        "triangulation": simplices,
        "certificate": {
            "bound": certificate.bound,
            "flag": certificate.flag,
            "multipliers": certificate.multipliers,
        },
    }
    verification = verify(data)
    assert certificate.bound is not None
    claimed = Fraction(certificate.bound)
    if goal.fits_64_bits:
        # Costs were not rounded, so the same sum is computed in two ways.
        assert verification.exact_bound == claimed
    assert verification.exact_bound is not None
    assert abs(verification.exact_bound - claimed) < Fraction(1, 10**6)
    assert verification.value == value


RATIONALS = st.fractions(min_value=-4, max_value=4, max_denominator=6)


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(["polygon:5,center", "grid:3,2", "grid:3,2 spanning", "cube:3", "prism:3"]),
    st.sampled_from(["min", "max"]),
    st.data(),
)
def test_any_multipliers_give_a_bound_on_every_triangulation(
    name: str, sense: str, data: st.DataObject
) -> None:
    family, _, spanning = name.partition(" ")
    formulation, every = listed(family, bool(spanning))
    facets = [facet for facet in formulation.row_faces if facet is not None]
    costs = {tuple(simplex): data.draw(RATIONALS) for simplex in formulation.simplices.tolist()}
    flag = data.draw(st.permutations(data.draw(st.sampled_from(formulation.chirotope.bases.tolist()))))
    certificate = CertificateData(
        None,
        flag=tuple(flag),
        coverage=data.draw(RATIONALS),
        cocircuits={facet: data.draw(RATIONALS) for facet in data.draw(st.sets(st.sampled_from(facets)))},
    )
    found = certified_bound(
        ExactPoints(formulation.configuration.scalars()),
        certificate,
        Costs(lambda simplices: [costs[simplex] for simplex in simplices], integral=False),
        sense=sense,
        spanning=bool(spanning),
    )
    assert found.candidates == len(formulation.simplices)
    assert found.bound is not None
    simplices = [tuple(simplex) for simplex in formulation.simplices.tolist()]
    values = [sum(costs[simplices[column]] for column in chosen) for chosen in every]
    assert found.bound <= min(values) if sense == "min" else found.bound >= max(values)

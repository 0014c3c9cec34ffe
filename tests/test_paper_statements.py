"""Statements of the paper on examples, each as it is written there, in exact arithmetic.

Lemma 1 is in `test_paper_docs`, the inclusions of the relaxations are in `test_all_formulations`.
"""

from __future__ import annotations

import json
from fractions import Fraction
from itertools import combinations
from math import comb, factorial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from reference import integral
from scipy.spatial import Delaunay
from test_crossings import meet_badly

import bcut
import bcut.instances
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.formulation import Formulation
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.circuits import circuits
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.crossings import crossing_matrix
from bcut.geometry.placing import placing_triangulation
from bcut.geometry.simplices import candidate_simplices
from bcut.geometry.triangulations import triangulations
from bcut.geometry.volumes import hull_volume, volumes
from bcut.instance import load_instance
from bcut.objectives.objective import make_objective


def random_points(n: int, dimension: int, seed: int) -> PointConfiguration:
    """Points in general position with small coordinates, sorted: each is outside the hull of those before it."""
    points = np.random.default_rng(seed).integers(0, 1000, size=(n, dimension))
    found = PointConfiguration.from_values(sorted(points.tolist()))
    assert Chirotope.of(found).is_general
    return found


def some_pairs(simplices: NDArray[np.int64], count: int) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    pairs = list(combinations([tuple(simplex) for simplex in simplices.tolist()], 2))
    chosen = np.random.default_rng(0).permutation(len(pairs))[:count]
    return [pairs[number] for number in chosen.tolist()]


# Proposition 1.


@pytest.mark.parametrize(
    ("dimension", "seed", "pairs"), [*((d, seed, 25) for d in (2, 3) for seed in (1, 2, 3)), (4, 1, 10)]
)
def test_simplices_intersect_where_faces_of_complementary_dimensions_do(
    dimension: int, seed: int, pairs: int
) -> None:
    configuration = random_points(7, dimension, seed)
    points = integral(configuration.scalars())
    answers = []
    for first, second in some_pairs(Chirotope.of(configuration).bases, pairs):
        faces = (
            (f, g)
            for size in range(1, dimension + 2)
            for f in combinations(first, size)
            for g in combinations(second, dimension + 2 - size)
        )
        expected = meet_badly(points, first, second)
        assert any(meet_badly(points, f, g) for f, g in faces) == expected
        answers.append(expected)
    assert len(set(answers)) == 2


@pytest.mark.parametrize("instance", ["grid:3,3", "cube:3", "prism:4", "polygon:6,center"])
def test_in_degenerate_position_the_dimensions_may_add_up_to_less(instance: str) -> None:
    configuration = load_instance(instance)
    chirotope, points = Chirotope.of(configuration), integral(configuration.scalars())
    parts = [
        tuple(frozenset(np.flatnonzero(row == sign).tolist()) for sign in (1, -1))
        for row in circuits(chirotope)
    ]
    smaller_only = 0
    for first, second in some_pairs(chirotope.bases, 200):
        s, t = set(first), set(second)
        sizes = [len(f) + len(g) for f, g in parts if (f <= s and g <= t) or (f <= t and g <= s)]
        assert bool(sizes) == meet_badly(points, first, second)
        assert all(size <= configuration.dimension + 2 for size in sizes)
        smaller_only += bool(sizes) and max(sizes) < configuration.dimension + 2
    assert smaller_only


# Proposition 3.


def overlapped(
    configuration: PointConfiguration, formulation: Formulation
) -> tuple[list[Fraction], int, int]:
    """Half of two triangulations of the first d + 3 points, and all of what the others add; with a missing simplex.

    Returns
    -------
    x : list of Fraction
        A point of P2.
    missing : int
        A simplex of the d + 3 points with the value 0.
    used : int
        One with the value 1/2 that does not lie in it.
    """
    few = configuration.dimension + 3
    inner = PointConfiguration.from_values(configuration.scalars()[:few])
    chirotope = Chirotope.of(inner)
    # Without points of the configuration in between, numbers of points are the same.
    columns = formulation.columns_of(chirotope.bases).tolist()
    found = list(triangulations(chirotope))
    one, two = next((a, b) for a, b in combinations(found, 2) if not set(a) & set(b))
    x = [Fraction(0)] * len(formulation.simplices)
    for chosen in (*one, *two):
        x[columns[chosen]] = Fraction(1, 2)
    for simplex in placing_triangulation(configuration, formulation.chirotope):
        if simplex.max() >= few:
            x[int(formulation.columns_of(simplex[None])[0])] = Fraction(1)
    missing = next(s for s in range(len(columns)) if s not in {*one, *two})
    # Whatever lies in a simplex has no vertex but its own and inner points; some simplex has another one.
    corners = chirotope.bases[missing].tolist()
    points = integral(inner.scalars())
    inside = {p for p in range(few) if meet_badly(points, corners, [p]) or p in corners}
    used = next(t for t in one if not set(chirotope.bases[t].tolist()) <= inside)
    return x, columns[missing], columns[used]


def residuals(formulation: Formulation, x: list[Fraction]) -> NDArray[Any]:
    return formulation.matrix.toarray().astype(object) @ np.array(x, dtype=object) - formulation.lower


@pytest.mark.parametrize("dimension", [2, 3, 4])
@pytest.mark.parametrize("more", [0, 2])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_point_of_p0_outside_p2(dimension: int, more: int, seed: int) -> None:
    configuration = random_points(dimension + 3 + more, dimension, seed)
    formulation = cocircuit_formulation(configuration)
    x, missing, used = overlapped(configuration, formulation)
    assert not residuals(formulation, x).any()
    sizes = [int(volume) for volume in volumes(configuration, formulation.simplices)[:, 0]]
    small = Fraction(1, 10**6)
    x[missing] += small
    x[used] -= small * sizes[missing] / sizes[used]
    assert all(0 <= value <= 1 for value in x)
    whole = int(hull_volume(configuration, formulation.chirotope.hull_facets)[0])
    assert sum(value * size for value, size in zip(x, sizes, strict=True)) == whole
    pairs = np.argwhere(np.triu(crossing_matrix(formulation.chirotope, formulation.simplices)))
    assert all(x[s] + x[t] <= 1 for s, t in pairs.tolist())
    assert residuals(formulation, x).any()


# Section 2.4.2.


@pytest.mark.parametrize(("n", "dimension"), [(10, 2), (9, 3)])
def test_as_many_simplices_are_empty_as_expected(n: int, dimension: int) -> None:
    chirotopes = [
        Chirotope.of(load_instance(f"random:{n},{dimension},seed={seed}")) for seed in range(1, 201)
    ]
    counts = np.array([len(candidate_simplices(chirotope, spanning=True)) for chirotope in chirotopes])
    assert counts.min() >= comb(n - 1, dimension)
    corners = np.random.default_rng(0).random((200_000, dimension + 1, dimension))
    parts = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / factorial(dimension)
    expected = comb(n, dimension + 1) * ((1 - parts) ** (n - dimension - 1)).mean()
    assert abs(counts.mean() - expected) < 4 * counts.std() / np.sqrt(len(counts))


# Section 2.5.


def test_the_pentagon_and_its_centre() -> None:
    formulation = cocircuit_formulation(load_instance("pentagon-center"))
    assert len(formulation.simplices) == 20
    assert len(list(triangulations(formulation.chirotope))) == 16
    data = json.loads(bcut.instances.path("pentagon-center-costs").read_text(encoding="utf-8"))
    chosen = formulation.columns_of(
        np.sort([vertices for vertices, cost in data["costs"] if cost == 0], axis=1)
    )
    assert len(chosen) == 10
    x = [Fraction(1, 2) if column in chosen else Fraction(0) for column in range(20)]
    assert not residuals(formulation, x).any()
    # The convex polygon cut of all points holds, with equality: M is 5.
    assert sum(x) == 5
    centre = next(v for v in range(6) if all(v not in facet for facet in formulation.chirotope.hull_facets))
    outer = [column for column in chosen if centre not in formulation.simplices[column]]
    crossing = crossing_matrix(formulation.chirotope, formulation.simplices[outer])
    assert crossing.sum(axis=1).tolist() == [2] * 5
    assert sum(x[column] for column in outer) == Fraction(5, 2)


# Sections 1 and 4.1.


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_in_the_plane_delaunay_has_the_largest_minimum_angle(seed: int) -> None:
    configuration = load_instance(f"random:10,2,seed={seed}")
    formulation = cocircuit_formulation(configuration, spanning=True)
    angles = make_objective("min-angle", formulation, sense="max").costs
    triangles = np.sort(Delaunay(configuration.floats).simplices, axis=1)
    found = bcut.solve(configuration, objective="max-min:min-angle", spanning=True)
    assert found.status == "optimal"
    assert found.value == pytest.approx(angles[formulation.columns_of(triangles)].min(), rel=1e-12)


@pytest.mark.parametrize("seed", [15, 701])
def test_the_relaxation_of_minimum_weight_may_be_fractional_in_space(seed: int) -> None:
    problem: dict[str, Any] = {"objective": "weight", "spanning": True, "separators": []}
    found = bcut.solve(f"random:10,3,seed={seed}", **problem)
    assert (found.status, found.root.integral) == ("optimal", False)
    assert found.value is not None
    assert found.root.lp is not None
    assert found.root.lp < found.value - 0.01

"""Circuits, overlaps and generic points against slow exact geometry."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from reference import barycentric, configuration_or_none, determinant, full_simplices, signed_volume

from bcut.bounds.safe import safe_bound
from bcut.formulations.formulation import UNBOUNDED
from bcut.formulations.lazy_rows import chamber_incidence
from bcut.geometry.chamber_flags import chamber_flags
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.circuits import circuits
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.overlaps import overlap_matrix
from bcut.instance import load_instance
from bcut.objectives.objective import from_fractions
from bcut.verification.dissection import overlap
from bcut.verification.exact_points import ExactPoints, SideTable

INSTANCES = ["grid:3,2", "random:6,2,seed=1", "cube:3", "random:6,3,seed=2", "prism:3", "random:7,4,seed=1"]
DEGENERATE = st.integers(2, 3).flatmap(
    lambda d: st.lists(
        st.lists(st.integers(0, 2), min_size=d, max_size=d), min_size=d + 2, max_size=7, unique_by=tuple
    )
)


def coverings(configuration: PointConfiguration, count: int) -> list[list[bool]]:
    """Which simplices contain random exact points that lie on no boundary."""
    points, random = configuration.scalars(), np.random.default_rng(0)
    simplices = full_simplices(points)
    found = []
    for weights in random.integers(1, 1000, size=(count, configuration.n)) ** 2:
        total = int(weights.sum())
        point = [
            sum((int(w) * p[j] for w, p in zip(weights, points, strict=True)), Fraction(0)) / total
            for j in range(configuration.dimension)
        ]
        least = [min(barycentric(points, simplex, point)) for simplex in simplices]
        if all(least):
            found.append([value > 0 for value in least])
    return found


def is_affine_combination(rows: np.ndarray, row: list[bool]) -> bool:
    """Whether a row is a combination with sum 1 of others: modulo a large prime, which is exact up to bad luck."""
    prime = 2_147_483_647
    table = np.hstack((rows, np.ones((len(rows), 1)))).astype(object).tolist()
    target = [*map(int, row), 1]
    pivots: list[tuple[int, list[int]]] = []
    for entries in [*table, target]:
        rest = [int(value) % prime for value in entries]
        for column, pivot in pivots:
            if rest[column]:
                rest = [(a - rest[column] * b) % prime for a, b in zip(rest, pivot, strict=True)]
        first = next((column for column, value in enumerate(rest) if value), None)
        if entries is target:
            return first is None
        if first is not None:
            inverse = pow(rest[first], -1, prime)
            pivots.append((first, [value * inverse % prime for value in rest]))
    raise AssertionError


@pytest.mark.parametrize("instance", INSTANCES)
def test_rows_of_random_chambers_follow_from_those_of_flags(instance: str) -> None:
    configuration = load_instance(instance)
    rows, _ = chamber_incidence(Chirotope.of(configuration), Chirotope.of(configuration).bases)
    for covering in coverings(configuration, 12):
        assert is_affine_combination(rows, covering)


@settings(max_examples=25, deadline=None)
@given(DEGENERATE)
def test_the_same_for_degenerate_points(values: list[list[int]]) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    assert configuration is not None
    chirotope = Chirotope.of(configuration)
    rows, _ = chamber_incidence(chirotope, chirotope.bases)
    for covering in coverings(configuration, 3):
        assert is_affine_combination(rows, covering)


def test_flags_are_few_in_general_position() -> None:
    for instance in ("random:8,2,seed=1", "random:8,3,seed=1"):
        chirotope = Chirotope.of(load_instance(instance))
        flags = chamber_flags(chirotope)
        assert len(flags) == 1 + 2 * int(chirotope.facet_is_interior.sum())
        assert (np.diff(np.sort(flags, axis=1)) > 0).all()


def brute_circuits(points: Any) -> set[tuple[int, ...]]:
    """Minimal affinely dependent subsets with the signs of their dependences, by elimination over all subsets."""
    found: set[tuple[int, ...]] = set()
    supports: list[set[int]] = []
    for size in range(3, len(points[0]) + 3):
        for subset in combinations(range(len(points)), size):
            if any(support <= set(subset) for support in supports):
                continue
            # Cayley-Menger: the Gram determinant vanishes exactly where the points are dependent.
            base = points[subset[0]]
            edges = [[a - b for a, b in zip(points[p], base, strict=True)] for p in subset[1:]]
            gram = [[sum(x * y for x, y in zip(u, v, strict=True)) for v in edges] for u in edges]
            if determinant(gram):
                continue
            supports.append(set(subset))
            found.add(tuple(subset))
    return found


@settings(max_examples=25, deadline=None)
@given(DEGENERATE)
def test_circuits_are_the_minimal_dependences(values: list[list[int]]) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    assert configuration is not None
    points = configuration.scalars()
    rows = circuits(Chirotope.of(configuration))
    assert {tuple(np.flatnonzero(row).tolist()) for row in rows} == brute_circuits(points)
    assert len(np.unique(np.abs(rows), axis=0)) == len(rows)
    for row in rows:
        # Points on the + side of a hyperplane only cannot be balanced: both parts are there, and their hulls meet.
        assert set(row.tolist()) >= {1, -1}
        plus, minus = np.flatnonzero(row > 0), np.flatnonzero(row < 0)
        assert _hulls_meet(configuration.floats[plus], configuration.floats[minus])


def _hulls_meet(first: np.ndarray, second: np.ndarray) -> bool:
    from scipy.optimize import linprog

    together = np.vstack((first, -second))
    ones = np.zeros((2, len(together)))
    ones[0, : len(first)] = ones[1, len(first) :] = 1
    answer = linprog(
        np.zeros(len(together)), A_eq=np.vstack((together.T, ones)), b_eq=[0.0] * first.shape[1] + [1.0, 1.0]
    )
    return bool(answer.status == 0)


@settings(max_examples=25, deadline=None)
@given(DEGENERATE)
def test_overlaps_are_common_interior_points(values: list[list[int]]) -> None:
    """Exactly: some generic point in both, if there is one near a vertex of their intersection; else separated."""
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    assert configuration is not None
    chirotope = Chirotope.of(configuration)
    overlapping = overlap_matrix(chirotope, chirotope.bases)
    rows, _ = chamber_incidence(chirotope, chirotope.bases)
    together = (rows[:, :, None] & rows[:, None, :]).any(axis=0)
    np.fill_diagonal(together, False)
    # Generic points prove overlaps; two other routes to a separating hyperplane must agree on the rest.
    assert not (together & ~overlapping).any()
    sides = SideTable(ExactPoints(configuration.scalars()))
    simplices = [tuple(simplex) for simplex in chirotope.bases.tolist()]
    for i, first in enumerate(simplices):
        for j, second in enumerate(simplices[:i]):
            assert overlap(sides, first, second) == overlapping[i, j] == overlapping[j, i]
    points = configuration.scalars()
    whole = {i: abs(signed_volume(points, simplex)) for i, simplex in enumerate(simplices)}
    hull = (
        max(sum(whole[i] for i in clique) for clique in _cliques(~overlapping))
        if len(simplices) < 9
        else None
    )
    if hull is not None:
        assert hull == sum(whole[i] for i in _cover(rows))


def _cliques(compatible: np.ndarray) -> list[tuple[int, ...]]:
    count = len(compatible)
    return [
        subset
        for size in range(1, count + 1)
        for subset in combinations(range(count), size)
        if all(compatible[i, j] for i, j in combinations(subset, 2))
    ]


def _cover(rows: np.ndarray) -> list[int]:
    """A dissection: simplices that contain every generic point once, by search."""

    def search(chosen: list[int], covered: np.ndarray) -> list[int] | None:
        if covered.all():
            return chosen
        for column in np.flatnonzero(rows[int(np.flatnonzero(~covered)[0])]).tolist():
            if not (rows[:, column] & covered).any():
                found = search([*chosen, column], covered | rows[:, column])
                if found is not None:
                    return found
        return None

    found = search([], np.zeros(len(rows), dtype=bool))
    assert found is not None
    return found


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**31), st.integers(1, 45))
def test_bounds_with_large_rows_are_proven_and_close(seed: int, bits: int) -> None:
    """Against exact rationals: never above what the rounded multipliers prove, and hardly below."""
    import scipy.sparse as sp

    random = np.random.default_rng(seed)
    columns = int(random.integers(1, 12))
    small = random.integers(-3, 4, size=(3, columns))
    shares = random.integers(0, 1 << bits, size=(2, columns))
    matrix = sp.csr_matrix(np.vstack((shares, small)).astype(np.int64))
    lower = np.array([-UNBOUNDED, 1 << bits, 0, -UNBOUNDED, -2])
    upper = np.array([1 << bits, UNBOUNDED, 0, 1, UNBOUNDED])
    costs = [Fraction(int(value)) for value in random.integers(-20, 20, columns)]
    objective = from_fractions("test", "min", costs)
    duals = random.normal(size=5) * 10
    shifts = np.array([bits, bits, 0, 0, 0])
    found = safe_bound(matrix, lower, upper, objective, duals, shifts)
    dense = matrix.toarray()
    multipliers = [
        Fraction(int(y)) * found.unit / (1 << int(shift))
        for y, shift in zip(found.multipliers, shifts, strict=True)
    ]
    assert all(y <= 0 for y, high in zip(multipliers, lower, strict=True) if high == -UNBOUNDED)
    exact = sum(
        (y * int(lower[i] if y > 0 else upper[i]) for i, y in enumerate(multipliers) if y), Fraction(0)
    )
    reduced = [
        cost - sum((y * int(dense[i, j]) for i, y in enumerate(multipliers)), Fraction(0))
        for j, cost in enumerate(costs)
    ]
    exact += sum((min(Fraction(0), value) for value in reduced), Fraction(0))
    assert found.value <= exact
    assert float(exact - found.value) < 1e-9
    for own, value in zip(found.reduced_costs.tolist(), reduced, strict=True):
        assert own * found.unit <= value
        assert float(value - own * found.unit) < 1e-9
    closest = [float(y) * 2.0 ** int(s) for y, s in zip(multipliers, shifts, strict=True)]
    for close, dual in zip(closest, duals, strict=True):
        assert close in (0.0, pytest.approx(dual, abs=1e-9))

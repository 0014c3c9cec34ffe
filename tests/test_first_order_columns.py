"""Columns of programs for first-order bounds, and the coverage points that combine their rows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from compact_programs import as_program, listed

import bcut
from bcut.bounds.columns import Columns
from bcut.bounds.coverage_points import coverage_points, spread_points
from bcut.bounds.repair import Program, Repair
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.compact import compact_program

# Columns -----------------------------------------------------------------------------------------------------------


def random_matrix(seed: int) -> sp.csr_array:
    """Return a matrix with mostly 1 and -1, some larger entries, and empty rows and columns."""
    generator = np.random.default_rng(seed)
    shape = (int(generator.integers(1, 9)), int(generator.integers(1, 40)))
    dense = generator.choice([0, 0, 0, 1, 1, -1, 3], size=shape).astype(float)
    dense[generator.random(shape) < 0.05] = 0.25
    return sp.csr_array(dense)


@pytest.mark.parametrize("seed", range(20))
def test_columns_are_the_matrix(seed: int) -> None:
    matrix = random_matrix(seed)
    columns = Columns.of_matrix(matrix)
    generator = np.random.default_rng(seed)
    x, y, costs = (generator.normal(size=size) for size in (matrix.shape[1], *matrix.shape))
    np.testing.assert_array_equal(columns.sparse().toarray(), matrix.toarray())
    np.testing.assert_allclose(columns.times(x), matrix @ x, atol=1e-12)
    np.testing.assert_allclose(columns.reduced(costs, y), costs - matrix.T @ y, atol=1e-12)
    some = generator.permutation(matrix.shape[1])[: matrix.shape[1] // 2]
    np.testing.assert_array_equal(columns.restricted_to(some).sparse().toarray(), matrix.toarray()[:, some])
    factors = sp.csr_array(generator.integers(-2, 3, (3, matrix.shape[0])))
    np.testing.assert_array_equal(
        columns.with_combinations(factors).sparse().toarray(),
        np.vstack((matrix.toarray(), factors.toarray() @ matrix.toarray())),
    )


def test_facets_are_laid_out_as_the_formulation_has_them() -> None:
    program = listed("random:12,3,seed=4")
    columns = Columns.of_facets(
        program.facet_rows, program.facet_signs, program.coverage, len(program.row_faces)
    )
    np.testing.assert_array_equal(columns.sparse().toarray(), program.matrix().toarray())


def test_rows_are_scaled_to_mean_entries_of_one() -> None:
    matrix = sp.csr_array(np.array([[1.0, -1, 0, 1], [2, 4, 6, 0], [0, 0, 0, 0]]))
    np.testing.assert_allclose(Columns.of_matrix(matrix).row_scale(), [1, 1 / 4, 1])


# Coverage points ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name",
    ["random:14,2,seed=1", "random:12,3,seed=2", "random:10,4,seed=3", "sphere:14,3,seed=5", "grid:4,4"],
)
def test_coverage_points_mark_simplices_that_contain_a_point(
    monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    configuration = bcut.load_instance(name)
    formulation = cocircuit_formulation(configuration, spanning=True)
    drawn: list[np.ndarray] = []

    def drawing(*arguments: Any) -> np.ndarray:
        drawn.append(spread_points(*arguments))
        return drawn[-1]

    monkeypatch.setattr("bcut.bounds.coverage_points.spread_points", drawing)
    rows = (coverage_points(formulation, points=12) @ formulation.matrix.astype(np.int64)).toarray()
    (targets,) = drawn
    corners = configuration.floats[formulation.simplices]
    inverse = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
    for row, target in zip(rows, targets, strict=True):
        weights = np.einsum("tij,tj->ti", inverse, target - corners[:, 0])
        inside = (weights > 0).all(axis=1) & (weights.sum(axis=1) < 1)
        np.testing.assert_array_equal(row, inside)
    assert len(np.unique(rows, axis=0)) > 6


@pytest.mark.parametrize("exponent", [-330, 330])
def test_coverage_points_do_not_depend_on_the_size_of_coordinates(exponent: int) -> None:
    """Volumes of four dimensions would be beyond the range of doubles there."""
    configuration = bcut.load_instance("random:10,4,seed=3")
    scaled = bcut.PointConfiguration.from_values(np.ldexp(configuration.floats, exponent))
    plain, far = (
        coverage_points(cocircuit_formulation(points, spanning=True)).toarray()
        for points in (configuration, scaled)
    )
    np.testing.assert_array_equal(plain, far)


def test_coverage_points_of_arrays_are_those_of_the_formulation() -> None:
    configuration = bcut.load_instance("random:14,3,seed=6")
    program = compact_program(configuration, spanning=True)
    ordinary = cocircuit_formulation(configuration, spanning=True)
    first, second = coverage_points(program, points=5), coverage_points(ordinary, points=5)
    np.testing.assert_array_equal(first.toarray(), second.toarray())


def test_the_number_of_points_follows_the_columns() -> None:
    """The further rows lengthen the columns by less than one entry on the average."""
    few, many = listed("random:16,3,seed=1"), listed("random:160,2,seed=1")
    assert coverage_points(few).shape[0] < coverage_points(many).shape[0]
    for program in (few, many):
        further = coverage_points(program) @ program.matrix().astype(np.int32)
        assert 0.2 < further.nnz / len(program.simplices) < 0.8


def test_multipliers_of_combinations_become_those_of_rows() -> None:
    program = listed("random:12,2,seed=8")
    costs = np.ones(len(program.simplices))
    plain, further = as_program(program, costs, points=0), as_program(program, costs, points=7)
    y = np.random.default_rng(0).normal(size=further.columns.rows)
    np.testing.assert_allclose(
        plain.columns.reduced(costs, further.without_combinations(y)),
        further.columns.reduced(costs, y),
        atol=1e-9,
    )
    assert Repair(plain).value(further.without_combinations(y)) == pytest.approx(Repair(further).value(y))


def test_only_equations_are_combined() -> None:
    columns = Columns.of_matrix(sp.csr_array(np.ones((2, 3))))
    program = Program(columns, np.ones(3), np.array([1.0, -np.inf]), np.array([1.0, 2.0]))
    with pytest.raises(ValueError, match="equations"):
        program.with_combinations(sp.csr_array(np.ones((1, 2))))

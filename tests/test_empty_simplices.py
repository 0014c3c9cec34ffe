"""The compiled enumeration against the tables of all signs, and the arrays of the program against the formulation."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from reference import configuration_or_none, full_simplices, is_empty

from bcut.errors import TooLargeError
from bcut.formulations import compact
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.compact import CompactProgram, compact_program, pays_to_compile
from bcut.formulations.formulation import Formulation
from bcut.geometry import _compiled, empty_simplices, rotations
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.empty_simplices import FacetTable, first_basis, list_simplices
from bcut.geometry.rotations import Rotations, sweep_order
from bcut.geometry.simplices import candidate_simplices
from bcut.geometry.subsets import all_subsets, ranks
from bcut.instance import load_instance

INSTANCES = [
    "grid:3,3",
    "grid:4,5",
    "moae",
    "polygon:5,center",
    "polygon:7",
    "random:20,2,seed=1",
    "cube:3",
    "cross-polytope:3",
    "grid:3,3,3",
    "dodecahedron",
    "icosidodecahedron",
    "random:14,3,seed=2",
    "sphere:14,3,seed=1",
    "cube:4",
    "grid:3,2,2,2",
    "24-cell",
    "random:11,4,seed=1",
    "hypersimplex:6,2",
    "simplex-product:2,1,1,1",
]


def assert_same_simplices(configuration: PointConfiguration) -> None:
    chirotope = Chirotope.of(configuration)
    for spanning in (False, True):
        expected = candidate_simplices(chirotope, spanning=spanning)
        found = list_simplices(configuration, spanning=spanning)
        np.testing.assert_array_equal(found.vertices, expected)
        np.testing.assert_array_equal(found.orientations, chirotope.orientations(expected))
        facets = FacetTable.of(configuration, found.rotations)
        np.testing.assert_array_equal(facets.kinds == 2, chirotope.facet_is_interior)
        np.testing.assert_array_equal(facets.kinds == 0, ~chirotope.sides.any(axis=1))
        assert facets.hull_facets == chirotope.hull_facets
    np.testing.assert_array_equal(first_basis(configuration), chirotope.bases[0])


def assert_same_program(program: CompactProgram, expected: Formulation) -> None:
    assert_same_formulation(program.formulation(), expected)
    assert program.size == expected.size
    uncovering = np.flatnonzero(~program.coverage)
    assert_same_formulation(program.formulation(uncovering), expected.restricted_to(uncovering))
    keep = np.arange(0, len(expected.simplices), 3)
    assert_same_formulation(program.formulation(keep), expected.restricted_to(keep))
    np.testing.assert_array_equal(program.columns_of(expected.simplices[keep]), keep)
    np.testing.assert_array_equal(program.coverage, expected.matrix[[0]].toarray()[0] == 1)
    without_row = program.facet_rows < 0
    np.testing.assert_array_equal(program.facet_signs == 0, without_row)
    faces = np.array([face for face in expected.row_faces if face is not None]).reshape(
        program.row_faces.shape
    )
    np.testing.assert_array_equal(program.row_faces, faces)


def assert_same_formulation(found: Formulation, expected: Formulation) -> None:
    np.testing.assert_array_equal(found.simplices, expected.simplices)
    assert found.matrix.shape == expected.matrix.shape
    assert found.matrix.dtype == expected.matrix.dtype
    for name in ("indptr", "indices", "data"):
        np.testing.assert_array_equal(getattr(found.matrix, name), getattr(expected.matrix, name))
    np.testing.assert_array_equal(found.lower, expected.lower)
    np.testing.assert_array_equal(found.upper, expected.upper)
    assert found.row_faces == expected.row_faces
    assert (found.name, found.spanning) == (expected.name, expected.spanning)


@pytest.mark.parametrize("instance", INSTANCES)
def test_the_same_simplices_orientations_and_facets_as_from_tables(instance: str) -> None:
    assert_same_simplices(load_instance(instance))


@pytest.mark.parametrize(
    "instance", ["random:50,3", "sphere:40,3", "random:150,2", "grid:4,4,4", "random:20,4"]
)
def test_configurations_of_some_size(instance: str) -> None:
    configuration = load_instance(instance)
    expected = candidate_simplices(Chirotope.of(configuration), spanning=True)
    np.testing.assert_array_equal(list_simplices(configuration, spanning=True).vertices, expected)


@pytest.mark.parametrize("instance", ["grid:3,3", "polygon:5,center", "grid:3,2,2", "random:9,3,seed=1"])
def test_empty_means_empty(instance: str) -> None:
    configuration = load_instance(instance)
    points = configuration.scalars()
    expected = [list(s) for s in full_simplices(points) if is_empty(points, s)]
    assert list_simplices(configuration, spanning=True).vertices.tolist() == expected


def points_of(
    coordinate: st.SearchStrategy[Any], extra: int, dimensions: tuple[int, int] = (2, 4)
) -> st.SearchStrategy[list[list[Any]]]:
    return st.integers(*dimensions).flatmap(
        lambda d: st.lists(
            st.lists(coordinate, min_size=d, max_size=d), min_size=d + 1, max_size=d + extra, unique_by=tuple
        )
    )


@settings(max_examples=150, deadline=None)
@given(points_of(st.integers(0, 3), 9))
def test_degenerate_points(values: list[list[int]]) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    assert_same_simplices(configuration)


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from([30, 40, 53, 80]).flatmap(
        lambda bits: points_of(st.integers(-(2**bits), 2**bits) | st.integers(-1, 1), 6)
    )
)
def test_large_coordinates(values: list[list[int]]) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    assert_same_simplices(configuration)


@settings(max_examples=60, deadline=None)
@given(points_of(st.floats(-1, 1, allow_subnormal=False), 6))
def test_doubles(values: list[list[float]]) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    assert_same_simplices(configuration)


@settings(max_examples=80, deadline=None)
@given(
    points_of(st.integers(0, 2), 8).flatmap(
        lambda points: st.tuples(
            st.just(points),
            st.lists(
                st.lists(st.integers(-1, 1), min_size=len(points[0]), max_size=len(points[0])),
                min_size=len(points),
                max_size=len(points),
            ),
            st.sampled_from([2**20, 2**50, 10**30]),
        )
    )
)
def test_nearly_degenerate_points(example: tuple[list[list[int]], list[list[int]], int]) -> None:
    points, moves, scale = example
    values = [
        [Fraction(x * scale + e, 7) for x, e in zip(p, m, strict=True)]
        for p, m in zip(points, moves, strict=True)
    ]
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    assert_same_simplices(configuration)


@pytest.mark.parametrize("spread", ["1e-20", "1"])
def test_nearly_degenerate_points_in_a_number_field(spread: str) -> None:
    grid = [(i, j) for i in range(4) for j in range(3)]
    values = [
        [f"{i}+sqrt(2)*{spread}*{(7 * i + 3 * j) % 5}", f"{j}+sqrt(2)*{spread}*{i * j % 3}"] for i, j in grid
    ]
    assert_same_simplices(PointConfiguration.from_values(values))


@settings(max_examples=40, deadline=None)
@given(points_of(st.integers(0, 3), 7), st.integers(0, 2**32), st.booleans())
def test_misleading_floats_make_no_difference(values: list[list[int]], seed: int, zero: bool) -> None:
    # Floats only propose orders and points to begin with; whatever they say, the result is right.
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    shape = (configuration.n, configuration.dimension)
    guide = np.zeros(shape) if zero else np.random.default_rng(seed).normal(size=shape)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rotations, "_guide", lambda configuration: guide)
        assert_same_simplices(configuration)


@pytest.mark.parametrize("instance", ["polygon:7,center", "icosahedron", "prism:5"])
@pytest.mark.parametrize("seed", range(3))
def test_misleading_floats_in_a_number_field(
    instance: str, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    configuration = load_instance(instance)
    assert configuration.field.degree > 1
    guide = np.random.default_rng(seed).normal(size=(configuration.n, configuration.dimension))
    monkeypatch.setattr(rotations, "_guide", lambda configuration: guide)
    assert_same_simplices(configuration)


@pytest.mark.parametrize("instance", ["random:12,2", "grid:3,3,2", "grid:3,3,2,2", "dodecahedron"])
def test_rotations_tell_every_orientation(instance: str, monkeypatch: pytest.MonkeyPatch) -> None:
    configuration = load_instance(instance)
    monkeypatch.setattr(rotations, "_BLOCK", 100)
    table = Rotations.of(configuration)
    n, d = configuration.n, configuration.dimension
    chirotope = Chirotope.of(configuration)
    subsets = all_subsets(n, d + 1)
    rows = ranks(subsets[:, : d - 1], n)
    half = table.half_turns[rows].astype(int)
    places = np.take_along_axis(table.positions[rows], subsets[:, d - 1 :], axis=1).astype(int)
    turns = (places[:, 1] - places[:, 0]) % np.maximum(2 * half, 1)
    found = np.where(turns % np.maximum(half, 1) == 0, 0, np.where(turns < half, 1, -1))
    found[(places < 0).any(axis=1)] = 0
    np.testing.assert_array_equal(found, chirotope.signs)


@pytest.mark.parametrize("instance", ["random:9,2", "grid:3,2,2", "icosahedron", "hypersimplex:5,2"])
def test_the_sweep_is_lexicographic(instance: str) -> None:
    configuration = load_instance(instance)
    order = sweep_order(configuration)
    assert sorted(order.tolist()) == list(range(configuration.n))
    points = [configuration.scalars()[label] for label in order]
    assert all(a < b for a, b in pairwise(points))


@pytest.mark.parametrize("instance", ["random:30,2", "random:16,3", "grid:3,3,2", "random:10,4"])
def test_pieces_make_no_difference(instance: str, monkeypatch: pytest.MonkeyPatch) -> None:
    configuration = load_instance(instance)
    expected = list_simplices(configuration, spanning=True).vertices
    monkeypatch.setattr(empty_simplices, "_PIECE", 1)
    np.testing.assert_array_equal(list_simplices(configuration, spanning=True).vertices, expected)
    monkeypatch.setattr(empty_simplices, "_STEPS", 1)
    np.testing.assert_array_equal(list_simplices(configuration, spanning=True).vertices, expected)


def test_positions_of_many_points_are_wider(monkeypatch: pytest.MonkeyPatch) -> None:
    configuration = load_instance("grid:3,3,2")
    assert Rotations.of(configuration).positions.dtype == np.int16
    monkeypatch.setattr(rotations, "_MAX_POINTS_IN_16_BITS", 10)
    assert Rotations.of(configuration).positions.dtype == np.int32
    assert_same_simplices(configuration)


def test_too_many_simplices_or_ridges_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    configuration = load_instance("random:20,3")
    monkeypatch.setattr(empty_simplices, "MAX_SIMPLICES", 100)
    with pytest.raises(TooLargeError, match="20 points in dimension 3 have more than 100 empty simplices"):
        list_simplices(configuration, spanning=True)
    monkeypatch.setattr(rotations, "MAX_POSITIONS", 100)
    with pytest.raises(TooLargeError, match="190 ridges"):
        list_simplices(configuration)


@pytest.mark.parametrize("instance", INSTANCES)
@pytest.mark.parametrize("compiled", [False, True])
def test_the_program_is_the_cocircuit_formulation(instance: str, compiled: bool) -> None:
    configuration = load_instance(instance)
    for spanning in (False, True):
        program = compact_program(configuration, spanning=spanning, compiled=compiled)
        assert_same_program(program, cocircuit_formulation(configuration, spanning=spanning))
        assert program.chirotope.hull_facets == Chirotope.of(configuration).hull_facets


@settings(max_examples=60, deadline=None)
@given(points_of(st.integers(0, 3), 7), st.booleans())
def test_the_program_of_degenerate_points(values: list[list[int]], spanning: bool) -> None:
    configuration = configuration_or_none(values)
    assume(configuration is not None)
    expected = cocircuit_formulation(configuration, spanning=spanning)
    for compiled in (False, True):
        program = compact_program(configuration, spanning=spanning, compiled=compiled)
        assert_same_program(program, expected)


def test_columns_of_the_matrix_by_choice() -> None:
    program = compact_program(load_instance("random:12,3,seed=1"), spanning=True)
    columns = np.array([40, 3, 17])
    np.testing.assert_array_equal(program.matrix(columns).toarray(), program.matrix().toarray()[:, columns])
    assert program.columns_of(np.array([[0, 1, 2, 3]]))[0] in (-1, 0)
    absent = next(s for s in all_subsets(12, 4).tolist() if s not in program.simplices.tolist())
    assert program.columns_of(np.array([absent, program.simplices[5].tolist()])).tolist() == [-1, 5]


@pytest.mark.parametrize("compiled", [False, True])
def test_a_column_takes_few_bytes(compiled: bool) -> None:
    program = compact_program(load_instance("random:12,3,seed=1"), spanning=True, compiled=compiled)
    arrays = (program.simplices, program.facet_rows, program.facet_signs, program.coverage)
    assert program.bytes_per_column * len(program.simplices) == sum(array.nbytes for array in arrays)
    assert program.bytes_per_column == 29


def test_kernels_are_for_instances_that_repay_them() -> None:
    assert not pays_to_compile(load_instance("random:40,3"))
    assert not pays_to_compile(load_instance("random:160,2"))
    assert pays_to_compile(load_instance("random:80,3"))
    assert pays_to_compile(load_instance("random:200,2"))
    # Many (d+1)-subsets, but even more pairs of a ridge and a point.
    assert not pays_to_compile(load_instance("cube:5"))


def test_the_size_decides(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(configuration: PointConfiguration, spanning: bool) -> CompactProgram:
        raise AssertionError

    configuration = load_instance("random:12,3,seed=1")
    monkeypatch.setattr(compact, "_by_kernels", refuse)
    assert compact_program(configuration).size[0] == 495
    monkeypatch.setattr(compact, "pays_to_compile", lambda configuration: True)
    with pytest.raises(AssertionError):
        compact_program(configuration)


def run(code: str, **environment: str) -> str:
    result = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_small_instances_do_without_numba() -> None:
    code = (
        "import sys; from bcut.formulations.compact import compact_program; from bcut.instance import load_instance;"
        "compact_program(load_instance('random:12,3'), spanning=True); print('numba' in sys.modules)"
    )
    assert run(code) == "False\n"


KERNEL = """
from bcut.geometry._compiled import compiled

@compiled
def double(values):
    for j in range(len(values)):
        values[j] *= 2
"""


def test_no_place_for_the_cache(tmp_path: Path) -> None:
    # A file where a folder should be: neither beside the module nor in a home can anything be written.
    (tmp_path / "kernel.py").write_text(KERNEL)
    (tmp_path / "__pycache__").write_text("")
    (tmp_path / "home").write_text("")
    home = str(tmp_path / "home")
    code = "import numpy as np, kernel; a = np.arange(3); kernel.double(a); print(a)"
    printed = run(
        code,
        PYTHONPATH=str(tmp_path),
        PYTHONDONTWRITEBYTECODE="1",
        HOME=home,
        XDG_CACHE_HOME=home,
        NUMBA_CACHE_DIR=home,
    )
    assert printed == "[0 2 4]\n"


def fake_njit(fail: Callable[[], None]) -> Callable[..., Any]:
    """Stand in for numba.njit: with a cache, the first call fails, as on a full disk."""

    def njit(function: Callable[..., Any] | None = None, *, cache: bool = False) -> Any:
        if function is not None:
            return function

        def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
            assert cache

            def call(*arguments: Any) -> None:
                fail()

            return call

        return decorate

    return njit


@pytest.mark.parametrize("error", [OSError, EOFError])
def test_a_cache_that_fails_later(error: type[Exception], monkeypatch: pytest.MonkeyPatch) -> None:
    import numba

    calls = []

    def fail() -> None:
        calls.append(error)
        raise error

    monkeypatch.setattr(numba, "njit", fake_njit(fail))
    twice = _compiled.compiled(lambda value: 2 * value)
    assert (twice(3), twice(4)) == (6, 8)
    assert calls == [error]


def test_the_kernels_are_kept_on_disk(tmp_path: Path) -> None:
    (tmp_path / "kernel.py").write_text(KERNEL)
    code = "import numpy as np, kernel; a = np.arange(3); kernel.double(a); print(a)"
    assert run(code, PYTHONPATH=str(tmp_path), NUMBA_CACHE_DIR=str(tmp_path / "cache")) == "[0 2 4]\n"
    assert list((tmp_path / "cache").rglob("*.nbc"))

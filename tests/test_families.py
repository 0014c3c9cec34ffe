"""Families: sizes, coordinates, exact geometric properties, and errors."""

from __future__ import annotations

import itertools
import json
import math

import numpy as np
import numpy.typing as npt
import pytest

from bcut.errors import ConfigurationError, InputError
from bcut.families import FAMILIES, build, families, is_family
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.rank import Scalar
from bcut.instance import load_instance

SIZES = {
    "cube": (8, 3),
    "cube:2": (4, 2),
    "cube:5": (32, 5),
    "cross-polytope:2": (4, 2),
    "cross-polytope:6": (12, 6),
    "cyclic:9,3": (9, 3),
    "cyclic:40,8": (40, 8),
    "simplex-product:2,1,1": (12, 4),
    "simplex-product:3": (4, 3),
    "hypersimplex:6,2": (15, 5),
    "hypersimplex:3,2": (3, 2),
    "grid:3,3,3": (27, 3),
    "grid:2,3,4,5": (120, 4),
    "polygon:3": (3, 2),
    "polygon:17": (17, 2),
    "polygon:5,center": (6, 2),
    "prism:7": (14, 3),
    "antiprism:4": (8, 3),
    "antiprism:7": (14, 3),
    "moae": (6, 2),
    "random:11,4,seed=3": (11, 4),
    "sphere:11,4,seed=3": (11, 4),
}

# Vertices, edges at each vertex, and facets with the vertices on each: every one is vertex-transitive.
SOLIDS = {
    "tetrahedron": (4, 3, {3: 4}),
    "octahedron": (6, 4, {3: 8}),
    "icosahedron": (12, 5, {3: 20}),
    "dodecahedron": (20, 3, {5: 12}),
    "cuboctahedron": (12, 4, {3: 8, 4: 6}),
    "truncated-tetrahedron": (12, 3, {3: 4, 6: 4}),
    "truncated-cube": (24, 3, {3: 8, 8: 6}),
    "truncated-octahedron": (24, 3, {4: 6, 6: 8}),
    "rhombicuboctahedron": (24, 4, {3: 8, 4: 18}),
    "truncated-cuboctahedron": (48, 3, {4: 12, 6: 8, 8: 6}),
    "icosidodecahedron": (30, 4, {3: 20, 5: 12}),
    "truncated-dodecahedron": (60, 3, {3: 20, 10: 12}),
    "truncated-icosahedron": (60, 3, {5: 12, 6: 20}),
    "rhombicosidodecahedron": (60, 4, {3: 20, 4: 30, 5: 12}),
    "truncated-icosidodecahedron": (120, 3, {4: 30, 6: 20, 10: 12}),
    "24-cell": (24, 8, None),
    "600-cell": (120, 12, None),
}


def products(configuration: PointConfiguration, left: npt.NDArray, right: npt.NDArray) -> npt.NDArray:
    """Exact scalar products of arrays of coefficient vectors (..., d, r)."""
    structure = configuration.field.structure
    return np.einsum("...ai,...aj,ijk->...k", left, right, structure)


def determinant(rows: list[list[Scalar]]) -> Scalar:
    if len(rows) == 1:
        return rows[0][0]
    return sum(
        (-1) ** j * rows[0][j] * determinant([row[:j] + row[j + 1 :] for row in rows[1:]])
        for j in range(len(rows))
    )


def differences(configuration: PointConfiguration, base: int, others: list[int]) -> list[list[Scalar]]:
    points = configuration.scalars()
    return [[a - b for a, b in zip(points[i], points[base], strict=True)] for i in others]


@pytest.mark.parametrize(("text", "size"), SIZES.items())
def test_sizes(text: str, size: tuple[int, int]) -> None:
    configuration = build(text)
    assert (configuration.n, configuration.dimension) == size
    assert configuration.name == ("cube:3" if text == "cube" else text)
    assert configuration == PointConfiguration.from_values(configuration.exact_points())


def test_every_family_is_listed_and_its_example_builds() -> None:
    listed = families()
    assert [name for name, _, _ in listed] == list(FAMILIES)
    for name, form, description in listed:
        example = FAMILIES[name].example
        assert form.split(":")[0] == example.split(":")[0] == name
        assert description
        assert is_family(example)
        configuration = build(example)
        assert configuration.name == example
        assert load_instance(example) == configuration


def test_known_instances_have_the_points_and_dimension_on_record() -> None:
    path = load_known()
    for row in json.loads(path):
        if row["dimension"] <= 7:
            configuration = build(row["instance"])
            assert (configuration.n, configuration.dimension) == (row["points"], row["dimension"])
        if "coordinates" in row:
            dropped = [point[:2] for point in row["coordinates"]]
            assert build(row["instance"]) == PointConfiguration.from_values(dropped)


def load_known() -> str:
    from bcut import instances

    return str(instances.path("known-optima").read_text(encoding="utf-8"))


def test_cube_vertices_come_in_binary_order() -> None:
    cube = build("cube:3")
    assert cube.numerators[:, :, 0].tolist() == [[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)]


def test_cyclic_points_lie_on_the_moment_curve_in_order() -> None:
    points = build("cyclic:6,4").numerators[:, :, 0].tolist()
    parameters = [point[0] for point in points]
    assert parameters == list(range(parameters[0], parameters[0] + 6))
    assert points == [[t, t**2, t**3, t**4] for t in parameters]


def test_orders_of_products_grids_and_hypersimplices() -> None:
    product = build("simplex-product:1,2").numerators[:, :, 0].tolist()
    assert product == [[0, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0], [1, 1, 0], [1, 0, 1]]
    grid = build("grid:2,3").numerators[:, :, 0].tolist()
    assert grid == [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [1, 2]]
    hypersimplex = build("hypersimplex:4,2").numerators[:, :, 0].tolist()
    assert hypersimplex == [[1, 1, 0], [1, 0, 1], [1, 0, 0], [0, 1, 1], [0, 1, 0], [0, 0, 1]]
    cross = build("cross-polytope:2").numerators[:, :, 0].tolist()
    assert cross == [[1, 0], [-1, 0], [0, 1], [0, -1]]


def test_random_points_are_exactly_the_doubles_of_the_generator() -> None:
    uniform = np.random.default_rng(7).random((30, 3))
    np.testing.assert_array_equal(build("random:30,3,seed=7").floats, uniform)
    normal = np.random.default_rng(7).normal(size=(30, 3))
    sphere = normal / np.linalg.norm(normal, axis=1)[:, None]
    np.testing.assert_array_equal(build("sphere:30,3,seed=7").floats, sphere)
    assert build("random:30,3").name == "random:30,3,seed=0"
    assert build(" random : 30 , 3, seed=007 ").name == "random:30,3,seed=7"


@pytest.mark.parametrize("m", [3, 4, 5, 6, 7, 9, 12, 16])
def test_polygons_are_affine_images_of_regular_ones(m: int) -> None:
    configuration = build(f"polygon:{m},center")
    t = 2 * np.pi / m * np.arange(m)
    regular = np.column_stack([2 * np.cos(t), np.sin(t) / np.sin(2 * np.pi / m)])
    np.testing.assert_allclose(configuration.floats, np.vstack([regular, [[0, 0]]]), atol=1e-14)
    # The step to the next vertex is one linear map A; exactly so, with A from the first two vertices.
    points = configuration.scalars()
    cosine = points[1][0] / 2
    for k in range(m):
        x, y = points[k]
        sine_squared = 1 - cosine * cosine
        image = (cosine * x - 2 * sine_squared * y, x / 2 + cosine * y)
        assert image == points[(k + 1) % m]


@pytest.mark.parametrize("m", [5, 7, 8, 9])
def test_prisms_and_antiprisms_have_exactly_parallel_edges(m: int) -> None:
    prism, antiprism = build(f"prism:{m}"), build(f"antiprism:{m}")
    for k in range(m):
        [bottom] = differences(prism, k, [(k + 1) % m])
        [top] = differences(prism, m + k, [m + (k + 1) % m])
        assert bottom == top
        [diagonal] = differences(prism, (k - 1) % m, [(k + 2) % m])
        assert bottom[0] * diagonal[1] - bottom[1] * diagonal[0] == 0
    # In an antiprism a top edge is parallel to the bottom diagonal past the vertex below its middle.
    for k in range(m):
        [top] = differences(antiprism, m + k, [m + (k + 1) % m])
        [diagonal] = differences(antiprism, k, [(k + 2) % m])
        assert top[0] * diagonal[1] - top[1] * diagonal[0] == 0
    heights = [point[2] for point in antiprism.scalars()]
    assert heights == [0] * m + [1] * m


@pytest.mark.parametrize(("name", "expected"), SOLIDS.items())
def test_solids_have_equal_norms_and_equally_many_shortest_edges(
    name: str, expected: tuple[int, int, object]
) -> None:
    configuration = build(name)
    n, valence, _ = expected
    assert configuration.n == n
    numerators = configuration.numerators
    norms = products(configuration, numerators, numerators)
    assert (norms == norms[0]).all()
    gaps = numerators[:, None] - numerators[None, :]
    squares = products(configuration, gaps, gaps)
    approximate = squares @ configuration.field.basis_floats
    np.fill_diagonal(approximate, np.inf)
    shortest = squares[np.unravel_index(approximate.argmin(), approximate.shape)]
    assert (configuration.field.signs(squares - shortest) >= 0).sum() == n * n - n
    assert ((squares == shortest).all(axis=2).sum(axis=1) == valence).all()


@pytest.mark.parametrize("name", [name for name, (_, _, faces) in SOLIDS.items() if faces])
def test_solids_have_exactly_planar_faces(name: str) -> None:
    configuration = build(name)
    _, _, faces = SOLIDS[name]
    floats = configuration.floats
    # Candidates: planes through three points with all points on one side, up to rounding.
    found = set()
    near = np.linalg.norm(floats[:, None] - floats[None, :], axis=2)
    edge = np.where(near > 0, near, np.inf).min() * 1.001
    for b in range(configuration.n):
        for a, c in itertools.combinations(np.flatnonzero((near[b] < edge) & (near[b] > 0)), 2):
            normal = np.cross(floats[a] - floats[b], floats[c] - floats[b])
            heights = (floats - floats[b]) @ normal
            if (heights < 1e-9).all() or (heights > -1e-9).all():
                found.add(tuple(np.flatnonzero(abs(heights) < 1e-9).tolist()))
    sizes = [len(face) for face in found]
    assert {size: sizes.count(size) for size in sizes} == faces
    for face in sorted(found)[:20]:
        for fourth in face[3:]:
            assert determinant(differences(configuration, face[0], [face[1], face[2], fourth])) == 0


@pytest.mark.parametrize(
    ("text", "fragment"),
    [
        ("cub:3", "did you mean cube"),
        ("nothing-like-it:3", "there are cube"),
        ("cube:", "nothing follows"),
        ("cube:1", "at least 2"),
        ("cube:-3", "at least 2"),
        ("cube:3.5", "must be an integer"),
        ("cube:three", "must be an integer"),
        ("cube:³", "must be an integer"),
        ("cube:" + "9" * 5000, "must be an integer"),
        ("cube:40", "too many"),
        ("cube:3,4", "no parameter '4'"),
        ("cross-polytope", "D is missing"),
        ("cross-polytope:50000", "too many"),
        ("cyclic:3,3", "at least D \\+ 1"),
        ("cyclic:9", "D is missing"),
        ("cyclic:100000,900", "too many"),
        ("simplex-product:1", "add up to at least 2"),
        ("simplex-product:2,0", "at least 1"),
        ("hypersimplex:4,4", "K must be below"),
        ("hypersimplex:60,30", "too many"),
        ("grid:3", "two directions"),
        ("grid:3,1", "at least 2"),
        ("grid:1000,1000,1000", "too many"),
        ("grid:" + ",".join(["2"] * 200), "too many"),
        ("polygon:2", "at least 3"),
        ("polygon:5,centre", "no parameter 'centre'"),
        ("polygon:center", "must be an integer"),
        ("prism:131", "degree above 64"),
        ("random:30", "D is missing"),
        ("random:30,3,seed", "no parameter 'seed'"),
        ("random:30,3,seed=-1", "at least 0"),
        ("random:30,3,seed=x", "seed must be an integer"),
        ("random:30,3,sead=1", "no parameter 'sead=1'"),
        ("random:3,3", "at least D \\+ 1"),
        ("sphere:2000000,3", "too many"),
        ("icosahedron:3", "no parameter '3'.*write icosahedron"),
        ("moae:1", "no parameter"),
    ],
)
def test_bad_families_and_parameters_are_refused_with_the_right_form(text: str, fragment: str) -> None:
    with pytest.raises(InputError, match=fragment) as caught:
        build(text)
    message = str(caught.value)
    name = text.partition(":")[0]
    if name in FAMILIES and not isinstance(caught.value, ConfigurationError):
        assert f"family '{name}'" in message
        assert FAMILIES[name].form in message
        assert FAMILIES[name].example in message


def test_large_members_stay_within_reach() -> None:
    assert build("cube:12").n == 4096
    assert build("hypersimplex:12,6").n == math.comb(12, 6)
    assert build("polygon:61").field.degree == 30

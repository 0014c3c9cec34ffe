"""Orbits of simplices: the same as those of all simplices, listed."""

from __future__ import annotations

import numpy as np
import pytest

import bcut
from bcut.errors import TooLargeError
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.orbit_cocircuits import orbit_formulation
from bcut.formulations.partial_cocircuits import partial_cocircuit_formulation
from bcut.geometry.canonical import CanonicalForms
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.generic_point import simplices_containing_generic_point
from bcut.geometry.orbits import simplex_orbits
from bcut.geometry.partial_chirotope import PartialChirotope
from bcut.geometry.permutations import PermutationGroup
from bcut.geometry.placing import placing_triangulation
from bcut.geometry.subsets import ranks
from bcut.geometry.symmetry import symmetry_group
from bcut.geometry.volumes import hull_volume, pulling_triangulation, volumes

NAMES = [
    "cube:3",
    "cube:4",
    "dodecahedron",
    "grid:3,3",
    "grid:3,2,2",
    "polygon:5,center",
    "hypersimplex:5,2",
    "antiprism:5",
    "moae",
    "simplex-product:2,2",
    "cyclic:8,4",
    "random:9,3,seed=2",
]


@pytest.mark.parametrize("name", [*NAMES[:9], "24-cell"])
def test_least_images_agree_with_all_images(name: str) -> None:
    group = symmetry_group(bcut.load_instance(name))
    elements = group.elements()
    forms = CanonicalForms(group)
    rng = np.random.default_rng(0)
    for size in (1, 2, 3, 4):
        sets = np.array([np.sort(rng.choice(group.n, size, replace=False)) for _ in range(60)])
        extras = np.array([rng.choice(np.setdiff1d(np.arange(group.n), row)) for row in sets])
        ways = forms.of(sets, extras)
        for number, row in enumerate(sets):
            images = np.sort(elements[:, row], axis=1)
            least = min(map(tuple, images.tolist()))
            assert least == tuple(ways.images[number].tolist())
            assert ways.stabilisers[number] == (images == row).all(axis=1).sum()
            reaching = elements[(images == np.array(least)).all(axis=1)]
            assert ways.fixing[number] == (elements[:, list(least)] == np.array(least)).all(axis=1).sum()
            # Up to the pointwise stabiliser of the image, the ways are all that elements do with the extra point.
            found = set(ways.extras[ways.owners == number].tolist())
            assert found <= set(reaching[:, extras[number]].tolist())
            if ways.fixing[number] == 1:
                assert found == set(reaching[:, extras[number]].tolist())
        rows, least_ways = forms.are_least(sets)
        assert rows.tolist() == np.flatnonzero((ways.images == sets).all(axis=1)).tolist()
        assert np.array_equal(least_ways.stabilisers, ways.stabilisers[rows])


@pytest.mark.parametrize("name", NAMES)
def test_orbits_are_those_of_the_listed_simplices(name: str) -> None:
    configuration = bcut.load_instance(name)
    group = symmetry_group(configuration)
    chirotope = Chirotope.of(configuration)
    orbits = simplex_orbits(configuration, group)
    elements = group.elements()

    def listed(sets: np.ndarray) -> dict[tuple[int, ...], int]:
        least: dict[tuple[int, ...], int] = {}
        for row in sets:
            image = min(map(tuple, np.sort(elements[:, row], axis=1).tolist()))
            least[image] = least.get(image, 0) + 1
        return least

    independent = chirotope.facets[chirotope.sides.any(axis=1)]
    for found, sizes, every in (
        (orbits.simplices, orbits.sizes, chirotope.bases),
        (orbits.facets, orbits.facet_sizes, independent),
    ):
        assert dict(zip(map(tuple, found.tolist()), sizes.tolist(), strict=True)) == listed(every)
    numbers = ranks(orbits.facets, configuration.n)
    assert np.array_equal(orbits.facet_sides, chirotope.sides[numbers])
    assert np.array_equal(orbits.facet_is_interior, chirotope.facet_is_interior[numbers])
    assert orbits.hull_facets == chirotope.hull_facets


@pytest.mark.parametrize(
    ("name", "simplices", "count"), [("cube:5", 237, 556_192), ("cube:6", 9892, 366_179_200)]
)
def test_cubes_have_the_known_numbers_of_simplices(name: str, simplices: int, count: int) -> None:
    configuration = bcut.load_instance(name)
    orbits = simplex_orbits(configuration, symmetry_group(configuration))
    assert len(orbits.simplices) == simplices
    assert orbits.number_of_simplices == count


def test_orbits_under_subgroups_split_those_of_the_group() -> None:
    configuration = bcut.load_instance("cube:4")
    group = symmetry_group(configuration)
    whole = simplex_orbits(configuration, group)
    smaller = simplex_orbits(configuration, group.reduced(30))
    trivial = simplex_orbits(configuration, PermutationGroup.trivial(16))
    assert len(whole.simplices) < len(smaller.simplices) < len(trivial.simplices)
    assert whole.number_of_simplices == smaller.number_of_simplices == trivial.number_of_simplices == 3008


@pytest.mark.parametrize("spanning", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_rows_are_averages_of_the_cocircuit_rows(name: str, spanning: bool) -> None:
    """Any vector that is constant on orbits has the same activities in both programs."""
    configuration = bcut.load_instance(name)
    group = symmetry_group(configuration)
    full = cocircuit_formulation(configuration, spanning=spanning)
    averaged = orbit_formulation(simplex_orbits(configuration, group), spanning=spanning)
    simplices, orbit_of = averaged.expanded(np.arange(len(averaged.simplices)))
    assert np.array_equal(simplices, full.simplices)
    weights = np.random.default_rng(1).integers(-50, 50, size=len(averaged.simplices))
    activity = full.matrix.astype(np.int64) @ weights[orbit_of]
    row_of = {face: row for row, face in enumerate(full.row_faces)}
    elements = group.elements()
    rows = averaged.matrix.astype(np.int64) @ (weights * averaged.sizes)
    seen = {0}
    for face, value in zip(averaged.row_faces.tolist(), rows.tolist(), strict=True):
        images = {tuple(sorted(image)) for image in elements[:, face].tolist()}
        assert value == len(images) * activity[row_of[tuple(face)]]
        seen.update(row_of[image] for image in images if image in row_of)
    # The rows that are left out say nothing about such vectors.
    left_out = np.setdiff1d(np.arange(len(activity)), list(seen))
    assert not activity[left_out].any()
    assert np.array_equal(np.bincount(orbit_of, minlength=len(averaged.sizes)), averaged.sizes)


@pytest.mark.parametrize("name", [*NAMES, "prism:7", "truncated-tetrahedron"])
def test_hull_volumes_are_those_of_triangulations(name: str) -> None:
    configuration = bcut.load_instance(name)
    chirotope = Chirotope.of(configuration)
    placed = placing_triangulation(configuration, chirotope)
    expected = volumes(configuration, placed).astype(object).sum(axis=0)
    assert np.array_equal(hull_volume(configuration, chirotope.hull_facets), expected)
    field = configuration.field
    assert (field.signs(volumes(configuration, chirotope.bases)) > 0).all()


def test_pulling_a_cube_gives_its_unimodular_triangulations() -> None:
    cube = bcut.load_instance("cube:4")
    pulled = pulling_triangulation(Chirotope.of(cube).hull_facets, cube.n)
    assert len(pulled) == 24
    assert set(volumes(cube, pulled)[:, 0].tolist()) == {1}


@pytest.mark.parametrize("name", ["cube:4", "dodecahedron", "grid:3,3,2", "moae", "random:10,3,seed=5"])
def test_partial_formulations_are_restrictions_of_the_full_one(name: str) -> None:
    configuration = bcut.load_instance(name)
    full = cocircuit_formulation(configuration)
    rng = np.random.default_rng(3)
    for share in (0.1, 0.6, 1.0):
        columns = np.flatnonzero(rng.random(len(full.simplices)) <= share)
        expected = full.restricted_to(columns)
        found = partial_cocircuit_formulation(
            configuration, full.simplices[columns], full.chirotope.hull_facets
        )
        assert found.row_faces == expected.row_faces
        assert (found.matrix[1:] != expected.matrix[1:]).nnz == 0
        assert np.array_equal(found.lower, expected.lower)
    placed = full.columns_of(placing_triangulation(configuration, full.chirotope))
    chosen = np.zeros(len(full.simplices), dtype=np.int64)
    chosen[placed] = 1
    assert np.array_equal(found.matrix.astype(np.int64) @ chosen, found.lower)
    # The coverage row of all simplices is one of a flag, too.
    flags = full.chirotope.bases[:200]
    rows = {
        simplices_containing_generic_point(full.chirotope, full.simplices, np.roll(flag, turn)).tobytes()
        for flag in flags
        for turn in range(flags.shape[1])
    }
    assert found.matrix[0].toarray()[0].astype(bool).tobytes() in rows


def test_a_formulation_that_covers_nothing_keeps_its_coverage_row() -> None:
    square = bcut.load_instance("grid:3,2")
    chirotope = Chirotope.of(square)
    far = chirotope.bases[~(chirotope.bases == 0).any(axis=1)]
    found = partial_cocircuit_formulation(square, far, chirotope.hull_facets)
    assert found.row_faces[0] is None
    assert found.matrix[0].nnz == 0
    assert found.lower[0] == 1
    assert len(found.row_faces) == found.matrix.shape[0]


def test_signs_on_demand_agree_with_the_table() -> None:
    configuration = bcut.load_instance("dodecahedron")
    chirotope = Chirotope.of(configuration)
    partial = PartialChirotope(configuration, chirotope.hull_facets)
    assert np.array_equal(partial.orientations(chirotope.bases), chirotope.orientations(chirotope.bases))
    assert partial.orientations(chirotope.bases[0]) == chirotope.orientations(chirotope.bases[0])
    assert partial.hull_facets == chirotope.hull_facets
    for name in ("bases", "facets", "sides", "facet_is_interior", "is_general"):
        with pytest.raises(TooLargeError, match="dodecahedron"):
            getattr(partial, name)

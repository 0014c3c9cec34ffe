"""Averaged link cuts: valid, exact averages, and as strong as all images together."""

from __future__ import annotations

from fractions import Fraction
from math import ceil

import numpy as np
import pytest

import bcut
from bcut.bounds.orbit_cuts import OrbitLinks, orbit_root_with_cuts, orbit_stars
from bcut.bounds.orbit_root import orbit_root, safe_orbit_bound
from bcut.formulations.orbit_cocircuits import OrbitFormulation, orbit_formulation
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.orbits import simplex_orbits
from bcut.geometry.permutations import PermutationGroup
from bcut.geometry.symmetry import symmetry_group
from bcut.geometry.triangulations import triangulations
from bcut.objectives.objective import Objective, from_fractions
from bcut.solving.orbit_stage import orbit_stage


def averaged(name: str, group: PermutationGroup | None = None, *, spanning: bool = False) -> OrbitFormulation:
    configuration = bcut.load_instance(name)
    orbits = simplex_orbits(configuration, group or symmetry_group(configuration))
    return orbit_formulation(orbits, spanning=spanning)


def random_costs(formulation: OrbitFormulation, seed: int) -> Objective:
    """Costs 0 and 1, of which three in ten, half or seven in ten are 1: more optima are fractional than otherwise."""
    drawn = np.random.default_rng(seed // 3).random(len(formulation.simplices)) < (0.3, 0.5, 0.7)[seed % 3]
    return from_fractions("test", "min", [Fraction(int(v)) for v in drawn])


def cuts_for(formulation: OrbitFormulation, seeds: range) -> list:
    """Cuts at the optima of random invariant costs."""
    links = OrbitLinks(formulation)
    found = []
    for seed in seeds:
        point = orbit_root(formulation, random_costs(formulation, seed)).point
        assert point is not None
        found += links.separate(point)
    return found


@pytest.mark.parametrize(
    ("name", "limit", "spanning"),
    [("prism:5", 2, False), ("icosahedron", 2, False), ("grid:3,2,2", 2, True), ("grid:3,2,2", 1, True)],
)
def test_no_triangulation_violates_an_averaged_cut(name: str, limit: int, spanning: bool) -> None:
    configuration = bcut.load_instance(name)
    chirotope = Chirotope.of(configuration)
    formulation = averaged(name, symmetry_group(configuration).reduced(limit), spanning=spanning)
    simplices, orbit_of = formulation.expanded(np.arange(len(formulation.simplices)))
    cuts = cuts_for(formulation, range(180))
    assert cuts
    checked = 0
    for chosen in triangulations(chirotope, spanning=spanning):
        sums = np.bincount(orbit_of[list(chosen)], minlength=len(formulation.simplices))
        assert all(cut.row @ sums <= 0 for cut in cuts)
        checked += 1
    assert checked > 50
    assert len(simplices) == len(orbit_of)


def test_cuts_are_averages_over_the_group() -> None:
    formulation = averaged("dodecahedron")
    simplices, orbit_of = formulation.expanded(np.arange(len(formulation.simplices)))
    place = {tuple(row): column for column, row in enumerate(simplices.tolist())}
    elements = formulation.orbits.group.elements()
    cuts = cuts_for(formulation, range(12))
    assert len(cuts) >= 3
    rng = np.random.default_rng(0)
    for cut in cuts:
        x = rng.integers(0, 100, size=len(simplices))
        total = 0
        for element in elements:
            images = np.sort(element[cut.simplices], axis=1).tolist()
            total += sum(
                c * x[place[tuple(s)]] for c, s in zip(cut.coefficients.tolist(), images, strict=True)
            )
        sums = np.bincount(orbit_of, weights=x, minlength=len(formulation.simplices)).astype(np.int64)
        activity = int(cut.row @ sums)
        assert total == 0 == activity or total / activity > 0
        assert activity == 0 or (Fraction(int(total), activity)).denominator == 1


def test_stars_are_complete() -> None:
    """Around each face there is one wedge for every simplex of the configuration that contains it."""
    formulation = averaged("cuboctahedron")
    chirotope = Chirotope.of(formulation.configuration)
    stars = orbit_stars(formulation)
    assert stars
    for item in stars:
        contain = (chirotope.bases[:, :, None] == item.star.face).any(axis=1).all(axis=1)
        assert len(item.star.columns) == contain.sum()
        # Each wedge belongs to the orbit that its simplex is in.
        for column, orbit in zip(item.star.columns.tolist(), item.orbits.tolist(), strict=True):
            images = formulation.orbits.group.orbit(item.simplices[column]).tolist()
            assert formulation.simplices[orbit].tolist() in images


@pytest.mark.parametrize(
    ("name", "sense", "before", "after"),
    [
        ("dodecahedron", "min", 22.5, 23.0),
        ("icosidodecahedron", "min", 44.6666667, 45.0),
        ("icosidodecahedron", "max", 83.0, 79.1176471),
        ("truncated-octahedron", "max", 50.0, 49.2),
        ("24-cell", "max", 92.5714286, 92.0),
        ("cube:4", "min", 16.0, 16.0),
    ],
)
def test_cuts_move_the_bounds_of_symmetric_solids(name: str, sense: str, before: float, after: float) -> None:
    stage = orbit_stage(bcut.load_instance(name), sense=sense)
    assert stage.root.lp == pytest.approx(before, abs=1e-6)
    root = orbit_root_with_cuts(stage.formulation, stage.objective)
    assert root.status == "dry"
    assert root.rounds[-1].lp == pytest.approx(after, abs=1e-6)
    assert root.root.bound is not None
    assert float(root.root.bound.value) == pytest.approx(stage.objective.sign * after, abs=1e-5)
    cut_stage = stage.with_link_cuts()
    assert cut_stage.root.bound is not None
    assert stage.root.bound is not None
    assert cut_stage.root.bound.value >= stage.root.bound.value
    target = Fraction(ceil(cut_stage.root.bound.value))
    assert cut_stage.columns_within(target) <= stage.columns_within(target)


def test_the_bound_is_that_of_the_relaxation_with_all_images_of_the_cuts() -> None:
    """Cuts found under a smaller group, separately, reach no further than under the whole one, and the same here."""
    group = symmetry_group(bcut.load_instance("dodecahedron"))
    for limit in (group.order, 6):
        formulation = averaged("dodecahedron", group.reduced(limit))
        objective = Objective("cardinality", "min", np.ones(len(formulation.simplices), dtype=np.int64))
        assert orbit_root_with_cuts(formulation, objective).rounds[-1].lp == pytest.approx(23, abs=1e-6)


def test_multipliers_of_cuts_never_help_with_the_wrong_sign() -> None:
    formulation = averaged("dodecahedron")
    objective = Objective("cardinality", "min", np.ones(len(formulation.simplices), dtype=np.int64))
    found = orbit_root_with_cuts(formulation, objective)
    assert found.formulation.cuts is not None
    assert found.root.bound is not None
    rows, cuts = formulation.matrix.shape[0], found.formulation.cuts.shape[0]
    assert (found.root.bound.multipliers[rows:] <= 0).all()
    duals = np.concatenate((np.zeros(rows), np.full(cuts, 1e3)))
    assert safe_orbit_bound(found.formulation, objective, duals, 0.0).value == 0


def test_goals_and_limits_stop_the_loop() -> None:
    formulation = averaged("icosidodecahedron")
    objective = Objective("cardinality", "max", np.ones(len(formulation.simplices), dtype=np.int64))
    few = orbit_root_with_cuts(formulation, objective, rounds=2)
    assert (few.status, len(few.rounds)) == ("rounds", 3)
    reached = orbit_root_with_cuts(formulation, objective, goal=Fraction(-82))
    assert reached.rounds[-1].lp < 82 < reached.rounds[-2].lp

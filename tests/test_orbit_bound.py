"""The averaged relaxation: the same bound as the relaxation itself, exactly proven, and fixing that loses nothing."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from itertools import product
from math import ceil, comb
from pathlib import Path

import numpy as np
import pytest

import bcut
from bcut.bounds import orbit_root as bounds
from bcut.bounds.averaged import AveragedPart
from bcut.bounds.averaged_root import averaged_root
from bcut.bounds.linear_program import LinearProgram, solve_linear_program
from bcut.bounds.orbit_root import orbit_root, safe_orbit_bound
from bcut.bounds.root import root_bound
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.invariant import invariant_program
from bcut.formulations.orbit_cocircuits import OrbitFormulation, orbit_formulation
from bcut.formulations.partial_cocircuits import partial_cocircuit_formulation
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.generic_point import simplices_containing_generic_point
from bcut.geometry.orbits import simplex_orbits
from bcut.geometry.permutations import PermutationGroup
from bcut.geometry.symmetry import symmetry_group
from bcut.geometry.triangulations import triangulations
from bcut.objectives.objective import Objective, from_fractions
from bcut.solving.invariant_search import find_invariant_triangulation, invariant_objective
from bcut.solving.orbit_stage import orbit_stage
from bcut.verification.triangulation import check_triangulation

# Instances with known optima (min, max); None where only the two relaxations are compared.
KNOWN = [
    ("polygon:6", False, 4, 4),
    ("polygon:5,center", False, 3, 5),
    ("moae", False, 1, 7),
    ("grid:3,3", False, 2, 8),
    ("grid:3,3", True, 8, 8),
    ("grid:4,4", True, 18, 18),
    ("grid:3,2,2", True, 9, 12),
    ("grid:3,3,3", True, 35, 48),
    ("cross-polytope:3", False, 4, 4),
    ("cross-polytope:4", False, 8, 8),
    ("cross-polytope:5", False, 16, 16),
    ("cube:3", False, 5, 6),
    ("cube:4", False, 16, 24),
    ("prism:3", False, 3, 3),
    ("prism:4", False, 5, 6),
    ("prism:5", False, 8, 10),
    ("prism:6", False, 10, 14),
    ("antiprism:3", False, 4, 4),
    ("antiprism:4", False, 7, 8),
    ("antiprism:5", False, 10, 12),
    ("antiprism:6", False, 13, 17),
    ("icosahedron", False, 15, 20),
    ("cuboctahedron", False, 13, 17),
    ("dodecahedron", False, 23, 36),
    ("simplex-product:2,1,1", False, 10, 12),
    ("simplex-product:2,2", False, 6, 6),
    ("hypersimplex:5,2", False, 11, 11),
    ("cyclic:6,3", False, 3, 6),
    ("cyclic:7,3", False, 4, 10),
    ("cyclic:8,3", False, 5, 15),
    ("cyclic:9,3", False, 6, 21),
    ("cyclic:6,4", False, 3, 3),
    ("cyclic:7,4", False, 6, 6),
    ("cyclic:8,4", False, 10, 10),
    ("cyclic:9,4", False, 15, 15),
    ("cyclic:7,5", False, 3, 4),
    ("cyclic:8,5", False, 6, 10),
]


def cardinality(count: int, sense: str) -> Objective:
    return Objective("cardinality", "min" if sense == "min" else "max", np.ones(count, dtype=np.int64))


def nested(name: str) -> PointConfiguration:
    """Return cubes, or squares, around one another: ``nested:DIMENSION,HALF AN EDGE,...``."""
    dimension, *sizes = map(int, name.removeprefix("nested:").split(","))
    signs = list(product((-1, 1), repeat=dimension))
    points = [[sign * size for sign in corner] for size in sizes for corner in signs]
    return PointConfiguration.from_values(points, name=name)


def configuration_of(name: str) -> PointConfiguration:
    return nested(name) if name.startswith("nested:") else bcut.load_instance(name)


def averaged(name: str, *, spanning: bool = False, group: PermutationGroup | None = None) -> OrbitFormulation:
    configuration = configuration_of(name)
    return orbit_formulation(
        simplex_orbits(configuration, group or symmetry_group(configuration)), spanning=spanning
    )


@pytest.mark.parametrize(("name", "spanning", "least", "most"), KNOWN)
def test_bound_is_that_of_the_full_relaxation(name: str, spanning: bool, least: int, most: int) -> None:
    full = cocircuit_formulation(bcut.load_instance(name), spanning=spanning)
    orbits = averaged(name, spanning=spanning)
    for sense, optimum in (("min", least), ("max", most)):
        objective = cardinality(len(orbits.simplices), sense)
        root = orbit_root(orbits, objective)
        expected = root_bound(full, cardinality(len(full.simplices), sense)).lp
        assert root.lp == pytest.approx(expected, rel=1e-9, abs=1e-9)
        assert root.bound is not None
        assert float(root.bound.value) == pytest.approx(objective.sign * root.lp, abs=1e-6)
        assert root.bound.value <= objective.sign * optimum


@pytest.mark.parametrize("name", ["cube:4", "dodecahedron", "grid:3,3", "hypersimplex:5,2"])
def test_bound_does_not_depend_on_which_subgroup_averages(name: str) -> None:
    group = symmetry_group(bcut.load_instance(name))
    bounds = []
    for limit in (group.order, 12, 1):
        orbits = averaged(name, group=group.reduced(limit))
        bounds.append(orbit_root(orbits, cardinality(len(orbits.simplices), "min")).lp)
    assert bounds == pytest.approx([bounds[0]] * 3, abs=1e-7)


@pytest.mark.parametrize(
    ("name", "sense", "lp"),
    [
        ("dodecahedron", "min", 22.5),
        ("dodecahedron", "max", 36),
        ("cube:5", "min", 67),
        ("cube:5", "max", 120),
        ("cube:6", "min", 308),
        ("24-cell", "min", 56),
        ("hypersimplex:6,3", "min", 58),
        ("hypersimplex:6,3", "max", 66),
        ("icosidodecahedron", "max", 83),
        ("truncated-octahedron", "max", 50),
        ("rhombicuboctahedron", "max", 61.25),
        ("truncated-cube", "min", 25),
    ],
)
@pytest.mark.parametrize("method", ["simplex", "interior"])
def test_famous_bounds_are_proven_exactly(name: str, sense: str, lp: float, method: str) -> None:
    orbits = averaged(name)
    objective = cardinality(len(orbits.simplices), sense)
    root = orbit_root(orbits, objective, method="interior" if method == "interior" else "simplex")
    assert root.lp == pytest.approx(lp, abs=1e-5)
    assert root.bound is not None
    assert ceil(root.bound.value) == ceil(objective.sign * Fraction(lp))


LARGE_VOLUMES = ["nested:2,1000001,333334", "nested:2,1500000001,500000003", "nested:2,3000000001,1000000003"]


@pytest.mark.parametrize(
    ("name", "bits", "dtype"),
    [
        *zip(LARGE_VOLUMES, (42, 62, 64), (np.int64, np.int64, object), strict=True),
        ("nested:3,10000,3334", 41, np.int64),
        ("nested:3,1320001,500009", 64, np.int64),
        ("random:9,3,seed=2", 159, object),
    ],
)
def test_volumes_are_large_with_64_bits_and_without(name: str, bits: int, dtype: type) -> None:
    orbits = averaged(name)
    assert (orbits.volume.bit_length(), orbits.volumes.dtype) == (bits, dtype)


@pytest.mark.parametrize(
    "unit", [Fraction(1, 7), Fraction(1, 10**12), Fraction(2 * 10**19), Fraction(10**40, 3)]
)
@pytest.mark.parametrize(
    "name", ["polygon:5,center", "grid:3,3", "cube:3", "moae", "cyclic:7,3", "prism:4", *LARGE_VOLUMES]
)
def test_any_multipliers_bound_every_triangulation(name: str, unit: Fraction) -> None:
    configuration = configuration_of(name)
    chirotope = Chirotope.of(configuration)
    orbits = averaged(name)
    simplices, orbit_of = orbits.expanded(np.arange(len(orbits.simplices)))
    assert np.array_equal(simplices, chirotope.bases)
    rng = np.random.default_rng(8)
    drawn = rng.integers(-9, 9, len(orbits.simplices)).tolist()
    costs, counts = (
        from_fractions("test", "max", [value * size for value in drawn]) for size in (unit, Fraction(1))
    )
    every = [np.array(chosen) for chosen in triangulations(chirotope)]
    values = [-costs.restricted_to(orbit_of).value(chosen) for chosen in every]
    for scale in (0.0, 0.3, 30.0):
        duals, coverage = rng.normal(size=orbits.matrix.shape[0]) * scale, float(rng.normal()) * scale
        bound = safe_orbit_bound(orbits, costs, duals * float(unit), coverage * float(unit))
        check_formula(orbits, costs, bound)
        # It does not matter what costs are counted in.
        counted = safe_orbit_bound(orbits, counts, duals, coverage)
        assert float(bound.value / unit) == pytest.approx(float(counted.value), rel=1e-9)
        for chosen, value in zip(every, values, strict=True):
            assert bound.value <= value
            # Fixing keeps whatever reaches a target.
            assert set(orbit_of[chosen].tolist()) <= set(bound.orbits_within(value).tolist())


def check_formula(orbits: OrbitFormulation, objective: Objective, bound: bounds.OrbitBound) -> None:
    """Compute a bound once more, in fractions; where costs are rounded, by less than what integers count."""
    y = [Fraction(int(v), bound.denominator) for v in bound.multipliers.tolist()]
    z = Fraction(bound.coverage, bound.denominator)
    costs = objective.exact_costs(np.arange(len(orbits.simplices)))
    total = z * orbits.volume
    columns = orbits.matrix.tocsc()
    for column, (size, volume) in enumerate(zip(orbits.sizes.tolist(), orbits.volumes.tolist(), strict=True)):
        part = slice(columns.indptr[column], columns.indptr[column + 1])
        entries = zip(columns.indices[part].tolist(), columns.data[part].tolist(), strict=True)
        exact = objective.sign * costs[column] - z * volume - sum(y[row] * value for row, value in entries)
        reduced = Fraction(int(bound.reduced_costs[column]), bound.denominator)
        assert 0 <= exact - reduced < Fraction(1, bound.denominator)
        total += size * min(Fraction(0), reduced)
    assert total == bound.value


@pytest.mark.parametrize(
    ("name", "cost"),
    [
        ("dodecahedron", Fraction(1)),
        ("dodecahedron", Fraction(1, 10**12)),
        ("dodecahedron", Fraction(2 * 10**19)),
        ("cube:4", Fraction(10**200, 3)),
        ("nested:3,10000,3334", Fraction(1)),
        ("nested:3,123457,41153", Fraction(1)),
        ("nested:3,123457,41153", Fraction(1, 10**12)),
        ("nested:3,1320001,500009", Fraction(1)),
        ("nested:2,1500000001,500000003", Fraction(1)),
        ("random:9,3,seed=2", Fraction(10**20)),
    ],
)
@pytest.mark.parametrize("sense", ["min", "max"])
def test_bounds_are_what_the_multipliers_say(name: str, cost: Fraction, sense: str) -> None:
    orbits = averaged(name)
    objective = from_fractions("costs", "min" if sense == "min" else "max", [cost] * len(orbits.simplices))
    root = orbit_root(orbits, objective, method="interior")
    counted = orbit_root(orbits, cardinality(len(orbits.simplices), sense), method="interior")
    assert root.lp == pytest.approx(counted.lp * float(cost), rel=1e-7)
    for found, costs in ((root, objective), (counted, cardinality(len(orbits.simplices), sense))):
        assert found.bound is not None
        check_formula(orbits, costs, found.bound)
        assert float(found.bound.value) == pytest.approx(costs.sign * found.lp, rel=1e-7)


def test_products_beyond_64_bits_are_exact() -> None:
    """Cuts of large entries: there is no shift for which 64 bits do."""
    import scipy.sparse as sp

    orbits = averaged("grid:3,3")
    row = np.arange(len(orbits.simplices), dtype=np.int64) << 57
    cut = orbits.with_cuts(sp.csr_matrix(-np.stack([row] * 40)))
    objective = cardinality(len(orbits.simplices), "min")
    duals = np.full(orbits.matrix.shape[0] + 40, -0.9)
    bound = safe_orbit_bound(cut, objective, duals, 0.25)
    whole = replace(
        cut, matrix=sp.vstack((orbits.matrix.astype(np.int64), cut.cuts), format="csr"), cuts=None
    )
    check_formula(whole, objective, bound)


def test_what_the_smallest_volume_needs_may_be_too_much_for_64_bits_times_the_largest() -> None:
    orbits = averaged("grid:4,4")
    costs = from_fractions("costs", "max", [Fraction(1 << 20)] * len(orbits.simplices))
    bound = safe_orbit_bound(orbits, costs, np.zeros(orbits.matrix.shape[0]), 0.0)
    assert int(orbits.volumes.max()) * abs(bound.coverage) >= 2**63
    check_formula(orbits, costs, bound)
    # Each triangle costs -2**20 and has at least 1/18 of the volume.
    assert bound.value == -18 << 20
    assert bound.reduced_costs.min() == 0


@pytest.mark.parametrize(
    ("name", "sense"),
    [("nested:3,10000,3334,1237", "min"), ("nested:3,10000,3334", "max"), ("nested:3,123457,41153", "min")],
)
def test_orbits_and_listing_agree_on_large_volumes(name: str, sense: str) -> None:
    configuration = nested(name)
    listed = bcut.solve(configuration, sense=sense, method="listing")
    found = bcut.solve(configuration, sense=sense, method="orbits")
    assert listed.status == found.status == "optimal"
    assert found.value == found.bound == listed.value
    assert bcut.verify(found).proven_optimal


@pytest.mark.parametrize("sense", ["min", "max"])
@pytest.mark.parametrize("cost", [1e-12, 2 * 10**19, 10**20, -(10**25), "1/3000000000000"])
def test_costs_of_all_sizes_have_the_same_triangulations(
    cost: float | str, sense: str, tmp_path: Path
) -> None:
    path = tmp_path / "costs.json"
    path.write_text(json.dumps({"default": cost, "costs": []}), encoding="utf-8")
    factor = Fraction(cost)
    configuration = bcut.load_instance("cube:3")
    best = 5 if (sense == "min") == (factor > 0) else 6
    stage = orbit_stage(configuration, f"costs:{path}", sense=sense)
    assert stage.root.lp == pytest.approx(float(best * factor), rel=1e-9)
    result = bcut.solve(configuration, objective=f"costs:{path}", sense=sense, method="orbits")
    assert result.status == "optimal"
    assert len(result.triangulation or ()) == best
    assert bcut.verify(result).value == Fraction(cost) * best
    assert result.certificate is not None
    for value in (result.value, result.bound, result.root.lp, Fraction(result.certificate.bound or 0)):
        assert float(value) == pytest.approx(float(best * factor), rel=1e-9)


def test_a_part_without_points_is_refuted_next_to_large_costs() -> None:
    """What covers everything instead has to cost as much as a simplex, though the target is zero."""
    stage = orbit_stage(bcut.load_instance("cube:3"))
    formulation, _ = stage.residual(stage.target_for(10**6))
    signs = Chirotope.of(stage.configuration)
    covering = simplices_containing_generic_point(signs, formulation.simplices, stage.flag)
    columns = np.setdiff1d(np.arange(len(formulation.simplices)), np.flatnonzero(covering))
    whole = AveragedPart(
        replace(formulation, chirotope=signs),
        from_fractions("costs", "min", [Fraction(10**20)] * len(formulation.simplices)),
        stage.flag,
        PermutationGroup.generated_by(np.empty((0, 8), dtype=np.int64), 8),
        columns,
    )
    root = averaged_root(whole, Fraction(0))
    assert root.status == "refuted"
    assert root.stages[-1].bound.value > 0


def test_coordinates_of_many_digits_are_bounded_exactly() -> None:
    orbits = averaged("random:9,3,seed=2")
    assert orbits.volumes.dtype == object
    full = cocircuit_formulation(bcut.load_instance("random:9,3,seed=2"))
    objective = cardinality(len(orbits.simplices), "min")
    root = orbit_root(orbits, objective)
    assert root.lp == pytest.approx(root_bound(full, cardinality(len(full.simplices), "min")).lp, abs=1e-7)
    assert root.bound is not None
    assert float(root.bound.value) == pytest.approx(root.lp, abs=1e-6)


def test_interior_duals_fix_most_of_the_five_cube() -> None:
    orbits = averaged("cube:5")
    bound = orbit_root(orbits, cardinality(len(orbits.simplices), "min"), method="interior").bound
    assert bound is not None
    left = bound.orbits_within(Fraction(67))
    assert (len(left), int(orbits.sizes[left].sum())) == (14, 12_352)
    assert len(bound.orbits_within(Fraction(66))) == 0


@pytest.mark.parametrize(
    ("name", "sense", "optimum"),
    [("cube:4", "min", 16), ("cube:5", "min", 67), ("24-cell", "min", 56), ("dodecahedron", "min", 23)],
)
def test_invariant_triangulations_reach_the_bound(name: str, sense: str, optimum: int) -> None:
    configuration = bcut.load_instance(name)
    group = symmetry_group(configuration)
    orbits = averaged(name)
    objective = cardinality(len(orbits.simplices), sense)
    bound = orbit_root(orbits, objective, method="interior").bound
    assert bound is not None
    target = Fraction(ceil(bound.value))
    simplices, orbit_of = orbits.expanded(bound.orbits_within(target))
    part = partial_cocircuit_formulation(configuration, simplices, orbits.orbits.hull_facets)
    found = find_invariant_triangulation(
        part, objective.restricted_to(orbit_of), group, cutoff=target + Fraction(1, 2), goal=target
    )
    assert found is not None
    assert found.value == target == optimum
    chosen = simplices[found.columns]
    check_triangulation(configuration.scalars(), chosen.tolist(), spanning=False)
    assert found.subgroup.order > 1
    for generator in found.subgroup.generators:
        images = np.sort(generator[chosen], axis=1)
        assert set(map(tuple, images.tolist())) == set(map(tuple, chosen.tolist()))


def test_invariant_programs_have_the_invariant_triangulations() -> None:
    """Every triangulation of the 3-cube that a quarter turn leaves invariant is a point of the small program."""
    configuration = bcut.load_instance("cube:3")
    chirotope = Chirotope.of(configuration)
    full = cocircuit_formulation(configuration)
    half_turn = np.array([6, 7, 4, 5, 2, 3, 0, 1])
    subgroup = PermutationGroup.generated_by(half_turn[None, :], 8)
    program = invariant_program(full, subgroup)
    objective = invariant_objective(program, cardinality(len(full.simplices), "min"))
    small = program.formulation
    invariant = 0
    for triangulation in triangulations(chirotope):
        chosen = np.array(triangulation)
        rows = {tuple(row) for row in full.simplices[chosen].tolist()}
        if {tuple(sorted(half_turn[list(row)].tolist())) for row in rows} != rows:
            continue
        invariant += 1
        columns = np.unique(program.orbit_of[chosen])
        x = np.zeros(len(small.simplices), dtype=np.int64)
        x[columns] = 1
        assert np.array_equal(small.matrix.astype(np.int64) @ x, small.lower)
        assert objective.value(columns) == len(chosen)
        assert np.array_equal(program.expanded(columns), np.sort(chosen))
    points = _binary_points(small.matrix.astype(np.int64).toarray(), small.lower)
    assert points == invariant > 0


def _binary_points(matrix: np.ndarray, right: np.ndarray) -> int:
    """Count the 0/1 solutions, column by column."""
    states = {tuple([0] * len(right)): 1}
    later = np.abs(matrix)[:, ::-1].cumsum(axis=1)[:, ::-1]
    for column in range(matrix.shape[1]):
        grown: dict[tuple[int, ...], int] = {}
        for state, ways in states.items():
            for choice in (0, 1):
                new = np.array(state) + choice * matrix[:, column]
                rest = later[:, column + 1] if column + 1 < matrix.shape[1] else 0
                if (np.abs(right - new) <= rest).all():
                    key = tuple(new.tolist())
                    grown[key] = grown.get(key, 0) + ways
        states = grown
    return states.get(tuple(right.tolist()), 0)


def test_linear_programs_without_points_are_recognised() -> None:
    import scipy.sparse as sp

    matrix = sp.csr_matrix(np.array([[1.0, 1.0], [1.0, 1.0]]))
    for method in ("simplex", "interior"):
        found = solve_linear_program(
            LinearProgram(np.ones(2), matrix, np.array([1.0, 2.0]), np.array([1.0, 2.0])),
            method="interior" if method == "interior" else "simplex",
        )
        assert found.status == "infeasible"
    none = averaged("grid:3,2", spanning=True)
    assert orbit_root(none, cardinality(len(none.simplices), "min")).status == "optimal"


def test_numbers_of_simplices_of_the_six_cube_are_not_listed_anywhere() -> None:
    """The whole bound takes no table over the subsets."""
    orbits = averaged("cube:6")
    assert comb(64, 7) > 600_000_000
    assert orbits.size == (9892, 1150)

"""First-order bounds of large programs: over orbits, without a point to start from, and interrupted."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

import bcut
from bcut.bounds import large_program
from bcut.bounds.first_order import Progress, first_order_bound
from bcut.bounds.large_program import solve_large_program
from bcut.bounds.linear_program import LinearProgram, solve_linear_program
from bcut.bounds.orbit_root import orbit_root
from bcut.formulations.orbit_cocircuits import orbit_formulation
from bcut.geometry.orbits import simplex_orbits
from bcut.geometry.symmetry import symmetry_group
from bcut.objectives.objective import Objective, make_objective


def orbit_program(name: str, sense: str) -> tuple[Any, Objective]:
    configuration = bcut.load_instance(name)
    formulation = orbit_formulation(simplex_orbits(configuration, symmetry_group(configuration)))
    return formulation, make_objective("cardinality", formulation, sense=sense)


@pytest.mark.parametrize("method", ["simplex", "interior"])
@pytest.mark.parametrize(
    ("name", "sense", "lp"),
    [
        ("cube:4", "min", 16),
        ("cube:4", "max", 24),
        ("cube:5", "min", 67),
        ("cube:5", "max", 120),
        ("dodecahedron", "min", Fraction(45, 2)),
        ("24-cell", "min", None),
        ("hypersimplex:5,2", "max", 11),
    ],
)
def test_orbit_programs_by_the_large_way(
    monkeypatch: pytest.MonkeyPatch, name: str, sense: str, lp: Fraction | int | None, method: Any
) -> None:
    formulation, objective = orbit_program(name, sense)
    direct = orbit_root(formulation, objective, method=method)
    monkeypatch.setattr("bcut.bounds.orbit_root.LARGE", 1)
    large = orbit_root(formulation, objective, method=method)
    assert large.status == "optimal"
    assert large.lp == pytest.approx(direct.lp, abs=1e-7)
    assert lp is None or large.lp == pytest.approx(float(lp), abs=1e-7)
    assert large.bound is not None
    assert large.lp is not None
    assert large.point is not None
    assert abs(float(large.bound.value) - objective.sign * large.lp) < 1e-6
    np.testing.assert_allclose(formulation.matrix @ large.point, 0.0, atol=1e-6)


@pytest.mark.parametrize(("name", "lp", "orbits"), [("cube:4", 16, None), ("cube:5", 67, 14)])
def test_the_middle_of_the_optimal_multipliers_fixes_the_most(
    monkeypatch: pytest.MonkeyPatch, name: str, lp: int, orbits: int | None
) -> None:
    formulation, objective = orbit_program(name, "min")
    direct = orbit_root(formulation, objective, method="interior")
    monkeypatch.setattr("bcut.bounds.orbit_root.LARGE", 1)
    vertex, middle = (orbit_root(formulation, objective, method=m) for m in ("simplex", "interior"))
    left = [len(root.bound.orbits_within(Fraction(lp))) for root in (direct, middle, vertex) if root.bound]
    assert left[1] <= left[0]
    assert left[1] <= left[2]
    assert orbits is None or left[1] == orbits


def test_a_limit_of_time_leaves_a_proven_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    formulation, objective = orbit_program("cube:5", "min")
    monkeypatch.setattr("bcut.bounds.orbit_root.LARGE", 1)
    root = orbit_root(formulation, objective, seconds=0.0)
    assert root.status == "limit"
    assert root.bound is not None
    assert 0 <= root.bound.value <= 67


def test_large_programs_without_a_point() -> None:
    """One orbit of simplices alone covers the cube, or it does not."""
    formulation, objective = orbit_program("cube:3", "min")
    matrix = sp.vstack((formulation.volumes[None] / 6, formulation.matrix)).tocsc()
    lower = np.zeros(matrix.shape[0])
    lower[0] = 1.0
    seen = set()
    for alone in range(matrix.shape[1]):
        part = matrix[:, [alone]].tocsr()
        program = LinearProgram(objective.costs[[alone]], part, lower, lower)
        status = solve_large_program(program).status
        assert status == solve_linear_program(program).status
        seen.add(status)
    assert seen == {"optimal", "infeasible"}


def test_an_interrupt_ends_a_large_program(monkeypatch: pytest.MonkeyPatch) -> None:
    formulation, objective = orbit_program("cube:4", "min")
    monkeypatch.setattr("bcut.bounds.orbit_root.LARGE", 1)

    def interrupted(*arguments: Any, **options: Any) -> Any:
        def tell(progress: Progress) -> None:
            raise KeyboardInterrupt

        return first_order_bound(*arguments, **options, on_progress=tell)

    monkeypatch.setattr(large_program, "first_order_bound", interrupted)
    with pytest.raises(KeyboardInterrupt):
        orbit_root(formulation, objective)

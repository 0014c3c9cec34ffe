"""Relaxations for the tests of first-order bounds, and points of them."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

import bcut
from bcut.bounds.columns import Columns
from bcut.bounds.coverage_points import coverage_points
from bcut.bounds.repair import Program
from bcut.formulations.compact import CompactProgram, compact_program
from bcut.formulations.formulation import Formulation


def listed(name: str, *, spanning: bool = True) -> CompactProgram:
    return compact_program(bcut.load_instance(name), spanning=spanning)


def as_program(program: CompactProgram, costs: np.ndarray, *, points: int | None = 8) -> Program:
    columns = Columns.of_facets(
        program.facet_rows, program.facet_signs, program.coverage, len(program.row_faces)
    )
    sides = np.zeros(columns.rows)
    sides[0] = 1.0
    result = Program(columns, costs, sides, sides.copy(), 1.0)
    return result.with_combinations(coverage_points(program, points=points)) if points != 0 else result


def solution_of(formulation: Formulation) -> np.ndarray:
    """Return a point of the relaxation."""
    return linprog(
        np.ones(len(formulation.simplices)), A_eq=formulation.matrix, b_eq=formulation.lower, method="highs"
    ).x

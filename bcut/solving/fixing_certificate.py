"""Certificates of bounds that were proven on flat arrays, without a model of all columns."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.compact_bound import CompactBound, Residual, compact_bound
from bcut.bounds.relaxation import InfeasibleRelaxationError
from bcut.bounds.root import Stage
from bcut.formulations.compact import CompactProgram
from bcut.geometry.rank import pivot_columns
from bcut.objectives.objective import Objective
from bcut.result import Certificate
from bcut.solving.certificates import stage_data

# More rows make files that nobody wants to read, and that verification would take hours for.
MAX_ROWS = 60_000
# What a triangulation must be better by, relative to the value, to be excluded by the certificate.
_LEAST_GAIN = Fraction(1, 2 * 10**9)


def make_compact_certificate(
    program: CompactProgram,
    objective: Objective,
    found: CompactBound,
    refutation: tuple[Fraction, Sequence[Stage]] | None = None,
) -> Certificate:
    """Write out the multipliers of a bound, and perhaps the refutation of a target beyond it.

    Parameters
    ----------
    program : CompactProgram
        With all its columns: a certificate speaks of every triangulation.
    objective : Objective
    found : CompactBound
        On all these columns.
    refutation : (Fraction, sequence of Stage), optional
        A value of ``sign * objective`` that no triangulation reaches, and why.
    """
    if len(program.row_faces) > MAX_ROWS:
        return Certificate(
            reason=f"the multipliers of {len(program.row_faces):,} rows are not written; at most {MAX_ROWS:,} are"
        )
    if not found.plain:
        return Certificate(reason="the bound rests on how many simplices a triangulation has at most")
    bound = found.bound
    multipliers: list[list[object]] = []
    if bound.multipliers[0]:
        multipliers.append(["coverage", str(int(bound.multipliers[0]) * bound.unit)])
    used = np.flatnonzero(bound.multipliers[1:])
    values = bound.multipliers[1:][used].tolist()
    for face, multiplier in zip(program.row_faces[used].tolist(), values, strict=True):
        multipliers.append([face, str(multiplier * bound.unit)])
    refutes = None
    if refutation is not None:
        target, stages = refutation
        refutes = {"target": str(objective.sign * target), "stages": [stage_data(stage) for stage in stages]}
    return Certificate(
        bound=str(objective.sign * bound.value),
        flag=first_basis(program),
        multipliers=multipliers,
        refutes=refutes,
    )


def first_basis(program: CompactProgram) -> list[int]:
    """Return the first affinely independent d + 1 points, whose generic point the coverage row is about."""
    d = program.configuration.dimension
    first = np.arange(d + 1)
    if program.chirotope.orientations(first[None, :])[0]:
        return [int(point) for point in first]
    points = program.configuration.scalars()
    rows: list[list[Any]] = [[Fraction(1)] * len(points)]
    rows += [[point[j] for point in points] for j in range(d)]
    return list(pivot_columns(rows))


def refute_better(
    program: CompactProgram,
    objective: Objective,
    found: CompactBound,
    value: Fraction,
    deadline: float | None = None,
) -> tuple[Fraction, tuple[Stage, ...]] | None:
    """Prove by one relaxation on the columns left that nothing is better than a value, up to rounding.

    Parameters
    ----------
    program : CompactProgram
    objective : Objective
    found : CompactBound
    value : Fraction
        ``sign * objective`` of the best triangulation.
    deadline : float, optional

    Returns
    -------
    (Fraction, tuple of Stage) or None
        The target that is refuted, and the proof. None where the relaxation does not give one.
    """
    target = value - _LEAST_GAIN * max(Fraction(1), abs(value))
    if objective.counts_units:
        target = value - objective.unit
    if found.bound.value > target:
        return None
    columns = found.bound.columns_within(target)
    residual = Residual.of(program, objective, columns, deadline)
    try:
        point = residual.relaxation.solve()
    except InfeasibleRelaxationError:
        return None
    if point is None:
        return None
    bound = residual.relaxation.safe_bound(point.duals)
    if bound.value <= target:
        return None
    return target, (Stage(residual.relaxation.formulation, bound, ()),)


def certify(
    program: CompactProgram,
    objective: Objective,
    duals: NDArray[np.float64],
    value: Fraction | None,
    deadline: float | None = None,
) -> Certificate:
    """Make the certificate of a finished search.

    Parameters
    ----------
    program : CompactProgram
        With all columns.
    objective : Objective
    duals : ndarray of float, shape (r + 1,)
    value : Fraction or None
        ``sign * objective`` of a triangulation that was found to be the best; None if none was.
    deadline : float, optional
    """
    found = compact_bound(program, objective, duals)
    refutation = None
    if value is not None and found.plain and len(program.row_faces) <= MAX_ROWS:
        refutation = refute_better(program, objective, found, value, deadline)
    return make_compact_certificate(program, objective, found, refutation)

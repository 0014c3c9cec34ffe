"""Proofs that no triangulation uses only the simplices at hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.relaxation import InfeasibleRelaxationError, Relaxation
from bcut.bounds.safe import SafeBound
from bcut.formulations.formulation import Formulation
from bcut.objectives.objective import from_fractions
from bcut.separation.driver import IntegerCut


def infeasibility_bound(formulation: Formulation) -> SafeBound | None:
    """Bound by how much a generic point can be covered where all cocircuit rows hold.

    Every triangulation covers it once. The cocircuit rows are homogeneous, so the multipliers of this bound, with 1 for
    the coverage row, are a Farkas proof: for every x with 0 <= x <= 1 that satisfies them,
    ``coverage(x) <= -value < 1``.

    Parameters
    ----------
    formulation : Formulation
        Formulation 2, on the simplices at hand; its first row is the coverage row.

    Returns
    -------
    SafeBound or None
        Its multipliers are those of the cocircuit rows; its value is above -1. None where there is no such proof: the
        relaxation has a point.
    """
    relaxation, duals = _coverage_at_most(formulation, [])
    bound = relaxation.safe_bound(duals)
    return bound if bound.value > -1 else None


def bound_beyond(relaxation: Relaxation, target: Fraction) -> SafeBound | None:
    """Turn the infeasibility of a relaxation with its cuts into a bound above a target.

    Multipliers that prove the coverage to stay below 1 may be taken as many times as the costs require.

    Parameters
    ----------
    relaxation : Relaxation
        Of Formulation 2, without a point; its first row is the coverage row.
    target : Fraction

    Returns
    -------
    SafeBound or None
        For the rows and cuts of the relaxation. None where floating point does not do, or where cuts rule out that
        nothing is covered.
    """
    formulation, objective = relaxation.formulation, relaxation.objective
    if formulation.row_name(0) != "coverage" or formulation.lazy:
        return None
    try:
        rest, duals = _coverage_at_most(formulation, relaxation.cuts)
    except InfeasibleRelaxationError:
        # Cuts that ask for simplices, such as parity cuts, contradict each other even where nothing is covered.
        return None
    missing = 1 + float(rest.safe_bound(duals).value)
    if missing <= 0:
        return None
    costs = float(np.abs(objective.costs).sum()) + abs(float(target)) + 1
    bound = relaxation.safe_bound(2 * costs / missing * np.concatenate(([1.0], duals)))
    return bound if bound.value > target else None


def _coverage_at_most(
    formulation: Formulation, cuts: Sequence[IntegerCut]
) -> tuple[Relaxation, NDArray[np.float64]]:
    """Maximise the coverage of the generic point subject to all other rows and cuts; return the duals of these."""
    coverage = formulation.matrix[:1].toarray()[0]
    rest = replace(
        formulation,
        matrix=formulation.matrix[1:],
        lower=formulation.lower[1:],
        upper=formulation.upper[1:],
        row_faces=formulation.row_faces[1:],
    )
    objective = from_fractions("coverage", "max", [Fraction(int(value)) for value in coverage])
    relaxation = Relaxation(rest, objective)
    relaxation.add(cuts)
    duals = np.zeros(len(rest.row_faces) + len(cuts))
    if len(rest.simplices):
        point = relaxation.solve()
        assert point is not None
        duals = point.duals
    return relaxation, duals

"""From an exact bound to a certificate that anyone can check without this program."""

from __future__ import annotations

from bcut.bounds.safe import SafeBound
from bcut.formulations.formulation import Formulation
from bcut.objectives.objective import Objective
from bcut.result import Certificate


def make_certificate(formulation: Formulation, objective: Objective, bound: SafeBound) -> Certificate:
    """Write out the multipliers of a bound that needs no cuts.

    Parameters
    ----------
    formulation : Formulation
        With all its columns: a certificate speaks of every triangulation.
    objective : Objective
    bound : SafeBound
        From duals of the rows of `formulation` alone.
    """
    multipliers: list[list[object]] = []
    for face, multiplier in zip(formulation.row_faces, bound.multipliers.tolist(), strict=True):
        if multiplier:
            row = "coverage" if face is None else list(face)
            multipliers.append([row, str(multiplier * bound.unit)])
    return Certificate(
        bound=str(objective.sign * bound.value),
        flag=formulation.chirotope.bases[0].tolist(),
        multipliers=multipliers,
    )

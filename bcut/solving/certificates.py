"""From an exact bound to a certificate that anyone can check without this program."""

from __future__ import annotations

from fractions import Fraction

from bcut.bounds.safe import SafeBound
from bcut.formulations.formulation import Formulation
from bcut.objectives.objective import Objective
from bcut.result import Certificate
from bcut.solving.orbit_stage import OrbitStage


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


def make_orbit_certificate(stage: OrbitStage) -> Certificate:
    """Write out the multipliers of a bound over orbits, those of averaged cuts included.

    Parameters
    ----------
    stage : OrbitStage
    """
    bound, formulation = stage.root.bound, stage.formulation
    if bound is None:
        return Certificate(reason="the relaxation over orbits was not solved to optimality")
    rows = len(formulation.row_faces)
    multipliers: list[list[object]] = [
        ["volume", str(Fraction(bound.coverage * formulation.volume, bound.denominator))]
    ]
    for face, multiplier in zip(
        formulation.row_faces.tolist(), bound.multipliers[:rows].tolist(), strict=True
    ):
        if multiplier:
            multipliers.append([face, str(Fraction(multiplier, bound.denominator))])
    cuts = [
        {
            "family": "link",
            "simplices": cut.simplices.tolist(),
            "coefficients": cut.coefficients.tolist(),
            "rhs": 0,
            "multiplier": str(Fraction(multiplier, bound.denominator) / cut.factor),
            "proof": cut.proof,
        }
        for cut, multiplier in zip(stage.cuts, bound.multipliers[rows:].tolist(), strict=True)
        if multiplier
    ]
    return Certificate(
        bound=str(stage.objective.sign * bound.value),
        # An affine basis: the vertices of any simplex.
        flag=formulation.simplices[0].tolist(),
        multipliers=multipliers,
        cuts=cuts,
        symmetries=stage.group.generators.tolist(),
        volume_coefficient=formulation.volume_coefficient,
    )

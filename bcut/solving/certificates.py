"""From an exact bound to a certificate that anyone can check without this program."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.averaged import AveragedCut
from bcut.bounds.averaged_root import AveragedStage
from bcut.bounds.infeasibility import infeasibility_bound
from bcut.bounds.orbit_cuts import OrbitCut
from bcut.bounds.orbit_root import OrbitBound
from bcut.bounds.root import Stage
from bcut.bounds.safe import SafeBound
from bcut.formulations.chambers import CHAMBER_ROW
from bcut.formulations.formulation import Formulation
from bcut.objectives.objective import Objective
from bcut.result import Certificate
from bcut.solving.orbit_branching import Case
from bcut.solving.orbit_stage import OrbitStage


def make_certificate(
    formulation: Formulation,
    objective: Objective,
    bound: SafeBound,
    refutation: tuple[Fraction, Sequence[Stage]] | None = None,
) -> Certificate:
    """Write out the multipliers of a bound that needs no cuts, and perhaps the refutation of a target beyond it.

    Parameters
    ----------
    formulation : Formulation
        With all its columns: a certificate speaks of every triangulation.
    objective : Objective
    bound : SafeBound
        From duals of the rows of `formulation` alone.
    refutation : (Fraction, sequence of Stage), optional
        A value of ``sign * objective`` that no triangulation reaches, and why. The first stage has the columns that
        `bound` leaves.
    """
    if formulation.name not in ("2", "chambers"):
        return Certificate(
            reason=f"the bound was proven with the rows of formulation {formulation.name}, which are not written"
        )
    if len(bound.multipliers) > len(formulation.row_faces):
        return Certificate(reason="the bound was proven with rows that were added as points violated them")
    refutes = None
    # Stages are re-checked with cocircuit rows; their cuts are those of triangulations.
    if refutation is not None and formulation.name == "2":
        target, stages = refutation
        refutes = {"target": str(objective.sign * target), "stages": [stage_data(stage) for stage in stages]}
    return Certificate(
        bound=str(objective.sign * bound.value),
        flag=formulation.chirotope.bases[0].tolist(),
        multipliers=_multipliers(formulation, bound),
        refutes=refutes,
    )


def _multipliers(formulation: Formulation, bound: SafeBound) -> list[list[object]]:
    """Return the multipliers of the rows, without those of cuts."""
    rows = zip(formulation.row_faces, bound.multipliers[: len(formulation.row_faces)].tolist(), strict=True)
    return [
        [_row(formulation, number) if face is None else list(face), str(multiplier * bound.unit)]
        for number, (face, multiplier) in enumerate(rows)
        if multiplier
    ]


def _row(formulation: Formulation, number: int) -> object:
    """Return what stands for a row that is no cocircuit row: its name, or the generic point of a chamber."""
    name = formulation.row_name(number)
    if name.startswith(CHAMBER_ROW):
        return {"flag": [int(vertex) for vertex in name.removeprefix(CHAMBER_ROW).split("_")]}
    return name


def stage_data(stage: Stage) -> dict[str, object]:
    """Write out one step of a refutation."""
    formulation, bound = stage.formulation, stage.bound
    cuts = zip(stage.cuts, bound.multipliers[len(formulation.row_faces) :].tolist(), strict=True)
    return {
        "multipliers": _multipliers(formulation, bound),
        "cuts": [
            {
                "family": cut.family,
                "simplices": formulation.simplices[cut.columns].tolist(),
                "coefficients": cut.coefficients.tolist(),
                "rhs": cut.rhs,
                "multiplier": str(multiplier * bound.unit),
                # The weights of all wedges of a link cut are no news: its coefficients and the face are enough.
                "proof": {key: part for key, part in cut.proof.items() if key not in ("alpha", "wedges")},
            }
            for cut, multiplier in cuts
            if multiplier
        ],
    }


def make_infeasibility_certificate(formulation: Formulation) -> Certificate:
    """Prove that there is no triangulation, where the relaxation has no point.

    Parameters
    ----------
    formulation : Formulation
        Formulation 2, with all its columns.
    """
    bound = infeasibility_bound(formulation)
    if bound is None:
        return Certificate(reason="that there is no triangulation rests on the solver's tree")
    multipliers: list[list[object]] = [["coverage", "1"]]
    for face, multiplier in zip(formulation.row_faces[1:], bound.multipliers.tolist(), strict=True):
        if multiplier:
            multipliers.append([list(face or ()), str(multiplier * bound.unit)])
    return Certificate(
        bound=str(1 + bound.value),
        flag=formulation.chirotope.bases[0].tolist(),
        multipliers=multipliers,
        infeasible=True,
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
    total = Fraction(bound.coverage * formulation.volume, bound.denominator)
    multipliers, weights = _orbit_multipliers("volume", total, formulation.row_faces, bound)
    cuts = [_averaged_cut(cut, weight) for cut, weight in zip(stage.cuts, weights, strict=True) if weight]
    return Certificate(
        bound=str(stage.objective.sign * bound.value),
        flag=stage.flag.tolist(),
        multipliers=multipliers,
        cuts=cuts,
        symmetries=stage.group.generators.tolist(),
        volume_coefficient=formulation.volume_coefficient,
    )


def case_data(case: Case) -> dict[str, object]:
    """Write out a proof by cases, for `bcut.result.Certificate.refutes`."""
    data: dict[str, object] = {"stages": [_averaged_stage_data(stage) for stage in case.stages]}
    if case.split is not None:
        data["face"] = list(case.split.face)
        data["chosen"] = case_data(case.split.chosen)
        data["excluded"] = case_data(case.split.excluded)
    return data


def _averaged_stage_data(stage: AveragedStage) -> dict[str, object]:
    bound = stage.bound
    total = Fraction(bound.coverage * stage.order, bound.denominator)
    multipliers, weights = _orbit_multipliers("coverage", total, stage.row_faces, bound)
    cuts = [
        {**_averaged_cut(cut, weight), "group": cut.level}
        for cut, weight in zip(stage.cuts, weights, strict=True)
        if weight
    ]
    return {"multipliers": multipliers, "cuts": cuts}


def _orbit_multipliers(
    name: str, total: Fraction, row_faces: NDArray[np.int64], bound: OrbitBound
) -> tuple[list[list[object]], list[Fraction]]:
    """Write out the multipliers of the named row and of the cocircuit rows; return those of the cuts beside them."""
    values = [Fraction(multiplier, bound.denominator) for multiplier in bound.multipliers.tolist()]
    rows = len(row_faces)
    named: list[list[object]] = [[name, str(total)]]
    named += [
        [face, str(value)] for face, value in zip(row_faces.tolist(), values[:rows], strict=True) if value
    ]
    return named, values[rows:]


def _averaged_cut(cut: OrbitCut | AveragedCut, multiplier: Fraction) -> dict[str, object]:
    """Write out a link cut whose mean has this multiplier."""
    return {
        "family": "link",
        "simplices": cut.simplices.tolist(),
        "coefficients": cut.coefficients.tolist(),
        "rhs": 0,
        "multiplier": str(multiplier / cut.factor),
        # Weights of all wedges are no news: those that differ between directions are the coefficients.
        "proof": {"face": list(cut.face)},
    }

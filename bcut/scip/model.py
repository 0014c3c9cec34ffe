"""A formulation as a SCIP model."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pyscipopt import Model, Variable
from pyscipopt.scip import Expr, ExprCons, Term

from bcut.formulations.formulation import Formulation
from bcut.objectives.objective import Objective
from bcut.separation.driver import IntegerCut


def build_model(
    formulation: Formulation,
    objective: Objective,
    *,
    cuts: Sequence[IntegerCut] = (),
    name: str = "bcut",
    costs: NDArray[np.float64] | None = None,
) -> tuple[Model, list[Variable]]:
    """Build the SCIP model of a formulation.

    Parameters
    ----------
    formulation : Formulation
    objective : Objective
    cuts : sequence of IntegerCut
        Written as removable rows that the solver need not check, since the formulation implies them for 0/1
        points.
    name : str
    costs : ndarray of float, shape (m,), optional
        To write into the model instead of ``objective.costs``.

    Returns
    -------
    Model
        Minimises or maximises, as the objective says.
    list of Variable
        One binary variable per column, named ``x_v0_v1_...``: d-simplices, then other faces.
    """
    model = Model(name)
    model.hideOutput()
    entries = objective.costs if costs is None else costs
    vertices = [*formulation.simplices.tolist(), *formulation.faces]
    variables = [
        model.addVar(name="x_" + "_".join(map(str, face)), vtype="B", obj=cost)
        for face, cost in zip(vertices, [*entries.tolist(), *[0.0] * len(formulation.faces)], strict=True)
    ]
    if objective.sense == "max":
        model.setMaximize()
    else:
        model.setMinimize()
    terms = [Term(variable) for variable in variables]
    matrix = formulation.matrix.tocsr()
    values, lower, upper = formulation.scaled
    for row in range(matrix.shape[0]):
        part = slice(matrix.indptr[row], matrix.indptr[row + 1])
        expression = _expression(terms, matrix.indices[part], values[part])
        low, high = float(lower[row]), float(upper[row])
        sides = (None if low == -inf else low, None if high == inf else high)
        model.addCons(ExprCons(expression, *sides), name=formulation.row_name(row))
    for number, cut in enumerate(cuts):
        expression = _expression(terms, cut.columns, cut.coefficients.astype(float))
        model.addCons(
            ExprCons(expression, None, float(cut.rhs)),
            name=f"{cut.family}_{number}",
            check=False,
            enforce=False,
            removable=True,
        )
    return model, variables


def _expression(terms: list[Term], columns: NDArray[np.integer], values: NDArray[np.float64]) -> Expr:
    """Return a linear expression; far faster than summing variables one by one."""
    return Expr(
        {terms[column]: value for column, value in zip(columns.tolist(), values.tolist(), strict=True)}
    )


def write_model(formulation: Formulation, objective: Objective, path: Path) -> None:
    """Write the model in the format that the suffix names (``.lp``, ``.mps``, ``.cip``)."""
    model, _ = build_model(formulation, objective, name=formulation.configuration.name)
    model.writeProblem(str(path), verbose=False)

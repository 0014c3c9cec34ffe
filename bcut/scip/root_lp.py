"""Reading the relaxation at SCIP's root: its point, the rows that are cuts, and the columns that are fixed."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyscipopt import Variable

# SCIP_ROWORIGINTYPE_CONS, a row that is a constraint of the model; PySCIPOpt has no name for it. All others are cuts,
# of separators or of constraint handlers.
_OF_THE_MODEL = 2
_INTEGRAL = 1e-9
# Names of rows that are not those of the separators that made them.
_MADE_BY = {"gom": "gomory", "scg": "gomory"}


@dataclass(frozen=True, eq=False)
class RootRow:
    """The inequality ``coefficients @ x[columns] <= rhs``, a row of the relaxation that is none of the model.

    Attributes
    ----------
    family : str
        The name of one of our families, or "scip:" and the name of SCIP's separator.
    """

    family: str
    columns: NDArray[np.int64]
    coefficients: NDArray[np.float64]
    rhs: float


@dataclass(frozen=True, eq=False)
class RootLp:
    """A relaxation of SCIP's root as it was solved.

    Attributes
    ----------
    x : ndarray of float, shape (m,)
    value : float
        Unrounded, in the sense of the objective.
    rows : list of RootRow
    at_zero, at_one : ndarray of int
        Columns that SCIP has fixed.
    """

    x: NDArray[np.float64]
    value: float
    rows: list[RootRow]
    at_zero: NDArray[np.intp]
    at_one: NDArray[np.intp]


RootLpWatcher = Callable[[RootLp], None]


def read_root_lp(
    model: Any, transformed: list[Variable], x: NDArray[np.float64], value: float, families: set[str]
) -> RootLp:
    """Read the current relaxation.

    Parameters
    ----------
    model : Model
        In the solving stage, at the root.
    transformed : list of Variable
    x : ndarray of float, shape (m,)
    value : float
    families : set of str
        Names of our families: their rows bear them.
    """
    place = {variable.ptr(): column for column, variable in enumerate(transformed)}
    rows: list[RootRow] = []
    for row in model.getLPRowsData():
        if row.getOrigintype() != _OF_THE_MODEL:
            rows.extend(_rows(model, row, place, families))
    lower = np.array([variable.getLbLocal() for variable in transformed])
    upper = np.array([variable.getUbLocal() for variable in transformed])
    return RootLp(x, value, rows, np.flatnonzero(upper < 0.5), np.flatnonzero(lower > 0.5))


def _rows(model: Any, row: Any, place: dict[int, int], families: set[str]) -> list[RootRow]:
    """Return a row of SCIP as one inequality for each finite side."""
    columns = np.array([place[column.getVar().ptr()] for column in row.getCols()], dtype=np.int64)
    values = np.array(row.getVals(), dtype=float)
    order = np.argsort(columns)
    columns, values = columns[order], values[order]
    family = _family(row.name, families)
    found = []
    for sign, side in ((1.0, row.getRhs()), (-1.0, row.getLhs())):
        if abs(side) < model.infinity():
            rhs = sign * (side - row.getConstant())
            found.append(RootRow(family, columns, _snapped(sign * values), float(_snapped(np.array(rhs)))))
    return found


def _family(name: str, families: set[str]) -> str:
    if name in families:
        return name
    # SCIP numbers its rows, as in "zerohalf12_3".
    kind = (re.match(r"[A-Za-z]+", name) or [name])[0]
    return "scip:" + _MADE_BY.get(kind, kind)


def _snapped(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values with noise around integers removed."""
    rounded = np.rint(values)
    # Adding zero turns -0.0 into 0.0.
    snapped: NDArray[np.float64] = np.where(np.abs(values - rounded) <= _INTEGRAL, rounded, values) + 0.0
    return snapped

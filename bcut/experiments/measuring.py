"""Triangulations and their measures: the values that objectives have there, whatever the run was about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bcut.errors import SolverError, VerificationError
from bcut.geometry.configuration import PointConfiguration
from bcut.objectives.objective import make_objective
from bcut.solving.delaunay import delaunay_triangulation
from bcut.solving.report import as_number
from bcut.verification.triangulation import check_triangulation


@dataclass(frozen=True, eq=False)
class Listed:
    """Simplices that get costs, as `make_objective` asks for them."""

    configuration: PointConfiguration
    simplices: NDArray[np.int64]


def value_at(
    configuration: PointConfiguration,
    triangulation: Sequence[Sequence[int]],
    objective: str,
    sense: str | None = None,
) -> int | float:
    """Return the value of an objective at a triangulation: computed exactly from the costs, then rounded once.

    Parameters
    ----------
    configuration : PointConfiguration
    triangulation : sequence of sequences of int
        Ascending vertices.
    objective : str
        As on the command line: "weight" is the sum over all simplices, "min-max:aspect-ratio" the largest one.
    sense : {"min", "max"}, optional

    Raises
    ------
    InputError, ObjectiveError
        As `make_objective`.
    """
    simplices = np.array(triangulation, dtype=np.int64).reshape(-1, configuration.dimension + 1)
    made = make_objective(objective, Listed(configuration, simplices), sense=sense)
    value = as_number(made.value(np.arange(len(simplices))))
    assert value is not None
    return value


def measured_at(
    configuration: PointConfiguration, triangulation: Sequence[Sequence[int]], measures: Sequence[str]
) -> dict[str, int | float]:
    """Return the values of several objectives at a triangulation, once it has been verified exactly.

    Raises
    ------
    SolverError
        It is no triangulation.
    """
    try:
        check_triangulation(configuration.scalars(), triangulation)
    except VerificationError as error:
        raise SolverError(f"{configuration.name}: the run ended with no triangulation: {error}") from error
    return {text: value_at(configuration, triangulation, text) for text in measures}


def delaunay(
    configuration: PointConfiguration, objective: str, sense: str
) -> tuple[list[list[int]], int | float]:
    """Return the Delaunay triangulation, and the value of an objective there.

    Raises
    ------
    InputError
        As `delaunay_triangulation`, and for an objective that these points do not have.
    """
    found = delaunay_triangulation(configuration)
    return found, value_at(configuration, found, objective, sense)

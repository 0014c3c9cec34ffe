"""From a finished search to a verified result."""

from __future__ import annotations

import platform
import time
from fractions import Fraction
from typing import Any

import numpy as np

import bcut
from bcut.errors import SolverError
from bcut.geometry.configuration import PointConfiguration
from bcut.result import Certificate, Instance, Question, Result, Root, RoundRecord, Size
from bcut.solving.search import Search


def make_result(
    configuration: PointConfiguration,
    question: Question,
    search: Search,
    *,
    size: tuple[int, int],
    certificate: Certificate,
    started: float,
) -> Result:
    """Verify what a search found, and write it down.

    Parameters
    ----------
    configuration : PointConfiguration
    question : Question
        What was asked.
    search : Search
        Finished, or stopped.
    size : (int, int)
        Columns and rows of the formulation that the search began with.
    certificate : Certificate
    started : float
        Value of `time.perf_counter` when the run began.

    Raises
    ------
    SolverError
        If what was found is no triangulation.
    """
    triangulation = None
    if search.columns is not None:
        triangulation = search.whole.formulation.simplices[np.sort(search.columns)].tolist()
        with search.timed("verify"):
            _verify(configuration, triangulation, question)
    search.seconds["total"] = time.perf_counter() - started
    proven = proven_bound(search)
    return Result(
        instance=_describe_instance(configuration),
        problem=question,
        status=search.status,
        value=as_number(search.value),
        bound=as_number(proven),
        gap=gap(search.value, proven),
        root=Root(
            search.lp,
            search.lp_after_cuts,
            search.root_is_integral,
            [_record(*item) for item in search.rounds],
        ),
        size=Size(*size, search.columns_after_fixing),
        nodes=search.nodes,
        separators={name: vars(family).copy() for name, family in search.statistics.items()},
        seconds=search.seconds,
        triangulation=triangulation,
        certificate=certificate,
        versions=_versions(),
    )


def _verify(configuration: PointConfiguration, triangulation: list[list[int]], question: Question) -> None:
    from bcut.errors import VerificationError
    from bcut.verification.dissection import check_dissection
    from bcut.verification.restrictions import RestrictionData
    from bcut.verification.triangulation import check_triangulation

    check = check_dissection if question.dissection else check_triangulation
    asked = RestrictionData(
        tuple(map(tuple, question.require)), tuple(map(tuple, question.forbid)), question.star
    )
    try:
        asked.check(check(configuration.scalars(), triangulation, spanning=question.spanning).simplices)
    except VerificationError as error:
        what = "dissection" if question.dissection else "triangulation"
        raise SolverError(f"{configuration.name}: the solver's answer is no {what}: {error}") from error


def _describe_instance(configuration: PointConfiguration) -> Instance:
    points = [list(point) for point in configuration.exact_points()]
    return Instance(configuration.name, configuration.dimension, points, configuration.digest)


def _record(stage: str, finished: Any) -> RoundRecord:
    return RoundRecord(finished.lp, finished.cuts, stage)


def proven_bound(search: Search) -> Fraction | None:
    """Return the bound on the objective, rounded to a value that it can have."""
    if search.bound is None:
        return None
    return search.sign * search.rounded_up(search.bound)


def as_number(value: Fraction | None) -> int | float | None:
    """Return a number as a result file holds it."""
    if value is None:
        return None
    return int(value) if value.denominator == 1 else float(value)


def gap(value: Fraction | None, proven: Fraction | None) -> float | None:
    """Return ``|value - bound| / max(1, |value|)``."""
    if value is None or proven is None:
        return None
    return abs(float(value - proven)) / max(1.0, abs(float(value)))


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    return {
        "bcut": bcut.__version__,
        "scip": _scip_version(),
        "pyscipopt": version("pyscipopt"),
        "highs": version("highspy"),
        "python": platform.python_version(),
    }


def _scip_version() -> str:
    """Return SCIP's version from the library when it is loaded anyway, so that root-only runs need not load it."""
    import sys

    if "pyscipopt" not in sys.modules:
        return "not used"
    from bcut.scip.host import scip_version

    return scip_version()

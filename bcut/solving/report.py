"""From a finished search to a verified result."""

from __future__ import annotations

import platform
import time
from dataclasses import replace
from fractions import Fraction
from functools import cache
from math import ceil, floor
from typing import Any

import numpy as np

import bcut
from bcut.errors import SolverError
from bcut.geometry.configuration import PointConfiguration
from bcut.result import Certificate, Instance, Question, Result, Root, RoundRecord, Size
from bcut.separation.resolve import is_built_in
from bcut.solving.search import Search
from bcut.verification.cuts import CUT_CHECKERS


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
        If what was found is no triangulation, or what was proven cannot be.
    """
    triangulation = None
    if search.columns is not None:
        triangulation = search.whole.formulation.simplices[np.sort(search.columns)].tolist()
        with search.timed("verify"):
            _verify(configuration, triangulation, question)
    proven = proven_bound(search)
    _check_consistency(configuration, question, search, proven)
    search.seconds["total"] = time.perf_counter() - started
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
        certificate=replace(certificate, settles=settles(search, certificate)),
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


def _check_consistency(
    configuration: PointConfiguration, question: Question, search: Search, proven: Fraction | None
) -> None:
    """Refuse what contradicts itself: a cut that is not valid, or a solver that errs, leads to such results."""
    if search.status == "infeasible" and not search.restricted and question.invariant_under is None:
        raise SolverError(
            f"{configuration.name}: the search ended without a triangulation, though there is always one: "
            + _blame(question)
        )
    value, sign = search.value, search.sign
    if value is None or proven is None:
        return
    # Bounds from solvers' trees are within their tolerances.
    room = max(Fraction(search.whole.objective.largest_cost), abs(value)) / 10**6
    if sign * value < sign * proven - room:
        raise SolverError(
            f"{configuration.name}: the bound {as_number(proven)} is refuted by a triangulation of the value "
            f"{as_number(value)}: {_blame(question)}"
        )


def _blame(question: Question) -> str:
    foreign = ", ".join(name for name in question.separators if not is_built_in(name))
    cuts = f"cuts of {foreign} are not valid (see `bcut separators check`), or " if foreign else ""
    return f"{cuts}a solver erred"


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


def settles(search: Search, certificate: Certificate) -> str | None:
    """Tell whether a certificate proves the status of a search: `bcut.result.Certificate.settles`.

    Exact multipliers do, where their bound meets the value, or where they refute all that is better. What rests on a
    solver's tree, on what a solver says of a relaxation without a point, or on cuts that nobody checks again, is no
    proof.
    """
    if search.status == "infeasible":
        return "exactly" if certificate.infeasible else None
    value, proven = search.value, _certified(search, certificate)
    if search.status != "optimal" or value is None or proven is None:
        return None
    short = search.sign * value - proven
    if short <= 0:
        return "exactly"
    size = min(max(Fraction(search.whole.objective.largest_cost), abs(value)), max(Fraction(1), abs(value)))
    return "within 1e-9" if short <= size / 10**9 else None


def _certified(search: Search, certificate: Certificate) -> Fraction | None:
    """Return the bound on ``sign * objective`` that a certificate proves, an integer where all costs are."""
    sign = search.sign
    if certificate.threshold is not None:
        return sign * Fraction(certificate.threshold)
    if certificate.bound is None:
        return None
    integral = search.value_unit.denominator == 1
    proven = sign * Fraction(certificate.bound)
    proven = Fraction(ceil(proven)) if integral else proven
    refuted = certificate.refutes
    if refuted is not None and _families(refuted) <= set(CUT_CHECKERS):
        target = sign * Fraction(refuted["target"])
        proven = max(proven, Fraction(floor(target) + 1) if integral else target)
    return proven


def _families(proof: dict[str, Any]) -> set[str]:
    """Return the cut families in a refutation, cases included."""
    case = proof.get("case", proof)
    found = {cut["family"] for stage in case["stages"] for cut in stage["cuts"]}
    for part in ("chosen", "excluded"):
        if part in case:
            found |= _families(case[part])
    return found


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
    return {
        "bcut": bcut.__version__,
        "scip": _scip_version(),
        "pyscipopt": _installed("pyscipopt"),
        "highs": _installed("highspy"),
        "python": platform.python_version(),
    }


@cache
def _installed(package: str) -> str:
    """Return the version of a package; reading its metadata takes as long as solving a small instance."""
    from importlib.metadata import version

    return version(package)


def _scip_version() -> str:
    """Return SCIP's version from the library when it is loaded anyway, so that root-only runs need not load it."""
    import sys

    if "pyscipopt" not in sys.modules:
        return "not used"
    from bcut.scip.host import scip_version

    return scip_version()

"""Runs as plain data, each with the fingerprint of everything that it depends on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bcut.errors import InputError
from bcut.experiments.cases import Case, load_case, objective_file
from bcut.experiments.plan import Plan
from bcut.experiments.variants import Variant
from bcut.experiments.versions import code_version, digest_of
from bcut.separation.resolve import Specification

SCHEMA = 1


@dataclass(frozen=True)
class Task:
    """One run: plain data that another process, or another machine, can carry out.

    Attributes
    ----------
    fingerprint : str
        SHA-256 of the inputs and of the code.
    data : dict
        What `bcut.experiments.execute` reads.
    case : Case
    variant : Variant
    """

    fingerprint: str
    data: dict[str, Any]
    case: Case
    variant: Variant


def tasks_of(plan: Plan) -> Iterator[Task]:
    """Yield the runs of a plan, problem by problem; two variants that ask for the same have the same fingerprint."""
    code = code_version()
    for case in plan.cases:
        configuration = load_case(case)
        instance = {
            "name": configuration.name,
            "dimension": configuration.dimension,
            "points": [list(point) for point in configuration.exact_points()],
            "digest": configuration.digest,
        }
        for variant in plan.variants:
            yield _task(variant.problem(case), variant, instance, code, plan.measures)


def _task(
    case: Case, variant: Variant, instance: dict[str, Any], code: dict[str, str], measures: tuple[str, ...]
) -> Task:
    settings = variant.settings()
    measures = measures if variant.has_triangulation else ()
    if variant.cutoff and case.optimum is None:
        raise InputError(
            f"variant '{variant.name}' asks for the optimum as a cutoff, but that of {case.instance} is not known; "
            "give it as 'optimum', or take cutoff away"
        )
    problem = {
        "objective": case.objective,
        "sense": case.sense,
        "spanning": case.spanning,
        "formulation": case.formulation,
        "cutoff": str(case.optimum) if variant.cutoff else None,
    }
    data = {
        "schema": SCHEMA,
        "instance": instance,
        "problem": problem,
        "settings": settings,
        "measures": list(measures),
        "files": _files(case, variant, measures),
        "code": code,
    }
    identity = {**data, "instance": instance["digest"]}
    text = json.dumps(identity, sort_keys=True, separators=(",", ":"))
    return Task(hashlib.sha256(text.encode()).hexdigest(), data, case, variant)


def _files(case: Case, variant: Variant, measures: tuple[str, ...]) -> dict[str, str]:
    """Return the digests of files that a run reads: separators, costs and users' objectives."""
    specifications = [Specification.parse(text) for text in variant.separators]
    paths = [specification.source for specification in specifications if specification.is_file]
    paths += [file for text in (case.objective, *measures) if (file := objective_file(text)) is not None]
    return {path: digest_of(Path(path)) for path in paths}

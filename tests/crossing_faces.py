"""What the tests of face-crossing cuts share: problems, points of them, cuts and their certificates."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import cache

import numpy as np
from numpy.typing import NDArray

import bcut
from bcut.bounds.root import root_bound
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.triangulations import triangulations
from bcut.objectives.objective import Objective
from bcut.separation.driver import to_integers
from bcut.separation.seam import Cut, FractionalPoint, Problem
from bcut.separators.face_crossing import FaceCrossing
from bcut.verification.cut_data import Candidates, CertificateCut
from bcut.verification.exact_points import ExactPoints


def problem_of(name: str, *, spanning: bool = False) -> Problem:
    return Problem(cocircuit_formulation(bcut.load_instance(name), spanning=spanning))


def all_of(problem: Problem) -> Iterator[list[int]]:
    """Yield all triangulations, as lists of columns."""
    return map(list, triangulations(problem.chirotope))


def candidates_of(problem: Problem) -> Candidates:
    points = ExactPoints(problem.configuration.scalars())
    return Candidates(points, spanning=problem.formulation.spanning)


def cuts_at(
    problem: Problem, x: NDArray[np.floating], **parameters: int
) -> tuple[list[Cut], FractionalPoint]:
    separator = FaceCrossing(**parameters)
    separator.setup(problem)
    point = FractionalPoint(problem, x)
    return list(separator.separate(point)), point


def certified(problem: Problem, cut: Cut) -> CertificateCut:
    scaled = to_integers(cut, "face-crossing", len(problem.simplices))
    return CertificateCut(
        "face-crossing",
        tuple(tuple(row) for row in problem.simplices[scaled.columns].tolist()),
        tuple(Fraction(c) for c in scaled.coefficients.tolist()),
        Fraction(scaled.rhs),
        Fraction(-1),
        scaled.proof,
    )


def anything(problem: Problem, seed: int) -> NDArray[np.float64]:
    """Return a point that knows nothing of the relaxation."""
    random = np.random.default_rng(seed)
    return np.where(random.random(len(problem.simplices)) < 0.3, random.random(len(problem.simplices)), 0.0)


def vertex(problem: Problem, seed: int) -> NDArray[np.float64]:
    """Return a vertex of the relaxation."""
    costs = np.random.default_rng(seed).integers(-20, 20, len(problem.simplices))
    found = root_bound(problem.formulation, Objective("random", "min", costs)).point
    assert found is not None
    return found


@cache
def halves() -> tuple[Problem, list[Cut], FractionalPoint]:
    """Return the cuts at a root optimum."""
    problem = problem_of("random:12,3,seed=23", spanning=True)
    costs = np.ones(len(problem.simplices), dtype=np.int64)
    root = root_bound(problem.formulation, Objective("cardinality", "min", costs))
    assert root.point is not None
    return problem, *cuts_at(problem, root.point)

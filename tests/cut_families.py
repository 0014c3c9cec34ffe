"""What the tests of the built-in cut families share: problems, separators at work on them, random graphs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.root import RootBound, root_bound
from bcut.families import build
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.formulation import Formulation
from bcut.objectives.objective import Objective
from bcut.separation.driver import Separation
from bcut.separation.resolve import resolve
from bcut.separation.seam import Problem, Separator


def problem(instance: str, *, spanning: bool = False) -> Problem:
    return Problem(cocircuit_formulation(build(instance), spanning=spanning))


def ready(separator: Separator, given: Problem) -> Separator:
    separator.setup(given)
    return separator


def loop(formulation: Formulation, objective: Objective, *separators: str) -> tuple[RootBound, Separation]:
    separation = Separation([resolve(text) for text in separators], Problem(formulation))
    return root_bound(formulation, objective, separation), separation


def random_graph(size: int, density: float, random: np.random.Generator) -> NDArray[np.bool_]:
    upper = np.triu(random.random((size, size)) < density, 1)
    return upper | upper.T

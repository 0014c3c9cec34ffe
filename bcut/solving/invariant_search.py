"""Good triangulations of symmetric configurations: those that a subgroup of the symmetries maps to themselves.

An invariant triangulation is made of whole orbits, so the programs are smaller by the order of the subgroup, and a
solver that finds nothing on the whole program finds an optimum, or refutes the kind of symmetry, in a moment. Famous
minimal triangulations, such as those of the cubes up to dimension 6, turn out to have symmetries.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import inf
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bcut.formulations.formulation import Formulation
from bcut.formulations.invariant import InvariantProgram, invariant_program
from bcut.geometry.permutations import PermutationGroup
from bcut.geometry.subgroups import some_subgroups
from bcut.objectives.objective import Objective

# Seconds for every subgroup: those that are decided quickly first, the hard ones again later.
PASSES = (2.0, 15.0, 90.0)
# Orders of subgroups, at most: triangulations with more symmetries are rare.
_LARGEST = 32


@dataclass
class InvariantSearch:
    """What a search found.

    Attributes
    ----------
    status : {"goal", "decided", "limit", "interrupted"}
        "decided" when no program was left undecided: then nothing better is invariant under one of the subgroups.
    columns : ndarray of int or None
        Of the formulation: the best triangulation, not verified.
    value : Fraction or None
    subgroup : PermutationGroup or None
        What leaves it invariant.
    attempts : int
        Programs that were solved.
    """

    status: Literal["goal", "decided", "limit", "interrupted"] = "decided"
    columns: NDArray[np.intp] | None = None
    value: Fraction | None = None
    subgroup: PermutationGroup | None = None
    attempts: int = 0


def find_invariant_triangulation(
    formulation: Formulation,
    objective: Objective,
    group: PermutationGroup,
    *,
    cutoff: Fraction | None = None,
    goal: Fraction | None = None,
    deadline: float | None = None,
    seed: int = 0,
    subgroups: Sequence[PermutationGroup] | None = None,
    passes: Sequence[float] = PASSES,
    on_progress: Callable[[dict[str, Any]], None] | None = None,
) -> InvariantSearch:
    """Look for a triangulation that is invariant under some subgroup.

    Parameters
    ----------
    formulation : Formulation
        Its columns must be closed under the group.
    objective : Objective
        Invariant under the group.
    group : PermutationGroup
        Of symmetries of the configuration.
    cutoff : Fraction, optional
        Only values strictly better than this, of ``sign * objective``, are wanted.
    goal : Fraction, optional
        Stop as soon as ``sign * objective`` is at most this.
    deadline : float, optional
        Value of `time.monotonic`.
    seed : int
        Of the choice of subgroups, and of the solver.
    subgroups : sequence of PermutationGroup, optional
        To be tried in this order; small ones of `group` when left out, from the largest on.
    passes : sequence of float
        Seconds for every subgroup in each pass over those that are undecided.
    on_progress : callable, optional
        Told of every attempt.
    """
    from bcut.scip.host import TreeOptions, branch_and_cut

    sign = objective.sign
    rest = list(some_subgroups(group, largest=_LARGEST, seed=seed) if subgroups is None else subgroups)
    search = InvariantSearch()
    for seconds in passes:
        undecided = []
        for subgroup in rest:
            left = inf if deadline is None else deadline - time.monotonic()
            if left <= 0:
                search.status = "limit"
                return search
            program = invariant_program(formulation, subgroup)
            limit = None if cutoff is None else float(sign * cutoff)
            options = TreeOptions(
                seconds=None if min(seconds, left) == inf else min(seconds, left), seed=seed, cutoff=limit
            )
            found = branch_and_cut(
                program.formulation, invariant_objective(program, objective), options=options
            )
            search.attempts += 1
            if on_progress is not None:
                on_progress({"stage": "invariant", "order": subgroup.order, "status": found.status})
            if found.columns is not None:
                columns = program.expanded(found.columns)
                value = objective.value(columns)
                if cutoff is None or sign * value < cutoff:
                    search.columns, search.value, search.subgroup = columns, value, subgroup
                    cutoff = sign * value
            if found.status == "interrupted":
                search.status = "interrupted"
                return search
            if search.value is not None and goal is not None and sign * search.value <= goal:
                search.status = "goal"
                return search
            if found.status == "limit":
                undecided.append(subgroup)
        rest = undecided
    search.status = "limit" if rest else "decided"
    return search


def invariant_objective(program: InvariantProgram, objective: Objective) -> Objective:
    """Return the objective of the variables that stand for whole orbits."""
    return objective.times(program.representatives, program.lengths)

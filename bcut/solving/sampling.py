"""Triangulations at random vertices of a relaxation: cheap to find where the relaxation reaches the target exactly.

For cardinality the relaxation, even with all its cuts, mostly ends at a fractional point among very many optimal ones:
the costs do not tell them apart. Random costs do, and with those the vertices of Formulation 2 are integral nearly
always. So the value gets a row of its own, and random costs choose a vertex of what is left. Where that is the
optimal face, its vertices are vertices of the relaxation; a few linear programs then find what a tree search looks
for at length.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from bcut.bounds.root import RootBound, RootLimits, root_bound
from bcut.formulations.value_row import with_value_row
from bcut.objectives.objective import Objective
from bcut.separation.driver import Separation
from bcut.separation.seam import Problem
from bcut.solving.search import Part, Search

# Vertices to look at, and relaxations with cuts on the way to each.
_SAMPLES, _ROUNDS = 4, 30
# Random costs are integers up to this.
_LARGEST = 1 << 16


def sample_vertices(search: Search, part: Part, root: RootBound, target: Fraction) -> None:
    """Look for a triangulation within a target at vertices that random costs lead to, and offer what is found.

    Parameters
    ----------
    search : Search
    part : Part
        With all simplices that such a triangulation can have; its costs are small multiples of a unit.
    root : RootBound
        Of this part: its columns and its cuts are taken over.
    target : Fraction
        Of ``sign * objective``.
    """
    part = part.restricted_to(root.columns)
    whole = search.whole.objective
    coefficients = np.array(
        [
            int(search.sign * cost / whole.unit)
            for cost in part.objective.exact_costs(range(len(part.columns)))
        ],
        dtype=np.int64,
    )
    limited = with_value_row(part.formulation, coefficients, int(target / whole.unit), name="target")
    random = np.random.default_rng(search.seed)
    for _ in range(_SAMPLES):
        if search.seconds_left == 0.0:
            return
        costs = random.integers(1, _LARGEST, len(part.columns))
        search.report("vertices", columns=len(part.columns))
        with search.timed("vertices"):
            found = root_bound(
                limited,
                Objective("random", "min", costs),
                # Its relaxations are none of the root's: nobody else watches them.
                Separation(search.make_separators(), Problem(limited), deadline=search.deadline),
                limits=RootLimits(rounds=_ROUNDS, deadline=search.deadline),
                cuts=root.cuts,
            )
        if found.status == "integral" and found.point is not None:
            search.offer(part.columns[found.point > 0.5])
            return
        if found.status in ("infeasible", "limit"):
            return

"""Bottlenecks: the triangulation whose worst simplex is best, by bisection over the costs that simplices have.

Simplices are ranked by how bad they are. For each k the question is whether there is a triangulation of simplices of
rank k at most: a feasibility problem on the columns that are allowed. All questions share one listing and one matrix,
and what one of them rules out stays ruled out for smaller k. Small k come first, since few columns make a quick answer:

1. columns that have no partner across one of their facets go, and so do those whose only partners they were;
2. the linear relaxation of what is left: it is infeasible, or its point may be a triangulation already;
3. from the least k on for which the relaxation is feasible, where its point is fractional: cuts, then SCIP.

That the relaxation is infeasible below a threshold is proven by one vector of multipliers (`threshold_certificate`).
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.linear_program import LinearProgram, solve_linear_program
from bcut.bounds.root import RootBound, RootLimits, root_bound
from bcut.bounds.safe import safe_bound
from bcut.formulations.formulation import Formulation
from bcut.geometry.hull import vertices_of_hull
from bcut.objectives.objective import Bottleneck, Objective
from bcut.result import Certificate
from bcut.solving.certificates import make_certificate
from bcut.solving.search import Part, Search, place

Outcome = Literal["reached", "refuted", "open", "limit", "interrupted"]

# The first step up from the least rank that is possible, as a part of all ranks in question.
_FIRST_STEP = 64
# Rounds of cuts before SCIP is asked: more rarely settle a question of feasibility.
_CUT_ROUNDS = 20


def solve_bottleneck(search: Search, *, branching: bool = True) -> None:
    """Find a triangulation whose worst simplex is best, and prove that there is no better one.

    Parameters
    ----------
    search : Search
        Its objective is a `Bottleneck`. It gets a certificate of the bound that the relaxation proves.
    branching : bool
        Whether SCIP decides what the relaxation and cuts leave open; without it only the bound is raised.
    """
    ladder = _Ladder(search)
    if branching:
        place(search)
    search.certificate = Certificate(reason="the bisection over the relaxations was not finished")
    if not ladder.relax():
        return
    relaxed = ladder.low
    finished = ladder.climb(branching=branching)
    if ladder.is_empty:
        search.status, search.certificate = "infeasible", None
        return
    search.lp, search.lp_after_cuts = ladder.cost(relaxed), ladder.cost(ladder.low)
    with search.timed("certificate"):
        search.certificate = threshold_certificate(
            search.whole.formulation, ladder.objective, relaxed, search.seconds_left
        )
    if finished and branching:
        search.status = "optimal"


def without_bad_simplices(search: Search) -> NDArray[np.intp] | None:
    """Return the columns of a triangulation whose worst simplex is good, though perhaps not the best, or None.

    Parameters
    ----------
    search : Search
        Its objective is a `Bottleneck`.
    """
    place(search)
    _Ladder(search).relax()
    return search.columns


class _Ladder:
    """The ranks, from the best simplices to the worst, and what is known about them.

    Attributes
    ----------
    ranks : ndarray of int64, shape (m,)
    examples : ndarray of int
        A column of each rank.
    low : int
        No triangulation has a better worst rank.
    """

    def __init__(self, search: Search) -> None:
        self.search = search
        self.objective = cast(Bottleneck, search.whole.objective)
        self.ranks = self.objective.ranks
        formulation = search.whole.formulation
        matrix = formulation.matrix.tocsc()
        balanced = np.flatnonzero((formulation.lower == 0) & (formulation.upper == 0))
        self.plus = (matrix > 0).astype(np.int32)[balanced]
        self.minus = (matrix < 0).astype(np.int32)[balanced]
        # Rows with a positive lower side need columns.
        self.needs = (matrix > 0).astype(np.int32)[np.flatnonzero(formulation.lower > 0)]
        self.examples = np.unique(self.ranks, return_index=True)[1]
        self.low = 0
        # Columns that a triangulation up to some rank may use, for ranks that have been reached.
        self.known: dict[int, NDArray[np.intp]] = {len(self.examples): np.arange(len(self.ranks))}
        self._raise(self._least_at_vertices())

    def cost(self, rank: int) -> float:
        """Return the cost of the simplices of a rank."""
        return float(self.objective.costs[self.examples[rank]])

    @property
    def is_empty(self) -> bool:
        """Whether there is no triangulation of any rank."""
        return self.low == len(self.examples)

    @property
    def high(self) -> int:
        """The worst rank in the best triangulation found; one more than all ranks without one."""
        columns = self.search.columns
        return len(self.examples) if columns is None else int(self.ranks[columns].max())

    def relax(self) -> bool:
        """Raise `low` to the least rank for which the relaxation is feasible; False where a limit came first."""
        feasible, step = self.high, max(1, (self.high - self.low) // _FIRST_STEP)
        rank, has_reached = self.low, False
        while self.low < feasible:
            outcome = self._relaxation(rank)
            if outcome == "refuted":
                self._raise(rank + 1)
                step *= 2
            elif outcome == "reached":
                feasible, has_reached = min(rank, self.high), True
            else:
                self.search.status = "interrupted" if outcome == "interrupted" else "limit"
                return False
            rank = (self.low + feasible - 1) // 2 if has_reached else min(self.low + step, feasible - 1)
        return True

    def climb(self, *, branching: bool) -> bool:
        """Raise `low`, and find triangulations, until they meet; False where something came before that.

        Without branching it ends at the first question that cuts leave open.
        """
        step, has_reached = 1, False
        while self.low < self.high:
            rank = (self.low + self.high - 1) // 2 if has_reached else min(self.low + step, self.high) - 1
            outcome = self._search(rank, branching=branching)
            if outcome == "refuted":
                self._raise(rank + 1)
                step *= 2 if branching else 1
            elif outcome == "reached":
                has_reached = True
            elif outcome == "open":
                return False
            else:
                self.search.status = "interrupted" if outcome == "interrupted" else "limit"
                return False
        return True

    def _raise(self, low: int) -> None:
        """Take note that no triangulation has a worst rank below `low`."""
        self.low = max(self.low, low)
        if self.low < len(self.examples):
            bound = self.objective.exact_costs(self.examples[[self.low]])[0]
            self.search.raise_bound(self.search.sign * bound)
        self.search.report("bottleneck")

    def _least_at_vertices(self) -> int:
        """Return the worst over all points that a triangulation uses of the best rank there."""
        formulation = self.search.whole.formulation
        n = formulation.configuration.n
        best = np.full(n, len(self.examples))
        for vertices in formulation.simplices.T:
            np.minimum.at(best, vertices, self.ranks)
        used = range(n) if formulation.spanning else vertices_of_hull(formulation.chirotope.hull_facets, n)
        return int(best[list(used)].max())

    def _survivors(self, rank: int) -> NDArray[np.intp] | None:
        """List the columns up to a rank that have partners across all facets; None where those do not suffice."""
        start = self.known[min(reached for reached in self.known if reached >= rank)]
        columns = start[self.ranks[start] <= rank]
        width = self.search.whole.formulation.width
        everything = np.concatenate((columns, np.arange(len(self.ranks), width)))
        plus, minus, needs = (part[:, everything] for part in (self.plus, self.minus, self.needs))
        alive = np.ones(len(everything), dtype=np.int32)
        while True:
            has_plus, has_minus = plus @ alive > 0, minus @ alive > 0
            alone = plus.T @ (has_plus & ~has_minus) + minus.T @ (has_minus & ~has_plus)
            dying = (alone > 0) & (alive > 0)
            if not dying.any():
                break
            alive[dying] = 0
        if not len(columns) or (needs @ alive == 0).any():
            return None
        return columns[alive[: len(columns)] > 0]

    def _part(self, columns: NDArray[np.intp]) -> Part:
        """Return the allowed columns, with an objective that draws a linear program to good simplices."""
        guide = Objective("guide", "min", self.ranks[columns])
        return Part(self.search.whole.formulation.restricted_to(columns), guide, columns)

    def _relaxation(self, rank: int) -> Outcome:
        """Ask the relaxation whether there is a triangulation up to a rank: "reached" is no more than perhaps."""
        search = self.search
        columns = self._survivors(rank)
        if columns is None:
            return "refuted"
        part = self._part(columns)
        with search.timed("root"):
            root = root_bound(
                part.formulation, part.objective, None, limits=RootLimits(deadline=search.deadline)
            )
        if root.status == "infeasible":
            return "refuted"
        if root.status == "limit" and root.point is None:
            return "limit"
        self.known[rank] = columns
        self._offer(part, root)
        search.columns_after_fixing = len(columns)
        search.report("bottleneck", columns=len(columns))
        return "reached"

    def _offer(self, part: Part, root: RootBound) -> bool:
        """Keep the point of a relaxation if it is a triangulation."""
        if root.status != "integral" or root.point is None:
            return False
        self.search.offer(part.columns[root.columns[root.point > 0.5]])
        return True

    def _search(self, rank: int, *, branching: bool) -> Outcome:
        """Decide whether there is a triangulation up to a rank."""
        search = self.search
        columns = self._survivors(rank)
        if columns is None:
            return "refuted"
        part = self._part(columns)
        limits = RootLimits(deadline=search.deadline, rounds=_CUT_ROUNDS)
        with search.timed("root"):
            root = root_bound(part.formulation, part.objective, search.separation(part), limits=limits)
        if root.status == "infeasible":
            return "refuted"
        if self._offer(part, root):
            return "reached"
        if search.seconds_left == 0.0:
            return "limit"
        if not branching:
            return "open"
        return self._branch(part, root)

    def _branch(self, part: Part, root: RootBound) -> Outcome:
        """Ask SCIP for any triangulation on a part: without costs, the first one ends the search."""
        from bcut.scip.host import TreeOptions, branch_and_cut

        search = self.search
        free = Objective("feasibility", "min", np.zeros(len(part.columns), dtype=np.int64))
        with search.timed("tree"):
            tree = branch_and_cut(
                part.formulation,
                free,
                root.separation,
                options=TreeOptions(seconds=search.seconds_left, seed=search.seed),
                cuts=root.cuts,
                on_progress=lambda facts: search.report(
                    "tree", columns=len(part.columns), nodes=facts["nodes"]
                ),
            )
        search.nodes += tree.nodes
        if tree.columns is not None:
            search.offer(part.columns[tree.columns])
            return "reached"
        if tree.status == "infeasible":
            return "refuted"
        return "interrupted" if tree.status == "interrupted" else "limit"


def threshold_certificate(
    formulation: Formulation, objective: Bottleneck, rank: int, seconds: float | None = None
) -> Certificate:
    """Prove that every triangulation has a simplex of at least a rank.

    With cost 1 for such simplices and 0 for all others, multipliers that prove a positive bound on the sum of costs
    prove it. They come from a small linear program over the simplices of lower rank only, with one more variable for
    the part of the right-hand side that these do not reach: scaled down, they satisfy the other columns as well.

    Parameters
    ----------
    formulation : Formulation
        Of all candidates.
    objective : Bottleneck
    rank : int
        As in ``objective.ranks``.
    seconds : float, optional
        Time limit.
    """
    import scipy.sparse as sp

    if formulation.name != "2":
        return Certificate(
            reason=f"thresholds are proven in formulation 2, and this is formulation {formulation.name}"
        )
    is_bad = objective.ranks >= rank
    matrix = formulation.matrix.tocsc()
    _, lower, upper = formulation.scaled
    missing = sp.csc_matrix(np.where(np.isfinite(upper), upper, 0.0)[:, None])
    program = LinearProgram(
        costs=np.append(np.zeros(int((~is_bad).sum())), 1.0),
        matrix=sp.hstack((matrix[:, np.flatnonzero(~is_bad)], missing), format="csr"),
        lower=lower,
        upper=upper,
    )
    solution = solve_linear_program(program, seconds=seconds)
    if solution.status == "limit":
        return Certificate(reason="a limit came before the multipliers of the threshold")
    activity = matrix[:, np.flatnonzero(is_bad)].T @ solution.duals
    duals = solution.duals / max(1.0, float(activity.max(initial=0.0)))
    bad = Objective("threshold", "min", is_bad.astype(np.int64))
    bound = safe_bound(formulation.matrix.tocsr(), formulation.lower, formulation.upper, bad, duals)
    if bound.value <= 0:
        return Certificate(reason="rounded multipliers do not prove the threshold")
    example = int(np.flatnonzero(objective.ranks == rank)[0])
    threshold: Fraction = objective.exact_costs([example])[0]
    return replace(make_certificate(formulation, bad, bound), threshold=str(threshold))

"""What separators are checked on: small configurations with all their triangulations or dissections, and points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bcut.families import build
from bcut.formulations.chambers import chamber_formulation
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.geometry.dissections import dissections
from bcut.geometry.triangulations import triangulations
from bcut.separation.seam import Problem

if TYPE_CHECKING:
    from bcut.separation.driver import IntegerCut

Point = NDArray[np.float64]


@dataclass(frozen=True)
class CaseName:
    """Which problem: a family's member, only its spanning solutions or all, on all columns or on some.

    With ``thinned`` the problem has only the columns of a few of the solutions, as after fixing by reduced
    costs. With ``dissection`` it is about dissections, in the form of the chambers; such cases concern families
    that declare ``dissections = True``.
    """

    instance: str
    spanning: bool = False
    thinned: bool = False
    dissection: bool = False

    def __str__(self) -> str:
        notes = [note for note in ("dissection", "spanning", "thinned") if getattr(self, note)]
        return f"{self.instance} ({', '.join(notes)})" if notes else self.instance


#: In general position and not, spanning and not, dimensions 2 to 5; many have fractional vertices. Those with
#: dissections are all in degenerate position, where these are more than the triangulations.
CASES = (
    CaseName("hypersimplex:3,1"),
    CaseName("cube:2"),
    CaseName("polygon:5,center"),
    CaseName("polygon:7"),
    CaseName("moae"),
    CaseName("random:7,2,seed=1"),
    CaseName("random:10,2,seed=2", spanning=True),
    CaseName("grid:3,3"),
    CaseName("grid:3,3", spanning=True),
    CaseName("grid:4,3", spanning=True),
    CaseName("hypersimplex:4,1"),
    CaseName("cross-polytope:3"),
    CaseName("cube:3"),
    CaseName("prism:5"),
    CaseName("antiprism:4"),
    CaseName("cyclic:8,3"),
    CaseName("random:7,3,seed=1"),
    CaseName("random:8,3,seed=1"),
    CaseName("random:10,3,seed=1000", spanning=True),
    CaseName("grid:3,2,2", spanning=True),
    CaseName("grid:3,2,2", spanning=True, thinned=True),
    CaseName("cross-polytope:4"),
    CaseName("simplex-product:2,2"),
    CaseName("cyclic:9,4"),
    CaseName("random:9,4,seed=3"),
    CaseName("cyclic:8,5"),
    CaseName("polygon:6,center", dissection=True),
    CaseName("grid:3,3", dissection=True),
    CaseName("grid:3,3", dissection=True, thinned=True),
    CaseName("cross-polytope:3", dissection=True),
    CaseName("cube:3", dissection=True),
    CaseName("antiprism:4", dissection=True, spanning=True),
    CaseName("cross-polytope:4", dissection=True),
    CaseName("simplex-product:2,2", dissection=True),
)


@dataclass(frozen=True, eq=False)
class Case:
    """A small problem with all its solutions: triangulations, or dissections where the name says so.

    Attributes
    ----------
    name : CaseName
    problem : Problem
        Formulation 2; for dissections that of the chambers.
    incidence : ndarray of float32, shape (m, T)
        Column t is the 0/1 point of solution t.
    """

    name: CaseName
    problem: Problem
    incidence: NDArray[np.float32]

    def left_sides(self, cut: IntegerCut) -> NDArray[np.int64]:
        """Return the left-hand side of a cut for each solution, exactly, shape (T,)."""
        rows = self.incidence[cut.columns]
        if np.abs(cut.coefficients).sum() < 1 << 23:
            # Sums of integers this small are exact in single precision, and a product of floats is fast.
            return (cut.coefficients.astype(np.float32) @ rows).astype(np.int64)
        return cut.coefficients @ rows.astype(np.int64)

    def solution(self, number: int) -> list[list[int]]:
        """Return the simplices of a solution as lists of vertices."""
        return self.problem.simplices[np.flatnonzero(self.incidence[:, number])].tolist()

    @cached_property
    def crossings(self) -> NDArray[np.bool_]:
        """The whole crossing graph."""
        return self.problem.crossings(np.arange(len(self.problem.simplices)))

    def optimal_vertex(self, costs: Point, cuts: Sequence[IntegerCut] = ()) -> Point | None:
        """Return a cheapest vertex of the relaxation with some cuts; None if it has no point."""
        import scipy.sparse as sp
        from scipy.optimize import linprog

        formulation = self.problem.formulation
        above, rhs = None, None
        if cuts:
            starts = np.cumsum([0, *(len(cut.columns) for cut in cuts)])
            entries = np.concatenate([cut.coefficients for cut in cuts]).astype(float)
            columns = np.concatenate([cut.columns for cut in cuts])
            above = sp.csr_matrix((entries, columns, starts), shape=(len(cuts), len(costs)))
            rhs = np.array([cut.rhs for cut in cuts], dtype=float)
        answer = linprog(
            costs,
            A_ub=above,
            b_ub=rhs,
            A_eq=formulation.matrix.astype(float),
            b_eq=formulation.lower.astype(float),
            bounds=(0, 1),
            method="highs-ds",
        )
        return None if answer.x is None else np.asarray(answer.x, dtype=float)

    def objectives(self) -> Iterator[Point]:
        """Yield costs to minimise: the number of simplices both ways, random costs, and sums over odd holes.

        Random costs seldom lead to a fractional vertex of a problem this small. The negative sum over a
        chordless odd cycle of the crossing graph often does: half of each of its simplices is more than any
        solution has.
        """
        random = np.random.default_rng(0)
        count = len(self.problem.simplices)
        yield np.ones(count)
        yield -np.ones(count)
        for _ in range(3):
            yield random.random(count)
        for size, wanted in ((5, 6), (7, 3)):
            for _ in range(wanted):
                hole = self._random_hole(size, random)
                if hole:
                    costs = 0.01 * random.random(count)
                    costs[hole] -= 1.0
                    yield costs

    def _random_hole(self, size: int, random: np.random.Generator) -> list[int]:
        """Return a random chordless cycle of the crossing graph, empty if some attempts find none."""
        count = len(self.crossings)
        for _ in range(50):
            path = [int(random.integers(count))]
            while len(path) < size:
                last = len(path) == size - 1
                next_ones = self.crossings[path[-1]] & ~self.crossings[path[1 if last else 0 : -1]].any(
                    axis=0
                )
                if last:
                    next_ones &= self.crossings[path[0]]
                next_ones[path] = False
                choices = np.flatnonzero(next_ones)
                if not len(choices):
                    break
                path.append(int(random.choice(choices)))
            if len(path) == size:
                return path
        return []

    def other_points(self) -> Iterator[Point]:
        """Yield points that no linear program gave.

        Nothing at all, a solution, mixtures of solutions (which violate no valid cut), and points far outside
        the relaxation: half of each simplex in a random set, random values, and all of everything.
        """
        random = np.random.default_rng(1)
        count, total = self.incidence.shape
        yield np.zeros(count)
        yield self.incidence[:, 0].astype(float)
        for mixed in (2, 3, 5):
            weights = random.dirichlet(np.ones(mixed))
            yield self.incidence[:, random.integers(total, size=mixed)] @ weights
        for share in (0.1, 0.3, 0.6):
            yield np.where(random.random(count) < share, 0.5, 0.0)
        for share in (0.2, 1.0):
            yield np.where(random.random(count) < share, random.random(count), 0.0)
        yield np.full(count, 0.999)


@lru_cache(maxsize=64)
def case(name: CaseName) -> Case:
    """Build a case; it is kept for the next separator of the same process."""
    configuration = build(name.instance)
    if name.dissection:
        formulation = chamber_formulation(configuration, spanning=name.spanning, dissection=True)
        listed = list(dissections(formulation.chirotope, spanning=name.spanning))
    else:
        formulation = cocircuit_formulation(configuration, spanning=name.spanning)
        listed = list(triangulations(formulation.chirotope, spanning=name.spanning))
    incidence = np.zeros((len(formulation.simplices), len(listed)), dtype=np.float32)
    for number, solution in enumerate(listed):
        incidence[list(solution), number] = 1
    if name.thinned:
        few = incidence[:, :: max(1, len(listed) // 12)]
        columns = np.flatnonzero(few.any(axis=1))
        left_out = np.ones(len(incidence), dtype=bool)
        left_out[columns] = False
        incidence = np.ascontiguousarray(incidence[columns][:, ~incidence[left_out].any(axis=0)])
        formulation = formulation.restricted_to(columns)
    return Case(name, Problem(formulation), incidence)


def disturbed(point: Point, random: np.random.Generator) -> Iterator[Point]:
    """Yield a point with noise as solvers leave it, and one that has been moved visibly."""
    yield point + 1e-8 * random.normal(size=len(point))
    moved = (
        point
        + 0.05 * random.normal(size=len(point)) * (point > 0)
        + 0.02 * (random.random(len(point)) < 0.05)
    )
    yield np.clip(moved, 0.0, 1.0)

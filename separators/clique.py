"""Clique cuts: of simplices that cross each other pairwise, a triangulation contains at most one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bcut.separation.graphs.cliques import heavy_cliques
from bcut.separation.seam import Cut, FractionalPoint, Separator

# Candidates for lifting that are tried, per simplex that is added.
_POOL = 4


class Clique(Separator):
    """Of simplices that cross each other pairwise, at most one: cliques of the crossing graph, lifted.

    The cuts are ``sum of x over the clique <= 1`` (the paper, Sec. 2.5). All simplices over one generic point
    form a clique, and Formulation 2 fixes their sum to 1: such cliques are never violated there. What is
    found is a clique without a common point.

    For each fractional simplex that is in no clique yet, the heaviest clique through it is sought by branch
    and bound with a weighted colouring as bound; a search that takes too long ends with the best clique so
    far. Every clique is then extended by simplices that cross all its members, whatever their value.

    Parameters
    ----------
    max_cuts : int
        At most this many cuts per point, most violated first.
    max_nodes : int
        Only that many fractional simplices, those of largest value, are looked at.
    effort : int
        How long to search: the members of all colour classes together, about.
    lift : int
        At most this many simplices of value zero are added to each clique.
    """

    name: ClassVar[str] = "clique"
    dissections: ClassVar[bool] = True

    def __init__(
        self, *, max_cuts: int = 50, max_nodes: int = 300, effort: int = 300_000, lift: int = 150
    ) -> None:
        if min(max_cuts, max_nodes, effort) < 1 or lift < 0:
            raise ValueError("max_cuts, max_nodes and effort are at least 1, lift at least 0")
        self.max_cuts, self.max_nodes, self.effort, self.lift = max_cuts, max_nodes, effort, lift

    def separate(self, point: FractionalPoint) -> Iterator[Cut]:
        """Yield violated cliques, most violated first."""
        columns = point.heaviest(self.max_nodes)
        values = point.x[columns]
        cliques = heavy_cliques(point.crossings_among(columns), values, self.effort)
        cliques.sort(key=lambda clique: (-values[clique].sum(), clique))
        for clique in cliques[: self.max_cuts]:
            members = self.extended(columns[clique], point)
            yield Cut(members, 1, proof={"clique": self.problem.simplices[members].tolist()})

    def extended(self, clique: NDArray[np.integer], point: FractionalPoint) -> NDArray[np.int64]:
        """Add simplices that cross all members and each other, as many as are found in one pass."""
        members = [int(column) for column in clique]
        if self.lift:
            crossed = np.flatnonzero(self.problem.crossing_rows(clique).all(axis=0))
            candidates = self.problem.nearest_first(crossed, clique)
            candidates = candidates[np.argsort(-point.x[candidates], kind="stable")][: _POOL * self.lift]
            crossings = self.problem.crossings(candidates)
            allowed = np.ones(len(candidates), dtype=bool)
            for position, candidate in enumerate(candidates.tolist()):
                if allowed[position]:
                    members.append(candidate)
                    allowed &= crossings[position]
            del members[len(clique) + self.lift :]
        return np.array(sorted(members), dtype=np.int64)

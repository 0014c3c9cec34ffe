"""Face-crossing cuts: cliques, odd cycles and antiholes among faces of all dimensions that cross.

For a face f of simplices, of any dimension, and a generic direction u at f let

    y_f(x) = the sum of x over the simplices that have f as a face and contain u, as seen from f.

Theorem. Let a be nonnegative numbers on faces, and let b be at least the sum of a over any faces that do not cross
pairwise. Then the sum of a_f y_f(x) is at most b for every triangulation, whatever directions are chosen.

Proof. Let x be a triangulation. Its simplices with the face f, if there are any, fit together around f without
overlapping, so at most one of them contains u: y_f(x) is 1 at most, and 0 if f is no face of the triangulation. So the
sum is at most that of a over the faces of the triangulation, of which no two cross: they meet in common faces.  QED

Two faces cross when some circuit has one part in each, so this is the paper's Formulation 1 (Sec. 2.2), which has a
variable for every face, with these variables written in those of Formulation 2. By the cocircuit rows y_f(x) is the
same for all directions into the hull at every point of the relaxation (docs/formulations.md), and at least x_t for
every t with the face f. So a cut on simplices becomes stronger when some of them are replaced by faces that still cross
what they have to, and faces collect what several simplices have too little of.

Nothing is said of dissections: their simplices may have faces that cross.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from math import sqrt
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.face_crossings import FaceGraph
from bcut.geometry.face_values import FaceValues
from bcut.separation.graphs.cliques import heavy_cliques
from bcut.separation.graphs.odd_cycles import (
    chordless_cycle,
    hole_gains,
    lifted_violation,
    odd_closed_walks,
    sequential_lifting,
    turned_cycle,
)
from bcut.separation.graphs.stable_triples import sets_without_stable_triples
from bcut.separation.seam import TOLERANCE, Cut, FractionalPoint, Problem, Separator

# Cuts count as violated from this much on.
_MARGIN = 1e-4

# Values that differ by less are the same.
_SAME = 1e-7

# Candidates for lifting that are tried, per face that is lifted.
_POOL = 4


class FaceCrossing(Separator):
    """Of faces of any dimension that cross, at most as many as do not: cliques, odd cycles, sets of rank two, lifted.

    Faces with fractional values are nodes, except those whose value one larger face has all of: that crosses more.
    Of faces that cross pairwise a triangulation has one at most; of k that cross in a cycle, k odd, at most
    (k - 1) / 2; of a set without three that do not cross, such as an odd antihole, at most two. Cliques and cycles are
    found as on simplices (`clique`, `odd-cycle`), the last kind greedily. Each set is written down in two ways: as it
    is, and with every face replaced by a smallest one that still crosses what it has to. Both are then lifted by any
    faces there are, in the order of what they add to the cut at the point, smaller faces first where they add the same.

    Parameters
    ----------
    max_cuts : int
        At most this many sets per point, most violated ones first, in relation to the root of their size.
    max_simplices : int
        Only that many fractional simplices, those of largest value, are looked at.
    max_nodes : int
        Only that many of their faces, those of largest value, are nodes.
    effort : int
        How long to search for cliques: the members of all colour classes together, about.
    starts : int
        So many nodes, those of largest value, are begun with in the search for sets without three faces that do not
        cross.
    lift : int
        At most this many faces are lifted into each set.
    """

    name: ClassVar[str] = "face-crossing"
    stage: ClassVar[int] = 1

    def __init__(
        self,
        *,
        max_cuts: int = 50,
        max_simplices: int = 600,
        max_nodes: int = 400,
        effort: int = 200_000,
        starts: int = 60,
        lift: int = 150,
    ) -> None:
        if min(max_cuts, max_simplices, max_nodes, effort) < 1 or min(starts, lift) < 0:
            raise ValueError(
                "max_cuts, max_simplices, max_nodes and effort are at least 1, starts and lift at least 0"
            )
        self.max_cuts, self.max_simplices, self.max_nodes = max_cuts, max_simplices, max_nodes
        self.effort, self.starts, self.lift = effort, starts, lift

    def setup(self, problem: Problem) -> None:
        """List the faces of all simplices."""
        super().setup(problem)
        self.graph = FaceGraph(problem.chirotope, problem.simplices)
        self.values = FaceValues(self.graph, problem.simplices)

    def separate(self, point: FractionalPoint) -> Iterator[Cut]:
        """Yield cuts from violated sets of faces, most violated ones first."""
        columns = point.heaviest(self.max_simplices)
        values = self.values.at(columns, point.x[columns])
        nodes = self._nodes(values)
        if not len(nodes):
            return
        crossings, weights = self.graph.crossings(nodes, nodes), values[nodes]
        found: dict[tuple[int, tuple[int, ...]], float] = {}
        for rhs, members, violation in self._sets(crossings, weights):
            if violation > _MARGIN:
                found.setdefault((rhs, tuple(nodes[members].tolist())), violation / sqrt(len(members)))
        for rhs, faces in sorted(found, key=lambda entry: (-found[entry], entry))[: self.max_cuts]:
            for chosen in dict.fromkeys((faces, self._shrunk(faces))):
                yield self._cut(rhs, chosen, values)

    def _sets(
        self, crossings: NDArray[np.bool_], weights: NDArray[np.float64]
    ) -> Iterator[tuple[int, list[int], float]]:
        """Yield sets of nodes, how many of each do not cross, and by how much their weight is more."""
        for clique in heavy_cliques(crossings, weights, self.effort):
            yield 1, clique, float(weights[clique].sum()) - 1
        for walk in odd_closed_walks(crossings, weights):
            cycle = chordless_cycle(walk, crossings)
            rhs = (len(cycle) - 1) // 2
            violation = float(weights[cycle].sum()) - rhs
            if violation <= _MARGIN and self.lift:
                violation = lifted_violation(cycle, crossings, weights)
            yield rhs, list(turned_cycle(cycle)), violation
        for members in sets_without_stable_triples(crossings, weights, self.starts):
            yield 2, members, float(weights[members].sum()) - 2

    def _nodes(self, values: NDArray[np.float64]) -> NDArray[np.intp]:
        """Return the faces to look at, ascending."""
        wanted = (values > TOLERANCE) & (values < 1 - TOLERANCE)
        for size, facets in self.graph.boundaries.items():
            own = values[self.graph.part(size)]
            used = own > TOLERANCE
            surpassed = own[used, None] >= values[facets[used]] - _SAME
            wanted[facets[used][surpassed]] = False
        nodes = np.flatnonzero(wanted)
        heaviest = np.argsort(-np.round(values[nodes], 6), kind="stable")[: self.max_nodes]
        return np.sort(nodes[heaviest])

    def _shrunk(self, faces: Sequence[int]) -> tuple[int, ...]:
        """Replace each face by the first of its smallest faces that crosses what it crosses among the others."""
        chosen = np.array(faces)
        crossings = self.graph.crossings(chosen, chosen)
        for i, face in enumerate(faces):
            crossing = np.all(self.graph.crossings(chosen[crossings[i]]), axis=0)
            subfaces = self.graph.subfaces(face)
            chosen[i] = subfaces[np.argmax(crossing[subfaces])]
        return tuple(chosen.tolist())

    def _gains(self, faces: Sequence[int], rhs: int) -> NDArray[np.int64]:
        """Return the coefficient that each face gets when it alone is lifted into a set."""
        crossing = self.graph.crossings(np.array(faces))
        if rhs == 1:
            return np.all(crossing, axis=0).astype(np.int64)
        if rhs > 2:
            gains = hole_gains(crossing)
        else:
            gains = np.full(crossing.shape[1], 2, dtype=np.int64)
            gains[~crossing.all(axis=0)] = 1
            for i, j in combinations(range(len(faces)), 2):
                if not crossing[i, faces[j]]:
                    gains[~(crossing[i] | crossing[j])] = 0
        gains[list(faces)] = 0
        return gains

    def _cut(self, rhs: int, faces: tuple[int, ...], values: NDArray[np.float64]) -> Cut:
        """Return the cut of a set of faces of which at most `rhs` do not cross, with others lifted into it."""
        # Two faces that do not cross may have been replaced by the same one, which then counts twice.
        weights = {face: faces.count(face) for face in faces}
        if self.lift:
            candidates = self._candidates(self._gains(faces, rhs), faces, values)
            nodes = np.concatenate((faces, candidates)).astype(np.intp)
            lifted = sequential_lifting(len(faces), self.graph.crossings(nodes, nodes), self.lift, rhs)
            for position in np.flatnonzero(lifted).tolist():
                weights[int(candidates[position])] = int(lifted[position])
        coefficients = np.zeros(len(self.problem.simplices), dtype=np.int64)
        written = []
        for face, weight in weights.items():
            columns, flag = self.values.around(face)
            coefficients[columns] += weight
            size = int(self.graph.sizes[face])
            written.append([list(flag[:size]), list(flag[size:]), weight])
        columns = np.flatnonzero(coefficients)
        return Cut(columns, rhs, coefficients[columns], {"bound": rhs, "faces": written})

    def _candidates(
        self, gains: NDArray[np.int64], faces: Sequence[int], values: NDArray[np.float64]
    ) -> NDArray[np.intp]:
        """Return the faces to lift, those with positive gains, in the order in which to try them."""
        candidates = np.flatnonzero(gains)
        gains = gains[candidates]
        occurrences = np.zeros(self.graph.chirotope.n, dtype=np.int64)
        for face in faces:
            occurrences[list(self.graph.vertices(face))] += 1
        shared = np.concatenate(
            [occurrences[rows].sum(axis=1) for size, rows in self.graph.table.faces.items() if size]
        )[candidates]
        added = np.round(gains * values[candidates], 6)
        order = np.lexsort((candidates, -shared, -gains, self.graph.sizes[candidates], -added))
        return candidates[order][: _POOL * self.lift]

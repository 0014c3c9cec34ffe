"""Sphere cuts: the star of a (d-3)-face is a triangulated sphere.

Theorem
-------
Let F be a (d-3)-simplex of the configuration, d >= 3: a vertex in space, an edge in dimension four. Seen along F, the
d-simplices that contain F are spherical triangles (`bcut.geometry.star_triangulations`). For x in the affine hull of
the triangulations let y_F(x) be the sum of x over those that contain one fixed generic direction at F; it does not
depend on the direction. For weights w >= 0 on the simplices that contain F let alpha be the least weight of a
triangulation of the star: a set of them that pairwise do not cross, one of which contains the direction, and with each
simplex, across each of its (d-1)-faces that contain F and lie in no facet of the hull, another one. Then every
triangulation satisfies

    sum of w_t x_t over the simplices t that contain F  >=  alpha * y_F(x).

Proof. If a triangulation uses F, its simplices that contain F cover a neighbourhood of F within the hull exactly once,
fit together facet to facet, and end only in the hull's boundary: they are a triangulation of the star, of weight at
least alpha, and y_F = 1. If it does not use F, both sides are 0.

Link cuts (`bcut.separators.link`) say the same of the circles around (d-2)-faces. What they leave are stars whose
circles are mixtures of circles, all of them, without being mixtures of spheres.

Separation
----------
These are local cuts (D. Applegate, R. Bixby, V. Chvatal and W. Cook, "TSP cuts which do not conform to the template
paradigm", 2001): the cuts of one F hold at x exactly when x on the star is a sum of star triangulations, and that is a
packing problem: find star triangulations with largest total value within the capacities x. Its columns are generated:
the prices of the capacities are weights, and a search for a star triangulation lighter than 1 finds the next column or
shows that there is none. Where the packing falls short of y_F, the prices are the most violated cut, with alpha = 1.
The prices become integers over a small common denominator, and alpha is computed again from these, by the same search.

Simplices outside the support of x weigh alpha at first, which makes every triangulation that uses one of them heavy
enough. They are lifted one after the other, those nearest to the support first: the lightest star triangulation that
consists of one of them and those done before tells by how much its weight can be lowered. A search that takes too many
steps leaves alpha where it is, or the star alone: the cut is valid in any case.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations, permutations
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.generic_point import contain_generic_points
from bcut.geometry.star_triangulations import Found, SearchLimitError, StarTriangulations
from bcut.geometry.subsets import all_subsets, ranks
from bcut.separation.seam import Cut, FractionalPoint, Problem, Separator
from bcut.separation.small_lp import SmallLps

# A packing that falls short of y_F by less than this is perfect up to the accuracy of the relaxation's point.
_SHORTFALL = 1e-5
# Simplices with less than this are not part of the star but noise of the solver.
_NOISE = 1e-7
# A star triangulation lighter than this is a column of the packing.
_LIGHT = 1 - 1e-6
# Columns that one search may add.
_COLUMNS_AT_ONCE = 8
_LARGEST_DENOMINATOR = 60
# Directions for y_F that are tried, for the one that leaves the fewest nonzero coefficients.
_DIRECTIONS = 24


@dataclass(frozen=True, eq=False)
class _Star:
    """The simplices that contain a face, and some generic directions there.

    Attributes
    ----------
    face : ndarray of int, shape (d - 2,)
    columns : ndarray of int, shape (k,)
        Ascending.
    directions : ndarray of int, shape (c, d + 1)
        Flags: the face, then three points.
    over : ndarray of bool, shape (c, k)
        Which simplices contain which direction.
    """

    face: NDArray[np.int64]
    columns: NDArray[np.intp]
    directions: NDArray[np.int64]
    over: NDArray[np.bool_]


class Sphere(Separator):
    """Cuts that make the simplices around a (d-3)-face a triangulated sphere.

    Parameters
    ----------
    max_cuts : int
        At most this many cuts per point, those with the largest shortfall; 0 for all.
    max_support : int
        Stars with more simplices than this in the support of the point are left alone.
    max_lifted : int
        For each cut so many simplices outside the support get their best coefficients, the others safe ones.
    max_steps : int
        Limit of each search; those that lift stop after a hundredth of it.
    """

    name: ClassVar[str] = "sphere"
    stage: ClassVar[int] = 2

    def __init__(
        self, *, max_cuts: int = 0, max_support: int = 200, max_lifted: int = 1000, max_steps: int = 20_000
    ) -> None:
        if min(max_cuts, max_lifted) < 0 or min(max_support, max_steps) < 1:
            raise ValueError("max_support and max_steps are at least 1, max_cuts and max_lifted at least 0")
        self.max_cuts, self.max_support = max_cuts, max_support
        self.max_lifted, self.max_steps = max_lifted, max_steps

    def setup(self, problem: Problem) -> None:
        """Sort the simplices by the (d-3)-faces that they contain."""
        super().setup(problem)
        self.programs = SmallLps()
        self._known: dict[int, _Star] = {}
        d, n, simplices = problem.dimension, problem.chirotope.n, problem.simplices
        self.faces: NDArray[np.int64] = np.empty((0, 0), dtype=np.int64)
        if d < 3 or not len(simplices):
            return
        positions = list(combinations(range(d + 1), d - 2))
        numbers = np.concatenate([ranks(simplices[:, list(chosen)], n) for chosen in positions])
        columns = np.tile(np.arange(len(simplices)), len(positions))
        order = np.lexsort((columns, numbers))
        used, first = np.unique(numbers[order], return_index=True)
        self.faces = all_subsets(n, d - 2)[used]
        self._columns = np.split(columns[order], first[1:])

    def separate(self, point: FractionalPoint) -> Iterable[Cut]:
        """Yield the most violated sphere cut of each face, by how much its packing falls short."""
        found = []
        fractional = np.zeros(len(point.x), dtype=bool)
        fractional[point.fractional] = True
        for number in range(len(self.faces)):
            columns = self._columns[number]
            support = np.flatnonzero(point.x[columns] > _NOISE)
            if len(support) <= self.max_support and fractional[columns[support]].any():
                try:
                    item = self._cut(self._star(number), support, point.x[columns])
                except SearchLimitError:
                    continue
                if item is not None:
                    found.append(item)
        found.sort(key=lambda item: item[0], reverse=True)
        for _, cut in found[: self.max_cuts or None]:
            yield cut

    def _star(self, number: int) -> _Star:
        """Return the star of ``faces[number]``; its directions are computed once."""
        if number not in self._known:
            face, columns = self.faces[number], self._columns[number]
            simplices = self.problem.simplices[columns]
            others = simplices[~np.isin(simplices, face)].reshape(-1, 3)
            # Just beside the face, towards one of three points, from there towards another one, then the third.
            choices = np.concatenate([others[:, list(order)] for order in permutations(range(3))])
            choices = choices[:: max(1, len(choices) // _DIRECTIONS)]
            directions = np.column_stack((np.tile(face, (len(choices), 1)), choices))
            over = contain_generic_points(
                self.problem.chirotope,
                np.tile(simplices, (len(choices), 1)),
                np.repeat(directions, len(simplices), axis=0),
            )
            self._known[number] = _Star(face, columns, directions, over.reshape(len(choices), -1))
        return self._known[number]

    def _cut(
        self, star: _Star, support: NDArray[np.intp], x: NDArray[np.floating]
    ) -> tuple[float, Cut] | None:
        """Return the most violated cut of one star with its shortfall, None where there is none."""
        # They differ only where x is outside the affine hull of the triangulations.
        total = float((star.over[:, support] @ x[support]).min())
        if not _SHORTFALL < total < 1 + _SHORTFALL:
            # Nothing to pack, or a point that covers a direction more than once.
            return None
        fewest = star.over[star.over[:, support].sum(axis=1).argmin(), support]
        start = np.flatnonzero(fewest).tolist()
        search = self._search(star, support)
        packed, prices = self._packing(search, x[support], total, start)
        if total - packed <= _SHORTFALL:
            return None
        integers = _to_integers(prices)
        lightest = search.lightest(integers, np.inf, start, steps=self.max_steps)
        alpha = int(lightest[-1][0]) if lightest else max(1, *integers)
        if alpha <= 0:
            return None
        # A simplex of weight alpha makes every triangulation with it heavy enough: the safe choice to start from.
        weights = np.full(len(star.columns), alpha)
        weights[support] = np.minimum(integers, alpha)
        self._lift(star, support, weights, alpha)
        # Equivalent for every direction; the sparsest is the cheapest row.
        choices = alpha * star.over - weights
        direction = int(np.count_nonzero(choices, axis=1).argmin())
        coefficients = choices[direction]
        if coefficients @ x <= _SHORTFALL:
            return None
        kept = np.flatnonzero(coefficients)
        light = np.flatnonzero(weights < alpha)
        listed = zip(
            self.problem.simplices[star.columns[light]].tolist(), weights[light].tolist(), strict=True
        )
        proof = {
            "face": star.face.tolist(),
            "alpha": alpha,
            "direction": star.directions[direction].tolist(),
            "light": [[simplex, weight] for simplex, weight in listed],
        }
        return total - packed, Cut(star.columns[kept], 0, coefficients[kept], proof)

    def _search(self, star: _Star, positions: NDArray[np.intp]) -> StarTriangulations:
        columns = star.columns[positions]
        simplices, crossings = self.problem.simplices[columns], self.problem.crossings(columns)
        return StarTriangulations(self.problem.chirotope, star.face, simplices, crossings)

    def _packing(
        self, search: StarTriangulations, x: NDArray[np.floating], total: float, start: list[int]
    ) -> tuple[float, list[float]]:
        """Pack star triangulations into x, until nothing more fits or `total` is reached."""
        columns: list[tuple[int, ...]] = []
        packed, prices = 0.0, [0.0] * search.size
        # The first columns come from where x is large.
        weights = (1 - np.minimum(x, 1)).tolist()
        found: list[Found] = search.lightest(
            weights, np.inf, start, steps=self.max_steps, enough=_COLUMNS_AT_ONCE
        )
        while found and total - packed > _SHORTFALL:
            columns += [chosen for _, chosen in found]
            starts = np.cumsum([0, *map(len, columns)])
            rows = np.concatenate(columns)
            packed, priced = self.programs.maximise(
                np.ones(len(columns)), starts, rows, np.ones(len(rows)), x, 0
            )
            prices = priced.tolist()
            found = search.lightest(prices, _LIGHT, start, steps=self.max_steps, enough=_COLUMNS_AT_ONCE)
        return packed, prices

    def _lift(self, star: _Star, support: NDArray[np.intp], weights: NDArray[np.int64], alpha: int) -> None:
        """Lower the weights of simplices outside the support, in place."""
        columns = np.delete(star.columns, support)
        nearest = self.problem.nearest_first(columns, star.columns[support])[: self.max_lifted]
        if not len(nearest):
            return
        positions = np.concatenate((support, np.searchsorted(star.columns, nearest)))
        search = self._search(star, positions)
        values = weights[positions].tolist()
        known = sum(1 << i for i in range(len(support)) if values[i] < alpha)
        left = self.max_steps
        for number in range(len(support), len(positions)):
            values[number] = 0
            steps = min(left, max(1, self.max_steps // 100))
            try:
                found = search.lightest(values, alpha, [number], among=known, steps=steps)
            except SearchLimitError:
                left -= steps
                continue
            weight = alpha - int(found[-1][0]) if found else 0
            values[number] = weights[positions[number]] = weight
            if weight < alpha:
                known |= 1 << number


def _to_integers(weights: list[float]) -> list[int]:
    """Scale to integers by the least denominator that fits, or round at the largest one."""
    values = np.array(weights)
    for denominator in range(1, _LARGEST_DENOMINATOR + 1):
        scaled = values * denominator
        if np.abs(scaled - np.rint(scaled)).max() < 1e-6 * denominator:
            break
    return np.rint(values * denominator).astype(int).tolist()

"""Link cuts: the star of a (d-2)-face winds around it once.

Theorem
-------
Let e be a (d-2)-simplex of the configuration that lies in no facet of the convex hull. Seen along e, the
d-simplices that contain e are wedges of less than half a turn, arcs between directions
(`bcut.geometry.stars`). For x in the affine hull of the triangulations let y_e(x) be the sum of x over the
wedges that contain one fixed generic direction; the cocircuit rows say that x on the wedges is a circulation,
so y_e does not depend on the direction. For any weights w on the wedges let alpha be the least weight of a
closed walk of arcs that winds exactly once. Then every triangulation satisfies

    sum of w_t x_t over the wedges t of e  >=  alpha * y_e(x).

Proof. If a triangulation uses e, its simplices around e fit together facet to facet and fill a neighbourhood
of e exactly once: their wedges form one closed walk that winds once, of weight at least alpha, and y_e = 1.
If not, both sides are 0.

Why they matter: the circulation of a fractional point also decomposes into closed walks, but some of these
wind twice or more often, such as five wedges of 144 degrees with value 1/2 each, and no combination of
cocircuit rows forbids that.

Separation
----------
The cuts of one star are all satisfied exactly when x on its wedges is a sum of once-winding closed walks. So
the separation problem is a fractional packing: find once-winding walks of largest total value within the
capacities x. A once-winding walk has exactly one wedge over a fixed direction, and the rest of it is a path
in an acyclic graph from the head of that wedge to its tail: a multi-commodity flow with one commodity per
tail of a wedge over the direction. By linear programming duality the largest packing equals the least w.x
over weights w >= 0 for which every once-winding walk weighs at least 1. If it equals y_e(x), no link cut of e
is violated by x; otherwise the optimal w is the most violated one (with alpha = 1). A direction with few
tails keeps the program small, and if all of x passes through one node the packing is trivially perfect.

Exactness
---------
The weights that the linear program returns are rounded to a common small denominator, and alpha is computed
again from the integers as a shortest path. Wedges outside the support are lifted one after the other, short
ones first: each gets the least weight for which no once-winding walk weighs less than alpha, so that the cut
is as strong there as it can be. All of this is integer arithmetic; the violation is checked once more at the
end.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.stars import Star, Stars
from bcut.separation.seam import Cut, FractionalPoint, Problem, Separator
from bcut.separation.small_lp import SmallLps

# A packing that falls short of y_e by less than this is perfect up to the accuracy of the relaxation's point.
_SHORTFALL = 1e-6
# Wedges with less than this are not part of the circulation but noise of the solver.
_NOISE = 1e-9
_LARGEST_DENOMINATOR = 24


class Link(Separator):
    """Cuts that forbid the simplices around a (d-2)-face to wind around it more than once.

    Parameters
    ----------
    max_cuts : int
        At most this many cuts per point, those with the largest shortfall; 0 for all.
    lift : bool
        Give simplices outside the support their best coefficients, instead of safe ones.
    """

    name = "link"

    def __init__(self, max_cuts: int = 0, lift: bool = True) -> None:
        if max_cuts < 0:
            raise ValueError("max_cuts is a number that is not negative")
        self.max_cuts, self.lift = max_cuts, lift

    def setup(self, problem: Problem) -> None:
        """Sort the wedges of all faces; angular orders are computed when a face is first looked at."""
        super().setup(problem)
        self.stars = Stars(problem.chirotope, problem.simplices)
        self.programs = SmallLps()

    def separate(self, point: FractionalPoint) -> Iterable[Cut]:
        """Yield the most violated link cut of each face, by how much its packing falls short."""
        found = []
        for number in self.faces_to_try(point.x):
            star = self.stars.star(number)
            values = point.x[star.columns]
            shortfall, weights = most_violated_weights(star, values, self.programs)
            if shortfall > _SHORTFALL:
                cut = self.cut_of(star, values, weights)
                if cut is not None:
                    found.append((shortfall, cut))
        found.sort(key=lambda item: item[0], reverse=True)
        for _, cut in found[: self.max_cuts or None]:
            yield cut

    def faces_to_try(self, x: NDArray[np.floating]) -> list[int]:
        """List the faces whose star is not packed perfectly at first sight.

        A star is where all of it passes through one node: every closed walk goes through that node once a
        turn, and falls apart there into walks that wind once. The node with the largest flow is the only one
        to look at, and the wedges that pass its direction elsewhere are told by two orientations each.
        """
        stars = self.stars
        wedges = np.flatnonzero(x[stars.columns] > _NOISE)
        values, faces = x[stars.columns[wedges]], stars.face_of[wedges]
        tails, heads = stars.tails[wedges], stars.heads[wedges]
        count, n = len(stars.faces), self.problem.chirotope.n
        flow = np.bincount(faces * n + tails, weights=values, minlength=count * n).reshape(count, n)
        busiest = flow.argmax(axis=1)[faces]
        beyond_tail = stars.turns(stars.faces[faces], tails, busiest) > 0
        before_head = stars.turns(stars.faces[faces], busiest, heads) >= 0
        elsewhere = beyond_tail & before_head & (heads != busiest)
        passing = np.bincount(faces, weights=values * elsewhere, minlength=count)
        return np.flatnonzero(passing > _SHORTFALL).tolist()

    def cut_of(self, star: Star, values: NDArray[np.floating], weights: NDArray[np.floating]) -> Cut | None:
        """Make the exact cut: round, lift, and write alpha * y_e - w x <= 0 with few nonzero coefficients."""
        support = np.flatnonzero(values > _NOISE)
        integers = _to_integers(weights[support])
        alpha, lifted = lift_weights(star, support, integers, lift=self.lift)
        if alpha <= 0:
            return None
        # Equivalent for every direction; the sparsest is the cheapest row.
        choices = alpha * star.over - lifted
        coefficients = choices[np.argmin(np.count_nonzero(choices, axis=1))]
        if coefficients @ values <= _SHORTFALL:
            return None
        kept = np.flatnonzero(coefficients)
        # Each wedge by the two points it turns between, and its weight: all that is needed to compute alpha again.
        wedges = np.column_stack((star.points[star.tails], star.points[star.heads], lifted))
        proof = {"face": star.face.tolist(), "alpha": alpha, "wedges": wedges.tolist()}
        return Cut(star.columns[kept], 0, coefficients[kept], proof)


def most_violated_weights(
    star: Star, values: NDArray[np.floating], programs: SmallLps
) -> tuple[float, NDArray[np.float64]]:
    """Solve the separation problem of one star exactly, up to floating point.

    Parameters
    ----------
    star : Star
    values : ndarray of float, shape (wedges,)
        x on the wedges, a circulation.
    programs : SmallLps

    Returns
    -------
    shortfall : float
        ``y_e`` minus the largest packing of once-winding walks: the violation of the best cut with alpha = 1.
    weights : ndarray of float, shape (wedges,)
        Not negative; zero outside the support.
    """
    weights = np.zeros(len(values))
    support = np.flatnonzero(values > _NOISE)
    tails, heads, x = star.tails[support], star.heads[support], values[support]
    level = _direction_with_fewest_tails(star, support)
    over = star.over[level, support]
    total = float(x[over].sum())
    if total <= _SHORTFALL:
        # Only points outside the affine hull of the triangulations can differ between directions.
        return 0.0, weights
    # Turn the numbering so that the direction comes first: then only wedges over it go backwards.
    position = (star.levels - level) % star.turn
    packed, weights[support] = _pack(position, tails, heads, x, over, np.unique(tails[over]), programs)
    return total - packed, weights


def _direction_with_fewest_tails(star: Star, support: NDArray[np.intp]) -> int:
    """Return the level before which the fewest tails have a wedge over it: each tail counts up to its widest wedge."""
    widest = np.zeros(star.size, dtype=np.int64)
    np.maximum.at(widest, star.tails[support], star.spans[support])
    behind = np.arange(star.turn)[:, None] - star.levels - 1
    return int((behind % star.turn < widest).sum(axis=1).argmin())


def _pack(
    position: NDArray[np.integer],
    tails: NDArray[np.integer],
    heads: NDArray[np.integer],
    x: NDArray[np.floating],
    over: NDArray[np.bool_],
    sinks: NDArray[np.integer],
    programs: SmallLps,
) -> tuple[float, NDArray[np.float64]]:
    """Pack once-winding walks: one commodity per tail of a wedge over the direction.

    Columns are the wedges over the direction (they start a walk), then each other wedge once for every
    commodity that can use it. Rows are the capacities, then the balance of each commodity at each node but
    its sink.
    """
    count, nodes = len(tails), len(position)
    starting, inner = np.flatnonzero(over), np.flatnonzero(~over)
    commodity_of = np.full(nodes, -1)
    commodity_of[sinks] = np.arange(len(sinks))
    wedge = [starting]
    commodity = [commodity_of[tails[starting]]]
    for number, sink in enumerate(sinks.tolist()):
        # A walk of this commodity ends in the sink, so it cannot use wedges that end beyond or beside it.
        usable = inner[(position[heads[inner]] < position[sink]) | (heads[inner] == sink)]
        wedge.append(usable)
        commodity.append(np.full(len(usable), number))
    wedges, commodities = np.concatenate(wedge), np.concatenate(commodity)
    begins = len(starting)
    # Entries: capacity, arrival at the head, departure from the tail; none at the sink, none at the start of
    # a walk.
    columns = np.arange(len(wedges))
    arrives = heads[wedges] != sinks[commodities]
    departs = columns >= begins
    rows = np.concatenate(
        (
            wedges,
            count + (commodities * nodes + heads[wedges])[arrives],
            count + (commodities * nodes + tails[wedges])[departs],
        )
    )
    of = np.concatenate((columns, columns[arrives], columns[departs]))
    values = np.concatenate((np.ones(len(wedges)), np.ones(arrives.sum()), -np.ones(departs.sum())))
    order = np.argsort(of, kind="stable")
    starts = np.searchsorted(of[order], np.arange(len(wedges) + 1))
    costs = (columns < begins).astype(float)
    return programs.maximise(costs, starts, rows[order], values[order], x, len(sinks) * nodes)


def _to_integers(weights: NDArray[np.floating]) -> NDArray[np.int64]:
    """Scale to integers by the least denominator that fits, or round at the largest one."""
    for denominator in range(1, _LARGEST_DENOMINATOR + 1):
        scaled = weights * denominator
        if np.abs(scaled - np.rint(scaled)).max() < 1e-6 * denominator:
            break
    return np.rint(weights * denominator).astype(np.int64)


def lift_weights(
    star: Star, support: NDArray[np.integer], weights: NDArray[np.int64], *, lift: bool = True
) -> tuple[int, NDArray[np.int64]]:
    """Extend weights from the support of a star to all its wedges.

    Parameters
    ----------
    star : Star
    support : ndarray of int
        Wedges with given weights.
    weights : ndarray of int64, shape (len(support),)
        Not negative.
    lift : bool
        Whether other wedges get the least valid weights, short wedges first, or simply alpha.

    Returns
    -------
    alpha : int
        Least weight of a once-winding closed walk on the support; where there is none, the largest weight, or
        1.
    all_weights : ndarray of int64, shape (wedges,)
        With these no once-winding closed walk weighs less than alpha.
    """
    walks = _Walks(star)
    for wedge, weight in sorted(
        zip(support.tolist(), weights.tolist(), strict=True), key=lambda item: walks.first(item[0])
    ):
        walks.add(wedge, weight)
    shortest = min(
        (walks.rest(wedge) + weight for wedge, weight in zip(support.tolist(), weights.tolist(), strict=True))
    )
    alpha = int(shortest) if shortest < _FAR else max(1, int(weights.max(initial=1)))
    # A wedge of weight alpha makes every walk through it heavy enough: the safe choice to start from.
    extended = np.full(len(star.columns), alpha, dtype=np.int64)
    extended[support] = weights
    if lift:
        others = np.setdiff1d(np.arange(len(star.columns)), support)
        for wedge in others[np.argsort(walks.length[others], kind="stable")].tolist():
            weight = alpha - min(alpha, int(walks.rest(wedge)))
            extended[wedge] = weight
            if weight < alpha:
                walks.add(wedge, weight)
    return alpha, extended


_FAR = 1 << 40


class _Walks:
    """Least weights of paths of at most a turn between the nodes of a star, as wedges are added.

    Node i of the second turn is number size + i, so arcs only go forward, and a path from a head to its tail
    one turn later completes a once-winding walk.
    """

    def __init__(self, star: Star) -> None:
        size = star.size
        self.size = size
        self.tails = star.tails
        self.heads = star.heads + size * star.wraps
        self.length = self.heads - self.tails
        self.least = np.full((2 * size, 2 * size), _FAR, dtype=np.int64)
        np.fill_diagonal(self.least, 0)

    def first(self, wedge: int) -> int:
        """Node where a wedge starts."""
        return int(self.tails[wedge])

    def add(self, wedge: int, weight: int) -> None:
        """Allow paths to use a wedge, in both turns."""
        size, tail, head = self.size, int(self.tails[wedge]), int(self.heads[wedge])
        if weight >= self.least[tail, head]:
            return
        # Paths of more than a turn are never asked for: they begin at most a turn before they end.
        self._shorten(max(0, head - size), tail, head, min(tail + size, 2 * size - 1), weight)
        if head < size:
            self._shorten(head, tail + size, head + size, 2 * size - 1, weight)

    def _shorten(self, first: int, tail: int, head: int, last: int, weight: int) -> None:
        through = self.least[first : tail + 1, tail, None] + (
            weight + self.least[None, head, head : last + 1]
        )
        part = self.least[first : tail + 1, head : last + 1]
        np.minimum(part, through, out=part)

    def rest(self, wedge: int) -> int:
        """Least weight of a path from the head of a wedge to its tail, one turn later."""
        tail, head = int(self.tails[wedge]), int(self.heads[wedge])
        if head >= self.size:
            return int(self.least[head - self.size, tail])
        return int(self.least[head, tail + self.size])

"""Local search among triangulations by bistellar flips, in any dimension and any position.

A circuit is a minimal affine dependence, written as a pair (Z+, Z-) of faces whose relative interiors meet in one
point. Its points have two triangulations: the faces Z minus z for z in Z+, and those for z in Z-. Where a
triangulation has all faces of the first kind, and all of them have the same link, the flip replaces them by
those of the second kind, joined to that link (De Loera, Rambau, Santos, *Triangulations*, Sec. 2.4.2). In general
position Z has d + 2 points, and the link is empty.

Signs are exact, so every flip leads to a triangulation. Gains are floating-point numbers: they only guide.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.barycentric import barycentric_signs
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.subsets import ranks, without

#: Costs of ascending simplices, shape (k, d + 1) to (k,); infinite for those that must not be used.
CostsOf = Callable[[NDArray[np.integer]], NDArray[np.float64]]

# Gains below this part of the largest cost are rounding errors.
_TINY = 1e-12


@dataclass(frozen=True)
class _Flip:
    """What a flip takes out, by places in the triangulation, what it puts in, and what is gained."""

    gain: float
    removed: tuple[int, ...]
    inserted: tuple[tuple[int, ...], ...]


def improve_by_flips(
    simplices: NDArray[np.integer],
    chirotope: Chirotope,
    costs_of: CostsOf,
    *,
    spanning: bool,
    is_over: Callable[[], bool] | None = None,
) -> NDArray[np.int64]:
    """Flip as long as the sum of costs becomes smaller: steepest descent, many flips at a time.

    Parameters
    ----------
    simplices : ndarray of int, shape (k, d + 1)
        A triangulation, each simplex ascending.
    chirotope : Chirotope
        Only asked for orientations, so one without tables will do.
    costs_of : callable
    spanning : bool
        Whether every point must stay a vertex.
    is_over : callable, optional
        Tells whether there is no more time.

    Returns
    -------
    ndarray of int64, shape (k', d + 1)
        A triangulation whose costs are no larger, in colexicographic order.
    """
    state = _State(np.asarray(simplices, dtype=np.int64), chirotope, costs_of, spanning)
    while is_over is None or not is_over():
        chosen = state.best_flips()
        if not chosen:
            break
        state.apply(chosen)
    return state.simplices


def anneal_by_flips(
    simplices: NDArray[np.integer],
    chirotope: Chirotope,
    costs_of: CostsOf,
    guide_of: CostsOf,
    noise_of: Callable[[NDArray[np.integer], int], NDArray[np.float64]],
    *,
    spanning: bool,
    steps: int,
    enough: float = -inf,
    is_over: Callable[[], bool] | None = None,
) -> NDArray[np.int64]:
    """Leave local minima: descend again and again with disturbed costs, the less disturbed the later.

    Parameters
    ----------
    simplices, chirotope, costs_of, spanning, is_over
        As for `improve_by_flips`.
    guide_of : callable
        Costs that lead to good triangulations better than the true ones do, such as roots of reduced costs.
    noise_of : callable
        Numbers of random sign for simplices in a step, about as large as the guide's costs; the same ones for the same
        simplices and step.
    steps : int
    enough : float
        A sum of costs that is good enough to stop.

    Returns
    -------
    ndarray of int64, shape (k', d + 1)
        The best triangulation on the way.
    """
    current = best = np.asarray(simplices, dtype=np.int64)
    least = float(costs_of(best).sum())
    for step in range(steps):
        if least <= enough or (is_over is not None and is_over()):
            break

        def disturbed(asked: NDArray[np.integer], step: int = step) -> NDArray[np.float64]:
            return guide_of(asked) + (1 - step / steps) * noise_of(asked, step)

        current = improve_by_flips(current, chirotope, disturbed, spanning=spanning, is_over=is_over)
        found = float(costs_of(current).sum())
        if found < least:
            best, least = current, found
    return improve_by_flips(best, chirotope, costs_of, spanning=spanning, is_over=is_over)


class _State:
    """A triangulation with the costs of its simplices, sorted by rank."""

    def __init__(
        self, simplices: NDArray[np.int64], chirotope: Chirotope, costs_of: CostsOf, spanning: bool
    ) -> None:
        self.chirotope, self.costs_of, self.spanning = chirotope, costs_of, spanning
        self._set(simplices)

    def _set(self, simplices: NDArray[np.int64]) -> None:
        found = ranks(simplices, self.chirotope.n)
        order = np.argsort(found)
        self.simplices, self.ranks = simplices[order], found[order]
        self.costs = self.costs_of(self.simplices)
        finite = np.abs(self.costs[np.isfinite(self.costs)])
        self.least_gain = _TINY * float(finite.max(initial=0.0)) + 1e-300

    def best_flips(self) -> list[_Flip]:
        """Return improving flips that do not touch each other, those with the largest gains first."""
        flips = [flip for flip in self._flips() if flip.gain > self.least_gain]
        flips.sort(key=lambda flip: (-flip.gain, flip.removed))
        touched: set[int] = set()
        chosen = []
        for flip in flips:
            if touched.isdisjoint(flip.removed):
                touched.update(flip.removed)
                chosen.append(flip)
        return chosen

    def apply(self, flips: list[_Flip]) -> None:
        """Make flips that take out different simplices.

        The stars that they replace have disjoint interiors, so each is still possible after the others.
        """
        gone = np.zeros(len(self.simplices), dtype=bool)
        for flip in flips:
            gone[list(flip.removed)] = True
        fresh = np.array([simplex for flip in flips for simplex in flip.inserted], dtype=np.int64)
        self._set(np.concatenate((self.simplices[~gone], fresh)))

    def _flips(self) -> Iterator[_Flip]:
        pairs = self._neighbours()
        signs = self._dependences(pairs)
        general = signs.all(axis=1)
        yield from self._flips_in_general_position(pairs[general], signs[general])
        circuits = {
            (tuple(points[sign > 0].tolist()), tuple(points[sign < 0].tolist()))
            for points, sign in zip(pairs[~general], signs[~general], strict=True)
        }
        circuits.update(self._insertions())
        stars = self._stars() if circuits else {}
        for plus, minus in sorted(circuits):
            flip = self._flip(plus, minus, stars)
            if flip is not None:
                yield flip

    def _neighbours(self) -> NDArray[np.int64]:
        """Return the d + 2 points of every two simplices that share a facet, ascending, each set once."""
        size, n = self.simplices.shape[1], self.chirotope.n
        count = len(self.simplices)
        facets = np.concatenate([ranks(without(self.simplices, p), n) for p in range(size)])
        order = np.argsort(facets, kind="stable")
        same = np.flatnonzero(facets[order][1:] == facets[order][:-1])
        first, second = order[same], order[same + 1]
        apexes = self.simplices[second % count, second // count]
        points = np.sort(np.column_stack((self.simplices[first % count], apexes)), axis=1)
        _, once = np.unique(ranks(points, n), return_index=True)
        return points[once]

    def _dependences(self, points: NDArray[np.int64]) -> NDArray[np.int8]:
        """Return the signs of the affine dependence of each set of d + 2 points that spans the space.

        Positive is where leaving the point out gives simplices of the triangulation, of which there are two.
        """
        size = points.shape[1]
        if not len(points):
            return np.empty(points.shape, dtype=np.int8)
        signs = np.stack(
            [self.chirotope.orientations(without(points, p)) * (-1 if p & 1 else 1) for p in range(size)],
            axis=1,
        )
        present = np.stack([self._places(without(points, p)) >= 0 for p in range(size)], axis=1)
        known = np.argmax(present, axis=1)
        turned = signs[np.arange(len(points)), known]
        result: NDArray[np.int8] = (signs * turned[:, None]).astype(np.int8)
        return result

    def _places(self, simplices: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return where simplices stand in the triangulation, -1 where they do not."""
        wanted = ranks(simplices, self.chirotope.n)
        place = np.minimum(np.searchsorted(self.ranks, wanted), len(self.ranks) - 1)
        return np.where(self.ranks[place] == wanted, place, -1)

    def _flips_in_general_position(
        self, points: NDArray[np.int64], signs: NDArray[np.int8]
    ) -> Iterator[_Flip]:
        """Yield the flips of circuits with d + 2 points: what is to be taken out must be there."""
        size = points.shape[1]
        places = np.stack([self._places(without(points, p)) for p in range(size)], axis=1)
        possible = ((places >= 0) | (signs < 0)).all(axis=1)
        if self.spanning:
            possible &= (signs < 0).sum(axis=1) > 1
        points, signs, places = points[possible], signs[possible], places[possible]
        costs = np.zeros(points.shape)
        for position in range(size):
            new = signs[:, position] < 0
            costs[new, position] = -self.costs_of(without(points[new], position))
            costs[~new, position] = self.costs[places[~new, position]]
        with np.errstate(invalid="ignore"):
            gains = costs.sum(axis=1)
        for number in np.flatnonzero(gains > self.least_gain).tolist():
            vertices = points[number].tolist()
            inserted = tuple(
                tuple(vertices[:p] + vertices[p + 1 :]) for p in np.flatnonzero(signs[number] < 0).tolist()
            )
            removed = tuple(places[number][signs[number] > 0].tolist())
            yield _Flip(float(gains[number]), removed, inserted)

    def _stars(self) -> dict[int, set[int]]:
        """Return the simplices at each vertex, by their places."""
        stars: dict[int, set[int]] = {}
        for place, simplex in enumerate(self.simplices.tolist()):
            for vertex in simplex:
                stars.setdefault(vertex, set()).add(place)
        return stars

    def _flip(
        self, plus: tuple[int, ...], minus: tuple[int, ...], stars: dict[int, set[int]]
    ) -> _Flip | None:
        """Return the flip of a circuit of any size, if there is one."""
        if self.spanning and len(minus) == 1:
            return None
        circuit = set(plus) | set(minus)
        links: set[frozenset[frozenset[int]]] = set()
        removed: set[int] = set()
        for point in plus:
            face = circuit - {point}
            star = set.intersection(*(stars.get(vertex, set()) for vertex in face))
            rows = self.simplices[sorted(star)].tolist()
            links.add(frozenset(frozenset(row) - face for row in rows))
            removed |= star
            if not star or len(links) > 1:
                return None
        if not links:
            return None
        (link,) = links
        inserted = [
            tuple(sorted((circuit - {point}) | rest)) for point in minus for rest in sorted(link, key=sorted)
        ]
        places = tuple(sorted(removed))
        lost = self.costs_of(np.array(inserted, dtype=np.int64)).sum()
        with np.errstate(invalid="ignore"):
            gain = float(self.costs[list(places)].sum() - lost)
        return _Flip(gain, places, tuple(inserted))

    def _insertions(self) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
        """Yield the circuits of points that are no vertices and the faces that they lie in."""
        used = np.zeros(self.chirotope.n, dtype=bool)
        used[self.simplices.ravel()] = True
        for point in np.flatnonzero(~used).tolist():
            signs = barycentric_signs(self.chirotope, self.simplices, point)
            inside = np.flatnonzero((signs >= 0).all(axis=1))
            carrier = self.simplices[inside[0]][signs[inside[0]] > 0]
            if len(carrier) > 1:
                yield (point,), tuple(carrier.tolist())

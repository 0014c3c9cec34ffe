"""Exact checks that a triangulation is regular, or that it is not.

A triangulation is regular if its points can be lifted to heights so that its simplices are the lower faces of their
hull, seen from below. Take two simplices F + a and F + b with the common facet F. Their d + 2 points have one affine
dependence, ``sum of l_p p = 0`` and ``sum of l_p = 0``, with l_a and l_b positive; the lifted surface is strictly
convex at F if and only if ``sum of l_p h_p > 0``. A surface over the convex hull that is convex at all its folds is
convex, so heights h with these inequalities at all inner facets are what is wanted; points that are not used have to be
lifted above the surface.

By linear programming duality (Farkas) there are no such heights if and only if some numbers y >= 0 of the inner facets,
not all 0, give ``sum of y_F l_F = 0``: then the left sides cannot all be positive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from bcut.errors import VerificationError
from bcut.verification.exact_points import ExactPoints, Simplex, without


@dataclass(frozen=True)
class Fold:
    """An inner facet of a triangulation, with the affine dependence of the two simplices next to it.

    Attributes
    ----------
    facet : tuple of int
    dependence : mapping of int to a number
        Exact, positive at the two opposite vertices.
    """

    facet: Simplex
    dependence: Mapping[int, Any]

    def at(self, heights: Sequence[Fraction] | Mapping[int, Fraction]) -> Any:
        """Return by how much the surface with these heights folds upwards at the facet."""
        return sum((value * heights[point] for point, value in self.dependence.items()), Fraction(0))


def folds(points: ExactPoints, simplices: Sequence[Simplex]) -> list[Fold]:
    """Return the folds at all inner facets of a triangulation.

    Parameters
    ----------
    points : ExactPoints
    simplices : sequence of tuple of int
        A triangulation, each simplex with ascending vertices.
    """
    opposite: dict[Simplex, list[int]] = {}
    for simplex in simplices:
        for position, vertex in enumerate(simplex):
            opposite.setdefault(without(simplex, position), []).append(vertex)
    found = []
    for facet, vertices in sorted(opposite.items()):
        if len(vertices) == 2:
            together = (*facet, *vertices)
            values = []
            for position in range(len(together)):
                # Cramer's rule: the determinant of the others, with alternating signs.
                *plane, last = without(together, position)
                volume = points.value(points.hyperplane(tuple(plane)), last)
                values.append(-volume if position & 1 else volume)
            turn = 1 if values[-1] > 0 else -1
            dependence = {point: turn * value for point, value in zip(together, values, strict=True)}
            found.append(Fold(facet, dependence))
    return found


def check_heights(points: ExactPoints, simplices: Sequence[Simplex], heights: Sequence[Fraction]) -> None:
    """Check exactly that heights make a triangulation regular.

    Parameters
    ----------
    points : ExactPoints
    simplices : sequence of tuple of int
        A triangulation.
    heights : sequence of Fraction
        One for each point. Those of points that are no vertices must exceed all others, which is more than needed.

    Raises
    ------
    VerificationError
        If the surface is not strictly convex at some inner facet, or an unused point is not lifted above it.
    """
    for fold in folds(points, simplices):
        if not fold.at(heights) > 0:
            raise VerificationError(f"the lifted surface is not strictly convex at {list(fold.facet)}")
    used = {vertex for simplex in simplices for vertex in simplex}
    highest = max(heights[vertex] for vertex in used)
    low = [point for point in range(points.n) if point not in used and heights[point] <= highest]
    if low:
        raise VerificationError(f"point {low[0]} is no vertex, but not lifted above all of them")


def check_irregularity(
    points: ExactPoints, simplices: Sequence[Simplex], multipliers: Mapping[Simplex, Any]
) -> None:
    """Check exactly that multipliers of inner facets prove that no heights make a triangulation regular.

    Parameters
    ----------
    points : ExactPoints
    simplices : sequence of tuple of int
        A triangulation.
    multipliers : mapping of tuple of int to exact numbers
        Of inner facets; those left out are 0.

    Raises
    ------
    VerificationError
        If one is negative, all are 0, or the weighted sum of the dependences does not vanish.
    """
    known = {fold.facet: fold for fold in folds(points, simplices)}
    sums: dict[int, Any] = {}
    for facet, multiplier in multipliers.items():
        if facet not in known or multiplier < 0:
            raise VerificationError(f"{list(facet)} is no inner facet with a multiplier that is not negative")
        for point, value in known[facet].dependence.items():
            sums[point] = sums.get(point, Fraction(0)) + value * multiplier
    if not any(multipliers.values()):
        raise VerificationError("no multiplier is positive, so nothing is proven")
    if any(sums.values()):
        raise VerificationError("the dependences, weighted with the multipliers, do not cancel")

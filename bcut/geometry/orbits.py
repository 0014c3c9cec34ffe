"""Orbits of simplices under a symmetry group, without listing the simplices.

Representatives are least images (`bcut.geometry.canonical`). The beginning of a least image is the least image of
itself, so the representatives with k points are found among the representatives with k - 1 points and one greater
point each ("orderly generation": R. C. Read, "Every one a winner", 1978). Nothing is compared with anything else, and
memory holds little more than the representatives.

All decisions about dependence and sides are exact.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import factorial, prod

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.canonical import CanonicalForms
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.determinants import orientation_signs
from bcut.geometry.permutations import PermutationGroup

# Candidates, or numbers of a table, that are worked on at once.
_CHUNK = 200_000
# Products of residues fit into 64 bits.
_PRIME = 2**31 - 1


@dataclass(frozen=True, eq=False)
class SimplexOrbits:
    """Orbits of the (d-1)-simplices and of the d-simplices of a configuration.

    Attributes
    ----------
    configuration : PointConfiguration
    group : PermutationGroup
    forms : CanonicalForms
        Least images under `group`.
    facets : ndarray of int64, shape (f, d)
        Representatives of the orbits of affinely independent d-subsets, in lexicographic order; ascending rows.
    facet_sizes : ndarray of int64, shape (f,)
        Lengths of these orbits.
    facet_sides : ndarray of int8, shape (f, n)
        Orientation of each representative followed by each point.
    simplices : ndarray of int64, shape (m, d + 1)
        Representatives of the orbits of affinely independent (d+1)-subsets, in lexicographic order; ascending rows.
    sizes : ndarray of int64, shape (m,)
        Lengths of these orbits.
    """

    configuration: PointConfiguration
    group: PermutationGroup
    forms: CanonicalForms
    facets: NDArray[np.int64]
    facet_sizes: NDArray[np.int64]
    facet_sides: NDArray[np.int8]
    simplices: NDArray[np.int64]
    sizes: NDArray[np.int64]

    @cached_property
    def hull_facets(self) -> tuple[tuple[int, ...], ...]:
        """Facets of the convex hull, each as the ascending tuple of all configuration points on it."""
        return hull_facets(self.group, self.facet_sides)

    @cached_property
    def facet_is_interior(self) -> NDArray[np.bool_]:
        """Whether the facets of each orbit have points strictly on both sides, shape (f,)."""
        above, below = self.facet_sides > 0, self.facet_sides < 0
        return np.asarray(above.any(axis=1) & below.any(axis=1))

    @property
    def number_of_simplices(self) -> int:
        """How many simplices there are in all orbits."""
        return int(self.sizes.sum())


def simplex_orbits(configuration: PointConfiguration, group: PermutationGroup) -> SimplexOrbits:
    """Find the orbits of (d-1)-simplices and d-simplices.

    Parameters
    ----------
    configuration : PointConfiguration
    group : PermutationGroup
        Of affine symmetries of the configuration, such as `bcut.geometry.symmetry.symmetry_group` returns or a
        subgroup.

    Raises
    ------
    TooLargeError
        If the stabiliser of a point in the group is too large to be listed.
    """
    d = configuration.dimension
    forms = CanonicalForms(group)
    sets = subset_orbits(configuration, forms, d)
    # Dependent sets that nothing has excluded so far have no point on either side.
    sides = facet_sides(configuration, sets)
    independent = sides.any(axis=1)
    facets, sides = sets[independent], sides[independent]
    _, facet_stabilisers = forms.are_least(facets)
    simplices, stabilisers = _extended(forms, facets, sides)
    order = group.order
    return SimplexOrbits(
        configuration,
        group,
        forms,
        facets,
        order // facet_stabilisers.stabilisers,
        sides,
        simplices,
        order // stabilisers,
    )


def subset_orbits(configuration: PointConfiguration, forms: CanonicalForms, size: int) -> NDArray[np.int64]:
    """Return representatives of the orbits of the affinely independent sets of `size` points, shape (m, size).

    Of configurations with irrational or large coordinates, dependent sets may be among them.
    """
    sets = forms.roots[:, None]
    span = _Span.of(configuration)
    for _ in range(size - 1):
        sets = _extended(forms, sets, span)[0]
    return sets


def facet_sides(configuration: PointConfiguration, facets: NDArray[np.int64]) -> NDArray[np.int8]:
    """Return the orientation of each d-subset followed by each point, shape (f, d) to (f, n), exactly."""
    n, d = configuration.n, configuration.dimension
    sides = np.zeros((len(facets), n), dtype=np.int8)
    step = max(1, 20 * _CHUNK // n)
    for start in range(0, len(facets), step):
        part = facets[start : start + step]
        inside = np.zeros((len(part), n), dtype=bool)
        np.put_along_axis(inside, part, True, axis=1)
        rows, points = np.nonzero(~inside)
        tuples = np.empty((len(rows), d + 1), dtype=np.int64)
        tuples[:, :-1], tuples[:, -1] = part[rows], points
        sides[start + rows, points] = orientation_signs(configuration, tuples)
    return sides


def hull_facets(group: PermutationGroup, sides: NDArray[np.int8]) -> tuple[tuple[int, ...], ...]:
    """Return the facets of the convex hull from the sides of representatives of all (d-1)-simplices."""
    above, below = (sides > 0).any(axis=1), (sides < 0).any(axis=1)
    found = {tuple(np.flatnonzero(row).tolist()) for row in sides[above ^ below] == 0}
    facets: set[tuple[int, ...]] = set()
    for points in sorted(found):
        if points not in facets:
            facets.update(map(tuple, group.orbit(points).tolist()))
    return tuple(sorted(facets))


def _extended(
    forms: CanonicalForms, sets: NDArray[np.int64], allowed: NDArray[np.int8] | _Span | None
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the representatives with one point more, and the orders of their stabilisers.

    Parameters
    ----------
    forms : CanonicalForms
    sets : ndarray of int64, shape (m, k)
        All representatives that matter.
    allowed : ndarray of int8, shape (m, n), or _Span, or None
        Nonzero for the points that may be added; or what finds those outside the affine hull.
    """
    found, stabilisers = [np.empty((0, sets.shape[1] + 1), dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    for start, part in _parts(sets, forms.n):
        if isinstance(allowed, _Span):
            outside = allowed.outside(part)
        elif allowed is None:
            outside = np.ones((len(part), forms.n), dtype=bool)
        else:
            outside = allowed[start : start + len(part)] != 0
        # The new point is the greatest, and the least in its orbit under the stabiliser of the others.
        numbers = np.arange(forms.n)
        outside &= numbers > part[:, -1:]
        outside &= forms.least_in_orbit(part) == numbers
        rows, points = np.nonzero(outside)
        candidates = np.column_stack((part[rows], points))
        least, ways = forms.are_least(candidates)
        found.append(candidates[least])
        stabilisers.append(ways.stabilisers)
    return np.concatenate(found), np.concatenate(stabilisers)


def _parts(sets: NDArray[np.int64], n: int) -> Iterator[tuple[int, NDArray[np.int64]]]:
    step = max(1, _CHUNK // n)
    for start in range(0, len(sets), step):
        yield start, sets[start : start + step]


class _Span:
    """Finds the points outside the affine hulls of point sets, modulo a prime that exceeds every minor."""

    def __init__(self, residues: NDArray[np.int64]) -> None:
        self.residues = residues

    @classmethod
    def of(cls, configuration: PointConfiguration) -> _Span | None:
        """Prepare it; None where residues would prove nothing: irrational or large coordinates."""
        if configuration.field.degree > 1:
            return None
        numerators = configuration.numerators[..., 0].astype(object)
        numerators = numerators - numerators[0]
        largest = np.abs(numerators).max(axis=0, initial=1)
        # A minor of the homogeneous coordinates vanishes exactly when it vanishes modulo the prime.
        if factorial(configuration.dimension + 1) * prod(int(value) for value in largest) >= _PRIME:
            return None
        ones = np.ones((1, configuration.n), dtype=np.int64)
        return cls(np.concatenate((numerators.T.astype(np.int64), ones)) % _PRIME)

    def outside(self, sets: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Tell which points lie outside the affine hull of each set of independent points, shape (m, k) to (m, n)."""
        count, size = sets.shape
        numbers = np.arange(count)
        table = np.tile(self.residues, (count, 1, 1))
        for position in range(size):
            # Eliminate with a row that is not used yet and does not vanish at the point.
            column = table[numbers, position:, sets[:, position]]
            pivots = position + (column != 0).argmax(axis=1)
            row = table[numbers, pivots]
            table[numbers, pivots] = table[:, position]
            table[:, position] = row
            value = row[numbers, sets[:, position]]
            factors = table[numbers, :, sets[:, position]]
            below = table[:, position + 1 :]
            below *= value[:, None, None]
            below -= (factors[:, position + 1 :, None] * row[:, None, :]) % _PRIME
            below %= _PRIME
        return (table[:, size:] != 0).any(axis=1)

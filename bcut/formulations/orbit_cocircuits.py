"""Formulation 2 averaged over a group of symmetries: one variable per orbit of d-simplices.

The mean of the images of a feasible point of the linear relaxation under the group is feasible too, has the same
value of an invariant objective, and is constant on orbits. So the relaxation has an optimum of that kind, and is
solved over the numbers X_o = sum of x_t over the simplices t of orbit o, with 0 <= X_o <= |o|.

Rows: the cocircuit row of an interior (d-1)-simplex f and those of its images say the same. Summed over the orbit of
f,

    sum over o of X_o * (facets of a simplex of o that a symmetry maps to f so that the simplex comes to the + side,
                         minus those that come to the - side)  =  0,

with coefficients of size d + 1 at most. Where a symmetry maps f to itself and exchanges its sides, the row is 0 = 0
and is left out.

Coverage: the cocircuit rows make the number of chosen simplices over a generic point a constant c, and then the
volumes of the chosen simplices add up to c times the volume of the hull. With c = 1 that is an equation in the number
field of the coordinates, and holds coefficient by coefficient: by an equation over the rationals each, since the
cocircuit rows have rational coefficients. One coefficient in which the hull's volume does not vanish is enough to
make c = 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import gcd
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.hull import lie_on_hull, vertices_of_hull
from bcut.geometry.orbits import SimplexOrbits, facet_sides
from bcut.geometry.subsets import ranks, without
from bcut.geometry.volumes import hull_volume, volumes

if TYPE_CHECKING:
    import scipy.sparse as sp

# Facets whose least images are sought at once.
_CHUNK = 200_000
_INT64 = 2**62


@dataclass(frozen=True, eq=False)
class OrbitFormulation:
    """The averaged program: ``matrix @ X = 0``, ``volumes @ X = volume``, 0 <= X <= sizes.

    Attributes
    ----------
    configuration : PointConfiguration
    orbits : SimplexOrbits
    spanning : bool
        Whether only orbits of empty simplices are variables.
    simplices : ndarray of int64, shape (m, d + 1)
        A representative of each variable's orbit, ascending.
    sizes : ndarray of int64, shape (m,)
        Lengths of the orbits.
    matrix : scipy.sparse.csr_matrix of int8, shape (rows, m)
        Cocircuit rows.
    row_faces : ndarray of int64, shape (rows, d)
        The representative of each row's orbit of (d-1)-simplices.
    volumes : ndarray of int64, or of Python integers where they are larger, shape (m,)
        One coefficient of the volumes of the representatives, up to a common factor.
    volume : int
        The same of the hull; positive.
    volume_coefficient : int
        Which coefficient it is, on the basis of the coordinates' field.
    cuts : scipy.sparse.csr_matrix of int64, shape (cuts, m), or None
        Valid inequalities ``cuts @ X <= 0``.
    """

    configuration: PointConfiguration
    orbits: SimplexOrbits
    spanning: bool
    simplices: NDArray[np.int64]
    sizes: NDArray[np.int64]
    matrix: sp.csr_matrix
    row_faces: NDArray[np.int64]
    volumes: NDArray[Any]
    volume: int
    volume_coefficient: int = 0
    cuts: sp.csr_matrix | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Numbers of columns and rows, the coverage row included, cuts not."""
        return len(self.simplices), self.matrix.shape[0] + 1

    def with_cuts(self, cuts: sp.csr_matrix) -> OrbitFormulation:
        """Return the same program with these cuts and no others."""
        return replace(self, cuts=cuts)

    def expanded(
        self, orbits: Sequence[int] | NDArray[np.integer]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """List the simplices of some orbits.

        Returns
        -------
        simplices : ndarray of int64, shape (k, d + 1)
            Ascending vertices, in colexicographic order.
        orbit_of : ndarray of int64, shape (k,)
            The number of the orbit of each.
        """
        d = self.configuration.dimension
        lists = [np.empty((0, d + 1), dtype=np.int64)]
        lists += [self.orbits.group.orbit(self.simplices[orbit]) for orbit in orbits]
        simplices = np.concatenate(lists)
        numbers = np.repeat(np.asarray(orbits, dtype=np.int64), [len(part) for part in lists[1:]])
        order = np.argsort(ranks(simplices, self.configuration.n))
        return simplices[order], numbers[order]


def orbit_formulation(orbits: SimplexOrbits, *, spanning: bool = False) -> OrbitFormulation:
    """Build the averaged program.

    Parameters
    ----------
    orbits : SimplexOrbits
    spanning : bool
        Only triangulations that use every point.
    """
    import scipy.sparse as sp

    configuration = orbits.configuration
    simplices, sizes = orbits.simplices, orbits.sizes
    if spanning:
        empty = _empty(orbits)
        simplices, sizes = simplices[empty], sizes[empty]
    rows, columns, values = _incidences(orbits, simplices)
    used, numbers = np.unique(rows, return_inverse=True)
    matrix = sp.csr_matrix((values, (numbers, columns)), shape=(len(used), len(simplices)), dtype=np.int8)
    matrix.eliminate_zeros()
    kept = np.flatnonzero(np.diff(matrix.indptr))
    coefficients, total, place = _volume_row(
        volumes(configuration, simplices), hull_volume(configuration, orbits.hull_facets)
    )
    return OrbitFormulation(
        configuration=configuration,
        orbits=orbits,
        spanning=spanning,
        simplices=simplices,
        sizes=sizes,
        matrix=matrix[kept],
        row_faces=orbits.facets[used[kept]],
        volumes=coefficients,
        volume=total,
        volume_coefficient=place,
    )


def _incidences(
    orbits: SimplexOrbits, simplices: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int8]]:
    """Return facet orbit, column and sign of every interior facet of every representative, except where sides mix."""
    n = orbits.configuration.n
    facet_ranks = ranks(orbits.facets, n)
    order = np.argsort(facet_ranks)
    rows, columns, values = [], [], []
    for start in range(0, len(simplices), _CHUNK):
        part = simplices[start : start + _CHUNK]
        for position in range(part.shape[1]):
            facets = without(part, position)
            interior = np.flatnonzero(~lie_on_hull(facets, orbits.hull_facets, n))
            ways = orbits.forms.of(facets[interior], part[interior, position])
            row = order[np.searchsorted(facet_ranks, ranks(ways.images, n), sorter=order)]
            signs = orbits.facet_sides[row[ways.owners], ways.extras]
            starts = np.searchsorted(ways.owners, np.arange(len(row)))
            first = signs[starts]
            # A symmetry that fixes a facet pointwise, and is not the identity, exchanges its sides.
            mixed = (ways.fixing > 1) | (np.bincount(ways.owners, signs != first[ways.owners], len(row)) > 0)
            rows.append(row[~mixed])
            columns.append(start + interior[~mixed])
            values.append(first[~mixed])
    return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)


def _empty(orbits: SimplexOrbits) -> NDArray[np.bool_]:
    """Tell which representatives contain no point of the configuration besides their vertices."""
    n, simplices = orbits.configuration.n, orbits.simplices
    empty = np.ones(len(simplices), dtype=bool)
    if len(vertices_of_hull(orbits.hull_facets, n)) == n:
        # A vertex of the hull is in no other points' hull.
        return empty
    for start in range(0, len(simplices), _CHUNK // 10):
        part = simplices[start : start + _CHUNK // 10]
        contained = np.ones((len(part), n), dtype=bool)
        for position in range(part.shape[1]):
            facets, numbers = np.unique(without(part, position), axis=0, return_inverse=True)
            sides = facet_sides(orbits.configuration, facets)[numbers.reshape(-1)]
            own = sides[np.arange(len(part)), part[:, position]]
            contained &= sides != -own[:, None]
        empty[start : start + len(part)] = contained.sum(axis=1) == part.shape[1]
    return empty


def _volume_row(coefficients: NDArray[Any], volume: NDArray[Any]) -> tuple[NDArray[Any], int, int]:
    """Choose a coefficient in which the hull's volume does not vanish, and divide by the common divisor."""
    place = max(range(len(volume)), key=lambda k: abs(int(volume[k])))
    # In the field, a coefficient of a positive number may be negative.
    sign = 1 if volume[place] > 0 else -1
    row = [sign * int(value) for value in coefficients[:, place]]
    total = sign * int(volume[place])
    divisor = gcd(total, *row)
    reduced = [value // divisor for value in row]
    dtype = np.int64 if max(map(abs, reduced), default=0) < _INT64 else object
    return np.array(reduced, dtype=dtype), total // divisor, place

"""Checking that permutations of the points are symmetries, and the orbits of sets of points under them.

A permutation of points comes from an affine map exactly when it leaves all barycentric coordinates with respect to an
affine basis unchanged. The coordinate that belongs to the basis point b_i is the value of the linear form of the
hyperplane through the others, divided by its value at b_i.

Orbits are found by going through a table of all sets of k points: the next one that has not been reached is a
representative, and everything that the permutations lead to from there is its orbit. The table is the proof that none
is missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray

from bcut.errors import VerificationError
from bcut.verification.exact_points import ExactPoints, Hyperplane, Simplex, without

# The next set that is not reached yet is looked for in pieces of the table of this length.
_PIECE = 1 << 20


@dataclass(frozen=True, eq=False)
class Symmetries:
    """Permutations that are known to come from affine maps.

    Attributes
    ----------
    images : tuple of ndarray of int, each of shape (n,)
    preserve_orientation : tuple of bool
        Whether the determinant of each map is positive.
    """

    images: tuple[NDArray[np.integer], ...]
    preserve_orientation: tuple[bool, ...]


def check_symmetries(
    points: ExactPoints, permutations: Sequence[Sequence[int]], basis: Simplex
) -> Symmetries:
    """Check that permutations of the points come from affine maps.

    Parameters
    ----------
    points : ExactPoints
    permutations : sequence of sequences of n int
        The image of each point.
    basis : tuple of int
        d + 1 affinely independent points.

    Raises
    ------
    VerificationError
        One of them is no permutation, or no symmetry.
    """
    planes = [points.hyperplane(without(basis, i)) for i in range(len(basis))]
    heights = [points.value(plane, b) for plane, b in zip(planes, basis, strict=True)]
    forms = [[points.value(plane, p) for p in range(points.n)] for plane in planes]
    kind = np.min_scalar_type(points.n)
    images, preserve = [], []
    for number, permutation in enumerate(permutations):
        where = f"symmetry {number} of the certificate"
        if sorted(permutation) != list(range(points.n)):
            raise VerificationError(f"{where} is no permutation of the {points.n} points")
        for i, plane in enumerate(planes):
            image = points.hyperplane(tuple(permutation[v] for v in plane.points))
            height = points.value(image, permutation[basis[i]])
            moved = next(
                (
                    p
                    for p in range(points.n)
                    if _differ(points, image, permutation[p], height, forms[i][p], heights[i])
                ),
                None,
            )
            if moved is not None or not height:
                raise VerificationError(
                    f"{where} is no affine symmetry: it takes the points {list(basis)} to "
                    f"{[permutation[v] for v in basis]}, but the map that does so does not take point "
                    f"{0 if moved is None else moved} to point {permutation[0 if moved is None else moved]}"
                )
        last = points.hyperplane(tuple(permutation[v] for v in basis[:-1]))
        preserve.append(points.side(last, permutation[basis[-1]]) == points.side(planes[-1], basis[-1]))
        images.append(np.array(permutation, dtype=kind))
    return Symmetries(tuple(images), tuple(preserve))


def _differ(
    points: ExactPoints, image: Hyperplane, moved: int, height: object, form: object, base: object
) -> bool:
    """Tell whether a point's image has another barycentric coordinate than the point."""
    return bool(points.value(image, moved) * base != form * height)  # type: ignore[operator]


class SetOrbits:
    """Orbits of sets of k points under symmetries, in a table of all sets.

    An orbit is oriented: its sets are ordered by ascending points, and a symmetry that takes one set to another takes
    the points on the + side of the one (those that give a positive determinant behind its points) to the + side or to
    the - side of the other.

    Parameters
    ----------
    symmetries : Symmetries
    n, size : int

    Attributes
    ----------
    labels : ndarray of int32, shape (C(n, size),)
        By colexicographic rank: 0 where nothing is known, otherwise the number of the orbit, from 1; negative where
        the + side is the image of the representative's - side.
    representatives : list of tuple of int
        Of orbit 1, 2, ...
    sizes : list of int
    exchanged : list of bool
        Whether some symmetry takes a set of the orbit to itself and exchanges its sides.
    """

    def __init__(self, symmetries: Symmetries, n: int, size: int) -> None:
        self.symmetries, self.n, self.size = symmetries, n, size
        self.binomials = np.array(
            [[comb(p, k) for p in range(n)] for k in range(1, size + 1)], dtype=np.int64
        )
        self.labels = np.zeros(comb(n, size), dtype=np.int32)
        self.representatives: list[Simplex] = []
        self.sizes: list[int] = []
        self.exchanged: list[bool] = []

    def ranks(self, columns: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the colexicographic ranks of ascending sets, shape (size, m) to (m,)."""
        ranks = self.binomials[0][columns[0]]
        for k in range(1, self.size):
            ranks = ranks + self.binomials[k][columns[k]]
        return ranks

    def add_all(self) -> None:
        """Find all orbits."""
        start = 0
        while start < len(self.labels):
            missing = np.flatnonzero(self.labels[start : start + _PIECE] == 0)
            if len(missing):
                start += int(missing[0])
                self.number_of(self._set_of_rank(start))
            else:
                start += _PIECE

    def number_of(self, points: Simplex) -> int:
        """Return the number of the orbit of an ascending set, which is found if it was not known."""
        column = np.array(points, dtype=np.min_scalar_type(self.n))[:, None]
        rank = int(self.ranks(column)[0])
        if not self.labels[rank]:
            self._reach(column, rank)
            self.representatives.append(points)
        return abs(int(self.labels[rank]))

    def _set_of_rank(self, rank: int) -> Simplex:
        points = []
        for k in range(self.size - 1, -1, -1):
            point = int(np.searchsorted(self.binomials[k], rank, side="right")) - 1
            points.append(point)
            rank -= int(self.binomials[k][point])
        return tuple(reversed(points))

    def _reach(self, column: NDArray[np.integer], rank: int) -> None:
        """Label everything that the symmetries lead to from one set."""
        number = len(self.sizes) + 1
        self.labels[rank] = number
        count, exchanged = 1, False
        frontier, signs = column, np.ones(1, dtype=np.int32)
        while frontier.shape[1]:
            found, found_signs = [frontier[:, :0]], [signs[:0]]
            for image, keeps in zip(
                self.symmetries.images, self.symmetries.preserve_orientation, strict=True
            ):
                moved, odd = _sorted_columns(image[frontier])
                moved_signs = np.where(odd == keeps, -signs, signs)
                ranks = self.ranks(moved)
                known = self.labels[ranks]
                exchanged = exchanged or bool(np.any((known != 0) & (known != number * moved_signs)))
                fresh = known == 0
                # A permutation takes different sets to different ones: nothing occurs twice here.
                self.labels[ranks[fresh]] = number * moved_signs[fresh]
                found.append(moved[:, fresh])
                found_signs.append(moved_signs[fresh])
            frontier, signs = np.concatenate(found, axis=1), np.concatenate(found_signs)
            count += frontier.shape[1]
        self.sizes.append(count)
        self.exchanged.append(exchanged)


def _sorted_columns(columns: NDArray[np.integer]) -> tuple[NDArray[np.integer], NDArray[np.bool_]]:
    """Sort every column, and tell for which of them that takes an odd permutation."""
    rows = list(columns)
    odd = np.zeros(columns.shape[1], dtype=bool)
    # Exchanges of neighbours, size after size, are few operations on whole rows.
    for end in range(len(rows) - 1, 0, -1):
        for k in range(end):
            odd ^= rows[k] > rows[k + 1]
            rows[k], rows[k + 1] = np.minimum(rows[k], rows[k + 1]), np.maximum(rows[k], rows[k + 1])
    return np.array(rows), odd

"""The rotation of the points about every ridge: all orientations of a configuration, in a small table.

Seen along a ridge, d - 1 independent points, the other points are directions in a plane. Their cyclic order, with
ties and opposite directions, tells the orientation of every simplex that contains the ridge (Bokowski and Sturmfels
call it a hyperline sequence). So about n exact determinants for each ridge replace one for each (d+1)-subset, and
everything after this module is comparisons of small integers, whatever the coordinates are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.errors import TooLargeError
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.determinants import determinants, orientation_signs
from bcut.geometry.numbers import AlgebraicNumber
from bcut.geometry.rank import pivot_columns
from bcut.geometry.subsets import all_subsets

# Entries of the table of positions; with them go a few times as many bytes.
MAX_POSITIONS = 1_000_000_000
# Determinants that are computed at a time.
_BLOCK = 1 << 17
# Positions are below twice the number of points.
_MAX_POINTS_IN_16_BITS = 1 << 14


@dataclass(frozen=True, eq=False)
class Rotations:
    """Positions of all points in the rotation about every ridge.

    Points are numbered here in an order of their own, `labels`. With h the half turn of the ridge r, positions
    count modulo 2h: the orientation of (r, a, b) is positive exactly when b is less than h positions after a,
    zero when it is 0 or h positions after it, and negative otherwise.

    Attributes
    ----------
    labels : ndarray of int64, shape (n,)
        The point of the configuration that each number here stands for.
    dimension : int
        d.
    positions : ndarray of int16 or int32, shape (C(n, d - 1), n)
        By the colexicographic rank of the ridge; -1 for points in the affine hull of the ridge.
    half_turns : ndarray of int32, shape (C(n, d - 1),)
        Number of lines through the ridge that carry points; 0 for (d-1)-subsets that are dependent.
    """

    labels: NDArray[np.int64]
    dimension: int
    positions: NDArray[np.integer[Any]]
    half_turns: NDArray[np.int32]

    @classmethod
    def of(cls, configuration: PointConfiguration, labels: NDArray[np.int64] | None = None) -> Rotations:
        """Compute all rotations exactly.

        Parameters
        ----------
        configuration : PointConfiguration
        labels : ndarray of int64, shape (n,), optional
            The order in which to number the points; that of the configuration if left out.

        Raises
        ------
        TooLargeError
            The table would have more than `MAX_POSITIONS` entries.
        """
        n, d = configuration.n, configuration.dimension
        if comb(n, d - 1) * n > MAX_POSITIONS:
            raise TooLargeError(
                f"{configuration.name}: {n} points in dimension {d} have {comb(n, d - 1):,} ridges; a table of the "
                f"rotation of the points about them may have {MAX_POSITIONS:,} entries. Take fewer points."
            )
        labels = np.arange(n, dtype=np.int64) if labels is None else labels
        ridges = all_subsets(n, d - 1)
        positions = np.empty((len(ridges), n), dtype=np.int16 if n < _MAX_POINTS_IN_16_BITS else np.int32)
        half_turns = np.empty(len(ridges), dtype=np.int32)
        sorter = _Sorter(configuration, labels)
        step = max(1, _BLOCK // n)
        for start in range(0, len(ridges), step):
            block = slice(start, start + step)
            positions[block], half_turns[block] = sorter.rotations(ridges[block])
        return cls(labels, d, positions, half_turns)

    @cached_property
    def n(self) -> int:
        """Number of points."""
        return len(self.labels)


def sweep_order(configuration: PointConfiguration) -> NDArray[np.int64]:
    """Return the points in lexicographic order of their coordinates, exactly.

    A point of a simplex that is no vertex of it comes strictly after its first and strictly before its last
    vertex.
    """
    if configuration.field.degree == 1:
        keys: Sequence[Any] = configuration.numerators[..., 0].tolist()
    else:
        keys = configuration.scalars()
    return np.array(sorted(range(configuration.n), key=keys.__getitem__), dtype=np.int64)


class _Sorter:
    """Sorts the points about ridges: floating-point angles propose the order, exact signs prove or refute it."""

    def __init__(self, configuration: PointConfiguration, labels: NDArray[np.int64]) -> None:
        self.configuration = configuration
        self.labels = labels
        self.n, self.dimension = configuration.n, configuration.dimension
        self.guide = _guide(configuration)[labels]

    def rotations(self, ridges: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return positions, shape (k, n), and half turns, shape (k,), of some ridges."""
        planar = self._planar(ridges)
        bases, sides = self._bases(ridges, planar)
        x, y = _about(planar, bases)
        # Twice the area of (base, point) has the sign of `sides` in one of the two orientations of the plane.
        handed = np.where((sides * y).sum(axis=1) < 0, -1.0, 1.0)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            keys = np.nan_to_num(-handed[:, None] * x / y, nan=0.0, posinf=1e300, neginf=-1e300)
        keys[sides == 0] = np.inf
        order = np.argsort(keys, axis=1)
        counts = np.count_nonzero(sides, axis=1)
        steps = self._steps(ridges, order, sides, counts)
        for row in np.flatnonzero((steps < 0).any(axis=1)).tolist():
            one = slice(row, row + 1)
            if self.configuration.field.degree == 1:
                order[row, : counts[row]] = self._exact_order(
                    ridges[row], int(bases[row]), sides[row], y[row]
                )
                steps[one] = self._steps(ridges[one], order[one], sides[one], counts[one])
            else:
                order[one], steps[one] = self._transposed(
                    ridges[one], order[one], steps[one], sides[one], counts[one]
                )
        return self._numbered(ridges, bases, sides, y, order, steps)

    def _signs(self, ridges: NDArray[np.int64], first: Any, second: Any) -> NDArray[np.int8]:
        """Return the orientations of (ridge, first, second); the three broadcast, but for the ridge's points."""
        first, second = np.broadcast_arrays(first, second)
        shape, size = first.shape, self.dimension - 1
        tuples = np.empty((*shape, size + 2), dtype=np.int64)
        tuples[..., :size] = ridges
        tuples[..., size], tuples[..., size + 1] = first, second
        return orientation_signs(self.configuration, self.labels[tuples.reshape(-1, size + 2)]).reshape(shape)

    def _planar(self, ridges: NDArray[np.int64]) -> NDArray[np.float64]:
        """Project the points along each ridge into a plane, approximately, shape (k, n, 2)."""
        origins = self.guide[ridges[:, 0]]
        differences = self.guide[None] - origins[:, None]
        if self.dimension == 2:
            return differences
        spans = self.guide[ridges[:, 1:]] - origins[:, None]
        basis, _ = np.linalg.qr(np.swapaxes(spans, 1, 2), mode="complete")
        return differences @ basis[:, :, self.dimension - 2 :]

    def _bases(
        self, ridges: NDArray[np.int64], planar: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int8]]:
        """Choose a point off each ridge, and return it with the orientations of (ridge, it, any point).

        Dependent subsets, which have no such point, keep the orientation zero throughout.
        """
        bases = np.einsum("kni,kni->kn", planar, planar).argmax(axis=1)
        everyone = np.arange(self.n)
        sides = self._signs(ridges[:, None, :], bases[:, None], everyone)
        for row in np.flatnonzero(~sides.any(axis=1)).tolist():
            # Rounding chose a point of the ridge's affine hull, or there is nothing to choose.
            ridge = ridges[row]
            if not self._is_independent(ridge):
                continue
            for candidate in range(self.n):
                sides[row] = self._signs(ridge, candidate, everyone)
                if sides[row].any():
                    bases[row] = candidate
                    break
        return bases, sides

    @cached_property
    def _scalars(self) -> tuple[tuple[Fraction | AlgebraicNumber, ...], ...]:
        return self.configuration.scalars()

    @cached_property
    def _integers(self) -> NDArray[np.object_]:
        """Numerators of rational points, in the order of the numbers here, shape (n, d)."""
        return self.configuration.numerators[self.labels, :, 0].astype(object)

    def _is_independent(self, ridge: NDArray[np.int64]) -> bool:
        first, *others = (self._scalars[label] for label in self.labels[ridge].tolist())
        differences = [[a - b for a, b in zip(other, first, strict=True)] for other in others]
        return len(pivot_columns(differences)) == len(differences)

    def _steps(
        self,
        ridges: NDArray[np.int64],
        order: NDArray[np.int64],
        sides: NDArray[np.int8],
        counts: NDArray[np.int64],
    ) -> NDArray[np.int8]:
        """Compare each point in the order with the next one, both turned to the positive side of the base.

        Shape (k, n - 1): 1 where the next one's line comes later, 0 on the same line, -1 where the order is
        wrong; 0 from the last point off the base's hyperplane on. As all these directions lie within half a
        turn, an order without -1 is right.
        """
        steps = np.zeros((len(order), self.n - 1), dtype=np.int8)
        rows, places = np.nonzero(np.arange(self.n - 1) < counts[:, None] - 1)
        first, second = order[rows, places], order[rows, places + 1]
        signs = self._signs(ridges[rows], first, second)
        steps[rows, places] = signs * sides[rows, first] * sides[rows, second]
        return steps

    def _exact_order(
        self, ridge: NDArray[np.int64], base: int, sides: NDArray[np.int8], y: NDArray[np.float64]
    ) -> list[int]:
        """Sort the points off the hyperplane of the base by exact slopes.

        With D(a, q) the determinant of (ridge, a, q), the quotients D(p, q) / D(base, q) rise or fall along
        the order, for any p off that hyperplane. Different ones differ by at least the reciprocal of the
        product of their denominators, so they still differ after scaling by more than that product and
        rounding down.
        """
        points = np.flatnonzero(sides)
        second = int(points[np.abs(y[points]).argmax()])
        numerators, origin = self._integers, self._integers[ridge[0]]

        def values(point: int) -> list[int]:
            rows = [
                [numerators[p, j : j + 1] - origin[j] for j in range(self.dimension)]
                for p in (*ridge[1:], point)
            ]
            rows.append([numerators[points, j] - origin[j] for j in range(self.dimension)])
            return np.asarray(determinants(rows)).tolist()

        tops, bottoms = values(second), values(base)
        shift = 2 * max(abs(bottom).bit_length() for bottom in bottoms) + 1
        rising = int(sides[second])
        slopes = {
            point: ((rising * top) << shift) // bottom
            for point, top, bottom in zip(points.tolist(), tops, bottoms, strict=True)
        }
        return sorted(slopes, key=slopes.__getitem__)

    def _transposed(
        self,
        ridges: NDArray[np.int64],
        order: NDArray[np.int64],
        steps: NDArray[np.int8],
        sides: NDArray[np.int8],
        counts: NDArray[np.int64],
    ) -> tuple[NDArray[np.int64], NDArray[np.int8]]:
        """Sort one order by exchanging neighbours; quotients of number field elements would cost more."""
        order = order.copy()
        while (steps < 0).any():
            wrong = np.flatnonzero(steps[0] < 0)
            # Of neighbouring exchanges every other one, so that they do not meet.
            chosen = [int(wrong[0])]
            for place in wrong[1:].tolist():
                if place > chosen[-1] + 1:
                    chosen.append(place)
            for place in chosen:
                order[0, [place, place + 1]] = order[0, [place + 1, place]]
            steps = self._steps(ridges, order, sides, counts)
        return order, steps

    def _numbered(
        self,
        ridges: NDArray[np.int64],
        bases: NDArray[np.int64],
        sides: NDArray[np.int8],
        y: NDArray[np.float64],
        order: NDArray[np.int64],
        steps: NDArray[np.int8],
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Count lines from that of the base, which is 0, and add the half turn for points behind the ridge."""
        count, rows = len(ridges), np.arange(len(ridges))
        lines = np.ones((count, self.n), dtype=np.int64)
        lines[:, 1:] += np.cumsum(steps, axis=1)
        half_turns = np.where(sides.any(axis=1), lines[:, -1] + 1, 0)
        positions = np.full((count, self.n), -1, dtype=np.int64)
        np.put_along_axis(positions, order, lines, axis=1)
        positions += np.where(sides < 0, half_turns[:, None], 0)
        positions[sides == 0] = -1
        # On the hyperplane of the base: seen from another point, they are on its side or opposite, or on the ridge.
        witnesses = np.where(sides != 0, np.abs(y), -1.0).argmax(axis=1)
        undecided = (sides == 0) & (half_turns > 0)[:, None]
        undecided[rows[:, None], ridges] = False
        at, points = np.nonzero(undecided)
        seen = self._signs(ridges[at], witnesses[at], points) * sides[at, witnesses[at]]
        positions[at[seen < 0], points[seen < 0]] = 0
        positions[at[seen > 0], points[seen > 0]] = half_turns[at[seen > 0]]
        return positions, half_turns


def _about(
    planar: NDArray[np.float64], bases: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return coordinates along and across the direction of the base, each of shape (k, n)."""
    direction = planar[np.arange(len(planar)), bases]
    along = np.einsum("kni,ki->kn", planar, direction)
    across = planar[..., 1] * direction[:, :1] - planar[..., 0] * direction[:, 1:]
    return along, across


def _guide(configuration: PointConfiguration) -> NDArray[np.float64]:
    """Return floats near an affine image of the points that fills [-1, 1], shape (n, d)."""
    if configuration.field.degree == 1:
        # Differences first: a common offset must not swallow the digits.
        numerators = configuration.numerators[..., 0].astype(object)
        differences = numerators - numerators[0]
        largest = np.abs(differences).max(axis=0)
        return np.true_divide(differences, largest).astype(float)
    differences = configuration.floats - configuration.floats[0]
    scales = np.abs(differences).max(axis=0)
    return differences / np.where(scales > 0, scales, 1.0)

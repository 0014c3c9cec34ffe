"""Point configurations: finitely many distinct points with exact coordinates that span their space."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

from bcut.errors import ConfigurationError
from bcut.geometry.coordinates import Coordinates, coordinates_of, from_coefficients, nearest_floats
from bcut.geometry.numbers import AlgebraicNumber, RealField, exact_scalar, number_text, unify
from bcut.geometry.rank import affine_rank


class PointConfiguration:
    """A finite set of points of full dimension d >= 2, with exact coordinates. Immutable.

    Make one with `from_values`, or with `bcut.load_instance` from a file or a family's name.

    Attributes
    ----------
    name : str
        What to call it in results; no part of its identity.
    n, dimension : int
        Number of points, and d.
    field : RealField
        The number field of the coordinates; of degree r.
    numerators : (n, d, r) array, read-only
        int64 where all entries are below 2**62 in absolute value, else Python integers (dtype object).
    denominator : int
        Positive. Coordinate j of point i is sum_k numerators[i, j, k] * field.basis_k / denominator; lowest
        terms.
    floats : (n, d) float64 array, read-only
        The nearest float64 of each coordinate: for display and as a first guess, never for a decision.
    """

    __slots__ = ("_coordinates", "_digest", "_floats", "_name", "_texts")

    def __init__(self, coordinates: Coordinates, name: str) -> None:
        self._name = name
        self._floats = _checked_floats(coordinates)
        self._coordinates = coordinates
        self._texts: tuple[tuple[str, ...], ...] | None = None
        self._digest = ""

    @classmethod
    def from_values(
        cls, values: Any, *, name: str = "points", origin: str | None = None
    ) -> PointConfiguration:
        """Make a configuration from an array or from nested sequences.

        Parameters
        ----------
        values : (n, d) array of integers or floats, or a sequence of n sequences of d coordinates
            Coordinates are integers, `Fraction`, floats (taken exactly), `AlgebraicNumber` or texts such as
            "1/3", "(1+sqrt(5))/2", "cos(2*pi/7)"; they may be mixed. The text "0.1" is the float 0.1.
        name : str
            What to call the configuration in results.
        origin : str, optional
            What to call it in error messages, such as the path of its file; the name if left out.

        Raises
        ------
        ConfigurationError
            No points, ragged rows, a coordinate that is no finite exact number, dimension below 2, fewer than
            d + 1 points, duplicates, or points in a common hyperplane.
        """
        try:
            return cls(coordinates_of(values), name)
        except ConfigurationError as error:
            raise ConfigurationError(f"{origin or name}: {error}") from None

    @property
    def name(self) -> str:
        """What to call the configuration in results; no part of its identity."""
        return self._name

    @property
    def floats(self) -> npt.NDArray[np.float64]:
        """The nearest float64 of each coordinate, (n, d)."""
        return self._floats

    @property
    def n(self) -> int:
        """Number of points."""
        return int(self._coordinates.numerators.shape[0])

    @property
    def dimension(self) -> int:
        """Dimension d of the space, which the points span."""
        return int(self._coordinates.numerators.shape[1])

    @property
    def field(self) -> RealField:
        """Number field of the coordinates."""
        return self._coordinates.field

    @property
    def numerators(self) -> npt.NDArray[Any]:
        """Integer coefficients of the coordinates, (n, d, r)."""
        return self._coordinates.numerators

    @property
    def denominator(self) -> int:
        """Common denominator of the coordinates."""
        return self._coordinates.denominator

    @property
    def digest(self) -> str:
        """SHA-256 of the exact points' texts, in hexadecimal; the name does not enter.

        Equal points give equal digests as long as they are written in one number field, and always after the
        texts of `exact_points` have been read back.
        """
        if not self._digest:
            lines = [f"{self.n} {self.dimension}", *(" ".join(row) for row in self.exact_points())]
            self._digest = hashlib.sha256("\n".join(lines).encode()).hexdigest()
        return self._digest

    def exact_points(self) -> tuple[tuple[str, ...], ...]:
        """Return the coordinates as canonical texts, which `from_values` reads back exactly."""
        if self._texts is None:
            self._texts = tuple(tuple(number_text(value) for value in row) for row in self.scalars())
        return self._texts

    def scalars(self) -> tuple[tuple[Fraction | AlgebraicNumber, ...], ...]:
        """Return the coordinates as exact scalars: `Fraction` in the field Q, else `AlgebraicNumber`."""
        return tuple(
            tuple(exact_scalar(self.field, coefficients, self.denominator) for coefficients in row)
            for row in self.numerators.tolist()
        )

    def relabelled(self, permutation: Sequence[int]) -> PointConfiguration:
        """Return the same points in another order: new point i is old point permutation[i].

        Raises
        ------
        ValueError
            Not a permutation of 0 ... n - 1.
        """
        order = np.asarray(permutation, dtype=np.int64)
        if order.shape != (self.n,) or not np.array_equal(np.sort(order), np.arange(self.n)):
            raise ValueError(f"not a permutation of the {self.n} points")
        numerators = np.ascontiguousarray(self.numerators[order])
        numerators.setflags(write=False)
        return PointConfiguration(Coordinates(self.field, numerators, self.denominator), self.name)

    def affine_image(self, matrix: Any, shift: Any = None) -> PointConfiguration:
        """Return the points A x + b, for a rational matrix.

        Parameters
        ----------
        matrix : (d, d) integers, rationals or floats
        shift : (d,) integers, rationals or floats, optional
            Zero if left out.

        Raises
        ------
        ConfigurationError
            The image does not span the space: the matrix is singular.
        """
        d, field = self.dimension, self.field
        rows = [[Fraction(value) for value in row] for row in np.asarray(matrix, dtype=object).tolist()]
        shifts = [
            Fraction(value)
            for value in np.asarray([0] * d if shift is None else shift, dtype=object).tolist()
        ]
        if [len(row) for row in rows] != [d] * d or len(shifts) != d:
            raise ValueError(f"an affine map of dimension {d} needs a {d} x {d} matrix and {d} shifts")
        images: list[Fraction | AlgebraicNumber] = []
        for point in self.scalars():
            for row, constant in zip(rows, shifts, strict=True):
                start = constant if field.degree == 1 else AlgebraicNumber.of(field, constant)
                images.append(sum((a * x for a, x in zip(row, point, strict=True)), start))
        # The image may need less than the whole field, and equal points must have equal digests.
        return PointConfiguration(from_coefficients(*unify(images), (self.n, d)), self.name)

    def __len__(self) -> int:
        return self.n

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, PointConfiguration):
            return NotImplemented
        if self.floats.shape != other.floats.shape or not np.array_equal(self.floats, other.floats):
            return False
        return self.digest == other.digest or self.scalars() == other.scalars()

    def __hash__(self) -> int:
        # Nearest floats do not depend on the field in which equal numbers are written.
        return hash((self.floats.shape, self.floats.tobytes()))

    def __repr__(self) -> str:
        return f"<PointConfiguration {self.name}: {self.n} points in dimension {self.dimension}>"


def _checked_floats(coordinates: Coordinates) -> npt.NDArray[np.float64]:
    """Return the nearest floats of points that are a configuration of full dimension.

    Raises
    ------
    ConfigurationError
        They are not.
    """
    n, dimension = coordinates.numerators.shape[:2]
    if n == 0:
        raise ConfigurationError("there are no points; a configuration needs at least dimension + 1 of them")
    if dimension < 2:
        raise ConfigurationError(f"points with {dimension} coordinate(s): the dimension must be at least 2")
    if n < dimension + 1:
        raise ConfigurationError(
            f"{n} point(s) cannot span dimension {dimension}; at least {dimension + 1} are needed "
            "(or the points are given as columns and must be transposed)"
        )
    floats = nearest_floats(coordinates)
    floats.setflags(write=False)
    duplicates = _first_duplicates(coordinates.numerators)
    if duplicates is not None:
        raise ConfigurationError(
            f"points {duplicates[0]} and {duplicates[1]} (counted from 0) are equal; remove one of them"
        )
    rank = affine_rank(coordinates, floats)
    if rank < dimension:
        raise ConfigurationError(
            f"the points lie in a common hyperplane: they span dimension {rank} of {dimension}; "
            + (f"give them in {rank} coordinates, or " if rank >= 2 else "")
            + "add a point outside"
        )
    return floats


def _first_duplicates(numerators: npt.NDArray[Any]) -> tuple[int, int] | None:
    """Return indices of two equal points, or None."""
    first: dict[Any, int] = {}
    flat = numerators.reshape(len(numerators), -1)
    keys = map(tuple, flat.tolist()) if flat.dtype == object else (row.tobytes() for row in flat)
    for index, key in enumerate(keys):
        if first.setdefault(key, index) != index:
            return first[key], index
    return None

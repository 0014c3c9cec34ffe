"""`regular`: heights that make a triangulation regular, or an exact proof that there are none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.bounds.linear_program import LinearProgram, LpSolution, solve_linear_program
from bcut.errors import ResultError, SolverError, VerificationError
from bcut.geometry.numbers import AlgebraicNumber, number_text, parse_coordinate
from bcut.verification.exact_points import ExactPoints, Simplex
from bcut.verification.reading import Source, load_result, plain_data
from bcut.verification.regularity import Fold, check_heights, check_irregularity, folds
from bcut.verification.triangulation import check_triangulation

# Multipliers below this are zero up to the accuracy of the solver.
_NOISE = 1e-8
# Heights are rounded to multiples of 2**-k for k up to this.
_FINEST = 40


@dataclass(frozen=True)
class Regularity:
    """Whether a triangulation is regular, with the proof.

    Attributes
    ----------
    regular : bool
    heights : tuple of Fraction or None
        One for each point: the triangulation is the lower side of the hull of the lifted points.
    multipliers : tuple of (facet, number) or None
        Of inner facets: their conditions, added up with these, are contradictory.
    """

    regular: bool
    heights: tuple[Fraction, ...] | None = None
    multipliers: tuple[tuple[Simplex, Fraction | AlgebraicNumber], ...] | None = None

    def __repr__(self) -> str:
        if self.regular:
            return f"<Regularity: regular, by {len(self.heights or ())} heights>"
        return f"<Regularity: not regular, by the conditions of {len(self.multipliers or ())} facets>"

    def to_dict(self) -> dict[str, Any]:
        """Return the answer as plain data, numbers as exact texts."""
        return {
            "regular": self.regular,
            "heights": None if self.heights is None else [str(height) for height in self.heights],
            "multipliers": None
            if self.multipliers is None
            else [[list(facet), number_text(value)] for facet, value in self.multipliers],
        }


def regular(result: Source) -> Regularity:
    """Find heights for which the triangulation of a result is regular, or prove that there are none.

    Parameters
    ----------
    result : mapping, Result or path
        The data of a result file, what `bcut.solve` returned, or where the file is.

    Returns
    -------
    Regularity
        Heights and proofs have been checked exactly.

    Raises
    ------
    ResultError
        If it cannot be read, has no triangulation, or is about a region.
    VerificationError
        If its simplices are no triangulation.

    Examples
    --------
    >>> import bcut
    >>> bcut.regular(bcut.solve("cube:3")).regular
    True
    """
    plain, label = plain_data(result)
    if isinstance(plain, Mapping) and plain.get("kind") == "region":
        raise ResultError(
            f"{label}: is about a region, and only triangulations of point configurations can be regular; take a file "
            "as 'bcut solve --output' wrote it"
        )
    data, _ = load_result(result)
    if data.triangulation is None:
        raise ResultError(f"{label}: there is no triangulation in it; solve the instance first")
    points = ExactPoints([[parse_coordinate(text) for text in point] for point in data.points])
    try:
        simplices = check_triangulation(points, data.triangulation).simplices
    except VerificationError as error:
        raise VerificationError(f"{label}: only triangulations can be regular: {error}") from None
    return regularity(points, simplices)


def regularity(points: ExactPoints, simplices: Sequence[Simplex]) -> Regularity:
    """Decide whether a triangulation is regular.

    Parameters
    ----------
    points : ExactPoints
    simplices : sequence of tuple of int
        A triangulation.

    Raises
    ------
    SolverError
        If rounding what the linear program returned gives neither heights nor a proof.
    """
    found = folds(points, simplices)
    used = sorted({vertex for simplex in simplices for vertex in simplex})
    solution = _most_convex(found, used)
    # The conditions are homogeneous: the least fold is as large as it may be, 1, or cannot be positive.
    if not found or solution.x[-1] > 0.5:
        heights = _rounded_heights(points, simplices, found, dict(zip(used, solution.x[:-1], strict=True)))
        if heights is not None:
            return Regularity(True, heights=heights)
    else:
        multipliers = _exact_multipliers(found, used, np.abs(solution.duals[: len(found)]))
        if multipliers is not None:
            check_irregularity(points, simplices, dict(multipliers))
            return Regularity(False, multipliers=multipliers)
    raise SolverError("the linear program for heights was not solved accurately enough to tell either way")


def _most_convex(found: Sequence[Fold], used: Sequence[int]) -> LpSolution:
    """Maximise the least fold, at most 1, over heights that are not negative; rows are scaled."""
    import scipy.sparse as sp

    place = {point: column for column, point in enumerate(used)}
    matrix = np.zeros((len(found) + 1, len(used) + 1))
    for row, fold in enumerate(found):
        values = _scaled(fold)
        for point, value in values.items():
            matrix[row, place[point]] = value
        matrix[row, -1] = -1.0
    matrix[-1, -1] = 1.0
    costs = np.zeros(len(used) + 1)
    costs[-1] = -1.0
    lower = np.append(np.zeros(len(found)), -np.inf)
    upper = np.append(np.full(len(found), np.inf), 1.0)
    return solve_linear_program(LinearProgram(costs, sp.csr_matrix(matrix), lower, upper))


def _scaled(fold: Fold) -> dict[int, float]:
    """Return the dependence in floating point, divided by its largest coefficient."""
    largest = max(abs(value) for value in fold.dependence.values())
    return {
        point: float(Fraction(value) / largest if isinstance(value, int) else value / largest)
        for point, value in fold.dependence.items()
    }


def _rounded_heights(
    points: ExactPoints, simplices: Sequence[Simplex], found: Sequence[Fold], heights: dict[int, float]
) -> tuple[Fraction, ...] | None:
    """Round to the coarsest fractions that are still right, and lift unused points above all others."""
    for bits in range(_FINEST + 1):
        rounded = {point: Fraction(round(height * 2**bits), 2**bits) for point, height in heights.items()}
        if all(fold.at(rounded) > 0 for fold in found):
            above = max(rounded.values()) + 1
            complete = tuple(rounded.get(point, above) for point in range(points.n))
            check_heights(points, simplices, complete)
            return complete
    return None


def _exact_multipliers(
    found: Sequence[Fold], used: Sequence[int], duals: NDArray[np.float64]
) -> tuple[tuple[Simplex, Fraction | AlgebraicNumber], ...] | None:
    """Solve ``sum of y_F l_F = 0`` exactly on the support of the duals, the free unknowns being rounded duals."""
    support: list[int] = np.flatnonzero(duals > _NOISE * duals.max(initial=0.0)).tolist()
    if not support:
        return None
    # Duals belong to scaled rows.
    sizes = [max(abs(float(value)) for value in found[row].dependence.values()) for row in support]
    guesses = [Fraction(float(duals[row])) / Fraction(size) for row, size in zip(support, sizes, strict=True)]
    largest = max(guesses)
    guesses = [(guess / largest).limit_denominator(10**6) for guess in guesses]
    rows: list[list[Any]] = [
        [_exact(found[row].dependence.get(point, 0)) for row in support] for point in used
    ]
    echelon: list[tuple[int, list[Any]]] = []
    for row in rows:
        rest = row
        for column, pivot_row in echelon:
            factor = rest[column]
            if factor:
                rest = [value - factor * other for value, other in zip(rest, pivot_row, strict=True)]
        pivot = next((column for column, value in enumerate(rest) if value), None)
        if pivot is not None:
            echelon.append((pivot, [value / rest[pivot] for value in rest]))
    values: list[Any] = list(guesses)
    # Each pivot row says what its unknown is in terms of those that come later in the elimination or are free.
    for column, pivot_row in reversed(echelon):
        values[column] = Fraction(0)
        values[column] = -sum((a * b for a, b in zip(pivot_row, values, strict=True)), Fraction(0))
    if any(value < 0 for value in values) or not any(values):
        return None
    return tuple((found[row].facet, value) for row, value in zip(support, values, strict=True) if value)


def _exact(value: Any) -> Any:
    """Make integers rationals, so that they can be divided by."""
    return Fraction(value) if isinstance(value, int) else value

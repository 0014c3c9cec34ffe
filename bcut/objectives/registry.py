"""The measures that can be called by name, and the forms in which they hand over their costs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.errors import InputError
from bcut.geometry.configuration import PointConfiguration

Simplices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Ratios:
    """Exact costs over one denominator.

    Attributes
    ----------
    numerators : ndarray of int64 or of Python integers, shape (m,)
    denominator : int
        Positive.
    """

    numerators: NDArray[Any]
    denominator: int


Costs = NDArray[np.int64] | NDArray[np.float64] | Ratios | list[Fraction]
Measure = Callable[[PointConfiguration, Simplices, str], Costs]

MEASURES: dict[str, Measure] = {}


def measure(name: str) -> Callable[[Measure], Measure]:
    """Register a measure under the name that users write."""

    def register(function: Measure) -> Measure:
        MEASURES[name] = function
        return function

    return register


def refuse_argument(name: str, argument: str) -> None:
    """Refuse an argument that a measure does not take.

    Raises
    ------
    InputError
        There is one.
    """
    if argument:
        raise InputError(f"objective '{name}' takes no argument, but got '{argument}'")


def exact(costs: Costs) -> list[int | Fraction]:
    """Return costs one by one, exactly."""
    if isinstance(costs, Ratios):
        return [Fraction(value, costs.denominator) for value in costs.numerators.tolist()]
    if isinstance(costs, np.ndarray) and costs.dtype.kind == "f":
        return [Fraction(value) for value in costs.tolist()]
    return costs.tolist() if isinstance(costs, np.ndarray) else list(costs)

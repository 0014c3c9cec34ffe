"""Measures of d-simplices, by name. To add one: write a function below and register it.

A measure gets the configuration, some of its simplices and the text behind the colon, and returns one cost
for each: an array of int64, or a list of `Fraction`. Costs that are not rational are rounded to doubles, and
those are then taken exactly.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from fractions import Fraction
from math import comb
from pathlib import Path
from sys import float_info
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.errors import InputError
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.subsets import ranks

Simplices = NDArray[np.int64]
Costs = NDArray[np.int64] | list[Fraction]
Measure = Callable[[PointConfiguration, Simplices, str], Costs]

MEASURES: dict[str, Measure] = {}

# "source" and "known" are for people.
_KEYS = {"default", "costs", "source", "known"}

# A text such as "1e999999999" has a billion digits when it is written out.
_LONG_EXPONENT = re.compile(r"[eE][+-]?\d{4}")


def measure(name: str) -> Callable[[Measure], Measure]:
    """Register a measure under the name that users write."""

    def register(function: Measure) -> Measure:
        MEASURES[name] = function
        return function

    return register


@measure("cardinality")
def cardinality(configuration: PointConfiguration, simplices: Simplices, argument: str) -> Costs:
    """1 for every simplex: the number of simplices."""
    if argument:
        raise InputError(f"objective 'cardinality' takes no argument, but got '{argument}'")
    return np.ones(len(simplices), dtype=np.int64)


@measure("random-costs")
def random_costs(configuration: PointConfiguration, simplices: Simplices, argument: str) -> Costs:
    """Return doubles from ``numpy.random.default_rng(SEED).random(C(n, d+1))``, one per (d+1)-subset in colex order."""
    if not argument.isdecimal():
        raise InputError(
            f"objective 'random-costs:{argument}': write random-costs:SEED with a non-negative integer"
        )
    n = configuration.n
    drawn = np.random.default_rng(int(argument)).random(comb(n, configuration.dimension + 1))
    return [Fraction(value) for value in drawn[ranks(simplices, n)].tolist()]


@measure("costs")
def costs_from_file(configuration: PointConfiguration, simplices: Simplices, argument: str) -> Costs:
    """Costs from a JSON file ``{"default": 1, "costs": [[[0, 1, 2], 0], ...]}``.

    Costs are integers, doubles (taken exactly) or rationals as text, "p/q". Simplices that are listed but are
    no candidates (flat, or not empty when only empty ones are allowed) are ignored.
    """
    if not argument:
        raise InputError("objective 'costs': name the file, as in costs:my-costs.json")
    default, table = read_costs(Path(argument), configuration)
    return [table.get(tuple(simplex), default) for simplex in simplices.tolist()]


def read_costs(
    path: Path, configuration: PointConfiguration
) -> tuple[Fraction, dict[tuple[int, ...], Fraction]]:
    """Read a costs file: the default, and the exact cost of each listed simplex (ascending vertices)."""
    data = _read_json(path)
    if not isinstance(data, dict) or set(data) - _KEYS or "costs" not in data:
        raise InputError(f'costs file {path}: expected {{"default": 1, "costs": [[[0, 1, 2], 0], ...]}}')
    if not isinstance(data["costs"], list):
        raise InputError(f"costs file {path}: 'costs' must be a list of [simplex, cost] pairs")
    table: dict[tuple[int, ...], Fraction] = {}
    for number, entry in enumerate(data["costs"]):
        simplex, cost = _entry(entry, configuration, path, number)
        if simplex in table:
            raise InputError(f"costs file {path}: entry {number}: {list(simplex)} has a cost already")
        table[simplex] = cost
    return _cost(data.get("default", 1), path, "default"), table


def _read_json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"costs file {path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise InputError(f"costs file {path}: is not UTF-8 text") from None
    except json.JSONDecodeError as error:
        raise InputError(
            f"costs file {path}: line {error.lineno}, column {error.colno}: {error.msg}"
        ) from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"costs file {path}: cannot be read ({error})") from None


def _entry(
    entry: Any, configuration: PointConfiguration, path: Path, number: int
) -> tuple[tuple[int, ...], Fraction]:
    where = f"costs file {path}: entry {number}"
    if not (isinstance(entry, list) and len(entry) == 2 and isinstance(entry[0], list)):
        raise InputError(f"{where}: expected [[vertices], cost], not {json.dumps(entry)}")
    n, size = configuration.n, configuration.dimension + 1
    vertices = entry[0]
    if not all(isinstance(v, int) and not isinstance(v, bool) and 0 <= v < n for v in vertices):
        raise InputError(f"{where}: vertices are integers from 0 to {n - 1}, not {json.dumps(vertices)}")
    if len(set(vertices)) != size or len(vertices) != size:
        raise InputError(f"{where}: a simplex here has {size} distinct vertices, not {json.dumps(vertices)}")
    return tuple(sorted(vertices)), _cost(entry[1], path, f"entry {number}")


def _cost(value: Any, path: Path, where: str) -> Fraction:
    try:
        if isinstance(value, str) and (len(value) > 1000 or _LONG_EXPONENT.search(value)):
            raise OverflowError
        if isinstance(value, int | float | str) and not isinstance(value, bool):
            exact = Fraction(value)
            # Solvers work with doubles: a cost beyond their range is refused here.
            if not exact or abs(float(exact)) >= float_info.min:
                return exact
    except (ValueError, ZeroDivisionError, OverflowError):
        pass
    shown = json.dumps(value)
    shown = shown if len(shown) <= 60 else shown[:57] + "..."
    raise InputError(f'costs file {path}: {where}: a cost is a finite number or "p/q", not {shown}')

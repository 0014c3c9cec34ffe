"""Measures of d-simplices, by name or from a user's file. To add one: write a function here and register it.

A measure gets the configuration, some of its simplices and the text behind the colon, and returns one cost for each:
an array of int64, `Ratios`, or an array of doubles, which are taken exactly. The cost of a simplex must not depend on
which other simplices are asked for: verification asks again. Measures of lengths, volumes and angles are in
`bcut.objectives.geometric`.
"""

from __future__ import annotations

import difflib
import json
import re
from fractions import Fraction
from math import comb
from pathlib import Path
from sys import float_info
from typing import Any

import numpy as np

from bcut.errors import InputError
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.subsets import ranks
from bcut.objectives import geometric  # registers its measures
from bcut.objectives.registry import MEASURES, Costs, Measure, Simplices, exact, measure, refuse_argument
from bcut.objectives.syntax import FUNCTION, FunctionText, MeasureName
from bcut.objectives.user import costs_of_function

__all__ = [
    "MEASURES",
    "Costs",
    "Measure",
    "Simplices",
    "exact",
    "geometric",
    "measure",
    "measured",
    "read_costs",
]

# "source" and "known" are for people.
_KEYS = {"default", "costs", "source", "known"}

# A text such as "1e999999999" has a billion digits when it is written out.
_LONG_EXPONENT = re.compile(r"[eE][+-]?\d{4}")


def measured(text: str, configuration: PointConfiguration, simplices: Simplices) -> Costs:
    """Evaluate the measure that a user wrote: ``NAME``, ``NAME:ARGUMENT``, ``FILE.py[:FUNCTION]``, or a function.

    Parameters
    ----------
    text : str
    configuration : PointConfiguration
    simplices : ndarray of int, shape (m, d + 1)
        Ascending vertices, none flat.

    Raises
    ------
    InputError
        If there is no such measure, its argument does not fit, or a cost is beyond the range of doubles.
    ObjectiveError
        If a user's function raises, or returns something else than a finite cost for each simplex.
    """
    name = MeasureName.parse(text)
    if name.is_file or isinstance(text, FunctionText):
        return costs_of_function(text, configuration, simplices)
    refuse_unknown(name)
    costs = MEASURES[name.source](configuration, simplices, name.argument)
    if isinstance(costs, np.ndarray) and costs.dtype.kind == "f":
        beyond = np.flatnonzero(~np.isfinite(costs))
        if len(beyond):
            raise InputError(
                f"objective '{text}': the cost of simplex {simplices[beyond[0]].tolist()} of {configuration.name} is "
                "beyond the range of float64; scale the points"
            )
    return costs


def refuse_unknown(name: MeasureName) -> None:
    """Refuse a measure that is neither known by its name nor a file.

    Raises
    ------
    InputError
        With the name that may have been meant, or all that are known.
    """
    if name.is_file or name.source in MEASURES:
        return
    if name.source == FUNCTION:
        raise InputError(
            f"objective '{FUNCTION}:{name.argument}' is a function of a Python session, of which only the name is "
            f"known here; hand it to bcut.solve itself, or write it to a file, as in ./mine.py:{name.argument}"
        )
    near = difflib.get_close_matches(name.source, MEASURES, n=1)
    hint = (
        f"did you mean '{near[0]}'?"
        if near
        else f"known are {', '.join(sorted(MEASURES))}; a file is given by its path"
    )
    raise InputError(f"unknown objective '{name.source}': {hint}")


@measure("cardinality")
def cardinality(configuration: PointConfiguration, simplices: Simplices, argument: str) -> Costs:
    """1 for every simplex: the number of simplices."""
    refuse_argument("cardinality", argument)
    return np.ones(len(simplices), dtype=np.int64)


@measure("random-costs")
def random_costs(configuration: PointConfiguration, simplices: Simplices, argument: str) -> Costs:
    """Random numbers from 0 to 1, as random-costs:SEED.

    They are the doubles of ``numpy.random.default_rng(SEED).random(C(n, d+1))``, one per (d+1)-subset in colex order.
    """
    if not argument.isdecimal():
        raise InputError(
            f"objective 'random-costs:{argument}': write random-costs:SEED with a non-negative integer"
        )
    n = configuration.n
    drawn = np.random.default_rng(int(argument)).random(comb(n, configuration.dimension + 1))
    return drawn[ranks(simplices, n)]


@measure("costs")
def costs_from_file(configuration: PointConfiguration, simplices: Simplices, argument: str) -> Costs:
    """Costs from a JSON file {"default": 1, "costs": [[[0, 1, 2], 0], ...]}, as costs:FILE.

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

"""What the arguments of the public functions may be: each is read into a plain value, or refused by its name."""

from __future__ import annotations

import os
from collections.abc import Callable
from numbers import Integral, Real
from operator import index
from reprlib import repr as shortened
from typing import Any

import numpy as np

from bcut.errors import InputError
from bcut.objectives.syntax import objective_text
from bcut.separation.seam import Separator

# Each reader raises TypeError for what it cannot read.
Reader = Callable[[Any], Any]


def read_argument(name: str, value: Any) -> Any:
    """Return an argument as a plain value: NumPy's numbers as Python's, and what may stand alone in a list.

    Parameters
    ----------
    name : str
        Of a parameter of `bcut.solve`.
    value : object

    Raises
    ------
    InputError
        It is of another type.
    """
    reader, accepted = _ACCEPTED[name]
    try:
        return reader(value)
    except TypeError:
        raise InputError(f"{name}={shortened(value)}: give {accepted}") from None


def _optional(reader: Reader) -> Reader:
    return lambda value: None if value is None else reader(value)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


def _truth(value: Any) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise TypeError
    return bool(value)


def _integer(value: Any) -> int:
    if isinstance(value, bool):
        raise TypeError
    return index(value)


def _number(value: Any) -> int | float:
    if isinstance(value, bool) or not isinstance(value, Real):
        raise TypeError
    return int(value) if isinstance(value, Integral) else float(value)


def _formulation(value: Any) -> str:
    return value if isinstance(value, str) else str(_integer(value))


def _objectives(value: Any) -> tuple[str, ...]:
    alone = isinstance(value, str) or callable(value)
    return tuple(objective_text(objective) for objective in ([value] if alone else value))


def _separators(value: Any) -> tuple[Any, ...]:
    return (value,) if isinstance(value, str | Separator | type) else tuple(value)


def _rows(value: Any) -> tuple[Any, ...]:
    """Read a list of lists; what is in them is read where the points are known."""
    rows = () if isinstance(value, str) else tuple(value)
    if isinstance(value, str) or not all(hasattr(row, "__iter__") for row in rows):
        raise TypeError
    return rows


def _group(value: Any) -> Any:
    if isinstance(value, str | os.PathLike):
        return value
    return [[_integer(image) for image in images] for images in value]


def _order_or_group(value: Any) -> Any:
    return _integer(value) if isinstance(value, Integral) else _group(value)


def _callable(value: Any) -> Any:
    if not callable(value):
        raise TypeError
    return value


def _observer(value: Any) -> Any:
    for method in ("relaxed", "separated", "took"):
        _callable(getattr(value, method, None))
    return value


_FACES = "a list of faces, each a list of points, such as [[0, 1, 4]]"
_PERMUTATIONS = "the path of a file, or a list of permutations of the points, such as [[1, 0, 2, 3]]"

#: For each parameter: how it is read, and what to give in words.
_ACCEPTED: dict[str, tuple[Reader, str]] = {
    "objective": (objective_text, "a measure, such as 'weight', or a function"),
    "sense": (_optional(_text), "'min' or 'max'"),
    "then": (_objectives, "a list of objectives, such as ['cardinality', 'max:weight']"),
    "formulation": (_optional(_formulation), "'0', '1', '2' or 'chambers'"),
    "spanning": (_truth, "True or False"),
    "dissection": (_truth, "True or False"),
    "require": (_rows, _FACES),
    "forbid": (_rows, _FACES),
    "star": (_optional(_integer), "the number of a point"),
    "separators": (_optional(_separators), "a list of separators, such as ['link', './my_cuts.py']"),
    "time_limit": (_optional(_number), "a number of seconds"),
    "memory_limit": (_optional(_number), "a number of GiB"),
    "seed": (_integer, "an integer that is not negative"),
    "method": (_text, "the name of a method, such as 'auto'"),
    "symmetries": (_optional(_group), _PERMUTATIONS),
    "invariant_under": (_optional(_order_or_group), f"the order of a group, {_PERMUTATIONS}"),
    "on_progress": (_optional(_callable), "a function that takes a dict"),
    "cut_observer": (_optional(_observer), "an object with the methods relaxed, separated and took"),
    "only_bound": (_truth, "True or False"),
}

"""A user's objective: one function of the coordinates of simplices, in a file of its own or handed over from Python."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bcut.errors import ObjectiveError, ObjectiveLoadError
from bcut.files.plugins import guarded, import_file
from bcut.geometry.configuration import PointConfiguration
from bcut.objectives.registry import Costs, Ratios, Simplices
from bcut.objectives.syntax import FunctionText, MeasureName

# Integer costs up to this size stay in 64 bits.
_MAX_INTEGER = 1 << 40


def costs_of_function(text: str, configuration: PointConfiguration, simplices: Simplices) -> Costs:
    """Call the function that a user wrote as ``FILE.py`` or ``FILE.py:FUNCTION``, or handed over, with all simplices.

    Parameters
    ----------
    text : str
    configuration : PointConfiguration
    simplices : ndarray of int, shape (m, d + 1)

    Returns
    -------
    ndarray of int64 or float, or Ratios
        As the function returned it: integers stay integers, and doubles are taken exactly.

    Raises
    ------
    ObjectiveLoadError
        There is no such file or function.
    ObjectiveError
        It raised, or returned something else than a finite number for each simplex.
    """
    function = load_function(text)
    # Fancy indexing makes a fresh array, which the function may do with as it likes.
    coordinates = configuration.floats[simplices]
    name = getattr(function, "__name__", "function")
    result = guarded(lambda: np.asarray(function(coordinates)), ObjectiveError, text, f"{name}()")
    return _checked(text, name, result, simplices)


def load_function(text: str) -> Callable[[NDArray[np.float64]], Any]:
    """Return the function of an objective, which stands in a file unless it was handed over.

    Raises
    ------
    ObjectiveLoadError
        There is no such file, or no such function in it, or several and none is named.
    ObjectiveError
        The file raises when it is imported.
    """
    if isinstance(text, FunctionText):
        return text.function
    name = MeasureName.parse(text)
    path = Path(name.source)
    module = import_file(
        path,
        "objective",
        ObjectiveLoadError,
        lambda load: guarded(load, ObjectiveError, str(path), "loading it"),
    )
    return _function_of(module, path, name.argument)


def _function_of(module: ModuleType, path: Path, wanted: str) -> Callable[[NDArray[np.float64]], Any]:
    own = {
        name: value
        for name, value in vars(module).items()
        if inspect.isfunction(value) and value.__module__ == module.__name__ and not name.startswith("_")
    }
    if wanted:
        found = getattr(module, wanted, None)
        if not callable(found):
            known = f"; it has {', '.join(own)}" if own else ""
            raise ObjectiveLoadError(f"objective file {path}: it has no function '{wanted}'{known}")
        return found
    if len(own) == 1:
        return next(iter(own.values()))
    if not own:
        raise ObjectiveLoadError(
            f"objective file {path}: it defines no function; write one that takes the coordinates of m simplices, an "
            "array of shape (m, d + 1, d), and returns m costs"
        )
    raise ObjectiveLoadError(
        f"objective file {path}: it defines {', '.join(own)}; say which by {path}:FUNCTION, "
        "or begin the names of the others with an underscore"
    )


def _checked(text: str, name: str, result: NDArray[Any], simplices: Simplices) -> Costs:
    if result.shape != (len(simplices),):
        raise ObjectiveError(
            text,
            f"{name}() returned an array of shape {result.shape} for {len(simplices)} simplices; "
            f"expected ({len(simplices)},), one cost for each",
        )
    if result.dtype.kind in "biu":
        integers = result.astype(object)
        if all(abs(int(value)) <= _MAX_INTEGER for value in integers):
            return result.astype(np.int64)
        return Ratios(np.array([int(value) for value in integers], dtype=object), 1)
    if result.dtype.kind != "f":
        raise ObjectiveError(
            text, f"{name}() returned entries of type {result.dtype}; a cost is a real number"
        )
    with np.errstate(over="ignore"):
        costs = result.astype(np.float64)
    wrong = np.flatnonzero(~np.isfinite(costs))
    if len(wrong):
        first = int(wrong[0])
        raise ObjectiveError(
            text,
            f"{name}() returned {costs[first]} for simplex {simplices[first].tolist()}; a cost is a finite number",
        )
    return costs

"""One entry for every way of giving an instance: points, a path, a bundled data file, a family."""

from __future__ import annotations

import difflib
import importlib
import os
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from bcut.errors import InputError
from bcut.families import FAMILIES, build, is_family
from bcut.files import SUFFIXES, read_points, read_standard_input
from bcut.geometry.configuration import PointConfiguration


class ArrayLike(Protocol):
    """What NumPy can make an array of: an array, or a table of another library."""

    def __array__(self) -> Any:
        """Return the points, shape (n, d)."""


InstanceLike = str | os.PathLike[str] | PointConfiguration | ArrayLike | Sequence[Sequence[Any]]


def load_instance(instance: InstanceLike) -> PointConfiguration:
    """Load a point configuration.

    Parameters
    ----------
    instance : str, path, points or PointConfiguration
        A file (with a known suffix, or with a folder in front), the name of a bundled instance such as
        "pentagon-center", or a family such as "cube:4" or "random:30,3,seed=7"; "-" is JSON on standard input. Or the
        points themselves, as an array of shape (n, d) or as n sequences of d coordinates; see
        `PointConfiguration.from_values`. A configuration is returned as it is.

    Raises
    ------
    InputError
        There is nothing of that name, or it cannot be read, or the points are no configuration.
    """
    if isinstance(instance, PointConfiguration):
        return instance
    if isinstance(instance, str):
        return _named(instance)
    if isinstance(instance, os.PathLike):
        return read_points(instance)
    if isinstance(instance, Sequence):
        return PointConfiguration.from_values(instance)
    if hasattr(instance, "__array__"):
        return PointConfiguration.from_values(np.asarray(instance))
    raise InputError(
        f"an instance is a family such as 'cube:4', a bundled name, a path, points (an array of shape (n, d), or lists "
        f"of coordinates) or a bcut.PointConfiguration, not {type(instance).__name__}"
    )


def _named(text: str) -> PointConfiguration:
    """Load what a text names."""
    instances = importlib.import_module("bcut.instances")  # lives at the top level of the repository

    name = text.strip()
    if name == "-":
        return read_standard_input()
    looks_like_path = (
        os.path.splitext(name)[1].lower() in SUFFIXES or os.sep in name or (os.altsep or os.sep) in name
    )
    if name and not looks_like_path:
        if is_family(name):
            return build(name)
        if name in instances.names():
            return read_points(instances.path(name))
    if name and (looks_like_path or os.path.exists(name)):
        return read_points(name)
    head = name.partition(":")[0]
    close = difflib.get_close_matches(head, [*FAMILIES, *instances.names()], n=3)
    if close:
        raise InputError(f"there is no instance '{name[:80]}'; did you mean {' or '.join(close)}?")
    raise InputError(
        f"there is no instance '{name[:80]}'; an instance is a file ({', '.join(SUFFIXES)}), "
        f"a bundled name ({', '.join(instances.names())}) or a family ({', '.join(FAMILIES)})"
    )

"""One entry for every way of naming an instance: a path, a bundled data file, a family."""

from __future__ import annotations

import difflib
import importlib
import os

from bcut.errors import InputError
from bcut.families import FAMILIES, build, is_family
from bcut.files import SUFFIXES, read_points
from bcut.geometry.configuration import PointConfiguration


def load_instance(text: str | os.PathLike[str]) -> PointConfiguration:
    """Load a point configuration.

    Parameters
    ----------
    text : str or path
        A file (with a known suffix, or with a folder in front), the name of a bundled instance such as
        "pentagon-center", or a family such as "cube:4" or "random:30,3,seed=7".

    Raises
    ------
    InputError
        There is nothing of that name, or it cannot be read.
    """
    if isinstance(text, os.PathLike):
        return read_points(text)
    instances = importlib.import_module("bcut.instances")  # lives at the top level of the repository

    name = text.strip()
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

"""Data files that come with bcut: instances, a costs file, and known optima with their sources."""

from __future__ import annotations

import importlib.resources
from pathlib import Path

# Data that is no point configuration.
_OTHER = ("known-optima", "-costs", "-set")


def names() -> list[str]:
    """Names of the bundled instances, each a native JSON file."""
    return [name for name in _stems() if not name.endswith(_OTHER)]


def collections() -> list[str]:
    """Names of the bundled collections of instances with known optima, for experiments."""
    return [name for name in _stems() if name.endswith("-set")]


def path(name: str) -> Path:
    """Path of a bundled JSON file by its name without suffix: an instance, a costs file, a collection, "known-optima".

    Raises
    ------
    KeyError
        There is no such file.
    """
    if name not in _stems():
        raise KeyError(f"no bundled file '{name}'; there are {', '.join(_stems())}")
    return _folder() / f"{name}.json"


def _folder() -> Path:
    return Path(str(importlib.resources.files(__name__)))


def _stems() -> list[str]:
    return sorted(file.stem for file in _folder().glob("*.json"))

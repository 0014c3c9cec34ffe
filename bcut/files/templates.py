"""Python files that a user begins with: their names, and writing them."""

from __future__ import annotations

import re
from pathlib import Path

from bcut.errors import InputError
from bcut.files.atomic import write_new


def check_name(what: str, name: str, example: str) -> None:
    """Refuse a name that is no words of lower-case letters and digits, joined by hyphens.

    Raises
    ------
    InputError
    """
    if not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", name):
        raise InputError(
            f"{what} name '{name}': write words of lower-case letters and digits, joined by hyphens, such as {example}"
        )


def file_name(name: str) -> str:
    """Return what the file of something with this name is called."""
    return name.replace("-", "_") + ".py"


def write_file(name: str, text: str, directory: Path) -> Path:
    """Write the file of something with this name, which must not exist yet, and return its path.

    Raises
    ------
    InputError
        The file exists already, or cannot be written.
    """
    path = directory / file_name(name)
    write_new(path, text)
    return path

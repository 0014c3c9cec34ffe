"""Python files that a user begins with: their names, and writing them."""

from __future__ import annotations

import keyword
import re
import sys
from pathlib import Path

from bcut.errors import InputError
from bcut.files.atomic import write_new

# The name is that of a function or class and of a file: it must not hide what the file uses itself, nor a module, which
# Python may look for in the folder of the file first.
_TAKEN = frozenset({"np", "numpy", "bcut", "cut", "separator"}) | sys.stdlib_module_names


def check_name(what: str, name: str, example: str) -> None:
    """Refuse a name that is no words of lower-case letters and digits, joined by hyphens, or a word of Python's.

    Raises
    ------
    InputError
    """
    if not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", name):
        raise InputError(
            f"{what} name '{name}': write words of lower-case letters and digits, joined by hyphens, such as {example}"
        )
    if keyword.iskeyword(name) or keyword.iskeyword(name.capitalize()) or file_name(name)[:-3] in _TAKEN:
        raise InputError(
            f"{what} name '{name}': the word has a meaning in Python or in the file that would be written; "
            f"take another one, such as {example}"
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

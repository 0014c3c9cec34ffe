"""The measure that `bcut objectives new` writes: small, complete, and running as it is."""

from __future__ import annotations

from pathlib import Path

from bcut.errors import InputError
from bcut.files.templates import check_name, file_name, write_file
from bcut.objectives.measures import MEASURES

_TEMPLATE = '''\
"""The measure {name}.

Use it:  bcut solve random:12,3,seed=1 --spanning --objective ./{file}
         bcut solve random:12,3,seed=1 --spanning --objective min-max:./{file}
"""

import numpy as np


def {function}(simplices):
    """Longest edge of each simplex."""
    # simplices is an array of shape (m, d + 1, d): the coordinates of the vertices of m simplices. Return m finite
    # numbers; what a simplex costs must depend on its own coordinates only.
    edges = simplices[:, :, None, :] - simplices[:, None, :, :]
    return np.sqrt((edges**2).sum(axis=-1)).max(axis=(1, 2))
'''


def template(name: str) -> str:
    """Return the text of a new measure.

    Parameters
    ----------
    name : str
        Of the measure: words of lower-case letters and digits, joined by hyphens.

    Raises
    ------
    InputError
        If the name is of another form, or that of a built-in measure.
    """
    check_name("objective", name, "longest-edge")
    if name in MEASURES:
        raise InputError(f"objective name '{name}': a built-in measure has it; take another one")
    return _TEMPLATE.format(name=name, file=file_name(name), function=name.replace("-", "_"))


def write_template(name: str, directory: Path) -> Path:
    """Write the text of a new measure to a file, and return its path.

    Raises
    ------
    InputError
        If the name does not do, the file exists already, or it cannot be written.
    """
    return write_file(name, template(name), directory)

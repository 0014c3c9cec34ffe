"""NumPy's `.npy` files: one (n, d) array of integers or floats."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from bcut.errors import InputError
from bcut.files.contents import Contents
from bcut.files.text import read_bytes


def read(path: Path) -> Contents:
    """Return the array of the file; pickled objects are never loaded.

    Raises
    ------
    InputError
        Not an .npy file, or one that holds Python objects.
    """
    content = read_bytes(path)
    if not content.startswith((b"\x93NUMPY", b"PK")):
        raise InputError(f"{path}: not an .npy file; write it with numpy.save from an (n, d) array")
    try:
        array = np.load(io.BytesIO(content), allow_pickle=False)
    except (ValueError, OSError, EOFError, MemoryError, SyntaxError) as error:
        raise InputError(
            f"{path}: no readable .npy array of numbers ({error}); "
            "write it with numpy.save from an (n, d) array"
        ) from None
    if not isinstance(array, np.ndarray):
        raise InputError(f"{path}: an archive of several arrays; write a single array with numpy.save")
    return Contents(array)

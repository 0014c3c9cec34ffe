"""Symmetry generators as files: permutations of the points, each as the list of the images of 0, 1, ...

They are written `[[1,0,2,3],[0,1,3,2]]`, which is JSON and TOPCOM's way of writing them; in a `.dat` file they stand
behind the points.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

from bcut.errors import InputError
from bcut.files.text import read_text


def read_permutations(path: Path, n: int) -> list[list[int]]:
    """Read permutations of n points.

    Parameters
    ----------
    path : path
        With the suffix ``.dat``, a configuration in TOPCOM's format with generators behind its points; otherwise a
        file with the generators alone.
    n : int

    Raises
    ------
    InputError
        The file cannot be read, or holds something else.
    """
    text = re.sub(r"(?m)^\s*#.*$", "", read_text(path))
    if path.suffix.lower() == ".dat":
        text = _behind_the_points(text, path)
    try:
        listed = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"{path}: this is no list of permutations ({error}); write [[1,0,2,3],[0,1,3,2]]"
        ) from None
    if not isinstance(listed, list) or not all(isinstance(entry, list) for entry in listed):
        raise InputError(f"{path}: this is no list of permutations; write [[1,0,2,3],[0,1,3,2]]")
    for number, images in enumerate(listed):
        integral = all(isinstance(v, int) and not isinstance(v, bool) for v in images)
        if not integral or sorted(images) != list(range(n)):
            raise InputError(
                f"{path}: permutation {number} (counted from 0) does not have each of the {n} points 0 to {n - 1} once"
            )
    return listed


def _behind_the_points(text: str, path: Path) -> str:
    """Return what follows the first bracketed list."""
    depth = 0
    for position, character in enumerate(text):
        depth += (character == "[") - (character == "]")
        if character == "]" and depth == 0:
            rest = text[position + 1 :].strip()
            if rest:
                return rest
            break
    raise InputError(f"{path}: there are no symmetry generators behind the points; add [[1,0,2,3],[0,1,3,2]]")

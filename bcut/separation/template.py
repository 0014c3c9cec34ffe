"""The separator that `bcut separators new` writes: small, complete, and passing `bcut separators check`."""

from __future__ import annotations

from pathlib import Path

from bcut.errors import InputError
from bcut.files.templates import check_name, file_name, write_file
from bcut.separation.resolve import built_in_names

_TEMPLATE = '''\
"""Cuts of the family {name}.

Check it:  bcut separators check ./{file}
Use it:    bcut solve random:12,3,seed=1000 --spanning --separator ./{file}
"""

from itertools import combinations

from bcut import Cut, Separator


class {class_name}(Separator):
    """Of three simplices that cross each other pairwise, a triangulation contains at most one."""

    name = "{name}"

    def __init__(self, max_cuts: int = 20) -> None:
        # Parameters have defaults; on the command line: --separator ./{file}:max_cuts=5
        self.max_cuts = max_cuts

    def separate(self, point):
        # point.x has a value for each simplex, a row of vertices in self.problem.simplices. point.fractional
        # lists those strictly between 0 and 1, and point.crossings tells which of these cross.
        found = 0
        for i, j, k in combinations(range(len(point.fractional)), 3):
            if not (point.crossings[i, j] and point.crossings[i, k] and point.crossings[j, k]):
                continue
            simplices = point.fractional[[i, j, k]]
            if point.x[simplices].sum() > 1.0001:
                # x[simplices].sum() <= 1; say in the proof why that holds for every triangulation.
                yield Cut(simplices, 1, proof={{"crossing": simplices.tolist()}})
                found += 1
                if found == self.max_cuts:
                    return
'''


def template(name: str) -> str:
    """Return the text of a new separator.

    Parameters
    ----------
    name : str
        Of the family: words of lower-case letters and digits, joined by hyphens.

    Raises
    ------
    InputError
        If the name is of another form, or that of a built-in family.
    """
    check_name("separator", name, "my-cuts")
    if name in built_in_names():
        raise InputError(f"separator name '{name}': a built-in family has it; take another one")
    class_name = "".join(word.capitalize() for word in name.split("-"))
    return _TEMPLATE.format(name=name, file=file_name(name), class_name=class_name)


def write_template(name: str, directory: Path) -> Path:
    """Write the text of a new separator to a file, and return its path.

    Raises
    ------
    InputError
        If the name does not do, the file exists already, or it cannot be written.
    """
    return write_file(name, template(name), directory)

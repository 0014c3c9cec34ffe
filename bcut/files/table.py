"""Tables: one point a line, separated by commas, semicolons or white space, with an optional header."""

from __future__ import annotations

import csv
import re
from pathlib import Path

from bcut.errors import ConfigurationError, InputError
from bcut.files.contents import Contents
from bcut.files.text import read_text
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.expressions import Expression, parse_coordinate

# A header names the columns; "nan" is a bad coordinate, not a name.
_LABEL = re.compile(r"(?!(nan|inf|infinity)$)[a-z_][\w -]*", re.IGNORECASE)


def read(path: Path) -> Contents:
    """Points of a table; entries are coordinate texts. Lines that begin with # are skipped.

    Raises
    ------
    InputError
        An entry is no coordinate (line and column are named), or the rows differ in length.
    """
    lines = [
        (number, line.strip())
        for number, line in enumerate(read_text(path).splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    delimiter = next((mark for mark in ";,\t" if any(mark in line for _, line in lines)), None)
    rows = [(number, _entries(path, number, line, delimiter)) for number, line in lines]
    if rows and all(_LABEL.fullmatch(entry) for entry in rows[0][1]):
        rows = rows[1:]
    if not rows:
        raise InputError(f"{path}: there are no points; write one point a line, such as 0,1/2,sqrt(2)")
    width = len(rows[0][1])
    for number, entries in rows:
        if len(entries) != width:
            raise InputError(
                f"{path}: line {number} has {len(entries)} entries but line {rows[0][0]} has {width}; "
                "give every point the same number of coordinates"
            )
    return Contents(
        [
            [_coordinate(path, number, column, entry) for column, entry in enumerate(entries, start=1)]
            for number, entries in rows
        ]
    )


def format_points(configuration: PointConfiguration) -> str:
    """Return the file's text: one point a line, exact coordinates separated by commas."""
    return "".join(f"{','.join(point)}\n" for point in configuration.exact_points())


def _entries(path: Path, number: int, line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return line.split()
    try:
        entries = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True))
    except csv.Error as error:
        raise InputError(f"{path}: line {number}: {error}") from None
    return [entry.strip() for entry in entries]


def _coordinate(path: Path, number: int, column: int, entry: str) -> Expression:
    try:
        return parse_coordinate(entry)
    except ConfigurationError as error:
        raise InputError(f"{path}: line {number}, column {column}: {error}") from None

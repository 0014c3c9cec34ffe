"""TOPCOM's format: homogeneous coordinates `[[1,0,0],[1,1,0],...]`, then perhaps symmetry generators.

A configuration is homogeneous when some linear functional takes the value 1 on all its points. Where a column
is constantly 1 that column is the functional, and is dropped; otherwise the points, which lie in the
hyperplane where the functional is 1, are projected onto coordinates that keep their affine rank. That is an
affine isomorphism, so the triangulations are the same.
"""

from __future__ import annotations

import re
from fractions import Fraction
from pathlib import Path
from typing import NoReturn

from bcut.errors import ConfigurationError, InputError
from bcut.files.contents import Contents
from bcut.files.text import read_text
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.expressions import parse_coordinate
from bcut.geometry.rank import pivot_columns

_TOKEN = re.compile(r"[\[\]]|[^\[\],\s]+")
_NUMBER = re.compile(r"[+-]?[0-9]+(/[0-9]+)?", re.ASCII)


def read(path: Path) -> Contents:
    """Points of a TOPCOM file in affine coordinates; symmetry generators are ignored.

    Raises
    ------
    InputError
        Not of that form, or the points are not homogeneous.
    """
    points = _homogeneous(path, read_text(path))
    width = len(points[0]) if points else 0
    for index, point in enumerate(points):
        if len(point) != width:
            raise InputError(
                f"{path}: point {index} (counted from 0) has {len(point)} coordinates, point 0 has {width}; "
                "give every point the same number"
            )
    for column in reversed(range(width)):
        if all(point[column] == 1 for point in points):
            return Contents([[*point[:column], *point[column + 1 :]] for point in points])
    if points and width in pivot_columns([*point, Fraction(1)] for point in points):
        raise InputError(
            f"{path}: these are no homogeneous coordinates: no linear functional is 1 on all points; "
            "add a column of ones to affine coordinates"
        )
    base = points[0] if points else []
    kept = pivot_columns([a - b for a, b in zip(point, base, strict=True)] for point in points)
    return Contents([[point[column] for column in kept] for point in points])


def format_points(configuration: PointConfiguration) -> str:
    """Return the file's text: the coordinates, then a 1.

    Raises
    ------
    InputError
        A coordinate is irrational, which the format cannot hold.
    """
    if configuration.field.degree > 1:
        raise InputError(
            f"{configuration.name}: TOPCOM's format holds rational coordinates only; "
            "use json or csv for irrational ones"
        )
    rows = [f"[{','.join([*point, '1'])}]" for point in configuration.exact_points()]
    return "[" + ",\n ".join(rows) + "]\n"


def _homogeneous(path: Path, text: str) -> list[list[Fraction]]:
    """Return the first list of lists in the text."""

    def fail(problem: str, position: int) -> NoReturn:
        line = text.count("\n", 0, position) + 1
        raise InputError(f"{path}: line {line}: {problem}; write [[1,0,0],[1,1,0],[1,0,1]]")

    text = re.sub(r"(?m)^\s*#.*$", "", text)
    points: list[list[Fraction]] = []
    depth = 0
    for match in _TOKEN.finditer(text):
        token, position = match.group(), match.start()
        if token == "[":
            depth += 1
            if depth > 2:
                fail("too many opening brackets", position)
            if depth == 2:
                points.append([])
        elif token == "]":
            depth -= 1
            if depth < 0:
                fail("a closing bracket without an opening one", position)
            if depth == 0:
                return points
        elif depth < 2:
            fail(f"'{token[:40]}' stands outside a point", position)
        elif not _NUMBER.fullmatch(token):
            where = f"point {len(points) - 1}, coordinate {len(points[-1])} (both count from 0)"
            fail(f"{where}: '{token[:40]}' is neither an integer nor a rational p/q", position)
        else:
            try:
                points[-1].append(_rational(token))
            except ConfigurationError as error:
                fail(str(error), position)
    return fail("the list of points does not end" if points else "there is no list of points", len(text))


def _rational(token: str) -> Fraction:
    value = parse_coordinate(token)
    assert isinstance(value, Fraction)  # what the pattern lets through has no irrational part
    return value

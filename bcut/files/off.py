"""OFF: points of dimension 3 and the faces of a surface, as text.

This is a reader of its own since meshes come from programs that lose lines, and what is missing must not be made up
from the lines that follow, as readers for pictures do; and since the coordinates are texts, which are taken exactly.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

from bcut.errors import InputError
from bcut.files.contents import Contents
from bcut.files.lines import Line, Lines, count_of
from bcut.files.text import read_text
from bcut.geometry.configuration import PointConfiguration

# Texture coordinates, colours and normals may follow the coordinates of a vertex; a 4 or n in front of the word
# would stand for another dimension.
_HEAD = re.compile(r"(ST)?(C)?(N)?OFF")


def read(path: Path) -> Contents:
    """Vertices of the file in its order, none merged or dropped, and its faces.

    Raises
    ------
    InputError
        The file cannot be read, holds more or less than its head promises, or points of another dimension than 3.
    """
    lines = Lines(path, read_text(path), comment="#")
    head = next(lines, None) or Line(path, 1, [""])
    word = _HEAD.fullmatch(head.words[0])
    if word is None:
        raise InputError(
            f"{path}: the first line is '{head.text[:20]}', not OFF (points of dimension 3); use csv otherwise"
        )
    # The counts may stand behind the word, too; that of the edges means nothing, and some leave it out.
    counts = Line(path, head.number, head.words[1:]) if len(head.words) > 1 else next(lines, head)
    n, m = [*map(count_of, counts.words[:2]), None, None][:2]
    if n is None or m is None or len(counts.words) > 3:
        counts.refuse(
            f"the numbers of vertices, faces and edges are expected, such as 4 4 6, not '{counts.text[:20]}'"
        )
    promise = (
        f"line {counts.number} promises {_many(n, 'vertex', 'vertices')} and {_many(m, 'face', 'faces')}"
    )
    points = [_vertex(line, word, promise) for line in lines.upto(n, "vertex", promise)]
    faces = [_face(line, n, promise) for line in lines.upto(m, "face", promise)]
    lines.end(promise)
    return Contents(points, faces=faces)


def format_points(configuration: PointConfiguration, faces: Sequence[Sequence[int]]) -> str:
    """Return the text of an OFF file.

    Raises
    ------
    InputError
        If a coordinate is no double.
    """
    lines = ["OFF", f"{configuration.n} {len(faces)} 0"]
    for number, point in enumerate(configuration.scalars()):
        texts = []
        for value in point:
            if not isinstance(value, Fraction) or Fraction(float(value)) != value:
                raise InputError(
                    f"{configuration.name}: point {number} has a coordinate that OFF cannot hold exactly; take json"
                )
            texts.append(str(value.numerator) if value.denominator == 1 else repr(float(value)))
        lines.append(" ".join(texts))
    lines += [f"{len(face)} {' '.join(map(str, face))}" for face in faces]
    return "\n".join(lines) + "\n"


def _vertex(line: Line, word: re.Match[str], promise: str) -> list[Fraction]:
    """Return the coordinates on a line, which must have as many entries as the head's first word says."""
    textures, colours, normals = word.groups()
    most = 3 + (3 if normals else 0) + (4 if colours else 0) + (2 if textures else 0)
    least = 3 + (3 if normals else 0) + (2 if textures else 0)
    count = len(line.words)
    if not least <= count <= most:
        expected = f"{least} numbers" if least == most else f"{least} to {most} numbers"
        line.refuse(
            f"a vertex is expected, of {expected}, not the {count} in '{line.text[:40]}', as {promise}; "
            "is a line missing?"
        )
    return [line.coordinate(column) for column in range(3)]


def _face(line: Line, n: int, promise: str) -> list[int]:
    """Return the vertices on a line; a colour of up to four numbers may follow them."""
    # No line is both a vertex and a face, so that counts which are wrong are found out: a face has three vertices.
    size = count_of(line.words[0]) or 0
    if size < 3 or not 0 <= len(line.words) - 1 - size <= 4:
        line.refuse(
            f"a face is expected, the number of its vertices and then these, such as 3 0 1 2, not '{line.text[:40]}', "
            f"as {promise}"
        )
    return [line.index(column, n) for column in range(1, size + 1)]


def _many(count: int, one: str, more: str) -> str:
    return f"{count} {one if count == 1 else more}"

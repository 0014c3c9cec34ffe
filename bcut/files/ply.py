"""PLY: points of dimension 3 and the faces of a surface, as text or binary.

Text is read here, for the reasons that `bcut.files.off` gives; binary files, which hold float32 or float64 numbers,
are read by a library.
"""

from __future__ import annotations

import io
import warnings
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bcut.errors import InputError
from bcut.files.contents import Contents
from bcut.files.lines import Line, Lines, count_of
from bcut.files.text import decoded, read_bytes

_AXES = ("x", "y", "z")
_FACES = ("vertex_indices", "vertex_index")
_FORMATS = ("ascii", "binary_little_endian", "binary_big_endian")


@dataclass(slots=True)
class _Element:
    """A kind of things that the header declares.

    Attributes
    ----------
    name : str
    count : int
    promise : str
        Where and how it is declared, for messages.
    properties : list of (str, bool)
        The name of each, and whether it is a list, with its length in front.
    """

    name: str
    count: int
    promise: str
    properties: list[tuple[str, bool]] = field(default_factory=list)


def read(path: Path) -> Contents:
    """Vertices of the file in its order, none merged or dropped, and its faces.

    In a text, coordinates are what the text says, whether they are declared as float or as double. The faces are
    None where a binary file has some that are no triangles.

    Raises
    ------
    InputError
        The file cannot be read, holds more or less than its header promises, or points of another dimension than 3.
    """
    content = read_bytes(path)
    # Comments may be in any encoding.
    header = content.partition(b"\nend_header")[0].decode("utf-8", "replace")
    encoding, elements = _header(Lines(path, header))
    vertices = next((element for element in elements if element.name == "vertex"), None)
    names = [name for name, _ in vertices.properties] if vertices else []
    if vertices is None or not set(_AXES) <= set(names):
        raise InputError(
            f"{path}: the header declares no vertices with the properties x, y and z (points of dimension 3); "
            "use csv for others"
        )
    if encoding != "ascii":
        faces = sum(element.count for element in elements if element.name == "face")
        return _read_binary(path, content, vertices.count, faces)
    lines = Lines(path, decoded(content, str(path)))
    if not any(line.words == ["end_header"] for line in lines):
        raise InputError(f"{path}: the header does not end; is the file cut off?")
    return _read_text(lines, elements, vertices.count)


def _header(lines: Lines) -> tuple[str, list[_Element]]:
    """Return the encoding and the elements that a header declares."""
    first, second = next(lines, None), next(lines, None)
    if first is None or first.words != ["ply"]:
        shown = first.text[:20] if first else ""
        raise InputError(
            f"{lines.path}: the first line is '{shown}', not ply; does the suffix fit the contents?"
        )
    if (
        second is None
        or second.words[0] != "format"
        or second.words[1:2] not in [[name] for name in _FORMATS]
    ):
        (second or first).refuse(f"the format is expected next, one of {', '.join(_FORMATS)}")
    elements: list[_Element] = []
    for line in lines:
        match line.words:
            case ["comment" | "obj_info", *_]:
                pass
            case ["element", name, number] if (count := count_of(number)) is not None:
                elements.append(_Element(name, count, f"line {line.number} promises '{line.text[:40]}'"))
            case ["property", "list", _, _, name] if elements:
                elements[-1].properties.append((name, True))
            case ["property", _, name] if elements:
                elements[-1].properties.append((name, False))
            case _:
                line.refuse(
                    f"'{line.text[:40]}' is no line of a header, such as 'element vertex 4' or 'property double x'"
                )
    return second.words[1], elements


def _read_text(lines: Lines, elements: list[_Element], n: int) -> Contents:
    """Return what stands behind the header."""
    points, faces = [], []
    for element in elements:
        for line in lines.upto(element.count, element.name, element.promise):
            places = _places(line, element)
            if element.name == "vertex":
                points.append([line.coordinate(places[axis].start) for axis in _AXES])
            elif element.name == "face":
                faces += [
                    [line.index(column, n) for column in places[name]] for name in _FACES if name in places
                ]
    lines.end(elements[-1].promise)
    return Contents(points, faces=faces)


def _places(line: Line, element: _Element) -> dict[str, range]:
    """Return where the words of each property stand on a line, which must have as many as are declared."""
    places, position = {}, 0
    for name, is_list in element.properties:
        length = 1
        if is_list:
            length = count_of(line.words[position]) or 0 if position < len(line.words) else 0
            position += 1
        places[name] = range(position, position + length)
        position += length
    if position != len(line.words):
        names = " ".join(f"{name}[...]" if is_list else name for name, is_list in element.properties)
        line.refuse(
            f"'{line.text[:40]}' is no {element.name} with the properties {names[:60]}, as {element.promise}; "
            "is a line missing?"
        )
    return places


def _read_binary(path: Path, content: bytes, vertex_count: int, face_count: int) -> Contents:
    """Return what a binary file holds."""
    import trimesh

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            # Materials could make the library renumber the vertices.
            options = {"fix_texture": False, "skip_materials": True}
            loaded = trimesh.load(io.BytesIO(content), file_type="ply", process=False, **options)
            vertices = np.array(loaded.vertices, dtype=np.float64)
            faces = np.array(getattr(loaded, "faces", np.empty((0, 3))), dtype=np.int64)
    except Exception as error:  # the library fails in whatever way the damage makes it
        raise InputError(f"{path}: no readable PLY file ({error}); is it cut off?") from None
    if len(vertices) != vertex_count:
        raise InputError(
            f"{path}: {len(vertices)} vertices where the header promises {vertex_count}; is the file cut off?"
        )
    # The library divides faces with more vertices, and there are more of them then.
    divided = faces.shape[1:] != (3,) or len(faces) != face_count
    return Contents(vertices, faces=None if divided else faces.tolist())

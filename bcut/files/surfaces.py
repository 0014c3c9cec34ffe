"""Closed surfaces in files: OFF and PLY with faces, and native JSON with an entry ``faces``."""

from __future__ import annotations

import io
import json
import os
import re
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from bcut.errors import InputError
from bcut.files import clouds, native
from bcut.files.text import read_bytes, read_text
from bcut.geometry.configuration import PointConfiguration

#: Suffixes that `read_surface` understands.
SUFFIXES = (".off", ".ply", ".json")

_PLY_FACES = re.compile(rb"element\s+face\s+(\d+)")


def read_surface(path: str | os.PathLike[str]) -> tuple[PointConfiguration, list[list[int]]]:
    """Read points and faces; whether the faces bound a region is not checked.

    Parameters
    ----------
    path : path

    Returns
    -------
    PointConfiguration
    list of list of int
        The vertices of each face.

    Raises
    ------
    InputError
        The file cannot be read, or its faces are not triangles.
    ConfigurationError
        Its points are no configuration.
    """
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix == ".json":
        values, name = native.read(file)
        document = json.loads(read_text(file))
        faces: Any = document.get("faces") if isinstance(document, dict) else None
        if not isinstance(faces, list) or not all(isinstance(face, list) for face in faces):
            raise InputError(f'{file}: there is no surface in it; add "faces": [[0, 1, 2], ...]')
    elif suffix in (".off", ".ply"):
        (values, name), faces = clouds.read(file), _mesh_faces(file, suffix[1:])
    else:
        read_bytes(file)
        raise InputError(
            f"{file}: unknown suffix '{file.suffix}'; surfaces are read from {', '.join(SUFFIXES)}"
        )
    return PointConfiguration.from_values(values, name=name or file.stem, origin=str(file)), faces


def format_off(configuration: PointConfiguration, faces: Sequence[Sequence[int]]) -> str:
    """Return the text of an OFF file.

    Raises
    ------
    InputError
        If a coordinate is no double.
    """
    lines = ["OFF", f"{configuration.n} {len(faces)} 0"]
    for number, point in enumerate(configuration.scalars()):
        for value in point:
            if not isinstance(value, Fraction) or Fraction(float(value)) != value:
                raise InputError(
                    f"{configuration.name}: point {number} has a coordinate that OFF cannot hold exactly; take json"
                )
        texts = [
            str(value.numerator) if value.denominator == 1 else repr(float(value))
            for value in point
            if isinstance(value, Fraction)
        ]
        lines.append(" ".join(texts))
    lines += [f"{len(face)} {' '.join(map(str, face))}" for face in faces]
    return "\n".join(lines) + "\n"


def _mesh_faces(path: Path, kind: str) -> list[list[int]]:
    """Return the triangles of an OFF or PLY file whose points could be read."""
    import trimesh

    content = read_bytes(path)
    loaded = trimesh.load(io.BytesIO(content), file_type=kind, process=False)
    faces = np.asarray(getattr(loaded, "faces", np.empty((0, 3), dtype=np.int64)))
    if not len(faces):
        raise InputError(f"{path}: there are no faces in it, only points; give a closed surface of triangles")
    declared = _declared_faces(content, kind)
    if faces.shape[1:] != (3,) or (declared is not None and declared != len(faces)):
        raise InputError(
            f"{path}: the file has {declared} faces, which are not all triangles; divide them into triangles, "
            "since how they are divided matters"
        )
    return [[int(vertex) for vertex in face] for face in faces]


def _declared_faces(content: bytes, kind: str) -> int | None:
    """Return how many faces the head of a file promises."""
    if kind == "ply":
        match = _PLY_FACES.search(content)
        return int(match.group(1)) if match else None
    words = re.sub(rb"#[^\n]*", b"", content).split()
    return int(words[2]) if len(words) > 2 and words[2].isdigit() else None

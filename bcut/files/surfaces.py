"""Closed surfaces in files: OFF and PLY with faces, and native JSON with an entry ``faces``."""

from __future__ import annotations

import os
from pathlib import Path

from bcut.errors import InputError
from bcut.files import native, off, ply
from bcut.files.text import read_bytes
from bcut.geometry.configuration import PointConfiguration

_READERS = {".off": off.read, ".ply": ply.read, ".json": native.read}
#: Suffixes that `read_surface` understands.
SUFFIXES = tuple(_READERS)


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
    if suffix not in _READERS:
        read_bytes(file)  # a missing file or a directory is the better complaint
        raise InputError(
            f"{file}: unknown suffix '{file.suffix}'; surfaces are read from {', '.join(SUFFIXES)}"
        )
    contents = _READERS[suffix](file)
    faces = contents.faces
    if suffix == ".json":
        if not isinstance(faces, list) or not all(isinstance(face, list) for face in faces):
            raise InputError(f'{file}: there is no surface in it; add "faces": [[0, 1, 2], ...]')
    elif faces is None or any(len(face) != 3 for face in faces):
        wrong = next(
            (f" (face {k} has {len(face)})" for k, face in enumerate(faces or []) if len(face) != 3), ""
        )
        raise InputError(
            f"{file}: the faces are not all triangles{wrong}; divide them into triangles, since how they are "
            "divided matters"
        )
    elif not faces:
        raise InputError(f"{file}: there are no faces in it, only points; give a closed surface of triangles")
    return contents.configuration(str(file), file.stem), faces

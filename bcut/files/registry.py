"""The file formats by suffix."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

from bcut.errors import InputError
from bcut.files import arrays, native, off, ply, table, topcom
from bcut.files.atomic import check_writable, write_text
from bcut.files.contents import Contents
from bcut.files.text import decoded, read_bytes
from bcut.geometry.configuration import PointConfiguration

_READERS: dict[str, Callable[[Path], Contents]] = {
    ".json": native.read,
    ".dat": topcom.read,
    ".csv": table.read,
    ".npy": arrays.read,
    ".off": off.read,
    ".ply": ply.read,
}
_WRITERS: dict[str, Callable[[PointConfiguration], str]] = {
    "json": native.format_points,
    "dat": topcom.format_points,
    "csv": table.format_points,
}

#: Suffixes that `read_points` understands.
SUFFIXES = tuple(_READERS)
#: Formats that `write_points` understands; also their suffixes.
FORMATS = tuple(_WRITERS)
_SURFACES = ", and off for surfaces (`bcut generate`)"


def read_points(path: str | os.PathLike[str]) -> PointConfiguration:
    """Read a point configuration from a file; its suffix tells the format.

    Raises
    ------
    InputError
        The file is missing, a directory, empty, of an unknown suffix, or does not hold what its suffix says.
    ConfigurationError
        Its points are no configuration.
    """
    file = Path(path)
    reader = _READERS.get(file.suffix.lower())
    if reader is None:
        read_bytes(file)  # a missing file or a directory is the better complaint
        raise InputError(
            f"{file}: unknown suffix '{file.suffix}'; points are read from {', '.join(SUFFIXES)}"
        )
    return reader(file).configuration(str(file), file.stem)


def read_standard_input() -> PointConfiguration:
    """Read a point configuration in the native format, or a result file, from the standard input.

    Raises
    ------
    InputError
        It is empty, or holds something else.
    ConfigurationError
        Its points are no configuration.
    """
    origin = "standard input"
    content = sys.stdin.buffer.read() if sys.stdin is not None else b""
    if not content.strip():
        raise InputError(
            f"{origin}: it is empty; it should hold points as JSON, which `bcut generate` writes"
        )
    return native.parse(decoded(content, origin), origin).configuration(origin, "stdin")


def format_points(configuration: PointConfiguration, kind: str) -> str:
    """Return the text of a file of that format: "json", "dat" or "csv".

    Raises
    ------
    InputError
        There is no such format, or it cannot hold these points.
    """
    writer = _WRITERS.get(kind.lower())
    if writer is None:
        raise InputError(f"points cannot be written as '{kind}'; there are {', '.join(FORMATS)}{_SURFACES}")
    return writer(configuration)


def write_points(
    configuration: PointConfiguration, path: str | os.PathLike[str], *, kind: str | None = None
) -> None:
    """Write a configuration to a file, completely or not at all.

    Parameters
    ----------
    configuration : PointConfiguration
    path : path
        Where to; an existing file is replaced.
    kind : str, optional
        "json", "dat" or "csv"; the path's suffix if left out.

    Raises
    ------
    InputError
        The format is unknown or cannot hold these points, or the file cannot be written.
    """
    file = Path(path)
    check_writable(file)
    write_text(file, format_points(configuration, kind or file.suffix[1:]))

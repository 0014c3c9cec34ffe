"""OFF and PLY point clouds; faces are ignored."""

from __future__ import annotations

import io
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from bcut.errors import InputError
from bcut.files.text import read_bytes

_OFF_HEADER = re.compile(rb"(ST)?C?N?OFF\b")
_PLY_COUNT = re.compile(rb"element\s+vertex\s+(\d+)")


def read(path: Path) -> tuple[np.ndarray[Any, Any], str | None]:
    """Vertices of the file in its order, (n, 3) float64, none merged or dropped.

    Raises
    ------
    InputError
        The file cannot be read, is truncated, or holds points of another dimension than 3.
    """
    content = read_bytes(path)
    kind = path.suffix[1:].lower()
    first_line = next(
        (line.strip() for line in content.splitlines() if line.strip() and not line.strip().startswith(b"#")),
        b"",
    )
    if kind == "off" and not _OFF_HEADER.match(first_line):
        shown = first_line[:20].decode("ascii", "replace")
        raise InputError(
            f"{path}: the first line is '{shown}', not OFF (points of dimension 3); use csv otherwise"
        )
    import trimesh

    # Materials could make the library renumber the vertices.
    options = {"fix_texture": False, "skip_materials": True} if kind == "ply" else {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # older NumPy only warns about entries that are no numbers
            loaded = trimesh.load(io.BytesIO(content), file_type=kind, process=False, **options)
            vertices = np.array(loaded.vertices, dtype=np.float64)
    except Exception as error:  # the readers fail in whatever way the damage makes them
        raise InputError(f"{path}: no readable {kind.upper()} file ({error})") from None
    declared = _PLY_COUNT.search(content) if kind == "ply" else None
    if declared and len(vertices) != int(declared.group(1)):
        raise InputError(
            f"{path}: {len(vertices)} vertices where the header promises {int(declared.group(1))}; "
            "is the file cut off?"
        )
    return vertices, None

"""Texts of files of points, for tests that read them."""

from __future__ import annotations

from pathlib import Path

PLY_HEADER = (
    "ply\nformat {encoding} 1.0\nelement vertex 4\n"
    "property {kind} x\nproperty {kind} y\nproperty {kind} z\nend_header\n"
)
PLY = PLY_HEADER.format(encoding="ascii", kind="double")
PLY_FACES = PLY.replace("end_header", "element face 1\nproperty list uchar int vertex_indices\nend_header")
ROWS = ("0 0 0\n", "1 0 0\n", "0 1 0\n", "0 0 1\n")


def written(tmp_path: Path, name: str, content: str | bytes) -> Path:
    path = tmp_path / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path

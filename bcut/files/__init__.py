"""Point configurations in files: native JSON, TOPCOM, tables, NumPy arrays, OFF and PLY."""

from bcut.files.registry import (
    FORMATS,
    SUFFIXES,
    format_points,
    read_points,
    read_standard_input,
    write_points,
)

__all__ = ["FORMATS", "SUFFIXES", "format_points", "read_points", "read_standard_input", "write_points"]

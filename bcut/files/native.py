"""The native format: JSON `{"schema": 1, "name": ..., "points": [[...], ...]}`, or the points alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from bcut.errors import InputError
from bcut.files.text import read_text
from bcut.geometry.configuration import PointConfiguration

SCHEMA = 1
_FORM = '{"schema": 1, "name": "...", "points": [[0, 0], ["1/2", "sqrt(3)/2"], ...]}'


def read(path: Path) -> tuple[Any, str | None]:
    """Points and name of a native file.

    Raises
    ------
    InputError
        Not JSON (the line and column are named), or of another form.
    """
    text = read_text(path)
    try:
        document = json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(
            f"{path}: line {error.lineno}, column {error.colno}: not JSON: {error.msg}"
        ) from None
    except (ValueError, RecursionError):  # integers beyond Python's digit limit; lists nested without end
        raise InputError(f"{path}: the JSON holds too long a number or is nested too deeply") from None
    if isinstance(document, list):
        return document, None
    if not isinstance(document, dict):
        raise InputError(f"{path}: the file holds {type(document).__name__}, not points; write {_FORM}")
    if document.get("schema", SCHEMA) != SCHEMA:
        raise InputError(
            f"{path}: schema {document['schema']!r} is unknown; this version reads schema {SCHEMA}"
        )
    if "points" not in document:
        raise InputError(f'{path}: the key "points" is missing; write {_FORM}')
    name = document.get("name")
    if name is not None and not isinstance(name, str):
        raise InputError(f'{path}: "name" must be a text, not {name!r}')
    return document["points"], name or None


def format_points(configuration: PointConfiguration) -> str:
    """Return the file's text; integers as JSON integers, everything else as exact texts."""
    rows = [
        json.dumps([int(value) if value.lstrip("-").isdigit() else value for value in point])
        for point in configuration.exact_points()
    ]
    points = ",\n    ".join(rows)
    head = f'"schema": {SCHEMA},\n  "name": {json.dumps(configuration.name)}'
    return f'{{\n  {head},\n  "points": [\n    {points}\n  ]\n}}\n'

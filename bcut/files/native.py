"""The native format: JSON `{"schema": 1, "name": ..., "points": [[...], ...]}`, or the points alone.

A result file holds its instance, and is read as that instance.
"""

from __future__ import annotations

import json
from pathlib import Path

from bcut.errors import ConfigurationError, InputError
from bcut.files.contents import Contents
from bcut.files.text import read_text
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.expressions import double_of

SCHEMA = 1
_FORM = '{"schema": 1, "name": "...", "points": [[0, 0], ["1/2", "sqrt(3)/2"], ...]}'


def read(path: Path) -> Contents:
    """Points, name and faces of a native file or of a result file.

    Raises
    ------
    InputError
        Not JSON (the line and column are named), or of another form.
    """
    return parse(read_text(path), str(path))


def parse(text: str, origin: str) -> Contents:
    """Points, name and faces of a native file's text; `origin` is what messages call it.

    Raises
    ------
    InputError
        Not JSON (the line and column are named), or of another form.
    """
    try:
        document = json.loads(text, parse_float=_decimal)
    except json.JSONDecodeError as error:
        raise InputError(
            f"{origin}: line {error.lineno}, column {error.colno}: not JSON: {error.msg}"
        ) from None
    except (ValueError, RecursionError):  # integers beyond Python's digit limit; lists nested without end
        raise InputError(f"{origin}: the JSON holds too long a number or is nested too deeply") from None
    if isinstance(document, list):
        return Contents(document)
    if not isinstance(document, dict):
        raise InputError(f"{origin}: the file holds {type(document).__name__}, not points; write {_FORM}")
    if document.get("schema", SCHEMA) != SCHEMA:
        raise InputError(
            f"{origin}: schema {document['schema']!r} is unknown; this version reads schema {SCHEMA}"
        )
    instance, digest = document, None
    result = document.get("instance")
    if "points" not in document and isinstance(result, dict) and "points" in result:
        instance, digest = result, result.get("digest")
        if not isinstance(digest, str):
            raise InputError(f"{origin}: instance.digest is missing, which a result file has; write {_FORM}")
    if "points" not in instance:
        raise InputError(f'{origin}: the key "points" is missing; write {_FORM}')
    name = instance.get("name")
    if name is not None and not isinstance(name, str):
        raise InputError(f'{origin}: "name" must be a text, not {name!r}')
    return Contents(instance["points"], name or None, instance.get("faces"), digest)


def _decimal(text: str) -> float | str:
    """Return the double that a JSON number stands for; as a text what none does, to be refused where it stands."""
    try:
        return double_of(text)
    except ConfigurationError:
        return text


def format_points(configuration: PointConfiguration) -> str:
    """Return the file's text; integers as JSON integers, everything else as exact texts."""
    rows = [
        json.dumps([int(value) if value.lstrip("-").isdigit() else value for value in point])
        for point in configuration.exact_points()
    ]
    points = ",\n    ".join(rows)
    head = f'"schema": {SCHEMA},\n  "name": {json.dumps(configuration.name)}'
    return f'{{\n  {head},\n  "points": [\n    {points}\n  ]\n}}\n'

"""Entries of a result file taken out with their types checked; where one does not fit, it is named."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any, NoReturn

from bcut.errors import ResultError
from bcut.verification.exact_points import Simplex

MEND = "take the file as 'bcut solve --output' wrote it, or solve the instance again"
_RATIONAL = re.compile(r"[+-]?\d{1,4000}(/\d{1,4000}|(\.\d{1,4000})?([eE][+-]?\d{1,3})?)")


@dataclass(frozen=True)
class FileNumber:
    """A number as a result file holds it: exact, or a double that stands for a number nearby."""

    exact: Fraction
    is_double: bool


class EntryReader:
    """Takes entries out of a result; names the result and the entry where one does not fit."""

    def __init__(self, label: str) -> None:
        self.label = label

    def refuse(self, where: str, expected: str, found: Any) -> NoReturn:
        """Raise a `ResultError` that names the result, the entry, and what belongs there."""
        place = f"'{where}': " if where else ""
        raise ResultError(f"{self.label}: {place}{expected}, not {shown(found)}; {MEND}")

    def entry(self, data: Mapping[str, Any], where: str) -> Any:
        """Return an entry by its path, of which the last part is its key."""
        key = where.rpartition(".")[2]
        if key not in data:
            raise ResultError(f"{self.label}: has no entry '{where}'; {MEND}")
        return data[key]

    def mapping(self, data: Mapping[str, Any], where: str) -> Mapping[str, Any]:
        """Return an entry that is a JSON object."""
        value = self.entry(data, where)
        if not isinstance(value, Mapping):
            self.refuse(where, "this is a JSON object", value)
        return value

    def text(self, data: Mapping[str, Any], where: str) -> str:
        """Return an entry that is a text."""
        value = self.entry(data, where)
        if not isinstance(value, str):
            self.refuse(where, "this is a text", value)
        return value

    def boolean(self, data: Mapping[str, Any], where: str) -> bool:
        """Return an entry that is true or false."""
        value = self.entry(data, where)
        if not isinstance(value, bool):
            self.refuse(where, "this is true or false", value)
        return value

    def flag(self, data: Mapping[str, Any], where: str) -> bool:
        """Read a truth value that older files lack."""
        return self.boolean(data, where) if where.rpartition(".")[2] in data else False

    def choice(self, data: Mapping[str, Any], where: str, known: tuple[str, ...]) -> str:
        """Return an entry that is one of several words."""
        value = self.entry(data, where)
        if value not in known:
            self.refuse(where, f"this is one of {', '.join(known)}", value)
        return str(value)

    def integer(self, value: Any, where: str) -> int:
        """Return a value that is an integer."""
        if not isinstance(value, int) or isinstance(value, bool):
            self.refuse(where, "this is an integer", value)
        return value

    def list_of(self, value: Any, where: str, expected: str) -> list[Any]:
        """Return a value that is a list."""
        if not isinstance(value, list | tuple):
            self.refuse(where, expected, value)
        return list(value)

    def number(self, value: Any, where: str) -> FileNumber:
        """Read an integer, a double, or a rational as text."""
        if isinstance(value, float) and value - value == 0:
            return FileNumber(Fraction(value), is_double=True)
        if isinstance(value, int) and not isinstance(value, bool):
            return FileNumber(Fraction(value), is_double=False)
        if not isinstance(value, str):
            self.refuse(where, 'this is a finite number, or a rational as text ("69/2")', value)
        return FileNumber(self.rational(value, where), is_double=False)

    def optional_number(self, data: Mapping[str, Any], where: str) -> FileNumber | None:
        """Return an entry that is a number or null."""
        value = self.entry(data, where)
        return None if value is None else self.number(value, where)

    def rational(self, value: Any, where: str) -> Fraction:
        """Return a value that is a rational as text."""
        try:
            if not isinstance(value, str) or not _RATIONAL.fullmatch(value):
                raise ValueError
            return Fraction(value)
        except (ValueError, ZeroDivisionError):
            self.refuse(where, 'this is a rational as text ("69/2")', value)

    def vertices(self, value: Any, where: str) -> list[int]:
        """Return a value that is a list of vertices."""
        return [self.integer(v, where) for v in self.list_of(value, where, "this is a list of vertices")]

    def ascending(self, value: Any, where: str) -> Simplex:
        """Read a set of vertices that is written in ascending order, each once."""
        vertices = tuple(self.vertices(value, where))
        if any(a >= b for a, b in pairwise(vertices)):
            self.refuse(where, "vertices are ascending here", value)
        return vertices

    def pair(self, value: Any, where: str, expected: str) -> tuple[Any, Any]:
        """Return a value that is a list of two."""
        entries = self.list_of(value, where, expected)
        if len(entries) != 2:
            self.refuse(where, expected, value)
        return entries[0], entries[1]


def shown(value: Any) -> str:
    """Return a value as it may stand in a message."""
    try:
        text = json.dumps(value)
    except (TypeError, ValueError):
        text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."

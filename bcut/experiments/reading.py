"""Reading TOML and JSON that people write: every complaint names the file, the line, the key and what is known."""

from __future__ import annotations

import difflib
import json
import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NoReturn

from bcut.errors import PlanError

_HEADER = re.compile(r"\s*(\[\[?)\s*([\w.-]+)\s*\]\]?")
_KEY = re.compile(r"\s*\"?([\w-]+)\"?\s*=")


class Lines:
    """Where the keys of a TOML file stand.

    Parameters
    ----------
    text : str
    """

    def __init__(self, text: str) -> None:
        self.at: dict[tuple[str, int, str], int] = {}
        header, count = "", {"": 0}
        for number, line in enumerate(text.splitlines(), 1):
            found = _HEADER.match(line)
            if found:
                header = found[2]
                # A table below a list of tables belongs to the last one of it.
                parent = header.rpartition(".")[0]
                repeated = found[1] == "[["
                count[header] = count.get(header, -1) + 1 if repeated else count.get(parent, 0)
                self.at.setdefault((header, count[header], ""), number)
            elif key := _KEY.match(line):
                self.at.setdefault((header, count[header], key[1]), number)

    def find(self, table: str, index: int, key: str) -> int | None:
        """Return the line of a key, else that of its table's header."""
        return self.at.get((table, index, key), self.at.get((table, index, "")))


class Table:
    """One table of a file; takes typed entries out of it, and complains about what is left.

    Parameters
    ----------
    entries : mapping
    label : str
        What to call the file.
    name : str
        Of the table, such as "variants"; empty at the top of the file.
    index : int
        Its place in a list of tables.
    lines : Lines, optional
    """

    def __init__(
        self,
        entries: Mapping[str, Any],
        label: str,
        name: str = "",
        index: int = 0,
        lines: Lines | None = None,
    ) -> None:
        self.entries, self.label, self.name, self.index, self.lines = entries, label, name, index, lines
        self.seen: set[str] = set()

    def refuse(self, key: str, problem: str) -> NoReturn:
        """Complain about an entry."""
        line = self.lines.find(self.name, self.index, key) if self.lines is not None else None
        where = self.label + (f", line {line}" if line else "")
        place = f"[[{self.name}]] number {self.index + 1}" if self.name else ""
        raise PlanError(
            f"{where}: " + ", ".join(part for part in (place, f"'{key}'") if part) + f" {problem}"
        )

    def known(self, *keys: str) -> None:
        """Refuse keys that nobody asks for."""
        for key in self.entries:
            if key not in keys:
                near = difflib.get_close_matches(key, keys, n=1)
                hint = f"did you mean '{near[0]}'? " if near else ""
                self.refuse(key, f"is no known key; {hint}known here are {', '.join(keys)}")

    def text(self, key: str, default: str | None = None, *, choices: Iterable[str] = ()) -> str:
        """Return a text."""
        value = self.entries.get(key, default)
        if not isinstance(value, str) or not value:
            self.refuse(key, "is missing" if key not in self.entries else f"is a text, not {value!r}")
        known = list(choices)
        if known and value not in known:
            self.refuse(key, f"is one of {', '.join(known)}, not '{value}'")
        return value

    def flag(self, key: str, default: bool) -> bool:
        """Return true or false."""
        value = self.entries.get(key, default)
        if not isinstance(value, bool):
            self.refuse(key, f"is true or false, not {value!r}")
        return value

    def number(self, key: str, default: float | None, *, least: float = 0.0) -> float | None:
        """Return a number, or None where there is none and no default."""
        value = self.entries.get(key, default)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value < 1e18:
            self.refuse(key, f"is a number from {least:g} on, not {value!r}")
        return value

    def texts(self, key: str, default: Iterable[str] = ()) -> tuple[str, ...]:
        """Return a list of texts."""
        value = self.entries.get(key, list(default))
        if not isinstance(value, list) or not all(isinstance(entry, str) and entry for entry in value):
            self.refuse(key, f"is a list of texts, not {value!r}")
        return tuple(value)

    def tables(self, key: str) -> list[Table]:
        """Return the tables of a list of tables."""
        value = self.entries.get(key, [])
        if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
            self.refuse(key, f"is a list of tables: write [[{key}]]")
        return [Table(entry, self.label, key, index, self.lines) for index, entry in enumerate(value)]


def read_toml(path: Path) -> tuple[Table, str]:
    """Read a TOML file; returns its top table and its text.

    Raises
    ------
    PlanError
        It cannot be read, or is no TOML.
    """
    text = _text(path)
    try:
        return Table(tomllib.loads(text), str(path), lines=Lines(text)), text
    except tomllib.TOMLDecodeError as error:
        raise PlanError(f"{path}: is no TOML: {error}") from None


def read_json(path: Path) -> Any:
    """Read a JSON file.

    Raises
    ------
    PlanError
        It cannot be read, or is no JSON.
    """
    try:
        return json.loads(_text(path))
    except json.JSONDecodeError as error:
        raise PlanError(f"{path}, line {error.lineno}: is no JSON: {error.msg}") from None


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise PlanError(f"{path}: there is no such file") from None
    except OSError as error:
        raise PlanError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise PlanError(f"{path}: is not UTF-8 text") from None

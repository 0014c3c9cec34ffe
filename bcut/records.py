"""Records: dataclasses that a result file is made of, shown briefly, and made again of plain data."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import MISSING, fields, is_dataclass
from reprlib import Repr
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from bcut.errors import ResultError
from bcut.verification.entries import EntryReader
from bcut.verification.reading import Source, plain_data

Made = TypeVar("Made")

_BRIEF = Repr()
_BRIEF.maxother = _BRIEF.maxstring = 80
_BRIEF.maxlist = _BRIEF.maxdict = _BRIEF.maxlevel = 3

#: What a value of a plain type is called in messages, and what it may be.
_PLAIN: dict[Any, tuple[str, tuple[type, ...]]] = {
    bool: ("true or false", (bool,)),
    int: ("an integer", (int,)),
    float: ("a number", (int, float)),
    str: ("a text", (str,)),
}


class Record:
    """A dataclass whose text stays short, however long its lists are."""

    def __repr__(self) -> str:
        parts = (f"{name}={_BRIEF.repr(value)}" for name, value in vars(self).items())
        return f"{type(self).__name__}({', '.join(parts)})"


def load_record(kind: type[Made], source: Source, *, schema: int, about: str | None = None) -> Made:
    """Make a result of what was written of it.

    Parameters
    ----------
    kind : type
        A dataclass. Its annotations tell what may stand in the file: plain types, `Literal`, lists, dicts and
        dataclasses of these, and unions.
    source : mapping or path
        The data of a result file, or where the file is.
    schema : int
        That this version reads.
    about : str, optional
        What the entry ``kind`` of the file says; there is no such entry without it.

    Raises
    ------
    ResultError
        It cannot be read, is about something else, belongs to another schema, lacks an entry, has one of the wrong type
        or one that is unknown.
    """
    data, label = plain_data(source)
    reader = _RecordReader(label)
    if not isinstance(data, Mapping):
        reader.refuse("", "a result is a JSON object", data)
    if data.get("kind") != about:
        known = "a triangulation" if about is None else f"a {about}"
        raise ResultError(
            f"{label}: is not about {known} (see its entry 'kind'); `bcut verify` takes results of both kinds"
        )
    if reader.entry(data, "schema") != schema:
        raise ResultError(
            f"{label}: has schema {data['schema']!r:.60}, but this version of bcut reads schema {schema}; read it with "
            "the version that wrote it (see its entry 'versions')"
        )
    return reader.record(kind, deepcopy(data), "")


class _RecordReader(EntryReader):
    """Makes records; names the result and the entry where one does not fit."""

    def record(self, kind: type[Made], data: Any, where: str) -> Made:
        """Make a dataclass of a mapping."""
        if not isinstance(data, Mapping):
            self.refuse(where, "this is a JSON object", data)
        prefix = f"{where}." if where else ""
        hints = get_type_hints(kind)
        values = {}
        for entry in fields(kind):  # type: ignore[arg-type]
            optional = entry.default is not MISSING or entry.default_factory is not MISSING
            if entry.name not in data and optional:  # older files lack it
                continue
            place = prefix + entry.name
            values[entry.name] = self.value(hints[entry.name], self.entry(data, place), place)
        for name in data:
            if name not in hints:
                raise ResultError(
                    f"{self.label}: has an entry '{prefix}{name}', which this version of bcut does not know; read it "
                    "with the version that wrote it (see its entry 'versions')"
                )
        return kind(**values)

    def value(self, hint: Any, value: Any, where: str) -> Any:
        """Return a value that an annotation allows."""
        if hint is Any:
            return value
        if is_dataclass(hint) and isinstance(hint, type):
            return self.record(hint, value, where)
        origin, arguments = get_origin(hint), get_args(hint)
        if origin in (Union, UnionType):
            return self._one_of(arguments, value, where)
        if origin is Literal:
            if not isinstance(value, str) or value not in arguments:
                self.refuse(where, f"this is one of {', '.join(arguments)}", value)
            return value
        if origin is list:
            listed = self.list_of(value, where, "this is a list")
            return [
                self.value(arguments[0], item, f"{where}[{number}]") for number, item in enumerate(listed)
            ]
        if origin is dict:
            if not isinstance(value, Mapping):
                self.refuse(where, "this is a JSON object", value)
            return {key: self.value(arguments[1], item, f"{where}.{key}") for key, item in value.items()}
        name, allowed = _PLAIN[hint]
        if not isinstance(value, allowed) or (isinstance(value, bool) and hint is not bool):
            self.refuse(where, f"this is {name}", value)
        return value

    def _one_of(self, hints: tuple[Any, ...], value: Any, where: str) -> Any:
        """Return a value that one of several annotations allows: None, and the widest of the others."""
        if value is None and NoneType in hints:
            return None
        # All unions of results are of None and one type, or of None and numbers, of which the last is the widest.
        return self.value([hint for hint in hints if hint is not NoneType][-1], value, where)

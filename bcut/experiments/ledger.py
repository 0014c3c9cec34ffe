"""Ledgers: every cut of a run, one JSON object a line, compressed by gzip.

The first line is the problem, exact; the last one the relaxation that the run ended with. Between them stand the
cuts as they were found, the fractional points that they were found for, and, where columns had been fixed before,
which simplices were left ("part"). `docs/experiments.md` describes the entries.
"""

from __future__ import annotations

import gzip
import io
import json
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import NoneType
from typing import Any

from bcut.errors import LedgerError

SCHEMA = 1
SUFFIX = ".cuts.jsonl.gz"


class LedgerWriter:
    """Compresses entries as they come.

    Parameters
    ----------
    header : dict
        The first line, without "record" and "schema".
    """

    def __init__(self, header: dict[str, Any]) -> None:
        self._buffer = io.BytesIO()
        # Without a time in it, equal runs give equal files.
        self._stream = gzip.GzipFile(fileobj=self._buffer, mode="wb", mtime=0)
        self.write({"record": "header", "schema": SCHEMA, **header})

    def write(self, entry: dict[str, Any]) -> None:
        """Add a line."""
        text = json.dumps(entry, separators=(",", ":"), allow_nan=False, default=_plain)
        self._stream.write(text.encode() + b"\n")

    def finish(self) -> bytes:
        """Return the whole file."""
        self._stream.close()
        return self._buffer.getvalue()


def _plain(value: Any) -> Any:
    """Return what a proof may hold besides JSON's types: numbers and arrays of numpy, rationals."""
    if hasattr(value, "tolist"):
        return value.tolist()
    return str(value)


@dataclass
class Ledger:
    """A ledger in memory.

    Attributes
    ----------
    header : dict
    cuts : list of dict
        In the order in which they were found; "final" says whether the last relaxation has the cut.
    points : list of dict
    parts : dict of int to list of list of int
        Simplices that were left, by the number of the part; a part that is not listed has all candidates.
    end : dict
    label : str
        What to call it in messages.
    """

    header: dict[str, Any]
    cuts: list[dict[str, Any]] = field(default_factory=list)
    points: list[dict[str, Any]] = field(default_factory=list)
    parts: dict[int, list[list[int]]] = field(default_factory=dict)
    end: dict[str, Any] = field(default_factory=dict)
    label: str = "the ledger"


_NUMBER, _MAYBE = (int, float), (int, float, NoneType)
# What the entries of each kind hold, and of which types it is; what a cut says is checked where it is proven again.
_NEEDED: dict[str, dict[str, type | tuple[type, ...]]] = {
    "header": {"instance": dict, "problem": dict, "settings": dict},
    "cut": {
        "number": int,
        "family": str,
        "node": int,
        "round": int,
        "part": int,
        "simplices": list,
        "coefficients": list,
        "rhs": _NUMBER,
        "violation": _MAYBE,
        "efficacy": _MAYBE,
        "taken": bool,
        "lp_before": _MAYBE,
        "lp_after": _MAYBE,
        "proof": dict,
    },
    "point": {"node": int, "round": int, "lp": _NUMBER, "simplices": list, "values": list},
    "part": {"part": int, "simplices": list},
    "end": {"lp": _MAYBE, "final": list, "at_zero": list, "at_one": list},
}
_NAMES = {
    int: "an integer", float: "a number", str: "a text", bool: "true or false", dict: "an object", list: "a list",
    NoneType: "null",
}  # fmt: skip
_SHOWN = 40
_INSTANCE, _PROBLEM = ("name", "points", "digest"), ("objective", "sense", "spanning", "formulation")
_MEND = f"take a file that ends in {SUFFIX}, as 'bcut experiment run' wrote it"


def read_ledger(path: Path | str) -> Ledger:
    """Read a ledger.

    Raises
    ------
    LedgerError
        It cannot be read, is cut short, belongs to another schema, or a line lacks something or has it of the wrong
        type.
    """
    lines = _entries(Path(path))
    header = next(lines, None)
    if header is None or header["record"] != "header" or header.get("schema") != SCHEMA:
        raise LedgerError(f"{path}: is no ledger of schema {SCHEMA}; {_MEND}")
    ledger = Ledger(header, label=str(path))
    for entry in lines:
        if ledger.end:
            raise LedgerError(f"{path}: goes on after its end; it was put together from several files")
        if entry["record"] == "cut":
            ledger.cuts.append(entry)
        elif entry["record"] == "point":
            ledger.points.append(entry)
        elif entry["record"] == "part":
            ledger.parts[entry["part"]] = entry["simplices"]
        else:
            ledger.end = entry
    if not ledger.end:
        raise LedgerError(f"{path}: is cut short, its last line is missing; run the experiment again")
    final = set(ledger.end["final"])
    for cut in ledger.cuts:
        cut["final"] = cut["number"] in final
    return ledger


def _entries(path: Path) -> Iterator[dict[str, Any]]:
    number = 0
    try:
        with gzip.open(path, "rt", encoding="utf-8") as stream:
            for number, line in enumerate(stream, 1):
                entry = json.loads(line)
                _check(entry, f"{path}, line {number}")
                yield entry
    except FileNotFoundError:
        raise LedgerError(f"{path}: there is no such file") from None
    except (OSError, EOFError, UnicodeDecodeError, zlib.error) as error:
        raise LedgerError(f"{path}: cannot be read as a compressed ledger ({error}); {_MEND}") from None
    except json.JSONDecodeError as error:
        raise LedgerError(f"{path}, line {number}: is no JSON ({error.msg}); {_MEND}") from None


def _check(entry: Any, where: str) -> None:
    """Refuse what is no entry of a ledger.

    Raises
    ------
    LedgerError
        It is of no kind, lacks something, or has something of the wrong type.
    """
    kind = entry.get("record") if isinstance(entry, dict) else None
    needed = _NEEDED.get(kind) if isinstance(kind, str) else None
    if needed is None:
        raise LedgerError(f"{where}: is no entry of a ledger")
    for key, types in needed.items():
        if key not in entry:
            raise LedgerError(f"{where}: has no entry '{key}'")
        value = entry[key]
        if not isinstance(value, types) or (isinstance(value, bool) and types is not bool):
            name = f"the '{key}' of cut {entry['number']}" if kind == "cut" else f"'{key}'"
            several = types if isinstance(types, tuple) else (types,)
            known = " or ".join(_NAMES[one] for one in several if one is not int or float not in several)
            raise LedgerError(f"{where}: {name} is {json.dumps(value)[:_SHOWN]}, where {known} belongs")
    if kind == "header":
        for key, parts in (("instance", _INSTANCE), ("problem", _PROBLEM)):
            missing = [part for part in parts if part not in entry[key]]
            if missing:
                raise LedgerError(f"{where}: has no entry '{key}.{missing[0]}'")
    if kind == "end" and not all(isinstance(number, int) for number in entry["final"]):
        raise LedgerError(f"{where}: 'final' is a list of the numbers of cuts")

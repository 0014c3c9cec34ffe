"""Ledgers: every cut of a run, one JSON object a line, compressed by gzip.

The first line is the problem, exact; the last one the relaxation that the run ended with. Between them stand the
cuts as they were found, the fractional points that they were found for, and, where columns had been fixed before,
which simplices were left ("part"). `docs/experiments.md` describes the entries.
"""

from __future__ import annotations

import gzip
import io
import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
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
    """

    header: dict[str, Any]
    cuts: list[dict[str, Any]] = field(default_factory=list)
    points: list[dict[str, Any]] = field(default_factory=list)
    parts: dict[int, list[list[int]]] = field(default_factory=dict)
    end: dict[str, Any] = field(default_factory=dict)


_NEEDED = {
    "header": ("instance", "problem", "settings"),
    "cut": (
        "number",
        "family",
        "node",
        "round",
        "part",
        "simplices",
        "coefficients",
        "rhs",
        "taken",
        "proof",
    ),
    "point": ("node", "round", "lp", "simplices", "values"),
    "part": ("part", "simplices"),
    "end": ("lp", "final", "at_zero", "at_one"),
}


def read_ledger(path: Path | str) -> Ledger:
    """Read a ledger.

    Raises
    ------
    LedgerError
        It cannot be read, is cut short, belongs to another schema, or a line lacks something.
    """
    lines = _entries(Path(path))
    header = next(lines, None)
    if header is None or header["record"] != "header" or header.get("schema") != SCHEMA:
        raise LedgerError(f"{path}: is no ledger of schema {SCHEMA}; take a file that ends in {SUFFIX}")
    ledger = Ledger(header)
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
                kind = entry.get("record") if isinstance(entry, dict) else None
                if kind not in _NEEDED:
                    raise LedgerError(f"{path}, line {number}: is no entry of a ledger")
                missing = [key for key in _NEEDED[kind] if key not in entry]
                if missing:
                    raise LedgerError(f"{path}, line {number}: has no entry '{missing[0]}'")
                yield entry
    except FileNotFoundError:
        raise LedgerError(f"{path}: there is no such file") from None
    except (OSError, EOFError, UnicodeDecodeError) as error:
        raise LedgerError(f"{path}: cannot be read as a compressed ledger ({error})") from None
    except json.JSONDecodeError as error:
        raise LedgerError(f"{path}, line {number + 1}: is no JSON ({error.msg})") from None

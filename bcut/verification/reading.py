"""Reading a result file with a reader of its own: JSON in, checked plain data out."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any, NoReturn, Protocol

from bcut.errors import ResultError
from bcut.verification.certificate import CertificateData
from bcut.verification.costs import CostTable
from bcut.verification.cuts import CertificateCut
from bcut.verification.exact_points import Simplex

SCHEMA = 1
STATUSES = ("optimal", "infeasible", "limit", "interrupted", "bound")

_MEND = "take the file as 'bcut solve --output' wrote it, or solve the instance again"
_RATIONAL = re.compile(r"[+-]?\d{1,4000}(/\d{1,4000}|(\.\d{1,4000})?([eE][+-]?\d{1,3})?)")


class HasDict(Protocol):
    """What `bcut.solve` returns, as far as verification looks at it."""

    def to_dict(self) -> dict[str, Any]:
        """Return the result file as plain data."""


Source = Mapping[str, Any] | HasDict | str | os.PathLike[str]


@dataclass(frozen=True)
class FileNumber:
    """A number as a result file holds it: exact, or a double that stands for a number nearby."""

    exact: Fraction
    is_double: bool


@dataclass(frozen=True)
class ResultData:
    """The parts of a result file that verification needs, with their types checked and nothing else."""

    name: str
    dimension: int
    points: list[list[str]]
    digest: str
    objective: str
    sense: str
    spanning: bool
    costs: CostTable | None
    status: str
    value: FileNumber | None
    bound: FileNumber | None
    gap: Fraction | None
    triangulation: list[list[int]] | None
    certificate: CertificateData | None


def load_result(source: Source) -> tuple[ResultData, str]:
    """Read a result.

    Parameters
    ----------
    source : mapping, Result or path
        The data of a result file, or where the file is.

    Returns
    -------
    ResultData
    str
        What to call the result in messages.

    Raises
    ------
    ResultError
        It cannot be read, belongs to another schema, lacks an entry or has one of the wrong type.
    """
    if not isinstance(source, str | os.PathLike):
        source = source if isinstance(source, Mapping) else source.to_dict()
        return _Reader("the result").result(source), "the result"
    label = f"result file {os.fspath(source)}"
    return _Reader(label).result(_parse(Path(source), label)), label


def _parse(path: Path, label: str) -> Any:
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise ResultError(f"{label}: there is no such file") from None
    except OSError as error:
        raise ResultError(f"{label}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise ResultError(f"{label}: is not UTF-8 text, so no result file; {_MEND}") from None
    except ValueError as error:  # a path that no file can have
        raise ResultError(f"{label}: cannot be read ({error})") from None
    try:
        return json.loads(text, parse_constant=_no_number)
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        raise ResultError(f"{label}: is not JSON ({where}: {error.msg}); {_MEND}") from None
    except (ValueError, RecursionError) as error:
        raise ResultError(f"{label}: is not JSON of a result ({error}); {_MEND}") from None


def _no_number(text: str) -> NoReturn:
    raise ValueError(f"{text} is no number")


class _Reader:
    """Takes entries out of a result; names the result and the entry where one does not fit."""

    def __init__(self, label: str) -> None:
        self.label = label

    def result(self, data: Any) -> ResultData:
        if not isinstance(data, Mapping):
            self.refuse("", "a result is a JSON object", data)
        schema = self.entry(data, "schema")
        if schema != SCHEMA or isinstance(schema, bool):
            raise ResultError(
                f"{self.label}: has schema {_shown(schema)}, but this version of bcut reads schema {SCHEMA}; "
                "verify it with the version that wrote it (see its entry 'versions')"
            )
        instance, problem = self.mapping(data, "instance"), self.mapping(data, "problem")
        return ResultData(
            name=self.text(instance, "instance.name"),
            dimension=self.integer(self.entry(instance, "instance.dimension"), "instance.dimension"),
            points=self.points(self.entry(instance, "instance.points")),
            digest=self.text(instance, "instance.digest"),
            objective=self.text(problem, "problem.objective"),
            sense=self.choice(problem, "problem.sense", ("min", "max")),
            spanning=self.boolean(problem, "problem.spanning"),
            costs=self.costs(problem.get("costs")),
            status=self.choice(data, "status", STATUSES),
            value=self.optional_number(data, "value"),
            bound=self.optional_number(data, "bound"),
            gap=None if (gap := self.optional_number(data, "gap")) is None else gap.exact,
            triangulation=self.triangulation(self.entry(data, "triangulation")),
            certificate=self.certificate(self.entry(data, "certificate")),
        )

    def refuse(self, where: str, expected: str, found: Any) -> NoReturn:
        place = f"'{where}': " if where else ""
        raise ResultError(f"{self.label}: {place}{expected}, not {_shown(found)}; {_MEND}")

    def entry(self, data: Mapping[str, Any], where: str) -> Any:
        key = where.rpartition(".")[2]
        if key not in data:
            raise ResultError(f"{self.label}: has no entry '{where}'; {_MEND}")
        return data[key]

    def mapping(self, data: Mapping[str, Any], where: str) -> Mapping[str, Any]:
        value = self.entry(data, where)
        if not isinstance(value, Mapping):
            self.refuse(where, "this is a JSON object", value)
        return value

    def text(self, data: Mapping[str, Any], where: str) -> str:
        value = self.entry(data, where)
        if not isinstance(value, str):
            self.refuse(where, "this is a text", value)
        return value

    def boolean(self, data: Mapping[str, Any], where: str) -> bool:
        value = self.entry(data, where)
        if not isinstance(value, bool):
            self.refuse(where, "this is true or false", value)
        return value

    def choice(self, data: Mapping[str, Any], where: str, known: tuple[str, ...]) -> str:
        value = self.entry(data, where)
        if value not in known:
            self.refuse(where, f"this is one of {', '.join(known)}", value)
        return str(value)

    def integer(self, value: Any, where: str) -> int:
        if not isinstance(value, int) or isinstance(value, bool):
            self.refuse(where, "this is an integer", value)
        return value

    def list_of(self, value: Any, where: str, expected: str) -> list[Any]:
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
        value = self.entry(data, where)
        return None if value is None else self.number(value, where)

    def rational(self, value: Any, where: str) -> Fraction:
        try:
            if not isinstance(value, str) or not _RATIONAL.fullmatch(value):
                raise ValueError
            return Fraction(value)
        except (ValueError, ZeroDivisionError):
            self.refuse(where, 'this is a rational as text ("69/2")', value)

    def points(self, value: Any) -> list[list[str]]:
        where = "instance.points"
        rows = self.list_of(value, where, "this is a list of points")
        for index, row in enumerate(rows):
            place = f"{where}[{index}]"
            for coordinate in self.list_of(row, place, "a point is a list of coordinates"):
                if not isinstance(coordinate, str):
                    self.refuse(place, "coordinates are exact, as text", coordinate)
        return [list(row) for row in rows]

    def vertices(self, value: Any, where: str) -> list[int]:
        return [self.integer(v, where) for v in self.list_of(value, where, "this is a list of vertices")]

    def triangulation(self, value: Any) -> list[list[int]] | None:
        if value is None:
            return None
        where = "triangulation"
        simplices = self.list_of(value, where, "this is a list of simplices")
        return [self.vertices(simplex, f"{where}[{index}]") for index, simplex in enumerate(simplices)]

    def ascending(self, value: Any, where: str) -> Simplex:
        """Read a set of vertices that is written in ascending order, each once."""
        vertices = tuple(self.vertices(value, where))
        if any(a >= b for a, b in pairwise(vertices)):
            self.refuse(where, "vertices are ascending here", value)
        return vertices

    def costs(self, value: Any) -> CostTable | None:
        if value is None:
            return None
        where = "problem.costs"
        if not isinstance(value, Mapping):
            self.refuse(where, "this is a JSON object", value)
        table: dict[Simplex, Fraction] = {}
        for index, entry in enumerate(
            self.list_of(self.entry(value, f"{where}.costs"), where, "this is a list")
        ):
            place = f"{where}.costs[{index}]"
            simplex, cost = self.pair(entry, place, "this is a pair of a simplex and its cost")
            vertices = tuple(sorted(self.vertices(simplex, place)))
            if vertices in table:
                self.refuse(place, "each simplex has one cost", entry)
            table[vertices] = self.number(cost, place).exact
        return CostTable(self.number(self.entry(value, f"{where}.default"), f"{where}.default").exact, table)

    def pair(self, value: Any, where: str, expected: str) -> tuple[Any, Any]:
        entries = self.list_of(value, where, expected)
        if len(entries) != 2:
            self.refuse(where, expected, value)
        return entries[0], entries[1]

    def certificate(self, value: Any) -> CertificateData | None:
        if value is None:
            return None
        where = "certificate"
        if not isinstance(value, Mapping):
            self.refuse(where, "this is a JSON object or null", value)
        bound = self.entry(value, f"{where}.bound")
        if bound is None:
            reason = value.get("reason")
            return CertificateData(None, reason=reason if isinstance(reason, str) else "")
        symmetries = self.symmetries(value.get("symmetries"), f"{where}.symmetries")
        row = "coverage" if symmetries is None else "volume"
        named, cocircuits = self.multipliers(self.entry(value, f"{where}.multipliers"), row)
        cuts = self.list_of(value.get("cuts", []), f"{where}.cuts", "this is a list of cuts")
        return CertificateData(
            bound=self.rational(bound, f"{where}.bound"),
            flag=tuple(self.vertices(self.entry(value, f"{where}.flag"), f"{where}.flag")),
            coverage=Fraction(0) if symmetries is not None else named,
            volume=Fraction(0) if symmetries is None else named,
            cocircuits=cocircuits,
            symmetries=symmetries,
            volume_coefficient=self.integer(
                value.get("volume_coefficient") or 0, f"{where}.volume_coefficient"
            ),
            cuts=tuple(self.cut(cut, f"{where}.cuts[{index}]") for index, cut in enumerate(cuts)),
        )

    def multipliers(self, value: Any, named: str) -> tuple[Fraction, dict[Simplex, Fraction]]:
        """Read the multipliers of the one row with a name, and of the cocircuit rows."""
        of_named: Fraction | None = None
        cocircuits: dict[Simplex, Fraction] = {}
        for index, entry in enumerate(self.list_of(value, "certificate.multipliers", "this is a list")):
            where = f"certificate.multipliers[{index}]"
            row, text = self.pair(entry, where, "this is a pair of a row and its multiplier")
            multiplier = self.rational(text, where)
            facet = None if row == named else self.ascending(row, where)
            if facet in cocircuits or (facet is None and of_named is not None):
                self.refuse(where, "each row has one multiplier", entry)
            if facet is None:
                of_named = multiplier
            else:
                cocircuits[facet] = multiplier
        return of_named or Fraction(0), cocircuits

    def symmetries(self, value: Any, where: str) -> tuple[Simplex, ...] | None:
        if value is None:
            return None
        listed = self.list_of(value, where, "this is a list of permutations of the points")
        return tuple(
            tuple(self.vertices(permutation, f"{where}[{i}]")) for i, permutation in enumerate(listed)
        )

    def cut(self, value: Any, where: str) -> CertificateCut:
        if not isinstance(value, Mapping):
            self.refuse(where, "this is a JSON object", value)
        listed = self.list_of(self.entry(value, f"{where}.simplices"), where, "this is a list of simplices")
        simplices = tuple(self.ascending(simplex, where) for simplex in listed)
        numbers = self.list_of(
            self.entry(value, f"{where}.coefficients"), where, "this is a list of coefficients"
        )
        coefficients = tuple(self.number(number, where).exact for number in numbers)
        if not simplices or len(simplices) != len(coefficients) or len(set(simplices)) != len(simplices):
            self.refuse(where, "a cut has different simplices, and a coefficient for each", value)
        proof = value.get("proof")
        return CertificateCut(
            family=self.text(value, f"{where}.family"),
            simplices=simplices,
            coefficients=coefficients,
            rhs=self.number(self.entry(value, f"{where}.rhs"), f"{where}.rhs").exact,
            multiplier=self.rational(self.entry(value, f"{where}.multiplier"), f"{where}.multiplier"),
            proof=proof if isinstance(proof, Mapping) else {},
        )


def _shown(value: Any) -> str:
    try:
        text = json.dumps(value)
    except (TypeError, ValueError):
        text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."

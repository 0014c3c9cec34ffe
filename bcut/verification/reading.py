"""Reading a result file with a reader of its own: JSON in, checked plain data out."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any, NoReturn, Protocol

from bcut.errors import ResultError
from bcut.verification.certificate import CertificateData, RefutationData
from bcut.verification.costs import CostTable
from bcut.verification.cuts import CertificateCut
from bcut.verification.exact_points import Simplex
from bcut.verification.restrictions import RestrictionData

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
class LevelData:
    """A further objective, and what was found by it; status is None where it was not begun."""

    objective: str
    sense: str
    costs: CostTable | None
    status: str | None
    value: FileNumber | None
    bound: FileNumber | None
    gap: Fraction | None
    certificate: CertificateData | None


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
    invariant_under: tuple[tuple[Simplex, ...], ...] | None = None
    dissection: bool = False
    restrictions: RestrictionData = field(default_factory=RestrictionData)
    then: tuple[LevelData, ...] = ()


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
    data, label = plain_data(source)
    return _Reader(label).result(data), label


def plain_data(source: Source) -> tuple[Any, str]:
    """Return the data of a result, not looked at yet, and what to call it in messages.

    Raises
    ------
    ResultError
        It cannot be read.
    """
    if not isinstance(source, str | os.PathLike):
        return source if isinstance(source, Mapping) else source.to_dict(), "the result"
    label = f"result file {os.fspath(source)}"
    return _parse(Path(source), label), label


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
            invariant_under=self.groups(problem.get("invariant_under"), "problem.invariant_under"),
            dissection=self.flag(problem, "problem.dissection"),
            restrictions=self.restrictions(problem),
            status=self.choice(data, "status", STATUSES),
            value=self.optional_number(data, "value"),
            bound=self.optional_number(data, "bound"),
            gap=None if (gap := self.optional_number(data, "gap")) is None else gap.exact,
            triangulation=self.triangulation(self.entry(data, "triangulation")),
            certificate=self.certificate(self.entry(data, "certificate")),
            then=self.levels(data, problem),
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

    def costs(self, value: Any, where: str = "problem.costs") -> CostTable | None:
        if value is None:
            return None
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
        default = self.optional_number(value, f"{where}.default")
        return CostTable(None if default is None else default.exact, table)

    def pair(self, value: Any, where: str, expected: str) -> tuple[Any, Any]:
        entries = self.list_of(value, where, expected)
        if len(entries) != 2:
            self.refuse(where, expected, value)
        return entries[0], entries[1]

    def levels(self, data: Mapping[str, Any], problem: Mapping[str, Any]) -> tuple[LevelData, ...]:
        """Read the further objectives, and what was found by each; older files have none."""
        asked = self.list_of(problem.get("then", []), "problem.then", "this is a list of objectives")
        found = self.list_of(
            data.get("then", []), "then", "this is a list, one entry for each of problem.then"
        )
        if len(asked) != len(found):
            self.refuse("then", f"this is a list of {len(asked)}, one entry for each of problem.then", found)
        return tuple(self.level(*pair, number) for number, pair in enumerate(zip(asked, found, strict=True)))

    def level(self, question: Any, record: Any, number: int) -> LevelData:
        where, asked = f"then[{number}]", f"problem.then[{number}]"
        for value, place in ((record, where), (question, asked)):
            if not isinstance(value, Mapping):
                self.refuse(place, "this is a JSON object", value)
        begun = self.entry(record, f"{where}.status") is not None
        gap = self.optional_number(record, f"{where}.gap")
        return LevelData(
            objective=self.text(question, f"{asked}.objective"),
            sense=self.choice(question, f"{asked}.sense", ("min", "max")),
            costs=self.costs(question.get("costs"), f"{asked}.costs"),
            status=self.choice(record, f"{where}.status", STATUSES) if begun else None,
            value=self.optional_number(record, f"{where}.value"),
            bound=self.optional_number(record, f"{where}.bound"),
            gap=None if gap is None else gap.exact,
            certificate=self.certificate(self.entry(record, f"{where}.certificate"), f"{where}.certificate"),
        )

    def certificate(self, value: Any, where: str = "certificate") -> CertificateData | None:
        if value is None:
            return None
        if not isinstance(value, Mapping):
            self.refuse(where, "this is a JSON object or null", value)
        bound = self.entry(value, f"{where}.bound")
        if bound is None:
            reason = value.get("reason")
            return CertificateData(None, reason=reason if isinstance(reason, str) else "")
        symmetries = self.symmetries(value.get("symmetries"), f"{where}.symmetries")
        row = "coverage" if symmetries is None else "volume"
        threshold = value.get("threshold")
        earlier = self.list_of(value.get("earlier", []), f"{where}.earlier", "this is a list of multipliers")
        named, cocircuits, chambers = self.multipliers(
            self.entry(value, f"{where}.multipliers"), row, f"{where}.multipliers"
        )
        cuts = self.list_of(value.get("cuts", []), f"{where}.cuts", "this is a list of cuts")
        return CertificateData(
            bound=self.rational(bound, f"{where}.bound"),
            flag=tuple(self.vertices(self.entry(value, f"{where}.flag"), f"{where}.flag")),
            coverage=Fraction(0) if symmetries is not None else named,
            volume=Fraction(0) if symmetries is None else named,
            cocircuits=cocircuits,
            chambers=chambers,
            symmetries=symmetries,
            volume_coefficient=self.integer(
                value.get("volume_coefficient") or 0, f"{where}.volume_coefficient"
            ),
            cuts=tuple(self.cut(cut, f"{where}.cuts[{index}]") for index, cut in enumerate(cuts)),
            infeasible=self.flag(value, f"{where}.infeasible"),
            refutes=self.refutation(value.get("refutes"), f"{where}.refutes"),
            threshold=None if threshold is None else self.rational(threshold, f"{where}.threshold"),
            earlier=tuple(self.rational(text, f"{where}.earlier") for text in earlier),
        )

    def refutation(self, value: Any, where: str) -> RefutationData | None:
        if value is None:
            return None
        if not isinstance(value, Mapping):
            self.refuse(where, "this is a JSON object or null", value)
        listed = self.list_of(
            self.entry(value, f"{where}.stages"), f"{where}.stages", "this is a list of stages"
        )
        stages = []
        for index, stage in enumerate(listed):
            place = f"{where}.stages[{index}]"
            if not isinstance(stage, Mapping):
                self.refuse(place, "this is a JSON object", stage)
            coverage, cocircuits, _ = self.multipliers(
                self.entry(stage, f"{place}.multipliers"), "coverage", f"{place}.multipliers"
            )
            cuts = self.list_of(stage.get("cuts", []), f"{place}.cuts", "this is a list of cuts")
            stages.append(
                CertificateData(
                    bound=None,
                    coverage=coverage,
                    cocircuits=cocircuits,
                    cuts=tuple(self.cut(cut, f"{place}.cuts[{k}]") for k, cut in enumerate(cuts)),
                )
            )
        target = self.rational(self.entry(value, f"{where}.target"), f"{where}.target")
        return RefutationData(target, tuple(stages))

    def multipliers(
        self, value: Any, named: str, place: str
    ) -> tuple[Fraction, dict[Simplex, Fraction], dict[Simplex, Fraction]]:
        """Read the multipliers of the one row with a name, of the cocircuit rows, and of generic points by flags."""
        of_named: Fraction | None = None
        cocircuits: dict[Simplex, Fraction] = {}
        chambers: dict[Simplex, Fraction] = {}
        for index, entry in enumerate(self.list_of(value, place, "this is a list")):
            where = f"{place}[{index}]"
            row, text = self.pair(entry, where, "this is a pair of a row and its multiplier")
            multiplier = self.rational(text, where)
            if isinstance(row, Mapping):
                flag = tuple(self.vertices(self.entry(row, f"{where}.flag"), f"{where}.flag"))
                if flag in chambers:
                    self.refuse(where, "each row has one multiplier", entry)
                chambers[flag] = multiplier
                continue
            facet = None if row == named else self.ascending(row, where)
            if facet in cocircuits or (facet is None and of_named is not None):
                self.refuse(where, "each row has one multiplier", entry)
            if facet is None:
                of_named = multiplier
            else:
                cocircuits[facet] = multiplier
        return of_named or Fraction(0), cocircuits, chambers

    def flag(self, data: Mapping[str, Any], where: str) -> bool:
        """Read a truth value that older files lack."""
        return self.boolean(data, where) if where.rpartition(".")[2] in data else False

    def restrictions(self, problem: Mapping[str, Any]) -> RestrictionData:
        star = problem.get("star")
        return RestrictionData(
            require=self.faces(problem.get("require", []), "problem.require"),
            forbid=self.faces(problem.get("forbid", []), "problem.forbid"),
            star=None if star is None else self.integer(star, "problem.star"),
            dissection=self.flag(problem, "problem.dissection"),
        )

    def faces(self, value: Any, where: str) -> tuple[Simplex, ...]:
        return tuple(
            self.ascending(face, where) for face in self.list_of(value, where, "this is a list of faces")
        )

    def groups(self, value: Any, where: str) -> tuple[tuple[Simplex, ...], ...] | None:
        if value is None:
            return None
        listed = self.list_of(value, where, "this is a list of groups, each a list of permutations")
        return tuple(self.symmetries(group, f"{where}[{i}]") or () for i, group in enumerate(listed))

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

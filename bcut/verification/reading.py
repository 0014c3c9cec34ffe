"""Reading a result file with a reader of its own: JSON in, checked plain data out."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any, NoReturn, Protocol

from bcut.errors import ResultError
from bcut.verification.certificate_data import CertificateData
from bcut.verification.certificate_reading import CertificateReader
from bcut.verification.costs import CostTable
from bcut.verification.entries import MEND, FileNumber, shown
from bcut.verification.exact_points import Simplex
from bcut.verification.restrictions import RestrictionData

SCHEMA = 1
STATUSES = ("optimal", "infeasible", "limit", "interrupted", "bound")


class HasDict(Protocol):
    """What `bcut.solve` returns, as far as verification looks at it."""

    def to_dict(self) -> dict[str, Any]:
        """Return the result file as plain data."""


Source = Mapping[str, Any] | HasDict | str | os.PathLike[str]


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
    if isinstance(source, Mapping):
        return source, "the result"
    if not isinstance(source, str | os.PathLike):
        if not callable(getattr(source, "to_dict", None)):
            raise ResultError(
                "a result is the path of a result file, its data, or what bcut.solve returned, "
                f"not {type(source).__name__}"
            )
        return source.to_dict(), "the result"
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
        raise ResultError(f"{label}: is not UTF-8 text, so no result file; {MEND}") from None
    except ValueError as error:  # a path that no file can have
        raise ResultError(f"{label}: cannot be read ({error})") from None
    try:
        return json.loads(text, parse_constant=_no_number)
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        raise ResultError(f"{label}: is not JSON ({where}: {error.msg}); {MEND}") from None
    except (ValueError, RecursionError) as error:
        raise ResultError(f"{label}: is not JSON of a result ({error}); {MEND}") from None


def _no_number(text: str) -> NoReturn:
    raise ValueError(f"{text} is no number")


class _Reader(CertificateReader):
    """Takes a result out of its file."""

    def result(self, data: Any) -> ResultData:
        if not isinstance(data, Mapping):
            self.refuse("", "a result is a JSON object", data)
        schema = self.entry(data, "schema")
        if schema != SCHEMA or isinstance(schema, bool):
            raise ResultError(
                f"{self.label}: has schema {shown(schema)}, but this version of bcut reads schema {SCHEMA}; "
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

    def points(self, value: Any) -> list[list[str]]:
        where = "instance.points"
        rows = self.list_of(value, where, "this is a list of points")
        for index, row in enumerate(rows):
            place = f"{where}[{index}]"
            for coordinate in self.list_of(row, place, "a point is a list of coordinates"):
                if not isinstance(coordinate, str):
                    self.refuse(place, "coordinates are exact, as text", coordinate)
        return [list(row) for row in rows]

    def triangulation(self, value: Any) -> list[list[int]] | None:
        if value is None:
            return None
        where = "triangulation"
        simplices = self.list_of(value, where, "this is a list of simplices")
        return [self.vertices(simplex, f"{where}[{index}]") for index, simplex in enumerate(simplices)]

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

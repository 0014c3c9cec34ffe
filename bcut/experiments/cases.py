"""The problems of a plan: instances with an objective, from families, files and named collections."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

from bcut.errors import BcutError, InputError
from bcut.experiments.ranges import combinations_of, placeholders, values_of
from bcut.experiments.reading import Table, read_json
from bcut.objectives.measures import refuse_unknown
from bcut.objectives.syntax import BOTTLENECKS, MeasureName, ObjectiveName, read_objective

_KEYS = (
    "instance", "file", "collection", "classes", "for", "class", "objective", "sense", "spanning", "formulation",
    "optimum", "orders",
)  # fmt: skip
_MEMBER_KEYS = (
    "instance", "class", "objective", "sense", "spanning", "formulation", "optimum", "lp", "columns", "found_by",
    "note", "bound",
)  # fmt: skip
#: What sizes are measured in; "per_row" are the nonzeros of a row, on average.
MEASURES = ("columns", "rows", "nonzeros", "per_row")


@dataclass(frozen=True)
class Case:
    """One problem.

    Attributes
    ----------
    instance : str
        A family or a bundled name, or the absolute path of a file.
    label : str
        The class that it belongs to in tables.
    objective : str
        A costs file by its absolute path.
    sense : {"min", "max"}
    spanning : bool
    formulation : str
    optimum : Fraction or None
        Where it is known.
    orders : dict of str to float
        Exponents of the number of points that a theory gives for measures of size, to be compared with measured ones.
    """

    instance: str
    label: str
    objective: str = "cardinality"
    sense: str = "min"
    spanning: bool = False
    formulation: str = "2"
    optimum: Fraction | None = None
    orders: dict[str, float] = field(default_factory=dict, hash=False)


def read_cases(top: Table, folder: Path) -> list[Case]:
    """Read the problems of a plan, each once."""
    tables = top.tables("instances")
    if not tables:
        top.refuse("instances", 'is missing: write [[instances]] with instance = "..." or collection = "..."')
    cases: dict[tuple[Any, ...], Case] = {}
    for table in tables:
        table.known(*_KEYS)
        sources = [key for key in ("instance", "file", "collection") if key in table.entries]
        if len(sources) != 1:
            table.refuse(sources[1] if sources else "instance", "names one of instance, file and collection")
        defaults = {
            key: top.entries[key]
            for key in ("objective", "sense", "spanning", "formulation")
            if key in top.entries
        }
        merged = Table(defaults | dict(table.entries), table.label, table.name, table.index, table.lines)
        found = (
            list(_collection(merged, folder)) if sources == ["collection"] else list(_family(merged, folder))
        )
        for case in found:
            key = (case.instance, case.objective, case.sense, case.spanning, case.formulation)
            cases.setdefault(key, case)
    return list(cases.values())


def _family(table: Table, folder: Path) -> Iterator[Case]:
    key = "file" if "file" in table.entries else "instance"
    pattern = table.text(key)
    label = table.text("class", pattern)
    objective = table.text("objective", "cardinality")
    given = table.entries.get("for", {})
    if not isinstance(given, dict):
        table.refuse("for", 'is a table of ranges, such as for = { n = [12, 14], s = "0..29" }')
    ranges = {}
    for name, value in given.items():
        try:
            ranges[name] = values_of(value)
        except ValueError as error:
            table.refuse("for", f"gives '{name}' a value that {error}")
    used = set()
    for place in (key, "class", "objective"):
        text = table.entries.get(place, "")
        try:
            names = placeholders(text)
        except ValueError as error:
            table.refuse(place, f"{error}")
        missing = [name for name in names if name not in ranges]
        if missing:
            table.refuse(place, f"has the placeholder {{{missing[0]}}} without a range: give one under 'for'")
        used |= set(names)
    unused = [name for name in ranges if name not in used]
    if unused:
        table.refuse("for", f"gives a range to '{unused[0]}', which no pattern uses")
    for chosen in combinations_of(ranges):
        instance = pattern.format(**chosen)
        yield _case(
            table,
            str((folder / instance).resolve()) if key == "file" else instance,
            label=label.format(**chosen),
            objective=with_absolute_path(objective.format(**chosen), folder),
        )


def _collection(table: Table, folder: Path) -> Iterator[Case]:
    for key in ("for", "class", "optimum", "orders"):
        if key in table.entries:
            table.refuse(key, "has no meaning for a collection, whose members say it")
    name = table.text("collection")
    path = collection_path(name, folder)
    if path is None:
        table.refuse(
            "collection", f"'{name}' is neither bundled ({', '.join(collection_names())}) nor a .json file"
        )
    wanted = table.texts("classes")
    members = read_collection(path)
    known = list(dict.fromkeys(member.label for member in members))
    for label in wanted:
        if label not in known:
            table.refuse("classes", f"names '{label}', but the classes of {name} are {', '.join(known)}")
    yield from (member for member in members if not wanted or member.label in wanted)


def collection_names() -> list[str]:
    """Return the names of the bundled collections."""
    instances = importlib.import_module("bcut.instances")
    names: list[str] = instances.collections()
    return names


def collection_path(name: str, folder: Path) -> Path | None:
    """Return the file of a collection, by its bundled name or its path."""
    if name in collection_names():
        path: Path = importlib.import_module("bcut.instances").path(name)
        return path
    path = folder / name
    return path if name.endswith(".json") and path.is_file() else None


def read_collection(path: Path) -> list[Case]:
    """Read a collection: an object with a list "members".

    Raises
    ------
    PlanError
        It cannot be read, or a member is malformed.
    """
    data = read_json(path)
    top = Table(data if isinstance(data, dict) else {}, str(path))
    if not isinstance(data, dict) or "members" not in data:
        top.refuse("members", "is missing: a collection is an object with a list of members")
    cases = []
    for table in top.tables("members"):
        table.known(*_MEMBER_KEYS)
        objective = with_absolute_path(table.text("objective", "cardinality"), path.parent)
        cases.append(
            _case(table, table.text("instance"), label=table.text("class", path.stem), objective=objective)
        )
    return cases


def _case(table: Table, instance: str, *, label: str, objective: str) -> Case:
    optimum = table.entries.get("optimum")
    try:
        known = None if optimum is None else Fraction(optimum)
    except (TypeError, ValueError, ZeroDivisionError):
        table.refuse("optimum", f"is a number or a rational as text, not {optimum!r}")
    read = checked_objective(table, "objective", objective, sense_of(table))
    return Case(
        instance,
        label,
        objective,
        read.sense,
        table.flag("spanning", False),
        table.text("formulation", "2"),
        known,
        _orders(table),
    )


def _orders(table: Table) -> dict[str, float]:
    """Read exponents of the number of points, such as { columns = 3, rows = 6 }."""
    given = table.entries.get("orders", {})
    if not isinstance(given, dict):
        table.refuse("orders", "is a table of exponents, such as orders = { columns = 3, rows = 2 }")
    for measure, exponent in given.items():
        if measure not in MEASURES:
            table.refuse("orders", f"speaks of '{measure}', but what grows is {', '.join(MEASURES)}")
        if isinstance(exponent, bool) or not isinstance(exponent, int | float):
            table.refuse("orders", f"gives '{measure}' an exponent, not {exponent!r}")
    return dict(given)


def sense_of(table: Table) -> str | None:
    """Return the sense that a table gives to its objective, if any."""
    return table.text("sense", choices=("min", "max")) if "sense" in table.entries else None


def checked_objective(table: Table, key: str, text: str, sense: str | None = None) -> ObjectiveName:
    """Read the objective that stands at a key of a table, and the sense beside it.

    Raises
    ------
    PlanError
        There is no such measure, or the sense is not that of the bottleneck.
    """
    try:
        read = read_objective(text)
        refuse_unknown(MeasureName.parse(read.measure))
    except InputError as error:
        table.refuse(key, f"cannot be used: {error}")
    try:
        return read_objective(text, sense)
    except InputError as error:
        table.refuse("sense", f"cannot be used: {error}")


def with_absolute_path(text: str, folder: Path) -> str:
    """Return an objective with the path of its file made absolute."""
    file = objective_file(text)
    return text if file is None else text.replace(file, str((folder / file).resolve()), 1)


def objective_file(text: str) -> str | None:
    """Return the file that an objective reads, of costs or with a function; None if it reads none."""
    kind, _, measure = text.partition(":")
    name = MeasureName.parse(measure if kind in BOTTLENECKS else text)
    if name.is_file:
        return name.source
    return name.argument or None if name.source == "costs" else None


def load_case(case: Case) -> Any:
    """Load the point configuration of a case.

    Raises
    ------
    InputError
        There is no such instance.
    """
    from bcut.instance import load_instance

    try:
        return load_instance(Path(case.instance) if Path(case.instance).is_absolute() else case.instance)
    except BcutError as error:
        raise type(error)(f"{error}") from None

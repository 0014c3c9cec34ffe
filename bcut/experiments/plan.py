"""Plans of experiments: which problems, and which variants of solving them.

A plan is a TOML file. `docs/experiments.md` describes its keys.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from bcut.experiments.cases import Case, checked_objective, read_cases, with_absolute_path
from bcut.experiments.drawings import Drawing, read_drawings
from bcut.experiments.reading import Table, read_toml
from bcut.experiments.variants import Variant, ablation, read_variant

_TOP = (
    "name", "description", "objective", "sense", "spanning", "formulation", "instances", "variants",
    "protocol", "separators", "preset", "scip", "cutoff", "time_limit", "memory_limit", "seed", "method", "ledger",
    "measures", "figures",
)  # fmt: skip

Protocol = Literal["ablation"]
PROTOCOLS = ("ablation",)


@dataclass(frozen=True)
class Plan:
    """What to run.

    Attributes
    ----------
    name, description : str
    cases : tuple of Case
    variants : tuple of Variant
        With different names. Two of them may ask for the same run, which is then made once.
    protocol : str
        "ablation" or nothing.
    measures : tuple of str
        Objectives whose values at the triangulation of each run are recorded; files by absolute path.
    drawings : tuple of Drawing
        Figures of these measures in the report.
    text : str
        The file as it was read.
    """

    name: str
    description: str
    cases: tuple[Case, ...]
    variants: tuple[Variant, ...]
    protocol: str = ""
    measures: tuple[str, ...] = ()
    drawings: tuple[Drawing, ...] = ()
    text: str = field(default="", repr=False)


def read_plan(path: Path | str) -> Plan:
    """Read a plan.

    Raises
    ------
    PlanError
        With the file, the line, the key, and what was expected.
    InputError
        An instance, an objective or a separator that does not exist.
    """
    path = Path(path)
    top, text = read_toml(path)
    top.known(*_TOP)
    folder = path.parent.resolve()
    common = {
        key: value for key, value in top.entries.items() if key not in ("instances", "variants", "figures")
    }
    cases = read_cases(top, folder)
    protocol = top.text("protocol", choices=PROTOCOLS) if "protocol" in top.entries else ""
    if "separators" in top.entries and not protocol:
        top.refuse(
            "separators", "is about the protocol 'ablation'; without one, write it in each of [[variants]]"
        )
    variants: list[Variant] = []
    if protocol:
        variants += ablation(top, folder)
    for table in top.tables("variants"):
        variants.append(read_variant(_inherited(table, common), folder))
    if not variants:
        top.refuse("variants", 'is missing: write [[variants]] with a name, or protocol = "ablation"')
    names = [variant.name for variant in variants]
    for position, name in enumerate(names):
        if name in names[:position]:
            top.refuse("variants", f"has the name '{name}' twice; names tell them apart in the report")
    measures = _measures(top, folder)
    return Plan(
        name=top.text("name", path.stem),
        description=top.text("description", "-") if "description" in top.entries else "",
        cases=tuple(cases),
        variants=tuple(variants),
        protocol=protocol,
        measures=measures,
        drawings=read_drawings(top, measures, names, folder),
        text=text,
    )


def _measures(top: Table, folder: Path) -> tuple[str, ...]:
    found: list[str] = []
    for text in top.texts("measures"):
        checked_objective(top, "measures", text)
        absolute = with_absolute_path(text, folder)
        if absolute in found:
            top.refuse("measures", f"has '{text}' twice")
        found.append(absolute)
    return tuple(found)


def _inherited(table: Table, common: dict[str, Any]) -> Table:
    """Return a variant's table with the settings that the top of the plan gives to all it can concern."""
    shared = ["preset", "time_limit", "memory_limit", "seed", "method", "ledger"]
    preset = table.entries.get("preset", common.get("preset", "loop"))
    if preset in ("loop", "root"):
        shared.append("cutoff")
    if preset == "root":
        shared.append("scip")
    entries = {key: common[key] for key in shared if key in common} | dict(table.entries)
    return Table(entries, table.label, table.name, table.index, table.lines)

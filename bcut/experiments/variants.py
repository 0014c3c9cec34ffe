"""Variants: the ways in which a plan solves each of its problems."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from bcut.errors import BcutError
from bcut.experiments.reading import Table
from bcut.separation.resolve import Specification, resolve

PRESETS = {
    "loop": "our cutting-plane loop in HiGHS: relaxation, cuts, and again; nothing else",
    "root": "SCIP's root node: no presolve, no restarts, no heuristics, its own separators only where named",
    "solve": "bcut solve",
    "plain": "SCIP with its own defaults on the exported model",
}
_KEYS = (
    "name", "preset", "separators", "scip", "cutoff", "time_limit", "memory_limit", "seed", "method", "ledger",
)  # fmt: skip
_METHODS = {
    "loop": ("listing", "orbits", "fixing"),
    "solve": ("auto", "listing", "orbits", "fixing", "elimination", "scip"),
}
_UNLIMITED = ":unlimited"


@dataclass(frozen=True)
class Variant:
    """One way of solving a problem.

    Attributes
    ----------
    name : str
        In tables; no part of what a run is identified by.
    preset : {"loop", "root", "solve", "plain"}
    separators : tuple of str
        Ours, as on the command line; files by absolute path.
    scip : tuple of str
        SCIP's own separators at the root: names, ":unlimited" behind those without limits on rounds and cuts;
        "default" for all of them as SCIP sets them.
    cutoff : bool
        Whether the known optimum is given as a cutoff.
    time_limit, memory_limit : float or None
        Seconds, and GiB of address space, for each run.
    seed : int
    method : str
        Of ``bcut solve``; "listing" or "orbits" for the preset "loop".
    ledger : bool
        Whether cuts are recorded.
    role : str
        In an ablation: "none", "all", "only" or "without".
    family : str
        In an ablation: the separator that the role speaks of.
    """

    name: str
    preset: str = "loop"
    separators: tuple[str, ...] = ()
    scip: tuple[str, ...] = ()
    cutoff: bool = False
    time_limit: float | None = None
    memory_limit: float | None = None
    seed: int = 0
    method: str = ""
    ledger: bool = True
    role: str = ""
    family: str = ""

    def settings(self) -> dict[str, Any]:
        """Return what influences a run, as plain data."""
        data = asdict(self)
        return {key: data[key] for key in data if key not in ("name", "role", "family")}


def read_variant(table: Table, folder: Path) -> Variant:
    """Read one variant.

    Raises
    ------
    PlanError, SeparatorLoadError
    """
    table.known(*_KEYS)
    preset = table.text("preset", "loop", choices=PRESETS)
    method = _method(table, preset)
    return Variant(
        name=table.text("name"),
        preset=preset,
        separators=_separators(table, preset, folder),
        scip=_scip(table, preset),
        cutoff=_cutoff(table, preset),
        time_limit=table.number("time_limit", None),
        memory_limit=table.number("memory_limit", None, least=0.25),
        seed=_seed(table),
        method=method,
        ledger=_ledger(table, preset, method),
    )


def ablation(top: Table, folder: Path) -> list[Variant]:
    """Expand the protocol: none of the separators, all, each alone, and all but each."""
    entries = {key: value for key, value in top.entries.items() if key in _KEYS}
    base = read_variant(Table({**entries, "name": "all"}, top.label, lines=top.lines), folder)
    if base.preset == "plain":
        top.refuse("preset", "'plain' has no separators to leave out")
    if not base.separators:
        top.refuse("separators", "is missing: an ablation says which separators it is about")
    families = [Specification.parse(text).source for text in base.separators]
    names = [Path(source).stem if source.endswith(".py") else source for source in families]
    variants = [replace(base, name="none", separators=(), role="none"), replace(base, name="all", role="all")]
    for position, name in enumerate(names):
        only = (base.separators[position],)
        variants.append(replace(base, name=f"only {name}", separators=only, role="only", family=name))
    for position, name in enumerate(names):
        rest = base.separators[:position] + base.separators[position + 1 :]
        if rest:
            variants.append(
                replace(base, name=f"without {name}", separators=rest, role="without", family=name)
            )
    return variants


def _separators(table: Table, preset: str, folder: Path) -> tuple[str, ...]:
    given = table.texts("separators")
    if preset == "plain" and given:
        table.refuse("separators", "has no meaning with preset 'plain', which is SCIP alone")
    absolute = [_absolute(text, folder) for text in given]
    for text in absolute:
        try:
            resolve(text)
        except BcutError as error:
            table.refuse("separators", f"cannot be used: {error}")
    return tuple(absolute)


def _absolute(text: str, folder: Path) -> str:
    specification = Specification.parse(text)
    if not specification.is_file:
        return text
    return str((folder / specification.source).resolve()) + text[len(specification.source) :]


def _scip(table: Table, preset: str) -> tuple[str, ...]:
    value = table.entries.get("scip", [])
    if value == "default":
        value = ["default"]
    elif value == "off":
        value = []
    if not isinstance(value, list) or not all(isinstance(entry, str) for entry in value):
        table.refuse(
            "scip", f'is "off", "default" or a list of names such as ["zerohalf:unlimited"], not {value!r}'
        )
    if value and preset != "root":
        table.refuse("scip", f"names separators of SCIP, which is for preset 'root' only, not '{preset}'")
    if value and value != ["default"]:
        from bcut.scip.host import scip_separators

        known = scip_separators()
        for entry in value:
            name = entry.removesuffix(_UNLIMITED)
            if name not in known:
                table.refuse("scip", f"names '{name}', but SCIP's separators are {', '.join(known)}")
    return tuple(value)


def named(scip: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Split names of SCIP's separators into those with their usual limits, and those without."""
    limited = tuple(name for name in scip if not name.endswith(_UNLIMITED) and name != "default")
    unlimited = tuple(name.removesuffix(_UNLIMITED) for name in scip if name.endswith(_UNLIMITED))
    return limited, unlimited


def _method(table: Table, preset: str) -> str:
    known = _METHODS.get(preset, ())
    if not known:
        # A setting for all variants does not concern those that have none.
        return ""
    return table.text("method", known[0], choices=known)


def _cutoff(table: Table, preset: str) -> bool:
    cutoff = table.flag("cutoff", False)
    if cutoff and preset not in ("loop", "root"):
        table.refuse("cutoff", f"is for presets 'loop' and 'root', not '{preset}'")
    return cutoff


def _seed(table: Table) -> int:
    seed = table.number("seed", 0)
    if seed is None or seed != int(seed):
        table.refuse("seed", "is an integer that is not negative")
    return int(seed)


def _ledger(table: Table, preset: str, method: str) -> bool:
    """Record cuts where bounds are studied; in whole solves, which are timed, only on request."""
    possible = preset != "plain" and method != "orbits"
    return possible and table.flag("ledger", preset in ("loop", "root"))

"""Variants: the ways in which a plan solves each of its problems."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from bcut.errors import BcutError
from bcut.experiments.cases import Case, checked_objective, sense_of, with_absolute_path
from bcut.experiments.reading import Table
from bcut.experiments.scip_names import DEFAULT, UNLIMITED
from bcut.separation.resolve import Specification, resolve

PRESETS = {
    "loop": "our cutting-plane loop in HiGHS: relaxation, cuts, and again; nothing else",
    "root": "SCIP's root node: no presolve, no restarts, no heuristics, its own separators only where named",
    "solve": "bcut solve",
    "plain": "SCIP with its own defaults on the exported model",
    "sizes": "columns, rows by kind and nonzeros, counted; nothing is solved",
    "delaunay": "the Delaunay triangulation; nothing is solved",
}
_KEYS = (
    "name", "preset", "objective", "sense", "separators", "scip", "cutoff", "time_limit", "memory_limit", "seed",
    "method", "ledger",
)  # fmt: skip
_METHODS = {
    "loop": ("listing", "orbits", "fixing"),
    "solve": ("auto", "listing", "orbits", "fixing", "elimination", "scip"),
}
_WITHOUT_SEPARATORS = {
    "plain": "it is SCIP alone",
    "sizes": "it solves nothing",
    "delaunay": "it solves nothing",
}
_WITH_BOTTLENECKS = ("solve", "delaunay")


@dataclass(frozen=True)
class Variant:
    """One way of solving a problem.

    Attributes
    ----------
    name : str
        In tables; no part of what a run is identified by.
    preset : {"loop", "root", "solve", "plain", "sizes", "delaunay"}
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
        Of ``bcut solve``; "listing", "orbits" or "fixing" for the preset "loop".
    ledger : bool
        Whether cuts are recorded.
    role : str
        In an ablation: "none", "all", "only" or "without".
    family : str
        In an ablation: the separator that the role speaks of.
    objective : str
        In place of that of the instances; nothing for theirs.
    sense : str
        Of this objective: "min" or "max".
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
    objective: str = ""
    sense: str = ""

    def settings(self) -> dict[str, Any]:
        """Return what influences a run besides the problem, as plain data."""
        data = asdict(self)
        aside = ("name", "role", "family", "objective", "sense")
        return {key: data[key] for key in data if key not in aside}

    @property
    def has_triangulation(self) -> bool:
        """Whether its runs may end with a triangulation, which has measures."""
        return self.preset not in ("loop", "sizes")

    def problem(self, case: Case) -> Case:
        """Return the problem that this variant makes of a case; the optimum of the case is not that of another one."""
        if not self.objective or (self.objective, self.sense) == (case.objective, case.sense):
            return case
        return replace(case, objective=self.objective, sense=self.sense, optimum=None)


def read_variant(table: Table, folder: Path) -> Variant:
    """Read one variant.

    Raises
    ------
    PlanError, SeparatorLoadError
    """
    table.known(*_KEYS)
    preset = table.text("preset", "loop", choices=PRESETS)
    method = _method(table, preset)
    objective, sense = _objective(table, preset, folder)
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
        objective=objective,
        sense=sense,
    )


def ablation(top: Table, folder: Path) -> list[Variant]:
    """Expand the protocol: none of the separators, all, each alone, and all but each."""
    # At the top of a plan the objective is that of the instances.
    aside = ("objective", "sense")
    entries = {key: value for key, value in top.entries.items() if key in _KEYS and key not in aside}
    base = read_variant(Table({**entries, "name": "all"}, top.label, lines=top.lines), folder)
    if base.preset in _WITHOUT_SEPARATORS:
        top.refuse("preset", f"'{base.preset}' has no separators to leave out")
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


def _objective(table: Table, preset: str, folder: Path) -> tuple[str, str]:
    """Return objective and sense that take the place of those of the instances; two empty texts without them."""
    sense = sense_of(table)
    if "objective" not in table.entries:
        if sense is not None:
            table.refuse("sense", "belongs to an objective of this variant: write 'objective' too")
        return "", ""
    text = with_absolute_path(table.text("objective"), folder)
    read = checked_objective(table, "objective", text, sense)
    if read.is_bottleneck and preset not in _WITH_BOTTLENECKS:
        table.refuse(
            "objective",
            f"'{text}' has no relaxation of its own, so it is for presets {' and '.join(_WITH_BOTTLENECKS)}, "
            f"not '{preset}'",
        )
    return text, read.sense


def _separators(table: Table, preset: str, folder: Path) -> tuple[str, ...]:
    given = table.texts("separators")
    if preset in _WITHOUT_SEPARATORS and given:
        table.refuse("separators", f"has no meaning with preset '{preset}': {_WITHOUT_SEPARATORS[preset]}")
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
    if value == DEFAULT:
        value = [DEFAULT]
    elif value == "off":
        value = []
    if not isinstance(value, list) or not all(isinstance(entry, str) for entry in value):
        table.refuse(
            "scip", f'is "off", "default" or a list of names such as ["zerohalf:unlimited"], not {value!r}'
        )
    if value and preset != "root":
        table.refuse("scip", f"names separators of SCIP, which is for preset 'root' only, not '{preset}'")
    if value and value != [DEFAULT]:
        from bcut.scip.host import scip_separators

        known = scip_separators()
        for entry in value:
            name = entry.removesuffix(UNLIMITED)
            if name not in known:
                table.refuse("scip", f"names '{name}', but SCIP's separators are {', '.join(known)}")
    return tuple(value)


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
    possible = preset not in _WITHOUT_SEPARATORS and method != "orbits"
    possible &= preset != "loop" or method == "listing"
    return possible and table.flag("ledger", preset in ("loop", "root"))

"""The runs that a report is about, with what follows from several of them together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import exp, log
from pathlib import Path
from typing import Any

from bcut.experiments.store import Store

# A root LP this close to the optimum, relative to it, leaves no gap to close.
_GAP = 1e-6
# Of a share of the gap.
_DIGITS = 9
_SETTLED = ("optimal", "infeasible")
_ROOT_PRESETS = ("loop", "root")

ProblemKey = tuple[str, str, str, bool, str]


@dataclass(frozen=True)
class Run:
    """One run of the plan that is stored.

    Attributes
    ----------
    entry : dict
        Of the manifest: instance, class, variant, ...
    record : dict
        As it was stored.
    optimum : float or None
        Of its problem.
    lp : float or None
        Root LP of its problem, without cuts.
    """

    entry: dict[str, Any]
    record: dict[str, Any]
    optimum: float | None
    lp: float | None

    @property
    def outcome(self) -> dict[str, Any]:
        """What came out."""
        found: dict[str, Any] = self.record["outcome"]
        return found

    @property
    def variant(self) -> str:
        """Name of the variant."""
        return str(self.entry["variant"])

    @property
    def measures(self) -> dict[str, float]:
        """Values of the plan's measures at the triangulation that the run ended with; none without it."""
        found: dict[str, float] = self.record.get("measures", {})
        return found

    @property
    def label(self) -> str:
        """Class of the instance."""
        return str(self.entry["class"])

    @property
    def seconds(self) -> float:
        """Wall time of the run, without starting the process and loading the instance."""
        return float(self.outcome["seconds"]["total"])

    @property
    def processor_seconds(self) -> float:
        """Processor time of the run: what can be compared when the machine had other work too."""
        return float(self.outcome["seconds"]["processor"])

    @property
    def is_root(self) -> bool:
        """Whether the run is about a root bound."""
        return self.record["settings"]["preset"] in _ROOT_PRESETS

    @property
    def only_counts(self) -> bool:
        """Whether nothing was to be solved."""
        return bool(self.record["settings"]["preset"] == "sizes")

    @property
    def has_gap(self) -> bool:
        """Whether there is something between the root LP and the optimum."""
        if self.optimum is None or self.lp is None:
            return False
        return abs(self.optimum - self.lp) > _GAP * max(1.0, abs(self.optimum))

    def closed(self, lp: float | None) -> float | None:
        """Return the share of the gap that a bound closes; None without a gap."""
        if not self.has_gap or lp is None:
            return None
        assert self.optimum is not None
        assert self.lp is not None
        # Without the noise of the relaxations; adding zero turns -0.0 into 0.0.
        return round((lp - self.lp) / (self.optimum - self.lp), _DIGITS) + 0.0

    @property
    def gap_closed(self) -> float | None:
        """Share of the gap that the run's root bound closes."""
        return self.closed(self.outcome["lp_after_cuts"]) if self.is_root else None

    @property
    def settled(self) -> bool:
        """Whether the run did what it is for: an optimum, or the whole gap closed."""
        if not self.is_root:
            return self.outcome["status"] in _SETTLED
        closed = self.gap_closed
        return bool(self.outcome["integral"]) or (closed is not None and closed >= 1 - _GAP)


@dataclass(frozen=True)
class Experiment:
    """A folder of runs.

    Attributes
    ----------
    manifest : dict
    runs : list of Run
        Stored ones, in the order of the plan.
    missing : int
        Runs of the plan that are neither stored nor failed.
    failures : list of dict
        instance, variant, kind, message.
    ledgers : dict of str to Path
        By fingerprint.
    """

    manifest: dict[str, Any]
    runs: list[Run]
    missing: int
    failures: list[dict[str, Any]]
    ledgers: dict[str, Path] = field(default_factory=dict)

    @property
    def variants(self) -> list[str]:
        """Names of the variants, in the order of the plan."""
        return [variant["name"] for variant in self.manifest["variants"]]

    @property
    def measures(self) -> list[str]:
        """What the plan measures triangulations by."""
        return list(self.manifest.get("measures", []))

    @property
    def drawings(self) -> list[dict[str, Any]]:
        """The figures that the plan asks for."""
        return list(self.manifest.get("figures", []))

    @property
    def labels(self) -> list[str]:
        """Classes of instances, in the order of the plan."""
        return list(dict.fromkeys(entry["class"] for entry in self.manifest["runs"]))


def load_experiment(folder: Path) -> Experiment:
    """Load what is stored in the folder of an experiment.

    Raises
    ------
    ExperimentError
        There is none.
    """
    store = Store(folder)
    manifest = store.load_manifest()
    stored, failures, missing = [], [], 0
    ledgers: dict[str, Path] = {}
    for entry in manifest["runs"]:
        name = entry["fingerprint"]
        record = store.load(name)
        if record is not None:
            stored.append((entry, record))
            if store.ledger(name).exists():
                ledgers[name] = store.ledger(name)
        elif (error := store.load_error(name)) is not None:
            failures.append({"instance": entry["instance"], "variant": entry["variant"], **error["error"]})
        else:
            missing += 1
    optima, lps = _known(stored)
    runs = [Run(entry, record, optima.get(_key(entry)), lps.get(_key(entry))) for entry, record in stored]
    return Experiment(manifest, runs, missing, failures, ledgers)


def _key(entry: dict[str, Any]) -> ProblemKey:
    return entry["instance"], entry["objective"], entry["sense"], entry["spanning"], entry["formulation"]


def _known(
    stored: list[tuple[dict[str, Any], dict[str, Any]]],
) -> tuple[dict[ProblemKey, float], dict[ProblemKey, float]]:
    """Return optimum and root LP of each problem: as the plan says, or as some run found them."""
    optima: dict[ProblemKey, float] = {}
    lps: dict[ProblemKey, float] = {}
    for entry, record in stored:
        key, outcome = _key(entry), record["outcome"]
        preset = record["settings"]["preset"]
        if entry["optimum"] is not None:
            optima[key] = float(Fraction(entry["optimum"]))
        elif preset in ("solve", "plain") and outcome["status"] == "optimal":
            optima.setdefault(key, outcome["value"])
        elif preset == "loop" and outcome["status"] == "integral":
            optima.setdefault(key, outcome["lp_after_cuts"])
        # The LP of the plain loop is the one that all variants start from.
        if outcome["lp"] is not None and (preset == "loop" or key not in lps):
            lps[key] = outcome["lp"]
    return optima, lps


def mean(values: Sequence[float]) -> float | None:
    """Return the arithmetic mean; None of nothing."""
    return sum(values) / len(values) if values else None


def shifted_geometric_mean(values: Sequence[float], shift: float) -> float | None:
    """Return ``exp(mean(log(values + shift))) - shift``; None of nothing."""
    if not values:
        return None
    # Rounding must not make it negative, as values never are.
    return max(0.0, exp(sum(log(value + shift) for value in values) / len(values)) - shift)

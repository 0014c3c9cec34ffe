"""The runs that a report is about, with what follows from several of them together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import exp, log
from pathlib import Path
from typing import Any

from bcut.experiments.reporting.known import (
    Contradiction,
    ProblemKey,
    Stored,
    contradictions_among,
    problem_of,
    proven_optimum,
    root_lp,
)
from bcut.experiments.store import Store

# A root LP this close to the optimum, relative to it, leaves no gap to close.
_GAP = 1e-6
# Of a share of the gap, and of means.
_DIGITS = 9
_SETTLED = ("optimal", "infeasible")
_ROOT_PRESETS = ("loop", "root")

FormulatedKey = tuple[ProblemKey, str]


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
        Of its problem; None also where runs contradict each other.
    lp : float or None
        Root LP of its problem, without cuts.
    disputed : bool
        Whether runs contradict each other about its problem.
    """

    entry: dict[str, Any]
    record: dict[str, Any]
    optimum: float | None
    lp: float | None
    disputed: bool = False

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
        return self._took("total")

    @property
    def processor_seconds(self) -> float:
        """Processor time of the run: what can be compared when the machine had other work too; else wall time."""
        return self._took("processor" if "processor" in self.outcome["seconds"] else "total")

    def _took(self, what: str) -> float:
        # What recording took was subtracted; older versions subtracted some of it twice.
        return max(0.0, float(self.outcome["seconds"][what]))

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
        """Whether the run did what it is for: an optimum, or the whole gap closed, and no other run denies it.

        At the root an outcome that is "integral" counts too, whatever that means for the preset: see
        `bcut.experiments.outcome.RunOutcome`.
        """
        if self.disputed:
            return False
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
    contradictions : list of Contradiction
        Of runs about the same problem, or of a run and the plan.
    ledgers : dict of str to Path
        By fingerprint.
    """

    manifest: dict[str, Any]
    runs: list[Run]
    missing: int
    failures: list[dict[str, Any]]
    contradictions: list[Contradiction] = field(default_factory=list)
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
    contradictions = contradictions_among(stored)
    runs = _runs(stored, {contradiction.key for contradiction in contradictions})
    return Experiment(manifest, runs, missing, failures, contradictions, ledgers)


def _runs(stored: list[Stored], disputed: set[ProblemKey]) -> list[Run]:
    """Put beside each run what is known of its problem; nothing is measured by an optimum that is in dispute."""
    problems: dict[FormulatedKey, list[Stored]] = {}
    for entry, record in stored:
        problems.setdefault((problem_of(entry), entry["formulation"]), []).append((entry, record))
    known = {
        key: (
            None if key[0] in disputed else _optimum(together),
            root_lp(record for _, record in together),
        )
        for key, together in problems.items()
    }
    return [
        Run(entry, record, *known[problem_of(entry), entry["formulation"]], problem_of(entry) in disputed)
        for entry, record in stored
    ]


def _optimum(stored: list[Stored]) -> float | None:
    """Return the optimum of a problem: as the plan says, or as the first run that proved it found it."""
    for entry, _ in stored:
        if entry["optimum"] is not None:
            return float(Fraction(entry["optimum"]))
    return next((found for _, record in stored if (found := proven_optimum(record)) is not None), None)


def mean(values: Sequence[float]) -> float | None:
    """Return the arithmetic mean; None of nothing."""
    return sum(values) / len(values) if values else None


def shifted_geometric_mean(values: Sequence[float], shift: float) -> float | None:
    """Return ``exp(mean(log(values + shift))) - shift``; None of nothing."""
    if not values:
        return None
    # Without the noise of the logarithms, which leaves zero neither zero nor even positive. Of times by clocks that
    # were set back, a negative one counts as none.
    found = exp(sum(log(max(0.0, value) + shift) for value in values) / len(values)) - shift
    return max(0.0, round(found, _DIGITS))

"""What SCIP says about its own work: seconds in linear programs, and what each of its separators did."""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bcut.separation.driver import FamilyStatistics

# The entry of the adapter that runs our separators, which are counted elsewhere.
_OURS = "bcut"


@dataclass(frozen=True)
class SolverStatistics:
    """Seconds that SCIP spent in linear programs, and its separators that did something, by name."""

    lp_seconds: float = 0.0
    separators: dict[str, FamilyStatistics] = field(default_factory=dict)


def read_statistics(model: Any) -> SolverStatistics:
    """Read the statistics of a model that has been solved."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "statistics.json"
        # PySCIPOpt shadows the variant that takes no file.
        model.writeStatisticsJson(str(path))
        data = json.loads(path.read_text(encoding="utf-8"))
    programs = data.get("lp", {}).values()
    seconds = sum(entry.get("time", 0.0) for entry in programs if isinstance(entry, dict))
    separators: dict[str, FamilyStatistics] = {}
    _collect(data.get("separator", {}).get("plugins", {}), separators)
    return SolverStatistics(seconds, separators)


def _collect(plugins: dict[str, Any], separators: dict[str, FamilyStatistics]) -> None:
    """Collect separators that were called; some contain others."""
    for name, entry in plugins.items():
        if not isinstance(entry, dict) or name == _OURS:
            continue
        if entry.get("calls") and "cuts_applied" in entry:
            separators[name] = FamilyStatistics(
                entry["calls"], entry["cuts_found"], entry["cuts_applied"], entry["exec_time"]
            )
        _collect(entry, separators)

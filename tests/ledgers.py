"""Ledgers for tests to read and to change, each made once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from laboratory import ledger_file

from bcut.experiments.ledger import Ledger

Entries = list[dict[str, Any]]

PLAN = """
[[instances]]
instance = "{instance}"
{case}
[[variants]]
name = "it"
{variant}
"""

ALL = 'separators = ["link", "clique:max_cuts=8", "odd-cycle:max_cuts=8"]'
SPANNING = "spanning = true"
RANDOM_COSTS = SPANNING + '\nobjective = "random-costs:2"'

# What each ledger is made from, and the bound that it ends with, where it is known.
MADE = {
    "loop": ("random:16,3,seed=20", SPANNING, ALL, 29.0),
    "loop in the plane": ("random:30,2,seed=2", RANDOM_COSTS, ALL, None),
    "loop, degenerate": ("grid:3,3,3", SPANNING, 'separators = ["link"]', 35.0),
    "loop with cutoff": ("random:16,3,seed=20", SPANNING + "\noptimum = 29", ALL + "\ncutoff = true", 29.0),
    "loop, maximum": ("random:12,3,seed=4", SPANNING + '\nsense = "max"', ALL, None),
    "root": ("random:16,3,seed=20", SPANNING, 'preset = "root"\n' + ALL, 29.0),
    "root with cutoff": (
        "random:16,3,seed=20",
        SPANNING + "\noptimum = 29",
        'preset = "root"\ncutoff = true\nscip = ["zerohalf:unlimited"]\n' + ALL,
        29.0,
    ),
    "zero-half": ("random:16,3,seed=9", SPANNING, 'preset = "root"\nscip = ["zerohalf:unlimited"]', 28.0),
    "zero-half and link": (
        "random:12,3,seed=1000",
        SPANNING,
        'preset = "root"\nscip = ["zerohalf"]\nseparators = ["link"]',
        17.0,
    ),
    "solve": ("random:18,3,seed=8", SPANNING, 'preset = "solve"\nledger = true\n' + ALL, None),
}

Made = Callable[[str], tuple[Path, dict[str, Any]]]


def made_in(folders: pytest.TempPathFactory) -> Made:
    """Make ledgers, each once."""
    known: dict[str, tuple[Path, dict[str, Any]]] = {}

    def make(name: str) -> tuple[Path, dict[str, Any]]:
        if name not in known:
            instance, case, variant, _ = MADE[name]
            text = PLAN.format(instance=instance, case=case, variant=variant)
            known[name] = ledger_file(folders.mktemp("ledger"), text)
        return known[name]

    return make


def cuts_of(ledger: Ledger, **wanted: Any) -> Entries:
    return [cut for cut in ledger.cuts if all(cut[key] == value for key, value in wanted.items())]

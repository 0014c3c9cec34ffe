"""The entry `outcome` of a record: what every preset has, and what only some have."""

from __future__ import annotations

import json
from typing import Any

import pytest

from bcut.experiments.outcome import RunOutcome
from bcut.experiments.variants import PRESETS

BOTH = [
    "status",
    "lp",
    "lp_after_cuts",
    "integral",
    "value",
    "bound",
    "nodes",
    "rounds",
    "columns",
    "rows",
    "nonzeros",
]
BOTH += ["columns_after_fixing", "separators", "seconds"]
SECONDS = {"total": 1.5, "processor": 1.0, "lp": 0.5, "separation": 0.25}


def outcome(**values: Any) -> RunOutcome:
    return RunOutcome(status="limit", seconds=SECONDS, **values)


@pytest.mark.parametrize("preset", PRESETS)
def test_whatever_is_unknown_is_there(preset: str) -> None:
    entry = outcome().stored(preset)
    assert sorted(entry) == sorted([*BOTH, "kinds"] if preset == "sizes" else BOTH)
    known = {"status": "limit", "nodes": 0, "rounds": [], "separators": {}, "seconds": SECONDS}
    assert entry == {**dict.fromkeys(entry), **known}


def test_stages_are_there_where_there_are_some() -> None:
    assert list(outcome(stages={"total": 1.0}).stored("solve")) == [*BOTH, "stages"]


def test_an_entry_is_plain_data() -> None:
    entry = outcome(rounds=[(7.5, {"link": 2}), (8.0, {})], kinds={"cocircuit": 3}).stored("sizes")
    assert entry["rounds"] == [[7.5, {"link": 2}], [8.0, {}]]
    assert entry["kinds"] == {"cocircuit": 3}
    assert json.loads(json.dumps(entry)) == entry

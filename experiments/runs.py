"""What the experiments share: runs that are stored as they finish, and are not run twice."""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable, Iterable
from pathlib import Path
from typing import Any


def run_all(
    keys: Iterable[tuple[Hashable, ...]], run: Callable[..., dict[str, Any]], file: Path
) -> list[dict[str, Any]]:
    """Run what is not stored yet, one JSON line each, and return everything."""
    file.parent.mkdir(parents=True, exist_ok=True)
    lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
    stored = {tuple(record["key"]): record for record in map(json.loads, lines)}
    records = []
    for key in keys:
        if key not in stored:
            stored[key] = {"key": list(key), **run(*key)}
            with file.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(stored[key]) + "\n")
            print(json.dumps(stored[key]), flush=True)
        records.append(stored[key])
    return records

"""SCIP's own separators as plans name them: each within its usual limits, or without limits on rounds and cuts."""

from __future__ import annotations

UNLIMITED = ":unlimited"
# All of them, as SCIP sets them.
DEFAULT = "default"


def named(scip: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Split names of SCIP's separators into those with their usual limits, and those without."""
    limited = tuple(name for name in scip if not name.endswith(UNLIMITED) and name != DEFAULT)
    unlimited = tuple(name.removesuffix(UNLIMITED) for name in scip if name.endswith(UNLIMITED))
    return limited, unlimited

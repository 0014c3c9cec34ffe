"""What the tests of `solve` share: its two methods for all questions, and what a solved one is."""

from __future__ import annotations

from typing import Any

from bcut.result import Result
from bcut.verification.verify import verify

METHODS = ["auto", "scip"]


def assert_solved(result: Result, value: Any) -> None:
    assert result.status == "optimal"
    assert result.value == result.bound == value
    assert result.gap == 0
    checked = verify(result)
    assert checked.value == value

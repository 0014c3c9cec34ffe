"""A live line about a running solve, on standard error, where that is a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.text import Text

Watcher = Callable[[dict[str, Any]], None]


@contextmanager
def progress_line(*, quiet: bool) -> Iterator[Watcher | None]:
    """Show a line while the block runs, and remove it afterwards.

    Yields
    ------
    callable or None
        What the solve should tell its progress to; None where nobody watches.
    """
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.live import Live

    line = _Line()
    with Live(line, console=Console(stderr=True), refresh_per_second=5, transient=True):
        yield line.facts.update


class _Line:
    """The latest facts as one line; its clock runs also while a solver is silent."""

    def __init__(self) -> None:
        self.started = time.monotonic()
        self.facts: dict[str, Any] = {"stage": "model"}

    def __rich__(self) -> Text:
        from rich.text import Text

        facts = self.facts
        parts = [f"{time.monotonic() - self.started:6.1f} s", f"{facts['stage']}"]
        for name, *keys in (
            ("columns", "columns"),
            ("LP", "lp"),
            ("bound", "tree_bound", "bound"),
            ("value", "tree_value", "value"),
            ("nodes", "tree_nodes", "nodes"),
        ):
            value = next((facts[key] for key in keys if facts.get(key) is not None), None)
            if value is not None:
                parts.append(f"{name} {value:,.8g}" if isinstance(value, float) else f"{name} {value:,}")
        if facts.get("memory"):
            parts.append(f"{facts['memory'] / 2**30:.2f} GiB")
        return Text("  ".join(parts), no_wrap=True, overflow="ellipsis")

"""What `solve` and `bound` share: run the library function, show progress, write and print the result."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import click

from bcut.cli.exits import exit_status
from bcut.cli.output import emit
from bcut.cli.termination import terminable
from bcut.errors import InputError


def carry_out(
    call: Callable[..., Any],
    *,
    instance: str,
    separator: tuple[str, ...],
    no_separators: bool,
    output: Path | None,
    as_json: bool,
    quiet: bool,
    **options: Any,
) -> int:
    """Call `bcut.solve` or `bcut.bound` with what the user wrote, and report the result.

    Returns
    -------
    int
        The exit status of the program.
    """
    from bcut.cli.progress import progress_line
    from bcut.summary import summary

    if separator and no_separators:
        raise click.UsageError("--separator and --no-separators contradict each other; drop one of them")
    check_output(output, instance)
    separators = [] if no_separators else list(separator) or None
    # Standard output is for the result; what a separator prints is for its author.
    with redirect_stdout(sys.stderr), terminable(), progress_line(quiet=quiet) as on_progress:
        result = call(instance, separators=separators, on_progress=on_progress, **options)
    if output is not None:
        result.save(output)
    if as_json:
        emit(result.to_json())
    elif not quiet:
        emit(summary(result, output))
    return exit_status(result.status)


def check_output(output: Path | None, source: str) -> None:
    """Refuse an output that cannot be written, or that would replace the file that is read.

    Raises
    ------
    InputError
        Before any work is done.
    """
    if output is None:
        return
    from bcut.files.atomic import check_writable

    check_writable(output)
    if os.path.exists(source) and output.exists() and os.path.samefile(source, output):
        raise InputError(f"{output}: is the file that is read; write to another one")

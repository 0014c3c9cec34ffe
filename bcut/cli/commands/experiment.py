"""`bcut experiment`: run, report."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bcut.cli.exits import ExitStatus
from bcut.cli.termination import terminable

if TYPE_CHECKING:
    from bcut.experiments.engine import Progress

_MOST_LISTED = 20


@click.group(short_help="Run many variants on many instances, and report what they did.")
def experiment() -> None:
    """Run a plan of instances and variants, each run a process of its own, and report what they did to the bound."""


@experiment.command("run", short_help="Carry out the runs of a plan that are not stored yet.")
@click.argument("plan", type=click.Path(path_type=Path))
@click.option(
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    required=True,
    metavar="DIR",
    help="Folder for the results; runs that it holds already are skipped.",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="A dask scheduler, such as tcp://10.0.0.1:8786, whose workers carry out the runs.",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Runs at once on this machine; as many as it has cores without this option.",
)
@click.option("--quiet", is_flag=True, help="No progress and no summary: only messages about what failed.")
def run_command(plan: Path, output: Path, scheduler: str | None, workers: int | None, quiet: bool) -> int:
    """Carry out the runs of the file PLAN, and store each in DIR as it ends.

    A run is known by its inputs and by the version of the program. Those that are stored are skipped, so what
    was interrupted, by Ctrl-C, SIGTERM or otherwise, goes on where it was when the command is given again. A run
    that fails loses only itself. Exit status: 0 all is stored, 2 the plan cannot be used, 5 some runs failed, 130
    interrupted.
    """
    from bcut.cli.output import emit
    from bcut.experiments.engine import run_experiment

    with terminable(), _progress_bar(quiet=quiet) as watcher:
        progress = run_experiment(plan, output, scheduler=scheduler, workers=workers, on_progress=watcher)
    for instance, variant, message in progress.failures[:_MOST_LISTED]:
        print(f"failed: {instance}, {variant}: {message}", file=sys.stderr)
    if len(progress.failures) > _MOST_LISTED:
        print(f"and {len(progress.failures) - _MOST_LISTED} more; see {output / 'failed'}", file=sys.stderr)
    if not quiet:
        emit(_summary(progress, output))
    if progress.interrupted:
        return ExitStatus.INTERRUPTED
    return ExitStatus.FAILED if progress.failures else ExitStatus.DONE


@experiment.command("report", short_help="Write tables and a page with figures about the runs of a folder.")
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@click.option(
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="Where to write; DIR/report without this option.",
)
@click.option("--quiet", is_flag=True, help="Do not print what was written.")
def report_command(folder: Path, output: Path | None, quiet: bool) -> int:
    """Write report.html, one page without other files, and its tables as CSV and Parquet, about the runs in DIR.

    Needs matplotlib, jinja2 and pyarrow: pip install "bcut[experiments]".
    """
    from bcut.cli.output import emit
    from bcut.experiments.reporting.report import write_report

    written = write_report(folder, output)
    if not quiet:
        emit("".join(f"{path}\n" for path in written))
    return 0


def _summary(progress: Progress, output: Path) -> str:
    lost = progress.total - progress.stored - progress.done - len(progress.failures)
    parts = [
        f"{progress.total} runs",
        f"{progress.stored} stored before",
        f"{progress.done} done",
        f"{len(progress.failures)} failed",
    ]
    if lost:
        parts.append(f"{lost} not run")
    return f"{output}: " + ", ".join(parts) + "\n"


@contextmanager
def _progress_bar(*, quiet: bool) -> Iterator[Callable[[Progress], None] | None]:
    """Show a bar with an estimate of the time left, on standard error, where that is a terminal."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.progress import Progress as Bar

    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        # Runs differ much in length, so the estimate looks back over a long time.
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
    )
    with Bar(*columns, console=Console(stderr=True), transient=True, speed_estimate_period=600.0) as bar:
        task = bar.add_task("", total=None)

        def watch(progress: Progress) -> None:
            ended = progress.done + len(progress.failures)
            # Runs that were stored before take no time: they do not count.
            failed = f"; {len(progress.failures)} failed" if progress.failures else ""
            bar.update(
                task,
                completed=ended,
                total=progress.total - progress.stored,
                description=f"{progress.last}{failed}",
            )

        yield watch

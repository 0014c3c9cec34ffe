"""`bcut export`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from bcut.cli.options import problem_options


@click.command(short_help="Write the integer program as an LP or MPS file.")
@problem_options
@click.argument("file", type=click.Path(path_type=Path), metavar="FILE.lp|FILE.mps")
def export(instance: str, file: Path, **options: Any) -> int:
    """Write the integer program of INSTANCE to a file that other solvers read; the suffix tells the format.

    INSTANCE is a file of points or a member of a family (`bcut generate --list`). The variable of a simplex
    is called x_v0_v1_..._vd after its vertices.
    """
    from bcut.cli.running import check_output
    from bcut.solving.export import export as call

    check_output(file, instance)
    call(instance, file, **options)
    return 0

"""`bcut region`."""

from __future__ import annotations

from typing import Any

import click

from bcut.cli.options import instance_argument, report_options, time_limit_option


@click.command(short_help="Triangulate what a closed surface bounds, or prove that there is no way.")
@instance_argument
@time_limit_option
@report_options
def region(instance: str, time_limit: float | None, output: Any, as_json: bool, quiet: bool) -> int:
    """Triangulate the region inside the closed surface INSTANCE, without new points.

    INSTANCE is a file with triangles as faces, counterclockwise as seen from outside (.off, .ply, or .json with
    an entry "faces"), or a member of a family of surfaces: schoenhardt, twisted-prism:5, chazelle:2. Status
    optimal: the region has a triangulation, and the one with the fewest tetrahedra is found; infeasible: it has
    none, and the largest volume that can be covered is found. Both are proven exactly (`bcut verify`). Exit
    status 0: settled, either way; 3: a limit came first; 2: the triangles bound no region.
    """
    from bcut.cli.exits import exit_status
    from bcut.cli.output import emit
    from bcut.cli.running import check_output
    from bcut.solving.region import region as call

    check_output(output, instance)
    found = call(instance, time_limit=time_limit)
    if output is not None:
        found.save(output)
    if as_json:
        emit(found.to_json())
    elif not quiet:
        emit(f"{found}\n" + (f"written to {output}\n" if output is not None else ""))
    return exit_status(found.status)

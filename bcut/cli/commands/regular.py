"""`bcut regular`."""

from __future__ import annotations

from pathlib import Path

import click

from bcut.cli.options import json_option, result_argument


@click.command(short_help="Tell whether the triangulation of a result is regular.")
@result_argument
@json_option
def regular(result: Path, as_json: bool) -> int:
    """Tell whether the triangulation in the file RESULT is regular: the lower side of its points' lifted hull.

    A linear program finds heights of the points, or multipliers which prove that there are none; both are checked
    exactly. Exit status 0: decided, either way; 2: the file has no triangulation of a point configuration.
    """
    from bcut.cli.output import emit, emit_json
    from bcut.solving.regularity import regular as call

    found = call(result)
    if as_json:
        emit_json(found.to_dict())
    elif found.heights is not None:
        emit(f"{result}: regular, with the heights {', '.join(map(str, found.heights))}\n")
    else:
        data = found.to_dict()["multipliers"]
        lines = "".join(f"  {value} at {','.join(map(str, facet))}\n" for facet, value in data)
        emit(f"{result}: not regular: the conditions at these facets cancel with these multipliers\n{lines}")
    return 0

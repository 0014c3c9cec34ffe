"""`bcut info`."""

from __future__ import annotations

import click

from bcut.cli.options import instance_argument, json_option


@click.command(short_help="Describe an instance: points, hull, candidate simplices, size of the program.")
@instance_argument
@json_option
def info(instance: str, as_json: bool) -> int:
    """Describe INSTANCE: its points, its convex hull, its candidate simplices and the size of its integer program.

    INSTANCE is a file of points or a member of a family (`bcut generate --list`). Everything is computed,
    nothing is looked up.
    """
    from bcut.cli.output import emit, emit_json, table
    from bcut.solving.information import info as call

    facts = call(instance)
    if as_json:
        emit_json(facts.to_dict())
        return 0
    rows = [
        ("points", f"{facts.points:,} in dimension {facts.dimension}"),
        ("field", facts.field),
        ("subsets", f"{facts.subsets:,} of {facts.dimension + 1} points"),
    ]
    known = facts.combinatorics
    if known is None:
        rows.append(("simplices", f"not listed: {facts.reason}"))
    else:
        every, empty = known.all_simplices, known.empty_simplices
        rows += [
            ("position", "general" if known.general_position else "degenerate"),
            ("hull", f"{known.hull_facets:,} facets, {known.hull_vertices:,} vertices"),
            ("simplices", f"{every.columns:,}; program of {every.rows:,} rows"),
            ("empty ones", f"{empty.columns:,}; program of {empty.rows:,} rows with --spanning"),
        ]
    rows.append(("digest", facts.digest))
    emit(f"{facts.name}\n" + table(rows))
    return 0

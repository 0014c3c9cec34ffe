"""`bcut generate`."""

from __future__ import annotations

from pathlib import Path

import click


@click.command(short_help="Write the points of a family's member, or of a file, in another format.")
@click.argument("instance", required=False)
@click.option(
    "--list", "list_families", is_flag=True, help="Show the families of instances and their parameters."
)
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write to this file instead of standard output; its suffix tells the format.",
)
@click.option(
    "--format",
    "kind",
    type=click.Choice(["json", "dat", "csv", "off"]),
    help="native JSON, TOPCOM, a table, or OFF with the faces of a surface; json where nothing else tells.",
)
def generate(instance: str | None, list_families: bool, output: Path | None, kind: str | None) -> int:
    """Write the points of INSTANCE, exactly, as a file of points; as OFF, with its faces.

    INSTANCE is a member of a family, such as cube:4, or a file of points, which is then converted; a result file is
    one, too. A dash stands for standard input (as JSON) and output, as in `bcut generate cube:3 | bcut solve -`.
    """
    from bcut.cli.output import emit, table
    from bcut.cli.running import check_output

    if list_families:
        if instance is not None:
            raise click.UsageError("--list takes no instance")
        from bcut.families import families

        emit(table([(form, description) for _, form, description in families()], indent=""))
        return 0
    if instance is None:
        raise click.UsageError("name an instance, such as cube:4; `bcut generate --list` shows the families")
    from bcut.files import format_points, write_points
    from bcut.instance import load_instance

    if output == Path("-"):
        output = None
    check_output(output, instance)
    if (kind or (output.suffix[1:].lower() if output is not None else "")) == "off":
        return _write_surface(instance, output)
    configuration = load_instance(instance)
    if output is None:
        emit(format_points(configuration, kind or "json"))
    else:
        write_points(configuration, output, kind=kind or (None if output.suffix else "json"))
    return 0


def _write_surface(instance: str, output: Path | None) -> int:
    from bcut.cli.output import emit
    from bcut.files.atomic import write_text
    from bcut.files.off import format_points
    from bcut.solving.region import load_surface

    text = format_points(*load_surface(instance))
    if output is None:
        emit(text)
    else:
        write_text(output, text)
    return 0

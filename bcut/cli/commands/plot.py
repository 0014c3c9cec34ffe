"""`bcut plot`."""

from __future__ import annotations

from pathlib import Path

import click

from bcut.cli.options import result_argument


@click.command(short_help="Draw the triangulation of a result file (2D or 3D).")
@result_argument
@click.argument("picture", type=click.Path(path_type=Path), metavar="PICTURE.svg|PICTURE.png")
@click.option(
    "--explode",
    type=click.FloatRange(min=0, max=10),
    default=0.35,
    show_default=True,
    metavar="FACTOR",
    help="How far the tetrahedra are moved apart, in units of their distance from the middle; 0 leaves them in place.",
)
@click.option("--labels", is_flag=True, help="Number the points.")
@click.option(
    "--normalize", is_flag=True, help="Undo skewed coordinates: regular polygons and solids look regular."
)
@click.option("--title", metavar="TEXT", help="What to write above the picture.")
def plot(
    result: Path, picture: Path, explode: float, labels: bool, normalize: bool, title: str | None
) -> int:
    """Draw the triangulation of the file RESULT: polygons in 2D, tetrahedra moved apart in 3D.

    Of a region that has none, what is covered is drawn, with the edges of its surface dotted.

    Needs matplotlib: pip install "bcut[plot]".
    """
    from bcut.cli.running import check_output
    from bcut.plotting import plot as call

    check_output(picture, str(result))
    call(result, picture, explode=explode, labels=labels, normalize=normalize, title=title)
    return 0

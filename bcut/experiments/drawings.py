"""The figures that a plan asks for: a measure of the triangulations that its variants end with."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bcut.experiments.cases import with_absolute_path
from bcut.experiments.reading import Table

_KEYS = ("name", "measure", "label", "caption", "variants", "scale")
_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")


@dataclass(frozen=True)
class Drawing:
    """One figure.

    Attributes
    ----------
    name : str
        Of its file, without the ending.
    measure : str
        One of the plan's measures; a file by absolute path.
    label : str
        Of the axis.
    caption : str
    variants : tuple of str
        In this order, from left to right.
    scale : {"linear", "log"}
    """

    name: str
    measure: str
    label: str
    caption: str
    variants: tuple[str, ...]
    scale: str = "linear"


def read_drawings(
    top: Table, measures: Sequence[str], variants: Sequence[str], folder: Path
) -> tuple[Drawing, ...]:
    """Read the figures of a plan.

    Parameters
    ----------
    top : Table
        Of the plan.
    measures : sequence of str
        Of the plan, files by absolute path.
    variants : sequence of str
        Their names.
    folder : path
        Of the plan.

    Raises
    ------
    PlanError
        A figure of a measure or a variant that the plan does not have, or a name that is none for a file.
    """
    drawings: list[Drawing] = []
    for table in top.tables("figures"):
        table.known(*_KEYS)
        name, text = table.text("name"), table.text("measure")
        if not _NAME.fullmatch(name):
            table.refuse("name", f"is for a file, of small letters, digits and hyphens, not '{name}'")
        if any(name == drawing.name for drawing in drawings):
            table.refuse("name", f"'{name}' has been given to another figure")
        measure = with_absolute_path(text, folder)
        if measure not in measures:
            known = (
                f"is one of the plan's measures, {', '.join(measures)}" if measures else "needs 'measures'"
            )
            table.refuse("measure", f"{known}: '{text}' is not listed at the top of the plan")
        shown = table.texts("variants", variants)
        for variant in shown:
            if variant not in variants:
                table.refuse("variants", f"names '{variant}', but the variants are {', '.join(variants)}")
        drawings.append(
            Drawing(
                name,
                measure,
                label=table.text("label", text),
                caption=table.text("caption", f"{text}, by variant."),
                variants=tuple(dict.fromkeys(shown)),
                scale=table.text("scale", "linear", choices=("linear", "log")),
            )
        )
    return tuple(drawings)

"""`plot`: pictures of triangulations, polygons in 2D and tetrahedra in 3D. Needs matplotlib, the extra `plot`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bcut.errors import InputError
from bcut.files.atomic import check_writable, replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bcut.result import Result

Floats = NDArray[np.float64]
Simplices = NDArray[np.int64]

#: Suffixes of picture files, each a format.
PICTURE_SUFFIXES = (".svg", ".png", ".pdf")

# Light colours that differ in brightness too; neighbours get different ones.
_COLOURS = ("#8fc1e3", "#f2b88d", "#a8d5a2", "#e3a5c7", "#f0dc8a", "#b8b0dc")
_INK = "#2b2b33"
_FAINT = "#9a9aa5"
_SIZE_INCHES = 6.0
_VIEW = {"elev": 18.0, "azim": -62.0}


def plot(
    result: Result | Mapping[str, Any] | str | os.PathLike[str],
    picture: str | os.PathLike[str],
    *,
    explode: float = 0.35,
    labels: bool = False,
    normalize: bool = False,
    title: str | None = None,
) -> None:
    """Draw the triangulation of a result.

    Parameters
    ----------
    result : Result, mapping or path
        A result, its data, or its file; of dimension 2 or 3.
    picture : path
        Ends in ".svg", ".png" or ".pdf".
    explode : float
        How far tetrahedra are moved apart, in units of their distance from the middle. With 0 they stay where they
        are and are drawn see-through. Has no effect in 2D.
    labels : bool
        Number the points.
    normalize : bool
        Draw the affine image whose points spread alike in all directions: regular polygons and solids, whose exact
        coordinates may be skewed, look regular again.
    title : str, optional

    Raises
    ------
    InputError
        If there is no triangulation to draw, it has another dimension, the suffix is unknown, the file cannot be
        written, or matplotlib is missing.
    ResultError
        If the result cannot be read.
    """
    from bcut.geometry.configuration import PointConfiguration
    from bcut.verification.reading import load_result

    target = Path(picture)
    if target.suffix not in PICTURE_SUFFIXES:
        known = ", ".join(PICTURE_SUFFIXES)
        raise InputError(f"{target}: unknown suffix '{target.suffix}'; pictures are written as {known}")
    check_writable(target)
    source = result if isinstance(result, Mapping | str | os.PathLike) else result.to_dict()
    data, label = load_result(source)
    if data.triangulation is None:
        raise InputError(f"{label}: has no triangulation to draw (status '{data.status}'); solve the instance")
    if data.dimension not in (2, 3):
        raise InputError(f"{label}: is of dimension {data.dimension}; pictures are drawn in dimension 2 and 3")
    points = PointConfiguration.from_values(data.points, name=data.name, origin=label).floats
    simplices = np.array(data.triangulation, dtype=np.int64)
    if simplices.shape[1:] != (data.dimension + 1,) or simplices.min() < 0 or simplices.max() >= len(points):
        raise InputError(f"{label}: its triangulation does not fit its points; check it with bcut verify")
    figure = _figure(label)
    draw = _draw_plane if data.dimension == 2 else _draw_space
    draw(figure, _round_image(points) if normalize else points, simplices, explode, labels)
    if title:
        figure.suptitle(title, fontsize=13, color=_INK)
    with replacing(target) as temporary:
        # Without a date the same result gives the same file.
        metadata = {"Date": None} if target.suffix == ".svg" else None
        figure.savefig(temporary, dpi=150, metadata=metadata, bbox_inches="tight", pad_inches=0.05)


def _figure(label: str) -> Figure:
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise InputError(f"{label}: pictures need matplotlib; install it by pip install 'bcut[plot]'") from None
    return Figure(figsize=(_SIZE_INCHES, _SIZE_INCHES))


def _round_image(points: Floats) -> Floats:
    """Return the affine image with the identity as its covariance matrix."""
    centred = points - points.mean(axis=0)
    values, vectors = np.linalg.eigh(centred.T @ centred / len(points))
    image: Floats = centred @ (vectors / np.sqrt(values)) @ vectors.T
    return image


def _neighbour_colours(simplices: Simplices) -> list[str]:
    """Give each simplex the first colour that no neighbour across a facet has yet."""
    across: dict[tuple[int, ...], list[int]] = {}
    for number, simplex in enumerate(simplices.tolist()):
        for facet in combinations(simplex, len(simplex) - 1):
            across.setdefault(facet, []).append(number)
    neighbours: list[set[int]] = [set() for _ in simplices]
    for pair in across.values():
        for number in pair:
            neighbours[number].update(pair)
    chosen: list[int] = []
    for number in range(len(simplices)):
        taken = {chosen[other] for other in neighbours[number] if other < number}
        chosen.append(next(colour for colour in range(len(_COLOURS)) if colour not in taken))
    return [_COLOURS[colour] for colour in chosen]


def _draw_plane(figure: Figure, points: Floats, simplices: Simplices, explode: float, labels: bool) -> None:
    from matplotlib.collections import PolyCollection

    axes = figure.add_subplot()
    triangles = PolyCollection(
        list(points[simplices]), facecolors=_neighbour_colours(simplices), edgecolors=_INK, linewidths=0.9
    )
    axes.add_collection(triangles)
    used = np.isin(np.arange(len(points)), simplices)
    axes.scatter(*points[used].T, s=22, color=_INK, zorder=3)
    axes.scatter(*points[~used].T, s=22, facecolor="white", edgecolor=_INK, zorder=3)
    if labels:
        for number, point in enumerate(points):
            axes.annotate(str(number), point, xytext=(4, 4), textcoords="offset points", fontsize=8, color=_INK)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")


def _draw_space(figure: Figure, points: Floats, simplices: Simplices, explode: float, labels: bool) -> None:
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

    axes: Any = figure.add_subplot(projection="3d")
    corners = points[simplices]
    middles = corners.mean(axis=1, keepdims=True)
    corners = corners + explode * (middles - points.mean(axis=0))
    faces = np.concatenate([np.delete(corners, vertex, axis=1) for vertex in range(4)])
    solid = explode > 0
    axes.add_collection3d(
        Poly3DCollection(
            faces,
            facecolors=_neighbour_colours(simplices) * 4,
            edgecolors=_INK,
            linewidths=0.6,
            alpha=0.92 if solid else 0.12,
            shade=solid,
        )
    )
    if solid:
        # The edges of the whole, faint, show where the pieces belong.
        edges = np.array(sorted({edge for simplex in simplices.tolist() for edge in combinations(simplex, 2)}))
        axes.add_collection3d(Line3DCollection(points[edges], colors=_FAINT, linewidths=0.3, alpha=0.5))
    else:
        axes.scatter(*points.T, s=14, color=_INK, depthshade=False)
    if labels:
        for number, point in enumerate(points):
            axes.text(*point, f" {number}", fontsize=8, color=_INK)
    low, high = corners.reshape(-1, 3).min(axis=0), corners.reshape(-1, 3).max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=1.35)
    axes.view_init(**_VIEW)
    axes.set_axis_off()

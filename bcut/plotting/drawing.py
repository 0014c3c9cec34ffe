"""Drawing with matplotlib: polygons in the plane, tetrahedra in orthographic projection."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bcut.plotting.depth import back_to_front

Floats = NDArray[np.float64]
Simplices = NDArray[np.int64]

# Light colours that differ in brightness too; neighbours get different ones.
_COLOURS = ("#8fc1e3", "#f4b98a", "#a9d8a0", "#e6a8c9", "#f2dd86", "#bab2e0")
INK = "#2b2b33"
_SEE_THROUGH = 0.14

# Orthonormal: to the right, up, and towards the viewer.
_AZIMUTH, _ELEVATION = np.radians(-58.0), np.radians(20.0)
_RIGHT = np.array([-np.sin(_AZIMUTH), np.cos(_AZIMUTH), 0.0])
TOWARDS = np.array(
    [np.cos(_AZIMUTH) * np.cos(_ELEVATION), np.sin(_AZIMUTH) * np.cos(_ELEVATION), np.sin(_ELEVATION)]
)
_UP = np.cross(TOWARDS, _RIGHT)
_LIGHT = (TOWARDS + 0.9 * _UP - 0.5 * _RIGHT) / np.linalg.norm(TOWARDS + 0.9 * _UP - 0.5 * _RIGHT)


def draw_plane(figure: Figure, points: Floats, triangles: Simplices, *, labels: bool) -> None:
    """Draw a triangulation of points in the plane; points that it does not use are hollow.

    Parameters
    ----------
    figure : Figure
    points : ndarray of float, shape (n, 2)
    triangles : ndarray of int, shape (m, 3)
    labels : bool
        Number the points.
    """
    axes = figure.add_subplot()
    colours = neighbour_colours(triangles)
    axes.add_collection(
        PolyCollection(list(points[triangles]), facecolors=colours, edgecolors=INK, linewidths=0.9)
    )
    used = np.isin(np.arange(len(points)), triangles)
    axes.scatter(points[used, 0], points[used, 1], s=22, color=INK, zorder=3)
    axes.scatter(points[~used, 0], points[~used, 1], s=22, facecolor="white", edgecolor=INK, zorder=3)
    finish(axes, points, labels)


def draw_space(
    figure: Figure,
    points: Floats,
    tetrahedra: Simplices,
    *,
    outline: Simplices,
    explode: float,
    labels: bool,
) -> None:
    """Draw a triangulation of points in space, its tetrahedra moved apart, or see-through where they are not.

    Parameters
    ----------
    figure : Figure
    points : ndarray of float, shape (n, 3)
    tetrahedra : ndarray of int, shape (m, 4)
    outline : ndarray of int, shape (k, 2)
        Edges to draw behind them, where they are in fact.
    explode : float
        How far they are moved, in units of their distance from the middle.
    labels : bool
        Number the points.
    """
    axes = figure.add_subplot()
    corners = points[tetrahedra]
    corners = corners + explode * (corners.mean(axis=1, keepdims=True) - points.mean(axis=0))
    colours = neighbour_colours(tetrahedra)
    faces, fills = [], []
    for number in back_to_front(corners, TOWARDS):
        for vertex in range(4):
            face = np.delete(corners[number], vertex, axis=0)
            normal = _outer_normal(face, corners[number, vertex])
            if explode and normal @ TOWARDS <= 0:
                continue
            brightness = 0.72 + 0.28 * max(0.0, float(normal @ _LIGHT))
            faces.append(projected(face))
            shade = [brightness * part for part in to_rgb(colours[number])]
            fills.append((*shade, 1.0 if explode else _SEE_THROUGH))
    axes.add_collection(
        PolyCollection(faces, facecolors=fills, edgecolors=INK, linewidths=0.7, joinstyle="round")
    )
    flat = projected(points)
    axes.add_collection(
        LineCollection(list(flat[outline]), colors=INK, linewidths=0.8, linestyles="dotted", zorder=0)
    )
    if not explode:
        axes.scatter(flat[:, 0], flat[:, 1], s=18, color=INK, zorder=3)
    finish(axes, flat, labels)


def neighbour_colours(simplices: Simplices) -> list[str]:
    """Give each simplex the least used colour that no neighbour across a facet has yet."""
    across: dict[tuple[int, ...], list[int]] = {}
    for number, simplex in enumerate(simplices.tolist()):
        for facet in combinations(sorted(simplex), len(simplex) - 1):
            across.setdefault(facet, []).append(number)
    neighbours: list[set[int]] = [set() for _ in simplices]
    for sharing in across.values():
        for number in sharing:
            neighbours[number].update(sharing)
    chosen: list[int] = []
    uses = [0] * len(_COLOURS)
    for number in range(len(simplices)):
        taken = {chosen[other] for other in neighbours[number] if other < number}
        # A list of simplices that is no triangulation may leave no colour free.
        free = [colour for colour in range(len(_COLOURS)) if colour not in taken] or [0]
        colour = min(free, key=uses.__getitem__)
        uses[colour] += 1
        chosen.append(colour)
    return [_COLOURS[colour] for colour in chosen]


def projected(points: Floats) -> Floats:
    """Return points of space as the viewer sees them, in the plane."""
    flat: Floats = np.stack((points @ _RIGHT, points @ _UP), axis=-1)
    return flat


def _outer_normal(face: Floats, opposite: Floats) -> Floats:
    normal = np.cross(face[1] - face[0], face[2] - face[0])
    normal = normal / (np.linalg.norm(normal) or 1.0)
    return normal if normal @ (opposite - face[0]) < 0 else -normal


def finish(axes: Axes, points: Floats, labels: bool) -> None:
    """Fit the axes to what was drawn, and number the points where that is wanted."""
    if labels:
        for number, point in enumerate(points):
            axes.annotate(
                str(number), tuple(point), xytext=(4, 4), textcoords="offset points", fontsize=8, color=INK
            )
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")

"""Pictures of a fractional point with a cut that it violates, in the plane and in space."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from bcut.plotting.drawing import INK, Floats, Simplices, finish, projected

#: Simplices with a positive coefficient, and with a negative one.
POSITIVE, NEGATIVE = "#d1603d", "#3d7ea6"
_FAINT = "#9a9aa5"
_FACE = "#111111"
# How far tetrahedra of a cut shrink towards their middle, so that one can be told from the next.
_SHRINK = 0.9


def draw_violated_cut(
    figure: Figure,
    points: Floats,
    simplices: Simplices,
    values: Floats,
    coefficients: Floats,
    *,
    face: Sequence[int] = (),
    labels: bool = True,
) -> None:
    """Draw the support of a fractional point, and the simplices of a cut on it.

    Parameters
    ----------
    figure : Figure
    points : ndarray of float, shape (n, 2) or (n, 3)
    simplices : ndarray of int, shape (m, d + 1)
        The support.
    values : ndarray of float, shape (m,)
        Positive; larger ones are drawn stronger.
    coefficients : ndarray of float, shape (m,)
        Of the cut, zero where it does not contain the simplex.
    face : sequence of int
        Points that the cut is about, such as the face of a link cut.
    labels : bool
        Number the points.
    """
    axes = figure.add_subplot()
    if points.shape[1] == 2:
        flat = points
        _draw_triangles(axes, points, simplices, values, coefficients)
    else:
        flat = projected(points)
        _draw_tetrahedra(axes, points, simplices, values, coefficients)
    axes.scatter(flat[:, 0], flat[:, 1], s=14, color=INK, zorder=4)
    if len(face):
        around = flat[list(face)]
        axes.plot(around[:, 0], around[:, 1], color=_FACE, linewidth=3.0, zorder=5, solid_capstyle="round")
        axes.scatter(around[:, 0], around[:, 1], s=42, color=_FACE, zorder=5)
    _legend(axes, coefficients, face)
    finish(axes, flat, labels)


def _draw_triangles(
    axes: Axes, points: Floats, triangles: Simplices, values: Floats, coefficients: Floats
) -> None:
    order = np.argsort(coefficients != 0, kind="stable")
    corners = points[triangles[order]]
    fills = [_fill(values[i], coefficients[i]) for i in order]
    axes.add_collection(PolyCollection(list(corners), facecolors=fills, edgecolors="none", zorder=1))
    edges = {tuple(edge) for triangle in triangles.tolist() for edge in combinations(triangle, 2)}
    axes.add_collection(
        LineCollection([points[list(edge)] for edge in edges], colors=_FAINT, linewidths=0.7, zorder=2)
    )
    chosen = corners[coefficients[order] != 0]
    axes.add_collection(
        PolyCollection(list(chosen), facecolors="none", edgecolors=INK, linewidths=1.1, zorder=3)
    )


def _draw_tetrahedra(
    axes: Axes, points: Floats, tetrahedra: Simplices, values: Floats, coefficients: Floats
) -> None:
    edges = {tuple(edge) for simplex in tetrahedra.tolist() for edge in combinations(simplex, 2)}
    flat = projected(points)
    axes.add_collection(
        LineCollection([flat[list(edge)] for edge in edges], colors=_FAINT, linewidths=0.6, zorder=1)
    )
    for number in np.flatnonzero(coefficients).tolist():
        corners = points[tetrahedra[number]]
        middle = corners.mean(axis=0)
        shrunk = projected(middle + _SHRINK * (corners - middle))
        axes.add_collection(
            PolyCollection(
                [shrunk[list(triangle)] for triangle in combinations(range(4), 3)],
                facecolors=[_fill(0.5 * values[number], coefficients[number])],
                edgecolors=_colour(coefficients[number]),
                linewidths=0.9,
                zorder=2,
            )
        )


def _colour(coefficient: float) -> str:
    return POSITIVE if coefficient > 0 else NEGATIVE if coefficient < 0 else _FAINT


def _fill(value: float, coefficient: float) -> tuple[str, float]:
    strength = 0.75 if coefficient else 0.25
    return _colour(coefficient), float(min(1.0, strength * value))


def _legend(axes: Axes, coefficients: Floats, face: Sequence[int]) -> None:
    entries: list[Patch | Line2D] = []
    if (coefficients > 0).any():
        entries.append(Patch(color=POSITIVE, alpha=0.6, label="in the cut, coefficient > 0"))
    if (coefficients < 0).any():
        entries.append(Patch(color=NEGATIVE, alpha=0.6, label="in the cut, coefficient < 0"))
    entries.append(Line2D([], [], color=_FAINT, label="rest of the fractional point"))
    if len(face):
        entries.append(Line2D([], [], color=_FACE, linewidth=3.0, marker="o", label="the face of the cut"))
    axes.legend(
        handles=entries, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=2, frameon=False, fontsize=9
    )

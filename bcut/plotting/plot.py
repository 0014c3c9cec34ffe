"""`plot`: from a result to a picture file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bcut.errors import InputError
from bcut.files.atomic import check_writable, replacing
from bcut.geometry.configuration import PointConfiguration
from bcut.verification.reading import ResultData, load_result, plain_data
from bcut.verification.region import verify_region

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bcut.result import Result
    from bcut.solving.region import RegionResult

#: Suffixes of picture files, each a format.
PICTURE_SUFFIXES = (".svg", ".png", ".pdf")

_SIZE_INCHES = 6.0


def plot(
    result: Result | RegionResult | Mapping[str, Any] | str | os.PathLike[str],
    picture: str | os.PathLike[str],
    *,
    explode: float = 0.35,
    labels: bool = False,
    normalize: bool = False,
    title: str | None = None,
) -> None:
    """Draw the triangulation of a result, or what is covered of a region.

    Parameters
    ----------
    result : Result, RegionResult, mapping or path
        A result, its data, or its file; of dimension 2 or 3.
    picture : path
        Ends in ".svg", ".png" or ".pdf".
    explode : float
        How far tetrahedra are moved apart, in units of their distance from the middle. With 0 they stay where
        they are and are drawn see-through. Has no effect in 2D.
    labels : bool
        Number the points.
    normalize : bool
        Draw the affine image whose points spread alike in all directions: regular polygons and solids, whose
        exact coordinates may be skewed, look regular again.
    title : str, optional

    Raises
    ------
    InputError
        If there is no triangulation to draw, it has another dimension, the suffix is unknown, the file cannot
        be written, or matplotlib is missing.
    ResultError
        If the result cannot be read.
    VerificationError
        If the result is about a region and does not hold.
    """
    target = Path(picture)
    if target.suffix not in PICTURE_SUFFIXES:
        known = ", ".join(PICTURE_SUFFIXES)
        raise InputError(f"{target}: unknown suffix '{target.suffix}'; pictures are written as {known}")
    check_writable(target)
    drawn = _drawn(result)
    points = _round_image(drawn.points) if normalize else drawn.points
    figure = _figure()
    from bcut.plotting.drawing import draw_plane, draw_space

    if points.shape[1] == 2:
        draw_plane(figure, points, drawn.simplices, labels=labels)
    else:
        draw_space(figure, points, drawn.simplices, outline=drawn.outline, explode=explode, labels=labels)
    if title:
        figure.suptitle(title, fontsize=13)
    from matplotlib import rc_context

    # Without a date, and with names that are no random numbers, the same result gives the same file.
    metadata = {"Date": None} if target.suffix == ".svg" else None
    with replacing(target) as temporary, rc_context({"svg.hashsalt": "bcut"}):
        figure.savefig(temporary, dpi=150, metadata=metadata, bbox_inches="tight", pad_inches=0.05)


@dataclass(frozen=True, eq=False)
class _Drawn:
    """What a picture shows: points, simplices, and the edges of the surface around a region."""

    points: NDArray[np.float64]
    simplices: NDArray[np.int64]
    outline: NDArray[np.int64]


def _drawn(result: Result | RegionResult | Mapping[str, Any] | str | os.PathLike[str]) -> _Drawn:
    """Read what there is to draw."""
    data, label = plain_data(result)
    if isinstance(data, Mapping) and data.get("kind") == "region":
        return _drawn_region(data, label)
    return _drawn_triangulation(*load_result(result))


def _drawn_triangulation(data: ResultData, label: str) -> _Drawn:
    if data.triangulation is None:
        raise InputError(
            f"{label}: has no triangulation to draw (status '{data.status}'); solve the instance"
        )
    if data.dimension not in (2, 3):
        raise InputError(
            f"{label}: is of dimension {data.dimension}; pictures are drawn in dimension 2 and 3"
        )
    points = PointConfiguration.from_values(data.points, name=data.name, origin=label).floats
    if points.shape[1] != data.dimension:
        raise InputError(f"{label}: its triangulation does not fit its points; `bcut verify` says why")
    simplices = _fitting(data.triangulation, data.dimension + 1, len(points), label)
    return _Drawn(points, simplices, np.empty((0, 2), dtype=np.int64))


def _drawn_region(data: Mapping[str, Any], label: str) -> _Drawn:
    found = verify_region(data, label)
    if not found.covered:
        raise InputError(f"{label}: nothing of the region is covered, so there are no tetrahedra to draw")
    instance = data["instance"]
    points = PointConfiguration.from_values(instance["points"], name=instance["name"], origin=label).floats
    edges = {pair for face in instance["faces"] for pair in combinations(sorted(face), 2)}
    return _Drawn(points, np.array(data["triangulation"], dtype=np.int64), np.array(sorted(edges)))


def _fitting(listed: list[list[int]], size: int, n: int, label: str) -> NDArray[np.int64]:
    """Return simplices as an array; refuse what cannot be drawn."""
    fits = all(
        len(simplex) == len(set(simplex)) == size and min(simplex) >= 0 and max(simplex) < n
        for simplex in listed
    )
    if not fits or not listed:
        raise InputError(f"{label}: its triangulation does not fit its points; `bcut verify` says why")
    return np.array(listed, dtype=np.int64)


def _figure() -> Figure:
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise InputError("pictures need matplotlib; install it by pip install 'bcut[plot]'") from None
    return Figure(figsize=(_SIZE_INCHES, _SIZE_INCHES))


def _round_image(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the affine image with the identity as its covariance matrix."""
    centred = points - points.mean(axis=0)
    values, vectors = np.linalg.eigh(centred.T @ centred / len(points))
    image: NDArray[np.float64] = centred @ (vectors / np.sqrt(values)) @ vectors.T
    return image

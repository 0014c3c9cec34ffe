"""Regular polygons, prisms and antiprisms, as affine images with coordinates in the smallest field.

sin(k t) / sin(t) is a polynomial in cos(t), so dividing the second coordinate by sin(t) leaves cosines only;
all triangulations are the same, lengths and angles are not.
"""

from __future__ import annotations

from fractions import Fraction

from bcut.families.parameters import Parameters
from bcut.geometry.numbers import AlgebraicNumber, parse_number

Number = int | Fraction | AlgebraicNumber


def polygon(parameters: Parameters) -> list[list[Number]]:
    """Vertices of a regular m-gon in order, then its centre if asked for."""
    m = parameters.integer("M", 3)
    center = parameters.flag("center")
    parameters.finish(m + center, 2)
    return [*circle(m), [0, 0]] if center else circle(m)


def prism(parameters: Parameters) -> list[list[Number]]:
    """Bottom m-gon in order, then the top one, above it."""
    m = parameters.integer("M", 3)
    parameters.finish(2 * m, 3)
    return [[*point, height] for height in (0, 1) for point in circle(m)]


def antiprism(parameters: Parameters) -> list[list[Number]]:
    """Bottom m-gon in order, then the top one, turned by half a step."""
    m = parameters.integer("M", 3)
    parameters.finish(2 * m, 3)
    points = circle(2 * m)
    return [[*point, 0] for point in points[::2]] + [[*point, 1] for point in points[1::2]]


def circle(m: int) -> list[list[Number]]:
    """Return the points (2 cos(k t), sin(k t) / sin(t)), t = 2 pi / m, k = 0 ... m - 1.

    Raises
    ------
    ConfigurationError
        cos(2 pi / m) has too large a degree.
    """
    double_cosine = parse_number(f"2*cos(2*pi/{m})")
    points: list[list[Number]] = [[2, 0], [double_cosine, 1]]
    while len(points) < m:  # both coordinates satisfy z_(k+1) = 2 cos(t) z_k - z_(k-1)
        points.append([double_cosine * a - b for a, b in zip(points[-1], points[-2], strict=True)])
    return points

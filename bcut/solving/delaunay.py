"""The Delaunay triangulation of a configuration, checked exactly."""

from __future__ import annotations

from bcut.errors import InputError, VerificationError
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.delaunay import qhull_simplices
from bcut.verification.delaunay import check_delaunay


def delaunay_triangulation(configuration: PointConfiguration) -> list[list[int]]:
    """Return the Delaunay triangulation; one of them, where more than d + 1 points lie on an empty sphere.

    Parameters
    ----------
    configuration : PointConfiguration

    Returns
    -------
    list of list of int
        Ascending vertices. They triangulate the hull, use every point, and no point is inside the sphere through
        any of them, all in exact arithmetic.

    Raises
    ------
    InputError
        Qhull, which works in floating point, finds none that exact arithmetic confirms: there are points on a common
        sphere or nearly so.
    """
    found = qhull_simplices(configuration)
    if found is None:
        raise InputError(f"{configuration.name}: Qhull finds no Delaunay triangulation of these points")
    simplices: list[list[int]] = found.tolist()
    try:
        check_delaunay(configuration.scalars(), simplices)
    except VerificationError as error:
        raise InputError(
            f"{configuration.name}: what Qhull finds in floating point is not its Delaunay triangulation ({error}); "
            "there are points on a common sphere or nearly so, move them a little"
        ) from None
    return simplices

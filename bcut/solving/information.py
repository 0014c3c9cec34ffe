"""`info`: what can be said of an instance before it is solved."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import comb, gcd
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bcut.errors import TooLargeError
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.simplices import candidate_simplices
from bcut.geometry.subsets import ranks, without
from bcut.instance import load_instance

if TYPE_CHECKING:
    from bcut.solving.options import InstanceLike


@dataclass(frozen=True)
class ProgramSize:
    """Size of Formulation 2: candidate simplices are its columns."""

    columns: int
    rows: int


@dataclass(frozen=True)
class Combinatorics:
    """What the chirotope tells.

    Attributes
    ----------
    general_position : bool
        Whether no d + 1 points lie on a common hyperplane.
    hull_facets, hull_vertices : int
        Of the convex hull; points inside its faces are no vertices.
    all_simplices, empty_simplices : ProgramSize
        With every d-simplex, and with those only that a spanning triangulation can use.
    """

    general_position: bool
    hull_facets: int
    hull_vertices: int
    all_simplices: ProgramSize
    empty_simplices: ProgramSize


@dataclass(frozen=True)
class Information:
    """Facts about an instance.

    Attributes
    ----------
    name, digest : str
    points, dimension : int
    field : str
        The number field of the coordinates.
    subsets : int
        Number of (d+1)-subsets of the points, flat ones included.
    combinatorics : Combinatorics or None
        None where the subsets are too many to be listed; `reason` then says so.
    """

    name: str
    points: int
    dimension: int
    field: str
    digest: str
    subsets: int
    combinatorics: Combinatorics | None
    reason: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return the facts as plain data."""
        return asdict(self)


def info(instance: InstanceLike) -> Information:
    """Describe an instance: its points, its hull, its candidate simplices, the size of its program.

    Parameters
    ----------
    instance : str, path, points or PointConfiguration

    Raises
    ------
    BcutError
        If the instance cannot be read.
    """
    configuration = load_instance(instance)
    n, d = configuration.n, configuration.dimension
    combinatorics, reason = None, None
    try:
        combinatorics = _combinatorics(Chirotope.of(configuration))
    except TooLargeError as error:
        reason = str(error)
    return Information(
        name=configuration.name,
        points=n,
        dimension=d,
        field=_field_name(configuration),
        digest=configuration.digest,
        subsets=comb(n, d + 1),
        combinatorics=combinatorics,
        reason=reason,
    )


def _combinatorics(chirotope: Chirotope) -> Combinatorics:
    return Combinatorics(
        general_position=chirotope.is_general,
        hull_facets=len(chirotope.hull_facets),
        hull_vertices=_hull_vertices(chirotope),
        all_simplices=_program_size(chirotope, chirotope.bases),
        empty_simplices=_program_size(chirotope, candidate_simplices(chirotope, spanning=True)),
    )


def _hull_vertices(chirotope: Chirotope) -> int:
    """Count the points that no other point shares all its hull facets with."""
    incidence = np.zeros((chirotope.n, len(chirotope.hull_facets)), dtype=bool)
    for facet, points in enumerate(chirotope.hull_facets):
        incidence[list(points), facet] = True
    vertices = 0
    for point in range(chirotope.n):
        on_facets = incidence[point]
        on_all_of_them = incidence[:, on_facets].all(axis=1)
        vertices += bool(on_facets.any() and on_all_of_them.sum() == 1)
    return vertices


def _program_size(chirotope: Chirotope, simplices: NDArray[np.int64]) -> ProgramSize:
    """Count the rows of Formulation 2 without building it: interior (d-1)-simplices of candidates, and the coverage."""
    is_used = np.zeros(len(chirotope.facet_is_interior), dtype=bool)
    for position in range(simplices.shape[1]):
        is_used[ranks(without(simplices, position), chirotope.n)] = True
    return ProgramSize(len(simplices), 1 + int((is_used & chirotope.facet_is_interior).sum()))


def _field_name(configuration: PointConfiguration) -> str:
    """Write the field with as few generators as its square roots need, such as "Q(cos(2*pi/7), sqrt(2))"."""
    field = configuration.field
    generators = [] if field.order == 1 else [f"cos(2*pi/{field.order})"]
    generated = {1}
    for radicand in field.radicands:
        if radicand not in generated:
            generators.append(f"sqrt({radicand})")
            generated |= {radicand * other // gcd(radicand, other) ** 2 for other in generated}
    return f"Q({', '.join(generators)})" if generators else "Q"

"""Families of instances by name: `cube:4`, `random:30,3,seed=7`, `dodecahedron`."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from bcut.errors import ConfigurationError, InputError
from bcut.families import combinatorial, polygons, random_points
from bcut.families.parameters import Parameters
from bcut.families.solids import SOLIDS, solid
from bcut.families.surfaces import points_of
from bcut.geometry.configuration import PointConfiguration


@dataclass(frozen=True, slots=True)
class Family:
    """One family of configurations.

    Attributes
    ----------
    name : str
        What stands before the colon.
    form : str
        Name and parameters in general, such as "random:N,D,seed=S".
    example : str
        One member.
    description : str
        One line.
    build : callable
        Takes the parameters and returns the points, as `PointConfiguration.from_values` takes them.
    """

    name: str
    form: str
    example: str
    description: str
    build: Callable[[Parameters], Any]


_FAMILIES = [
    Family("cube", "cube:D", "cube:4", "vertices of the D-dimensional 0/1 cube", combinatorial.cube),
    Family(
        "cross-polytope",
        "cross-polytope:D",
        "cross-polytope:4",
        "the 2 D points +e_i and -e_i",
        combinatorial.cross_polytope,
    ),
    Family(
        "cyclic",
        "cyclic:N,D",
        "cyclic:9,3",
        "N points of the moment curve in dimension D",
        combinatorial.cyclic,
    ),
    Family(
        "simplex-product",
        "simplex-product:A,B,...",
        "simplex-product:2,1,1",
        "product of simplices of dimensions A, B, ...",
        combinatorial.simplex_product,
    ),
    Family(
        "hypersimplex",
        "hypersimplex:N,K",
        "hypersimplex:6,2",
        "0/1 vectors of length N with K ones, in dimension N - 1",
        combinatorial.hypersimplex,
    ),
    Family("grid", "grid:A,B,...", "grid:3,3,3", "integer grid of A x B x ... points", combinatorial.grid),
    Family(
        "polygon",
        "polygon:M[,center]",
        "polygon:5,center",
        "regular M-gon, with its centre",
        polygons.polygon,
    ),
    Family("prism", "prism:M", "prism:6", "prism over a regular M-gon", polygons.prism),
    Family("antiprism", "antiprism:M", "antiprism:5", "regular antiprism of two M-gons", polygons.antiprism),
    Family("moae", "moae", "moae", "two nested triangles, no three points on a line", combinatorial.moae),
    Family(
        "random",
        "random:N,D[,seed=S]",
        "random:30,3,seed=7",
        "N uniform points of the unit cube in dimension D",
        random_points.uniform,
    ),
    Family(
        "sphere",
        "sphere:N,D[,seed=S]",
        "sphere:30,3,seed=7",
        "N points in uniform directions on the unit sphere in dimension D",
        random_points.on_sphere,
    ),
    Family(
        "schoenhardt",
        "schoenhardt",
        "schoenhardt",
        "Schönhardt's polyhedron (bcut region): points of a twisted triangular prism",
        points_of("schoenhardt"),
    ),
    Family(
        "twisted-prism",
        "twisted-prism:M[,twist=T][,seed=S]",
        "twisted-prism:5,twist=18,seed=3",
        "prism with concave sides (bcut region), turned by T degrees, irregular with a seed other than 0",
        points_of("twisted-prism"),
    ),
    Family(
        "chazelle",
        "chazelle:K",
        "chazelle:2",
        "box with K notches from each of two sides (bcut region) along a saddle",
        points_of("chazelle"),
    ),
    *[Family(name, name, name, description, solid(name)) for name, (description, _) in SOLIDS.items()],
]

#: Name -> family.
FAMILIES = {family.name: family for family in _FAMILIES}


def families() -> list[tuple[str, str, str]]:
    """Name, form and one-line description of every family."""
    return [(family.name, family.form, family.description) for family in _FAMILIES]


def is_family(text: str) -> bool:
    """Whether the part before the colon names a family."""
    return text.partition(":")[0].strip() in FAMILIES


def build(text: str) -> PointConfiguration:
    """Build a member of a family.

    Parameters
    ----------
    text : str
        Such as "cube:4" or "random:30,3,seed=7". The configuration's name is this text in a normal form.

    Raises
    ------
    InputError
        No such family, or parameters that it does not take.
    """
    head, colon, tail = text.partition(":")
    name = head.strip()
    if name not in FAMILIES:
        close = difflib.get_close_matches(name, FAMILIES, n=3)
        hint = f"did you mean {' or '.join(close)}?" if close else f"there are {', '.join(FAMILIES)}"
        raise InputError(f"there is no family '{name[:60]}'; {hint}")
    family = FAMILIES[name]
    parameters = Parameters(name, family.form, family.example, tail)
    if colon and not tail.strip():
        parameters.fail("nothing follows the colon")
    try:
        values = family.build(parameters)
    except ConfigurationError as error:
        raise ConfigurationError(f"family '{text}': {error}") from None
    return PointConfiguration.from_values(values, name=parameters.name)

"""Triangulations that have some faces and lack others, as a condition on single simplices.

A *face* here is any affinely independent set of points, from single points to d-simplices; a triangulation has it if
one of its simplices contains all of them as vertices.

- It lacks f if and only if no chosen simplex has all points of f among its vertices.
- It has f if and only if no chosen simplex meets f improperly, that is, in something that is not a common (possibly
  empty) face of the two. If f is in a triangulation T, it meets all of T in common faces, since T is a simplicial
  complex. Conversely let p be a point in the relative interior of f. Since T covers the hull, some t in T contains p.
  If t meets f in a common face, that is a face of f with p in it, so it is f itself, and f is a face of t. This needs
  no general position.
- It is a *star* of the point p if all its simplices have p as a vertex.

So each condition says which d-simplices may be chosen and nothing else: it only takes columns away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from operator import index

import numpy as np
from numpy.typing import NDArray

from bcut.errors import InputError
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.crossings import crossing_matrix
from bcut.geometry.overlaps import overlap_matrix

Face = tuple[int, ...]


@dataclass(frozen=True)
class Restrictions:
    """What a triangulation must have and must not have.

    Attributes
    ----------
    require, forbid : tuple of tuple of int
        Faces, each with ascending vertices.
    star : int, optional
        A point that all simplices must have as a vertex.
    """

    require: tuple[Face, ...] = ()
    forbid: tuple[Face, ...] = ()
    star: int | None = None

    def __bool__(self) -> bool:
        return bool(self.require or self.forbid or self.star is not None)

    @classmethod
    def of(
        cls,
        configuration: PointConfiguration,
        *,
        require: Sequence[Sequence[int]] = (),
        forbid: Sequence[Sequence[int]] = (),
        star: int | None = None,
    ) -> Restrictions:
        """Check what a user wrote.

        Raises
        ------
        InputError
            If an index is no point, a face repeats a point, or has too many.
        """
        if star is not None:
            _checked((star,), configuration, "star")
        return cls(
            tuple(sorted({_checked(face, configuration, "require") for face in require})),
            tuple(sorted({_checked(face, configuration, "forbid") for face in forbid})),
            star,
        )

    def allowed(
        self,
        configuration: PointConfiguration,
        chirotope: Chirotope,
        simplices: NDArray[np.int64],
        *,
        dissection: bool = False,
    ) -> NDArray[np.bool_]:
        """Tell which simplices may be chosen, shape (m,).

        Parameters
        ----------
        configuration : PointConfiguration
        chirotope : Chirotope
        simplices : ndarray of int64, shape (m, d + 1)
        dissection : bool
            Required simplices then exclude those that they overlap; required faces of smaller dimensions mean nothing
            there, unless the points are in general position, where every dissection is a triangulation.

        Raises
        ------
        InputError
            If a face is affinely dependent, so that no simplex has it; or is required of a dissection.
        """
        keep = np.ones(len(simplices), dtype=bool)
        for face in (*self.require, *self.forbid):
            if not np.isin(chirotope.bases, face).sum(axis=1).max(initial=0) >= len(face):
                raise InputError(
                    f"{configuration.name}: the points {_text(face)} are affinely dependent, so they are no face "
                    "of any simplex; leave one of them out"
                )
        for face in self.require:
            if dissection and len(face) <= chirotope.dimension and not chirotope.is_general:
                raise InputError(
                    f"{configuration.name}: --require {_text(face)}: a dissection need not meet a face in common "
                    f"faces, so only simplices with {chirotope.dimension + 1} points can be required of it"
                )
            relation = overlap_matrix if dissection and not chirotope.is_general else crossing_matrix
            keep &= ~relation(chirotope, np.array([face]), simplices)[0]
        for face in self.forbid:
            keep &= np.isin(simplices, face).sum(axis=1) < len(face)
        if self.star is not None:
            keep &= (simplices == self.star).any(axis=1)
        return keep


def _checked(face: Sequence[int], configuration: PointConfiguration, option: str) -> Face:
    try:
        vertices = tuple(sorted(index(vertex) for vertex in face))
    except TypeError:
        raise InputError(f"{option} {face!r}: name points by their numbers, as in 0,1,4") from None
    n, d = configuration.n, configuration.dimension
    unknown = [vertex for vertex in vertices if not 0 <= vertex < n]
    if unknown:
        raise InputError(
            f"{configuration.name}: {option} {_text(face)}: there is no point {unknown[0]}; points are numbered from 0 "
            f"to {n - 1}"
        )
    if not vertices or len(vertices) > d + 1 or len(set(vertices)) < len(vertices):
        raise InputError(
            f"{configuration.name}: {option} {_text(face)}: a face has from 1 to {d + 1} different points"
        )
    return vertices


def _text(face: Sequence[int]) -> str:
    return ",".join(map(str, face))

"""Required and forbidden faces and stars, as a result file records them, checked without the model's own code."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bcut.errors import VerificationError
from bcut.verification.cut_data import cross
from bcut.verification.dissection import overlap
from bcut.verification.exact_points import SideTable, Simplex


@dataclass(frozen=True)
class RestrictionData:
    """What a triangulation must have and must not have.

    Attributes
    ----------
    require, forbid : tuple of tuple of int
        Faces with ascending vertices.
    star : int or None
        A vertex of all simplices.
    dissection : bool
        Whether required simplices are those of a dissection.
    """

    require: tuple[Simplex, ...] = ()
    forbid: tuple[Simplex, ...] = ()
    star: int | None = None
    dissection: bool = False

    def __bool__(self) -> bool:
        return bool(self.require or self.forbid or self.star is not None)

    def check_points(self, n: int, dimension: int) -> None:
        """Refuse faces that are no sets of some of the points.

        Raises
        ------
        VerificationError
        """
        faces = (*self.require, *self.forbid, *(() if self.star is None else ((self.star,),)))
        for face in faces:
            if not 1 <= len(face) <= dimension + 1 or not all(0 <= vertex < n for vertex in face):
                raise VerificationError(
                    f"the problem names the face {list(face)}, "
                    f"which is no set of 1 to {dimension + 1} of the {n} points"
                )

    def check(self, simplices: Sequence[Simplex]) -> None:
        """Refuse a triangulation that lacks a required face or has a forbidden one.

        Raises
        ------
        VerificationError
        """
        sets = [frozenset(simplex) for simplex in simplices]
        for face in self.require:
            if not any(simplex.issuperset(face) for simplex in sets):
                raise VerificationError(f"the problem requires the face {list(face)}, but no simplex has it")
        for face in self.forbid:
            for simplex in sets:
                if simplex.issuperset(face):
                    raise VerificationError(
                        f"the problem forbids the face {list(face)}, but {sorted(simplex)} has it"
                    )
        for simplex in sets:
            if self.star is not None and self.star not in simplex:
                raise VerificationError(
                    f"the problem asks for a star of point {self.star}, but {sorted(simplex)} does not have it"
                )

    def admit(self, sides: SideTable, simplex: Simplex) -> bool:
        """Tell whether a triangulation with these restrictions may use a d-simplex.

        One that has the face f uses no simplex that meets f in something else than a common face. A dissection that has
        the d-simplex f uses none that overlaps it; faces of smaller dimensions say so much only where the points are in
        general position, since every dissection is a triangulation there.
        """
        if self.star is not None and self.star not in simplex:
            return False
        if any(set(face) <= set(simplex) for face in self.forbid):
            return False
        for face in self.require:
            if self.dissection and len(face) == len(simplex):
                if simplex != face and overlap(sides, simplex, face):
                    return False
            elif self.dissection and not sides.is_general:
                continue
            elif not set(face) <= set(simplex) and cross(sides, simplex, face):
                return False
        return True

"""Exact re-checking of results about regions, from their coordinates alone.

The surface is closed, does not cross itself, and has the region on its inner side; tetrahedra lie inside, fit to the
surface and to each other face to face, and have the volume that is claimed, which is compared with the region's volume
by the divergence theorem. Proofs are trees; their leaves carry multipliers, whose bounds are computed again over all
tetrahedra inside, which are found again from the coordinates. Whether a point is inside is told by a ray.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import combinations
from typing import Any, NoReturn

from bcut.errors import ConfigurationError, ResultError, VerificationError
from bcut.geometry.configuration import PointConfiguration
from bcut.verification.exact_points import Simplex, without
from bcut.verification.reading import Source, plain_data
from bcut.verification.surface import SurfaceCheck

STATUSES = ("optimal", "infeasible", "limit", "interrupted")


@dataclass(frozen=True)
class RegionVerification:
    """What holds of a result about a region, exactly.

    Attributes
    ----------
    statement : str
        One line for people; never stronger than what was checked.
    volume, covered : Fraction
        Of the region, and of the tetrahedra; the latter is None without any claim.
    triangulable : bool or None
        Whether the region has a triangulation without new points; None where that was not proven.
    covered_is_largest : bool
        Whether it was proven that no more can be covered.
    fewest : bool
        Whether it was proven that no triangulation of the region has fewer tetrahedra.
    checks : list of str
    """

    statement: str
    volume: Fraction
    covered: Fraction | None = None
    triangulable: bool | None = None
    covered_is_largest: bool = False
    fewest: bool = False
    checks: list[str] = field(default_factory=list)

    @property
    def settled(self) -> bool:
        """Whether the tetrahedra were proven to be the best ones."""
        return self.fewest or self.covered_is_largest


def verified_region(source: Source) -> RegionVerification | None:
    """Re-check a result if it is about a region; None if it is about something else.

    Parameters
    ----------
    source : mapping, RegionResult or path

    Raises
    ------
    VerificationError, ResultError
        As `verify_region`.
    """
    data, label = plain_data(source)
    if not isinstance(data, Mapping) or data.get("kind") != "region":
        return None
    return verify_region(data, label)


def verify_region(data: Mapping[str, Any], label: str) -> RegionVerification:
    """Re-check a result about a region.

    Parameters
    ----------
    data : mapping
        As `bcut.region` wrote it.
    label : str
        What to call it in messages.

    Raises
    ------
    VerificationError
        The result is refused; the message is the reason.
    ResultError
        It is no readable result.
    """
    try:
        return _Verifier(data, label).run()
    except VerificationError as error:
        raise VerificationError(f"{label}: {error}") from None


class _Verifier:
    """One verification."""

    def __init__(self, data: Mapping[str, Any], label: str) -> None:
        self.data, self.label = data, label
        self.checks: list[str] = []
        if data.get("schema") != 1 or data.get("status") not in STATUSES:
            self._unreadable("schema or status is unknown")
        instance = data.get("instance")
        if not isinstance(instance, Mapping) or not isinstance(instance.get("points"), list):
            self._unreadable("instance.points is missing")
        self.n = len(instance["points"])
        faces = [self._points_list(face, 3) for face in self._list(instance.get("faces"), "faces")]
        self.geometry = SurfaceCheck(self._read_points(instance), faces)
        self.points, self.sides = self.geometry.points, self.geometry.sides
        self.surface = self.geometry.surface
        self._inside: list[Simplex] | None = None

    def _read_points(self, instance: Mapping[str, Any]) -> list[list[Fraction]]:
        try:
            configuration = PointConfiguration.from_values(instance["points"], origin="instance.points")
        except ConfigurationError as error:
            raise ResultError(f"{self.label}: {error}") from None
        if configuration.dimension != 3 or configuration.field.degree > 1:
            self._unreadable("the points are no rational points of dimension 3")
        if configuration.digest != instance.get("digest"):
            self._refuse(
                "instance.digest does not belong to instance.points: one of them was changed after the run"
            )
        self.checks.append(f"{configuration.n} points have the digest of the instance")
        return [[Fraction(value) for value in point] for point in configuration.scalars()]  # type: ignore[arg-type]

    def run(self) -> RegionVerification:
        """Check the surface, the tetrahedra and the proofs."""
        self.geometry.check()
        self.checks.append(
            f"the {len(self.geometry.triangles)} triangles are a closed surface, which does not cross itself, "
            "around a region"
        )
        volume = self.geometry.volume()
        if self._rational("volume") != volume * self.points.volume_unit:
            self._refuse(f"its volume is {volume * self.points.volume_unit}, not {self.data.get('volume')}")
        tetrahedra = self._check_tetrahedra()
        covered = None if tetrahedra is None else sum(map(self.points.volume, tetrahedra))
        if covered is not None and self._rational("covered") != covered * self.points.volume_unit:
            self._refuse(
                f"the tetrahedra cover {covered * self.points.volume_unit}, not {self.data.get('covered')}"
            )
        return self._conclusion(volume, tetrahedra, covered)

    def _conclusion(
        self, volume: int, tetrahedra: Sequence[Simplex] | None, covered: int | None
    ) -> RegionVerification:
        """Check the proofs against the status."""
        status, unit = self.data["status"], self.points.volume_unit
        trees = self.data.get("certificate")
        if not isinstance(trees, Mapping):
            self._unreadable("certificate is missing")
        triangulable, largest, fewest = None, False, False
        if tetrahedra is not None and covered == volume:
            triangulable = True
            self.checks.append("they have the volume of the region, so they are a triangulation of it")
            if trees.get("infeasible") is not None:
                self._refuse("its certificate says that there is no triangulation, but it has one")
            tree = trees.get("cardinality")
            fewest = tree is not None and self._proves(tree, lambda _: 1, len(tetrahedra) - 1, equations=True)
            if self.data.get("value") != len(tetrahedra):
                self._refuse(f"it has {len(tetrahedra)} tetrahedra, not {self.data.get('value')}")
            if fewest:
                self.checks.append(
                    f"multipliers prove that no triangulation has less than {len(tetrahedra)} tetrahedra"
                )
        elif trees.get("infeasible") is not None:
            self._proves(trees["infeasible"], lambda _: 0, 0, equations=True)
            triangulable = False
            self.checks.append("multipliers prove that there is no triangulation of the region")
            if trees.get("covered") is not None and covered is not None:
                largest = self._proves(
                    trees["covered"], lambda t: -self.points.volume(t), -covered - 1, equations=False
                )
                self.checks.append(f"multipliers prove that no more than {covered * unit} can be covered")
        if (status == "optimal") != (triangulable is True and fewest) or (status == "infeasible") != (
            triangulable is False and largest
        ):
            self._refuse(f"its status '{status}' does not fit to what it proves")
        exact = None if covered is None else covered * unit
        if triangulable:
            end = ", which is the least number, proven exactly" if fewest else ""
            text = f"triangulable: {len(tetrahedra or ())} tetrahedra{end}"
        elif triangulable is False:
            text = "infeasible, proven exactly: there is no triangulation without new points; "
            text += f"{exact} of {volume * unit} is covered"
            text += ", and no more can be, proven exactly" if largest else ""
        else:
            text = f"{exact or 0} of {volume * unit} is covered; nothing was proven"
        return RegionVerification(text, volume * unit, exact, triangulable, largest, fewest, self.checks)

    def _all_inside(self) -> list[Simplex]:
        if self._inside is None:
            self._inside = [t for t in combinations(range(self.n), 4) if self.geometry.fits(t)]
        return self._inside

    def _check_tetrahedra(self) -> list[Simplex] | None:
        listed = self.data.get("triangulation")
        if listed is None:
            return None
        tetrahedra = [tuple(sorted(self._points_list(t, 4))) for t in self._list(listed, "triangulation")]
        for tetrahedron in tetrahedra:
            if not self.geometry.fits(tetrahedron):
                self._refuse(
                    f"the tetrahedron {list(tetrahedron)} is flat, not inside, or crosses the surface"
                )
        for first, second in combinations(tetrahedra, 2):
            if first == second or self.sides.crossing(first, second):
                self._refuse(f"the tetrahedra {list(first)} and {list(second)} do not meet face to face")
        self.checks.append(
            f"{len(tetrahedra)} tetrahedra lie inside, and meet each other and the surface face to face"
        )
        return tetrahedra

    # Proofs

    def _proves(self, tree: Any, cost: Any, floor: int, *, equations: bool) -> bool:
        """Refuse a tree one of whose leaves does not prove ``sum of costs > floor``."""
        self._check_tree(tree, cost, floor, equations, (), frozenset())
        return True

    def _check_tree(
        self,
        tree: Any,
        cost: Any,
        floor: int,
        equations: bool,
        chosen: tuple[Simplex, ...],
        excluded: frozenset[Simplex],
    ) -> None:
        if not isinstance(tree, Mapping):
            self._unreadable("a proof is no tree of branches and multipliers")
        if "branch" in tree:
            column = tuple(sorted(self._points_list(tree["branch"], 4)))
            self._check_tree(tree.get("with"), cost, floor, equations, (*chosen, column), excluded)
            self._check_tree(tree.get("without"), cost, floor, equations, chosen, excluded | {column})
            return
        bound = self._bound(tree, cost, equations, chosen, excluded)
        if not bound > floor:
            self._refuse(f"multipliers prove a bound of {bound} only, which has to exceed {floor}")

    def _bound(
        self,
        leaf: Mapping[str, Any],
        cost: Any,
        equations: bool,
        chosen: tuple[Simplex, ...],
        excluded: frozenset[Simplex],
    ) -> Fraction:
        """Return what multipliers prove of the sums of costs with some tetrahedra chosen and some excluded."""
        total = Fraction(0)
        weights: dict[Any, Fraction] = {}
        for entry in self._list(leaf.get("multipliers"), "multipliers"):
            if not isinstance(entry, list) or len(entry) != 2 or not isinstance(entry[1], str):
                self._unreadable("a multiplier is no pair of a row and a number")
            value = self._fraction(entry[1])
            if equations:
                face = tuple(sorted(self._points_list(entry[0], 3)))
                weights[face] = weights.get(face, Fraction(0)) + value
                total += value if face in self.surface else 0
                continue
            clique = [tuple(sorted(self._points_list(t, 4))) for t in self._list(entry[0], "a row")]
            if value > 0 or not all(self.sides.crossing(*pair) for pair in combinations(clique, 2)):
                self._refuse(
                    "a row of its proof has tetrahedra that do not cross each other, or a wrong sign"
                )
            total += value
            for member in set(clique):
                weights[member] = weights.get(member, Fraction(0)) + value
        for tetrahedron in self._all_inside():
            if tetrahedron in excluded:
                continue
            reduced = cost(tetrahedron) - self._weight(tetrahedron, weights, equations)
            is_free = not any(self.sides.crossing(tetrahedron, other) for other in chosen)
            if tetrahedron in chosen or (reduced < 0 and is_free):
                total += reduced
        return total

    def _weight(self, tetrahedron: Simplex, weights: Mapping[Any, Fraction], equations: bool) -> Fraction:
        """Return the sum over rows of the multiplier times the entry of a tetrahedron."""
        if not equations:
            return weights.get(tetrahedron, Fraction(0))
        total = Fraction(0)
        for position, apex in enumerate(tetrahedron):
            face = without(tetrahedron, position)
            value = weights.get(face)
            if value:
                above = face in self.surface or self.sides[face][0] >> apex & 1
                total += value if above else -value
        return total

    # Reading

    def _points_list(self, value: Any, size: int) -> Simplex:
        if (
            not isinstance(value, Sequence)
            or isinstance(value, str)
            or len(value) != size
            or len(set(map(str, value))) < size
            or not all(isinstance(v, int) and not isinstance(v, bool) and 0 <= v < self.n for v in value)
        ):
            self._unreadable(f"{value!r} is no list of {size} different points")
        return tuple(value)

    def _list(self, value: Any, what: str) -> list[Any]:
        if not isinstance(value, list):
            self._unreadable(f"{what} is no list")
        return value

    def _rational(self, key: str) -> Fraction:
        value = self.data.get(key)
        if not isinstance(value, str):
            self._unreadable(f"{key} is no exact number as text")
        return self._fraction(value)

    def _fraction(self, text: str) -> Fraction:
        try:
            return Fraction(text)
        except (ValueError, ZeroDivisionError):
            self._unreadable(f"{text[:40]!r} is no rational number")

    def _refuse(self, reason: str) -> NoReturn:
        raise VerificationError(reason)

    def _unreadable(self, reason: str) -> NoReturn:
        raise ResultError(
            f"{self.label}: {reason}; take the file as 'bcut region --output' wrote it, or solve the region again"
        )

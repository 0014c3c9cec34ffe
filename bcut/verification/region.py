"""Exact re-checking of results about regions, from their coordinates alone.

The surface is closed, does not cross itself, and has the region on its inner side; tetrahedra lie inside, fit to the surface and
to each other face to face, and have the volume that is claimed, which is compared with the region's volume by the divergence
theorem. Proofs are trees; their leaves carry multipliers, whose bounds are computed again over all tetrahedra inside, which are
found again from the coordinates. Whether a point is inside is told by a ray.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import combinations, count
from math import lcm
from typing import Any, NoReturn

from bcut.errors import ConfigurationError, ResultError, VerificationError
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.numbers import parse_coordinate
from bcut.verification.cut_data import Candidates
from bcut.verification.exact_points import ExactPoints, Simplex, without

Vector = tuple[int, int, int]
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


def is_region(data: Any) -> bool:
    """Tell whether plain data is a result about a region."""
    return isinstance(data, Mapping) and data.get("kind") == "region"


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
    return _Verifier(data, label).run()


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
        self._read_points(instance)
        self.triangles = [self._points_list(face, 3) for face in self._list(instance.get("faces"), "faces")]
        self.surface = {tuple(sorted(triangle)) for triangle in self.triangles}
        self._inside: list[Simplex] | None = None

    def _read_points(self, instance: Mapping[str, Any]) -> None:
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
        rows = [[parse_coordinate(text) for text in point] for point in instance["points"]]
        self.points = ExactPoints(rows)
        self.sides = Candidates(self.points)
        scalars = [[Fraction(value) for value in point] for point in configuration.scalars()]  # type: ignore[arg-type]
        unit = lcm(*(value.denominator for point in scalars for value in point))
        # Twelve times as fine, so that barycentres are integers.
        self.integers: list[Vector] = [
            (int(12 * unit * x), int(12 * unit * y), int(12 * unit * z)) for x, y, z in scalars
        ]
        self.checks.append(f"{configuration.n} points have the digest of the instance")

    def run(self) -> RegionVerification:
        """Check the surface, the tetrahedra and the proofs."""
        self._check_surface()
        volume = self._region_volume()
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
            text = f"infeasible, proven exactly: there is no triangulation without new points; {exact} of {volume * unit} "
            text += "is covered, and no more can be, proven exactly" if largest else "is covered"
        else:
            text = f"{exact or 0} of {volume * unit} is covered; nothing was proven"
        return RegionVerification(text, volume * unit, exact, triangulable, largest, fewest, self.checks)

    # The surface

    def _check_surface(self) -> None:
        edges: dict[tuple[int, int], int] = {}
        for number, (a, b, c) in enumerate(self.triangles):
            if not any(
                self.points.value(self.points.hyperplane((a, b, c)), p) for p in range(self.points.n)
            ):
                self._refuse(f"the points {[a, b, c]} lie on a line")
            for edge in ((a, b), (b, c), (c, a)):
                if edge in edges:
                    self._refuse(f"the surface is not oriented: two triangles run along {list(edge)}")
                edges[edge] = number
        for a, b in edges:
            if (b, a) not in edges:
                self._refuse(f"the surface is not closed at the edge {[a, b]}")
        for first, second in combinations(sorted(self.surface), 2):
            if self._triangles_cross(first, second):
                self._refuse(f"the triangles {list(first)} and {list(second)} of the surface cross")
        component = list(range(len(self.triangles)))
        for _ in component:
            for (a, b), number in edges.items():
                other = edges[b, a]
                component[number] = component[other] = min(component[number], component[other])
        for number in sorted(set(component)):
            if self._winding(self.triangles[number], behind=True) != 1:
                self._refuse(
                    f"the triangle {list(self.triangles[number])} of the surface is wrongly oriented"
                )
        self.checks.append(
            f"the {len(self.triangles)} triangles are a closed surface, which does not cross itself, around a region"
        )

    def _triangles_cross(self, first: Simplex, second: Simplex) -> bool:
        """Tell whether two triangles do not meet in a common face.

        They do if and only if some tetrahedron with the first one as a face meets the second one in a common face, or the two
        lie in one plane and do so there; a point off that plane makes tetrahedra of both questions.
        """
        apexes = [p for p in range(self.points.n) if p not in second and self._independent((*first, p))]
        # A tetrahedron over `first` on one side: what it and `second` share is in `first` or beyond it, so try both sides.
        plus = [p for p in apexes if self.sides.orientation(tuple(sorted((*first, p)))) != 0]
        plane = self.points.hyperplane(first)
        off = [p for p in second if self.points.side(plane, p)]
        if off and len({self.points.side(plane, p) for p in off}) == 1:
            # `second` is on one closed side: an apex on the other one meets it in the plane only.
            wanted = -self.points.side(plane, off[0])
            plus = [p for p in plus if self.points.side(plane, p) == wanted] or plus
            apex = plus[0] if plus and self.points.side(plane, plus[0]) == wanted else None
            if apex is not None:
                return self.sides_cross((*first, apex), second)
        return self._segments_cross(first, second)

    def sides_cross(self, tetrahedron: Sequence[int], other: Simplex) -> bool:
        """Tell whether a tetrahedron and a triangle do not meet in a common face."""
        from bcut.verification.cut_data import cross

        return cross(self.sides, tuple(sorted(tetrahedron)), other)

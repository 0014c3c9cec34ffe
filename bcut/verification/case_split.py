"""Checking a proof by cases that no triangulation reaches a target: with some faces, and without any images of them.

A case speaks of the triangulations within the target that use only some candidates, a set that is closed under a group
H of symmetries which leave the costs invariant. Its stages give up candidates whose reduced costs are too high; as
their multipliers are the same for all images of a row, what is left is closed under H too. Then either the last
stage's bound exceeds the target, or there is a face f:

- a triangulation that has none of the images of f under H uses only candidates without them, which are closed under H;
- one that has the image g f is the image, under g, of one that has f, costs the same and uses only candidates of the
  case as well. That one uses no candidate that crosses f, that is, meets it in something else than a common face. The
  candidates that do not cross f are closed under the subgroup of H that takes f to itself.

So where both cases are out of reach of the target, so is the one that they come from. Symmetries are not used for
anything else: each stage's bound is computed again from all rows that its multipliers stand for.

A cut stands for the mean of its images under the group of this case or of one that it comes from. It is checked
against the candidates that were left there when the next face was chosen: these are closed under that group, so the
images are valid as well.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from bcut.errors import VerificationError
from bcut.verification.certificate import check_cuts, check_rows
from bcut.verification.certificate_data import CaseData, CertificateData, StageData
from bcut.verification.certificate_program import CertificateProgram
from bcut.verification.costs import Costs
from bcut.verification.cut_data import Candidates, CertificateCut, cross
from bcut.verification.exact_points import Simplex, sign_of_order
from bcut.verification.symmetries import Symmetries

# Elements of a group that are listed, at most.
MAX_ELEMENTS = 20_000


@dataclass(frozen=True)
class Element:
    """A symmetry: the images of the points, and 1 or -1 for its determinant's sign."""

    images: Simplex
    sign: int

    def of(self, points: Iterable[int]) -> Simplex:
        """Return the image of a set of points, ascending."""
        return tuple(sorted([self.images[v] for v in points]))


def listed_elements(symmetries: Symmetries, n: int) -> list[Element] | None:
    """List the group that symmetries generate; None where it is too large."""
    generators = [
        Element(tuple(map(int, images)), 1 if keeps else -1)
        for images, keeps in zip(symmetries.images, symmetries.preserve_orientation, strict=True)
    ]
    found = {tuple(range(n)): Element(tuple(range(n)), 1)}
    frontier = list(found.values())
    while frontier:
        products = [
            Element(tuple(generator.images[v] for v in element.images), generator.sign * element.sign)
            for element in frontier
            for generator in generators
        ]
        frontier = []
        for product in products:
            if product.images not in found:
                found[product.images] = product
                frontier.append(product)
        if len(found) > MAX_ELEMENTS:
            return None
    return list(found.values())


@dataclass(frozen=True)
class Frame:
    """What a case is about: a group, and candidates that are closed under it."""

    group: Sequence[Element]
    candidates: frozenset[Simplex]


class CaseChecker:
    """Checks cases one within the other.

    Parameters
    ----------
    sides : Candidates
    flag : tuple of int
        d + 1 affinely independent points: those of the generic point.
    costs : Costs
        Invariant under the symmetries.
    sign : int
    spanning : bool
    target : Fraction
        Of the objective.
    """

    def __init__(
        self,
        sides: Candidates,
        flag: Simplex,
        costs: Costs,
        sign: int,
        spanning: bool,
        target: Fraction,
    ) -> None:
        self.sides, self.flag, self.costs, self.target = sides, flag, costs, target
        self.sign, self.spanning = sign, spanning

    def check(self, case: CaseData, frames: Sequence[Frame]) -> str:
        """Refuse a case that does not put the target out of reach; return why it cannot be checked, or nothing.

        Parameters
        ----------
        case : CaseData
        frames : sequence of Frame
            That of the case, behind those that it comes from.

        Raises
        ------
        VerificationError
        """
        *outer, frame = frames
        bound: Fraction | None = None
        for number, stage in enumerate(case.stages):
            where = f"{case.where}, stage {number}"
            try:
                obstacle = self._check_parts(stage, (*outer, frame))
                if obstacle:
                    return f"{where}: {obstacle}"
                full = self._expanded(stage, (*outer, frame))
            except VerificationError as error:
                raise VerificationError(f"{where}: {error}") from None
            program = CertificateProgram(
                self.sides, full, self.costs, self.sign, self.spanning, frame.candidates
            )
            bound = program.solve().bound
            assert bound is not None
            slack = self.sign * (self.target - bound)
            if slack < 0:
                return ""
            frame = replace(frame, candidates=frozenset(program.left_within(slack)))
        if case.chosen is None or case.excluded is None:
            proven = "nothing" if bound is None else f"the bound {bound} only"
            raise VerificationError(
                f"the certificate claims that no triangulation reaches {self.target}, but {case.where} proves {proven}"
            )
        self._check_face(case)
        return self.check(case.chosen, (*outer, frame, self._with(frame, case.face))) or self.check(
            case.excluded, (*outer, self._without(frame, case.face))
        )

    def _check_face(self, case: CaseData) -> None:
        n, d = self.sides.points.n, self.sides.points.dimension
        if not 1 <= len(case.face) <= d + 1 or not all(0 <= v < n for v in case.face):
            raise VerificationError(
                f"{case.where}: {list(case.face)} is no set of 1 to {d + 1} of the {n} points"
            )

    def _check_parts(self, stage: StageData, frames: Sequence[Frame]) -> str:
        """Check rows and cuts."""
        if not all(0 <= group < len(frames) for group in stage.groups):
            raise VerificationError(f"a cut belongs to a group that is none of the {len(frames)} there are")
        check_rows(self.sides, stage.data)
        for number, frame in enumerate(frames):
            cuts = tuple(
                cut for cut, group in zip(stage.data.cuts, stage.groups, strict=True) if group == number
            )
            if cuts:
                obstacle = check_cuts(self.sides.only(frame.candidates), replace(stage.data, cuts=cuts))
                if obstacle:
                    return obstacle
        return ""

    def _expanded(self, stage: StageData, frames: Sequence[Frame]) -> CertificateData:
        """Return the multipliers of all rows and cuts that those of a stage stand for."""
        group = frames[-1].group
        cuts = [
            _mean(cut, frames[number].group)
            for cut, number in zip(stage.data.cuts, stage.groups, strict=True)
            if cut.multiplier
        ]
        # The generic point's images are all different: its points span the space.
        share = stage.data.coverage / len(group)
        return CertificateData(
            bound=None,
            flag=self.flag,
            cocircuits=_all_rows(stage.data.cocircuits or {}, group),
            chambers={tuple(element.images[v] for v in self.flag): share for element in group},
            cuts=tuple(cuts),
        )

    def _with(self, frame: Frame, face: Simplex) -> Frame:
        """Return the case of the triangulations that have a face."""
        points = set(face)
        return Frame(
            [element for element in frame.group if element.of(face) == face],
            frozenset(
                simplex
                for simplex in frame.candidates
                if points <= set(simplex) or not cross(self.sides, simplex, face)
            ),
        )

    def _without(self, frame: Frame, face: Simplex) -> Frame:
        """Return the case of the triangulations that have none of the images of a face."""
        images = [set(image) for image in {element.of(face) for element in frame.group}]
        kept = (simplex for simplex in frame.candidates if not any(image <= set(simplex) for image in images))
        return Frame(frame.group, frozenset(kept))


def _all_rows(rows: Mapping[Simplex, Fraction], group: Sequence[Element]) -> dict[Simplex, Fraction]:
    """Give the multiplier of each row to all its images, with the sign that their orientation asks for."""
    found: dict[Simplex, Fraction] = {}
    for row, multiplier in rows.items():
        own: dict[Simplex, int] = {}
        for element in group:
            moved = [element.images[v] for v in row]
            image, sign = tuple(sorted(moved)), element.sign * sign_of_order(moved)
            if own.setdefault(image, sign) != sign:
                raise VerificationError(
                    f"a symmetry exchanges the sides of {list(image)}, so there is no such row"
                )
        if own.keys() & found.keys():
            raise VerificationError(f"the row {list(row)} belongs to an orbit that has a multiplier already")
        found.update({image: sign * multiplier for image, sign in own.items()})
    return found


def _mean(cut: CertificateCut, group: Sequence[Element]) -> CertificateCut:
    """Return the mean of the images of a cut."""
    total: dict[Simplex, Fraction] = {}
    for simplex, coefficient in zip(cut.simplices, cut.coefficients, strict=True):
        share = coefficient / len(group)
        for element in group:
            image = element.of(simplex)
            total[image] = total.get(image, Fraction(0)) + share
    return replace(cut, simplices=tuple(total), coefficients=tuple(total.values()))

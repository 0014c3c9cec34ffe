"""What a certificate consists of, as read from a result file, and what it proves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from math import floor

from bcut.verification.cut_data import CertificateCut
from bcut.verification.exact_points import Simplex

# Cases within cases that are read.
MAX_DEPTH = 200


@dataclass(frozen=True)
class CertificateData:
    """Multipliers as read from a result file.

    Attributes
    ----------
    bound : Fraction or None
        The claim, on the objective itself; None where the file claims nothing.
    flag : tuple of int
        v_0, ..., v_d.
    coverage : Fraction
        Multiplier of the coverage row.
    cocircuits : mapping of tuple of int to Fraction
        Multipliers of the rows of ascending (d-1)-simplices.
    chambers : mapping of tuple of int to Fraction
        Multipliers of the coverage rows of more generic points, by their flags.
    cuts : tuple of CertificateCut
    symmetries : tuple of tuple of int, or None
        Permutations of the points. Where this is not None, multipliers are those of all images of a row, those of cuts
        belong to the means of their images, and the volume row takes the place of the coverage row (see
        `bcut.verification.orbit_certificate`).
    volume : Fraction
        Multiplier of the volume row.
    volume_coefficient : int
        Which coefficient of the volumes, on the basis of the coordinates' number field, the volume row takes.
    refutes : RefutationData or None
        Goes beyond the bound.
    infeasible : bool
        Whether the multipliers are to prove a positive bound on the value 0 of all triangulations: that there is none.
    threshold : Fraction or None
        Of a bottleneck: the multipliers are to prove a positive bound on the number of simplices that are no better.
    earlier : tuple of Fraction
        Multipliers of the values of earlier objectives.
    reason : str
        Why there is no bound.
    """

    bound: Fraction | None
    flag: Simplex = ()
    coverage: Fraction = Fraction(0)
    cocircuits: Mapping[Simplex, Fraction] | None = None
    chambers: Mapping[Simplex, Fraction] | None = None
    cuts: tuple[CertificateCut, ...] = ()
    symmetries: tuple[Simplex, ...] | None = None
    volume: Fraction = Fraction(0)
    volume_coefficient: int = 0
    refutes: RefutationData | None = None
    infeasible: bool = False
    threshold: Fraction | None = None
    earlier: tuple[Fraction, ...] = ()
    reason: str = ""


@dataclass(frozen=True)
class RefutationData:
    """A value that no triangulation reaches, and why.

    Attributes
    ----------
    target : Fraction
        Of the objective.
    stages : tuple of CertificateData
        Each speaks of the candidates whose reduced costs in the one before, first in the certificate itself, a
        triangulation within the target may have.
    case : CaseData or None
        In the place of stages, where there are symmetries: these candidates, and all symmetries.
    """

    target: Fraction
    stages: tuple[CertificateData, ...]
    case: CaseData | None = None


@dataclass(frozen=True)
class StageData:
    """A stage of a case; see `bcut.verification.case_split`.

    Attributes
    ----------
    data : CertificateData
        Its multipliers; that of the coverage row belongs to the mean of the row's images.
    groups : tuple of int
        For each cut, by how many chosen faces the group is told whose images of the cut are meant.
    """

    data: CertificateData
    groups: tuple[int, ...]


@dataclass(frozen=True)
class CaseData:
    """A case of a proof.

    Attributes
    ----------
    where : str
        What to call it in messages.
    stages : tuple of StageData
    face : tuple of int
        Ascending; empty where the stages are the proof.
    chosen, excluded : CaseData or None
        Of the triangulations with the face, and of those without any image of it.
    """

    where: str
    stages: tuple[StageData, ...]
    face: Simplex = ()
    chosen: CaseData | None = None
    excluded: CaseData | None = None


@dataclass(frozen=True)
class CertifiedBound:
    """What a certificate proves.

    Attributes
    ----------
    bound : Fraction or None
        No triangulation has a better value; None where `obstacle` kept the bound from being re-computed.
    integral : bool
        Whether all candidate simplices have integral costs, so that the bound may be rounded.
    candidates : int
        Number of candidate simplices.
    obstacle : str
        Why the bound could not be re-computed.
    refuted : Fraction or None
        A value beyond the bound that no triangulation reaches either.
    """

    bound: Fraction | None
    integral: bool = False
    candidates: int = 0
    obstacle: str = ""
    refuted: Fraction | None = None

    def beyond(self, target: Fraction, sign: int) -> CertifiedBound:
        """Return what holds where no triangulation reaches a target either."""
        # Between integral values there is nothing: the next one is a bound.
        beyond = Fraction(sign * (floor(sign * target) + 1)) if self.integral else target
        bound = beyond if self.bound is None else max(self.bound, beyond, key=lambda value: sign * value)
        return replace(self, bound=bound, refuted=target)

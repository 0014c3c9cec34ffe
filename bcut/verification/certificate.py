"""Re-computing the bound that exact dual multipliers prove, over every candidate simplex.

Let sign be 1 for a minimum and -1 for a maximum, and x the 0/1 vector of a triangulation, indexed by the
candidate simplices. It satisfies

- for a (d-1)-simplex f with points strictly on both sides: the sum over t = f + a of x_t times the sign of
  ``det(f_1 - f_0, ..., f_{d-1} - f_0, a - f_0)`` is 0, because as many simplices (one or none) lie on either
  side of f;
- coverage rows: the sum of x_t over the t that contain a generic point is 1 (that of a dissection too);
- the cuts ``a x <= rhs``, as far as they are valid.

Hence for any multipliers y of the equations and any multipliers z <= 0 of the cuts

    sign * c x >= sum of y_coverage + sum_k z_k rhs_k + sum_t min(0, sign * c_t - sum_i y_i A_it - sum_k z_k a_kt),

since 0 <= x_t <= 1. The generic point is ``v_0 + e (v_1 - v_0) + e^2 (v_2 - v_0) + ...`` for the flag v and
an infinitesimal e > 0: it is on the side of a hyperplane on which the first of v_0, v_1, ... lies that is
not on the hyperplane.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import comb

from bcut.errors import VerificationError
from bcut.verification.certificate_data import CertificateData, CertifiedBound
from bcut.verification.certificate_program import CertificateProgram
from bcut.verification.costs import Costs
from bcut.verification.cuts import CUT_CHECKERS, Candidates, UncheckedError
from bcut.verification.exact_points import ExactPoints, SideTable, Simplex
from bcut.verification.restrictions import RestrictionData

# Subsets of d + 1 points to look at, unless told otherwise: some minutes' work.
MAX_SUBSETS = 20_000_000


def certified_bound(
    points: ExactPoints,
    certificate: CertificateData,
    costs: Costs,
    *,
    sense: str,
    spanning: bool,
    restrictions: RestrictionData | None = None,
    max_subsets: int = MAX_SUBSETS,
) -> CertifiedBound:
    """Re-compute the bound of a certificate exactly.

    Parameters
    ----------
    points : ExactPoints
    certificate : CertificateData
    costs : Costs
    sense : {"min", "max"}
    spanning : bool
        Candidates are the simplices without further points in them, instead of all.
    restrictions : RestrictionData, optional
        Candidates are only those that these leave.
    max_subsets : int
        Give up, with an obstacle, where more (d+1)-subsets would have to be looked at.

    Returns
    -------
    CertifiedBound

    Raises
    ------
    VerificationError
        A row or a cut is not valid, or the multipliers prove less than the certificate claims.
    """
    subsets = comb(points.n, points.dimension + 1)
    if subsets > max_subsets:
        return CertifiedBound(
            None, obstacle=f"there are {subsets:,} subsets of {points.dimension + 1} points to look at"
        )
    sides = Candidates(points, spanning=spanning, restrictions=restrictions)
    for flag in (certificate.flag, *(certificate.chambers or {})):
        check_flag(sides, flag)
    check_rows(sides, certificate)
    obstacle = check_cuts(sides, certificate)
    if obstacle:
        return CertifiedBound(None, obstacle=obstacle)
    sign = 1 if sense == "min" else -1
    program = CertificateProgram(sides, certificate, costs, sign, spanning)
    found = program.solve()
    assert found.bound is not None
    check_claim(certificate, found.bound, sense)
    if certificate.refutes is None:
        return found
    obstacle = _check_refutation(program, found.bound, certificate)
    if obstacle:
        return replace(found, obstacle=obstacle)
    return found.beyond(certificate.refutes.target, sign)


def _check_refutation(program: CertificateProgram, bound: Fraction, certificate: CertificateData) -> str:
    """Refuse stages that do not prove the target to be out of reach; return why they cannot be checked, or nothing."""
    refutes, sign, sides = certificate.refutes, program.sign, program.sides
    assert refutes is not None
    if refutes.case is not None:
        raise VerificationError("the certificate splits cases by symmetries, but has none")
    for number, stage in enumerate(refutes.stages):
        where = f"stage {number} of the certificate's refutation of {refutes.target}"
        left = program.left_within(sign * (refutes.target - bound))
        sides = sides.only(left)
        stage = replace(stage, flag=certificate.flag)
        try:
            check_rows(sides, stage)
            obstacle = check_cuts(sides, stage)
        except VerificationError as error:
            raise VerificationError(f"{where}: {error}") from None
        if obstacle:
            return f"{where}: {obstacle}"
        program = CertificateProgram(sides, stage, program.costs, sign, program.spanning, left)
        found = program.solve().bound
        assert found is not None
        bound = found
    if not refutes.stages or sign * bound <= sign * refutes.target:
        raise VerificationError(
            f"the certificate claims that no triangulation reaches {refutes.target}, but its stages prove the bound "
            f"{bound} only"
        )
    return ""


def check_claim(certificate: CertificateData, proven: Fraction, sense: str) -> None:
    """Refuse a certificate that proves less than it claims."""
    claim = certificate.bound
    if claim is not None and (proven < claim if sense == "min" else proven > claim):
        raise VerificationError(
            f"the certificate claims the bound {claim}, but its multipliers prove {proven} only "
            f"({'at least' if sense == 'min' else 'at most'} {float(proven):.6g})"
        )


def check_flag(sides: SideTable, flag: Simplex) -> None:
    """Refuse a flag that is no list of d + 1 affinely independent points."""
    n, d = sides.points.n, sides.points.dimension
    if len(set(flag)) != d + 1 or len(flag) != d + 1 or not all(0 <= v < n for v in flag):
        raise VerificationError(
            f"the certificate's flag {list(flag)} is not a list of {d + 1} different points"
        )
    if not sides.orientation(tuple(sorted(flag))):
        raise VerificationError(
            f"the certificate's flag {list(flag)} lies in a hyperplane: it gives no generic point"
        )


def check_rows(sides: SideTable, certificate: CertificateData) -> None:
    """Refuse multipliers of rows that there are not."""
    n, d = sides.points.n, sides.points.dimension
    for facet in certificate.cocircuits or {}:
        if len(facet) != d or not all(0 <= v < n for v in facet):
            raise VerificationError(f"the certificate's row {list(facet)} does not name {d} points")
        plus, minus = sides[facet]
        if not (plus and minus):
            raise VerificationError(
                f"the certificate has a multiplier for {list(facet)}, "
                "which has no points strictly on both sides: there is no such row"
            )


def check_cuts(sides: SideTable, certificate: CertificateData) -> str:
    """Refuse cuts that are not valid; return why they cannot be checked, or nothing."""
    unknown = sorted(
        {cut.family for cut in certificate.cuts if cut.multiplier and cut.family not in CUT_CHECKERS}
    )
    if unknown:
        return f"it uses cuts that cannot be re-checked ({', '.join(unknown)})"
    n, d = sides.points.n, sides.points.dimension
    for number, cut in enumerate(certificate.cuts):
        if not cut.multiplier:
            continue
        where = f"cut {number} of the certificate ({cut.family})"
        if cut.multiplier > 0:
            raise VerificationError(
                f"{where}: multiplier {cut.multiplier} of a '<=' row must not be positive"
            )
        for simplex in cut.simplices:
            if len(simplex) != d + 1 or not all(0 <= v < n for v in simplex):
                raise VerificationError(f"{where}: {list(simplex)} does not name {d + 1} points")
        try:
            CUT_CHECKERS[cut.family](sides, cut)
        except VerificationError as error:
            raise VerificationError(f"{where} is not valid: {error}") from None
        except UncheckedError as error:
            return f"{where}: {error}"
    return ""

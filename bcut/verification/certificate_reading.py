"""Reading the certificates of a result file."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from bcut.verification.certificate_data import MAX_DEPTH, CaseData, CertificateData, RefutationData, StageData
from bcut.verification.cut_data import CertificateCut
from bcut.verification.entries import EntryReader
from bcut.verification.exact_points import Simplex


class CertificateReader(EntryReader):
    """Takes certificates out of a result."""

    def certificate(self, value: Any, where: str = "certificate") -> CertificateData | None:
        """Read a certificate, or null."""
        if value is None:
            return None
        if not isinstance(value, Mapping):
            self.refuse(where, "this is a JSON object or null", value)
        bound = self.entry(value, f"{where}.bound")
        if bound is None:
            reason = value.get("reason")
            return CertificateData(None, reason=reason if isinstance(reason, str) else "")
        symmetries = self.symmetries(value.get("symmetries"), f"{where}.symmetries")
        row = "coverage" if symmetries is None else "volume"
        threshold = value.get("threshold")
        earlier = self.list_of(value.get("earlier", []), f"{where}.earlier", "this is a list of multipliers")
        named, cocircuits, chambers = self.multipliers(
            self.entry(value, f"{where}.multipliers"), row, f"{where}.multipliers"
        )
        cuts = self.list_of(value.get("cuts", []), f"{where}.cuts", "this is a list of cuts")
        return CertificateData(
            bound=self.rational(bound, f"{where}.bound"),
            flag=tuple(self.vertices(self.entry(value, f"{where}.flag"), f"{where}.flag")),
            coverage=Fraction(0) if symmetries is not None else named,
            volume=Fraction(0) if symmetries is None else named,
            cocircuits=cocircuits,
            chambers=chambers,
            symmetries=symmetries,
            volume_coefficient=self.integer(
                value.get("volume_coefficient") or 0, f"{where}.volume_coefficient"
            ),
            cuts=tuple(self.cut(cut, f"{where}.cuts[{index}]") for index, cut in enumerate(cuts)),
            infeasible=self.flag(value, f"{where}.infeasible"),
            refutes=self.refutation(value.get("refutes"), f"{where}.refutes"),
            threshold=None if threshold is None else self.rational(threshold, f"{where}.threshold"),
            earlier=tuple(self.rational(text, f"{where}.earlier") for text in earlier),
        )

    def refutation(self, value: Any, where: str) -> RefutationData | None:
        """Read the stages that refute a target."""
        if value is None:
            return None
        if not isinstance(value, Mapping):
            self.refuse(where, "this is a JSON object or null", value)
        target = self.rational(self.entry(value, f"{where}.target"), f"{where}.target")
        if "case" in value:
            return RefutationData(target, (), self.case(value["case"], f"{where}.case", 0))
        listed = self.list_of(
            self.entry(value, f"{where}.stages"), f"{where}.stages", "this is a list of stages"
        )
        stages = (self.stage(stage, f"{where}.stages[{k}]")[0] for k, stage in enumerate(listed))
        return RefutationData(target, tuple(stages))

    def stage(self, value: Any, where: str) -> tuple[CertificateData, list[Any]]:
        """Read a stage, and return the entries of its cuts as well."""
        if not isinstance(value, Mapping):
            self.refuse(where, "this is a JSON object", value)
        coverage, cocircuits, _ = self.multipliers(
            self.entry(value, f"{where}.multipliers"), "coverage", f"{where}.multipliers"
        )
        listed = self.list_of(value.get("cuts", []), f"{where}.cuts", "this is a list of cuts")
        cuts = tuple(self.cut(cut, f"{where}.cuts[{k}]") for k, cut in enumerate(listed))
        return CertificateData(bound=None, coverage=coverage, cocircuits=cocircuits, cuts=cuts), listed

    def case(self, value: Any, where: str, depth: int) -> CaseData:
        """Read a case of a proof, and those that it is split into."""
        if not isinstance(value, Mapping):
            self.refuse(where, "this is a JSON object", value)
        if depth > MAX_DEPTH:
            self.refuse(where, f"cases are at most {MAX_DEPTH} within each other", "one more")
        stages = []
        listed = self.list_of(
            self.entry(value, f"{where}.stages"), f"{where}.stages", "this is a list of stages"
        )
        for number, entry in enumerate(listed):
            place = f"{where}.stages[{number}]"
            data, cuts = self.stage(entry, place)
            groups = (
                self.integer(self.entry(cut, f"{place}.cuts[{k}].group"), f"{place}.cuts[{k}].group")
                for k, cut in enumerate(cuts)
            )
            stages.append(StageData(data, tuple(groups)))
        if "face" not in value:
            return CaseData(where, tuple(stages))
        return CaseData(
            where,
            tuple(stages),
            self.ascending(value["face"], f"{where}.face"),
            self.case(self.entry(value, f"{where}.chosen"), f"{where}.chosen", depth + 1),
            self.case(self.entry(value, f"{where}.excluded"), f"{where}.excluded", depth + 1),
        )

    def multipliers(
        self, value: Any, named: str, place: str
    ) -> tuple[Fraction, dict[Simplex, Fraction], dict[Simplex, Fraction]]:
        """Read the multipliers of the one row with a name, of the cocircuit rows, and of generic points by flags."""
        of_named: Fraction | None = None
        cocircuits: dict[Simplex, Fraction] = {}
        chambers: dict[Simplex, Fraction] = {}
        for index, entry in enumerate(self.list_of(value, place, "this is a list")):
            where = f"{place}[{index}]"
            row, text = self.pair(entry, where, "this is a pair of a row and its multiplier")
            multiplier = self.rational(text, where)
            if isinstance(row, Mapping):
                flag = tuple(self.vertices(self.entry(row, f"{where}.flag"), f"{where}.flag"))
                if flag in chambers:
                    self.refuse(where, "each row has one multiplier", entry)
                chambers[flag] = multiplier
                continue
            facet = None if row == named else self.ascending(row, where)
            if facet in cocircuits or (facet is None and of_named is not None):
                self.refuse(where, "each row has one multiplier", entry)
            if facet is None:
                of_named = multiplier
            else:
                cocircuits[facet] = multiplier
        return of_named or Fraction(0), cocircuits, chambers

    def cut(self, value: Any, where: str) -> CertificateCut:
        """Read a cut of a certificate."""
        if not isinstance(value, Mapping):
            self.refuse(where, "this is a JSON object", value)
        listed = self.list_of(self.entry(value, f"{where}.simplices"), where, "this is a list of simplices")
        simplices = tuple(self.ascending(simplex, where) for simplex in listed)
        numbers = self.list_of(
            self.entry(value, f"{where}.coefficients"), where, "this is a list of coefficients"
        )
        coefficients = tuple(self.number(number, where).exact for number in numbers)
        if not simplices or len(simplices) != len(coefficients) or len(set(simplices)) != len(simplices):
            self.refuse(where, "a cut has different simplices, and a coefficient for each", value)
        proof = value.get("proof")
        return CertificateCut(
            family=self.text(value, f"{where}.family"),
            simplices=simplices,
            coefficients=coefficients,
            rhs=self.number(self.entry(value, f"{where}.rhs"), f"{where}.rhs").exact,
            multiplier=self.rational(self.entry(value, f"{where}.multiplier"), f"{where}.multiplier"),
            proof=proof if isinstance(proof, Mapping) else {},
        )

    def symmetries(self, value: Any, where: str) -> tuple[Simplex, ...] | None:
        """Read a list of permutations."""
        if value is None:
            return None
        listed = self.list_of(value, where, "this is a list of permutations of the points")
        return tuple(
            tuple(self.vertices(permutation, f"{where}[{i}]")) for i, permutation in enumerate(listed)
        )

"""What the runs of a problem say about it together: its root LP, its optimum, and where two of them disagree."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

# Values this close, relative to them, are the same: bounds of relaxations carry the noise of a solver.
CLOSE = 1e-6
# Stages of `bcut solve` that leave out columns before the first relaxation.
_PARTS = {"diamond", "skeleton"}

Stored = tuple[dict[str, Any], dict[str, Any]]
ProblemKey = tuple[str, str, str, bool]


@dataclass(frozen=True)
class Claim:
    """What one run, or the plan, says about the optimum of a problem.

    Attributes
    ----------
    who : str
        Name of the variant, or "the plan".
    kind : {"optimum", "infeasible", "value"}
        Proven, that there is no triangulation, or the value of some triangulation.
    value : float
        Of an infeasible problem, that of nothing: infinity, to be minimised.
    sense : {"min", "max"}
    fingerprint : str
        Of the run; nothing for the plan.
    """

    who: str
    kind: str
    value: float
    sense: str
    fingerprint: str = ""

    @property
    def text(self) -> str:
        """The claim in words."""
        if self.kind == "infeasible":
            return "that there is no triangulation"
        return f"{'the optimum' if self.kind == 'optimum' else 'a triangulation of value'} {self.value:.10g}"

    def agrees_with(self, proven: Claim) -> bool:
        """Tell whether both can be true, where the other one is proven."""
        if "infeasible" in (self.kind, proven.kind):
            return self.kind == proven.kind
        better = proven.value - self.value if self.sense == "min" else self.value - proven.value
        apart = better if self.kind == "value" else abs(better)
        return apart <= CLOSE * max(1.0, abs(self.value), abs(proven.value))


@dataclass(frozen=True)
class Contradiction:
    """Two claims about one problem that cannot both be true.

    Attributes
    ----------
    key : tuple
        Instance, objective, sense, whether spanning.
    first, second : Claim
        What was claimed first in the order of the plan, and what contradicts it.
    """

    key: ProblemKey
    first: Claim
    second: Claim

    @property
    def claims(self) -> tuple[Claim, Claim]:
        """Both."""
        return self.first, self.second

    @property
    def instance(self) -> str:
        """Of the problem."""
        return self.key[0]

    def told_of(self, claim: Claim) -> str:
        """Return what a user is to know of one of the two, and what to look at."""
        other = self.second if claim is self.first else self.first
        records = " and ".join(f"runs/{c.fingerprint}.json" for c in (claim, other) if c.fingerprint)
        return (
            f"found {claim.text}, but {_named(other)} says {other.text}: one of them is wrong; see {records}"
        )

    def row(self) -> dict[str, Any]:
        """Return the row of a table."""
        instance, objective, sense, spanning = self.key
        return {
            "instance": instance,
            "objective": objective,
            "sense": sense,
            "spanning": spanning,
            "variant": self.first.who,
            "says": self.first.text,
            "other_variant": self.second.who,
            "other_says": self.second.text,
            "fingerprint": self.first.fingerprint,
            "other_fingerprint": self.second.fingerprint,
        }


def _named(claim: Claim) -> str:
    return f"variant '{claim.who}'" if claim.fingerprint else claim.who


def problem_of(entry: dict[str, Any]) -> ProblemKey:
    """Return the problem of a run, which is the same in all formulations."""
    return entry["instance"], entry["objective"], entry["sense"], entry["spanning"]


def contradictions_among(stored: Iterable[Stored]) -> list[Contradiction]:
    """Return the claims that contradict the first proven one about the same problem."""
    claims: dict[ProblemKey, list[Claim]] = {}
    for entry, record in stored:
        known = claims.setdefault(problem_of(entry), [])
        known += (claim for claim in _claims(entry, record) if claim not in known)
    found = []
    for key, known in claims.items():
        proven = next((claim for claim in known if claim.kind != "value"), None)
        if proven is not None:
            found += [Contradiction(key, proven, claim) for claim in known if not claim.agrees_with(proven)]
    return found


def _claims(entry: dict[str, Any], record: dict[str, Any]) -> Iterator[Claim]:
    sense = entry["sense"]
    nothing = float("inf") if sense == "min" else float("-inf")
    if entry["optimum"] is not None:
        yield Claim("the plan", "optimum", float(Fraction(entry["optimum"])), sense)
    who, name, outcome = str(entry["variant"]), entry["fingerprint"], record["outcome"]
    proven = proven_optimum(record)
    if proven is None and _is_proven_at_scip_root(record):
        proven = outcome["value"]
    if proven is not None:
        yield Claim(who, "optimum", proven, sense, name)
    elif outcome["status"] == "infeasible" and not record["settings"]["cutoff"]:
        # With a cutoff the word is about solutions that are better than it.
        yield Claim(who, "infeasible", nothing, sense, name)
    elif outcome["value"] is not None:
        yield Claim(who, "value", outcome["value"], sense, name)


def _is_proven_at_scip_root(record: dict[str, Any]) -> bool:
    return record["settings"]["preset"] == "root" and record["outcome"]["status"] == "optimal"


def proven_optimum(record: dict[str, Any]) -> float | None:
    """Return the optimum that a run ended with: of a whole solve, or of a relaxation with an integral point."""
    preset, outcome = record["settings"]["preset"], record["outcome"]
    found: float | None = None
    if preset in ("solve", "plain") and outcome["status"] == "optimal":
        found = outcome["value"]
    elif preset == "loop" and outcome["status"] == "integral":
        found = outcome["lp_after_cuts"]
    return found


def root_lp(records: Iterable[dict[str, Any]]) -> float | None:
    """Return the root LP of a problem in one formulation, from the best source among its runs, the first of equals.

    That is the first relaxation of our loop with all simplices listed, which all variants start from; the loop
    over orbits has the same value, as the average of a point over symmetries satisfies the same rows. SCIP's first
    relaxation, which may know more than the rows, counts only without these, and that of ``bcut solve`` only where no
    run is about the root.
    """
    best: tuple[int, float] | None = None
    for record in records:
        rank, lp = _rank_of_lp(record), record["outcome"]["lp"]
        if rank is not None and lp is not None and (best is None or rank < best[0]):
            best = rank, lp
    return None if best is None else best[1]


def _rank_of_lp(record: dict[str, Any]) -> int | None:
    """Return the place of a run among the sources of the root LP, 0 the best; None where its number may be another."""
    settings = record["settings"]
    preset, method = settings["preset"], settings.get("method", "listing")
    if preset == "loop":
        # Their value is recorded once the relaxation is solved to the end; method "fixing" may end with multipliers,
        # which prove a bound below it.
        return {"listing": 0, "orbits": 1}.get(method)
    if preset == "root":
        return 2
    if preset == "solve" and method != "scip" and _is_of_all_columns(record["outcome"]):
        return 3
    # SCIP's own presolve changes the rows.
    return None


def _is_of_all_columns(outcome: dict[str, Any]) -> bool:
    """Tell whether the first bound of ``bcut solve`` is the value of a relaxation, and that of all columns."""
    stages = outcome.get("stages", {})
    if "multipliers" in stages:
        return any(lp == outcome["lp"] for lp, _ in outcome["rounds"])
    return _PARTS.isdisjoint(stages)

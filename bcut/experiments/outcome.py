"""What came out of a run: the entry ``outcome`` of its record, whatever its preset."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from bcut.result import Result


@dataclass(kw_only=True)
class RunOutcome:
    """What came out of a run; None for what its preset does not tell, or what a limit left unknown.

    Attributes
    ----------
    status : str
        As in a result, such as "optimal" or "limit". Of our loop, why it ended: see `bcut.bounds.root.RootBound`.
        "counted" where a program was, "verified" for a triangulation that no bound belongs to.
    lp, lp_after_cuts : float or None
        Values of the root relaxation before and after cuts, unrounded.
    integral : bool or None
        Whether the root settled the problem, as the preset can tell. Our loop, and ``bcut solve``: the point of the
        last relaxation at the root is a triangulation. SCIP's root: SCIP proved optimality there, which it may do by
        rounding its bound, while the last relaxation's point is still fractional. None where the root is not looked
        at.
    value, bound : float or None
        Of the best triangulation, and proven for all of them.
    nodes : int
    rounds : list of (float, dict of str to int)
        Each relaxation at the root: its value, and the cuts then added, by family.
    columns, rows, nonzeros : int or None
        Size of the program as it was written: without rows that are added where they are violated. All rows for
        the preset "sizes".
    kinds : dict of str to int, or None
        Rows of each kind. The entry has it for the preset "sizes" only.
    columns_after_fixing : int or None
    separators : dict
        For each family: calls, found, added, seconds. SCIP's own are called "scip:NAME".
    seconds : dict of str to float
        "total" and "processor" time, and of the former what went into "lp" and "separation".
    stages : dict of str to float, or None
        Seconds of each stage of ``bcut solve`` and ``bcut bound``. The entry has it for those only.
    """

    status: str
    lp: float | None = None
    lp_after_cuts: float | None = None
    integral: bool | None = None
    value: int | float | None = None
    bound: int | float | None = None
    nodes: int = 0
    rounds: list[tuple[float, Mapping[str, int]]] = field(default_factory=list)
    columns: int | None = None
    rows: int | None = None
    nonzeros: int | None = None
    kinds: Mapping[str, int] | None = None
    columns_after_fixing: int | None = None
    separators: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    seconds: Mapping[str, float]
    stages: Mapping[str, float] | None = None

    @classmethod
    def of_result(cls, result: Result, seconds: Mapping[str, float]) -> RunOutcome:
        """Return what a result of ``bcut solve`` or ``bcut bound`` tells."""
        return cls(
            status=result.status,
            lp=result.root.lp,
            lp_after_cuts=result.root.lp_after_cuts,
            integral=result.root.integral,
            value=result.value,
            bound=result.bound,
            nodes=result.nodes,
            rounds=[(finished.lp, finished.cuts) for finished in result.root.rounds],
            columns=result.size.columns,
            rows=result.size.rows,
            columns_after_fixing=result.size.columns_after_fixing,
            separators=result.separators,
            seconds=seconds,
            stages=result.seconds,
        )

    def stored(self, preset: str) -> dict[str, Any]:
        """Return the entry of a record, as plain data."""
        names = [attribute.name for attribute in fields(self)]
        if preset != "sizes":
            names.remove("kinds")
        if self.stages is None:
            names.remove("stages")
        data = {name: getattr(self, name) for name in names}
        return {**data, "rounds": [[lp, dict(cuts)] for lp, cuts in self.rounds]}

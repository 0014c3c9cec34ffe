"""A result as a few lines for people, and as one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from bcut.objectives.syntax import BOTTLENECKS

if TYPE_CHECKING:
    from bcut.result import Question, Result

_MEANING = {
    "optimal": "optimal",
    "infeasible": "infeasible: there is no such triangulation",
    "limit": "a limit came first",
    "interrupted": "interrupted",
    "bound": "bound at the root",
}

_IN_A_WORD = {"limit": "stopped by a limit"}


def summary(result: Result, output: Path | None = None) -> str:
    """Return the summary of a result, and where it was written, with a line break at the end."""
    instance, problem, size = result.instance, result.problem, result.size
    head = f"{instance.name}: {len(instance.points)} points in dimension {instance.dimension}\n"
    kind = ("spanning " if problem.spanning else "") + (
        "dissections" if problem.dissection else "triangulations"
    )
    kind += _restrictions(problem)
    columns = f"{size.columns:,} columns, {size.rows:,} rows"
    if size.columns_after_fixing is not None:
        columns += f"; {size.columns_after_fixing:,} columns after fixing"
    rows = [
        ("problem", f"{_asked(problem.objective, problem.sense)} over all {kind}"),
        ("program", f"formulation {problem.formulation}, method {problem.method}: {columns}"),
        ("root LP", f"{_number(result.root.lp)}, after cuts {_number(result.root.lp_after_cuts)}"),
        ("value", _number(result.value)),
        ("bound", _number(result.bound)),
        *_further(result),
        ("status", _status(result)),
        ("nodes", f"{result.nodes:,}"),
        *_separators(result),
        ("time", _times(result.seconds)),
    ]
    if result.status == "bound":
        rows = [row for row in rows if row[0] not in ("value", "nodes")]
    if output is not None:
        rows.append(("written", str(output)))
    return head + table(rows)


def headline(result: Result) -> str:
    """Return what was asked and what is known, in one line without a line break."""
    problem = result.problem
    text = f"{result.instance.name}: {_asked(problem.objective, problem.sense)}"
    if result.value is not None:
        text += f" {_number(result.value)}"
    if result.bound is not None and result.status != "optimal":
        text += f", bound {_number(result.bound)}"
    for asked, found in zip(problem.then, result.then, strict=False):
        text += f", then {_asked(asked.objective, asked.sense)} {_number(found.value)}"
    return text if result.status == "bound" else f"{text}, {_IN_A_WORD.get(result.status, result.status)}"


def table(rows: list[tuple[str, str]], *, indent: str = "  ") -> str:
    """Return pairs as lines in two aligned columns."""
    width = max((len(left) for left, _ in rows), default=0)
    return "".join(f"{indent}{left:<{width}}  {right}".rstrip() + "\n" for left, right in rows)


def _restrictions(problem: Question) -> str:
    """Write what a triangulation must have and must not have."""
    parts = [f"with {','.join(map(str, face))}" for face in problem.require]
    parts += [f"without {','.join(map(str, face))}" for face in problem.forbid]
    if problem.star is not None:
        parts.append(f"that are stars of {problem.star}")
    return " " + ", ".join(parts) if parts else ""


def _asked(objective: str, sense: str) -> str:
    """Write an objective with its sense, which a bottleneck tells itself."""
    return objective if objective.partition(":")[0] in BOTTLENECKS else f"{sense} {objective}"


def _further(result: Result) -> list[tuple[str, str]]:
    """Return what the further objectives reached, a line each."""
    return [
        (
            "then",
            f"{_asked(asked.objective, asked.sense)}: value {_number(found.value)}, bound {_number(found.bound)}",
        )
        for asked, found in zip(result.problem.then, result.then, strict=True)
    ]


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.10g}"


def _may_have_reached_a_limit(result: Result) -> bool:
    """Tell whether a limit that was asked for can be what ended a run."""
    limits = result.problem.limits
    seconds = limits.get("time")
    # Stages end a moment before the limit, rather than after it.
    in_time = seconds is None or result.seconds.get("total", 0.0) < 0.9 * seconds
    return limits.get("memory") is not None or not in_time


def _status(result: Result) -> str:
    text = _MEANING.get(result.status, result.status)
    if result.status in ("optimal", "infeasible"):
        return f"{text} ({_reason(result)})"
    if result.status == "limit" and not _may_have_reached_a_limit(result):
        text = "a limit of the solvers' accuracy, or of what fits into memory, came first"
    return text if not result.gap else f"{text}; gap {100 * result.gap:.2f} %"


def _reason(result: Result) -> str:
    """Say what the status rests on."""
    from bcut.separation.resolve import is_built_in

    certificates = [result.certificate, *(level.certificate for level in result.then)]
    unsettled = [certificate for certificate in certificates if certificate.settles is None]
    if not unsettled:
        exact = all(certificate.settles == "exactly" for certificate in certificates)
        return "proven exactly" if exact else "proven within a relative gap of 1e-9"
    foreign = [name for name in result.problem.separators if not is_built_in(name)]
    if foreign:
        return f"if the cuts of {', '.join(foreign)} are valid: they were not checked"
    return unsettled[0].reason or "the last step rests on the solver's search"


def _separators(result: Result) -> list[tuple[str, str]]:
    lines = [
        f"{name}: {family['calls']} calls, {family['found']} cuts found, {family['added']} added, "
        f"{family['seconds']:.2f} s"
        for name, family in result.separators.items()
    ]
    return [("separators" if number == 0 else "", line) for number, line in enumerate(lines)]


def _times(seconds: dict[str, float]) -> str:
    stages = ", ".join(f"{stage} {spent:.2f}" for stage, spent in seconds.items() if stage != "total")
    return f"{seconds.get('total', 0.0):.2f} s ({stages})"

"""`bcut cuts`: show, replay, verify."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bcut.cli.exits import ExitStatus
from bcut.cli.options import json_option
from bcut.errors import BcutError

if TYPE_CHECKING:
    from bcut.experiments.replay import CutChecks

_LEDGER = click.argument("ledger", type=click.Path(path_type=Path))
_QUIET = click.option(
    "--quiet", is_flag=True, help="Print nothing where all is well: the exit status says it."
)
_MOST_REASONS = 5


@click.group(short_help="Look at the cuts of an experiment, use them again, prove them again.")
def cuts() -> None:
    """Look at the cuts that an experiment recorded, solve with them again, or prove them again."""


@cuts.command("show", short_help="List the cuts of a ledger.")
@_LEDGER
@click.option("--family", metavar="NAME", help="Only cuts of this family.")
@click.option("--taken", is_flag=True, help="Only cuts that the solver took.")
@click.option("--final", is_flag=True, help="Only cuts that the last relaxation has.")
@click.option(
    "--limit",
    type=click.IntRange(min=0),
    default=50,
    show_default=True,
    metavar="N",
    help="At most N cuts; 0 for all.",
)
@json_option
def show_command(
    ledger: Path, family: str | None, taken: bool, final: bool, limit: int, as_json: bool
) -> int:
    """List the cuts of the file LEDGER (DIR/runs/*.cuts.jsonl.gz) as a table.

    Node 0 is the cutting-plane loop, 1 is SCIP's root. "violation" is by how much the point of the round violated the
    cut, "efficacy" its distance from the cut; "took" tells whether the solver took it, "end" whether the last
    relaxation has it. With --json, one object with what the file says of the cuts, proofs included, under "cuts".
    """
    from bcut.cli.output import emit
    from bcut.experiments.ledger import read_ledger

    read = read_ledger(ledger)
    chosen = [
        cut
        for cut in read.cuts
        if (family is None or cut["family"] == family)
        and (cut["taken"] or not taken)
        and (cut["final"] or not final)
    ]
    shown = chosen[: limit or None]
    instance, problem = read.header["instance"], read.header["problem"]
    if as_json:
        about = {
            "instance": instance["name"],
            "problem": problem,
            "recorded": len(read.cuts),
            "chosen": len(chosen),
        }
        emit(_with_lines(about, "cuts", shown))
        return 0
    head = f"{instance['name']}: {problem['sense']} {problem['objective']}, {len(read.cuts)} cuts\n"
    emit(head + _table([_row(cut) for cut in shown]))
    if len(shown) < len(chosen):
        emit(f"and {len(chosen) - len(shown)} more (--limit 0 shows all)\n")
    return 0


@cuts.command("replay", short_help="Solve the last root relaxation again with the cuts of a ledger.")
@_LEDGER
@json_option
@_QUIET
def replay_command(ledger: Path, as_json: bool, quiet: bool) -> int:
    """Solve the root relaxation again with exactly the cuts that the run of the file LEDGER ended with.

    Exit status 0: the bound is the recorded one, up to 1e-9; 2: it is not.
    """
    from bcut.cli.output import emit, emit_json
    from bcut.errors import VerificationError
    from bcut.experiments.ledger import read_ledger
    from bcut.experiments.replay import replay

    found = replay(read_ledger(ledger))
    if as_json:
        emit_json(
            {
                "cuts": found.cuts,
                "before": found.before,
                "recorded": found.recorded,
                "found": found.found,
                "agrees": found.agrees,
            }
        )
    elif not quiet:
        emit(
            f"{ledger}: {found.cuts} cuts move the bound from {found.before:.10g} to {found.found:.10g}; "
            f"recorded was {found.recorded:.10g}\n"
        )
    if not found.agrees:
        raise VerificationError(
            f"{ledger}: the bound with its cuts is {found.found!r}, not {found.recorded!r} as recorded"
        )
    return 0


@cuts.command("verify", short_help="Prove the cuts of ledgers again, exactly.")
@click.argument("ledgers", metavar="LEDGER...", type=click.Path(path_type=Path), nargs=-1, required=True)
@json_option
@_QUIET
def verify_command(ledgers: tuple[Path, ...], as_json: bool, quiet: bool) -> int:
    """Derive the right-hand side of every cut of each LEDGER again, exactly, from its proof and the points alone.

    The check shares nothing with the separators. Exit status 0: all that can be checked holds; 2: a cut is refused, or
    a file is no ledger, and the message says why; 3: neither, but some cuts take too long to check, and the message
    names them. Cuts of families without a checker, such as SCIP's own, are counted apart.
    """
    from bcut.cli.output import emit, emit_json

    records, status = [], ExitStatus.DONE
    for path in ledgers:
        checks, complaint, found = _verified(path)
        # A refusal in one ledger is the graver thing, whatever the others are like.
        status = found if status in (ExitStatus.DONE, ExitStatus.LIMIT) and found else status
        records.append(_record(path, checks, complaint))
        if not as_json and not quiet and checks is not None:
            emit(_account(path, checks))
        if complaint:
            print(f"Error: {complaint}", file=sys.stderr)
    if as_json:
        emit_json({"ledgers": records})
    return status


def _verified(path: Path) -> tuple[CutChecks | None, str, ExitStatus]:
    """Check one ledger; returns what came of its cuts, the complaint about it, and its exit status."""
    from bcut.experiments.ledger import read_ledger
    from bcut.experiments.replay import UncheckedCutsError, check_ledger

    try:
        checks = check_ledger(read_ledger(path))
    except UncheckedCutsError as error:
        return error.checks, str(error), ExitStatus.LIMIT
    except BcutError as error:
        return None, str(error), ExitStatus(error.exit_status)
    if not checks.refused:
        return checks, "", ExitStatus.DONE
    reasons = "; ".join(f"cut {number}: {reason}" for number, reason in checks.refused[:_MOST_REASONS])
    more = len(checks.refused) - _MOST_REASONS
    return checks, f"{path}: {reasons}" + (f"; and {more} more" if more > 0 else ""), ExitStatus.BAD_INPUT


def _record(path: Path, checks: CutChecks | None, complaint: str) -> dict[str, Any]:
    """Return what came of a ledger as plain data."""
    if checks is None:
        return {"ledger": str(path), "error": complaint}
    return {
        "ledger": str(path),
        "proven": checks.proven,
        "without_checker": checks.without_checker,
        "refused": [{"number": number, "reason": reason} for number, reason in checks.refused],
        "unchecked": [{"number": number, "reason": reason} for number, reason in checks.unchecked],
    }


def _account(path: Path, checks: CutChecks) -> str:
    """Say what came of the cuts of a ledger, but for those that are complained about."""
    lost = len(checks.refused) + len(checks.unchecked)
    unknown = _counted(checks.without_checker)
    if checks.proven or lost:
        text = f"{path}: {_counted(checks.proven) or 'none'} proven again\n"
        return text + (f"  not checked, nobody knows how: {unknown}\n" if unknown else "")
    if unknown:
        return f"{path}: nothing to prove: nobody knows how to check {unknown}\n"
    return f"{path}: nothing to prove: the run found no cuts\n"


def _with_lines(about: dict[str, Any], name: str, entries: Sequence[dict[str, Any]]) -> str:
    """Return one JSON object, whose last entry is a list with a line for each of its own."""
    lines = [f" {json.dumps(key)}: {json.dumps(value)}" for key, value in about.items()]
    listed = ",\n".join(f"  {json.dumps(entry)}" for entry in entries)
    lines.append(f" {json.dumps(name)}: " + (f"[\n{listed}\n ]" if entries else "[]"))
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _counted(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {family}" for family, count in sorted(counts.items()))


_COLUMNS = (
    "cut",
    "family",
    "node",
    "round",
    "size",
    "rhs",
    "violation",
    "efficacy",
    "took",
    "end",
    "LP before",
    "after",
)


def _row(cut: dict[str, Any]) -> tuple[str, ...]:
    return (
        str(cut["number"]),
        cut["family"],
        str(cut["node"]),
        str(cut["round"]),
        str(len(cut["simplices"])),
        f"{cut['rhs']:g}",
        _number(cut["violation"], ".4f"),
        _number(cut["efficacy"], ".4f"),
        "yes" if cut["taken"] else "no",
        "yes" if cut["final"] else "no",
        _number(cut["lp_before"], ".8g"),
        _number(cut["lp_after"], ".8g"),
    )


def _number(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)


def _table(rows: list[tuple[str, ...]]) -> str:
    lines = [_COLUMNS, *rows]
    widths = [max(len(line[column]) for line in lines) for column in range(len(_COLUMNS))]
    text = ""
    for line in lines:
        cells = [
            cell.ljust(width) if column == 1 else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        ]
        text += "  ".join(cells).rstrip() + "\n"
    return text

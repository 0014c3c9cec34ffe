"""`bcut cuts`: show, replay, verify."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from bcut.cli.options import json_option

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
    relaxation has it.
    """
    from bcut.cli.output import emit, emit_json
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
    if as_json:
        emit_json(shown)
        return 0
    instance, problem = read.header["instance"], read.header["problem"]
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


@cuts.command("verify", short_help="Prove the cuts of a ledger again, exactly.")
@_LEDGER
@json_option
@_QUIET
def verify_command(ledger: Path, as_json: bool, quiet: bool) -> int:
    """Derive the right-hand side of every cut of the file LEDGER again, exactly, from its proof and the points alone.

    The check shares nothing with the separators. Exit status 0: all that can be checked holds; 2: a cut is refused,
    and the message says why. Cuts of families without a checker, such as SCIP's own, are counted apart.
    """
    from bcut.cli.output import emit, emit_json
    from bcut.errors import VerificationError
    from bcut.experiments.ledger import read_ledger
    from bcut.experiments.replay import check_ledger

    checks = check_ledger(read_ledger(ledger))
    if as_json:
        emit_json(
            {
                "proven": checks.proven,
                "without_checker": checks.without_checker,
                "refused": [{"number": number, "reason": reason} for number, reason in checks.refused],
            }
        )
    elif not quiet:
        emit(f"{ledger}: {_counted(checks.proven) or 'no cuts'} proven again\n")
        if checks.without_checker:
            emit(f"  not checked, nobody knows how: {_counted(checks.without_checker)}\n")
    if checks.refused:
        reasons = "; ".join(f"cut {number}: {reason}" for number, reason in checks.refused[:_MOST_REASONS])
        more = len(checks.refused) - _MOST_REASONS
        raise VerificationError(f"{ledger}: {reasons}" + (f"; and {more} more" if more > 0 else ""))
    return 0


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

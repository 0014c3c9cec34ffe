"""`bcut verify`."""

from __future__ import annotations

from pathlib import Path

import click

from bcut.cli.options import json_option, result_argument


@click.command(short_help="Re-check a result file exactly, without any solver.")
@result_argument
@json_option
@click.option("--quiet", is_flag=True, help="Print nothing where the result holds: the exit status says it.")
def verify(result: Path, as_json: bool, quiet: bool) -> int:
    """Re-check the file RESULT exactly: triangulation, value, and the bound where it carries a certificate.

    The check shares nothing with the model or the solvers that found the result. Exit status 0: the result
    holds; 2: it is refused, and the message says why.
    """
    from bcut.cli.output import emit, emit_json
    from bcut.verification.verify import verify as call

    found = call(result)
    if as_json:
        emit_json(
            {
                "statement": found.statement,
                "value": _text(found.value),
                "exact_bound": _text(found.exact_bound),
                "rounded_bound": _text(found.rounded_bound),
                "proven_optimal": found.proven_optimal,
                "then": [
                    {
                        "statement": level.statement,
                        "value": _text(level.value),
                        "exact_bound": _text(level.exact_bound),
                        "rounded_bound": _text(level.rounded_bound),
                        "proven_optimal": level.proven_optimal,
                    }
                    for level in found.further
                ],
                "checks": found.checks,
            }
        )
    elif not quiet:
        emit(f"{result}: {found.statement}\n" + "".join(f"  {check}\n" for check in found.checks))
    return 0


def _text(value: object) -> str | None:
    return None if value is None else str(value)

"""Entry point of the program `bcut`: finds the command, and turns errors into messages and exit statuses."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Any

import click

from bcut import __version__
from bcut.cli.exits import ExitStatus
from bcut.errors import BcutError

# Command name -> module with a function of that name; loaded when the command is used or its help is shown.
_COMMANDS = {
    name: f"bcut.cli.commands.{name}"
    for name in (
        "solve",
        "bound",
        "verify",
        "regular",
        "region",
        "separators",
        "objectives",
        "experiment",
        "cuts",
        "info",
        "generate",
        "export",
        "plot",
    )
}


class LazyGroup(click.Group):
    """A group of commands that imports only the module of the command that is used."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names in the order in which a user meets them."""
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command; None where there is no such one."""
        if cmd_name not in _COMMANDS:
            return None
        command: click.Command = getattr(import_module(_COMMANDS[cmd_name]), cmd_name)
        return command


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Exit status: 0 done, 2 bad usage or input, 3 a limit came first, 5 a plug-in or the solver failed, "
    "130 interrupted.",
)
@click.version_option(
    __version__, prog_name="bcut", message="%(prog)s %(version)s", help="Show the version and exit."
)
def bcut() -> None:
    """Find provably optimal triangulations of point configurations, by branch-and-cut.

    An INSTANCE is a file of points (.json, .dat, .csv, .npy, .off, .ply) or a member of a family such as cube:4 or
    random:20,3,seed=1; `bcut generate --list` shows the families.
    """


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status; every message goes to standard error."""
    try:
        status: Any = bcut.main(
            None if arguments is None else list(arguments), prog_name="bcut", standalone_mode=False
        )
    except (click.exceptions.Abort, KeyboardInterrupt):  # click turns the one into the other
        print("Interrupted before anything was found.", file=sys.stderr)
        return ExitStatus.INTERRUPTED
    except click.ClickException as error:
        error.show()
        return ExitStatus.BAD_INPUT
    except BcutError as error:
        _complain(error)
        return error.exit_status
    return int(status or 0)


def main() -> None:
    """Run as a program."""
    sys.exit(run())


def _complain(error: BcutError) -> None:
    """Print the message; before it, a plug-in's own traceback, which its author needs."""
    trace = getattr(error, "trace", "")
    if trace:
        print(trace.rstrip(os.linesep), file=sys.stderr)
    print(f"Error: {error}", file=sys.stderr)

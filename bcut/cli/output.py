"""Standard output: data goes there, whole, and a reader that leaves early is no error."""

from __future__ import annotations

import json
import os
import sys
from typing import Any

from bcut.errors import InputError
from bcut.summary import table as table


def emit(text: str) -> None:
    """Write text to standard output.

    Raises
    ------
    InputError
        If standard output cannot take it, such as a full disk behind a redirection.
    """
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:
        _discard_standard_output()
    except OSError as error:
        _discard_standard_output()
        raise InputError(
            f"standard output cannot be written ({error.strerror}); redirect it elsewhere"
        ) from None


def emit_json(data: Any) -> None:
    """Write one JSON value to standard output."""
    emit(json.dumps(data, indent=1, allow_nan=False) + "\n")


def _discard_standard_output() -> None:
    """Send what is still buffered nowhere: the interpreter would complain about it when it ends."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)

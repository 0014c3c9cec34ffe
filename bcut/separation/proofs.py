"""Proofs of cuts as plain data: result files and ledgers are JSON, and plug-ins compute with numpy."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from math import isfinite
from typing import Any

import numpy as np

from bcut.errors import SeparatorError
from bcut.separation.calls import shown

_MEND = "a proof is JSON-ready data: text, integers, finite floats, Fractions, lists and mappings of them"


class _NotPlainError(Exception):
    """Something that JSON does not hold."""


def plain_proof(proof: Any, family: str) -> dict[str, Any]:
    """Return the proof of a cut as JSON holds it.

    Numbers and arrays of numpy become those of Python, tuples lists, Fractions text such as ``"3/2"``, keys text.
    None is no proof, as an empty mapping is.

    Raises
    ------
    SeparatorError
        If it is no mapping, or holds something else.
    """
    if proof is None:
        return {}
    if not isinstance(proof, Mapping):
        raise SeparatorError(
            family,
            f"a cut's proof must be a mapping such as {{'clique': [3, 5, 8]}}, or left out, not {shown(proof)}",
        )
    plain = {}
    for key, value in proof.items():
        try:
            plain[_key(key)] = _plain(value)
        except _NotPlainError as wrong:
            raise SeparatorError(family, f"a cut's proof holds {wrong} under {key!r}; {_MEND}") from None
        except RecursionError:
            message = f"a cut's proof is nested too deeply under {key!r}, or holds itself; {_MEND}"
            raise SeparatorError(family, message) from None
    return plain


def _plain(value: Any) -> Any:
    if value is None or isinstance(value, str | int):  # bool is an int
        return value
    if isinstance(value, list | tuple):
        if set(map(type, value)) <= {int}:  # most of what proofs hold
            return list(value)
        return [_plain(entry) for entry in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.bool_ | np.integer | np.floating):
        return _plain(value.item() if type(value) is not np.longdouble else float(value))
    if isinstance(value, float):
        if not isfinite(value):
            raise _NotPlainError(f"the number {value}")
        return value
    if isinstance(value, Fraction):
        return str(value)
    if isinstance(value, Mapping):
        return {_key(key): _plain(entry) for key, entry in value.items()}
    raise _NotPlainError(shown(value))


def _key(key: Any) -> str:
    if isinstance(key, str):
        return key
    if isinstance(key, int | np.integer) and not isinstance(key, bool):
        return str(int(key))
    raise _NotPlainError(f"the key {shown(key)}")

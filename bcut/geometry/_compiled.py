"""Compiles a kernel with numba, and keeps the machine code on disk where that is possible."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from functools import wraps
from typing import Any

# What reading or writing of the cache may raise: it does no other input or output, and happens before a kernel runs.
_CACHE_ERRORS = (OSError, EOFError, pickle.PickleError)


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function of arrays and numbers at its first call.

    numba looks for a folder that it can write to when a function is decorated, and reads and writes there when
    it is called first. Neither may fail the computation: a read-only installation, a full disk or a damaged file
    only mean to compile again in the next process.
    """
    import numba

    try:
        fast = numba.njit(cache=True)(function)
    except (RuntimeError, *_CACHE_ERRORS):
        fast = numba.njit(function)

    @wraps(function)
    def call(*arguments: Any) -> Any:
        nonlocal fast
        try:
            return fast(*arguments)
        except _CACHE_ERRORS:
            fast = numba.njit(function)
            return fast(*arguments)

    return call

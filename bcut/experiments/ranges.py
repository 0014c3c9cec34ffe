"""Families of instances in a plan: patterns with placeholders, and the ranges that fill them."""

from __future__ import annotations

import re
import string
from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

_RANGE = re.compile(r"\s*(-?\d+)\s*\.\.\s*(-?\d+)\s*(?::\s*(\d+)\s*)?")
_MOST = 100_000


def values_of(range_or_list: Any) -> list[Any]:
    """Return what a placeholder runs over: a list, or a text such as "0..29" or "12..24:2", both ends included.

    Raises
    ------
    ValueError
        It is neither; the message says what is expected.
    """
    if isinstance(range_or_list, list):
        good = [v for v in range_or_list if isinstance(v, int | str) and not isinstance(v, bool)]
        if good and len(good) == len(range_or_list):
            return good
    elif isinstance(range_or_list, int) and not isinstance(range_or_list, bool):
        return [range_or_list]
    elif isinstance(range_or_list, str) and (match := _RANGE.fullmatch(range_or_list)):
        first, last, step = int(match[1]), int(match[2]), int(match[3] or 1)
        if step and first <= last <= first + _MOST * step:
            return list(range(first, last + 1, step))
    raise ValueError(
        f'is a list of numbers or texts, or a range such as "0..29" or "12..24:2", not {range_or_list!r}'
    )


def placeholders(pattern: str) -> list[str]:
    """Return the names in braces of a pattern, in order.

    Raises
    ------
    ValueError
        Braces that do not pair, or hold no name.
    """
    try:
        names = [name for _, name, *_ in string.Formatter().parse(pattern) if name is not None]
    except ValueError as error:
        raise ValueError(f"has braces that do not pair ({error})") from None
    for name in names:
        if not name.isidentifier():
            raise ValueError(f"has a placeholder {{{name}}} that is no name")
    return list(dict.fromkeys(names))


def combinations_of(ranges: Mapping[str, list[Any]]) -> Iterator[dict[str, Any]]:
    """Yield every choice of one value for each placeholder; the last one changes fastest."""
    for chosen in product(*ranges.values()):
        yield dict(zip(ranges, chosen, strict=True))

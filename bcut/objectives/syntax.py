"""How an objective is written: ``MEASURE``, or ``min-max:MEASURE`` and ``max-min:MEASURE`` for the worst simplex."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from bcut.errors import InputError

Sense = Literal["min", "max"]

#: The sense that each kind of bottleneck fixes: min-max minimises the largest measure, max-min maximises the smallest.
BOTTLENECKS: dict[str, Sense] = {"min-max": "min", "max-min": "max"}

# A path may hold colons itself, behind a drive for one, so it ends where ".py" does.
_FILE = re.compile(r".+?\.py(?=:|$)")


@dataclass(frozen=True)
class ObjectiveName:
    """An objective as written by a user.

    Attributes
    ----------
    text : str
        All of it, such as "min-max:aspect-ratio".
    measure : str
        What is summed, or what is compared, with its argument: "aspect-ratio", "costs:FILE", "./mine.py:function".
    sense : {"min", "max"}
    is_bottleneck : bool
        Whether the worst simplex counts, not the sum.
    """

    text: str
    measure: str
    sense: Sense
    is_bottleneck: bool


@dataclass(frozen=True)
class MeasureName:
    """A measure as written by a user: a name or a file, and what stands behind its colon."""

    source: str
    argument: str

    @classmethod
    def parse(cls, text: str) -> MeasureName:
        """Split ``NAME[:ARGUMENT]`` or ``FILE.py[:FUNCTION]``."""
        name = text.partition(":")[0]
        # Only a measure that takes a file, such as costs:FILE, has a path behind a plain name.
        path = None if re.fullmatch(r"[a-z]+(-[a-z]+)*", name) and name != text else _FILE.match(text)
        source = path.group() if path else name
        return cls(source, text[len(source) + 1 :])

    @property
    def is_file(self) -> bool:
        """Whether it is a function in a file of a user."""
        return self.source.endswith(".py") or "/" in self.source or "\\" in self.source


def read_objective(text: str, sense: str | None = None) -> ObjectiveName:
    """Read an objective and the sense given with it.

    Parameters
    ----------
    text : str
    sense : {"min", "max"}, optional
        Without it, a sum is minimised, and a bottleneck has its own sense.

    Raises
    ------
    InputError
        If the sense is none, or contradicts the bottleneck, or the bottleneck has no measure.
    """
    if sense not in (None, "min", "max"):
        raise InputError(f"sense '{sense}': it is 'min' or 'max'")
    kind, _, measure = text.partition(":")
    if kind not in BOTTLENECKS:
        return ObjectiveName(text, text, "max" if sense == "max" else "min", is_bottleneck=False)
    if not measure or measure.partition(":")[0] in BOTTLENECKS:
        raise InputError(f"objective '{text}': name the measure behind the colon, as in {kind}:aspect-ratio")
    own = BOTTLENECKS[kind]
    if sense not in (None, own):
        other = next(name for name in BOTTLENECKS if name != kind)
        raise InputError(
            f"objective '{text}' and sense '{sense}' contradict each other: {kind} is a {own}imum. "
            f"Leave the sense out, or write {other}:{measure}"
        )
    return ObjectiveName(text, measure, own, is_bottleneck=True)


def read_level(text: str) -> ObjectiveName:
    """Read a further objective of a lexicographic combination: ``[min:|max:]OBJECTIVE``."""
    prefix, _, rest = text.partition(":")
    if prefix in ("min", "max"):
        return read_objective(rest, prefix)
    return read_objective(text)

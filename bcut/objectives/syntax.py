"""How an objective is written: ``MEASURE``, or ``min-max:MEASURE`` and ``max-min:MEASURE`` for the worst simplex.

From Python a measure may also be a function, and then ``("max-min", function)`` stands for the worst simplex.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from bcut.errors import InputError

Sense = Literal["min", "max"]

#: The sense that each kind of bottleneck fixes: min-max minimises the largest measure, max-min maximises the smallest.
BOTTLENECKS: dict[str, Sense] = {"min-max": "min", "max-min": "max"}

#: What stands in front of a function's name, in the text that stands for it.
FUNCTION = "python"

Function = Callable[..., Any]
ObjectiveLike = str | Function | tuple[str, Function]

# A path may hold colons itself, behind a drive for one, so it ends where ".py" does.
_FILE = re.compile(r".+?\.py(?=:|$)")


class FunctionText(str):
    """The text that stands for a function of a Python session, ``[PREFIX:]python:NAME``, and the function itself.

    A result holds the text, and a table of costs; a copy is plain text.
    """

    __slots__ = ("function",)
    function: Function

    def __new__(cls, text: str, function: Function) -> FunctionText:
        """Put text and function together."""
        made = super().__new__(cls, text)
        made.function = function
        return made

    @classmethod
    def of(cls, function: Function, prefix: str | None = None) -> FunctionText:
        """Name a function, as Python does; one without a name is called by its type."""
        name = getattr(function, "__qualname__", type(function).__qualname__)
        return cls(f"{FUNCTION}:{name}" if prefix is None else f"{prefix}:{FUNCTION}:{name}", function)

    def behind(self, prefix: str) -> FunctionText:
        """Return what stands behind a prefix and its colon."""
        return FunctionText(self[len(prefix) + 1 :], self.function)

    def __reduce__(self) -> tuple[type[str], tuple[str]]:
        return str, (str(self),)


def objective_text(objective: ObjectiveLike) -> str:
    """Return an objective as text.

    Parameters
    ----------
    objective : str, function, or (str, function)
        The text of a pair is what stands in front of the function: "min-max", "max-min", or, for further objectives,
        "min" and "max".

    Raises
    ------
    InputError
        It is something else.
    """
    if isinstance(objective, str):
        return objective
    if callable(objective):
        return FunctionText.of(objective)
    if isinstance(objective, tuple) and len(objective) == 2:
        prefix, function = objective
        if isinstance(prefix, str) and callable(function):
            return FunctionText.of(function, prefix)
    raise InputError(
        f"objective {objective!r}: give a measure such as 'weight', a function of the coordinates of simplices, or "
        "a pair such as ('max-min', function)"
    )


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

    @property
    def is_function(self) -> bool:
        """Whether it is a function of a user, in a file or not: nobody but the user can evaluate it again."""
        return self.is_file or self.source == FUNCTION


def read_objective(objective: ObjectiveLike, sense: str | None = None) -> ObjectiveName:
    """Read an objective and the sense given with it.

    Parameters
    ----------
    objective : str, function, or (str, function)
        As for `objective_text`.
    sense : {"min", "max"}, optional
        Without it, a sum is minimised, and a bottleneck has its own sense.

    Raises
    ------
    InputError
        If the sense is none, or contradicts the bottleneck, or the bottleneck has no measure.
    """
    text = objective_text(objective)
    if sense not in (None, "min", "max"):
        raise InputError(f"sense '{sense}': it is 'min' or 'max'")
    kind, _, measure = text.partition(":")
    if isinstance(text, FunctionText):
        if kind not in (FUNCTION, *BOTTLENECKS):
            raise InputError(f"objective '{text}': in front of a function stands {' or '.join(BOTTLENECKS)}")
        measure = text.behind(kind)
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


def read_level(objective: ObjectiveLike) -> ObjectiveName:
    """Read a further objective of a lexicographic combination: ``[min:|max:]OBJECTIVE``."""
    text = objective_text(objective)
    prefix, _, rest = text.partition(":")
    if prefix in ("min", "max"):
        return read_objective(text.behind(prefix) if isinstance(text, FunctionText) else rest, prefix)
    return read_objective(text)

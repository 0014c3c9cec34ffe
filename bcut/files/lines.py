"""Lines of words, for the formats of meshes: what is missing or too much is told, with its line."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import NoReturn

from bcut.errors import ConfigurationError, InputError
from bcut.geometry.expressions import parse_coordinate

# Also nan and inf, which then are told as what they are; formulas are for other formats.
_NUMBER = re.compile(r"[+-]?([0-9.]+([eE][+-]?[0-9]+)?|nan|inf(inity)?)", re.ASCII | re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Line:
    """A line that is not empty.

    Attributes
    ----------
    path : Path
        Of its file.
    number : int
        Counted from 1.
    words : list of str
    """

    path: Path
    number: int
    words: list[str]

    @property
    def text(self) -> str:
        """The words with a space in between."""
        return " ".join(self.words)

    def refuse(self, problem: str) -> NoReturn:
        """Raise an InputError that names the file and the line."""
        raise InputError(f"{self.path}: line {self.number}: {problem}")

    def coordinate(self, column: int) -> Fraction:
        """Return a word as the number that it stands for, exactly.

        Raises
        ------
        InputError
            It is no decimal number.
        """
        word = self.words[column]
        if not _NUMBER.fullmatch(word):
            self.refuse(f"'{word[:40]}' is no decimal number; other numbers can be written in csv and json")
        try:
            value = parse_coordinate(word)
        except ConfigurationError as error:
            self.refuse(str(error))
        assert isinstance(value, Fraction)  # decimal numbers are rational
        return value

    def index(self, column: int, n: int) -> int:
        """Return a word as the number of one of n vertices.

        Raises
        ------
        InputError
            It is none.
        """
        word = self.words[column]
        number = count_of(word)
        if number is None or number >= n:
            self.refuse(f"'{word[:40]}' is no vertex; they are numbered from 0 to {n - 1}")
        return number


def count_of(word: str) -> int | None:
    """Return a word as a number of things, or None if it is none; nothing has a billion of them."""
    return int(word) if re.fullmatch(r"[0-9]{1,9}", word, re.ASCII) else None


class Lines(Iterator[Line]):
    """The lines of a text that are not empty, one after the other.

    Parameters
    ----------
    path : Path
        For messages.
    text : str
    comment : str, optional
        What begins a comment, anywhere on a line.
    """

    def __init__(self, path: Path, text: str, comment: str | None = None) -> None:
        self.path = path
        bare = (line.partition(comment)[0] if comment else line for line in text.splitlines())
        self._lines = [
            Line(path, number, words) for number, line in enumerate(bare, start=1) if (words := line.split())
        ]
        self._position = 0

    def __next__(self) -> Line:
        if self._position == len(self._lines):
            raise StopIteration
        self._position += 1
        return self._lines[self._position - 1]

    def upto(self, count: int, what: str, promise: str) -> Iterator[Line]:
        """Go through the next `count` lines.

        Raises
        ------
        InputError
            The text ends before.
        """
        for position in range(count):
            line = next(self, None)
            if line is None:
                raise InputError(
                    f"{self.path}: the file ends before {what} {position} (counted from 0), but {promise}; "
                    "is it cut off?"
                )
            yield line

    def end(self, promise: str) -> None:
        """Refuse what is left.

        Raises
        ------
        InputError
            Something is.
        """
        line = next(self, None)
        if line is not None:
            line.refuse(
                f"'{line.text[:40]}' is too much, as {promise}; correct these numbers or take the line out"
            )

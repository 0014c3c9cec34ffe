"""The parameters after the colon of a family's name, read with errors that show the right form."""

from __future__ import annotations

from typing import NoReturn

from bcut.errors import InputError

#: More points than this are surely a typing error: their simplices could not be listed.
MAX_POINTS = 100_000
MAX_COORDINATES = 1_000_000


class Parameters:
    """Positional integers, flags and `key=integer` options of one family, taken one after the other.

    Parameters
    ----------
    family, form, example : str
        The family's name, its general form and one example, for error messages.
    text : str
        What follows the colon; empty where there is none.
    """

    def __init__(self, family: str, form: str, example: str, text: str) -> None:
        self._family, self._form, self._example = family, form, example
        self._items = [item.strip() for item in text.split(",")] if text.strip() else []
        self._used: list[str] = []

    def fail(self, problem: str) -> NoReturn:
        """Raise the error that names the family, the problem, the form and an example."""
        example = "without parameters" if self._form == self._example else f"for example {self._example}"
        raise InputError(f"family '{self._family}': {problem}; write {self._form}, {example}")

    def integer(self, name: str, low: int, high: int | None = None, *, default: int | None = None) -> int:
        """Return the next positional integer; the default, if there is one, stands for no parameters at all.

        Raises
        ------
        InputError
            It is missing, no integer, or out of range.
        """
        if default is not None and not self._items:
            self._used.append(str(default))
            return default
        if not self._items or "=" in self._items[0]:
            self.fail(f"the parameter {name} is missing")
        return self._convert(name, self._items.pop(0), low, high, "")

    def integers(self, name: str, low: int) -> list[int]:
        """All remaining positional integers, at least one."""
        values = [self.integer(name, low)]
        while self._items and "=" not in self._items[0]:
            values.append(self.integer(name, low))
        return values

    def flag(self, name: str) -> bool:
        """Whether the word stands next."""
        if self._items and self._items[0] == name:
            self._used.append(self._items.pop(0))
            return True
        return False

    def option(self, name: str, default: int) -> int:
        """Return the value of `name=integer`, non-negative; a default is written out in the full name."""
        for index, item in enumerate(self._items):
            key, equals, value = item.partition("=")
            if key.strip() == name and equals:
                del self._items[index]
                return self._convert(name, value.strip(), 0, None, f"{name}=")
        self._used.append(f"{name}={default}")
        return default

    def finish(self, points: int, dimension: int) -> None:
        """Check that nothing is left over and that the configuration is of a sensible size."""
        if self._items:
            self.fail(f"there is no parameter '{self._items[0]}' here")
        if points > MAX_POINTS or points * dimension > MAX_COORDINATES:
            count = str(points) if points < 10**12 else "more than 10^12"
            self.fail(
                f"{count} points in dimension {dimension} are too many "
                f"(at most {MAX_POINTS} points and {MAX_COORDINATES} coordinates)"
            )

    @property
    def name(self) -> str:
        """The family's name with its parameters, in one normal form."""
        return f"{self._family}:{','.join(self._used)}" if self._used else self._family

    def _convert(self, name: str, text: str, low: int, high: int | None, prefix: str) -> int:
        digits = text[1:] if text[:1] in {"+", "-"} else text
        if not (digits.isascii() and digits.isdigit()) or len(digits) > 18:
            self.fail(f"{name} must be an integer, not '{text[:40]}'")
        value = int(text)
        if value < low or (high is not None and value > high):
            self.fail(
                f"{name} must be at least {low}{'' if high is None else f' and at most {high}'}, not {value}"
            )
        self._used.append(f"{prefix}{value}")
        return value

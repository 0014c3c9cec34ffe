"""The grammar of coordinate texts, read without evaluating anything that could grow without bound.

A coordinate is an integer, a rational "p/q", a decimal, or an expression of these with + - * / ** (integer
exponents), parentheses, sqrt(k) of a non-negative rational, and cos(q*pi) of a rational multiple of pi. What is
rational is folded at once; what is not stays a small tree, to be evaluated in a number field once the field of
the whole configuration is known.

A decimal stands for a float64: programs write theirs so, with 17 digits or as few as tell them apart, and what
they wrote must be read back as it was. It is the float64 nearest to it, exactly; "0.1" is not "1/10". A decimal
that no float64 is written like is refused, since it would be changed without a word.
"""

from __future__ import annotations

import ast
import math
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from bcut.errors import ConfigurationError
from bcut.geometry.radicals import Term, cosine_terms, sqrt_terms

#: Bits that a numerator or denominator may have anywhere; well inside Python's limit on integers as text.
MAX_BITS = 14_000
_MAX_LENGTH = 100_000
_MAX_DEPTH = 150
_MAX_EXPONENT = 1000

_RATIONAL = re.compile(r"[+-]?[0-9]+(/[0-9]+)?", re.ASCII)
_DECIMAL = re.compile(r"[+-]?(?=\.?[0-9])([0-9]*)\.?([0-9]*)(?:[eE]([+-]?[0-9]+))?", re.ASCII)
_EXACT_INTEGERS = 2.0**53
_ALLOWED = re.compile(r"[0-9A-Za-z.+\-*/() \t]*", re.ASCII)
_EXAMPLE = 'write it like "3", "-1/2", "0.25", "(1+sqrt(5))/2" or "cos(2*pi/7)"'


@dataclass(frozen=True, slots=True)
class Sum:
    """A leaf: the sum of some terms, at least one of them irrational."""

    terms: tuple[Term, ...]


@dataclass(frozen=True, slots=True)
class Operation:
    """An operation on two expressions; for `**` the right one is an integer."""

    operator: str
    left: Expression
    right: Expression


#: A parsed coordinate: an exact rational, or a tree with irrational leaves.
Expression = Fraction | Sum | Operation


@dataclass(frozen=True, slots=True)
class _PiMultiple:
    """A rational multiple of pi; stands only inside cos."""

    factor: Fraction


_Value = Fraction | Sum | Operation | _PiMultiple


def parse_coordinate(text: str) -> Expression:
    """Read one coordinate text.

    Returns
    -------
    Fraction where the value is rational, else a tree of `Operation` and `Sum`.

    Raises
    ------
    ConfigurationError
        The text is no coordinate, is not finite, or is too large to be handled exactly.
    """
    stripped = text.strip()
    if len(stripped) > _MAX_LENGTH:
        raise ConfigurationError(
            f"a coordinate text of {len(stripped)} characters is too long (limit {_MAX_LENGTH})"
        )
    try:
        if _RATIONAL.fullmatch(stripped):
            return _bounded(Fraction(stripped))
        if _DECIMAL.fullmatch(stripped):
            return Fraction(double_of(stripped))
        return _Reader(stripped).read()
    except ConfigurationError as error:
        raise ConfigurationError(f"cannot read the coordinate {_quote(text)}: {error}") from None
    except ZeroDivisionError:
        raise ConfigurationError(f"cannot read the coordinate {_quote(text)}: it divides by zero") from None
    except (ValueError, MemoryError, RecursionError):
        raise ConfigurationError(
            f"cannot read the coordinate {_quote(text)}: it is too long or nested too deeply"
        ) from None


def terms_of(expression: Expression) -> Iterator[Term]:
    """All terms at the leaves of an expression: they determine the number field that holds its value."""
    pending = [expression]
    while pending:
        node = pending.pop()
        if isinstance(node, Sum):
            yield from node.terms
        elif isinstance(node, Operation):
            pending += [node.left, node.right]


def double_of(text: str) -> float:
    """Return the float64 that a decimal stands for.

    Parameters
    ----------
    text : str
        Digits with a point, an exponent or neither, perhaps behind a sign.

    Raises
    ------
    ConfigurationError
        No float64 is written like this: it is out of range, or its digits are those of another number.
    """
    match = _DECIMAL.fullmatch(text)
    if match is None:
        raise ConfigurationError(f"{text[:60]!r} is no number; {_EXAMPLE}")
    whole, fraction, power = match.groups()
    value = abs(float(text))
    if math.isinf(value):
        raise ConfigurationError("it is beyond the range of float64, about 1.8e308; scale the points down")
    digits = (whole + fraction).lstrip("0")
    kept = digits.rstrip("0")
    if kept and value == 0:
        raise ConfigurationError(
            "it is too small for a float64 and would become 0; write it exactly, such as 1/10**400"
        )
    # 17 digits tell all float64 apart, so nobody who writes a fraction with so many means more than the nearest one.
    # Integers beyond 2**53 are another matter: there an integer may be meant that is no float64.
    clear = not kept or (len(kept) <= 17 and sys.float_info.min <= value < _EXACT_INTEGERS)
    if not clear:
        unit = Fraction(10) ** (int(power or 0) - len(fraction) + len(digits) - len(kept))
        written = int(kept) * unit
        # What a program writes is rounded from the float64, or the shortest text that is nearest to it. At powers of
        # two, where the spacing changes, the latter need not be the former.
        if 2 * abs(written - Fraction(value)) > unit and written != Fraction(repr(value)):
            raise ConfigurationError(
                "a number with a point or an exponent is a double, but no double is written like this: the nearest is "
                f"{float(text)!r}; write that, or the exact number as an integer or a fraction p/q"
            )
    return float(text)


def _bounded(value: Fraction) -> Fraction:
    if value.numerator.bit_length() > MAX_BITS or value.denominator.bit_length() > MAX_BITS:
        raise ConfigurationError(f"it leads to integers of more than {MAX_BITS} bits")
    return value


def _quote(text: str) -> str:
    return repr(text if len(text) <= 60 else text[:57] + "...")


class _Reader:
    """Walks the syntax tree of one text; only the node types named here get through."""

    def __init__(self, text: str) -> None:
        self.text = text

    def read(self) -> Expression:
        if self.text.lower().lstrip("+-") in {"nan", "inf", "infinity"}:
            raise ConfigurationError("coordinates must be finite numbers")
        allowed = _ALLOWED.match(self.text)
        if not self.text or allowed is None or allowed.end() != len(self.text):
            where = (
                f"the character {self.text[allowed.end()]!r} is not allowed"
                if self.text and allowed
                else "it is empty"
            )
            raise ConfigurationError(f"{where}; {_EXAMPLE}")
        try:
            tree = ast.parse(self.text, mode="eval")
        except SyntaxError:
            raise ConfigurationError(f"it is no arithmetic expression; {_EXAMPLE}") from None
        value = self.visit(tree.body, 0)
        if isinstance(value, _PiMultiple):
            raise ConfigurationError("pi may only stand inside cos(...), because pi itself is not algebraic")
        return value

    def visit(self, node: ast.expr, depth: int) -> _Value:
        if depth > _MAX_DEPTH:
            raise ConfigurationError(f"it is nested more than {_MAX_DEPTH} levels deep")
        if isinstance(node, ast.Constant):
            return self.constant(node)
        if isinstance(node, ast.Name) and node.id == "pi":
            return _PiMultiple(Fraction(1))
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            value = self.visit(node.operand, depth + 1)
            return value if isinstance(node.op, ast.UAdd) else _binary("*", Fraction(-1), value)
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
            left, right = self.visit(node.left, depth + 1), self.visit(node.right, depth + 1)
            return _binary(_OPERATORS[type(node.op)], left, right)
        if isinstance(node, ast.Call):
            return self.call(node, depth)
        raise ConfigurationError(f"{self.source(node)!r} is not allowed; {_EXAMPLE}")

    def source(self, node: ast.expr) -> str:
        return self.text[node.col_offset : node.end_col_offset]  # the text is ASCII: offsets count characters

    def constant(self, node: ast.Constant) -> Fraction:
        numeral = self.source(node)
        if re.fullmatch(r"[0-9]+", numeral):
            return _bounded(Fraction(int(numeral)))
        if _DECIMAL.fullmatch(numeral):
            return Fraction(double_of(numeral))
        raise ConfigurationError(f"{numeral!r} is no number; {_EXAMPLE}")

    def call(self, node: ast.Call, depth: int) -> Expression:
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if name not in {"sqrt", "cos"}:
            raise ConfigurationError(
                f"{self.source(node.func)!r} is no known function; there are sqrt(k) and cos(2*pi/m)"
            )
        if len(node.args) != 1 or node.keywords:
            raise ConfigurationError(f"{name} takes one argument")
        argument = self.visit(node.args[0], depth + 1)
        if name == "sqrt":
            if not isinstance(argument, Fraction) or argument < 0:
                raise ConfigurationError(
                    "sqrt takes a non-negative rational number; nested roots are not supported"
                )
            return _folded(sqrt_terms(argument))
        if argument == 0:
            argument = _PiMultiple(Fraction(0))
        if not isinstance(argument, _PiMultiple):
            raise ConfigurationError("cos takes a rational multiple of pi, such as cos(2*pi/7)")
        return _folded(cosine_terms(argument.factor / 2))


_OPERATORS: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Pow: "**",
}


def _folded(terms: tuple[Term, ...]) -> Expression:
    if any(turns or radicand != 1 for _, turns, radicand in terms):
        return Sum(terms)
    return sum((coefficient for coefficient, _, _ in terms), Fraction(0))


def _binary(operator: str, left: _Value, right: _Value) -> _Value:
    if isinstance(left, _PiMultiple) or isinstance(right, _PiMultiple):
        return _pi_arithmetic(operator, left, right)
    if operator == "**":
        return _power(left, right)
    if not isinstance(left, Fraction) or not isinstance(right, Fraction):
        return Operation(operator, left, right)
    if operator == "+":
        return _bounded(left + right)
    if operator == "-":
        return _bounded(left - right)
    return _bounded(left * right if operator == "*" else left / right)


def _power(base: Expression, exponent: Expression) -> Expression:
    if not isinstance(exponent, Fraction) or exponent.denominator != 1:
        raise ConfigurationError("an exponent must be an integer; write sqrt(k) for a square root")
    n = exponent.numerator
    if abs(n) > _MAX_EXPONENT:
        raise ConfigurationError(f"the exponent {n if abs(n) < 10**9 else '...'} is beyond {_MAX_EXPONENT}")
    if not isinstance(base, Fraction):
        return Operation("**", base, exponent)
    if max(base.numerator.bit_length(), base.denominator.bit_length()) * abs(n) > 2 * MAX_BITS:
        raise ConfigurationError(f"it leads to integers of more than {MAX_BITS} bits")
    return _bounded(base**n)


def _pi_arithmetic(operator: str, left: _Value, right: _Value) -> _PiMultiple | Fraction:
    """Arithmetic inside the argument of cos."""
    if operator in {"+", "-"}:
        factors = [Fraction(0) if side == 0 else getattr(side, "factor", None) for side in (left, right)]
        if factors[0] is not None and factors[1] is not None:
            total = factors[0] + factors[1] if operator == "+" else factors[0] - factors[1]
            return _PiMultiple(_bounded(total))
    elif operator == "*":
        if isinstance(left, _PiMultiple) and isinstance(right, Fraction):
            return _PiMultiple(_bounded(left.factor * right))
        if isinstance(right, _PiMultiple) and isinstance(left, Fraction):
            return _PiMultiple(_bounded(left * right.factor))
    elif operator == "/" and isinstance(left, _PiMultiple):
        if isinstance(right, _PiMultiple):
            return left.factor / right.factor
        if isinstance(right, Fraction):
            return _PiMultiple(_bounded(left.factor / right))
    raise ConfigurationError("the argument of cos must be a rational multiple of pi, such as 2*pi/7")

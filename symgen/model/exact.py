"""Arithmetic of numbers in expressions: exact while that is cheap, then double precision, refused beyond."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

from symgen.runtime.graph.functions import IN_MODELS

from ..errors import ModelError
from . import algebra

MOST_DIGITS = 100
LARGEST_DECIMAL_EXPONENT = 400
MOST_EXACT_BITS = 1024
LARGEST_EXPONENT = 1000  # of a power whose base is not a number

Number = algebra.Rational | algebra.Float

MATH: dict[str, Callable[..., float]] = {
    **{name: function.value for name, function in IN_MODELS.items()},
    "dot": lambda x: 0.0,
}


def decimal_fraction(text: str) -> Fraction:
    """The exact value of a decimal literal, refused where a double could not hold it."""
    digits, _, exponent = text.lower().partition("e")
    whole, _, part = digits.partition(".")
    if len(whole) + len(part) > MOST_DIGITS:
        raise ModelError(
            f"the number {text[:20]}… has more than {MOST_DIGITS} digits", hint="write fewer digits"
        )
    if len(exponent) > 6 or abs(int(exponent or 0)) > LARGEST_DECIMAL_EXPONENT:
        raise ModelError(
            f"the number {text} is outside the range of double precision",
            hint="look at the exponent and the unit",
        )
    shift = int(exponent or 0) - len(part)
    value = Fraction(int(whole + part)) if shift == 0 else int(whole + part) * Fraction(10) ** shift
    to_double(value, text)
    return value


def to_double(value: Fraction | int, shown: str = "") -> float:
    """The nearest double; a number that would overflow, or vanish, is refused."""
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if math.isinf(result) or (result == 0.0 and value != 0):
        raise ModelError(
            f"the number {shown} is outside the range of double precision".replace("  ", " "),
            hint="look at the exponent and the unit",
        )
    return result


def number(value: Fraction | int | float) -> Number:
    """A number of an expression: exact if its size allows, a double otherwise.

    Raises
    ------
    ModelError
        If the value is not a finite double.
    """
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ModelError("the value of a constant part is not finite", hint="look at the numbers in it")
        return algebra.Float(value)
    bits = value.numerator.bit_length() + value.denominator.bit_length()
    if bits > MOST_EXACT_BITS:
        return algebra.Float(to_double(value))
    return algebra.Rational(value.numerator, value.denominator)


def python_number(value: Number) -> Fraction | float:
    """A number of an expression as an exact fraction, or as a double."""
    if isinstance(value, algebra.Rational):
        return Fraction(int(value.p), int(value.q))
    return float(value)


def add(a: Number, b: Number) -> Number:
    """a + b."""
    if a == 0 or b == 0:
        return b if a == 0 else a
    return number(_mixed(a, b, lambda x, y: x + y))


def multiply(a: Number, b: Number) -> Number:
    """a b."""
    if a is algebra.ONE or b is algebra.ONE:
        return b if a is algebra.ONE else a
    return number(_mixed(a, b, lambda x, y: x * y))


def _mixed(a: Number, b: Number, operation: Callable) -> Fraction | float:
    x, y = python_number(a), python_number(b)
    if isinstance(x, float) or isinstance(y, float):
        x, y = float(x), float(y)
    return operation(x, y)


def power(base: Number, exponent: Number) -> Number:
    """base ** exponent, never larger than a double and never computed before its size is known."""
    b, e = python_number(base), python_number(exponent)
    if b == 0 and e < 0:
        raise ModelError("division by zero", hint="look at what is divided by")
    if isinstance(b, Fraction) and isinstance(e, Fraction) and e.denominator == 1:
        bits = max(b.numerator.bit_length(), b.denominator.bit_length())
        if bits * abs(e) <= MOST_EXACT_BITS:
            return number(b ** int(e))
    try:
        return number(math.pow(b, e))
    except OverflowError:
        raise ModelError(
            "the value of a power of numbers is outside the range of double precision",
            hint="look at the exponent and the unit",
        ) from None
    except ValueError:
        raise ModelError(
            "a negative number to a fractional power has no real value", hint="look at the sign"
        ) from None


def call(name: str, arguments: list[Number]) -> Number:
    """A function of numbers, in double precision."""
    if name == "abs":
        return number(abs(python_number(arguments[0])))
    try:
        return number(MATH[name](*(float(a) for a in arguments)))
    except OverflowError:
        raise ModelError(
            f"the value of '{name}' is outside the range of double precision",
            hint="look at the exponent and the unit",
        ) from None
    except ValueError:
        raise ModelError(f"'{name}' has no real value here", hint="look at its argument") from None

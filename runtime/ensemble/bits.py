"""Logarithms, powers and roots that are read from the bits of numbers: to some percent, or a few steps better."""

from __future__ import annotations

from symgen.runtime.ensemble.writer import Value

_OFFSET = 1022.957  # of a logarithm read from bits: its error is within 0.05
_FARTHEST = 1000.0  # powers of two
_HALLEY = 3  # steps, each of which triples the digits


def log2(a: Value) -> Value:
    """The logarithm of positive numbers, to within 0.05."""
    return a.code.bits_as_number(a) * 2.0**-52 - _OFFSET


def exp2(a: Value) -> Value:
    """The inverse of `log2`."""
    code = a.code
    low = code.select(a > -_FARTHEST, a, code.all_lanes(-_FARTHEST))
    return code.number_of_bits(
        (code.select(low < _FARTHEST, low, code.all_lanes(_FARTHEST)) + _OFFSET) * 2.0**52
    )


def power(a: Value, exponent: Value | float) -> Value:
    """A power of positive numbers, to some percent for exponents within ±1."""
    return exp2(log2(a) * exponent)


def cube_root(a: Value) -> Value:
    """The cube root of numbers that are not negative, by Halley's method."""
    code = a.code
    usual = (a > 1e-300) & code.finite(a)
    x = power(code.select(usual, a, code.all_lanes(1.0)), 1.0 / 3.0)
    for _ in range(_HALLEY):
        cube = x * x * x
        x = x * (cube + a * 2.0) / (cube * 2.0 + a)
    return code.select(usual, x, a)

"""Sums, products and quotients as SymPy objects in SymPy's own order, but not evaluated."""

from __future__ import annotations

import functools
from collections.abc import Iterable

import sympy

ARGUMENT_ORDER = functools.cmp_to_key(sympy.Basic.compare)


def split_product(value: sympy.Expr) -> tuple[sympy.Expr, list[sympy.Expr]]:
    """The number in a product, and its other factors."""
    if value.is_Number:
        return value, []
    if isinstance(value, sympy.Mul):
        if value.args[0].is_Number:
            return value.args[0], list(value.args[1:])
        return sympy.S.One, list(value.args)
    return sympy.S.One, [value]


def inverted(x: sympy.Expr) -> sympy.Expr:
    """1/x."""
    if isinstance(x, sympy.Pow) and x.exp.is_Number:
        exponent = -x.exp
        return x.base if exponent == 1 else sympy.Pow(x.base, exponent, evaluate=False)
    return sympy.Pow(x, sympy.S.NegativeOne, evaluate=False)


def negated(x: sympy.Expr) -> sympy.Expr:
    """-x."""
    number, rest = split_product(x)
    return build(sympy.Mul, -number, sympy.S.One, rest)


def build(cls: type, number: sympy.Expr, neutral: sympy.Expr, rest: list[sympy.Expr]) -> sympy.Expr:
    """A sum or product in SymPy's own order but not evaluated.

    SymPy combines powers of equal base, and 2^x*2^(10^9 - x) would then be computed.
    """
    args = sorted(rest, key=ARGUMENT_ORDER)
    if number != neutral or not args:
        args.insert(0, number)
    return args[0] if len(args) == 1 else cls(*args, evaluate=False)


def total(terms: Iterable[sympy.Expr]) -> sympy.Expr:
    """A sum."""
    rest = [x for x in terms if not (x.is_Number and x == 0)]
    return build(sympy.Add, sympy.S.Zero, sympy.S.Zero, rest)


def difference(a: sympy.Expr, b: sympy.Expr) -> sympy.Expr:
    """a - b."""
    return total([a, negated(b)])


def product(factors: Iterable[sympy.Expr]) -> sympy.Expr:
    """A product."""
    number, rest = sympy.S.One, []
    for x in factors:
        coefficient, others = split_product(x)
        number *= coefficient
        rest += others
    return sympy.S.Zero if number == 0 else build(sympy.Mul, number, sympy.S.One, rest)


def squared(x: sympy.Expr) -> sympy.Expr:
    """x^2."""
    return sympy.Pow(x, sympy.Integer(2), evaluate=False)

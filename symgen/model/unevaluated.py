"""Sums, products and quotients in the order that expressions have, but not evaluated."""

from __future__ import annotations

from collections.abc import Iterable

from . import algebra


def split_product(value: algebra.Expr) -> tuple[algebra.Expr, list[algebra.Expr]]:
    """The number in a product, and its other factors."""
    if value.is_Number:
        return value, []
    if isinstance(value, algebra.Mul):
        if value.args[0].is_Number:
            return value.args[0], list(value.args[1:])
        return algebra.ONE, list(value.args)
    return algebra.ONE, [value]


def inverted(x: algebra.Expr) -> algebra.Expr:
    """1/x."""
    if isinstance(x, algebra.Pow) and x.exp.is_Number:
        exponent = -x.exp
        return x.base if exponent == 1 else algebra.Pow(x.base, exponent, evaluate=False)
    return algebra.Pow(x, algebra.NEGATIVE_ONE, evaluate=False)


def negated(x: algebra.Expr) -> algebra.Expr:
    """-x."""
    number, rest = split_product(x)
    return build(algebra.Mul, -number, algebra.ONE, rest)


def build(cls: type, number: algebra.Expr, neutral: algebra.Expr, rest: list[algebra.Expr]) -> algebra.Expr:
    """A sum or product in the usual order but not evaluated.

    Powers of equal base would be combined, and 2^x*2^(10^9 - x) would then be computed.
    """
    args = sorted(rest, key=algebra.sort_key)
    if number != neutral or not args:
        args.insert(0, number)
    return args[0] if len(args) == 1 else cls(*args, evaluate=False)


def total(terms: Iterable[algebra.Expr]) -> algebra.Expr:
    """A sum."""
    rest = [x for x in terms if not (x.is_Number and x == 0)]
    return build(algebra.Add, algebra.ZERO, algebra.ZERO, rest)


def difference(a: algebra.Expr, b: algebra.Expr) -> algebra.Expr:
    """a - b."""
    return total([a, negated(b)])


def product(factors: Iterable[algebra.Expr]) -> algebra.Expr:
    """A product."""
    number, rest = algebra.ONE, []
    for x in factors:
        coefficient, others = split_product(x)
        number *= coefficient
        rest += others
    return algebra.ZERO if number == 0 else build(algebra.Mul, number, algebra.ONE, rest)


def squared(x: algebra.Expr) -> algebra.Expr:
    """x^2."""
    return algebra.Pow(x, algebra.Integer(2), evaluate=False)

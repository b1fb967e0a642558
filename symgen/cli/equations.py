"""A generated module's functions as SymPy expressions of the model's names: the equations that are solved."""

from __future__ import annotations

import operator
from fractions import Fraction
from typing import TYPE_CHECKING

import sympy

from symgen.runtime.graph.carry_out import carry_out
from symgen.runtime.graph.functions import IN_CODE

if TYPE_CHECKING:
    from collections.abc import Callable

    from symgen.runtime.system import System

_FUNCTIONS: dict[str, Callable[..., sympy.Expr]] = {
    **{name: getattr(sympy, entry.sympy) for name, entry in IN_CODE.items() if entry.sympy},
    "sqrt": sympy.sqrt,
    "pow": sympy.Pow,
    "copysign": lambda size, sign: sympy.Abs(size) * sympy.sign(sign),
}
_LARGEST_DENOMINATOR = 1000


def symbolic(system: System, function: str) -> dict[int, sympy.Expr]:
    """Return what `function` writes, by index; structural zeros are missing.

    The form is carried out with symbols for numbers: rates are symbols named `dot(x)`,
    or by names of their own.
    """
    coordinates = [record["name"] for record in system.coordinates]
    rates = [record["name"] for record in system.rates]
    # The angular velocity of a joint is no coordinate's derivative, and has a name of its own.
    own = set(rates) - set(coordinates)
    names = coordinates + [rate if rate in own else f"dot({rate})" for rate in rates]
    p = [*(record["name"] for record in (*system.parameters, *system.inputs)), *system.settings]
    symbols_y, symbols_p = list(map(sympy.Symbol, names)), list(map(sympy.Symbol, p))
    written = carry_out(
        system.form(function), _Symbols(), symbols_y.__getitem__, symbols_p.__getitem__, const=_number
    )
    return {index: value for index, value in written if value != 0}


class _Symbols:
    """The operations of a form, on expressions."""

    neg = staticmethod(operator.neg)
    add = staticmethod(operator.add)
    sub = staticmethod(operator.sub)
    mul = staticmethod(operator.mul)
    div = staticmethod(operator.truediv)

    @staticmethod
    def time() -> sympy.Expr:
        return sympy.Symbol("t")

    @staticmethod
    def call(name: str, *args: sympy.Expr) -> sympy.Expr:
        return _FUNCTIONS[name](*args)

    @staticmethod
    def select(
        is_strict: bool, a: sympy.Expr, b: sympy.Expr, then: sympy.Expr, otherwise: sympy.Expr
    ) -> sympy.Expr:
        return sympy.Piecewise((then, a < b if is_strict else a <= b), (otherwise, True))


def _number(value: float) -> sympy.Number:
    exact = Fraction(value)
    # 0.5 is meant as one half; 0.1 is printed as it stands.
    if exact.denominator <= _LARGEST_DENOMINATOR:
        return sympy.Rational(exact.numerator, exact.denominator)
    return sympy.Float(value)

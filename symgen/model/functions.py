"""Opaque SymPy functions of model expressions: SymPy must neither evaluate nor differentiate them.

Conditions are such functions too: SymPy's own relations compare and combine what they are made of.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

import sympy

from symgen.runtime.graph.functions import CONDITIONS, IN_MODELS


class dot(sympy.Function):
    """Total time derivative of an expression of coordinates, definitions and `t`.

    Left unevaluated: the derivation differentiates on the operation graph, where shared parts stay shared.
    """

    nargs = 1


class minimum(sympy.Function):
    """Smaller of two values; unlike `sympy.Min` it does not try to compare its arguments."""

    nargs = 2


class maximum(sympy.Function):
    """Larger of two values; unlike `sympy.Max` it does not try to compare its arguments."""

    nargs = 2


class floor(sympy.Function):
    """Largest whole number that is not above a value; unlike `sympy.floor` it stays as it is written."""

    nargs = 1


class heaviside(sympy.Function):
    """0 below zero, 1 above, 1/2 at zero."""

    nargs = 1


class less(sympy.Function):
    """The condition that the first value is below the second."""

    nargs = 2


class at_most(sympy.Function):
    """The condition that the first value is not above the second."""

    nargs = 2


class both(sympy.Function):
    """The condition that two conditions hold."""

    nargs = 2


class either(sympy.Function):
    """The condition that one of two conditions holds, or both."""

    nargs = 2


class opposite(sympy.Function):
    """The condition that a condition does not hold."""

    nargs = 1


class where(sympy.Function):
    """The second argument where the first, a condition, holds; else the third."""

    nargs = 3


class branch(sympy.Function):
    """The second argument where the first is below zero, else the third."""

    nargs = 3


class smooth_minimum(minimum):
    """Smaller of two values where it stands in a sum or product that has no kink."""


class Tabulated(sympy.Function):
    """A table of a model, of one or two arguments; `tabulated` makes a class for each.

    `role` says what of it: VALUE, INTEGRAL; PIECE or PIECE + INTEGRAL with numbers of the held piece behind the
    arguments; PLACE, which is whole at the knots of argument `axis`; SLOPE and the numbers of the arguments that the
    value is differentiated by.
    """

    table = ""
    role = ""
    axis = 0


VALUE, INTEGRAL, PIECE, PLACE, SLOPE = "value", "integral", "piece ", "place", "slope "


@functools.cache
def tabulated(table: str, role: str, n_arguments: int, axis: int = 0) -> type[Tabulated]:
    """The class of a table's function; it has the table's name, or that with `_integral`."""
    names = {VALUE: table, INTEGRAL: f"{table}_integral"}
    own = {"table": table, "role": role, "axis": axis, "nargs": n_arguments, "__module__": __name__}
    return type(Tabulated)(names.get(role, f"{table} {role}{axis}"), (Tabulated,), own)


t = sympy.Symbol("t")  # the time

_OWN = {"min": minimum, "max": maximum, "floor": floor, "heaviside": heaviside, "where": where}
CONDITION_CLASSES: dict[str, type] = {
    "<": less, "<=": at_most, "and": both, "or": either, "not": opposite,
}  # fmt: skip
# What stands for each function of model files in SymPy; a square root is a power there.
CLASSES: dict[str, type] = {
    name: _OWN.get(name) or getattr(sympy, function.sympy)
    for name, function in IN_MODELS.items()
    if name in _OWN or function.sympy
}
OF_CLASS = (
    {kind: IN_MODELS[name] for name, kind in CLASSES.items()}
    | {kind: CONDITIONS[name] for name, kind in CONDITION_CLASSES.items()}
    | {smooth_minimum: IN_MODELS["min"]}
)


def mod(x: sympy.Expr, divisor: sympy.Expr) -> sympy.Expr:
    """What is left of `x` when as many whole divisors as fit are taken away, with the divisor's sign, as in Python."""
    quotient = floor(sympy.Mul(x, sympy.Pow(divisor, -1, evaluate=False), evaluate=False), evaluate=False)
    taken = sympy.Mul(sympy.S.NegativeOne, divisor, quotient, evaluate=False)
    return sympy.Add(x, taken, evaluate=False)


def smoothstep(low: sympy.Expr, high: sympy.Expr, x: sympy.Expr) -> sympy.Expr:
    """0 below `low`, 1 above `high`, and s^2 (3 - 2 s) between, where s goes evenly from 0 to 1."""
    width = sympy.Add(high, sympy.Mul(-1, low, evaluate=False), evaluate=False)
    above = sympy.Add(x, sympy.Mul(-1, low, evaluate=False), evaluate=False)
    share = sympy.Mul(above, sympy.Pow(width, -1, evaluate=False), evaluate=False)
    s = maximum(minimum(share, sympy.S.One, evaluate=False), sympy.S.Zero, evaluate=False)
    back = sympy.Mul(
        sympy.S.NegativeOne, s, evaluate=False
    )  # twice: a factor of 2 may be meant to carry a unit
    slope = sympy.Add(sympy.Integer(3), back, back, evaluate=False)
    return sympy.Mul(sympy.Pow(s, 2, evaluate=False), slope, evaluate=False)


ABBREVIATIONS = {"mod": mod, "smoothstep": smoothstep}  # functions that are written with others


def sensor(kind: str, *names: str) -> sympy.Symbol:
    """What is measured of a mechanism: `sensor("velocity", "tip", "x")` is `velocity("tip", "x")` of model files.

    Parameters
    ----------
    kind : str
        position, velocity, acceleration, angular_velocity, angular_acceleration, distance, angle, reaction or power.
    *names : str
        Of what is measured; then of axis and frame.
    """
    quoted = ", ".join('"' + name + '"' for name in names)
    return sympy.Symbol(f"{kind}({quoted})")


def is_condition(x: Any) -> bool:
    """Whether something is a condition, not a value."""
    return isinstance(x, tuple(CONDITION_CLASSES.values()))


def nested(function: Callable, arguments: Sequence[sympy.Basic]) -> sympy.Basic:
    """A function of two arguments over many, as a tree as shallow as can be."""
    arguments = list(arguments)
    while len(arguments) > 1:
        pairs = [arguments[k : k + 2] for k in range(0, len(arguments), 2)]
        arguments = [function(*pair, evaluate=False) if len(pair) == 2 else pair[0] for pair in pairs]
    return arguments[0]

"""Functions of model expressions that stay as they are written: rates, choices, conditions, tables."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

from symgen.runtime.graph.functions import CONDITIONS, IN_MODELS

from . import algebra


class dot(algebra.Function):
    """Total time derivative of an expression of coordinates, definitions and `t`.

    Left unevaluated: the derivation differentiates on the operation graph, where shared parts stay shared.
    """


class minimum(algebra.Function):
    """Smaller of two values."""


class maximum(algebra.Function):
    """Larger of two values."""


class floor(algebra.Function):
    """Largest whole number that is not above a value; unlike `algebra.floor` it stays as it is written."""


class heaviside(algebra.Function):
    """0 below zero, 1 above, 1/2 at zero."""


class less(algebra.Function):
    """The condition that the first value is below the second."""


class at_most(algebra.Function):
    """The condition that the first value is not above the second."""


class both(algebra.Function):
    """The condition that two conditions hold."""


class either(algebra.Function):
    """The condition that one of two conditions holds, or both."""


class opposite(algebra.Function):
    """The condition that a condition does not hold."""


class where(algebra.Function):
    """The second argument where the first, a condition, holds; else the third."""


class branch(algebra.Function):
    """The second argument where the first is below zero, else the third."""


class smooth_minimum(minimum):
    """Smaller of two values where it stands in a sum or product that has no kink."""


class settled(floor):
    """Largest whole number that is not above a value, where nothing happens as it changes: it cuts off digits."""


class Tabulated(algebra.Function):
    """A table of a model, of one or two arguments; `tabulated` makes a class for each.

    `role` says what of it: VALUE, INTEGRAL; PIECE or PIECE + INTEGRAL with numbers of the held piece behind the
    arguments; PLACE, which is whole at the knots of argument `axis`; SLOPE and the numbers of the arguments that the
    value is differentiated by.
    """

    table = ""
    role = ""
    axis = 0

    def __reduce__(self) -> tuple[Any, ...]:
        return _tabulated, (self.table, self.role, self.axis, self.args)


def _tabulated(table: str, role: str, axis: int, args: tuple[algebra.Expr, ...]) -> Tabulated:
    """A copy of a table's function, or what was pickled."""
    return tabulated(table, role, len(args), axis)(*args, evaluate=False)


VALUE, INTEGRAL, PIECE, PLACE, SLOPE = "value", "integral", "piece ", "place", "slope "


def tabulated(table: str, role: str, n_arguments: int, axis: int = 0) -> type[Tabulated]:
    """The class of a table's function; it has the table's name, or that with `_integral`."""
    return _class_of(table, role, n_arguments, axis)


@functools.cache
def _class_of(table: str, role: str, n_arguments: int, axis: int) -> type[Tabulated]:
    names = {VALUE: table, INTEGRAL: f"{table}_integral"}
    own = {"table": table, "role": role, "axis": axis, "__module__": __name__}
    return type(Tabulated)(names.get(role, f"{table} {role}{axis}"), (Tabulated,), own)


t = algebra.Symbol("t")  # the time

_OWN = {"min": minimum, "max": maximum, "floor": floor, "heaviside": heaviside, "where": where}
CONDITION_CLASSES: dict[str, type] = {
    "<": less, "<=": at_most, "and": both, "or": either, "not": opposite,
}  # fmt: skip
# What stands for each function of model files in expressions; a square root is a power there.
CLASSES: dict[str, type] = {
    name: _OWN.get(name) or getattr(algebra, function.sympy)
    for name, function in IN_MODELS.items()
    if name in _OWN or function.sympy
}
OF_CLASS = (
    {kind: IN_MODELS[name] for name, kind in CLASSES.items()}
    | {kind: CONDITIONS[name] for name, kind in CONDITION_CLASSES.items()}
    | {smooth_minimum: IN_MODELS["min"], settled: IN_MODELS["floor"]}
)


def mod(x: algebra.Expr, divisor: algebra.Expr) -> algebra.Expr:
    """What is left of `x` when as many whole divisors as fit are taken away, with the divisor's sign, as in Python."""
    quotient = floor(algebra.Mul(x, algebra.Pow(divisor, -1, evaluate=False), evaluate=False), evaluate=False)
    taken = algebra.Mul(algebra.NEGATIVE_ONE, divisor, quotient, evaluate=False)
    return algebra.Add(x, taken, evaluate=False)


def smoothstep(low: algebra.Expr, high: algebra.Expr, x: algebra.Expr) -> algebra.Expr:
    """0 below `low`, 1 above `high`, and s^2 (3 - 2 s) between, where s goes evenly from 0 to 1."""
    width = algebra.Add(high, algebra.Mul(-1, low, evaluate=False), evaluate=False)
    above = algebra.Add(x, algebra.Mul(-1, low, evaluate=False), evaluate=False)
    share = algebra.Mul(above, algebra.Pow(width, -1, evaluate=False), evaluate=False)
    s = maximum(minimum(share, algebra.ONE, evaluate=False), algebra.ZERO, evaluate=False)
    back = algebra.Mul(
        algebra.NEGATIVE_ONE, s, evaluate=False
    )  # twice: a factor of 2 may be meant to carry a unit
    slope = algebra.Add(algebra.Integer(3), back, back, evaluate=False)
    return algebra.Mul(algebra.Pow(s, 2, evaluate=False), slope, evaluate=False)


ABBREVIATIONS = {"mod": mod, "smoothstep": smoothstep}  # functions that are written with others


def sensor(kind: str, *names: str) -> algebra.Symbol:
    """What is measured of a mechanism: `sensor("velocity", "tip", "x")` is `velocity("tip", "x")` of model files.

    Parameters
    ----------
    kind : str
        position, velocity, acceleration, angular_velocity, angular_acceleration, distance, angle, reaction or power.
    *names : str
        Of what is measured; then of axis and frame.
    """
    quoted = ", ".join('"' + name + '"' for name in names)
    return algebra.Symbol(f"{kind}({quoted})")


def is_condition(x: Any) -> bool:
    """Whether something is a condition, not a value."""
    return isinstance(x, tuple(CONDITION_CLASSES.values()))


def nested(function: Callable, arguments: Sequence[algebra.Expr]) -> algebra.Expr:
    """A function of two arguments over many, as a tree as shallow as can be."""
    arguments = list(arguments)
    while len(arguments) > 1:
        pairs = [arguments[k : k + 2] for k in range(0, len(arguments), 2)]
        arguments = [function(*pair, evaluate=False) if len(pair) == 2 else pair[0] for pair in pairs]
    return arguments[0]

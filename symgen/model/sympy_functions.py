"""The functions of models for who writes with SymPy, which must neither evaluate nor differentiate them.

Conditions are such functions too: SymPy's own relations compare and combine what they are made of.
"""

from __future__ import annotations

import functools

import sympy

from . import functions


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


def _opaque(kind: type, n_arguments: int) -> type[sympy.Function]:
    """SymPy's face of a function that only models have."""
    own = {"nargs": n_arguments, "__module__": __name__, "__doc__": kind.__doc__}
    return type(sympy.Function)(kind.__name__, (sympy.Function,), own)


less, at_most, both, either = (
    _opaque(kind, 2) for kind in (functions.less, functions.at_most, functions.both, functions.either)
)
opposite = _opaque(functions.opposite, 1)
where, branch = _opaque(functions.where, 3), _opaque(functions.branch, 3)
smooth_minimum = _opaque(functions.smooth_minimum, 2)
settled = _opaque(functions.settled, 1)

t = sympy.Symbol("t")  # the time


class Tabulated(sympy.Function):
    """A table of a model; `tabulated` makes a class for each of `functions.tabulated`."""

    kind: type[functions.Tabulated]


@functools.cache
def tabulated(kind: type[functions.Tabulated], n_arguments: int) -> type[Tabulated]:
    """SymPy's face of a table's function."""
    own = {"kind": kind, "nargs": n_arguments, "__module__": __name__}
    return type(Tabulated)(kind.__name__, (Tabulated,), own)


def sensor(kind: str, *names: str) -> sympy.Symbol:
    """What is measured of a mechanism: `sensor("velocity", "tip", "x")` is `velocity("tip", "x")` of model files.

    Parameters
    ----------
    kind : str
        position, velocity, acceleration, angular_velocity, angular_acceleration, distance, angle, reaction or power.
    *names : str
        Of what is measured; then of axis and frame.
    """
    return sympy.Symbol(functions.sensor(kind, *names).name)

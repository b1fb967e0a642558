"""Opaque SymPy functions of model expressions: SymPy must neither evaluate nor differentiate them."""

from __future__ import annotations

import sympy

from symgen.runtime.graph.functions import IN_MODELS


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


class branch(sympy.Function):
    """The second argument where the first is below zero, else the third."""

    nargs = 3


class smooth_minimum(minimum):
    """Smaller of two values where it stands in a sum or product that has no kink."""


t = sympy.Symbol("t")  # the time

_OWN = {"min": minimum, "max": maximum}
# What stands for each function of model files in SymPy; a square root is a power there.
CLASSES: dict[str, type] = {
    name: _OWN.get(name) or getattr(sympy, function.sympy)
    for name, function in IN_MODELS.items()
    if name in _OWN or function.sympy
}
OF_CLASS = {kind: IN_MODELS[name] for name, kind in CLASSES.items()} | {smooth_minimum: IN_MODELS["min"]}

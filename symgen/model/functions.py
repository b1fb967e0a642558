"""Opaque SymPy functions of model expressions: SymPy must neither evaluate nor differentiate them."""

from __future__ import annotations

import sympy


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


t = sympy.Symbol("t")  # the time

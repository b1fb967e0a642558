"""Numeric values of expressions, as far as they are known before a run."""

from __future__ import annotations

import math
from collections.abc import Mapping

import sympy

from . import exact
from .tree import kind, postorder

OPERATIONS = exact.MATH | {"cot": lambda x: 1.0 / math.tan(x), "real": lambda x: x}


class NotFinite(Exception):
    """A part of an expression has no finite real value; `node` is that part."""

    def __init__(self, node: sympy.Basic) -> None:
        super().__init__(node)
        self.node = node


def evaluate(root: sympy.Expr, values: Mapping[str, float | None]) -> float | None:
    """The value of an expression where names have `values`; None where it depends on an unknown one.

    Raises
    ------
    NotFinite
        If a part whose operands are known is infinite or not real.
    """
    if isinstance(root, sympy.Symbol):
        return values.get(root.name)
    memo: dict[int, float | None] = {}
    for node in postorder([root]):
        what = kind(node)
        operands = [memo[id(x)] for x in node.args]
        if what == "symbol":
            memo[id(node)] = values.get(node.name)
        elif None in operands or what == "dot":
            memo[id(node)] = None
        else:
            memo[id(node)] = _finite(node, what, operands)
    return memo[id(root)]


def _finite(node: sympy.Basic, what: str | None, operands: list[float]) -> float:
    try:
        value = _apply(node, what, operands)
    except (OverflowError, ValueError, ZeroDivisionError):
        raise NotFinite(node) from None
    if isinstance(value, complex) or not math.isfinite(value):
        raise NotFinite(node)
    return value


def _apply(node: sympy.Basic, what: str | None, operands: list[float]) -> float:
    if what in ("number", "constant"):
        return float(node)
    if what == "sum":
        return sum(operands)
    if what == "product":
        return math.prod(operands)
    if what == "power":
        return math.pow(*operands)
    if what is None:
        raise ValueError(node)
    return OPERATIONS[what](*operands)

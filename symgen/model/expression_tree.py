"""Walks over SymPy expressions: by object identity, as much is shared, and in loops, as they can be deep."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import sympy

from .functions import CLASSES, CONDITION_CLASSES, Tabulated, dot, smooth_minimum

# SymPy makes the last three of others: tan(x + pi/2), |exp(x)|.
FUNCTIONS: dict[type, str] = {kind: name for name, kind in (CLASSES | CONDITION_CLASSES).items()} | {
    dot: "dot",
    smooth_minimum: "min",
    sympy.cot: "cot",
    sympy.re: "real",
    sympy.conjugate: "real",
}


TABLE = "table"


def postorder(roots: Iterable[sympy.Basic], seen: set[int] | None = None) -> list[sympy.Basic]:
    """Every object below the roots once, arguments before what they are arguments of.

    Parameters
    ----------
    roots : iterable of sympy.Basic
    seen : set of int, optional
        Identities that are left out; grows by those returned.
    """
    seen = set() if seen is None else seen
    order: list[sympy.Basic] = []
    stack: list[tuple[sympy.Basic, bool]] = [(root, False) for root in reversed(list(roots))]
    while stack:
        node, done = stack.pop()
        if done:
            order.append(node)
        elif id(node) not in seen:
            seen.add(id(node))
            arguments = node.args
            if arguments:
                stack.append((node, True))
                stack += [(x, False) for x in reversed(arguments) if id(x) not in seen]
            else:
                order.append(node)
    return order


def kind(node: sympy.Basic) -> str | None:
    """What a node is: symbol, number, constant (pi), sum, product, power, a function; None if unknown."""
    if isinstance(node, sympy.Symbol):
        return "symbol"
    if isinstance(node, sympy.Number):
        return "number" if node.is_finite else None
    if isinstance(node, sympy.NumberSymbol):
        return "constant"
    if isinstance(node, sympy.Add):
        return "sum"
    if isinstance(node, sympy.Mul):
        return "product"
    if isinstance(node, sympy.Pow):
        return "power"
    return TABLE if isinstance(node, Tabulated) else FUNCTIONS.get(node.func)


@dataclass(frozen=True)
class Uses:
    """What an expression mentions by itself, without looking into definitions.

    `dotted` are the names inside a `dot(…)`; `nested` tells of a `dot` inside another;
    `foreign` is the first node that no model can have; `tables` are by name and number of arguments.
    """

    names: frozenset[str]
    dotted: frozenset[str]
    has_dot: bool
    nested: bool
    foreign: sympy.Basic | None
    tables: frozenset[tuple[str, int]] = frozenset()


def uses(root: sympy.Basic) -> Uses:
    """What an expression mentions."""
    order = postorder([root])
    dots = [node for node in order if isinstance(node, dot)]
    inside = postorder([x for node in dots for x in node.args]) if dots else []
    return Uses(
        names=_names(order),
        dotted=_names(inside),
        has_dot=bool(dots),
        nested=any(isinstance(node, dot) for node in inside),
        foreign=next((node for node in order if kind(node) is None), None),
        tables=frozenset((x.func.table, len(x.args)) for x in order if isinstance(x, Tabulated)),
    )


def names_in(root: sympy.Basic) -> frozenset[str]:
    """The names in an expression."""
    return _names(postorder([root]))


def _names(nodes: list[sympy.Basic]) -> frozenset[str]:
    return frozenset(node.name for node in nodes if isinstance(node, sympy.Symbol))

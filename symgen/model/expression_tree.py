"""What an expression is made of, and what it mentions."""

from __future__ import annotations

from dataclasses import dataclass

from . import algebra
from .algebra import postorder
from .functions import CLASSES, CONDITION_CLASSES, Tabulated, dot, settled, smooth_minimum

# SymPy, with which users write, makes the last three of others: tan(x + pi/2), |exp(x)|.
FUNCTIONS: dict[type, str] = {kind: name for name, kind in (CLASSES | CONDITION_CLASSES).items()} | {
    dot: "dot",
    smooth_minimum: "min",
    settled: "floor",
    algebra.cot: "cot",
    algebra.re: "real",
    algebra.conjugate: "real",
}


TABLE = "table"


def kind(node: algebra.Expr) -> str | None:
    """What a node is: symbol, number, constant (pi), sum, product, power, a function; None if unknown."""
    if isinstance(node, algebra.Symbol):
        return "symbol"
    if isinstance(node, algebra.Number):
        return "number" if node.is_finite else None
    if isinstance(node, algebra.NumberSymbol):
        return "constant"
    if isinstance(node, algebra.Add):
        return "sum"
    if isinstance(node, algebra.Mul):
        return "product"
    if isinstance(node, algebra.Pow):
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
    foreign: algebra.Expr | None
    tables: frozenset[tuple[str, int]] = frozenset()


def uses(root: algebra.Expr) -> Uses:
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


def names_in(root: algebra.Expr) -> frozenset[str]:
    """The names in an expression."""
    return _names(postorder([root]))


def _names(nodes: list[algebra.Expr]) -> frozenset[str]:
    return frozenset(node.name for node in nodes if isinstance(node, algebra.Symbol))

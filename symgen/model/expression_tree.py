"""What an expression is made of, and what it mentions."""

from __future__ import annotations

from dataclasses import dataclass

from . import algebra
from .forms import WIDE, form_of
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
    formed = form_of(root)
    if formed is None:
        return _looked_up(root)
    form, names = formed
    if form.uses is None:
        found = _looked_up(root)
        if found.foreign is not None:  # is that of each
            return found
        form.uses = found, tuple(k for k, name in enumerate(names) if name in found.dotted)
    found, dotted = form.uses
    inside = frozenset([names[k] for k in dotted]) if dotted else found.dotted
    return Uses(frozenset(names), inside, found.has_dot, found.nested, None)


def _looked_up(root: algebra.Expr) -> Uses:
    """The same from its parts; wide ones keep it, as each of a hundred flat sums may be made of others like it."""
    waiting = [root]
    while True:
        node = waiting[-1]
        found = _kept(node)
        if found is None:
            near = _near(node)
            unknown = [x for x in near if _is_wide(x) and x is not node and _kept(x) is None]
            if unknown:
                waiting += unknown
                continue
            found = _joined(node, near)
            if _is_wide(node):
                node.__dict__["_uses"] = found
        waiting.pop()
        if not waiting:
            return found


def _is_wide(node: algebra.Expr) -> bool:
    return len(node.args) >= WIDE


def _kept(node: algebra.Expr) -> Uses | None:
    return node.__dict__.get("_uses")


def _near(root: algebra.Expr) -> list[algebra.Expr]:
    """What an expression is made of, arguments first, not looking into wide ones below it."""
    order: list[algebra.Expr] = []
    seen: set[int] = set()
    stack: list[algebra.Expr | None] = [root]
    while stack:
        node = stack.pop()
        if node is None:
            order.append(stack.pop())
        elif id(node) not in seen:
            seen.add(id(node))
            if node.args and (node is root or len(node.args) < WIDE):
                stack += (node, None, *node.args[::-1])
            else:
                order.append(node)
    return order


def _joined(root: algebra.Expr, near: list[algebra.Expr]) -> Uses:
    """The uses of an expression, from those that wide ones below it keep."""
    wide = [_kept(x) for x in near if x is not root and _is_wide(x)]
    dots = [x for x in near if isinstance(x, dot)]
    inside = [y for x in dots for a in x.args for y in ([a] if _is_wide(a) else _near(a))]
    inside_wide = [_kept(x) for x in inside if _is_wide(x)]
    foreign = (
        _kept(x).foreign if x is not root and _is_wide(x) else x if kind(x) is None else None for x in near
    )
    own_tables = ((x.func.table, len(x.args)) for x in near if isinstance(x, Tabulated))
    return Uses(
        names=_names(near).union(*(x.names for x in wide)),
        dotted=_names(inside).union(*(x.names for x in inside_wide), *(x.dotted for x in wide)),
        has_dot=bool(dots) or any(x.has_dot for x in wide),
        nested=any(isinstance(x, dot) for x in inside)
        or any(x.has_dot for x in inside_wide)
        or any(x.nested for x in wide),
        foreign=next((x for x in foreign if x is not None), None),
        tables=frozenset(own_tables).union(*(x.tables for x in wide)),
    )


def names_in(root: algebra.Expr) -> frozenset[str]:
    """The names in an expression."""
    formed = form_of(root)
    if formed is not None:
        return frozenset(formed[1])
    if not _is_wide(root):
        near = _near(root)
        if not any(map(_is_wide, near)):
            return _names(near)
    return uses(root).names


def _names(nodes: list[algebra.Expr]) -> frozenset[str]:
    return frozenset(node.name for node in nodes if isinstance(node, algebra.Symbol))

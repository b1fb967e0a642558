"""Derivatives on the operation graph: tangents (forward), adjoints (reverse), sparse Jacobians."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from symgen.runtime.graph.functions import IN_CODE, slopes

from .graph import Graph
from .nodes import SparseRows

# What is finite, with its derivative, wherever its argument is.
_HARMLESS = ("sin", "cos", "atan", "tanh", "erf", "fabs", "floor", "copysign")
_FAR = 1e300  # something divided by it is nothing
MAY_BREAK = frozenset(IN_CODE) - set(_HARMLESS) | {"div"}


def is_guarded(g: Graph, node: int) -> bool:
    """Whether what a choice leaves out may be infinite or undefined there, or may have such a derivative.

    A zero weight does not take that away: 0 times infinity is no number. So derivatives of what is left out are made
    as if it were chosen, and the choice is between the results. What the choice itself looks at is finite.
    """
    if g.op[node] != "select":
        return False
    known = g.guarded.get(node)
    if known is None:
        a, b, then, otherwise = g.args[node]
        decided = {x for x in g.reachable([a, b]) if g.op[x] in MAY_BREAK}
        known = any(g.op[x] in MAY_BREAK and x not in decided for x in g.reachable([then, otherwise]))
        g.guarded[node] = known
    return known


def is_not_clamped(g: Graph, node: int) -> int:
    """The condition that a node is not held at zero, as max(0, x) is below 0: choices that end in 1 and 0."""
    stack = [node]
    while stack:
        x = stack[-1]
        op, args = g.op[x], g.args[x]
        if op == "select":
            below = args[2:]
        else:
            below = (
                args
                if op in ("mul", "add", "sub", "neg", "fabs")
                else args[:1]
                if op in ("sqrt", "pow")
                else ()
            )
        missing = [part for part in below if part not in g.nonzero]
        if missing:
            stack += missing
            continue
        stack.pop()
        parts = [g.nonzero[part] for part in below]
        if op == "select":
            found = g.select(*args[:2], *parts)
        elif op == "mul":
            found = g.choose(parts[0], parts[1], g.zero)
        elif op in ("add", "sub"):
            found = g.choose(parts[0], g.one, parts[1])
        else:
            found = parts[0] if parts else g.zero if x == g.zero else g.one
        g.nonzero[x] = found
    return g.nonzero[node]


def slope_of_power(g: Graph, base: int, exponent: float) -> int:
    """The derivative of a power by its base.

    Where it is infinite at 0 and the base is held there, what moves the base is nothing, and so is this: the product
    of the two is 0, not 0 times infinity.
    """
    if exponent >= 1.0:
        return g.mul(g.const(exponent), g.power(base, exponent - 1.0))
    moves = is_not_clamped(g, base)
    below = g.choose(moves, g.power(base, 1.0 - exponent), g.one)
    if base in g.undivided:
        below = g.select(g.zero, below, below, g.const(_FAR))
    return g.div(g.choose(moves, g.const(exponent), g.zero), below)


@contextmanager
def finite_at_roots(g: Graph, outputs: list[int]) -> Iterator[None]:
    """Meanwhile the derivative of a root at 0 is 0, where no value of `outputs` is divided by it.

    That of r = sqrt(u² + v²) has no limit at 0, that of r·u has: 0, as of drag at rest. Newton's method needs the
    latter; of the former any value between -1 and 1 serves it.
    """
    nodes = g.reachable(outputs)
    roots = {node: power[0] for node in nodes if (power := g.root_power(node)) is not None and power[1] < 1.0}
    stack, divided = [g.args[node][1] for node in nodes if g.op[node] == "div"], set()
    while stack:
        node = stack.pop()
        power = g.root_power(node)
        if power is not None:
            divided.add(power[0])
        elif g.op[node] in ("mul", "neg"):
            stack += g.args[node]
    g.undivided = frozenset(roots.values()) - divided
    yield
    g.undivided = frozenset()


def slope_needs_care(g: Graph, base: int) -> bool:
    """Whether the derivative of a root is not simply infinite where its base is 0."""
    return base in g.undivided or is_not_clamped(g, base) != g.one


def depends_on(g: Graph, node: int) -> tuple[int, ...]:
    """The nodes by which `partials` differentiates: the operands, or the base of a power that is made of a root."""
    power = g.root_power(node)
    return g.operands(node) if power is None else (power[0],)


def partials(g: Graph, node: int) -> list[tuple[int, int]]:
    """Local partial derivatives of one operation: pairs (operand, derivative node).

    A square is one operand with derivative 2a, so that it is not differentiated twice. A power that is made of a root
    has its base for an operand.
    """
    op, args = g.op[node], g.args[node]
    power = g.root_power(node)
    if power is not None and (op != "sqrt" or slope_needs_care(g, args[0])):
        return [(power[0], slope_of_power(g, *power))]
    if op == "add":
        return [(args[0], g.one), (args[1], g.one)]
    if op == "sub":
        return [(args[0], g.one), (args[1], g.const(-1.0))]
    if op == "neg":
        return [(args[0], g.const(-1.0))]
    if op == "mul":
        a, b = args
        return [(a, g.mul(g.const(2.0), a))] if a == b else [(a, b), (b, a)]
    if op == "div":
        a, b = args
        inverse = g.div(g.one, b)
        return [(a, inverse), (b, g.neg(g.mul(node, inverse)))]
    if op == "pow" and (moves := is_not_clamped(g, args[0])) != g.one:
        (above, _), (by_exponent, _) = slopes(g, op, (g.choose(moves, args[0], g.one), args[1]), node)
        return [(args[0], g.choose(moves, above, g.zero)), (args[1], by_exponent)]
    if op == "select":
        a, b, then, otherwise = args
        return [(then, g.select(a, b, g.one, g.zero)), (otherwise, g.select(a, b, g.zero, g.one))]
    return [
        (operand, above if below is None else g.div(above, below))
        for operand, (above, below) in zip(args, slopes(g, op, args, node), strict=True)
    ]


def forward(g: Graph, outputs: list[int], seeds: dict[int, int]) -> list[int]:
    """Tangents of `outputs` when each variable in `seeds` moves with its tangent (one sweep)."""
    return Tangents(g, seeds).of(outputs)


class Tangents:
    """Tangents when each variable in `seeds` moves with its tangent; that of a node is worked out once.

    What is asked for part by part, as along a chain of bodies, then costs no more than all at once.
    """

    def __init__(self, g: Graph, seeds: dict[int, int]) -> None:
        self.g = g
        self._tangent = dict(seeds)
        self._met: set[int] = set()
        self._mask = 0
        for variable in seeds:
            self._mask |= g.mask[variable]

    def of(self, outputs: list[int]) -> list[int]:
        """The tangents of nodes."""
        g, tangent = self.g, self._tangent
        for node in g.moved(outputs, self._mask, self._met):
            if node not in tangent and g.op[node] != "var":
                tangent[node] = _tangent(g, node, tangent)
        return [tangent.get(node, g.zero) for node in outputs]


def _tangent(g: Graph, node: int, tangent: dict[int, int]) -> int:
    op, args = g.op[node], g.args[node]
    if op == "div":  # (da - node db) / b: one division, and the quotient is there already
        da, db = tangent.get(args[0], g.zero), tangent.get(args[1], g.zero)
        return g.div(g.sub(da, g.mul(node, db)), args[1])
    if op == "select":
        return g.select(args[0], args[1], tangent.get(args[2], g.zero), tangent.get(args[3], g.zero))
    total = g.zero
    for operand, partial in partials(g, node):
        moved = tangent.get(operand, g.zero)
        if moved != g.zero:
            total = g.add(total, g.mul(partial, moved))
    return total


def reverse(g: Graph, seeds: Iterable[tuple[int, int]], mask: int) -> dict[int, int]:
    """Adjoints of all variables of the kinds in `mask` for the weighted sum of outputs.

    `seeds` are pairs (output, weight); an output may occur more than once. Nodes that do not depend on
    these kinds are skipped.
    """
    adjoint: dict[int, int] = {}
    for node, weight in seeds:
        adjoint[node] = g.add(adjoint.get(node, g.zero), weight)
    for node in reversed(g.moved(list(adjoint), mask)):
        weight = adjoint.get(node, g.zero)
        if weight == g.zero or g.op[node] == "var":
            continue
        if is_guarded(g, node):
            for variable, share in _chosen_shares(g, node, weight, mask):
                adjoint[variable] = g.add(adjoint.get(variable, g.zero), share)
            continue
        for operand, share in shares(g, node, weight, mask):
            adjoint[operand] = g.add(adjoint.get(operand, g.zero), share)
    return {node: value for node, value in adjoint.items() if g.op[node] == "var" and g.mask[node] & mask}


def _chosen_shares(g: Graph, node: int, weight: int, mask: int) -> Iterator[tuple[int, int]]:
    """What a guarded choice hands down to each variable."""
    a, b, *parts = g.args[node]
    then, otherwise = (reverse(g, [(part, weight)], mask) for part in parts)
    for variable in sorted({*then, *otherwise}):
        yield variable, g.select(a, b, then.get(variable, g.zero), otherwise.get(variable, g.zero))


def shares(g: Graph, node: int, weight: int, mask: int) -> list[tuple[int, int]]:
    """What an adjoint hands down to each operand that depends on the kinds in `mask`."""
    op, args = g.op[node], g.args[node]
    if op == "div":
        share = g.div(weight, args[1])
        pairs = [(args[0], share)]
        if g.slope_mask[args[1]] & mask:
            pairs.append((args[1], g.neg(g.mul(node, share))))
    elif op == "select":
        a, b, then, otherwise = args
        pairs = [(then, g.select(a, b, weight, g.zero)), (otherwise, g.select(a, b, g.zero, weight))]
    else:
        pairs = [(operand, g.mul(weight, partial)) for operand, partial in partials(g, node)]
    return [(operand, share) for operand, share in pairs if g.slope_mask[operand] & mask]


def jacobian(g: Graph, outputs: list[int], inputs: list[int]) -> list[list[int]]:
    """Derivatives of `outputs` by `inputs`, by columns or by rows, whichever costs fewer operations."""
    return g.dense(sparse_jacobian(g, outputs, inputs), len(inputs))


def sparse_jacobian(g: Graph, outputs: list[int], inputs: list[int]) -> SparseRows:
    """The nonzero entries of `jacobian`, each row in the order of its columns."""
    by_columns = _sparse_forward(g, outputs, inputs)
    by_rows = _rows_by_reverse(g, outputs, inputs)

    def cost(rows: SparseRows) -> int:
        return g.count([*outputs, *(entry for row in rows for entry in row.values())])

    return [dict(sorted(row.items())) for row in min(by_columns, by_rows, key=cost)]


def _sparse_forward(g: Graph, outputs: list[int], inputs: list[int]) -> SparseRows:
    """All tangents at once: each node carries its nonzero derivatives by the inputs."""
    mask = 0
    for variable in inputs:
        mask |= g.mask[variable]
    column = {variable: k for k, variable in enumerate(inputs)}
    gradient: dict[int, dict[int, int]] = {}
    for node in g.moved(outputs, mask):
        if g.op[node] == "var":
            gradient[node] = {column[node]: g.one} if node in column else {}
            continue
        if is_guarded(g, node):
            a, b, *parts = g.args[node]
            then, otherwise = (gradient.get(part, {}) for part in parts)
            gradient[node] = {
                k: g.select(a, b, then.get(k, g.zero), otherwise.get(k, g.zero))
                for k in sorted({*then, *otherwise})
            }
            continue
        total: dict[int, int] = {}
        for operand, partial in partials(g, node):
            for k, entry in gradient.get(operand, {}).items():
                total[k] = g.add(total.get(k, g.zero), g.mul(partial, entry))
        gradient[node] = total
    return [{k: d for k, d in gradient.get(node, {}).items() if d != g.zero} for node in outputs]


def _rows_by_reverse(g: Graph, outputs: list[int], inputs: list[int]) -> SparseRows:
    mask = 0
    for variable in inputs:
        mask |= g.mask[variable]
    position = {variable: k for k, variable in enumerate(inputs)}
    rows = []
    for node in outputs:
        adjoint = reverse(g, [(node, g.one)], mask)
        rows.append({position[x]: d for x, d in adjoint.items() if x in position and d != g.zero})
    return rows

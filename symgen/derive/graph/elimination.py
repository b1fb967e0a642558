"""Jacobians of long functions: what is between inputs and outputs is eliminated, one node after another.

An operation is a vertex of a graph whose edges are partial derivatives. Eliminating a vertex multiplies each edge into
it with each edge out of it (Griewank and Walther, Evaluating Derivatives, 2008, section 9.2); what is left in the end
are the derivatives of outputs by inputs. Tangents eliminate from the inputs on, adjoints from the outputs on; here
goes first whatever adds fewest edges, as in sparse elimination (Markowitz 1957). So what has few inputs and few
outputs, such as the force of a contact, is differentiated by itself, once.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection

from .differentiate import MAY_BREAK, is_guarded, partials, shares
from .graph import Graph
from .nodes import SparseRows

Slopes = dict[int, int]  # derivatives by nodes


def eliminated_jacobian(g: Graph, outputs: list[int], inputs: list[int]) -> SparseRows:
    """The nonzero derivatives of `outputs` by `inputs`, each row in the order of its columns.

    Parameters
    ----------
    g : Graph
    outputs : list of int
    inputs : list of int
        Variables.

    Returns
    -------
    SparseRows
    """
    mask = 0
    for variable in inputs:
        mask |= g.mask[variable]
    below = _edges(g, outputs, mask)
    _eliminate(g, below)
    column = {variable: k for k, variable in enumerate(inputs)}
    rows = [below.get(_end(k), {}) for k in range(len(outputs))]
    return [
        {column[x]: slope for x, slope in sorted(row.items()) if x in column and slope != g.zero}
        for row in rows
    ]


def _end(row: int) -> int:
    """The vertex of an output: the node itself may be below other outputs."""
    return -1 - row


def _edges(g: Graph, outputs: list[int], mask: int) -> dict[int, Slopes]:
    """For each vertex that depends on the kinds in `mask`, the derivatives by those right below it."""
    slopes, guarded = g.slope_mask, _Guarded(g, mask)
    below: dict[int, Slopes] = {}
    stack = [node for node in outputs if slopes[node] & mask]
    while stack:
        node = stack.pop()
        if node not in below:
            below[node] = {} if g.op[node] == "var" else guarded.slopes(node)
            stack += below[node]
    for k, node in enumerate(outputs):
        if node in below:
            below[_end(k)] = {node: g.one}
    return below


def _eliminate(g: Graph, below: dict[int, Slopes]) -> None:
    """Eliminate all vertices but variables and outputs."""
    above: dict[int, dict[int, None]] = {node: {} for node in below}  # in an order that is no accident
    for node, slopes in below.items():
        for x in slopes:
            above[x][node] = None

    def added(node: int) -> int:
        n_below, n_above = len(below[node]), len(above[node])
        return n_below * n_above - n_below - n_above

    cost = {node: added(node) for node in below if node >= 0 and g.op[node] != "var"}
    waiting = [(n, -node) for node, n in cost.items()]
    heapq.heapify(waiting)
    while waiting:
        n, node = heapq.heappop(waiting)
        node = -node
        if cost.get(node) != n:
            continue
        del cost[node]
        inner, outer = below.pop(node), above.pop(node)
        for x in inner:
            del above[x][node]
        for end in outer:
            slopes = below[end]
            weight = slopes.pop(node)
            for x, slope in inner.items():
                product = g.mul(weight, slope)
                if x in slopes:
                    slopes[x] = g.add(slopes[x], product)
                else:
                    slopes[x] = product
                    above[x][end] = None
        for x in (*inner, *outer):
            if x in cost and cost[x] != (n := added(x)):
                cost[x] = n
                heapq.heappush(waiting, (n, -x))


class _Guarded:
    """Derivatives of operations by what is right below them; of guarded choices by what is sound in any case.

    See `differentiate.is_guarded`: derivatives of both sides are made down to nodes whose own are finite whatever is
    chosen, and the choice is between these derivatives.
    """

    def __init__(self, g: Graph, mask: int) -> None:
        self.g, self.mask = g, mask
        self._known: dict[int, Slopes] = {}

    def slopes(self, node: int) -> Slopes:
        """The derivatives of an operation, those that are not zero."""
        g, mask = self.g, self.mask
        found: Slopes = {}
        if is_guarded(g, node):
            pairs = list(self._chosen(node).items())
        else:
            pairs = partials(g, node)
        for x, slope in pairs:
            if g.slope_mask[x] & mask and slope != g.zero:
                found[x] = g.add(found[x], slope) if x in found else slope
        return found

    def _chosen(self, node: int) -> Slopes:
        """The derivatives of a guarded choice."""
        if node not in self._known:
            g = self.g
            a, b, *sides = g.args[node]
            unsound = self._unsound(sides, {*g.reachable([a, b])})
            then, otherwise = (self._of_side(side, unsound) for side in sides)
            self._known[node] = {
                x: g.select(a, b, then.get(x, g.zero), otherwise.get(x, g.zero))
                for x in sorted({*then, *otherwise})
            }
        return self._known[node]

    def _unsound(self, sides: list[int], decided: Collection[int]) -> set[int]:
        """The nodes below both sides that may break, or are made of such; what the choice looks at does not."""
        g = self.g
        found: set[int] = set()
        for x in g.reachable(sides):
            breaks = g.op[x] in MAY_BREAK and x not in decided
            if breaks or any(operand in found for operand in g.operands(x)):
                found.add(x)
        return found

    def _of_side(self, side: int, unsound: set[int]) -> Slopes:
        """The derivatives of one side by the first sound nodes below it."""
        g, mask = self.g, self.mask
        adjoint, found = {side: g.one}, {}
        for x in reversed(g.moved([side], mask)):
            weight = adjoint.get(x, g.zero)
            if weight == g.zero:
                continue
            if x not in unsound:
                found[x] = weight
                continue
            if is_guarded(g, x):
                handed = [(y, g.mul(weight, slope)) for y, slope in self._chosen(x).items()]
            else:
                handed = shares(g, x, weight, mask)
            for y, share in handed:
                adjoint[y] = g.add(adjoint.get(y, g.zero), share)
        return found

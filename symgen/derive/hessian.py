"""Second derivatives on the graph by edge pushing (Gower and Mello 2012, Algorithm 3): M from T."""

from __future__ import annotations

from collections.abc import Iterator

from .differentiate import forward, partials, reverse
from .graph import LOCAL, Graph


def hessian(g: Graph, output: int, inputs: list[int]) -> list[list[int]]:
    """Second derivatives of `output` by `inputs`.

    One reverse sweep carries the adjoint of each node and the nonlinear "edges" between pairs of nodes.
    On the kinetic energy of a tree of bodies the edges gather the inertia of all that hangs below a joint,
    which is the composite-body algorithm.

    Parameters
    ----------
    g : Graph
    output : int
    inputs : list of int
        Variables of one kind.

    Returns
    -------
    list of list of int, n x n, symmetric
    """
    mask = 0
    for variable in inputs:
        mask |= g.mask[variable]
    adjoint = {output: g.one}
    edges: dict[int, dict[int, int]] = {}  # edges[i][j] = edges[j][i] = weight
    for node in reversed(g.reachable([output], mask)):
        if g.op[node] == "var":
            continue
        local = _local_partials(g, node, mask)
        _push(g, edges, node, local)
        weight = adjoint.get(node, g.zero)
        if weight != g.zero:
            _create(g, edges, node, weight, mask)
            for x, d in local:
                adjoint[x] = g.add(adjoint.get(x, g.zero), g.mul(weight, d))
    return [[edges.get(a, {}).get(b, g.zero) for b in inputs] for a in inputs]


def _local_partials(g: Graph, node: int, mask: int) -> list[tuple[int, int]]:
    """Partials by the operands of the kinds in `mask`, one for each: an operand may stand in both places."""
    total: dict[int, int] = {}
    for x, d in partials(g, node):
        if g.mask[x] & mask:
            total[x] = g.add(total.get(x, g.zero), d)
    return [(x, d) for x, d in total.items() if d != g.zero]


def _accumulate(g: Graph, edges: dict[int, dict[int, int]], a: int, b: int, weight: int) -> None:
    if weight == g.zero:
        return
    total = g.add(edges.setdefault(a, {}).get(b, g.zero), weight)
    edges[a][b] = total
    edges.setdefault(b, {})[a] = total


def _push(g: Graph, edges: dict[int, dict[int, int]], node: int, local: list[tuple[int, int]]) -> None:
    """Move the edges of `node` to its operands (chain rule for second derivatives)."""
    own = edges.pop(node, None)
    if not own:
        return
    for other, weight in own.items():
        if other == node:
            for k, (x, dx) in enumerate(local):
                for y, dy in local[k:]:
                    _accumulate(g, edges, x, y, g.mul(g.mul(dx, dy), weight))
            continue
        edges[other].pop(node, None)
        for x, d in local:
            push = g.mul(d, weight)
            _accumulate(g, edges, x, other, g.mul(g.const(2.0), push) if x == other else push)


def _create(g: Graph, edges: dict[int, dict[int, int]], node: int, weight: int, mask: int) -> None:
    """Add the operation's own second derivatives."""
    op, args = g.op[node], g.args[node]
    if op in ("add", "sub", "neg"):
        return
    if op == "mul":
        a, b = args
        if a == b:
            _accumulate(g, edges, a, a, g.mul(g.const(2.0), weight))
        elif g.mask[a] & mask and g.mask[b] & mask:
            _accumulate(g, edges, a, b, weight)
        return
    moving = [x for x in dict.fromkeys(args) if g.mask[x] & mask]
    for x, y, second in _second_partials(g, node, moving):
        _accumulate(g, edges, x, y, g.mul(weight, second))


def _second_partials(g: Graph, node: int, moving: list[int]) -> Iterator[tuple[int, int, int]]:
    """Second derivatives of one operation by each pair of the operands in `moving`.

    Variables of their own stand in for the operands meanwhile: on the operands themselves, sign rules and
    identities could carry a derivative past them to what they are made of.
    """
    stand_in = {x: g.var(LOCAL, k) for k, x in enumerate(moving)}
    operands = {variable: x for x, variable in stand_in.items()}
    local = g.rebuild(node, [stand_in.get(x, x) for x in g.operands(node)])
    gradient = reverse(g, [(local, g.one)], LOCAL)
    for k, x in enumerate(moving):
        up_to_x = [gradient.get(stand_in[y], g.zero) for y in moving[: k + 1]]
        second = g.substitute(forward(g, up_to_x, {stand_in[x]: g.one}), operands)
        yield from ((x, y, s) for y, s in zip(moving, second, strict=False))

"""Kinetic energy and constraints as sums over velocities: what the mass matrix is made of, before it is made.

M of a chain in absolute angles is full, and its factorisation costs the third power of the number of links. The
velocities that the kinetic energy is made of are a few numbers a link, and each follows from that of the link before.
So the system [M Gᵀ; G 0] is kept as the second derivatives of T + Σ λ·(dΦ/dt) by rates, multipliers and such velocities
(nodes), and two kinds of steps are mixed: *substitution* of a node by what it is made of (edge pushing, as when M is
made), and *elimination* of a rate that no node is made of any longer, or of a multiplier.

Substitution changes nothing but the form. So every pivot is that of [M Gᵀ; G 0] in the same order of rates and
multipliers, and is regular where that is (see `factorise`).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from ..graph.graph import Graph
from ..graph.nodes import V

LARGEST_MERGED = 3  # inputs of a sum that is merged into its only user


@dataclass(frozen=True)
class Lifted:
    """Second derivatives of T + Σ λ·(dΦ/dt) by rates (0 to n - 1), multipliers (the next m) and nodes (those behind).

    Attributes
    ----------
    n, m : int
    inputs : dict of int to (dict of int to int)
        What each node is a sum of: numbers of rates and of earlier nodes, each with the graph's node of its factor.
    edges : dict of int to (dict of int to int)
        The second derivatives that are not zero, both triangles.
    number : dict of int to int
        Numbers of rates and nodes, by what stands for them on the graph.
    """

    n: int
    m: int
    inputs: dict[int, dict[int, int]]
    edges: dict[int, dict[int, int]]
    number: dict[int, int] = field(default_factory=dict)

    @property
    def weights(self) -> list[int]:
        """All numbers that the system is made of, as nodes of the graph."""
        tables = (*self.inputs.values(), *self.edges.values())
        return [weight for table in tables for weight in table.values()]


def lift(
    g: Graph, kinetic: int, velocities: list[int], rates: list[int], diagonal: dict[int, int]
) -> Lifted | None:
    """Return the system behind an energy and constraints; None where these are no sums of products of velocities.

    Parameters
    ----------
    g : Graph
    kinetic : int
    velocities : list of int
        Velocity level of the constraints.
    rates : list of int
    diagonal : dict of int to int
        What else is in the diagonal, by the numbers of rates and multipliers.
    """
    nodes = g.reachable([kinetic, *velocities], V)
    linear = _linear(g, nodes)
    if any(node not in linear for node in velocities if g.mask[node] & V):
        return None
    products = _products(g, kinetic, linear)
    if products is None:
        return None
    n, m = len(rates), len(velocities)
    used = {node for pair in products for node in pair} | set(velocities)
    number, inputs = _statements(g, [x for x in nodes if x in linear], rates, used, n + m)
    edges: dict[int, dict[int, int]] = {i: {} for i in (*range(n + m), *inputs)}

    def add(i: int, j: int, weight: int) -> None:
        edges[i][j] = edges[j][i] = g.add(edges[i].get(j, g.zero), weight)

    for (a, b), weight in products.items():
        add(number[a], number[b], g.mul(g.const(2.0), weight) if a == b else weight)
    for k, node in enumerate(velocities):
        if node in number:
            add(n + k, number[node], g.one)
    for i, node in diagonal.items():
        add(i, i, node)
    return Lifted(n, m, inputs, edges, number)


def _linear(g: Graph, nodes: list[int]) -> set[int]:
    """Those of the nodes that are sums of rates with factors that are none."""
    found: set[int] = set()
    for node in nodes:
        op, args = g.op[node], g.args[node]
        moving = [x for x in g.operands(node) if g.mask[x] & V]
        if any(x not in found for x in moving):
            continue
        if op in ("var", "add", "sub", "neg") or (op == "mul" and len(moving) == 1):
            found.add(node)
        elif op == "div" and not g.mask[args[1]] & V:
            found.add(node)
    return found


def _products(g: Graph, kinetic: int, linear: set[int]) -> dict[tuple[int, int], int] | None:
    """The products of linear nodes that an energy is a sum of, with their factors; None if there is anything else."""
    factor = {kinetic: g.one}
    products: dict[tuple[int, int], int] = {}
    for node in reversed(g.reachable([kinetic], V)):
        weight = factor.pop(node, g.zero)
        if weight == g.zero or node in linear:
            continue
        op, args = g.op[node], g.args[node]
        moving = [x for x in g.operands(node) if g.mask[x] & V]
        if op in ("add", "sub", "neg"):
            signs = {"add": (1, 1), "sub": (1, -1), "neg": (-1,)}[op]
            shares = [(x, weight if sign > 0 else g.neg(weight)) for x, sign in zip(args, signs, strict=True)]
        elif op == "mul" and all(x in linear for x in moving):
            a, b = sorted(args)
            products[a, b] = g.add(products.get((a, b), g.zero), weight)
            continue
        elif op == "mul" and len(moving) == 1:
            other = args[1] if args[0] == moving[0] else args[0]
            shares = [(moving[0], g.mul(weight, other))]
        elif op == "div" and not g.mask[args[1]] & V:
            shares = [(args[0], g.div(weight, args[1]))]
        else:
            return None
        for x, share in shares:
            if g.mask[x] & V:
                factor[x] = g.add(factor.get(x, g.zero), share)
    return {pair: weight for pair, weight in products.items() if weight != g.zero}


def _statements(
    g: Graph, nodes: list[int], rates: list[int], used: set[int], first: int
) -> tuple[dict[int, int], dict[int, dict[int, int]]]:
    """Numbers of the linear nodes that stay, from `first` on behind those of rates, and what each is a sum of.

    A node is merged into those that are made of it if it is a multiple of one other; or if it is none of `used`, has
    one user and few inputs. A sum onto a node that stays is none of these: chains along bodies remain chains.
    """
    users = Counter(x for node in nodes for x in set(g.operands(node)))
    number = {variable: k for k, variable in enumerate(rates)}
    inputs: dict[int, dict[int, int]] = {}
    merged: dict[int, dict[int, int]] = {}
    for node in nodes:
        if node in number:
            continue
        args = g.args[node]
        terms: dict[int, int] = {}
        for operand, factor in _terms(g, node):
            below = merged[operand] if operand in merged else {number[operand]: g.one}
            for x, weight in below.items():
                terms[x] = g.add(terms.get(x, g.zero), g.mul(factor, weight))
        terms = {x: weight for x, weight in terms.items() if weight != g.zero}
        onto_node = g.op[node] in ("add", "sub") and any(number.get(x, 0) >= first for x in args)
        few = users[node] == 1 and len(terms) <= LARGEST_MERGED and not onto_node
        if node not in used and (len(terms) <= 1 or few):
            merged[node] = terms
        else:
            number[node] = first + len(inputs)
            inputs[number[node]] = terms
    return number, inputs


def _terms(g: Graph, node: int) -> list[tuple[int, int]]:
    """What a linear node is a sum of, with factors."""
    op, args = g.op[node], g.args[node]
    if op in ("add", "sub", "neg"):
        signs = {"add": (1.0, 1.0), "sub": (1.0, -1.0), "neg": (-1.0,)}[op]
        pairs = [(x, g.const(sign)) for x, sign in zip(args, signs, strict=True)]
    elif op == "mul":
        pairs = [(args[0], args[1]), (args[1], args[0])]
    else:
        pairs = [(args[0], g.div(g.one, args[1]))]
    return [(x, factor) for x, factor in pairs if g.mask[x] & V]

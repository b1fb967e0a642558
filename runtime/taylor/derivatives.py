"""Find operations that are time derivatives of others, so that their series come from an index shift.

The text of `residual` spells out accelerations such as a·cos q − v²·sin q; as a series that is the second derivative
of sin q, whose coefficients are there already. Whether one expression is the derivative of another is decided by
their values in the integers modulo a prime, at one random point: a false match has a probability of 1e-15.
"""

from __future__ import annotations

import hashlib
import math

from symgen.runtime.taylor.graph import SeriesGraph
from symgen.runtime.taylor.nodes import CONVOLUTIONS

PRIME = 2**61 - 1
_REPLACEABLE = ("add", "sub", "neg", "scale", *CONVOLUTIONS)
_NEVER = 9  # the level of what no derivative gives: multipliers


class Values:
    """Values and time derivatives of nodes modulo the prime, at one random point."""

    def __init__(self, graph: SeriesGraph) -> None:
        self.graph = graph
        self._known: dict[tuple[int, int], int] = {}

    def __call__(self, node: int, order: int) -> int:
        """The derivative of `node` of this order."""
        known = self._known
        pending = [(node, order)]
        while pending:
            wanted = pending[-1]
            if wanted in known:
                pending.pop()
                continue
            missing = [need for need in self._needs(*wanted) if need not in known]
            if missing:
                pending += missing
            else:
                known[wanted] = self._value(*wanted)
        return known[node, order]

    def _needs(self, node: int, n: int) -> list[tuple[int, int]]:
        g = self.graph
        kind, args = g.op[node], g.args[node]
        if g.is_constant(node):
            return [] if n else [(a, 0) for a in args]
        if kind == "integral":
            return [(args[0], n - 1)] if n else [(a, 0) for a in g.begins_with(node)]
        if kind == "shift":
            return [(args[0], n + 1)]
        if kind == "power" and g.data[node][1] >= 0:
            args = (g.data[node][1],)
        if kind in CONVOLUTIONS:
            lower = [(node, i) for i in range(n)] if kind != "mul" else []
            return [(a, i) for a in args for i in range(n + 1)] + lower
        if kind in ("scale", "kept"):
            return [(args[0], 0), (args[1], n)]
        return [(a, n) for a in args]

    def _value(self, node: int, n: int) -> int:
        g, v = self.graph, self._known
        kind, args, data = g.op[node], g.args[node], g.data[node]
        if g.is_constant(node):
            return self._constant(node) if n == 0 else 0
        if kind == "integral":
            if n:
                return v[args[0], n - 1]
            return _random(*data) if data[0] == "state" else _random(data[0], *(v[a, 0] for a in data[1:]))
        if kind == "time":
            return (_random("time"), 1, 0)[min(n, 2)]
        if kind in ("acceleration", "multiplier"):
            return _random(kind, data[0], n)
        if kind == "shift":
            return v[args[0], n + 1]
        if kind == "neg":
            return -v[args[0], n] % PRIME
        if kind in ("add", "sub"):
            right = v[args[1], n]
            return (v[args[0], n] + (right if kind == "add" else -right)) % PRIME
        if kind in ("scale", "kept"):
            return v[args[0], 0] * v[args[1], n] % PRIME
        if kind == "mul":
            return _product([v[args[0], i] for i in range(n + 1)], [v[args[1], i] for i in range(n + 1)])
        if kind == "div":
            lower = [v[node, i] for i in range(n)]
            rest = v[args[0], n] - _product([*lower, 0], [v[args[1], i] for i in range(n + 1)])
            return rest * pow(v[args[1], 0], -1, PRIME) % PRIME
        if kind == "power":
            return self._power(node, n)
        if n == 0:
            return _random("sqrt", v[args[0], 0])
        lower = [0, *(v[node, i] for i in range(1, n)), 0]
        return (v[args[0], n] - _product(lower, lower)) * pow(2 * v[node, 0], -1, PRIME) % PRIME

    def _power(self, node: int, n: int) -> int:
        """Of P = b^e, from b P' = e b' P; b is a root where e would be half an integer."""
        (base,), (exponent, root), v = self.graph.args[node], self.graph.data[node], self._known
        if root >= 0:
            base, exponent = root, 2.0 * exponent
        if n == 0:
            whole = exponent == round(exponent)
            return pow(v[base, 0], int(exponent), PRIME) if whole else _random("power", v[base, 0], exponent)
        numerator, denominator = exponent.as_integer_ratio()
        rise = _product([v[base, i + 1] for i in range(n)], [v[node, i] for i in range(n)])
        rest = _product([v[base, i] for i in range(n)], [*(v[node, i + 1] for i in range(n - 1)), 0])
        slope = rise * numerator * pow(denominator, -1, PRIME) - rest
        return slope * pow(v[base, 0], -1, PRIME) % PRIME

    def _constant(self, node: int) -> int:
        g, v = self.graph, self._known
        kind, data = g.op[node], g.data[node]
        args = [v[a, 0] for a in g.args[node]]
        if kind == "number":
            if not math.isfinite(data[0]):
                return _random("number", repr(data[0]))
            numerator, denominator = data[0].as_integer_ratio()
            return numerator * pow(denominator, -1, PRIME) % PRIME
        if kind == "fadd":
            return (args[0] + args[1]) % PRIME
        if kind == "fsub":
            return (args[0] - args[1]) % PRIME
        if kind == "fmul":
            return args[0] * args[1] % PRIME
        if kind == "fdiv" and args[1]:
            return args[0] * pow(args[1], -1, PRIME) % PRIME
        if kind == "neg":
            return -args[0] % PRIME
        return _random(kind, *data, *args)


def _product(a: list[int], b: list[int]) -> int:
    """The last derivative of a product, from all derivatives of its factors (Leibniz)."""
    n = len(a) - 1
    return sum(math.comb(n, i) * a[i] * b[n - i] for i in range(n + 1)) % PRIME


def _random(*key: object) -> int:
    return int.from_bytes(hashlib.blake2b(repr(key).encode(), digest_size=8).digest()) % PRIME


def levels(graph: SeriesGraph, nodes: list[int]) -> dict[int, int]:
    """The highest derivative of positions in each node: 0 positions, 1 rates, 2 accelerations."""
    level: dict[int, int] = {}
    for node in nodes:  # by number: what a node is made of comes first
        kind, args = graph.op[node], graph.args[node]
        if kind == "acceleration":
            level[node] = 2
        elif kind == "multiplier":
            level[node] = _NEVER
        elif kind == "integral":
            below = graph.begins_with(node)
            level[node] = max((level[a] for a in below), default=int(node in graph.rates))
        else:
            level[node] = max((level[a] for a in args), default=0) + (kind == "shift")
    return level


def use_derivatives(graph: SeriesGraph, roots: list[int], candidates: list[int]) -> list[int]:
    """Replace operations by equal ones and by derivatives of others, in place; returns the roots.

    Parameters
    ----------
    graph : SeriesGraph
    roots : list of int
    candidates : list of int
        Nodes that need not be behind the roots, of which some may be derivatives: positions of bodies,
        constraints.
    """
    nodes = graph.reachable(roots)
    values = Values(graph)
    level = levels(graph, graph.reachable([*roots, *candidates]))
    series = [
        n
        for n in (*nodes, *sorted(level.keys() - set(nodes)))
        if not graph.is_constant(n) and level[n] < _NEVER
    ]
    equal: dict[tuple[int, int], int] = {}
    derived: dict[tuple[int, int], tuple[int, int]] = {}
    for node in series:
        equal.setdefault((values(node, 0), level[node]), node)
    for order in (2, 1):
        for node in series:
            if level[node] + order <= 2:
                derived.setdefault((values(node, order), level[node] + order), (node, order))
    replaced = {}
    for node in nodes:
        if not graph.is_constant(node) and graph.op[node] in _REPLACEABLE and level[node] < _NEVER:
            found = _found(graph, derived, equal, values(node, 0), level[node])
            if found is not None and found != node:
                replaced[node] = found
    return graph.replace(replaced, roots)


def _found(graph, derived, equal, value: int, level: int) -> int | None:
    """The node to use for one of this value and level: a derivative, or the first that is equal."""
    if value == 0:
        return None
    for sign in (1, -1):
        match = derived.get((sign * value % PRIME, level))
        if match is not None:
            source, order = match
            for _ in range(order):
                source = graph.shift(source)
            return source if sign == 1 else graph.neg(source)
    return equal.get((value, level))

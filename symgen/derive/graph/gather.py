"""Gathers parameters in products, so that they are multiplied with each other once per run and not in every call.

p1·(p2·x) becomes (p1·p2)·x and x/p becomes (1/p)·x; x·(p·y) becomes p·(x·y) where p·y serves nothing else, which
lets p meet others further out. No product depends on motion that did not before.
"""

from __future__ import annotations

from collections import Counter

from .graph import Graph
from .kinds import PARAM

LARGEST = 20_000  # operations; in longer functions the search takes longer than it saves


def gather(g: Graph, outputs: tuple[int, ...]) -> tuple[int, ...]:
    """`outputs` with the parameters in their products gathered; the same but for rounding.

    Parameters
    ----------
    g : Graph
    outputs : tuple of int
        All that one function writes.
    """
    nodes = g.reachable(outputs)
    if len(nodes) > LARGEST:
        return outputs
    uses = Counter(outputs)
    for node in nodes:
        uses.update(g.operands(node))
    return tuple(_Gathering(g, uses).rebuilt(nodes, outputs))


class _Gathering:
    def __init__(self, g: Graph, uses: Counter[int]) -> None:
        self.g, self.uses = g, uses
        self.new: dict[int, int] = {}

    def rebuilt(self, nodes: list[int], outputs: tuple[int, ...]) -> list[int]:
        """Rebuild nodes in topological order and return the new outputs."""
        g, new = self.g, self.new
        for node in nodes:
            op, args = g.op[node], g.args[node]
            if op in ("const", "var") or not g.mask[node] & ~PARAM:
                new[node] = node
            elif op == "mul":
                new[node] = self._product(*args)
            elif op == "div" and not g.mask[args[1]] & ~PARAM:
                new[node] = self._scaled(g.div(g.one, args[1]), new[args[0]])
            else:
                operands = [new[x] for x in args]
                new[node] = node if operands == list(args) else g.rebuild(node, operands)
        return [new[node] for node in outputs]

    def _product(self, a: int, b: int) -> int:
        g, new = self.g, self.new
        if not g.mask[a] & ~PARAM:
            return self._scaled(a, new[b])
        if not g.mask[b] & ~PARAM:
            return self._scaled(b, new[a])
        factor_a, rest_a = self._split(new[a]) if self.uses[a] == 1 else (g.one, new[a])
        factor_b, rest_b = self._split(new[b]) if self.uses[b] == 1 else (g.one, new[b])
        return self._scaled(g.mul(factor_a, factor_b), g.mul(rest_a, rest_b))

    def _scaled(self, factor: int, node: int) -> int:
        inner, rest = self._split(node)
        return self.g.mul(self.g.mul(factor, inner), rest)

    def _split(self, node: int) -> tuple[int, int]:
        """A factor of parameters and numbers, and the rest."""
        g = self.g
        op, args = g.op[node], g.args[node]
        if op == "neg":
            factor, rest = self._split(args[0])
            return (factor, g.neg(rest)) if factor != g.one else (g.one, node)
        if op == "mul":
            for factor, rest in (args, args[::-1]):
                if not g.mask[factor] & ~PARAM:
                    return factor, rest
        return g.one, node

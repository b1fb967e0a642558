"""Which operations depend on parameters only, so that they need doing once per set of parameters, not once per call."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable
from itertools import chain

from .graph import Graph
from .nodes import ON_ARRAYS, PARAM

# p1·(p2·x) becomes (p1·p2)·x and x/p becomes (1/p)·x; x·(p·y) becomes p·(x·y) where p·y serves nothing else, which
# lets p meet others further out. No product depends on motion that did not before.

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
    uses.update(chain.from_iterable(map(g.operands, nodes)))
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


# What an operation depends on: numbers; parameters that all instances of a loop share; parameters of one's own; motion.
CONSTANT, SHARED, OWN, MOTION = range(4)


def levels(g: Graph, nodes: Iterable[int], own: Collection[int] = ()) -> dict[int, int]:
    """What each node depends on.

    Parameters
    ----------
    g : Graph
    nodes : iterable of int
        In topological order, complete.
    own : collection of int
        Indices of the parameters that differ from instance to instance of a loop.
    """
    result: dict[int, int] = {}
    for node in nodes:
        op, args = g.op[node], g.args[node]
        if g.mask[node] & ~PARAM or op in ON_ARRAYS:
            result[node] = MOTION
        elif op == "const":
            result[node] = CONSTANT
        elif op == "var":
            result[node] = OWN if args[1] in own else SHARED
        else:
            result[node] = max(result[x] for x in args)
    return result


def count(g: Graph, outputs: Iterable[int], own: Collection[int] = ()) -> tuple[int, int, int]:
    """Numbers of operations below `outputs` that depend on shared parameters, own parameters, and motion.

    The graph keeps them: reports and headers ask for those of every function several times.
    """
    key = (tuple(outputs), frozenset(own))
    if key not in g.counted:
        counts = [0, 0, 0, 0]
        for node, level in levels(g, g.reachable(key[0]), own).items():
            counts[level] += g.cost(node)
        g.counted[key] = (counts[SHARED], counts[OWN], counts[MOTION])
    return g.counted[key]

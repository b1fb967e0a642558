"""Which operations depend on parameters only, so that they need doing once per set of parameters, not once per call."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from .graph import Graph
from .kinds import PARAM
from .nodes import ON_ARRAYS

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

"""Nodes of one graph on another one."""

from __future__ import annotations

from collections.abc import Callable

from symgen.runtime.graph.functions import IN_CODE

from .graph import Graph


def copied(g: Graph, own: Graph, wanted: list[int], variable: Callable[[int, int], int]) -> list[int]:
    """Nodes of the graph `own` on the graph `g`; `variable` gives the node there of a kind and number."""
    new: dict[int, int] = {}
    for node in own.reachable(wanted):
        op, args = own.op[node], own.args[node]
        if op == "const":
            new[node] = g.const(args[0])
        elif op == "var":
            new[node] = variable(*args)
        else:
            operands = [new[x] for x in args]
            new[node] = g.call(op, *operands) if op in IN_CODE else getattr(g, op)(*operands)
    return [new[node] for node in wanted]

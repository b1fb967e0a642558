"""Numerical values of nodes, for many values of the variables at once."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from symgen.runtime.graph.functions import IN_CODE

from .graph import Graph

OPERATIONS: dict[str, Callable] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "neg": np.negative,
    "select": lambda a, b, then, otherwise: np.where(a < b, then, otherwise),
}


def evaluate(
    g: Graph, nodes: list[int], variables: dict[int, np.ndarray | float]
) -> list[np.ndarray | float]:
    """Values of nodes without loops of their own; nan where there is none.

    Parameters
    ----------
    g : Graph
    nodes : list of int
    variables : dict of int to float or ndarray, shape (n,)
        Values of all variables that the nodes depend on.
    """
    values = dict(variables)
    with np.errstate(all="ignore"):
        for node in g.reachable(nodes):
            op = g.op[node]
            if op == "const":
                values[node] = g.args[node][0]
            elif op != "var":
                function = OPERATIONS.get(op) or _on_arrays(op)
                values[node] = function(*(values[operand] for operand in g.operands(node)))
    return [values[node] for node in nodes]


def _on_arrays(name: str) -> Callable:
    function = IN_CODE[name]
    if function.numpy:
        return getattr(np, function.numpy)
    return np.vectorize(function.value, otypes=[float])


def without_pattern(n: int) -> np.ndarray:
    """Numbers between 0.4 and 1.2 for variables that stand for any: Weyl's sequence of the golden ratio.

    Random generators of NumPy take longer to load.
    """
    return 0.4 + 0.8 * (np.arange(1, n + 1) * (0.5 * (math.sqrt(5.0) - 1.0)) % 1.0)

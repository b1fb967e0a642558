"""Numerical values of nodes, for many values of the variables at once."""

from __future__ import annotations

import numpy as np

from .graph import Graph

FUNCTIONS = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "neg": np.negative,
    "pow": np.power,
    "atan2": np.arctan2,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
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
                function = FUNCTIONS.get(op) or getattr(np, op)
                values[node] = function(*(values[operand] for operand in g.operands(node)))
    return [values[node] for node in nodes]

"""A few values of a form as a line of text: NumPy works them out at many states at once, and nothing has to be read.

Steps stand one behind the other: `y3` and `p1` are elements of those arrays, `#0.5` is a number, `mul:0:2` an
operation on earlier ones; an exclamation mark says that a step is one of the values wanted.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from symgen.runtime.graph.form import P, Y
from symgen.runtime.graph.nodes import Nodes

_LONGEST = 200  # steps
_OPERATIONS = {
    "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide, "neg": np.negative, "sin": np.sin,
    "cos": np.cos, "sqrt": np.sqrt,
}  # fmt: skip


def recipe_of(nodes: Nodes, wanted: Collection[int]) -> str:
    """Return how to work out some nodes; empty where that is long, or needs more than elements of `y` and `p`."""
    steps, number = [], {}
    for node in nodes.reachable(wanted):
        op, args = nodes.op[node], nodes.args[node]
        if op == "const":
            step = f"#{args[0]!r}"
        elif op == "var":
            kind, place = args
            if kind not in (Y, P) or place.step or place.table:
                return ""
            step = f"{'y' if kind == Y else 'p'}{place.first}"
        elif op in _OPERATIONS:
            step = ":".join((op, *(str(number[x]) for x in args)))
        else:
            return ""
        number[node] = len(steps)
        steps.append(f"!{step}" if node in wanted else step)
        if len(steps) > _LONGEST:
            return ""
    return ";".join(steps)


def places_in(recipe: str) -> set[int]:
    """Return the places of `y` that a recipe reads."""
    steps = (step.lstrip("!") for step in recipe.split(";"))
    return {int(step[1:]) for step in steps if step[0] == "y"}


def values_of(recipe: str, y: np.ndarray, p: np.ndarray) -> list[np.ndarray]:
    """Return the values wanted, for each row of `y`."""
    found, wanted = [], []
    for step in recipe.split(";"):
        is_wanted = step[0] == "!"
        step = step[is_wanted:]
        if step[0] == "#":
            value = float(step[1:])
        elif step[1:].isdigit():
            place = int(step[1:])
            value = y[:, place] if step[0] == "y" else float(p[place])
        else:
            op, *args = step.split(":")
            value = _OPERATIONS[op](*(found[int(k)] for k in args))
        found.append(value)
        if is_wanted:
            wanted.append(value)
    return wanted

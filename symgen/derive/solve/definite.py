"""Where the mass matrix is singular by its structure: more coordinates move a mass than it has ways to go."""

from __future__ import annotations

import numpy as np

from ..graph.evaluate import evaluate, without_pattern
from ..graph.graph import Graph
from ..graph.nodes import SparseRows

LARGEST = 40  # coordinates whose inertia is coupled
_SINGULAR = 1e-12  # smallest eigenvalue, of a matrix with a diagonal of ones
_PART = 1e-6  # of a vector of length one


def singular_coordinates(g: Graph, mass: SparseRows) -> set[int]:
    """Return the coordinates along which a motion has no inertia though each has some, whatever the numbers.

    M is looked at for numbers without a pattern: what is singular for these is so by its structure.

    Parameters
    ----------
    g : Graph
    mass : n rows
    """
    found: set[int] = set()
    for block in _blocks(mass):
        nodes = [mass[i].get(j, g.zero) for i in block for j in block]
        variables = [node for node in g.reachable(nodes) if g.op[node] == "var"]
        numbers = without_pattern(len(variables)).tolist()
        values = evaluate(g, nodes, dict(zip(variables, numbers, strict=True)))
        matrix = np.array(values, dtype=float).reshape(len(block), len(block))
        diagonal = np.diag(matrix)
        if not np.isfinite(matrix).all() or diagonal.min() <= 0.0:
            continue
        root = np.sqrt(diagonal)
        sizes, vectors = np.linalg.eigh(matrix / np.outer(root, root))
        still = vectors[:, np.abs(sizes) < _SINGULAR]
        found |= {i for i, parts in zip(block, still, strict=True) if np.abs(parts).max(initial=0.0) > _PART}
    return found


def _blocks(mass: SparseRows) -> list[list[int]]:
    """The sets of several coordinates whose inertia is coupled, but for large ones."""
    blocks, seen = [], set[int]()
    for start, row in enumerate(mass):
        if start in seen or len(row) < 2:
            continue
        block, waiting = {start}, [start]
        while waiting:
            found = mass[waiting.pop()].keys() - block
            block |= found
            waiting += found
        seen |= block
        if len(block) <= LARGEST:
            blocks.append(sorted(block))
    return blocks

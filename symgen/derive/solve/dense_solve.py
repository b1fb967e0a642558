"""Dense LDLᵀ solves by loops, for what is too large and too full to be written out operation by operation.

On the graph a factorisation or a solution is one node, whose numbers are its elements. In the generated module it is a
call of a function of its own: `TEXT`, which the run time knows and replaces by faster code of the same operations.
"""

from __future__ import annotations

from ..graph.graph import Graph

FACTOR, SOLVE = "factor_ldl", "solve_ldl"
SMALLEST = 24  # rows; from here on loops are faster than straight-line code, and compile in no time
LARGEST_HOISTED = 32  # rows of a constant matrix: straight-line factors are hoisted, those of loops are not
LEAST_FULL = 0.7  # share of nonzero entries from which zeros are not worth a thought

TEXT = {
    FACTOR: '''def factor_ldl(a, n, nc):
    """Factorise a symmetric n x n matrix in place: D and U^T D by rows, with 1/d on the diagonal.

    The first nc pivots also change the references a[n*n:] of the later ones, as they change the diagonal.
    """
    for k in range(n):
        d = 1.0 / a[k * n + k]
        a[k * n + k] = d
        for i in range(k + 1, n):
            f = d * a[k * n + i]
            if k < nc <= i:
                a[n * n + i] = a[n * n + i] - f * a[k * n + i]
            for j in range(i, n):
                a[i * n + j] = a[i * n + j] - f * a[k * n + j]
''',
    SOLVE: '''def solve_ldl(a, b, n):
    """Solve in place with the factors in a: b becomes the solution."""
    for k in range(n):
        b[k] = a[k * n + k] * b[k]
        for i in range(k + 1, n):
            b[i] = b[i] - a[k * n + i] * b[k]
    for k in range(n - 2, -1, -1):
        s = 0.0
        for i in range(n - 1, k, -1):
            s = s + a[k * n + i] * b[i]
        b[k] = b[k] - a[k * n + k] * s
''',
}


def worthwhile(n: int, n_entries: int) -> bool:
    """Whether loops over a full n x n matrix win, when `n_entries` of it are not zero."""
    return n >= SMALLEST and n_entries >= LEAST_FULL * n * n


def factor(g: Graph, rows: list[dict[int, int]], n_coordinates: int, references: list[int]) -> int:
    """The node of a factorisation.

    Parameters
    ----------
    g : Graph
    rows : list of dict of int to int
        A symmetric matrix; the first `n_coordinates` rows are positive definite, the rest constraints.
    n_coordinates : int
    references : list of int
        What is in the diagonal of constraints from coordinates that were eliminated before; zero for coordinates.
    """
    n = len(rows)
    entries = [row.get(j, g.zero) if j >= i else g.zero for i, row in enumerate(rows) for j in range(n)]
    return g.on_arrays(FACTOR, (g.const(n), g.const(n_coordinates), *entries, *references))


def solve(g: Graph, factors: int, right: list[int]) -> list[int]:
    """Solution for a right-hand side."""
    handle = g.on_arrays(SOLVE, (factors, *right))
    return [element(g, handle, k) for k in range(len(right))]


def condition(g: Graph, factors: int, row: int) -> int:
    """A constraint's pivot relative to its value before other constraints were eliminated."""
    n = int(g.value(g.args[factors][0]))
    inverse, reference = element(g, factors, row * n + row), element(g, factors, n * n + row)
    return g.div(g.one, g.mul(inverse, reference))


def element(g: Graph, handle: int, index: int) -> int:
    """A number of an array."""
    return g.on_arrays("element", (handle, g.const(index)))

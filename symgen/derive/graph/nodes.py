"""What the derivation's graph has beyond the store of operations: solvers on arrays, and what operations cost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from symgen.runtime.graph.nodes import FoldingError
from symgen.runtime.graph.nodes import Nodes as Store

# LOCAL: stand-ins within a derivative; VIRTUAL: virtual velocities, by which a virtual power is differentiated; SENSED:
# stand-ins for what sensors tell that forces follow, until it is solved for.
T, Q, V, A, LAM, PARAM, INPUT, LOCAL, VIRTUAL, SENSED = (1 << k for k in range(10))
MOTION = T | Q | V | A | LAM | INPUT  # everything that can change during a run


__all__ = ["ON_ARRAYS", "FoldingError", "FrontPlan", "Nodes", "SparseRows"]

# See `solve/dense_solve.py` and `solve/fronts.py`.
ON_ARRAYS = frozenset(("factor_ldl", "solve_ldl", "factor_fronts", "solve_fronts", "element"))

# A matrix: for each row its entries (nodes) by column, structural zeros left out.
SparseRows = list[dict[int, int]]


@dataclass(frozen=True)
class FrontPlan:
    """Where the numbers of a sparse matrix stand in the fronts' array, and the table of the elimination.

    Attributes
    ----------
    n_fronts, n_values : int
        `n_values` is the length of the fronts' array.
    table : tuple of int
        See `factor_fronts` in `TEXT` of `solve/fronts.py`.
    places : tuple of int
        Where the entries go that `factor` is given.
    entries : tuple of (int, int)
        Row and column of each of these; those of the diagonal come twice.
    operations : (int, int)
        Of a factorisation and of a solution.
    """

    n_fronts: int
    n_values: int
    table: tuple[int, ...]
    places: tuple[int, ...]
    entries: tuple[tuple[int, int], ...]
    operations: tuple[int, int]


class Nodes(Store):
    """Operations, among them solvers, whose results are arrays."""

    def __init__(self) -> None:
        super().__init__()
        self.zero = self.const(0.0)
        self.one = self.const(1.0)
        self.front_plans: list[FrontPlan] = []  # factorisations by fronts name theirs by its number
        self.counted: dict[tuple, tuple[int, int, int]] = {}  # operations of functions, see `hoist.count`

    def on_arrays(self, op: str, args: tuple[int, ...]) -> int:
        """One of the operations in `ON_ARRAYS`, whose result is no number, or an element of such a result."""
        return self.operation(op, *args)

    def dense(self, rows: SparseRows, n_columns: int) -> list[list[int]]:
        """A matrix with its zeros."""
        result = [[self.zero] * n_columns for _ in rows]
        for full, row in zip(result, rows, strict=True):
            for k, node in row.items():
                full[k] = node
        return result

    def count(self, outputs: Iterable[int]) -> int:
        """Number of operations that `outputs` cost (constants and variables are free)."""
        nodes = self.reachable(outputs)
        found = Counter(map(self.op.__getitem__, nodes))
        if ON_ARRAYS.isdisjoint(found):
            return len(nodes) - found["const"] - found["var"]
        return sum(map(self.cost, nodes))

    def cost(self, node: int) -> int:
        """Number of operations on numbers that one node stands for."""
        op, args = self.op[node], self.args[node]
        if op not in ON_ARRAYS:
            return op not in ("const", "var")
        if op == "element":
            return 0
        if op == "factor_fronts":
            return self.front_plans[int(self.args[args[0]][0])].operations[0]
        if op == "solve_fronts":
            return self.front_plans[int(self.args[self.args[args[0]][0]][0])].operations[1]
        sizes = self.args[args[0]] if op == "solve_ldl" else args
        n, n_coordinates = (int(self.args[x][0]) for x in sizes[:2])
        if op == "solve_ldl":
            return 2 * n * n
        updates = sum((n - k) * (n - k - 1) // 2 for k in range(n))
        return n + n * (n - 1) // 2 + 2 * updates + 2 * n_coordinates * (n - n_coordinates)

"""Storage of the operation graph: hash-consed nodes in flat lists, and walks over them."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

# See `solve/dense_solve.py` and `solve/fronts.py`.
ON_ARRAYS = frozenset(("factor_ldl", "solve_ldl", "factor_fronts", "solve_fronts", "element"))
_LEAVES = ("const", "var")

# A matrix: for each row its entries (nodes) by column, structural zeros left out.
SparseRows = list[dict[int, int]]


class FoldingError(ValueError):
    """A constant subexpression has no finite real value."""


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


class Nodes:
    """Nodes of an operation graph, each stored once.

    A node is an integer; `op[n]` is its operation, `args[n]` its arguments (nodes, all smaller than `n`, so
    that numeric order is a topological order). Constants and variables have payloads in `args`:
    `("const", (value,))`, `("var", (kind, index))`.
    """

    def __init__(self) -> None:
        self.op: list[str] = []
        self.args: list[tuple] = []
        self.mask: list[int] = []
        self._operands: list[tuple[int, ...]] = []  # `args`, but nothing for constants and variables
        self._index: defaultdict[str, dict[tuple, int]] = defaultdict(dict)  # by operation, then arguments
        self.front_plans: list[FrontPlan] = []  # factorisations by fronts name theirs by its number
        self.counted: dict[tuple, tuple[int, int, int]] = {}  # operations of functions, see `hoist.count`
        self.zero = self.const(0.0)
        self.one = self.const(1.0)

    def _node(self, op: str, args: tuple, mask: int) -> int:
        table = self._index[op]
        node = table.get(args)
        if node is None:
            node = table[args] = len(self.op)
            self.op.append(op)
            self.args.append(args)
            self.mask.append(mask)
            self._operands.append(() if op in _LEAVES else args)
        return node

    def const(self, value: float) -> int:
        """Node of a number."""
        value = float(value)
        if not math.isfinite(value):
            raise FoldingError(f"a constant part of an expression has the value {value}")
        return self._node("const", (value + 0.0,), 0)  # + 0.0 turns -0.0 into 0.0

    def var(self, kind: int, index: int = 0) -> int:
        """Node of a variable."""
        return self._node("var", (kind, index), kind)

    def value(self, a: int) -> float | None:
        """The number that a node stands for, None if it is not constant."""
        return self.args[a][0] if self.op[a] == "const" else None

    def on_arrays(self, op: str, args: tuple[int, ...]) -> int:
        """One of the operations in `ON_ARRAYS`, whose result is no number, or an element of such a result."""
        mask = 0
        for x in args:
            mask |= self.mask[x]
        return self._node(op, args, mask)

    def dense(self, rows: SparseRows, n_columns: int) -> list[list[int]]:
        """A matrix with its zeros."""
        result = [[self.zero] * n_columns for _ in rows]
        for full, row in zip(result, rows, strict=True):
            for k, node in row.items():
                full[k] = node
        return result

    def operands(self, node: int) -> tuple[int, ...]:
        """The nodes that a node is computed from."""
        return self._operands[node]

    def reachable(self, outputs: Iterable[int], mask: int = -1) -> list[int]:
        """All nodes below `outputs` that depend on a kind in `mask` (-1: all), in topological order."""
        operands, masks = self._operands, self.mask
        every = mask == -1
        seen = {node for node in outputs if every or masks[node] & mask}
        stack = list(seen)
        while stack:
            for x in operands[stack.pop()]:
                if x not in seen and (every or masks[x] & mask):
                    seen.add(x)
                    stack.append(x)
        return sorted(seen)

    def count(self, outputs: Iterable[int]) -> int:
        """Number of operations that `outputs` cost (constants and variables are free)."""
        return sum(map(self.cost, self.reachable(outputs)))

    def cost(self, node: int) -> int:
        """Number of operations on numbers that one node stands for."""
        op, args = self.op[node], self.args[node]
        if op not in ON_ARRAYS:
            return op not in _LEAVES
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

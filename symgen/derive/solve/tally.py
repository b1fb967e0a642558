"""What an elimination would cost: arithmetic on what is known about numbers, which counts itself."""

from __future__ import annotations

from collections.abc import Iterable

from ..graph.graph import Graph
from ..graph.nodes import MOTION, FrontPlan, SparseRows

# A multiplication that is vectorised counts as little as this: loops over full matrices do so many at a time.
IN_LOOPS = 0.25


class TooMuch(Exception):
    """Counting has gone beyond its limit."""


class Tally:
    """Stands in for a graph: numbers are zero, one, or something of a kind; no operation is made twice the same.

    Attributes
    ----------
    operations : float
        So far, of those that are carried out again and again: what follows from parameters alone is not counted.
    """

    zero, one = 0, 1

    def __init__(self, limit: float = float("inf")) -> None:
        self.mask = [0, 0]
        self.values = {self.zero: 0.0, self.one: 1.0}
        self.args: dict[int, tuple] = {
            k: (value,) for k, value in self.values.items()
        }  # of numbers, and of solvers
        self.front_plans: list[FrontPlan] = []
        self.operations, self.limit = 0.0, limit

    def number(self, g: Graph, node: int) -> int:
        """What is known about a node of a graph."""
        if node == g.zero:
            return self.zero
        if g.value(node) in (1.0, -1.0):
            return self.one
        return self._new(g.mask[node])

    def moving(self) -> int:
        """A number that changes during a run."""
        return self._new(MOTION)

    def rows(self, g: Graph, rows: SparseRows) -> SparseRows:
        """What is known about a matrix."""
        return [{j: self.number(g, node) for j, node in row.items()} for row in rows]

    def _new(self, mask: int) -> int:
        self.mask.append(mask)
        return len(self.mask) - 1

    def _operation(self, mask: int) -> int:
        if mask & MOTION:
            self.operations += 1
            if self.operations > self.limit:
                raise TooMuch
        return self._new(mask)

    def const(self, value: float) -> int:
        if value in (0.0, 1.0, -1.0):
            return self.one if value else self.zero
        node = self._new(0)
        self.values[node], self.args[node] = value, (value,)
        return node

    def value(self, a: int) -> float | None:
        return self.values.get(a)

    def neg(self, a: int) -> int:
        """-a, which is free: signs move into sums."""
        return a

    def add(self, a: int, b: int) -> int:
        if a == self.zero or b == self.zero:
            return a or b
        return self._operation(self.mask[a] | self.mask[b])

    sub = add

    def mul(self, a: int, b: int) -> int:
        if a == self.zero or b == self.zero:
            return self.zero
        if a == self.one or b == self.one:
            return b if a == self.one else a
        return self._operation(self.mask[a] | self.mask[b])

    def div(self, a: int, b: int) -> int:
        if a == self.zero or b == self.one:
            return a
        return self._operation(self.mask[a] | self.mask[b])

    def sum(self, nodes: Iterable[int]) -> int:
        total = self.zero
        for node in nodes:
            total = self.add(total, node)
        return total

    def dot(self, a: Iterable[int], b: Iterable[int]) -> int:
        return self.sum(self.mul(x, y) for x, y in zip(a, b, strict=True))

    def on_arrays(self, op: str, args: tuple[int, ...]) -> int:
        """A solver by loops, at what its operations are worth."""
        if op == "factor_ldl":
            self.operations += IN_LOOPS * self.values[args[0]] ** 3 / 3
        elif op == "solve_ldl":
            self.operations += IN_LOOPS * 2 * (len(args) - 1) ** 2
        elif op in ("factor_fronts", "solve_fronts"):
            factored = args if op == "factor_fronts" else self.args[args[0]]
            made = self.front_plans[int(self.values[factored[0]])]
            self.operations += IN_LOOPS * made.operations[op == "solve_fronts"]
        if self.operations > self.limit:
            raise TooMuch
        node = self.moving()
        self.args[node] = args
        return node

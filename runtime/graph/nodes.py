"""The store of operations: each once, by number, in flat lists that grow together.

Both halves of the program keep their operations here: the derivation those of a model's equations, the run time those
of a generated function, and the series that it makes of them.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Hashable, Iterable

_LEAVES = ("const", "var")


class FoldingError(ValueError):
    """A constant subexpression has no finite real value."""


class Nodes:
    """Nodes of an operation graph, each stored once.

    A node is an integer; `op[n]` is its operation, `args[n]` its arguments (nodes, all smaller than `n`, so
    that numeric order is a topological order). Constants and variables have payloads in `args`:
    `("const", (value,))`, `("var", (kind, index))`. The bits of `mask[n]` are the kinds of all variables below it.
    """

    def __init__(self) -> None:
        self.op: list[str] = []
        self.args: list[tuple] = []
        self.mask: list[int] = []
        self._operands: list[tuple[int, ...]] = []  # `args`, but nothing for constants and variables
        # By operation, or by what tells operations apart, then by arguments.
        self._index: defaultdict[Hashable, dict[tuple, int]] = defaultdict(dict)

    def _node(self, op: str, args: tuple, mask: int) -> int:
        table = self._index[op]
        node = table.get(args)
        if node is None:
            node = table[args] = self._append(op, args, mask)
        return node

    def _append(self, op: str, args: tuple, mask: int) -> int:
        """Store a node, whether there is an equal one or not."""
        self.op.append(op)
        self.args.append(args)
        self.mask.append(mask)
        self._operands.append(() if op in _LEAVES else args)
        return len(self.op) - 1

    def const(self, value: float) -> int:
        """Node of a number."""
        value = float(value)
        if not math.isfinite(value):
            raise FoldingError(f"a constant part of an expression has the value {value}")
        return self._node("const", (value + 0.0,), 0)  # + 0.0 turns -0.0 into 0.0

    def var(self, kind: int, index: Hashable = 0) -> int:
        """Node of a variable; `index` tells those of a kind apart."""
        return self._node("var", (kind, index), kind)

    def operation(self, op: str, *operands: int) -> int:
        """Node of an operation as it stands: nothing is folded."""
        mask = 0
        for x in operands:
            mask |= self.mask[x]
        return self._node(op, operands, mask)

    def value(self, a: int) -> float | None:
        """The number that a node stands for, None if it is not constant."""
        return self.args[a][0] if self.op[a] == "const" else None

    def operands(self, node: int) -> tuple[int, ...]:
        """The nodes that a node is computed from."""
        return self._operands[node]

    def reachable(self, outputs: Iterable[int], mask: int = -1, met: set[int] | None = None) -> list[int]:
        """All nodes below `outputs` that depend on a kind in `mask` (-1: all), in topological order.

        Nodes in `met` are left out, with what is below them; it grows by those returned.
        """
        operands, masks = self._operands, self.mask
        every = mask == -1
        met = set() if met is None else met
        found = [node for node in {*outputs} - met if every or masks[node] & mask]
        met.update(found)
        stack = list(found)
        while stack:
            for x in operands[stack.pop()]:
                if x not in met and (every or masks[x] & mask):
                    met.add(x)
                    found.append(x)
                    stack.append(x)
        found.sort()
        return found

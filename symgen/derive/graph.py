"""The operation graph: hash-consed scalar operations in flat lists, folded and sign-normalised as they are built."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence

# Kinds of variable, each with its own bit in a node's dependency mask.
# LOCAL: stand-ins within a derivative; VIRTUAL: virtual velocities, by which a virtual power is differentiated.
T, Q, V, A, LAM, PARAM, INPUT, LOCAL, VIRTUAL = (1 << k for k in range(9))
KIND_NAMES = {T: "t", Q: "q", V: "v", A: "a", LAM: "lam", PARAM: "p", INPUT: "u"}
MOTION = T | Q | V | A | LAM | INPUT  # everything that can change during a run

UNARY: dict[str, Callable[[float], float]] = {
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "sinh": math.sinh,
    "cosh": math.cosh,
    "tanh": math.tanh,
    "exp": math.exp,
    "log": math.log,
    "sqrt": math.sqrt,
    "fabs": math.fabs,
}
ODD = frozenset(("sin", "tan", "asin", "atan", "sinh", "tanh"))
EVEN = frozenset(("cos", "cosh", "fabs"))
LARGEST_UNROLLED_POWER = 64
ON_ARRAYS = frozenset(("factor_ldl", "solve_ldl", "element"))  # see `dense_solve.py`
_LEAVES = ("const", "var")


SparseRows = list[
    dict[int, int]
]  # a matrix: for each row, its entries (nodes) by column, without structural zeros


class FoldingError(ValueError):
    """A constant subexpression has no finite real value."""


class Graph:
    """Scalar operations, each stored once.

    A node is an integer; `op[n]` is its operation, `args[n]` its arguments (nodes, all smaller than `n`, so
    that numeric order is a topological order). Constants and variables have payloads in `args`:
    `("const", (value,))`, `("var", (kind, index))`. Building a node folds constants, drops neutral elements,
    moves signs outwards and finds an equal node that exists already; nothing is expanded or simplified beyond that.
    """

    def __init__(self) -> None:
        self.op: list[str] = []
        self.args: list[tuple] = []
        self.mask: list[int] = []
        self._operands: list[tuple[int, ...]] = []  # `args`, but nothing for constants and variables
        self._index: defaultdict[str, dict[tuple, int]] = defaultdict(dict)  # by operation, then arguments
        self._circle: set[int] = set()  # products k·sin(x)² and k·cos(x)²
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

    def neg(self, a: int) -> int:
        op = self.op[a]
        if op == "const":
            return self.const(-self.args[a][0])
        if op == "neg":
            return self.args[a][0]
        if op == "sub":
            reverse = self._index["sub"].get((self.args[a][1], self.args[a][0]))
            if reverse is not None:
                return reverse
        return self._node("neg", (a,), self.mask[a])

    def add(self, a: int, b: int) -> int:
        if a == self.zero:
            return b
        if b == self.zero:
            return a
        op_a, op_b = self.op[a], self.op[b]
        if op_a == "const" and op_b == "const":
            return self.const(self.args[a][0] + self.args[b][0])
        if op_b == "neg":
            return self.sub(a, self.args[b][0])
        if op_a == "neg":
            return self.sub(b, self.args[a][0])
        if a in self._circle or b in self._circle:
            unit = self._unit_circle(a, b)
            if unit is not None:
                return unit
        if a > b:
            a, b = b, a
        return self._node("add", (a, b), self.mask[a] | self.mask[b])

    def _unit_circle(self, a: int, b: int) -> int | None:
        """a + b where that is k sin² + k cos² = k, or such a pair with something added before; else None.

        The one identity that is applied: rigid bodies make these pairs by the dozen, and 1 is exact.
        """
        for x, y in ((a, b), (b, a)):
            if x not in self._circle:
                continue
            factor, partner = self._circle_partner(x)
            if partner is None:
                continue
            if y == partner:
                return factor
            if self.op[y] == "add" and partner in self.args[y]:
                first, second = self.args[y]
                return self.add(second if first == partner else first, factor)
        return None

    def _circle_partner(self, node: int) -> tuple[int, int | None]:
        """For k·sin(x)² (or cos): k and the node k·cos(x)² (or sin), None if there is no such node yet."""
        first, second = self.args[node]
        for factor, square in ((self.one, node), (first, second), (second, first)):
            if self.op[square] != "mul" or self.args[square][0] != self.args[square][1]:
                continue
            root = self.args[square][0]
            if self.op[root] not in ("sin", "cos"):
                continue
            twin = self._index["cos" if self.op[root] == "sin" else "sin"].get(self.args[root])
            partner = self._index["mul"].get((twin, twin))
            if partner is not None and factor != self.one:
                partner = self._index["mul"].get((min(factor, partner), max(factor, partner)))
            return factor, partner
        return self.one, None

    def sub(self, a: int, b: int) -> int:
        if a == b:
            return self.zero
        if b == self.zero:
            return a
        if a == self.zero:
            return self.neg(b)
        op_a, op_b = self.op[a], self.op[b]
        if op_a == "const" and op_b == "const":
            return self.const(self.args[a][0] - self.args[b][0])
        if op_b == "neg":
            return self.add(a, self.args[b][0])
        if op_a == "neg":
            return self.neg(self.add(self.args[a][0], b))
        reverse = self._index["sub"].get((b, a))
        if reverse is not None:
            return self._node("neg", (reverse,), self.mask[reverse])
        return self._node("sub", (a, b), self.mask[a] | self.mask[b])

    def mul(self, a: int, b: int) -> int:
        if a == self.one:
            return b
        if b == self.one:
            return a
        if a == self.zero or b == self.zero:
            return self.zero
        op_a, op_b = self.op[a], self.op[b]
        if op_a == "const":
            value = self.args[a][0]
            return self.const(value * self.args[b][0]) if op_b == "const" else self._scale(value, b)
        if op_b == "const":
            return self._scale(self.args[b][0], a)
        negative = False
        if op_a == "neg":
            a, negative = self.args[a][0], True
        if op_b == "neg":
            b, negative = self.args[b][0], not negative
        node = self._product(a, b) if a <= b else self._product(b, a)
        return self.neg(node) if negative else node

    def _product(self, a: int, b: int) -> int:
        """The node a·b of operands without signs; remembers the products that `_unit_circle` looks for."""
        node = self._node("mul", (a, b), self.mask[a] | self.mask[b])
        if self.op[a] in ("sin", "cos") if a == b else a in self._circle or b in self._circle:
            self._circle.add(node)
        return node

    def _scale(self, factor: float, a: int) -> int:
        """Product of a number and a node, with the numbers of nested products gathered into one."""
        if self.op[a] == "neg":
            factor, a = -factor, self.args[a][0]
        if self.op[a] == "mul" and self.op[self.args[a][0]] == "const":
            factor, a = factor * self.args[self.args[a][0]][0], self.args[a][1]
        if factor == 1.0:
            return a
        if factor == -1.0:
            return self.neg(a)
        if factor < 0.0:
            return self.neg(self._product(self.const(-factor), a))
        return self._product(self.const(factor), a)

    def div(self, a: int, b: int) -> int:
        vb = self.value(b)
        if vb is not None:
            if vb == 0.0:
                raise FoldingError("division by zero in a constant part of an expression")
            return (
                self.mul(self.const(1.0 / vb), a) if self.value(a) is None else self.const(self.value(a) / vb)
            )
        if a == self.zero:
            return self.zero
        if a == b:
            return self.one
        negative = False
        va = self.value(a)
        if va is not None and va < 0.0:
            a, negative = self.const(-va), True
        if self.op[a] == "neg":
            a, negative = self.args[a][0], True
        if self.op[b] == "neg":
            b, negative = self.args[b][0], not negative
        node = self._node("div", (a, b), self.mask[a] | self.mask[b])
        return self.neg(node) if negative else node

    def power(self, base: int, exponent: float) -> int:
        """`base` to a constant power; integers and half-integers become products and square roots."""
        if exponent < 0.0:
            return self.div(self.one, self.power(base, -exponent))
        if exponent == 0.0:
            return self.one
        if 2.0 * exponent == round(2.0 * exponent) and exponent <= LARGEST_UNROLLED_POWER:
            whole = self._integer_power(base, int(exponent))
            return whole if exponent == int(exponent) else self.mul(self.unary("sqrt", base), whole)
        return self.pow(base, self.const(exponent))

    def _integer_power(self, base: int, exponent: int) -> int:
        result, square = self.one, base
        while exponent:
            if exponent & 1:
                result = self.mul(result, square)
            exponent >>= 1
            if exponent:
                square = self.mul(square, square)
        return result

    def pow(self, a: int, b: int) -> int:
        """General power."""
        va, vb = self.value(a), self.value(b)
        if va is not None and vb is not None:
            return self._fold(lambda: math.pow(va, vb), "pow")
        return self._node("pow", (a, b), self.mask[a] | self.mask[b])

    def atan2(self, a: int, b: int) -> int:
        va, vb = self.value(a), self.value(b)
        if va is not None and vb is not None:
            return self.const(math.atan2(va, vb))
        return self._node("atan2", (a, b), self.mask[a] | self.mask[b])

    def unary(self, name: str, a: int) -> int:
        """One of the functions in `UNARY`."""
        va = self.value(a)
        if va is not None:
            return self._fold(lambda: UNARY[name](va), name)
        if self.op[a] == "neg":
            if name in ODD:
                return self.neg(self.unary(name, self.args[a][0]))
            if name in EVEN:
                return self.unary(name, self.args[a][0])
        return self._node(name, (a,), self.mask[a])

    def _fold(self, evaluate: Callable[[], float], name: str) -> int:
        try:
            return self.const(evaluate())
        except (ValueError, OverflowError, ZeroDivisionError) as error:
            raise FoldingError(f"{name} of a constant has no finite real value") from error

    def select(self, a: int, b: int, then: int, otherwise: int) -> int:
        """`then` where a < b, else `otherwise`."""
        if then == otherwise:
            return then
        va, vb = self.value(a), self.value(b)
        if va is not None and vb is not None:
            return then if va < vb else otherwise
        args = (a, b, then, otherwise)
        return self._node(
            "select", args, self.mask[a] | self.mask[b] | self.mask[then] | self.mask[otherwise]
        )

    def minimum(self, a: int, b: int) -> int:
        return self.select(b, a, b, a)

    def maximum(self, a: int, b: int) -> int:
        return self.select(a, b, b, a)

    def sign(self, a: int) -> int:
        """-1, 0 or 1."""
        return self.select(a, self.zero, self.const(-1.0), self.select(self.zero, a, self.one, self.zero))

    def on_arrays(self, op: str, args: tuple[int, ...]) -> int:
        """One of the operations in `ON_ARRAYS`, whose result is no number, or an element of such a result."""
        mask = 0
        for x in args:
            mask |= self.mask[x]
        return self._node(op, args, mask)

    def sum(self, nodes: Iterable[int]) -> int:
        total = self.zero
        for node in nodes:
            total = self.add(total, node)
        return total

    def dot(self, a: Iterable[int], b: Iterable[int]) -> int:
        """Sum of products."""
        return self.sum(self.mul(x, y) for x, y in zip(a, b, strict=True))

    def sparse(self, matrix: Iterable[Sequence[int]]) -> SparseRows:
        """The nonzero entries of a matrix."""
        zero = self.zero
        return [{k: node for k, node in enumerate(row) if node != zero} for row in matrix]

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

    def substitute(self, outputs: list[int], replacement: dict[int, int]) -> list[int]:
        """`outputs` with nodes replaced."""
        mask = 0
        for node in replacement:
            mask |= self.mask[node]
        new = dict(replacement)
        for node in self.reachable(outputs, mask):
            if node not in new:
                new[node] = self.rebuild(node, [new.get(x, x) for x in self.operands(node)])
        return [new.get(node, node) for node in outputs]

    def rebuild(self, node: int, operands: list[int]) -> int:
        """The operation of `node` applied to other operands."""
        op = self.op[node]
        if op in ("const", "var"):
            return node
        if op in UNARY:
            return self.unary(op, *operands)
        if op in ON_ARRAYS:
            return self.on_arrays(op, tuple(operands))
        return getattr(self, op)(*operands)

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
        sizes = self.args[args[0]] if op == "solve_ldl" else args
        n, n_coordinates = (int(self.args[x][0]) for x in sizes[:2])
        if op == "solve_ldl":
            return 2 * n * n
        updates = sum((n - k) * (n - k - 1) // 2 for k in range(n))
        return n + n * (n - 1) // 2 + 2 * updates + 2 * n_coordinates * (n - n_coordinates)

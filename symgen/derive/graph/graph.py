"""The operation graph: scalar operations, folded and sign-normalised as they are built."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable

from symgen.runtime.graph.functions import IN_CODE

from .nodes import ON_ARRAYS, FoldingError, Nodes


def depth_first(g: Graph, roots: Iterable[int], leaves: Collection[int] = ()) -> list[int]:
    """Return all nodes that `roots` need, operands before what uses them, root after root.

    Lifetimes are short in this order, which halves LLVM's time.

    Parameters
    ----------
    leaves : collection of int
        Nodes whose operands are not looked at.
    """
    done: set[int] = set()
    order: list[int] = []
    for root in roots:
        stack = [root]
        while stack:
            node = stack[-1]
            operands = () if node in done or node in leaves else g.operands(node)
            waiting = [x for x in operands if x not in done]
            if waiting:
                stack.extend(reversed(waiting))
                continue
            stack.pop()
            if node not in done:
                done.add(node)
                order.append(node)
    return order


LARGEST_UNROLLED_POWER = 64
# What is below so many outputs or more is kept, of a few functions, unless it is much.
FEWEST_KEPT, MOST_KEPT, LARGEST_KEPT = 8, 12, 100_000
_EVERYWHERE = (-math.inf, math.inf)
_ROOTS = ("sqrt", "pow")
_STEPPED = frozenset(name for name, entry in IN_CODE.items() if entry.stepped)
_UNDEFINED_SOMEWHERE = {name for name, entry in IN_CODE.items() if entry.domain != _EVERYWHERE} | {"pow"}


class Graph(Nodes):
    """Scalar operations on nodes.

    Building a node folds constants, drops neutral elements, moves signs outwards and finds an equal node that exists
    already; nothing is expanded or simplified beyond that.
    """

    def __init__(self) -> None:
        self._circle: set[int] = set()  # products k·sin(x)² and k·cos(x)²
        self.guarded: dict[int, bool] = {}  # choices that have been looked at, see `differentiate.is_guarded`
        self.undivided: frozenset[int] = frozenset()  # set while `differentiate.finite_at_roots` is entered
        self.nonzero: dict[int, int] = {}  # what has been looked at by `differentiate.is_not_clamped`
        # Powers with a root in them, and powers that may become such: base, exponent, whether a root is in it.
        self._powers: dict[int, tuple[int, float, bool]] = {}
        self._undefined: list[
            bool
        ] = []  # of the first nodes: whether what they are made of has no value somewhere
        self._slopes: list[int] = []  # of the first nodes, see `slope_mask`
        self._reached: dict[tuple[int, ...], list[int]] = {}  # what is below outputs that were asked for last
        super().__init__()

    @property
    def slope_mask(self) -> list[int]:
        """The kinds of variables by which a node has a derivative: none where there are steps."""
        slopes = self._slopes
        for node in range(len(slopes), len(self.op)):
            mask, kinds = self.mask[node], 0
            if mask and self.op[node] not in _STEPPED:
                operands = self._operands[node]
                kinds = 0 if operands else mask
                for x in operands:
                    kinds |= slopes[x]
            slopes.append(kinds)
        return slopes

    def reachable(self, outputs: Iterable[int], mask: int = -1, met: set[int] | None = None) -> list[int]:
        """As of all nodes; what is below the outputs of a function is asked for by every pass and kept meanwhile."""
        if mask != -1 or met is not None:
            return super().reachable(outputs, mask, met)
        key = tuple(outputs)
        found = self._reached.get(key)
        if found is None:
            found = super().reachable(key)
            if len(key) >= FEWEST_KEPT and len(found) <= LARGEST_KEPT:
                if len(self._reached) == MOST_KEPT:
                    del self._reached[next(iter(self._reached))]
                self._reached[key] = found
        return found.copy()

    def moved(self, outputs: Iterable[int], mask: int, met: set[int] | None = None) -> list[int]:
        """All nodes below `outputs` that have a derivative by a kind in `mask`, in topological order.

        What steps are made of is left out: it costs a derivative nothing. Nodes in `met` are left out, with what is
        below them; it grows by those returned.
        """
        slopes, met = self.slope_mask, set() if met is None else met
        found = [node for node in {*outputs} - met if slopes[node] & mask]
        met.update(found)
        stack = list(found)
        while stack:
            node = stack.pop()
            for x in self.operands(node):
                if x not in met and slopes[x] & mask:
                    met.add(x)
                    found.append(x)
                    stack.append(x)
        found.sort()
        return found

    def neg(self, a: int) -> int:
        """-a."""
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
        """a + b."""
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
        """a - b."""
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
        """a·b."""
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
        table = self._index["mul"]
        known = table.get((a, b))
        if known is not None:
            return known
        node = table[a, b] = self._append("mul", (a, b), self.mask[a] | self.mask[b])
        op_a, op_b, powers = self.op[a], self.op[b], self._powers
        if a == b or a in powers or b in powers or op_a in _ROOTS or op_b in _ROOTS:
            (base, exponent, root), (other, more, another) = self._as_power(a), self._as_power(b)
            if base == other:
                powers[node] = base, exponent + more, root or another
        if op_a in ("sin", "cos") if a == b else a in self._circle or b in self._circle:
            self._circle.add(node)
        return node

    def _as_power(self, node: int) -> tuple[int, float, bool]:
        """Base and exponent of a node, and whether it is made of a root, so that its base is not negative."""
        op, args = self.op[node], self.args[node]
        if op == "sqrt":
            base, exponent, root = self._as_power(args[0])
            return (base, 0.5 * exponent, True) if root else (args[0], 0.5, True)
        if op == "pow" and (exponent := self.value(args[1])) is not None:
            return args[0], exponent, True
        return self._powers.get(node, (node, 1.0, False))

    def root_power(self, node: int) -> tuple[int, float] | None:
        """Base and exponent of a power that is not that of a whole number, written as a product or not.

        The derivative of x·sqrt(x) at 0 is 0, and by the rule of products it is 0 times infinity.
        """
        if self.op[node] == "sqrt":
            return self.args[node][0], 0.5
        base, exponent, root = self._as_power(node)
        return (base, exponent) if root else None

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
        """a/b."""
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
            return whole if exponent == int(exponent) else self.mul(self.call("sqrt", base), whole)
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
        return self.call("pow", a, b)

    def call(self, name: str, *args: int) -> int:
        """A function of the table, by its name in generated modules."""
        function = IN_CODE[name]
        values = [self.value(a) for a in args]
        if None not in values:
            try:
                return self.const(function.value(*values))
            except (ValueError, OverflowError, ZeroDivisionError) as error:
                raise FoldingError(f"{name} of a constant has no finite real value") from error
        if function.parity and self.op[args[0]] == "neg":
            positive = self.call(name, self.args[args[0]][0])
            return self.neg(positive) if function.parity == "odd" else positive
        mask = 0
        for a in args:
            mask |= self.mask[a]
        return self._node(name, args, mask)

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
        """The smaller of a and b."""
        return self.select(b, a, b, a)

    def maximum(self, a: int, b: int) -> int:
        """The larger of a and b."""
        return self.select(a, b, b, a)

    def sign(self, a: int) -> int:
        """-1, 0 or 1."""
        return self.select(a, self.zero, self.const(-1.0), self.select(self.zero, a, self.one, self.zero))

    def heaviside(self, a: int) -> int:
        """0 below zero, 1 above, 1/2 at zero."""
        return self.select(a, self.zero, self.zero, self.select(self.zero, a, self.one, self.const(0.5)))

    def less(self, a: int, b: int) -> int:
        """The condition a < b: 1 or 0, and no number where one of them is none."""
        return self.defined((a, b), self.select(a, b, self.one, self.zero))

    def defined(self, operands: tuple[int, ...], value: int) -> int:
        """A value that is chosen by operands, and no number where one of these is none.

        Comparisons are false there, so that a choice would be made without a word. Costs nothing where operands are
        made of what has a value everywhere.
        """
        known = self._undefined
        for node in range(len(known), len(self.op)):
            known.append(self.op[node] in _UNDEFINED_SOMEWHERE or any(known[x] for x in self.operands(node)))
        if not any(known[x] for x in operands):
            return value
        total = self.sum(operands)
        square = self.mul(total, total)
        return self.select(self.const(-1.0), square, value, square)

    def choose(self, condition: int, then: int, otherwise: int) -> int:
        """`then` where a condition holds, else `otherwise`.

        A condition is made of choices that end in 1 and 0 (`CONDITIONS` of the table of functions); so is what is
        chosen, with other ends. An end that is none of them is no number.
        """
        chosen = {self.one: then, self.zero: otherwise}
        stack = [condition]
        while stack:
            node = stack[-1]
            if node in chosen:
                stack.pop()
                continue
            if self.op[node] != "select":
                chosen[node] = node
                continue
            a, b, *ends = self.args[node]
            missing = [x for x in ends if x not in chosen]
            if missing:
                stack += missing
            else:
                chosen[node] = self.select(a, b, *(chosen[x] for x in ends))
        return chosen[condition]

    def sum(self, nodes: Iterable[int]) -> int:
        """The sum of all, added in their order."""
        total = self.zero
        for node in nodes:
            total = self.add(total, node)
        return total

    def product(self, nodes: Iterable[int]) -> int:
        """The product of all, multiplied in their order."""
        total = self.one
        for node in nodes:
            total = self.mul(total, node)
        return total

    def dot(self, a: Iterable[int], b: Iterable[int]) -> int:
        """Sum of products."""
        return self.sum(self.mul(x, y) for x, y in zip(a, b, strict=True))

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
        if op in IN_CODE:
            return self.call(op, *operands)
        if op in ON_ARRAYS:
            return self.on_arrays(op, tuple(operands))
        return getattr(self, op)(*operands)

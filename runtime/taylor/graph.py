"""Operations on power series in time, hash-consed: what a function's text becomes before its series are computed.

Every operation is one of a few: sums, products, quotients, square roots, and integrals. Elementary functions are
integrals of their derivatives (sin u is the integral of cos u · u'), which gives their usual recurrences.
"""

from __future__ import annotations

import math

from runtime.taylor.refusal import Refusal

SMOOTH = (
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "atan2",
    "sinh",
    "cosh",
    "tanh",
    "exp",
    "log",
    "sqrt",
    "pow",
)
CONVOLUTIONS = ("mul", "div", "sqrt")
_MOST_FACTORS = 8


class SeriesGraph:
    """Nodes by number: `kinds`, `args` and `data`, in an order in which values come after what they are made of.

    Kinds of constants (of motion): number, parameter, and operations on these: fadd, fsub, fmul, fdiv, neg, call,
    select. Kinds of series: time, acceleration, multiplier, add, sub, neg, scale (constant times series), mul, div,
    sqrt, integral, shift (derivative). `data` of an integral says how it begins: ("state", index of y) or
    (function, *nodes).
    """

    def __init__(self) -> None:
        self.kinds: list[str] = []
        self.args: list[tuple[int, ...]] = []
        self.data: list[tuple] = []
        self.constant: list[bool] = []
        self._known: dict[tuple, int] = {}
        self._cycles: dict[tuple, int] = {}
        self._states: dict[int, int] = {}
        self.rates: set[int] = set()  # which states are rates

    def _node(
        self, kind: str, args: tuple[int, ...], data: tuple = (), *, constant: bool | None = None
    ) -> int:
        key = (kind, args, data)
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = self._append(kind, args, data, constant)
        return found

    def _append(self, kind: str, args: tuple[int, ...], data: tuple, constant: bool | None) -> int:
        self.kinds.append(kind)
        self.args.append(args)
        self.data.append(data)
        self.constant.append(all(self.constant[a] for a in args) if constant is None else constant)
        return len(self.kinds) - 1

    def number(self, value: float) -> int:
        return self._node("number", (), (value, math.copysign(1.0, value)))

    def parameter(self, index: int) -> int:
        return self._node("parameter", (), (index,))

    def time(self) -> int:
        return self._node("time", (), (), constant=False)

    def unknown(self, kind: str, index: int) -> int:
        """An acceleration or a multiplier."""
        return self._node(kind, (), (index,), constant=False)

    def state(self, index: int) -> int:
        """The series that begins with y[index]; `integrate` says what it is the integral of."""
        if index not in self._states:
            self._states[index] = self._append("integral", (), ("state", index), False)
        return self._states[index]

    def integrate(self, state: int, derivative: int) -> None:
        self.args[state] = (derivative,)

    def add(self, a: int, b: int) -> int:
        if self.constant[a] and self.constant[b]:
            return self._node("fadd", (a, b))
        if self.kinds[b] == "neg":
            return self.sub(a, self.args[b][0])
        if self.kinds[a] == "neg":
            return self.sub(b, self.args[a][0])
        return self._node("add", (a, b))

    def sub(self, a: int, b: int) -> int:
        if self.constant[a] and self.constant[b]:
            return self._node("fsub", (a, b))
        if self.kinds[b] == "neg":
            return self.add(a, self.args[b][0])
        return self._node("sub", (a, b))

    def neg(self, a: int) -> int:
        if self.kinds[a] == "number":
            return self.number(-self.data[a][0])
        if self.kinds[a] == "neg":
            return self.args[a][0]
        if self.kinds[a] == "scale":
            return self.scale(self.neg(self.args[a][0]), self.args[a][1])
        return self._node("neg", (a,))

    def mul(self, a: int, b: int) -> int:
        """A product; constant factors and signs come to its outside."""
        if self.constant[a] and self.constant[b]:
            return self._constant_product(a, b)
        if self.constant[a] or self.constant[b]:
            return self.scale(a, b) if self.constant[a] else self.scale(b, a)
        factor, a = self._split(a)
        other, b = self._split(b)
        return self.scale(self._constant_product(factor, other), self._node("mul", (min(a, b), max(a, b))))

    def scale(self, constant: int, a: int) -> int:
        """A constant times a series."""
        factor, a = self._split(a)
        constant = self._constant_product(constant, factor)
        if self.kinds[constant] == "number" and abs(self.data[constant][0]) == 1.0:
            return a if self.data[constant][0] > 0.0 else self.neg(a)
        return self._node("scale", (constant, a))

    def _split(self, a: int) -> tuple[int, int]:
        """A constant factor and the rest."""
        if self.kinds[a] == "scale":
            return self.args[a]
        if self.kinds[a] == "neg" and not self.constant[a]:
            return self.number(-1.0), self.args[a][0]
        return self.number(1.0), a

    def _constant_product(self, a: int, b: int) -> int:
        if self.kinds[b] == "number":
            a, b = b, a
        if self.kinds[a] == "number":
            value = self.data[a][0]
            if self.kinds[b] == "number":
                return self.number(value * self.data[b][0])
            if abs(value) == 1.0:
                return b if value > 0.0 else self.neg(b)
        return self._node("fmul", (a, b))

    def div(self, a: int, b: int) -> int:
        if self.constant[a] and self.constant[b]:
            return self._node("fdiv", (a, b))
        if self.constant[b]:
            return self.scale(self._node("fdiv", (self.number(1.0), b)), a)
        return self._node("div", (a, b))

    def select(self, comparison: str, left: int, right: int, chosen: int, other: int) -> int:
        args = (left, right, chosen, other)
        if not all(self.constant[a] for a in args):
            raise Refusal("a choice (minimum, maximum, a switch) has no Taylor series where it switches")
        return self._node("select", args, (comparison,))

    def shift(self, a: int) -> int:
        """The derivative with respect to time, carried down through linear operations."""
        kind, args = self.kinds[a], self.args[a]
        if self.constant[a]:
            return self.number(0.0)
        if kind == "time":
            return self.number(1.0)
        if kind == "integral" and args:
            return args[0]
        if kind == "neg":
            return self.neg(self.shift(args[0]))
        if kind == "scale":
            return self.mul(args[0], self.shift(args[1]))
        if kind in ("add", "sub"):
            left, right = self.shift(args[0]), self.shift(args[1])
            if self.constant[args[0]]:
                return right if kind == "add" else self.neg(right)
            if self.constant[args[1]]:
                return left
            return self.add(left, right) if kind == "add" else self.sub(left, right)
        return self._node("shift", (a,))

    def call(self, name: str, args: tuple[int, ...]) -> int:
        """A mathematical function of constants, or of series where it is smooth."""
        if all(self.constant[a] for a in args):
            return self._node("call", args, (name,))
        if name not in SMOOTH:
            raise Refusal(f"{name} has no Taylor series where its argument changes sign")
        if name == "sqrt":
            return self._node("sqrt", args)
        if name == "pow":
            return self._power(*args)
        if name in ("sin", "cos", "sinh", "cosh"):
            return self._pair(name, args[0])
        if name in ("tan", "tanh", "exp"):
            return self._growing(name, args[0])
        return self._integral(name, args)

    def _power(self, base: int, exponent: int) -> int:
        if self.kinds[exponent] == "number":
            n = self.data[exponent][0]
            if n == round(n) and 1 <= abs(n) <= _MOST_FACTORS:
                value = base
                for _ in range(int(abs(n)) - 1):
                    value = self.mul(value, base)
                return value if n > 0 else self.div(self.number(1.0), value)
        key = ("pow", base, exponent)
        if key not in self._cycles:
            node = self._cycles[key] = self._append("integral", (), key, False)
            slope = self.mul(exponent, self._slope_of_log(base))
            if not self.constant[exponent]:
                slope = self.add(slope, self.mul(self.shift(exponent), self.call("log", (base,))))
            self.args[node] = (self.mul(node, slope),)
        return self._cycles[key]

    def _slope_of_log(self, base: int) -> int:
        return self.number(0.0) if self.constant[base] else self.div(self.shift(base), base)

    def _pair(self, name: str, u: int) -> int:
        first, second = ("sin", "cos") if name in ("sin", "cos") else ("sinh", "cosh")
        if (first, u) not in self._cycles:
            s = self._cycles[first, u] = self._append("integral", (), (first, u), False)
            c = self._cycles[second, u] = self._append("integral", (), (second, u), False)
            slope = self.shift(u)
            self.args[s] = (self.mul(c, slope),)
            rise = self.mul(s, slope)
            self.args[c] = (self.neg(rise) if first == "sin" else rise,)
        return self._cycles[name, u]

    def _growing(self, name: str, u: int) -> int:
        """Functions whose derivative is made of themselves."""
        if (name, u) not in self._cycles:
            node = self._cycles[name, u] = self._append("integral", (), (name, u), False)
            slope = self.shift(u)
            factor = node
            if name != "exp":
                square, one = self.mul(node, node), self.number(1.0)
                factor = self.add(one, square) if name == "tan" else self.sub(one, square)
            self.args[node] = (self.mul(factor, slope),)
        return self._cycles[name, u]

    def _integral(self, name: str, args: tuple[int, ...]) -> int:
        if (name, *args) not in self._cycles:
            u, one = args[0], self.number(1.0)
            if name == "log":
                slope = self.div(self.shift(u), u)
            elif name == "atan":
                slope = self.div(self.shift(u), self.add(one, self.mul(u, u)))
            elif name == "atan2":
                y, x = args
                turned = self.sub(self.mul(x, self.shift(y)), self.mul(y, self.shift(x)))
                slope = self.div(turned, self.add(self.mul(x, x), self.mul(y, y)))
            else:
                root = self.call("sqrt", (self.sub(one, self.mul(u, u)),))
                slope = self.div(self.shift(u), root)
                slope = self.neg(slope) if name == "acos" else slope
            self._cycles[name, *args] = self._append("integral", (slope,), (name, *args), False)
        return self._cycles[name, *args]

    def begins_with(self, node: int) -> tuple[int, ...]:
        """The nodes that give the first value of an integral."""
        data = self.data[node]
        return () if data[0] == "state" else data[1:]

    def reachable(self, roots: list[int]) -> list[int]:
        """All nodes that the series of `roots` need, by number; first values of integrals included."""
        found, pending = set(roots), list(roots)
        while pending:
            node = pending.pop()
            below = self.args[node]
            if self.kinds[node] == "integral":
                below += self.begins_with(node)
            for a in below:
                if a not in found:
                    found.add(a)
                    pending.append(a)
        return sorted(found)

    def replace(self, replaced: dict[int, int], roots: list[int]) -> list[int]:
        """Let all nodes use others in the place of some, in place; returns the roots."""

        def last(node: int) -> int:
            while node in replaced:
                node = replaced[node]
            return node

        for node in range(len(self.kinds)):
            self.args[node] = tuple(last(a) for a in self.args[node])
            if self.kinds[node] == "integral" and self.data[node][0] != "state":
                self.data[node] = (self.data[node][0], *(last(a) for a in self.data[node][1:]))
        return [last(node) for node in roots]

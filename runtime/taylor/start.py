"""Write what a step begins with: the values of order 0, and the constants of the model."""

from __future__ import annotations

from symgen.runtime.code.llvm_text import constant
from symgen.runtime.taylor.code import ONE, Code, Value
from symgen.runtime.taylor.graph import SeriesGraph

_MOST_PRODUCTS = 4


class Start:
    """Writes values at the start of a step, each when it is first needed.

    Attributes
    ----------
    values : dict of (node, order) to Value
        Coefficients written so far.
    """

    def __init__(self, code: Code, graph: SeriesGraph) -> None:
        self.code, self.graph = code, graph
        self.values: dict[tuple[int, int], Value] = {}
        self._inverses: dict[int, str] = {}
        self._pairs: dict[int, tuple[str, str]] = {}

    def constant(self, node: int) -> str:
        """The value of a node that does not move."""
        return self.initial(node)

    def initial(self, node: int) -> Value:
        """The value of a node at the start of the step."""
        pending = [node]
        while pending:
            wanted = pending[-1]
            if (wanted, 0) in self.values:
                pending.pop()
                continue
            kind = self.graph.op[wanted]
            below = self._below(wanted)
            missing = [a for a in below if kind != "shift" and (a, 0) not in self.values]
            if missing:
                pending += missing
            else:
                self.values[wanted, 0] = self._initial(wanted)
        return self.values[node, 0]

    def _below(self, node: int) -> tuple[int, ...]:
        """The nodes whose values give that of a node."""
        if node in self.graph.products:
            return self.graph.products[node]
        return self.graph.begins_with(node) if self.graph.op[node] == "integral" else self.graph.args[node]

    def _initial(self, node: int) -> Value:
        g, code = self.graph, self.code
        kind, args, data = g.op[node], self._below(node), g.data[node]
        if node in g.products:
            return code.mul(*(self.values[a, 0] for a in args))
        if kind == "number":
            return constant(data[0])
        if kind == "parameter":
            return code.load("p", data[0])
        if kind == "integral" and data[0] == "state":
            return code.load("y", data[1])
        if kind in ("time", "now"):
            return "%t"
        if kind == "shift":
            return self.values[args[0], 1]
        zero = constant(0.0)
        values = [self.values[a, 0] for a in args]
        known = [zero if value is None else value for value in values]
        if kind == "integral":
            return self._function(data[0], data[1], known)
        if kind == "call":
            return code.call(data[0], known)
        if kind == "sqrt":
            return code.call("sqrt", known)
        if kind == "power":
            return self._power(known[0], data[0])
        if kind == "select":
            return code.select(data[0], *known)
        if kind == "kept":
            return code.kept(*known)
        if kind in ("div", "fdiv"):
            return code.div(values[0], known[1])
        if kind in ("mul", "scale", "fmul"):
            return code.mul(*values)
        return getattr(code, {"fadd": "add", "fsub": "sub"}.get(kind, kind))(*values)

    def _power(self, base: str, exponent: float) -> str:
        """A power by products and at most one root and one division; by the C library where that takes many."""
        code, size = self.code, abs(exponent)
        if size > _MOST_PRODUCTS or 2.0 * size != round(2.0 * size):
            return code.call("pow", [base, constant(exponent)])
        value: Value = code.call("sqrt", [base]) if size != round(size) else ONE
        for _ in range(int(size)):
            value = code.mul(base, value)
        return value if exponent > 0.0 else code.div(ONE, value)

    def _function(self, name: str, argument: int, known: list[str]) -> str:
        if name not in ("sin", "cos"):
            return self.code.call(name, known)
        if argument not in self._pairs:
            self._pairs[argument] = self.code.sincos(known[0])
        return self._pairs[argument][name == "cos"]

    def inverse(self, node: int) -> str:
        """1 / c of a quotient b / c or a power of c, 1 / (2 u) of a root u, at the start of the step."""
        if node not in self._inverses:
            half = self.graph.op[node] == "sqrt"
            divisor = self.initial(node if half else self.graph.args[node][-1])
            self._inverses[node] = self.code.div(constant(0.5) if half else ONE, divisor or constant(0.0))
        return self._inverses[node]

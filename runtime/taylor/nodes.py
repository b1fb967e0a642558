"""The nodes of a graph of power series in time: what each is, and what it is made of."""

from __future__ import annotations

import math

from symgen.runtime.graph.nodes import Nodes

MOVING = 1  # a node's mask, if it changes during a step
CONVOLUTIONS = ("mul", "div", "sqrt", "power")


class SeriesNodes(Nodes):
    """Nodes in an order in which values come after what they are made of, but for integrals (`integrate`).

    Kinds of constants (of a step): number, parameter, now (the time at its start), and operations on these: fadd,
    fsub, fmul, fdiv, neg, call, select. Kinds of series: time, acceleration, multiplier, add, sub, neg, scale (constant
    times series), kept (series where a constant is 1, zero where it is 0), mul, div, sqrt, power (`data`: the exponent,
    and for halves the root), integral, shift (derivative).
    `data` of an integral says how it begins: ("state", index of y) or (function, *nodes).

    `stops_at_choices` says whether steps end where time alone chooses anew; only then have such choices a series.

    `products` has sums whose terms cancel: at the start of a step, they are the product of two other nodes, exactly.
    """

    def __init__(self, *, stops_at_choices: bool = False) -> None:
        super().__init__()
        self.stops_at_choices = stops_at_choices
        self.data: list[tuple] = []  # what a node is besides its operands
        self._cycles: dict[tuple, int] = {}
        self._states: dict[int, int] = {}
        self.products: dict[int, tuple[int, int]] = {}
        self.rates: set[int] = set()  # which states are rates

    def _node(
        self, kind: str, args: tuple[int, ...], data: tuple = (), *, constant: bool | None = None
    ) -> int:
        table = self._index[kind, data]
        found = table.get(args)
        if found is None:
            found = table[args] = self._append(kind, args, data, constant)
        return found

    def _append(self, kind: str, args: tuple[int, ...], data: tuple, constant: bool | None) -> int:
        self.data.append(data)
        moves = any(self.mask[a] for a in args) if constant is None else not constant
        return super()._append(kind, args, MOVING if moves else 0)

    def is_constant(self, node: int) -> bool:
        """Whether a node is the same all through a step."""
        return not self.mask[node]

    def number(self, value: float) -> int:
        return self._node("number", (), (value, math.copysign(1.0, value)))

    def parameter(self, index: int) -> int:
        return self._node("parameter", (), (index,))

    def time(self) -> int:
        return self._node("time", (), (), constant=False)

    def now(self) -> int:
        """The time at the start of the step."""
        return self._node("now", (), (), constant=True)

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
            if self.op[node] == "integral":
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

        for node in range(len(self.op)):
            self.args[node] = tuple(last(a) for a in self.args[node])
            if self.op[node] == "integral" and self.data[node][0] != "state":
                self.data[node] = (self.data[node][0], *(last(a) for a in self.data[node][1:]))
        self.products = {last(node): (last(a), last(b)) for node, (a, b) in self.products.items()}
        return [last(node) for node in roots]

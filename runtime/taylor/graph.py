"""Operations on power series in time: what a function's text becomes before its series are computed.

Every operation is one of a few: sums, products, quotients, roots, powers, and integrals. Elementary functions are
integrals of their derivatives (sin u is the integral of cos u · u'), which gives their usual recurrences.
"""

from __future__ import annotations

import math

from symgen.runtime.errors import Refusal
from symgen.runtime.graph.functions import IN_CODE, slopes
from symgen.runtime.graph.nodes import Nodes

MOVING = 1  # a node's mask, if it changes during a step
SOLVED = 2  # and if it is made of right-hand sides: its operations are carried out as they stand
CONVOLUTIONS = ("mul", "div", "sqrt", "power")


class SeriesNodes(Nodes):
    """Nodes in an order in which values come after what they are made of, but for integrals (`integrate`).

    Kinds of constants (of a step): number, parameter, now (the time at its start), start (an element of y there), and
    operations on these: fadd, fsub, fmul, fdiv, neg, call, select. Kinds of series: time, acceleration, multiplier,
    right (of the equations, for what is solved at every order), add, sub, neg, scale (constant times series), kept
    (series where a constant is 1, zero where it is 0), mul, div, sqrt, power (`data`: the exponent, and for halves the
    root), integral, shift (derivative).
    `data` of an integral says how it begins: ("state", index of y) or (function, *nodes).

    `stops_at_choices` says whether steps end where time alone chooses anew; only then have such choices a series.
    `branches` are the parameters that hold choices which the state makes: steps end where these are turned around.
    Other choices of the state are those of the start of a step, too; `has_unheld` says whether there are any
    (`note_unheld` finds them), for which steps look in between.

    `products` has sums whose terms cancel: at the start of a step, they are the product of two other nodes, exactly.
    """

    def __init__(self, *, stops_at_choices: bool = False, branches: range = range(0)) -> None:
        super().__init__()
        self.stops_at_choices, self.branches, self.has_unheld = stops_at_choices, branches, False
        self.data: list[tuple] = []  # what a node is besides its operands
        self._cycles: dict[tuple, int] = {}
        self._at_start: dict[int, int | None] = {}
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
        mask = 0 if constant is not False else MOVING
        for a in args if constant is None else ():
            mask |= self.mask[a]
        return super()._append(kind, args, mask | SOLVED if kind == "right" else mask)

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

    def start(self, index: int) -> int:
        """y[index] at the start of the step."""
        return self._node("start", (), (index,), constant=True)

    def unknown(self, kind: str, index: int) -> int:
        """An acceleration, a multiplier, or a right-hand side."""
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

    def solved_below(self, roots: list[int]) -> list[int]:
        """All nodes below `roots` that a right-hand side moves, each after what it is made of.

        Numbers do not say that order: nodes that took the place of others are newer than those that read them.
        """
        found: dict[int, None] = {}
        pending = list(reversed(roots))
        while pending:
            node = pending[-1]
            missing = [a for a in self.args[node] if self.mask[a] & SOLVED and a not in found]
            if missing and node not in found:
                pending += missing
            else:
                pending.pop()
                if self.mask[node] & SOLVED:
                    found[node] = None
        return list(found)

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


# Constant factors and signs come to the outside. Products and quotients of powers of one series become one power:
# m / r · (1 / r) · (1 / r) with r = sqrt(u) is m u^(-3/2).

_MOST_FACTORS = 8
_MAY_BREAK = ("div", "fdiv", "sqrt", "power", "call")


class Algebra(SeriesNodes):
    """What is made of series by arithmetic and by differentiation."""

    def add(self, a: int, b: int) -> int:
        if self.is_constant(a) and self.is_constant(b):
            return self._node("fadd", (a, b))
        if self.op[b] == "neg":
            return self.sub(a, self.args[b][0])
        if self.op[a] == "neg":
            return self.sub(b, self.args[a][0])
        return self._node("add", (a, b))

    def sub(self, a: int, b: int) -> int:
        if self.is_constant(a) and self.is_constant(b):
            return self._node("fsub", (a, b))
        if self.op[b] == "neg":
            return self.add(a, self.args[b][0])
        return self._node("sub", (a, b))

    def neg(self, a: int) -> int:
        if self.op[a] == "number":
            return self.number(-self.data[a][0])
        if self.op[a] == "neg":
            return self.args[a][0]
        if self.op[a] == "scale":
            return self.scale(self.neg(self.args[a][0]), self.args[a][1])
        return self._node("neg", (a,))

    def mul(self, a: int, b: int) -> int:
        """A product; constant factors and signs come to its outside."""
        if self.is_constant(a) and self.is_constant(b):
            return self._constant_product(a, b)
        if (self.mask[a] | self.mask[b]) & SOLVED:
            one = self.number(1.0)  # as a factor that terms share, it would be taken out of sums without end
            return a if b == one else b if a == one else self._node("mul", (min(a, b), max(a, b)))
        if self.is_constant(a) or self.is_constant(b):
            return self.scale(a, b) if self.is_constant(a) else self.scale(b, a)
        factor, a = self._split(a)
        other, b = self._split(b)
        return self.scale(self._constant_product(factor, other), self._product(a, b))

    def _product(self, a: int, b: int) -> int:
        (base, exponent), (other, more) = self._as_power(a), self._as_power(b)
        if base == other and (exponent, more) != (1.0, 1.0):
            return self.power(base, exponent + more)
        for left, right in ((a, b), (b, a)):
            if (found := self._distributed(left, right)) is not None:
                return found
            if (found := self._merged(left, right)) is not None:
                return found
        return self._node("mul", (min(a, b), max(a, b)))

    def _distributed(self, total: int, factor: int) -> int | None:
        """(r - c) times 1 / r as 1 - c / r, which needs no product of series: the force of a spring.

        Where r is near c, its value is still that of the product.
        """
        base, exponent = self._as_power(factor)
        if exponent == 1.0 or self.op[total] not in ("add", "sub"):
            return None
        left, right = self.args[total]
        if self.is_constant(left) == self.is_constant(right):
            return None
        other, more = self._as_power(self._split(right if self.is_constant(left) else left)[1])
        if other != base or exponent + more not in (0.0, 1.0):
            return None
        found = getattr(self, self.op[total])(self.mul(left, factor), self.mul(right, factor))
        self.products[found] = total, factor
        return found

    def _merged(self, product: int, factor: int) -> int | None:
        """(w / r) times 1 / r as w / r^2, one quotient for two products: the force of a damper."""
        base, exponent = self._as_power(factor)
        if exponent == 1.0 or self.op[product] != "mul":
            return None
        for inner, rest in (self.args[product], self.args[product][::-1]):
            other, more = self._as_power(inner)
            if other == base and exponent + more in (0.0, -1.0):
                return rest if exponent + more == 0.0 else self.div(rest, base)
        return None

    def _as_power(self, a: int) -> tuple[int, float]:
        """A series as base and exponent."""
        kind, args = self.op[a], self.args[a]
        if kind == "sqrt":
            return args[0], 0.5
        if kind == "power":
            return args[0], self.data[a][0]
        if kind == "div" and args[0] == self.number(1.0):
            return args[1], -1.0
        return a, 1.0

    def power(self, base: int, exponent: float) -> int:
        """A series to the power of a number."""
        if exponent == 0.0:
            return self.number(1.0)
        if exponent == round(exponent) and 1.0 <= exponent <= _MOST_FACTORS:
            value = base
            for _ in range(int(exponent) - 1):
                value = self.mul(value, base)
            return value
        if exponent == -1.0:
            return self._node("div", (self.number(1.0), base))
        if exponent == 0.5:
            return self._node("sqrt", (base,))
        # That of a root: what says which series are derivatives of others thinks of powers as those of roots.
        root = self._node("sqrt", (base,)) if 2.0 * exponent == round(2.0 * exponent) else -1
        return self._node("power", (base,), (exponent, root))

    def scale(self, constant: int, a: int) -> int:
        """A constant times a series."""
        if self.is_constant(a):
            return self._constant_product(constant, a)
        factor, a = self._split(a)
        constant = self._constant_product(constant, factor)
        if self.op[constant] == "number" and abs(self.data[constant][0]) == 1.0:
            return a if self.data[constant][0] > 0.0 else self.neg(a)
        return self._node("scale", (constant, a))

    def _split(self, a: int) -> tuple[int, int]:
        """A constant factor and the rest."""
        if self.op[a] == "scale":
            return self.args[a]
        if self.op[a] == "neg" and not self.is_constant(a):
            return self.number(-1.0), self.args[a][0]
        return self.number(1.0), a

    def _constant_product(self, a: int, b: int) -> int:
        if self.op[b] == "number":
            a, b = b, a
        if self.op[a] == "number":
            value = self.data[a][0]
            if self.op[b] == "number":
                return self.number(value * self.data[b][0])
            if abs(value) == 1.0:
                return b if value > 0.0 else self.neg(b)
        return self._node("fmul", (a, b))

    def div(self, a: int, b: int) -> int:
        if self.is_constant(a) and self.is_constant(b):
            return self._node("fdiv", (a, b))
        if self.mask[a] & SOLVED:
            return self.mul(a, self.div(self.number(1.0), b))
        if self.is_constant(b):
            return self.scale(self._node("fdiv", (self.number(1.0), b)), a)
        divisor, b = self._split(b)
        factor, a = (a, self.number(1.0)) if self.is_constant(a) else self._split(a)
        if self.op[divisor] == "number" and abs(self.data[divisor][0]) == 1.0:
            factor = self._constant_product(factor, divisor)
        else:
            factor = self._node("fdiv", (factor, divisor))
        return self.scale(factor, self._quotient(a, b))

    def _quotient(self, a: int, b: int) -> int:
        base, exponent = self._as_power(b)
        if a == self.number(1.0):
            return self.power(base, -exponent)
        other, more = self._as_power(a)
        if other == base:
            return self.power(base, more - exponent)
        found = self._distributed(a, self.power(base, -exponent)) if exponent != 1.0 else None
        return self._node("div", (a, b)) if found is None else found

    def select(self, comparison: str, left: int, right: int, chosen: int, other: int) -> int:
        """A choice that is made at the start of a step: where time or a branch decides anew steps end, or look."""
        sides = self.at_start(left), self.at_start(right)
        if None in sides:
            raise Refusal(NO_CHOICE)
        if self.is_constant(chosen) and self.is_constant(other):
            return self._node("select", (*sides, chosen, other), (comparison,))
        one, none = self.number(1.0), self.number(0.0)
        taken = self._node("select", (*sides, one, none), (comparison,))
        left_out = self._node("select", (*sides, none, one), (comparison,))
        return self.add(self._kept(taken, chosen), self._kept(left_out, other))

    def _kept(self, is_taken: int, a: int) -> int:
        """A series where `is_taken` is 1, zero where it is 0; also of what is infinite or undefined there."""
        if not self._may_break(a):
            return self.mul(is_taken, a)
        if self.is_constant(a):
            none = self.number(0.0)
            return self._node("select", (none, is_taken, a, none), ("olt",))
        return self._node("kept", (is_taken, a))

    def _is_given(self, node: int) -> bool:
        """Whether a constant is made of numbers and parameters alone."""
        return all(self.args[x] or self.op[x] in ("number", "parameter") for x in self.reachable([node]))

    def _may_break(self, a: int, by_motion: bool = False) -> bool:
        """Whether a series is made of what is not finite everywhere, for some parameters or along a motion."""
        seen, pending = set(), [a]
        while pending:
            node = pending.pop()
            kind, data = self.op[node], self.data[node]
            if kind in _MAY_BREAK or (kind == "integral" and data[0] not in ("state", "sin", "cos")):
                if not (by_motion and self._is_given(node)):
                    return True
            if node not in seen and kind != "integral":
                seen.add(node)
                pending += self.args[node]
        return False

    def at_start(self, a: int) -> int | None:
        """What time and state decide, as the constant that it is at the start of a step; None where that may change.

        Whether a branch holds what the state decides, `note_unheld` finds.
        """
        if self.is_constant(a):
            return a
        if a not in self._at_start:
            self._at_start[a] = self._taken_at_start(a)
        return self._at_start[a]

    def _taken_at_start(self, a: int) -> int | None:
        kind = self.op[a]
        if kind == "time":
            return self.now() if self.stops_at_choices else None
        if kind == "integral":
            name, *below = self.data[a]
        else:
            name, below = kind, list(self.args[a])
        if name == "state":
            return self.start(below[0])
        if name in ("acceleration", "multiplier", "right", "shift"):
            return None
        args = [self.at_start(x) for x in below]
        if None in args:
            return None
        if kind == "integral" or kind == "sqrt":
            return self._node("call", tuple(args), (name,))
        if kind == "power":
            return self._node("call", (args[0], self.number(self.data[a][0])), ("pow",))
        return getattr(self, {"scale": "mul", "kept": "_kept"}.get(kind, kind))(*args)

    def shift(self, a: int) -> int:
        """The derivative with respect to time, carried down through linear operations."""
        kind, args = self.op[a], self.args[a]
        if self.is_constant(a):
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
            if self.is_constant(args[0]):
                return right if kind == "add" else self.neg(right)
            if self.is_constant(args[1]):
                return left
            return self.add(left, right) if kind == "add" else self.sub(left, right)
        return self._node("shift", (a,))


NO_CHOICE = "a choice (minimum, maximum, a switch) has no Taylor series where it switches"


class SeriesGraph(Algebra):
    """Nodes by number, see `SeriesNodes`; elementary functions are made of what arithmetic offers."""

    const = Algebra.number  # as the operation graph calls it

    def call(self, name: str, *args: int) -> int:
        """A mathematical function of constants, or of series where it is smooth."""
        if all(self.is_constant(a) for a in args):
            return self._node("call", args, (name,))
        if name == "fabs" and self.at_start(args[0]) is not None:
            return self.select("olt", args[0], self.number(0.0), self.neg(args[0]), args[0])
        if IN_CODE[name].stepped and (argument := self.at_start(args[0])) is not None:
            return self._node("call", (argument,), (name,))
        if not IN_CODE[name].smooth:
            where = "it jumps" if IN_CODE[name].stepped else "its argument changes sign"
            raise Refusal(f"{name} has no Taylor series where {where}")
        if name == "sqrt":
            return self._node("sqrt", args)
        if name == "pow":
            return self._power(*args)
        if (name, *args) not in self._cycles:
            self._integrate(name, args)
        return self._cycles[name, *args]

    def _integrate(self, name: str, args: tuple[int, ...]) -> None:
        """Make the integral of a function's derivative, with those of the functions that this is made of."""
        system = IN_CODE[name].system
        if not system:
            slope = self._derivative(name, args, -1)
            self._cycles[name, *args] = self._append("integral", (slope,), (name, *args), False)
            return
        nodes = [self._append("integral", (), (member, *args), False) for member in system]
        self._cycles |= {(member, *args): node for member, node in zip(system, nodes, strict=True)}
        for member, node in zip(system, nodes, strict=True):
            self.args[node] = (self._derivative(member, args, node),)

    def sign(self, a: int) -> int:
        """-1 or 1: the derivative of `fabs`."""
        return self.select("olt", a, self.number(0.0), self.number(-1.0), self.number(1.0))

    def _derivative(self, name: str, args: tuple[int, ...], value: int) -> int:
        """The derivative of a function with respect to time."""
        above: dict[int | None, int] = {}  # sums of numerators, by their denominator
        for a, (numerator, denominator) in zip(args, slopes(self, name, args, value), strict=True):
            if not self.is_constant(a):
                term = self.mul(numerator, self.shift(a))
                above[denominator] = self.add(above[denominator], term) if denominator in above else term
        (total, *others) = (
            numerator if denominator is None else self.div(numerator, denominator)
            for denominator, numerator in above.items()
        )
        for other in others:
            total = self.add(total, other)
        return total

    def _power(self, base: int, exponent: int) -> int:
        if self.op[exponent] == "number":
            n = self.data[exponent][0]
            inner, of_inner = self._as_power(base)
            # What is below a root is positive; (u^2)^0.5 is not u.
            return self.power(base, n) if of_inner == round(of_inner) else self.power(inner, of_inner * n)
        key = ("pow", base, exponent)
        if key not in self._cycles:
            node = self._cycles[key] = self._append("integral", (), key, False)
            slope = self.mul(exponent, self._slope_of_log(base))
            if not self.is_constant(exponent):
                slope = self.add(slope, self.mul(self.shift(exponent), self.call("log", base)))
            self.args[node] = (self.mul(node, slope),)
        return self._cycles[key]

    def _slope_of_log(self, base: int) -> int:
        return self.number(0.0) if self.is_constant(base) else self.div(self.shift(base), base)

    def note_unheld(self, roots: list[int]) -> None:
        """Find choices of the state that no branch holds: kinks that leave forces smooth, which a step may go over.

        Raises
        ------
        Refusal
            A function that jumps, or a choice with no value somewhere, is not held; or a root is taken of a kink.
        """
        found, pending, unheld = set(roots), list(roots), set()
        while pending:
            node = pending.pop()
            if self._is_unheld(node):
                unheld.add(node)
            for below in self._chosen_among(node):
                if below not in found:
                    found.add(below)
                    pending.append(below)
        self.has_unheld = bool(unheld)
        for node in found if unheld else ():
            # The series of a root ends where a kink makes it zero; that of a piece goes on where it has no value.
            breaks = (
                self.op[node] == "sqrt"
                or (self.op[node] == "kept" and self._may_break(self.args[node][1], by_motion=True))
                or (self.op[node] == "power" and self.data[node][0] % 1.0)
            )
            if breaks and not unheld.isdisjoint(self.reachable([self.args[node][0]])):
                raise Refusal(NO_CHOICE)

    def _is_unheld(self, node: int) -> bool:
        if self.op[node] != "select":
            return False
        of_state, of_branch, breaks = map(any, zip(*map(self._decides, self.args[node][:2]), strict=True))
        if of_state and breaks:
            raise Refusal(NO_CHOICE)
        return of_state and not of_branch

    def _chosen_among(self, node: int) -> tuple[int, ...]:
        """What a node is made of, without what only decides and is held."""
        op, args = self.op[node], self.args[node]
        if op == "integral":
            return args + self.begins_with(node)
        if op == "select":
            of_state, of_branch, _ = map(any, zip(*map(self._decides, args[:2]), strict=True))
            # `p` alone chooses what is held, and else the choice that is not: as it is outside of step loops.
            return args[2:] if of_state else args[2:3] if of_branch and not self._is_nested(args[3]) else args
        if op == "call" and IN_CODE[self.data[node][0]].stepped:
            of_state, of_branch, breaks = self._decides(args[0])
            if of_state and (breaks or not of_branch):
                raise Refusal(f"{self.data[node][0]} has no Taylor series where it jumps")
            return ()
        return args

    def _is_nested(self, node: int) -> bool:
        """Whether a choice between what is held and what is not stands here."""
        if self.op[node] != "select":
            return False
        of_state, of_branch, _ = map(any, zip(*map(self._decides, self.args[node][:2]), strict=True))
        return of_branch and not of_state

    def _decides(self, node: int) -> tuple[bool, bool, bool]:
        """Whether a constant is made of the state at the start, of a branch, and of what is not finite everywhere.

        Series of a piece go on where the choice itself has no value, and would say nothing.
        """
        seen, pending, of_state, of_branch, breaks = {node}, [node], False, False, False
        while pending:
            x = pending.pop()
            breaks = breaks or self._is_partial(x)
            of_state = of_state or self.op[x] == "start"
            of_branch = of_branch or (self.op[x] == "parameter" and self.data[x][0] in self.branches)
            for below in self.args[x]:
                if below not in seen:
                    seen.add(below)
                    pending.append(below)
        return of_state, of_branch, breaks

    def _is_never_negative(self, node: int) -> bool:
        """Whether a constant is seen to be no negative number: a sum of squares, as in distances and slips."""
        op, args = self.op[node], self.args[node]
        if op == "number":
            return self.data[node][0] >= 0.0
        if op == "fmul" and args[0] == args[1]:
            return True
        if op == "select":
            return all(map(self._is_never_negative, args[2:]))
        if op == "call" and self.data[node][0] == "sqrt":
            return True
        return op in ("fadd", "fmul") and all(map(self._is_never_negative, args))

    def _is_partial(self, node: int) -> bool:
        """Whether an operation on constants has no value somewhere; where a distance is zero it may have none.

        What is made of parameters alone has a value, or none throughout a run.
        """
        if self.op[node] in ("div", "fdiv"):
            divisor = self.args[node][1]
            return not (self._is_given(divisor) or self._is_never_negative(divisor))
        if self.op[node] != "call" or self._is_given(node):
            return False
        name, base = self.data[node][0], self.args[node][0]
        if name in ("sqrt", "pow") and self._is_never_negative(base):
            return False
        return name in ("tan", "pow") or IN_CODE[name].domain != (-math.inf, math.inf)

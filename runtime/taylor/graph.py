"""Operations on power series in time: what a function's text becomes before its series are computed.

Every operation is one of a few: sums, products, quotients, roots, powers, and integrals. Elementary functions are
integrals of their derivatives (sin u is the integral of cos u · u'), which gives their usual recurrences.
"""

from __future__ import annotations

from symgen.runtime.graph.functions import IN_CODE, slopes
from symgen.runtime.taylor.algebra import Algebra
from symgen.runtime.taylor.refusal import Refusal


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

"""Operations on power series in time: what a function's text becomes before its series are computed.

Every operation is one of a few: sums, products, quotients, roots, powers, and integrals. Elementary functions are
integrals of their derivatives (sin u is the integral of cos u · u'), which gives their usual recurrences.
"""

from __future__ import annotations

from runtime.taylor.algebra import Algebra
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


class SeriesGraph(Algebra):
    """Nodes by number, see `Nodes`; elementary functions are made of what arithmetic offers."""

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
            inner, of_inner = self._as_power(base)
            # What is below a root is positive; (u^2)^0.5 is not u.
            return self.power(base, n) if of_inner == round(of_inner) else self.power(inner, of_inner * n)
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

"""The functions of a generated module on numbers of many digits, and the motion of a scene in them."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

from symgen.runtime import System

DIGITS = 40
PROJECTIONS = 6


def number_field() -> tuple[Callable, Callable, dict[str, Callable]]:
    """Return what makes and what prints high-precision numbers, and the functions that generated text calls."""
    names = "sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt".split()
    try:
        import gmpy2 as numbers

        numbers.get_context().precision = int(DIGITS * 3.33)
        real, text = numbers.mpfr, "{:.23e}".format
    except ImportError:
        from mpmath import mp as numbers

        numbers.dps = DIGITS
        real, text = numbers.mpf, lambda x: numbers.nstr(x, 24)
    functions = {name: getattr(numbers, name) for name in names}
    functions |= {
        "fabs": abs,
        "pow": lambda x, y: x**y,
        "copysign": lambda x, s: abs(x) if s >= 0 else -abs(x),
    }
    return real, text, functions


REAL, TEXT, FUNCTIONS = number_field()


def high_precision(module_text: str) -> dict[str, Callable]:
    """Return the functions of a module on high-precision numbers: `f(t, y, p, out)`."""
    namespace = dict(FUNCTIONS)
    exec(re.sub(r"^(@njit|from math|from numba).*\n", "", module_text, flags=re.MULTILINE), namespace)
    return namespace


class Motion:
    """The equations of motion of a scene on object arrays."""

    def __init__(self, system: System, module_text: str, p: np.ndarray):
        self.system = system
        self._functions = high_precision(module_text)
        self.p = [REAL(float(x)) for x in p]
        self.n = system.nq + system.nv
        self.calls = 0

    def derivative(self, t, y: np.ndarray) -> np.ndarray:
        """Return dy/dt, y = (q, v)."""
        out = [REAL(0)] * self.system.n_row
        self._functions["rhs"](t, [*y, REAL(0)], self.p, out)
        self.calls += 1
        return np.array(out[: self.n], dtype=object)

    def multipliers(self, t, y: np.ndarray) -> np.ndarray:
        """Return the multipliers, shape (m,)."""
        out = [REAL(0)] * self.system.n_row
        self._functions["rhs"](t, [*y, REAL(0)], self.p, out)
        return np.array(out[self.system.ny : self.system.ny + self.system.m], dtype=object)

    def projected(self, y: np.ndarray) -> np.ndarray:
        """Return the consistent state nearest to y."""
        if not self.system.has("project"):
            return y
        for _ in range(PROJECTIONS):
            out = [REAL(0)] * (self.n + self.system.nh + self.system.m)
            self._functions["project"](REAL(0), list(y), self.p, out)
            y = np.array(out[: self.n], dtype=object)
        return y

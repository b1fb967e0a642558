"""Test support: random expressions as recipes that build on a `Graph` and evaluate with numbers alike."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from types import SimpleNamespace

from hypothesis import reject
from hypothesis import strategies as st

from symgen.derive.graph.graph import Graph
from symgen.derive.graph.nodes import PARAM, FoldingError, Q, V
from symgen.runtime.graph.functions import IN_CODE

VARIABLES = ((Q, 0), (Q, 1), (V, 0), (V, 1), (PARAM, 0))
CONSTANTS = (-2.0, 0.5, 3.0)
EXPONENTS = (-2.5, -2.0, -1.0, -0.5, 0.0, 0.3, 0.5, 1.0, 1.5, 2.0, 3.0, 7.0)
UNARY = [name for name, function in IN_CODE.items() if function.arity == (1, 1)]
OFFSET = 0.1378  # keeps the kinks of select, abs, min and max away from ties, which rounding would decide


class Direct:
    """The graph's constructors as plain arithmetic on numbers of any kind; `lib` has the functions."""

    def __init__(self, lib) -> None:
        self.lib = lib

    def const(self, value):
        return value

    def add(self, a, b):
        return a + b

    def sub(self, a, b):
        return a - b

    def mul(self, a, b):
        return a * b

    def div(self, a, b):
        return a / b

    def neg(self, a):
        return -a

    def power(self, a, exponent):
        return self.lib.pow(a, exponent)

    def pow(self, a, b):
        return self.lib.pow(a, b)

    def call(self, name, *args):
        return getattr(self.lib, name)(*args)

    def select(self, a, b, then, otherwise):
        return then if real(a) < real(b) else otherwise

    def minimum(self, a, b):
        return b if real(b) < real(a) else a

    def maximum(self, a, b):
        return b if real(a) < real(b) else a

    def sign(self, a):
        return math.copysign(1.0, real(a)) if real(a) else 0.0


def real(x) -> float:
    return x.real if isinstance(x, complex) else x


def _complex_pow(a, b):
    if b == 0:
        return 1.0
    return a**b if isinstance(b, complex) or real(a) <= 0 else cmath.exp(b * cmath.log(a))


def _complex_atan2(y, x):
    """Real angle plus first-order imaginary part, which is what the complex step needs."""
    a, b = complex(y), complex(x)
    return complex(math.atan2(a.real, b.real), (b.real * a.imag - a.real * b.imag) / (a.real**2 + b.real**2))


def _complex_acos(z):
    """`cmath.acos` cancels tiny imaginary parts."""
    z = complex(z)
    return complex(math.acos(z.real), -z.imag / math.sqrt(1.0 - z.real**2))


def _complex_asin(z):
    z = complex(z)
    return complex(math.asin(z.real), z.imag / math.sqrt(1.0 - z.real**2))


def _complex_erf(z):
    z = complex(z)
    return complex(math.erf(z.real), 2.0 / math.sqrt(math.pi) * math.exp(-(z.real**2)) * z.imag)


# Functions of complex numbers for the complex step: f'(x) = Im f(x + ih) / h.
COMPLEX = SimpleNamespace(
    **{name: getattr(cmath, name) for name in UNARY if hasattr(cmath, name) and name not in ("asin", "acos")},
    asin=_complex_asin,
    acos=_complex_acos,
    fabs=lambda z: -z if real(z) < 0 else z,
    erf=_complex_erf,
    pow=_complex_pow,
    atan2=_complex_atan2,
)
STEP = 1e-30


def _one_plus_square(a, x):
    return a.add(a.const(1.0), a.mul(x, x))


# Every operation of the graph, kept inside its domain so that few random recipes are thrown away.
OPERATIONS: dict[str, Callable] = {
    "add": lambda a, x, y, *_: a.add(x, y),
    "sub": lambda a, x, y, *_: a.sub(x, y),
    "mul": lambda a, x, y, *_: a.mul(x, y),
    "square": lambda a, x, *_: a.mul(x, x),
    "neg": lambda a, x, *_: a.neg(x),
    "div": lambda a, x, y, *_: a.div(x, _one_plus_square(a, y)),
    "inverse": lambda a, x, *_: a.div(a.const(-3.0), a.neg(_one_plus_square(a, x))),
    "pow": lambda a, x, y, *_: a.pow(_one_plus_square(a, x), a.call("sin", y)),
    "atan2": lambda a, x, y, *_: a.call("atan2", x, a.add(y, a.const(OFFSET))),
    "atan2_neg": lambda a, x, y, *_: a.call("atan2", a.neg(_one_plus_square(a, x)), y),
    "select": lambda a, x, y, z, w: a.select(x, a.add(y, a.const(OFFSET)), z, w),
    "minimum": lambda a, x, y, *_: a.minimum(x, a.add(y, a.const(OFFSET))),
    "maximum": lambda a, x, y, *_: a.maximum(a.sub(x, a.const(OFFSET)), y),
    "sign": lambda a, x, *_: a.sign(a.add(x, a.const(OFFSET))),
    "fabs": lambda a, x, *_: a.call("fabs", a.add(x, a.const(OFFSET))),
    "sqrt": lambda a, x, *_: a.call("sqrt", _one_plus_square(a, x)),
    "log": lambda a, x, *_: a.call("log", _one_plus_square(a, x)),
    "circle": lambda a, x, y, *_: a.add(
        a.mul(y, a.mul(a.call("sin", x), a.call("sin", x))),
        a.mul(y, a.mul(a.call("cos", x), a.call("cos", x))),
    ),
    **{
        name: lambda a, x, *_, name=name: a.call(name, a.div(x, _one_plus_square(a, x)))
        for name in ("asin", "acos", "tan", "exp", "sinh", "cosh")
    },
    **{name: lambda a, x, *_, name=name: a.call(name, x) for name in ("sin", "cos", "atan", "tanh", "erf")},
    **{f"power{e}": lambda a, x, *_, e=e: a.power(_one_plus_square(a, x), e) for e in EXPONENTS},
}

recipes = st.lists(
    st.tuples(st.sampled_from(sorted(OPERATIONS)), *[st.integers(0, 7)] * 4), min_size=1, max_size=12
)
points = st.lists(
    st.floats(-2.0, 2.0).filter(lambda x: abs(x) > 1e-3), min_size=len(VARIABLES), max_size=len(VARIABLES)
)


def follow(recipe, algebra, variables: list) -> list:
    """All intermediate values of a recipe in an algebra (a `Graph` or `Direct`)."""
    values = [*variables, *(algebra.const(c) for c in CONSTANTS)]
    for operation, *picks in recipe:
        operands = [values[-1 - (k % len(values))] for k in picks]
        try:
            values.append(OPERATIONS[operation](algebra, *operands))
        except (FoldingError, OverflowError):  # a tower of squares
            reject()
    return values


def on_graph(recipe) -> tuple[Graph, list[int], list[int]]:
    """Graph, variables and all intermediate nodes of a recipe."""
    g = Graph()
    variables = [g.var(*v) for v in VARIABLES]
    return g, variables, follow(recipe, g, variables)


def evaluate(g: Graph, outputs: list[int], values: dict[int, complex], lib=math) -> list:
    """Values of nodes, operation by operation."""
    direct = Direct(lib)
    result = dict(values)
    for node in g.reachable(outputs):
        if node in result:
            continue
        op, args = g.op[node], g.args[node]
        if op == "const":
            result[node] = args[0]
        elif op in IN_CODE:
            result[node] = direct.call(op, *(result[x] for x in args))
        else:
            result[node] = getattr(direct, op)(*(result[x] for x in args))
    return [result[n] for n in outputs]

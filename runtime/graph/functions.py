"""Elementary functions: all that the program knows of each, in one entry.

The parser of model files, the operation graph and its derivatives, printing, machine code, power series and dual
numbers read this table. A derivative is written once, over any arithmetic: nodes of a graph give its expression,
power series its recurrence (a function is the integral of its derivative times that of its argument), plain numbers
its value. A new function is one more entry, and a row in docs/reference.md; `tests/test_functions.py` holds every
entry to its value, its derivative, its series and its machine code. Conditions of `where` have a table of their own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol


class Arithmetic(Protocol):
    """What derivatives are written in; the values are the arithmetic's own: nodes, series, numbers."""

    def const(self, value: float) -> Any: ...
    def neg(self, a: Any) -> Any: ...
    def add(self, a: Any, b: Any) -> Any: ...
    def sub(self, a: Any, b: Any) -> Any: ...
    def mul(self, a: Any, b: Any) -> Any: ...
    def sign(self, a: Any) -> Any: ...
    def call(self, name: str, *args: Any) -> Any:
        """The function of this name in generated code."""


# A derivative as numerator and denominator (None: 1), so that series need no more quotients than there are.
Slope = tuple[Any, Any | None]


@dataclass(frozen=True)
class Function:
    """An elementary function.

    Attributes
    ----------
    name : str
        In model files; empty for those that only generated code uses.
    value : callable
        Of numbers; raises ValueError or OverflowError where there is none.
    code : str
        Its name in generated modules, which is that in `math`, else in NumPy; empty for one that is written as choices.
    slopes : callable or None
        `slopes(arithmetic, arguments, value)`: the derivative by each argument.
    build : callable or None
        `build(graph, *nodes)`: the choices that it is written as.
    sympy : str
        The class of SymPy that stands for it; empty where SymPy has none, or evaluates it in ways that models
        cannot have.
    numpy : str
        Its name in NumPy; empty where there is none.
    llvm : str
        "intrinsic", or "library": a function of the C library.
    arity : tuple
        Fewest and most arguments; None: any number.
    parity : str
        "odd", "even", or neither.
    smooth : bool
        Whether it has a power series at every point inside its domain.
    stepped : bool
        Whether it is constant between its jumps.
    dimension : str
        "pure": takes a pure number or an angle and gives one; "kept": gives the dimension that it takes;
        "compared": its arguments must have one dimension, which it gives; "ratio": they must, and it gives a
        pure number; "any": takes any, gives a pure number; "chosen": all but the first, a condition, must have one
        dimension, which it gives.
    domain : tuple of float
        Bounds of its arguments.
    system : tuple of str
        The functions, itself among them, that solve a system of differential equations with it: sine and cosine are
        each other's derivatives. Empty where the derivative is made of other functions.
    """

    name: str
    value: Callable[..., float]
    code: str = ""
    slopes: Callable[[Arithmetic, Sequence[Any], Any], Sequence[Slope]] | None = None
    build: Callable[..., Any] | None = None
    sympy: str = ""
    numpy: str = ""
    llvm: str = ""
    arity: tuple[int, int | None] = (1, 1)
    parity: str = ""
    smooth: bool = True
    stepped: bool = False
    dimension: str = "pure"
    domain: tuple[float, float] = (-math.inf, math.inf)
    system: tuple[str, ...] = ()


def _one_minus_square(a: Arithmetic, x: Any) -> Any:
    return a.sub(a.const(1.0), a.mul(x, x))


def _one_plus_square(a: Arithmetic, x: Any) -> Any:
    return a.add(a.const(1.0), a.mul(x, x))


def _of_atan2(a: Arithmetic, args: Sequence[Any], _: Any) -> Sequence[Slope]:
    y, x = args
    square = a.add(a.mul(x, x), a.mul(y, y))
    return (x, square), (a.neg(y), square)


def _of_power(a: Arithmetic, args: Sequence[Any], value: Any) -> Sequence[Slope]:
    base, exponent = args
    by_base = a.mul(exponent, a.call("pow", base, a.sub(exponent, a.const(1.0))))
    return (by_base, None), (a.mul(value, a.call("log", base)), None)


def _of_erf(a: Arithmetic, args: Sequence[Any], _: Any) -> Sequence[Slope]:
    (x,) = args
    bell = a.call("exp", a.neg(a.mul(x, x)))
    return ((a.mul(a.const(2.0 / math.sqrt(math.pi)), bell), None),)


def sign(x: float) -> float:
    """-1, 0 or 1."""
    return math.copysign(1.0, x) if x else 0.0


def floor(x: float) -> float:
    """The largest whole number that is not above `x`, as NumPy has it.

    `math.floor` gives an integer, which Numba lets overflow, and has no value where NaN is one.
    """
    return x if math.isinf(x) else x // 1.0


def heaviside(x: float) -> float:
    """0 below zero, 1 above, 1/2 at zero: as SymPy has it, and as `sign` has 0 there."""
    return 0.5 + 0.5 * sign(x)


ENTRIES = (
    Function(
        "sin", math.sin, "sin", lambda a, x, y: ((a.call("cos", *x), None),),
        sympy="sin", numpy="sin", system=("sin", "cos"), llvm="intrinsic", parity="odd",
    ),
    Function(
        "cos", math.cos, "cos", lambda a, x, y: ((a.neg(a.call("sin", *x)), None),),
        sympy="cos", numpy="cos", system=("sin", "cos"), llvm="intrinsic", parity="even",
    ),
    Function(
        "tan", math.tan, "tan", lambda a, x, y: ((_one_plus_square(a, y), None),),
        sympy="tan", numpy="tan", system=("tan",), llvm="library", parity="odd",
    ),
    Function(
        "asin", math.asin, "asin",
        lambda a, x, y: ((a.const(1.0), a.call("sqrt", _one_minus_square(a, *x))),),
        sympy="asin", numpy="arcsin", llvm="library", parity="odd", domain=(-1.0, 1.0),
    ),
    Function(
        "acos", math.acos, "acos",
        lambda a, x, y: ((a.const(-1.0), a.call("sqrt", _one_minus_square(a, *x))),),
        sympy="acos", numpy="arccos", llvm="library", domain=(-1.0, 1.0),
    ),
    Function(
        "atan", math.atan, "atan", lambda a, x, y: ((a.const(1.0), _one_plus_square(a, *x)),),
        sympy="atan", numpy="arctan", llvm="library", parity="odd",
    ),
    Function(
        "sinh", math.sinh, "sinh", lambda a, x, y: ((a.call("cosh", *x), None),),
        sympy="sinh", numpy="sinh", system=("sinh", "cosh"), llvm="library", parity="odd",
    ),
    Function(
        "cosh", math.cosh, "cosh", lambda a, x, y: ((a.call("sinh", *x), None),),
        sympy="cosh", numpy="cosh", system=("sinh", "cosh"), llvm="library", parity="even",
    ),
    Function(
        "tanh", math.tanh, "tanh", lambda a, x, y: ((_one_minus_square(a, y), None),),
        sympy="tanh", numpy="tanh", system=("tanh",), llvm="library", parity="odd",
    ),
    Function(
        "exp", math.exp, "exp", lambda a, x, y: ((y, None),),
        sympy="exp", numpy="exp", system=("exp",), llvm="intrinsic",
    ),
    Function(
        "log", math.log, "log", lambda a, x, y: ((a.const(1.0), x[0]),),
        sympy="log", numpy="log", llvm="intrinsic", domain=(0.0, math.inf),
    ),
    # In SymPy a power of 1/2.
    Function(
        "sqrt", math.sqrt, "sqrt", lambda a, x, y: ((a.const(0.5), y),),
        numpy="sqrt", llvm="intrinsic", domain=(0.0, math.inf),
    ),
    Function("erf", math.erf, "erf", _of_erf, sympy="erf", llvm="library", parity="odd"),
    Function(
        "atan2", math.atan2, "atan2", _of_atan2,
        sympy="atan2", numpy="arctan2", llvm="library", arity=(2, 2), dimension="ratio",
    ),
    Function(
        "abs", math.fabs, "fabs", lambda a, x, y: ((a.sign(*x), None),),
        sympy="Abs", numpy="fabs", llvm="intrinsic", parity="even", smooth=False, dimension="kept",
    ),
    Function(
        "sign", sign, build=lambda g, x: g.defined((x,), g.sign(x)),
        sympy="sign", numpy="sign", parity="odd", smooth=False, dimension="any",
    ),
    Function(
        "min", min, build=lambda g, x, y: g.defined((x, y), g.minimum(x, y)),
        numpy="minimum", arity=(2, None), smooth=False, dimension="compared",
    ),
    Function(
        "max", max, build=lambda g, x, y: g.defined((x, y), g.maximum(x, y)),
        numpy="maximum", arity=(2, None), smooth=False, dimension="compared",
    ),
    Function(
        "floor", floor, "floor", lambda a, x, y: ((a.const(0.0), None),),
        sympy="floor", numpy="floor", llvm="intrinsic", smooth=False, stepped=True,
    ),
    Function(
        "heaviside", heaviside, build=lambda g, x: g.defined((x,), g.heaviside(x)), smooth=False, dimension="any",
    ),
    Function(
        "where", lambda condition, x, y: x if condition else y,
        build=lambda g, condition, x, y: g.choose(condition, x, y),
        arity=(3, 3), smooth=False, dimension="chosen",
    ),
    Function("", math.pow, "pow", _of_power, numpy="power", llvm="intrinsic", arity=(2, 2)),
    Function("", math.copysign, "copysign", numpy="copysign", llvm="intrinsic", arity=(2, 2), smooth=False),
)  # fmt: skip

# What conditions are made of, by their signs in model files: 1 where they hold, 0 elsewhere. On a graph they are
# choices between 1 and 0, and `where` puts what is chosen in the place of these.
CONDITIONS = {
    entry.name: entry
    for entry in (
        Function(
            "<", lambda x, y: float(x < y), build=lambda g, x, y: g.less(x, y),
            arity=(2, 2), smooth=False, dimension="ratio",
        ),
        Function(
            "<=", lambda x, y: float(x <= y), build=lambda g, x, y: g.choose(g.less(y, x), g.zero, g.one),
            arity=(2, 2), smooth=False, dimension="ratio",
        ),
        Function(
            "and", lambda x, y: float(x and y), build=lambda g, x, y: g.choose(x, y, g.zero),
            arity=(2, 2), smooth=False, dimension="any",
        ),
        Function(
            "or", lambda x, y: float(x or y), build=lambda g, x, y: g.choose(x, g.one, y),
            arity=(2, 2), smooth=False, dimension="any",
        ),
        Function(
            "not", lambda x: float(not x), build=lambda g, x: g.choose(x, g.zero, g.one), smooth=False,
            dimension="any",
        ),
    )
}  # fmt: skip

IN_MODELS = {entry.name: entry for entry in ENTRIES if entry.name}  # by what model files call them
IN_CODE = {entry.code: entry for entry in ENTRIES if entry.code}  # by what generated modules call them


def slopes(arithmetic: Arithmetic, code: str, args: Sequence[Any], value: Any) -> Sequence[Slope]:
    """Return the derivative of a function by each of its arguments, as numerators and denominators.

    Parameters
    ----------
    arithmetic : Arithmetic
    code : str
        The function's name in generated modules.
    args : sequence
        Its arguments, as values of that arithmetic.
    value : object
        What the function is of them.

    Raises
    ------
    LookupError
        There is no such function, or it has no derivative.
    """
    entry = IN_CODE.get(code)
    if entry is None or entry.slopes is None:
        raise LookupError(f"the function {code!r} has no derivative in runtime/graph/functions.py")
    return entry.slopes(arithmetic, args, value)

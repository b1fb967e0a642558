"""Exact derivatives of a model's functions: their forms, carried out on numbers that carry their derivatives.

Forward mode: Griewank, Walther, Evaluating Derivatives, 2nd ed. (2008), chapter 3.
"""

from __future__ import annotations

import math
import operator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.code import dense_ldl, front_ldl
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.graph.carry_out import carry_out
from symgen.runtime.graph.functions import IN_CODE, sign, slopes

if TYPE_CHECKING:
    from collections.abc import Callable

    from symgen.runtime.graph.form import Form
    from symgen.runtime.system import System


class Dual:
    """A number and its derivatives along some directions."""

    __slots__ = ("slope", "value")

    def __init__(self, value: float, slope: np.ndarray):
        self.value, self.slope = value, slope

    def __add__(self, other: Number) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value + other.value, self.slope + other.slope)
        return Dual(self.value + other, self.slope)

    __radd__ = __add__

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)

    def __sub__(self, other: Number) -> Dual:
        return self + (-other)

    def __rsub__(self, other: float) -> Dual:
        return Dual(other - self.value, -self.slope)

    def __mul__(self, other: Number) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value * other.value, _share(other, self.slope) + _share(self, other.slope))
        return Dual(self.value * other, _share(other, self.slope))

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> Dual:
        if isinstance(other, Dual):
            value = self.value / other.value
            return Dual(value, (self.slope - value * other.slope) / other.value)
        return Dual(self.value / other, self.slope / other)

    def __rtruediv__(self, other: float) -> Dual:
        value = other / self.value
        return Dual(value, -value / self.value * self.slope)

    def __lt__(self, other: Number) -> bool:
        return self.value < _value(other)

    def __le__(self, other: Number) -> bool:
        return self.value <= _value(other)

    def __gt__(self, other: Number) -> bool:
        return self.value > _value(other)

    def __ge__(self, other: Number) -> bool:
        return self.value >= _value(other)


Number = Dual | float


def _share(factor: Number, slope: np.ndarray) -> np.ndarray:
    """Return a factor times the slope of the other one: 0 where the factor is 0 and differentiable.

    The slope may be infinite, that of a root at 0; the product x sqrt(x) has one all the same.
    """
    value = _value(factor)
    if value == 0.0 and not (isinstance(factor, Dual) and np.isinf(factor.slope).any()):
        return np.zeros_like(slope)
    return slope * value


def derivatives(
    system: System,
    function: str,
    t: float,
    y: np.ndarray,
    p: np.ndarray,
    along_y: np.ndarray,
    along_p: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return a function of the model and its derivatives along directions, exact but for round-off.

    Parameters
    ----------
    function : str
        See docs/abi.md.
    t : float [s]
    y, p : ndarray
        Where to evaluate it.
    along_y, along_p : ndarray, shape (len(y), k) and (len(p), k)
        The directions.

    Returns
    -------
    values : ndarray, shape (n,)
    slopes : ndarray, shape (n, k)

    Raises
    ------
    RuntimeModelError
        It has no value or no derivative there.
    """
    form = system.form(function)
    with np.errstate(all="ignore"):
        try:
            out = carried_out(form, float(t), _seeded(y, along_y), _seeded(p, along_p))
        except (ArithmeticError, ValueError):
            out = [math.nan]
    values = np.array([_value(x) for x in out])
    none = np.zeros(along_y.shape[1])
    slopes = np.array([x.slope if isinstance(x, Dual) else none for x in out]).reshape(len(out), len(none))
    if not (np.isfinite(values).all() and np.isfinite(slopes).all()):
        raise RuntimeModelError(
            f"the function {function!r} of model {system.name!r} has no finite value or derivative at this state: "
            "choose another start, or another state to linearise about"
        )
    return values, slopes


def carried_out(form: Form, t: float, y: list[Number], p: list[Number]) -> list[Number]:
    """Return what a function writes for numbers of either kind."""
    out: list[Number] = [0.0] * form.lengths.out
    for place, value in carry_out(form, _Duals(t), y.__getitem__, p.__getitem__, solvers=_SOLVERS):
        out[place] = value
    return out


def _seeded(values: np.ndarray, along: np.ndarray) -> list[Number]:
    """Plain numbers stay plain where nothing moves them: work on these costs little."""
    return [Dual(x, row) if row.any() else x for x, row in zip(values.tolist(), along)]


def _value(x: Number) -> float:
    return x.value if isinstance(x, Dual) else x


class _Numbers:
    """The arithmetic of plain numbers, for derivatives of the table."""

    const = staticmethod(float)
    neg = staticmethod(operator.neg)
    add = staticmethod(operator.add)
    sub = staticmethod(operator.sub)
    mul = staticmethod(operator.mul)
    sign = staticmethod(sign)

    @staticmethod
    def call(name: str, *args: float) -> float:
        return IN_CODE[name].value(*args)


def _lifted(name: str) -> Callable[..., Number]:
    """Return a function of the table for both kinds of numbers."""
    function = IN_CODE[name].value

    def lifted(*args: Number) -> Number:
        values = [_value(x) for x in args]
        value = function(*values)
        found: Number = value
        if any(isinstance(x, Dual) and x.slope.any() for x in args):
            for x, (above, below) in zip(args, slopes(_Numbers, name, values, value), strict=True):
                if isinstance(x, Dual):
                    found = found + Dual(0.0, (above if below is None else above / below) * x.slope)
            return found
        return next((Dual(value, x.slope) for x in args if isinstance(x, Dual)), value)

    return lifted


class _RootOfZero(Dual):
    """A root at 0: its slope is infinite along what moves what is below it, that of its square is not."""

    __slots__ = ("below",)

    def __init__(self, below: np.ndarray):
        super().__init__(0.0, _infinite(below))
        self.below = below

    def __mul__(self, other: Number) -> Dual:
        return Dual(0.0, self.below) if other is self else super().__mul__(other)


def _infinite(along: np.ndarray) -> np.ndarray:
    return np.where(along == 0.0, 0.0, math.inf)


def _sqrt(x: Number) -> Number:
    return _RootOfZero(x.slope) if isinstance(x, Dual) and x.value == 0.0 else _smooth_sqrt(x)


def _pow(base: Number, exponent: Number) -> Number:
    x, n = _value(base), _value(exponent)
    value = math.pow(x, n)
    result: Number = value
    if isinstance(base, Dual):
        if x == 0.0 and 0.0 < n < 1.0:
            result = Dual(value, _infinite(base.slope))
        else:
            result = Dual(value, (n * math.pow(x, n - 1.0) if n else 0.0) * base.slope)
    if isinstance(exponent, Dual):
        result = result + Dual(0.0, (value * math.log(x) if value else 0.0) * exponent.slope)
    return result


def _copysign(size: Number, sign: Number) -> Number:
    value = math.copysign(_value(size), _value(sign))
    if not isinstance(size, Dual):
        return value
    return Dual(
        value, size.slope if math.copysign(1.0, size.value) == math.copysign(1.0, value) else -size.slope
    )


class _Duals:
    """The operations of a form on numbers of both kinds."""

    neg = staticmethod(operator.neg)
    add = staticmethod(operator.add)
    sub = staticmethod(operator.sub)
    mul = staticmethod(operator.mul)
    div = staticmethod(operator.truediv)

    def __init__(self, t: float):
        self.time = lambda: t

    @staticmethod
    def call(name: str, *args: Number) -> Number:
        return _MATHEMATICS[name](*args)

    @staticmethod
    def decide(is_strict: bool, a: Number, b: Number) -> bool:
        return a < b if is_strict else a <= b


# Roots and powers at 0, and `copysign` of a sign that stays, have derivatives where those of the table have none.
_smooth_sqrt = _lifted("sqrt")
_MATHEMATICS = {name: _lifted(name) for name in IN_CODE} | {"pow": _pow, "sqrt": _sqrt, "copysign": _copysign}
_SOLVERS = {name: getattr(solvers, name) for solvers in (dense_ldl, front_ldl) for name in solvers.SOLVERS}

"""Arithmetic on functions of time over many cells of time at once: what they can be there, and how fast they change.

Interval arithmetic (Moore, Kearfott, Cloud, Introduction to Interval Analysis, 2009): ranges of a function and of its
derivative hold for every time in a cell, so that nothing between samples is missed, however narrow it is. They hold
for exact numbers: ends are rounded outward, and a value in the middle has a bound on what rounding did to it.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from symgen.runtime.graph.functions import IN_CODE, Function

NEGLIGIBLE = 1e-13  # of the range over all times: what changes by less does not count
_EVEN = 4.0  # an oscillation whose rates differ by less than this over a cell is one
_OF_EXP = 1.0  # the height of a pulse exp(-u) whose u is not seen to be positive
_NONE, _ONE, _MANY = 0, 1, 2
_ROUNDED = (
    4.0 * np.finfo(float).eps
)  # of a result: more than operations and functions of the C library are off by
_LEAST = 5e-324
INFINITE = math.inf


@dataclass(frozen=True, eq=False)
class Range:
    """A function of time over cells.

    Attributes
    ----------
    low, high : ndarray
        It lies between them in all of the cell.
    slow, fast : ndarray
        Its derivative lies between them [1/s], but where it jumps.
    middle : ndarray
        Its value in the middle of the cell.
    scale : ndarray
        It takes at least so long to change [s], and a steady oscillation is left to `period`.
    period : ndarray
        The time of a radian [s] of oscillations that go on all through the cell.
    blur : ndarray
        At most so far is the value in the middle from the exact one.
    breaks : ndarray of int
        Where it jumps or has a kink: nowhere in the cell, once at most, or perhaps more often.
    """

    low: np.ndarray
    high: np.ndarray
    slow: np.ndarray
    fast: np.ndarray
    middle: np.ndarray
    scale: np.ndarray
    period: np.ndarray
    breaks: np.ndarray
    blur: np.ndarray


Number = Range | float


@dataclass
class Intervals:
    """The operations of a function's text, on ranges over cells.

    Attributes
    ----------
    begin, end : ndarray
        Of each cell [s].
    widths : list of float
        The width of the range of each result over all times, in the order in which they are made; empty while these
        are found (the cell is then all of time), and filled by it. Without them all that changes counts.
    finding : bool
        Whether `widths` are being found.
    """

    begin: np.ndarray
    end: np.ndarray
    widths: list[float]
    finding: bool = False
    _made: int = field(default=0)
    _half: np.ndarray | None = field(default=None)

    def time(self) -> Range:
        """Time itself."""
        n = len(self.begin)
        one, never = np.ones(n), np.full(n, INFINITE)
        none = np.zeros(n)
        return Range(
            self.begin, self.end, one, one, self._centre(), never, never, np.zeros(n, dtype=np.int8), none
        )

    def call(self, name: str, *args: Number) -> Number:
        """A mathematical function."""
        if not any(isinstance(x, Range) for x in args):
            return _of_numbers(name, *args)
        known = getattr(self, f"_{name}", None)
        return known(*args) if known is not None else self._of_table(name, *map(self._lifted, args))

    def const(self, value: float) -> float:
        return value

    def sign(self, x: Number) -> Number:
        return self.select(True, x, 0.0, -1.0, self.select(True, 0.0, x, 1.0, 0.0))

    def neg(self, x: Number) -> Number:
        if not isinstance(x, Range):
            return -x
        return Range(-x.high, -x.low, -x.fast, -x.slow, -x.middle, x.scale, x.period, x.breaks, x.blur)

    def add(self, x: Number, y: Number) -> Number:
        if not isinstance(x, Range):
            return x + y if not isinstance(y, Range) else self._shifted(y, x)
        if not isinstance(y, Range):
            return self._shifted(x, y)
        return self._done(
            (x.low + y.low, x.high + y.high), _outward(x.slow + y.slow, x.fast + y.fast), x.middle + y.middle, (x, y),
            blur=x.blur + y.blur,
        )  # fmt: skip

    def sub(self, x: Number, y: Number) -> Number:
        return self.add(x, self.neg(y))

    def mul(self, x: Number, y: Number) -> Number:
        if not isinstance(x, Range):
            return x * y if not isinstance(y, Range) else self._scaled(y, x)
        if not isinstance(y, Range):
            return self._scaled(x, y)
        values = _square(x.low, x.high) if x is y else _times((x.low, x.high), (y.low, y.high))
        first = _times((x.low, x.high), (y.slow, y.fast))
        second = first if x is y else _times((y.low, y.high), (x.slow, x.fast))
        slopes = _outward(first[0] + second[0], first[1] + second[1])
        size_x, size_y = np.abs(x.middle), np.abs(y.middle)
        blur = x.blur * (size_y + y.blur) + y.blur * size_x
        return self._done(values, slopes, x.middle * y.middle, (x, y), blur=blur)

    def div(self, x: Number, y: Number) -> Number:
        if not isinstance(y, Range):
            return x / y if not isinstance(x, Range) else self._scaled(x, 1.0 / y if y else math.nan)
        return self.mul(x, self._reciprocal(y))

    def select(self, is_strict: bool, a: Number, b: Number, then: Number, otherwise: Number) -> Number:
        """`then` where a < b (or a <= b), else `otherwise`."""
        d = self.sub(a, b)
        if not isinstance(d, Range):
            return then if (d < 0.0 if is_strict else d <= 0.0) else otherwise
        yes = d.high < 0.0 if is_strict else d.high <= 0.0
        no = d.low >= 0.0 if is_strict else d.low > 0.0
        x, y = self._lifted(then), self._lifted(otherwise)

        def chosen(of_x: np.ndarray, of_y: np.ndarray, both: np.ndarray) -> np.ndarray:
            return np.where(yes, of_x, np.where(no, of_y, both))

        values = (
            chosen(x.low, y.low, np.minimum(x.low, y.low)),
            chosen(x.high, y.high, np.maximum(x.high, y.high)),
        )
        slopes = (
            chosen(x.slow, y.slow, np.minimum(x.slow, y.slow)),
            chosen(x.fast, y.fast, np.maximum(x.fast, y.fast)),
        )
        scale = chosen(x.scale, y.scale, np.minimum(x.scale, y.scale))
        period = chosen(x.period, y.period, np.minimum(x.period, y.period))
        crossing = np.maximum(np.where(_is_monotone(d), _ONE, _MANY), d.breaks)
        breaks = chosen(x.breaks, y.breaks, np.maximum(np.maximum(x.breaks, y.breaks), crossing))
        middle = np.where(d.middle < 0.0 if is_strict else d.middle <= 0.0, x.middle, y.middle)
        return self._made_of(values, slopes, middle, scale, period, breaks, np.maximum(x.blur, y.blur))

    # Functions of which more is known than the table says: periods, distances that scale them, poles, powers.

    def _sin(self, u: Range) -> Range:
        return self._wave(u, 0)

    def _cos(self, u: Range) -> Range:
        return self._wave(u, 1)

    def _wave(self, u: Range, quarter: int) -> Range:
        values, rates = _sine(u.low, u.high, quarter), _sine(u.low, u.high, quarter + 1)
        slopes = _times(rates, (u.slow, u.fast))
        fastest, slowest = _largest(u.slow, u.fast), _least(u.slow, u.fast)
        own = _over(1.0, fastest)
        steady = _EVEN * slowest >= fastest
        return self._done(
            values, slopes, (np.sin, np.cos)[quarter](u.middle), (u,), blur=u.blur,
            scale=np.where(steady, INFINITE, own), period=np.where(steady, own, INFINITE),
        )  # fmt: skip

    def _tan(self, u: Range) -> Range:
        a, b = u.low / math.pi, u.high / math.pi
        turns = np.floor(a + 0.5 - _ROUNDED * (1.0 + np.abs(a))) != np.floor(
            b + 0.5 + _ROUNDED * (1.0 + np.abs(b))
        )
        values = np.where(turns, -INFINITE, np.tan(u.low)), np.where(turns, INFINITE, np.tan(u.high))
        square = _square(*_outward(*values))
        slopes = _times((1.0 + square[0], 1.0 + square[1]), (u.slow, u.fast))
        own = _over(1.0, (1.0 + square[1]) * _largest(u.slow, u.fast))
        return self._done(
            values, slopes, np.tan(u.middle), (u,), scale=own, breaks=np.where(turns, _MANY, _NONE),
            blur=_blurred(1.0 + square[1], u),
        )  # fmt: skip

    def _atan(self, u: Range) -> Range:
        square = _square(u.low, u.high)
        slopes = _times((1.0 / (1.0 + square[1]), 1.0 / (1.0 + square[0])), (u.slow, u.fast))
        # Far from its step, whose ends fade as powers do, distances are the scale.
        own = _over(np.maximum(1.0, _least(u.low, u.high)), _largest(u.slow, u.fast))
        return self._done(
            (np.arctan(u.low), np.arctan(u.high)), slopes, np.arctan(u.middle), (u,), scale=own, blur=u.blur
        )

    def _cosh(self, u: Range) -> Range:
        """By its ends: the slope of sinh, which is found by it."""
        around = (u.low <= 0.0) & (u.high >= 0.0)
        ends = np.cosh(u.low), np.cosh(u.high)
        rates = _outward(np.sinh(u.low), np.sinh(u.high))
        slopes = _times(rates, (u.slow, u.fast))
        return self._done(
            (np.where(around, 1.0, np.minimum(*ends)), np.maximum(*ends)), slopes, np.cosh(u.middle), (u,),
            scale=_over(1.0, _largest(u.slow, u.fast)), blur=_blurred(_largest(*rates), u),
        )  # fmt: skip

    def _atan2(self, y: Number, x: Number) -> Range:
        y, x = self._lifted(y), self._lifted(x)
        radius = self.add(self.mul(y, y), self.mul(x, x))
        turned = self.sub(
            self.mul(
                x, Range(y.slow, y.fast, *_unknown(y), y.middle * 0.0, y.scale, y.period, y.breaks, y.blur)
            ),
            self.mul(
                y, Range(x.slow, x.fast, *_unknown(x), x.middle * 0.0, x.scale, x.period, x.breaks, x.blur)
            ),
        )
        rate = self.div(turned, radius)
        slopes = rate.low, rate.high
        n = len(self.begin)
        cut = np.where((y.low <= 0.0) & (y.high >= 0.0) & (x.low <= 0.0), _MANY, _NONE)
        return self._done(
            (np.full(n, -math.pi), np.full(n, math.pi)), slopes, np.arctan2(y.middle, x.middle), (y, x),
            scale=_over(1.0, _largest(*slopes)), breaks=cut,
            blur=_blurred(_over(1.0, np.sqrt(np.maximum(radius.low, 0.0))), x, y),
        )  # fmt: skip

    def _tanh(self, u: Range) -> Range:
        values = np.tanh(u.low), np.tanh(u.high)
        square = _square(*_outward(*values))
        slopes = _times((1.0 - square[1], 1.0 - square[0]), (u.slow, u.fast))
        own = _over(1.0, _largest(u.slow, u.fast))
        return self._done(values, slopes, np.tanh(u.middle), (u,), scale=own, blur=u.blur)

    def _exp(self, u: Range) -> Range:
        values = _outward(np.exp(u.low), np.maximum(np.exp(u.high), _LEAST))
        own = _over(1.0, _largest(u.slow, u.fast))
        slopes = _times(values, (u.slow, u.fast))
        return self._done(
            values, slopes, np.exp(u.middle), (u,), scale=own, most=_OF_EXP, blur=_blurred(values[1], u)
        )

    def _log(self, u: Range) -> Range:
        low, high = np.maximum(u.low, 0.0), np.maximum(u.high, 0.0)
        slopes = _times((_over(1.0, high), _over(1.0, low)), (u.slow, u.fast))
        return self._done(
            (np.log(low), np.log(high)), slopes, np.log(u.middle), (u,),
            scale=_over(low, _largest(u.slow, u.fast)), breaks=_crossings(u, touching=True),
            blur=_blurred(_over(1.0, low), u),
        )  # fmt: skip

    def _sqrt(self, u: Range) -> Range:
        low, high = np.sqrt(np.maximum(u.low, 0.0)), np.sqrt(np.maximum(u.high, 0.0))
        slopes = _times((_over(0.5, high), _over(0.5, low)), (u.slow, u.fast))
        return self._done(
            (low, high), slopes, np.sqrt(u.middle), (u,),
            scale=_over(np.maximum(u.low, 0.0), _largest(u.slow, u.fast)), breaks=_crossings(u, touching=True),
            blur=_blurred(_over(0.5, low), u),
        )  # fmt: skip

    def _fabs(self, u: Range) -> Range:
        negative, positive = u.high <= 0.0, u.low >= 0.0
        most = np.maximum(-u.low, u.high)
        low = np.where(negative, -u.high, np.where(positive, u.low, 0.0))
        slow = np.where(negative, -u.fast, np.where(positive, u.slow, np.minimum(u.slow, -u.fast)))
        fast = np.where(negative, -u.slow, np.where(positive, u.fast, np.maximum(u.fast, -u.slow)))
        return self._done(
            (low, most),
            (slow, fast),
            np.abs(u.middle),
            (u,),
            breaks=_crossings(u, touching=False),
            blur=u.blur,
        )

    def _floor(self, u: Range) -> Range:
        low, high, none = np.floor(u.low), np.floor(u.high), np.zeros(len(self.begin))
        once = _is_monotone(u) & (high - low == 1.0)
        breaks = np.where(low == high, _NONE, np.where(once, _ONE, _MANY))
        return self._done((low, high), (none, none), np.floor(u.middle), (u,), breaks=breaks)

    def _pow(self, x: Number, y: Number) -> Number:
        if not isinstance(y, Range) and y == round(y) and abs(y) <= 1e3:
            square: Number = 1.0
            for _ in range(int(abs(y))):
                square = self.mul(square, x)
            return square if y >= 0.0 else self.div(1.0, square)
        power = self.call("exp", self.mul(y, self.call("log", x)))
        if not (isinstance(x, Range) and isinstance(y, Range)):
            return power
        # Exponents that are whole in the cell have powers of negative numbers too.
        negative, (least, most) = x.low < 0.0, _unknown(x)
        return replace(
            power,
            low=np.where(negative, least, power.low),
            high=np.where(negative, most, power.high),
            slow=np.where(negative, least, power.slow),
            fast=np.where(negative, most, power.fast),
            breaks=np.where(negative, _MANY, power.breaks),
        )

    def _copysign(self, size: Number, sign: Number) -> Number:
        return self.mul(self.call("fabs", size), self.select(True, sign, 0.0, -1.0, 1.0))

    def _reciprocal(self, y: Range) -> Range:
        below, above = y.low < 0.0, y.high > 0.0
        around = (y.low <= 0.0) & (y.high >= 0.0)
        nothing = around & ~below & ~above
        low = np.where((around & below) | nothing, -INFINITE, 1.0 / y.high)
        high = np.where((around & above) | nothing, INFINITE, 1.0 / y.low)
        low, high = _outward(low, high)
        square = _square(low, high)
        slopes = _times((-square[1], -square[0]), (y.slow, y.fast))
        own = _over(_least(y.low, y.high), _largest(y.slow, y.fast))
        return self._done(
            (low, high), slopes, 1.0 / y.middle, (y,), scale=own, breaks=np.where(around, _MANY, _NONE),
            blur=_blurred(square[1], y),
        )  # fmt: skip

    def _of_table(self, name: str, *of: Range) -> Range:
        """A function that has no rule here: its slopes, as the table has them, over the ranges of its arguments.

        Where these say that it only rises or only falls, its ends bound it; elsewhere the mean value theorem does.
        """
        entry, (least, most) = IN_CODE[name], IN_CODE[name].domain
        value = _vectorised(entry)
        middle = value(*(u.middle for u in of))
        unknown = _unknown(of[0])
        by_each = self._slopes_of_table(entry, of, middle)
        slopes = unknown if not by_each else (np.zeros_like(middle), np.zeros_like(middle))
        blur = np.full_like(middle, 0.0 if by_each else INFINITE)
        for slope, u in zip(by_each, of, strict=False):
            blur += _blurred(_largest(slope.low, slope.high), u)
            part = _times((slope.low, slope.high), (u.slow, u.fast))
            slopes = _outward(slopes[0] + part[0], slopes[1] + part[1])
        values = unknown
        if len(by_each) == 1:
            (u,) = of
            ends = value(np.clip(u.low, least, most)), value(np.clip(u.high, least, most))
            rises, falls = by_each[0].low >= 0.0, by_each[0].high <= 0.0
            values = (
                np.where(rises, ends[0], np.where(falls, ends[1], unknown[0])),
                np.where(rises, ends[1], np.where(falls, ends[0], unknown[1])),
            )
        outside = np.logical_or.reduce([(u.low < least) | (u.high > most) for u in of])
        fastest = np.maximum.reduce([_largest(u.slow, u.fast) for u in of])
        return self._done(
            values,
            slopes,
            middle,
            of,
            scale=_over(1.0, fastest),
            breaks=np.where(outside, _MANY, _NONE),
            blur=blur,
        )

    def _slopes_of_table(self, entry: Function, of: tuple[Range, ...], middle: np.ndarray) -> list[Range]:
        if entry.slopes is None:
            return []
        value = self._made_of(
            _unknown(of[0]),
            _unknown(of[0]),
            middle,
            *(np.full(len(middle), x) for x in (INFINITE, INFINITE, _MANY, INFINITE)),
        )
        found = entry.slopes(self, of, value)
        return [self._lifted(top if under is None else self.div(top, under)) for top, under in found]

    # What all of them share.

    def _centre(self) -> np.ndarray:
        if self.finding:
            return self.begin
        return self.begin + 0.5 * (self.end - self.begin)

    def _lifted(self, x: Number) -> Range:
        if isinstance(x, Range):
            return x
        n = len(self.begin)
        same, none, never = np.full(n, float(x)), np.zeros(n), np.full(n, INFINITE)
        return Range(same, same, none, none, same, never, never, np.zeros(n, dtype=np.int8), none)

    def _shifted(self, x: Range, by: float) -> Range:
        middle = x.middle + by
        blur = x.blur + _ROUNDED * np.abs(middle)
        low, high = _shift(x.low, by, -INFINITE), _shift(x.high, by, INFINITE)
        return Range(low, high, x.slow, x.fast, middle, x.scale, x.period, x.breaks, blur)

    def _scaled(self, x: Range, by: float) -> Range:
        if by == 0.0:
            return self._lifted(0.0)
        ends, slopes = (by * x.low, by * x.high), (by * x.slow, by * x.fast)
        if by < 0.0:
            ends, slopes = ends[::-1], slopes[::-1]
        if math.frexp(by)[0] not in (0.5, -0.5):  # products with powers of two are exact
            ends, slopes = _outward(*ends), _outward(*slopes)
        middle = by * x.middle
        blur = abs(by) * x.blur + _ROUNDED * np.abs(middle)
        return Range(*ends, *slopes, middle, x.scale, x.period, x.breaks, blur)

    def _done(
        self,
        values: tuple[np.ndarray, np.ndarray],
        slopes: tuple[np.ndarray, np.ndarray],
        middle: np.ndarray,
        of: tuple[Range, ...],
        *,
        scale: np.ndarray | float = INFINITE,
        period: np.ndarray | float = INFINITE,
        breaks: np.ndarray | int = _NONE,
        most: float = INFINITE,
        blur: np.ndarray | float = 0.0,
    ) -> Range:
        """A result with what it is made of: its own scales and breaks, and theirs.

        `most` is what its range over all times counts as where interval arithmetic finds no bound.
        """
        for x in of:
            scale, period = np.minimum(scale, x.scale), np.minimum(period, x.period)
            breaks = np.maximum(breaks, x.breaks)
        return self._made_of(values, slopes, middle, scale, period, breaks, blur, most)

    def _made_of(self, values, slopes, middle, scale, period, breaks, blur, most: float = INFINITE) -> Range:
        low, high = _outward(*values)
        # What is not a number says nothing.
        low, high = np.fmax(low, -INFINITE), np.fmin(high, INFINITE)
        slow, fast = np.fmax(slopes[0], -INFINITE), np.fmin(slopes[1], INFINITE)
        blur = blur + _ROUNDED * np.abs(middle)
        place, self._made = self._made, self._made + 1
        if self.finding:
            self.widths.append(min(float(high[0] - low[0]), most))
            return Range(low, high, slow, fast, middle, scale, period, breaks, blur)
        # The mean value theorem: ranges of long expressions, in which time stands often, are far too wide else.
        if self._half is None:
            # A little more, as the middle, products and sums with it are rounded.
            self._half = (0.5 + _ROUNDED) * (self.end - self.begin) + np.spacing(np.abs(self.end))
        reach = self._half * np.maximum(-slow, fast) + blur
        smooth = (breaks == _NONE) & np.isfinite(middle) & np.isfinite(reach)
        low = np.where(smooth, np.maximum(low, middle - reach), low)
        high = np.where(smooth, np.minimum(high, middle + reach), high)
        width = self.widths[place] if self.widths else INFINITE
        if 0.0 < width < INFINITE:
            still = high - low <= NEGLIGIBLE * width
            scale, period = np.where(still, INFINITE, scale), np.where(still, INFINITE, period)
            breaks = np.where(still, _NONE, breaks)
        return Range(low, high, slow, fast, middle, scale, period, breaks, blur)


def _of_numbers(name: str, *args: float) -> float:
    try:
        return float(IN_CODE[name].value(*args))
    except (ValueError, OverflowError, ZeroDivisionError):
        return math.nan


def _vectorised(entry: Function) -> Callable[..., np.ndarray]:
    if entry.numpy:
        return getattr(np, entry.numpy)

    def value(*args: float) -> float:
        try:
            return entry.value(*args)
        except (ValueError, OverflowError, ZeroDivisionError):
            return math.nan

    return np.vectorize(value, otypes=[float])


def _unknown(x: Range) -> tuple[np.ndarray, np.ndarray]:
    n = len(x.low)
    return np.full(n, -INFINITE), np.full(n, INFINITE)


def _times(
    x: tuple[np.ndarray, np.ndarray], y: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """The range of a product; nothing times what has no bound is nothing."""
    products = [a * b for a in x for b in y]
    # Ends that are 0 are exact, so that it is 0 however far the other reaches: the other products bound what is not.
    low, high = functools.reduce(np.minimum, products), functools.reduce(np.maximum, products)
    if np.isnan(low).any():
        products = [np.where(np.isnan(product), 0.0, product) for product in products]
        low, high = functools.reduce(np.minimum, products), functools.reduce(np.maximum, products)
    return _outward(low, high)


def _square(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    least, most = _least(low, high), _largest(low, high)
    return _outward(least * least, most * most)


def _largest(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    return np.maximum(np.abs(low), np.abs(high))


def _least(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    return np.where((low <= 0.0) & (high >= 0.0), 0.0, np.minimum(np.abs(low), np.abs(high)))


def _over(x: np.ndarray | float, y: np.ndarray) -> np.ndarray:
    """x / y where y may be zero or without bound."""
    ratio = x / y
    return np.where(np.isnan(ratio), INFINITE if np.isscalar(x) else 0.0, ratio)


def _outward(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Round ends outward; 0 stays, as sums and products that are 0 are exact (but for underflow)."""
    return low - _ROUNDED * np.abs(low), high + _ROUNDED * np.abs(high)


def _shift(end: np.ndarray, by: float, towards: float) -> np.ndarray:
    """Return end + by, rounded towards one side where it is not exact: what was lost is known (Knuth's two-sum)."""
    total = end + by
    part = total - end
    lost = (end - (total - part)) + (by - part)
    return np.where(lost < 0.0 if towards < 0.0 else lost > 0.0, np.nextafter(total, towards), total)


def _blurred(rate: np.ndarray, *of: Range) -> np.ndarray:
    """What is unknown of arguments, as a function passes it on that changes by at most `rate` of them."""
    blur = functools.reduce(np.add, (u.blur for u in of))
    return np.fmax(rate * blur, 0.0)  # what is known exactly stays so, however steep


def _sine(low: np.ndarray, high: np.ndarray, quarter: int) -> tuple[np.ndarray, np.ndarray]:
    """The range of the sine, so many quarters of a turn ahead (0 to 2)."""
    turn = 2.0 * math.pi
    unknown = ~(np.isfinite(low) & np.isfinite(high)) | (high - low >= turn)
    a, b = np.where(unknown, 0.0, low), np.where(unknown, 0.0, high)
    # An extremum as near to an end as turns are rounded counts as inside.
    first, last = a / turn + 0.25 * quarter, b / turn + 0.25 * quarter
    first, last = first - _ROUNDED * (1.0 + np.abs(first)), last + _ROUNDED * (1.0 + np.abs(last))
    top = np.ceil(first - 0.25) + 0.25 <= last
    bottom = np.ceil(first + 0.25) - 0.25 <= last
    at_a, at_b = (np.cos(a), np.cos(b)) if quarter == 1 else (np.sin(a), np.sin(b))
    if quarter == 2:
        at_a, at_b = -at_a, -at_b
    least, most = _outward(np.minimum(at_a, at_b), np.maximum(at_a, at_b))
    return np.where(unknown | bottom, -1.0, least), np.where(unknown | top, 1.0, most)


def _is_monotone(x: Range) -> np.ndarray:
    return (x.slow > 0.0) | (x.fast < 0.0)


def _crossings(u: Range, *, touching: bool) -> np.ndarray:
    """How often a function crosses zero in a cell: not at all, once at most, or perhaps more often."""
    still = (u.low == 0.0) & (u.high == 0.0)
    inside = (u.low <= 0.0) & (u.high >= 0.0) if touching else (u.low < 0.0) & (u.high > 0.0)
    return np.where(inside & ~still, np.where(_is_monotone(u), _ONE, _MANY), _NONE)

"""Arithmetic on functions of time over many cells of time at once: what they can be there, and how fast they change.

Interval arithmetic (Moore, Kearfott, Cloud, Introduction to Interval Analysis, 2009): ranges of a function and of its
derivative hold for every time in a cell, so that nothing between samples is missed, however narrow it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from symgen.runtime.graph.functions import IN_CODE, Function

NEGLIGIBLE = 1e-13  # of the range over all times: what changes by less does not count
_EVEN = 4.0  # an oscillation whose rates differ by less than this over a cell is one
_OF_EXP = 1.0  # the height of a pulse exp(-u) whose u is not seen to be positive
_NONE, _ONE, _MANY = 0, 1, 2
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

    def time(self) -> Range:
        """Time itself."""
        n = len(self.begin)
        one, never = np.ones(n), np.full(n, INFINITE)
        return Range(self.begin, self.end, one, one, self._centre(), never, never, np.zeros(n, dtype=np.int8))

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
        return Range(-x.high, -x.low, -x.fast, -x.slow, -x.middle, x.scale, x.period, x.breaks)

    def add(self, x: Number, y: Number) -> Number:
        if not isinstance(x, Range):
            return x + y if not isinstance(y, Range) else self._shifted(y, x)
        if not isinstance(y, Range):
            return self._shifted(x, y)
        return self._done(
            (x.low + y.low, x.high + y.high), (x.slow + y.slow, x.fast + y.fast), x.middle + y.middle, (x, y)
        )

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
        slopes = first[0] + second[0], first[1] + second[1]
        return self._done(values, slopes, x.middle * y.middle, (x, y))

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
        return self._made_of(values, slopes, middle, scale, period, breaks)

    # Functions of which more is known than the table says: periods, distances that scale them, poles, powers.

    def _sin(self, u: Range) -> Range:
        return self._wave(u, 0.0)

    def _cos(self, u: Range) -> Range:
        return self._wave(u, 0.5 * math.pi)

    def _wave(self, u: Range, phase: float) -> Range:
        values = _sine(u.low + phase, u.high + phase)
        slopes = _times(
            _sine(u.low + phase + 0.5 * math.pi, u.high + phase + 0.5 * math.pi), (u.slow, u.fast)
        )
        fastest, slowest = _largest(u.slow, u.fast), _least(u.slow, u.fast)
        own = _over(1.0, fastest)
        steady = _EVEN * slowest >= fastest
        return self._done(
            values, slopes, np.sin(u.middle + phase), (u,),
            scale=np.where(steady, INFINITE, own), period=np.where(steady, own, INFINITE),
        )  # fmt: skip

    def _tan(self, u: Range) -> Range:
        turns = np.floor(u.low / math.pi + 0.5) != np.floor(u.high / math.pi + 0.5)
        values = np.where(turns, -INFINITE, np.tan(u.low)), np.where(turns, INFINITE, np.tan(u.high))
        square = _square(*values)
        slopes = _times((1.0 + square[0], 1.0 + square[1]), (u.slow, u.fast))
        own = _over(1.0, (1.0 + square[1]) * _largest(u.slow, u.fast))
        return self._done(
            values, slopes, np.tan(u.middle), (u,), scale=own, breaks=np.where(turns, _MANY, _NONE)
        )

    def _atan(self, u: Range) -> Range:
        square = _square(u.low, u.high)
        slopes = _times((1.0 / (1.0 + square[1]), 1.0 / (1.0 + square[0])), (u.slow, u.fast))
        # Far from its step, whose ends fade as powers do, distances are the scale.
        own = _over(np.maximum(1.0, _least(u.low, u.high)), _largest(u.slow, u.fast))
        return self._done((np.arctan(u.low), np.arctan(u.high)), slopes, np.arctan(u.middle), (u,), scale=own)

    def _cosh(self, u: Range) -> Range:
        """By its ends: the slope of sinh, which is found by it."""
        around = (u.low <= 0.0) & (u.high >= 0.0)
        ends = np.cosh(u.low), np.cosh(u.high)
        slopes = _times((np.sinh(u.low), np.sinh(u.high)), (u.slow, u.fast))
        return self._done(
            (np.where(around, 1.0, np.minimum(*ends)), np.maximum(*ends)), slopes, np.cosh(u.middle), (u,),
            scale=_over(1.0, _largest(u.slow, u.fast)),
        )  # fmt: skip

    def _atan2(self, y: Number, x: Number) -> Range:
        y, x = self._lifted(y), self._lifted(x)
        radius = self.add(self.mul(y, y), self.mul(x, x))
        turned = self.sub(
            self.mul(x, Range(y.slow, y.fast, *_unknown(y), y.middle * 0.0, y.scale, y.period, y.breaks)),
            self.mul(y, Range(x.slow, x.fast, *_unknown(x), x.middle * 0.0, x.scale, x.period, x.breaks)),
        )
        rate = self.div(turned, radius)
        slopes = rate.low, rate.high
        n = len(self.begin)
        cut = np.where((y.low <= 0.0) & (y.high >= 0.0) & (x.low <= 0.0), _MANY, _NONE)
        return self._done(
            (np.full(n, -math.pi), np.full(n, math.pi)), slopes, np.arctan2(y.middle, x.middle), (y, x),
            scale=_over(1.0, _largest(*slopes)), breaks=cut,
        )  # fmt: skip

    def _tanh(self, u: Range) -> Range:
        values = np.tanh(u.low), np.tanh(u.high)
        square = _square(*values)
        slopes = _times((1.0 - square[1], 1.0 - square[0]), (u.slow, u.fast))
        own = _over(1.0, _largest(u.slow, u.fast))
        return self._done(values, slopes, np.tanh(u.middle), (u,), scale=own)

    def _exp(self, u: Range) -> Range:
        values = np.exp(u.low), np.exp(u.high)
        own = _over(1.0, _largest(u.slow, u.fast))
        slopes = _times(values, (u.slow, u.fast))
        return self._done(values, slopes, np.exp(u.middle), (u,), scale=own, most=_OF_EXP)

    def _log(self, u: Range) -> Range:
        low, high = np.maximum(u.low, 0.0), np.maximum(u.high, 0.0)
        slopes = _times((_over(1.0, high), _over(1.0, low)), (u.slow, u.fast))
        return self._done(
            (np.log(low), np.log(high)), slopes, np.log(u.middle), (u,),
            scale=_over(low, _largest(u.slow, u.fast)), breaks=_crossings(u, touching=True),
        )  # fmt: skip

    def _sqrt(self, u: Range) -> Range:
        low, high = np.sqrt(np.maximum(u.low, 0.0)), np.sqrt(np.maximum(u.high, 0.0))
        slopes = _times((_over(0.5, high), _over(0.5, low)), (u.slow, u.fast))
        return self._done(
            (low, high), slopes, np.sqrt(u.middle), (u,),
            scale=_over(np.maximum(u.low, 0.0), _largest(u.slow, u.fast)), breaks=_crossings(u, touching=True),
        )  # fmt: skip

    def _fabs(self, u: Range) -> Range:
        negative, positive = u.high <= 0.0, u.low >= 0.0
        most = np.maximum(-u.low, u.high)
        low = np.where(negative, -u.high, np.where(positive, u.low, 0.0))
        slow = np.where(negative, -u.fast, np.where(positive, u.slow, np.minimum(u.slow, -u.fast)))
        fast = np.where(negative, -u.slow, np.where(positive, u.fast, np.maximum(u.fast, -u.slow)))
        return self._done(
            (low, most), (slow, fast), np.abs(u.middle), (u,), breaks=_crossings(u, touching=False)
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
        return self.call("exp", self.mul(y, self.call("log", x)))

    def _copysign(self, size: Number, sign: Number) -> Number:
        return self.mul(self.call("fabs", size), self.select(True, sign, 0.0, -1.0, 1.0))

    def _reciprocal(self, y: Range) -> Range:
        below, above = y.low < 0.0, y.high > 0.0
        around = (y.low <= 0.0) & (y.high >= 0.0)
        nothing = around & ~below & ~above
        low = np.where((around & below) | nothing, -INFINITE, 1.0 / y.high)
        high = np.where((around & above) | nothing, INFINITE, 1.0 / y.low)
        square = _square(low, high)
        slopes = _times((-square[1], -square[0]), (y.slow, y.fast))
        own = _over(_least(y.low, y.high), _largest(y.slow, y.fast))
        return self._done(
            (low, high), slopes, 1.0 / y.middle, (y,), scale=own, breaks=np.where(around, _MANY, _NONE)
        )

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
        for slope, u in zip(by_each, of, strict=False):
            part = _times((slope.low, slope.high), (u.slow, u.fast))
            slopes = slopes[0] + part[0], slopes[1] + part[1]
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
            values, slopes, middle, of, scale=_over(1.0, fastest), breaks=np.where(outside, _MANY, _NONE)
        )

    def _slopes_of_table(self, entry: Function, of: tuple[Range, ...], middle: np.ndarray) -> list[Range]:
        if entry.slopes is None:
            return []
        value = self._made_of(
            _unknown(of[0]),
            _unknown(of[0]),
            middle,
            *(np.full(len(middle), x) for x in (INFINITE, INFINITE, _MANY)),
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
        return Range(same, same, none, none, same, never, never, np.zeros(n, dtype=np.int8))

    def _shifted(self, x: Range, by: float) -> Range:
        return Range(x.low + by, x.high + by, x.slow, x.fast, x.middle + by, x.scale, x.period, x.breaks)

    def _scaled(self, x: Range, by: float) -> Range:
        if by == 0.0:
            return self._lifted(0.0)
        ends, slopes = (by * x.low, by * x.high), (by * x.slow, by * x.fast)
        if by < 0.0:
            ends, slopes = ends[::-1], slopes[::-1]
        return Range(*ends, *slopes, by * x.middle, x.scale, x.period, x.breaks)

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
    ) -> Range:
        """A result with what it is made of: its own scales and breaks, and theirs.

        `most` is what its range over all times counts as where interval arithmetic finds no bound.
        """
        for x in of:
            scale, period = np.minimum(scale, x.scale), np.minimum(period, x.period)
            breaks = np.maximum(breaks, x.breaks)
        return self._made_of(values, slopes, middle, scale, period, breaks, most)

    def _made_of(self, values, slopes, middle, scale, period, breaks, most: float = INFINITE) -> Range:
        low, high = (
            np.where(np.isnan(x), end, x) for x, end in zip(values, (-INFINITE, INFINITE), strict=True)
        )
        slow, fast = (
            np.where(np.isnan(x), end, x) for x, end in zip(slopes, (-INFINITE, INFINITE), strict=True)
        )
        place, self._made = self._made, self._made + 1
        if self.finding:
            self.widths.append(min(float(high[0] - low[0]), most))
            return Range(low, high, slow, fast, middle, scale, period, breaks)
        # The mean value theorem: ranges of long expressions, in which time stands often, are far too wide else.
        half = 0.5 * (self.end - self.begin)
        reach = half * np.maximum(np.abs(slow), np.abs(fast))
        smooth = (breaks == _NONE) & np.isfinite(middle) & np.isfinite(reach)
        reach += 4.0 * np.spacing(np.abs(middle))
        low = np.where(smooth, np.maximum(low, middle - reach), low)
        high = np.where(smooth, np.minimum(high, middle + reach), high)
        width = self.widths[place] if self.widths else INFINITE
        if 0.0 < width < INFINITE:
            still = high - low <= NEGLIGIBLE * width
            scale, period = np.where(still, INFINITE, scale), np.where(still, INFINITE, period)
            breaks = np.where(still, _NONE, breaks)
        return Range(low, high, slow, fast, middle, scale, period, breaks)


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
    products = [np.where(np.isnan(product), 0.0, product) for product in products]
    return np.minimum.reduce(products), np.maximum.reduce(products)


def _square(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    least, most = _least(low, high), _largest(low, high)
    return least * least, most * most


def _largest(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    return np.maximum(np.abs(low), np.abs(high))


def _least(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    return np.where((low <= 0.0) & (high >= 0.0), 0.0, np.minimum(np.abs(low), np.abs(high)))


def _over(x: np.ndarray | float, y: np.ndarray) -> np.ndarray:
    """x / y where y may be zero or without bound."""
    ratio = x / y
    return np.where(np.isnan(ratio), INFINITE if np.isscalar(x) else 0.0, ratio)


def _sine(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The range of the sine."""
    turn = 2.0 * math.pi
    unknown = ~(np.isfinite(low) & np.isfinite(high)) | (high - low >= turn)
    a, b = np.where(unknown, 0.0, low), np.where(unknown, 0.0, high)
    top = np.ceil(a / turn - 0.25) * turn + 0.25 * turn <= b
    bottom = np.ceil(a / turn + 0.25) * turn - 0.25 * turn <= b
    at_a, at_b = np.sin(a), np.sin(b)
    return (
        np.where(unknown | bottom, -1.0, np.minimum(at_a, at_b)),
        np.where(unknown | top, 1.0, np.maximum(at_a, at_b)),
    )


def _is_monotone(x: Range) -> np.ndarray:
    return (x.slow > 0.0) | (x.fast < 0.0)


def _crossings(u: Range, *, touching: bool) -> np.ndarray:
    """How often a function crosses zero in a cell: not at all, once at most, or perhaps more often."""
    still = (u.low == 0.0) & (u.high == 0.0)
    inside = (u.low <= 0.0) & (u.high >= 0.0) if touching else (u.low < 0.0) & (u.high > 0.0)
    return np.where(inside & ~still, np.where(_is_monotone(u), _ONE, _MANY), _NONE)

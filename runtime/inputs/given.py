"""Inputs over time as users give them: a table of values, or a polynomial.

A function of time in pieces, each a polynomial: what tables, polynomials and sampled values become.

The cubic spline through a table's values: twice continuously differentiable, not-a-knot at its ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from symgen.runtime.errors import RuntimeModelError, nearest

SAME_TIME = 64.0 * float(np.finfo(float).eps)  # relative: breaks that are nearer to each other are one
_SAME_SLOPE = 1e-9  # likewise of slopes
_SAME = 1e-12  # a difference at a knot, in parts of the values about it, that is round-off and no jump
_FITTED, _FIT = 4, 1e-8  # pieces of such a degree approximate a function, which their slopes miss by so much
_COUNTS = 1e-9  # of what an input adds up to in a run
_STEEPEST = 1e75  # [1/s]: of polynomials with such slopes the powers overflow


@dataclass(frozen=True)
class Pieces:
    """Piece k is the sum of coefficients[k, j] (t - knots[k])^j; it holds from its knot to the next.

    The first piece also holds before its knot, the last one for ever.

    Attributes
    ----------
    knots : ndarray, shape (n,) [s]
        Ascending.
    coefficients : ndarray, shape (n, degree + 1)
    """

    knots: np.ndarray
    coefficients: np.ndarray

    @property
    def degree(self) -> int:
        """Of the polynomials."""
        return self.coefficients.shape[1] - 1

    @property
    def breaks(self) -> np.ndarray:
        """Times [s] at which one piece ends and the next begins."""
        return self.knots[1:]

    def piece_at(self, t: float) -> int:
        """Return the number of the piece that holds at `t`; at a break, the one that begins."""
        return max(0, int(np.searchsorted(self.knots, t, side="right")) - 1)

    def jumps(self) -> np.ndarray:
        """Return at which breaks the value itself jumps, shape (n - 1,).

        What is round-off is measured by the values about a break: elsewhere they may be larger by any factor.
        """
        before, size = self._ends()
        return np.abs(self.coefficients[1:, 0] - before) > _SAME * np.maximum(
            size, np.abs(self.coefficients[1:, 0])
        )

    def kinks(self) -> np.ndarray:
        """Return at which breaks the value or its slope jumps, shape (n - 1,)."""
        width, before = np.diff(self.knots), self.coefficients[:-1]
        slope = np.zeros(len(width))
        for j in range(self.degree, 0, -1):
            slope = slope * width + j * before[:, j]
        after = self.coefficients[1:, 1] if self.degree else slope
        # Slopes are differences of values over the shorter of two widths.
        size = np.maximum(self._ends()[1], np.abs(self.coefficients[1:, 0]))
        shorter = np.minimum(width, np.append(width[1:], np.inf))
        same = _FIT if self.degree >= _FITTED else _SAME
        rounded = _SAME_SLOPE * np.maximum(np.abs(slope), np.abs(after)) + same * size / shorter
        return self.jumps() | (np.abs(after - slope) > rounded)

    def _ends(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the value of each piece but the last where it ends, and the size of what that is a sum of."""
        width, before = np.diff(self.knots), self.coefficients[:-1]
        value, size = np.zeros(len(width)), np.zeros(len(width))
        for j in range(self.degree, -1, -1):
            value, size = value * width + before[:, j], size * width + np.abs(before[:, j])
        return value, size

    def lost(self, t_start: float, t_end: float) -> tuple[float, float, float] | None:
        """Return a piece that counts in a run from one time to another, and is too short for its ends to be told apart.

        Returns
        -------
        tuple of float or None [s]
            When it begins, how long it lasts, and how long it would have to.
        """
        begins, width = self.knots[:-1], np.diff(self.knots)
        least = SAME_TIME * np.maximum(abs(t_start), np.abs(begins))
        short = (width <= least) & (begins >= t_start) & (begins < t_end)
        if not short.any():
            return None
        value, _ = self._ends()
        of_piece = np.maximum(np.abs(self.coefficients[:-1, 0]), np.abs(value))
        kept = np.append(of_piece[~short], np.abs(self.coefficients[-1, 0])).max()
        counts = short & (of_piece * width > _COUNTS * kept * (t_end - t_start))
        k = int(np.argmax(counts))
        return (float(begins[k]), float(width[k]), 2.0 * float(least[k])) if counts.any() else None

    def merged(self) -> Pieces:
        """Return the same function without breaks between pieces that are one constant."""
        flat = ~self.coefficients[:, 1:].any(axis=1)
        same = flat[1:] & flat[:-1] & (self.coefficients[1:, 0] == self.coefficients[:-1, 0])
        kept = np.concatenate([[True], ~same])
        return Pieces(self.knots[kept], self.coefficients[kept])


def cubic_spline(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return the coefficients of each piece in powers of t - t[k], shape (n - 1, 4).

    Slopes at the times from the continuity of second derivatives, and of the third at the second and the last but one
    time (not-a-knot): de Boor, A Practical Guide to Splines (1978), ch. IV. Three times give a parabola, two a line.

    Parameters
    ----------
    t, x : ndarray, shape (n,), n ≥ 2
    """
    h = np.diff(t)
    chord = np.diff(x) / h
    if len(t) == 2:
        slopes = np.repeat(chord, 2)
    elif len(t) == 3:
        curve = (chord[1] - chord[0]) / (t[2] - t[0])
        slopes = np.array([chord[0] - h[0] * curve, chord[0] + h[0] * curve, chord[1] + h[1] * curve])
    else:
        slopes = _slopes(t, h, chord)
    rise = (slopes[:-1] + slopes[1:] - 2.0 * chord) / h
    return np.column_stack([x[:-1], slopes[:-1], (chord - slopes[:-1]) / h - rise, rise / h])


def _slopes(t: np.ndarray, h: np.ndarray, chord: np.ndarray) -> np.ndarray:
    """The slopes at all times, by a tridiagonal system."""
    n = len(t)
    below, diagonal, above, right = (np.zeros(n) for _ in range(4))
    below[1:-1], diagonal[1:-1], above[1:-1] = h[1:], 2.0 * (h[:-1] + h[1:]), h[:-1]
    right[1:-1] = 3.0 * (h[1:] * chord[:-1] + h[:-1] * chord[1:])
    diagonal[0], above[0] = h[1], t[2] - t[0]
    right[0] = ((h[0] + 2.0 * above[0]) * h[1] * chord[0] + h[0] ** 2 * chord[1]) / above[0]
    diagonal[-1], below[-1] = h[-2], t[-1] - t[-3]
    right[-1] = (h[-1] ** 2 * chord[-2] + (2.0 * below[-1] + h[-1]) * h[-2] * chord[-1]) / below[-1]
    for i in range(1, n):  # diagonally dominant but for the ends, where elimination keeps its pivots too
        factor = below[i] / diagonal[i - 1]
        diagonal[i] -= factor * above[i - 1]
        right[i] -= factor * right[i - 1]
    for i in range(n - 1, -1, -1):
        right[i] = (right[i] - (above[i] * right[i + 1] if i < n - 1 else 0.0)) / diagonal[i]
    return right


KINDS = ("linear", "cubic", "hold")
# What NumPy makes numbers of without a word, by its kind.
_NO_NUMBERS = {
    "M": "dates: give seconds, (t - t[0]) / numpy.timedelta64(1, 's')",
    "m": "time spans in a unit of their own: give seconds, t / numpy.timedelta64(1, 's')",
    "c": "complex: give their real parts",
}


class InputFault(RuntimeModelError):
    """What is given for an input is none."""


@dataclass(frozen=True)
class Table:
    """Values at times; before the first time and after the last, the value there holds.

    Parameters
    ----------
    times : array_like, shape (n,) [s]
        Ascending, at least one.
    values : array_like, shape (n,)
        In the unit of the input.
    kind : {"linear", "cubic", "hold"}
        Between the times: straight lines, a cubic spline (not-a-knot: de Boor, A Practical Guide to Splines, 1978,
        ch. IV), or the value at the time before.

    Raises
    ------
    InputFault
        The lengths differ, a number is not finite, or times do not ascend.
    """

    times: np.ndarray
    values: np.ndarray
    kind: str = "linear"

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputFault(f"a table of kind {self.kind!r}: {nearest(str(self.kind), KINDS)}")
        times, values = _numbers("times", self.times), _numbers("values", self.values)
        if len(times) != len(values):
            raise InputFault(f"a table of {len(times)} times and {len(values)} values: give as many of each")
        if not len(times):
            raise InputFault("a table without rows: give at least one time and value")
        steps = np.flatnonzero(np.diff(times) <= 0.0)
        if len(steps):
            row = int(steps[0]) + 1
            raise InputFault(
                f"times of a table must ascend, but row {row + 1} has {times[row]:.9g} s after {times[row - 1]:.9g} s"
            )
        if self.kind != "hold":
            self._refuse_slopes(times, values)
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "values", values)

    @staticmethod
    def _refuse_slopes(times: np.ndarray, values: np.ndarray) -> None:
        with np.errstate(over="ignore", invalid="ignore"):
            steep = np.flatnonzero(~(np.abs(np.diff(values) / np.diff(times)) <= _STEEPEST))
        if len(steep):
            row = int(steep[0])
            raise InputFault(
                f"values of a table go from {values[row]:.3g} to {values[row + 1]:.3g} in "
                f"{times[row + 1] - times[row]:.3g} s from row {row + 1} on, steeper than numbers can follow: look at "
                'the exponents, or let it jump, with kind = "hold"'
            )

    def pieces(self) -> Pieces:
        """Return the table as polynomials in pieces; one piece before the first time, one after the last."""
        t, x = self.times, self.values
        if self.kind == "hold" or len(t) == 1:
            return Pieces(t, x[:, None]).merged()
        if self.kind == "linear":
            inner = np.column_stack([x[:-1], np.diff(x) / np.diff(t)])
        else:
            inner = cubic_spline(t, x)
        outside = np.zeros((1, inner.shape[1]))
        first, last = outside.copy(), outside.copy()
        first[0, 0], last[0, 0] = x[0], x[-1]
        # The piece before the table needs a knot of its own, at which nothing happens: any earlier time will do.
        knots = np.concatenate([[t[0] - (t[1] - t[0])], t])
        return Pieces(knots, np.concatenate([first, inner, last])).merged()


@dataclass(frozen=True)
class Polynomial:
    """c0 + c1 (t - t0) + c2 (t - t0)² + …, at all times.

    Parameters
    ----------
    coefficients : array_like, shape (n,)
        From the constant upward, in the unit of the input over powers of seconds.
    t0 : float [s]
    """

    coefficients: np.ndarray
    t0: float = 0.0

    def __post_init__(self) -> None:
        coefficients = _numbers("coefficients", self.coefficients)
        if not len(coefficients):
            raise InputFault("a polynomial without coefficients: give at least one number")
        object.__setattr__(self, "coefficients", coefficients)
        object.__setattr__(self, "t0", float(_numbers("t0", [self.t0])[0]))

    def pieces(self) -> Pieces:
        """Return the polynomial as one piece."""
        return Pieces(np.array([self.t0]), self.coefficients[None].copy())


def _numbers(name: str, values: Any) -> np.ndarray:
    kind = getattr(getattr(values, "dtype", None), "kind", "f")
    if kind in _NO_NUMBERS:
        raise InputFault(f"{name} are {_NO_NUMBERS[kind]}")
    if np.ma.is_masked(values):
        raise InputFault(f"{name} have places that are masked: leave their rows out")
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InputFault(f"{name} cannot be read as numbers") from None
    if array.ndim != 1:
        raise InputFault(f"{name} have shape {array.shape}: give a list of numbers")
    bad = np.flatnonzero(~np.isfinite(array))
    if len(bad):
        raise InputFault(f"number {bad[0] + 1} of {name} is {array[bad[0]]}: all must be finite")
    return array


def is_constant(value: Any) -> bool:
    """Whether what is given for an input is a plain number, or a quantity as text."""
    return isinstance(value, (int, float, np.number, str)) or (
        isinstance(value, np.ndarray) and value.ndim == 0
    )


def from_pair(value: Sequence[Any]) -> Table:
    """Return the linear table of a pair of times and values."""
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        raise InputFault(
            f"a {type(value).__name__}: give a number, a pair (times, values), a function of time, a Table, a "
            "Polynomial or a Controller"
        )
    return Table(*value)


def from_record(record: dict[str, Any]) -> Table | Polynomial | None:
    """Return what a model says that an input does over time, from the record in its header; None: a constant."""
    if "table" in record:
        table = record["table"]
        return Table(table["t"], table["values"], table["kind"])
    if "polynomial" in record:
        return Polynomial(record["polynomial"])
    return None

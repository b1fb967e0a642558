"""Inputs over time as users give them: a table of values, or a polynomial."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from symgen.runtime.errors import RuntimeModelError, nearest
from symgen.runtime.inputs.pieces import Pieces
from symgen.runtime.inputs.spline import cubic_spline

KINDS = ("linear", "cubic", "hold")


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
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "values", values)

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
    """Whether what is given for an input is a plain number."""
    return isinstance(value, (int, float, np.number)) or (isinstance(value, np.ndarray) and value.ndim == 0)


def from_pair(value: Sequence[Any]) -> Table:
    """Return the linear table of a pair of times and values."""
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        raise InputFault(
            f"a {type(value).__name__}: give a number, a pair (times, values), a Table, a Polynomial or a Controller"
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

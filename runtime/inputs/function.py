"""Inputs that are functions of time in Python: taken as polynomials in pieces, as good as the pieces are short."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np

from symgen.runtime.inputs.given import InputFault, Pieces

_DEGREE = 8
_TOLERANCE = 1e-10  # of the largest value that was seen in an interval around a piece
_SHORTEST = 2.0**-30  # of the first interval: what needs shorter pieces jumps
_MOST = 20_000  # pieces


def sampled(function: Callable[[float], float], t_start: float, t_end: float) -> tuple[Pieces, float, float]:
    """Return a function of time as polynomials in pieces, how far they are off at most, and when [s].

    Intervals are halved until the interpolant through Chebyshev's points of the second kind (which have both ends, so
    that pieces join) agrees with the function between these points. Ends of intervals are multiples of powers of two,
    so that a run and a longer one see the same pieces, unless the function grows much; the last may reach beyond
    `t_end`.

    Parameters
    ----------
    function : callable
        Of the time [s], a float; returns a number in the unit of the input.

    Raises
    ------
    InputFault
        It fails, gives something that is no finite number, or needs too many pieces.
    """
    width = 2.0 ** math.ceil(math.log2(t_end - t_start))
    first, last = math.floor(t_start / width), math.floor(t_end / width)
    pending = [(k * width, width, 0.0) for k in range(last, first - 1, -1)]
    knots, rows, worst, when = [], [], 0.0, t_start
    while pending:
        begin, width_here, scale = pending.pop()
        if begin >= t_end or begin + width_here <= t_start:
            continue
        coefficients, off, largest = _piece(function, begin, width_here)
        scale = max(scale, largest)
        if off > _TOLERANCE * scale and width_here > _SHORTEST * width:
            half = width_here / 2.0
            pending += [(begin + half, half, scale), (begin, half, scale)]
            continue
        if off > worst:
            worst, when = off, begin
        knots.append(begin)
        rows.append(coefficients)
        width_last = width_here
        if len(knots) > _MOST:
            raise InputFault(
                f"a function that needs more than {_MOST} pieces up to t = {begin:.6g} s: give a Table, or a "
                "Controller, which is called at every instant"
            )
    # Behind its last piece the last value holds, as with tables: a run that goes on would follow a polynomial.
    last = np.zeros(_DEGREE + 1)
    last[0] = rows[-1] @ width_last ** np.arange(_DEGREE + 1)
    return Pieces(np.array([*knots, knots[-1] + width_last]), np.array([*rows, last])), worst, when


_NODES = -np.cos(np.pi * np.arange(_DEGREE + 1) / _DEGREE)
_BETWEEN = -np.cos(np.pi * (np.arange(_DEGREE) + 0.5) / _DEGREE)


@functools.cache
def _maps() -> tuple[np.ndarray, np.ndarray]:
    """From values at the nodes to values between them, and to coefficients of powers of (t - begin)/width."""
    chebyshev = np.polynomial.chebyshev
    of_values = np.linalg.inv(chebyshev.chebvander(_NODES, _DEGREE))
    series = [chebyshev.Chebyshev.basis(k)(np.polynomial.Polynomial([-1.0, 2.0])) for k in range(_DEGREE + 1)]
    powers = np.array([np.pad(x.coef, (0, _DEGREE + 1 - len(x.coef))) for x in series]).T
    return chebyshev.chebvander(_BETWEEN, _DEGREE) @ of_values, powers @ of_values


def _piece(function: Callable[[float], float], begin: float, width: float) -> tuple[np.ndarray, float, float]:
    """Return coefficients in t - begin, the largest error between the nodes, and the largest value."""
    between, powers = _maps()
    values = _values(function, begin + width * (_NODES + 1.0) / 2.0)
    off = np.abs(_values(function, begin + width * (_BETWEEN + 1.0) / 2.0) - between @ values).max()
    coefficients = powers @ (values - values[0])
    coefficients[0] = values[0]
    coefficients[-1] += values[-1] - coefficients.sum()  # round-off would be a jump to the next piece
    return coefficients / width ** np.arange(_DEGREE + 1), float(off), float(np.abs(values).max())


def _values(function: Callable[[float], float], times: np.ndarray) -> np.ndarray:
    found = np.empty(len(times))
    for k, t in enumerate(times):
        try:
            found[k] = function(float(t))
        except Exception as error:
            raise InputFault(
                f"its function fails at t = {t:.6g} s: {type(error).__name__}: {error}"
            ) from error
        if not math.isfinite(found[k]):
            raise InputFault(f"its function gives {found[k]} at t = {t:.6g} s: it must be finite")
    return found

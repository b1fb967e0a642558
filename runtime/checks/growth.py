"""How fast the difference of two runs grows: exponentially where motion is chaotic, by a power of time otherwise."""

from __future__ import annotations

import numpy as np

_ROUND_OFF, SATURATED = 1e-14, 0.1  # relative differences between which growth is looked for
_LEAST_GROWTH = 10.0  # by which a difference must have grown for its rate to mean something
_LEAST_FRAMES = 10
_NEAR_LEAST = 2.0  # times the least value
_ENVELOPE_PART = 20  # of the run
# From a quarter of a time to its end a power t^k grows 4^k times. Errors of regular motion grow with k up to 3: a drift
# of the energy moves the frequency (1), that the phase (2), and resonance may add one.
_FIRST_PART, LARGEST_POWER = 0.25, 3.5


def growth_rate(t: np.ndarray, relative: np.ndarray) -> float | None:
    """Return the rate [1/s] at which a difference grows, by least squares of its logarithm.

    Parameters
    ----------
    t : ndarray, shape (n,) [s]
    relative : ndarray, shape (n,)
        What is taken is its envelope, from where that leaves round-off, or its least value if it falls at first, to
        where it is no longer small.

    Returns
    -------
    float or None
        None where it grows by less than a factor of ten, or in too few frames.
    """
    first = len(t) // _ENVELOPE_PART
    upper = _envelope(relative, first)
    saturated = np.flatnonzero(upper >= SATURATED)
    end = int(saturated[0]) if saturated.size else len(t)
    usable = np.maximum(upper[first:end], _ROUND_OFF)
    if not usable.size:
        return None
    # Errors of the start may die out before others grow.
    begin = first + int(np.flatnonzero(usable <= _NEAR_LEAST * usable.min())[-1])
    if end - begin < _LEAST_FRAMES:
        return None
    x, y = t[begin:end], np.log(np.maximum(upper[begin:end], _ROUND_OFF))
    if y[-1] - y[0] < np.log(_LEAST_GROWTH):
        return None
    return slope(x, y)


def slope(x: np.ndarray, y: np.ndarray) -> float:
    """Return the slope of the straight line that fits best by least squares."""
    x = x - x.mean()
    return float((x @ (y - y.mean())) / (x @ x))


def _envelope(relative: np.ndarray, width: int) -> np.ndarray:
    """Return the largest value of the last while: differences that oscillate pass through zero."""
    values = np.nan_to_num(relative, nan=np.inf)
    values = np.concatenate([np.full(width, values[0]), values])
    seen = 1  # of how many values there are the largest ones; twice as many each time
    while 2 * seen <= width + 1:
        values = np.maximum(values[seen:], values[:-seen])
        seen *= 2
    rest = width + 1 - seen
    return np.maximum(values[rest:], values[: len(values) - rest])


def is_exponential(t: np.ndarray, relative: np.ndarray, *, but_once: bool = False) -> bool:
    """Return whether a difference grows faster than any power that errors of regular motion grow with."""
    return power_of_growth(t, relative, but_once=but_once) > LARGEST_POWER


def power_of_growth(t: np.ndarray, relative: np.ndarray, *, but_once: bool = False) -> float:
    """Return the power of time with which a difference grows; 0 where there are too few frames to tell.

    Looked at is its running maximum, up to where it is no longer small: from the first quarter of that time to its end.

    Parameters
    ----------
    t : ndarray, shape (n,) [s]
    relative : ndarray, shape (n,)
    but_once : bool
        Whether the largest factor between two frames counts as the mean of the others: what comes at one place, as
        where something strikes, tells nothing about how small differences grow elsewhere.
    """
    peak = running_maximum(relative)
    end = int(np.searchsorted(peak, SATURATED))
    if end < _LEAST_FRAMES:
        return 0.0
    last = min(end, len(t) - 1)
    early = int(np.searchsorted(t, t[0] + _FIRST_PART * (t[last] - t[0])))
    grown = np.maximum(np.minimum(peak[early : last + 1], SATURATED), _ROUND_OFF)
    growth = grown[-1] / grown[0]
    if but_once and len(grown) > 2:
        n = len(grown) - 1
        growth = (growth / (grown[1:] / grown[:-1]).max()) ** (n / (n - 1))
    return float(np.log(max(growth, 1.0)) / -np.log(_FIRST_PART))


def running_maximum(relative: np.ndarray) -> np.ndarray:
    """Return the largest value so far; what is no number is infinite."""
    return np.maximum.accumulate(np.nan_to_num(relative, nan=np.inf))

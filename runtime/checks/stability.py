"""How long a step explicit methods may take: eigenvalues against the region of stability.

By how much a step of length h lets a motion x'' = -w^2 x - 2 d w x' grow depends on z = h w and d only; a method's
record knows it (`Method.growth`).
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from symgen.runtime.integrate.methods import Method

_LARGEST = 12.0  # no explicit method here is stable at a longer h |lambda|
_SCANNED = 1200
_ROUNDING = 1e-7  # growth per step below this is round-off of a motion that keeps its size
_UNDAMPED = 1e-5  # of |lambda|: damping below this is round-off of the linearisation
_LEAST_OF_FASTEST = 0.2  # slower motions than this part of the fastest do not limit a step of these methods


def stable_radius(method: Method, damping: float = 0.0) -> float | None:
    """Return the largest h |lambda| that is stable; None where a method has no such limit.

    Parameters
    ----------
    damping : float
        -Re(lambda) / |lambda|: 0 undamped, 1 a decay without oscillation. Growing motions count as undamped.

    Returns
    -------
    float or None
        0 where no step is stable, as of explicit Euler on undamped motion.
    """
    if method.growth is None:
        return None
    return _radius(method.growth, float(np.clip(round(damping, 3), 0.0, 1.0)))


def stable_step(method: Method, eigenvalues: np.ndarray) -> float:
    """Return the longest stable step [s] on motions of these eigenvalues [1/s]; infinite if unlimited.

    Each motion counts along its own ray: undamped, damped, or a decay.
    """
    eigenvalues = np.atleast_1d(np.asarray(eigenvalues, dtype=complex))
    fastest = np.abs(eigenvalues).max(initial=0.0)
    if fastest <= 0.0 or method.growth is None:
        return np.inf
    fast = eigenvalues[np.abs(eigenvalues) >= _LEAST_OF_FASTEST * fastest]
    return min(stable_radius(method, damping_ratio(value)) / abs(value) for value in fast)


def unstable_rate(method: Method, step: float, eigenvalues: np.ndarray) -> float:
    """Return the rate [1/s] at which steps [s] let the motion of these eigenvalues grow that is least stable."""
    eigenvalues = np.atleast_1d(np.asarray(eigenvalues, dtype=complex))
    fastest, rate = np.abs(eigenvalues).max(initial=0.0), 0.0
    if fastest <= 0.0 or method.growth is None:
        return 0.0
    for value in eigenvalues[np.abs(eigenvalues) >= _LEAST_OF_FASTEST * fastest]:
        damping = min(damping_ratio(value), 1.0)
        grown = float(method.growth(np.array([step * abs(value)]), damping)[0])
        rate = max(rate, np.log(max(grown, 1.0)) / step)
    return rate


def damping_ratio(eigenvalue: complex) -> float:
    """Return -Re / |.|, and 0 where that is round-off, or the motion grows."""
    ratio = -eigenvalue.real / abs(eigenvalue) if eigenvalue else 0.0
    return float(ratio) if ratio > _UNDAMPED else 0.0


@functools.cache
def _radius(growth: Callable[[np.ndarray, float], np.ndarray], damping: float) -> float:
    z = np.linspace(0.0, _LARGEST, _SCANNED + 1)[1:]
    unstable = np.flatnonzero(growth(z, damping) > 1.0 + _ROUNDING)
    if not unstable.size:
        return float(z[-1])
    high = float(z[unstable[0]])
    low = high - float(z[0])
    for _ in range(50):
        middle = 0.5 * (low + high)
        grows = growth(np.array([middle]), damping)[0] > 1.0 + _ROUNDING
        low, high = (low, middle) if grows else (middle, high)
    # What grows in the shortest steps that can be told from round-off grows in all.
    return low if low > 2.0 * float(z[0]) else 0.0

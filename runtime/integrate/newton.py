"""When simplified Newton iterations stop: converged, too slow, or diverging."""

import math

import numpy as np

from symgen.runtime.code.jitted import jitted

EPS = float(np.finfo(float).eps)
MAX_ITERATIONS = 12
ITERATING, CONVERGED, DIVERGED = range(3)

# The monitor of an iteration (float64): size of the last correction, its ratio to the one before, the rate of
# contraction θ, θ / (1 - θ), and by how much the last iteration allowed is expected to miss the tolerance.
SIZE, RATIO, RATE, REST, OVERSHOOT = range(5)
N_MONITOR = 5


@jitted
def start_newton(monitor):
    """Prepare the monitor for the next system; what it knows of the rate serves for the first correction."""
    monitor[REST] = max(monitor[REST], EPS) ** 0.8
    monitor[RATE] = 0.0
    monitor[OVERSHOOT] = 0.0


@jitted
def forget_rate(monitor):
    """Forget the rate of contraction: that of new factors is unknown."""
    monitor[REST] = 1.0


@jitted
def judge_correction(iteration, size, tolerance, monitor):
    """Judge a simplified Newton iteration by the sizes of its corrections.

    Hairer, Wanner, Solving ODEs II (1996), IV.8, equations (8.10) and (8.11), and radau5.f. Unlike there, an
    iteration that stagnates in round-off below the tolerance has converged.

    Parameters
    ----------
    iteration : int
        1 for the first correction.
    size : float
        Norm of the correction; it may be infinite or nan.
    tolerance : float
        Bound of the error that is left after this correction.
    monitor : ndarray, shape (N_MONITOR,)
        Updated in place.

    Returns
    -------
    int
        ITERATING, CONVERGED (with this correction) or DIVERGED.
    """
    if not math.isfinite(size):
        return DIVERGED
    if size == 0.0:
        monitor[SIZE] = EPS
        return CONVERGED
    if iteration > 1:
        ratio = size / monitor[SIZE]
        rate = ratio if iteration == 2 else math.sqrt(ratio * monitor[RATIO])
        monitor[RATIO], monitor[RATE] = ratio, rate
        if rate >= 0.99:
            return CONVERGED if size <= tolerance else DIVERGED
        monitor[REST] = rate / (1.0 - rate)
        expected = monitor[REST] * size * rate ** (MAX_ITERATIONS - 1 - iteration) / tolerance
        if expected >= 1.0:
            monitor[OVERSHOOT] = expected
            return DIVERGED
    monitor[SIZE] = max(size, EPS)
    if monitor[REST] * size <= tolerance:
        return CONVERGED
    return ITERATING if iteration < MAX_ITERATIONS else DIVERGED

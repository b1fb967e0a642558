"""Step size: error norms, Hairer's controller, the first step, landing on stop times, the fixed grid."""

import math

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.layout import (
    ATOL,
    ERROR_OLD,
    GRID_STEP,
    H_BASE,
    H_MAX,
    H_MIN,
    H_SHARE,
    LAST_REJECTED,
    NQ,
    NV,
    RHS,
    RHS_CALLS,
    RTOL,
    T_GRID,
    T_START,
    T_STOP,
    T_WATCH,
    H,
    T,
)

EPS = float(np.finfo(float).eps)
SAFETY = 0.9
_FARTHEST = 100.0  # times a trial step that the first step may be
_FIRST_STEP_TRIALS = 5


@jitted
def error_scale(control, y0, y1):
    """Return the tolerance of one component, never below its round-off."""
    size = max(abs(y0), abs(y1))
    return max(control[ATOL] + control[RTOL] * size, 4.0 * EPS * size + 1e-300)


@jitted
def error_norm(control, n, y0, y1, error):
    """Return the root mean square of the first `n` components of `error`, each in units of its tolerance."""
    total = 0.0
    for i in range(n):
        ratio = error[i] / error_scale(control, y0[i], y1[i])
        total += ratio * ratio
    return math.sqrt(total / n)


@jitted
def first_step(order, addresses, sizes, p, control, counters, y, f, row, y_trial):
    """Return a first step size [s]: Hairer's HINIT (dopri5.f; Hairer, Nørsett, Wanner 1993, II.4), repeated.

    HINIT measures the derivative's change over a tiny Euler step and goes at most a hundred times as far. A mechanism
    that starts at rest has rates whose scale is the absolute tolerance alone there, so that the tiny step is far too
    tiny, and four or five steps would go by until the step has grown. Where the hundredfold is the limit, it is
    the next Euler step therefore, and scales are those of its end.

    Parameters
    ----------
    order : int
    y, f : ndarray
        State and its derivative at `control[T]`.
    row, y_trial : ndarray
        Scratch: one rhs row, one state.
    """
    n = sizes[NQ] + sizes[NV]
    size_f, size_y = 0.0, 0.0
    for i in range(n):
        scale = error_scale(control, y[i], y[i])
        size_f += (f[i] / scale) ** 2
        size_y += (y[i] / scale) ** 2
    h = 1e-6
    # Infinite where a component starts at zero and nothing but rtol is given: that says nothing about the step.
    if size_f > 1e-10 and size_y > 1e-10 and math.isfinite(size_f):
        h = 0.01 * math.sqrt(size_y / size_f)
    longest = min(longest_step(control), control[T_STOP] - control[T])
    h = min(h, longest)
    for trial in range(_FIRST_STEP_TRIALS):
        steepest = steepest_change(addresses, sizes, p, control, counters, h, y, f, row, y_trial)
        if not math.isfinite(steepest):
            return h if trial == 0 else h / _FARTHEST
        h_order = max(1e-6, 1e-3 * h) if steepest <= 1e-15 else (0.01 / steepest) ** (1.0 / order)
        if h_order <= _FARTHEST * h or h >= longest:
            return max(min(h_order, longest_step(control)), control[H_MIN])
        h = min(_FARTHEST * h, longest)
    return max(h, control[H_MIN])


@jitted
def steepest_change(addresses, sizes, p, control, counters, h, y, f, row, y_trial):
    """Return the larger of |y'| and |y''|, in units of tolerances, as an Euler step of length `h` sees them."""
    for i in range(y.shape[0]):
        y_trial[i] = y[i] + h * f[i]
    call_kernel(addresses[RHS], control[T] + h, y_trial, p, row)
    counters[RHS_CALLS] += 1
    size_f, change = 0.0, 0.0
    for i in range(sizes[NQ] + sizes[NV]):
        scale = error_scale(control, y[i], y_trial[i])
        size_f += (f[i] / scale) ** 2
        change += ((row[i] - f[i]) / scale) ** 2
    return max(math.sqrt(change) / h, math.sqrt(size_f))


@jitted
def longest_step(control):
    """Return how long a step of an adaptive method may be [s].

    Nothing here may depend on where the run ends: it is the time that the run has covered so far which says how far it
    may be safe to look ahead.
    """
    covered = control[T] - control[T_START]
    return min(control[H_MAX], control[H_BASE] + control[H_SHARE] * covered)


@jitted
def watch_is_near(control):
    """Whether the next step may pass the time that is watched."""
    return control[T] + 1.01 * min(control[H], longest_step(control)) >= control[T_WATCH]


@jitted
def step_end(control):
    """Return where the next step of an adaptive method ends: after `control[H]`, or exactly at the stop time."""
    t, stop = control[T], control[T_STOP]
    h = min(control[H], longest_step(control))
    # A step stretched by 1 % spares a tiny one after it (dopri5.f).
    return stop if t + 1.01 * h >= stop else t + h


@jitted
def grid_end(control, counters):
    """Return where the next step of a fixed-step method ends: T_GRID + k H, or exactly at the stop time."""
    h = control[H]
    k = counters[GRID_STEP] + 1
    while control[T_GRID] + k * h <= control[T] + 1e-9 * h:
        k += 1
    counters[GRID_STEP] = k - 1
    t1 = control[T_GRID] + k * h
    return control[T_STOP] if t1 >= control[T_STOP] - 1e-9 * h else t1


@jitted
def grid_length(control, t0, t1):
    """Return the length of a step of the grid [s]: exactly `control[H]` unless the step is cut at a stop time.

    The difference of the times carries the round-off of time, which would jolt a method that conserves what
    belongs to its step.
    """
    h = t1 - t0
    return control[H] if abs(h - control[H]) <= 1e-9 * control[H] + 4.0 * EPS * abs(t1) else h


@jitted
def too_small(control):
    """Whether the step size has reached its lower limit, or the round-off of time.

    Some roundings more than the two that a step's length may be off by: a step that can no longer be told from the
    one that failed would be tried for ever.
    """
    return control[H] <= max(control[H_MIN], 16.0 * EPS * abs(control[T]))


@jitted
def accept_step(exponent, beta, shrink, grow, safety, error, h, control, counters):
    """Set `control[H]` after an accepted step of length `h`: Hairer's controller with PI stabilisation."""
    wanted = control[H]
    factor = error**exponent if error > 0.0 else 0.0
    if beta != 0.0:
        factor /= control[ERROR_OLD] ** beta
    factor = max(1.0 / grow, min(1.0 / shrink, factor / safety))
    h_new = h / factor
    if h < wanted:
        # The step was cut at a stop time, which says nothing against the step that the method wanted.
        h_new = max(h_new, wanted)
    if counters[LAST_REJECTED]:
        h_new = min(h_new, h)
    control[H] = min(h_new, longest_step(control))
    control[ERROR_OLD] = max(error, 1e-4)
    counters[LAST_REJECTED] = 0


@jitted
def reject_step(exponent, shrink, safety, error, h, control, counters):
    """Set `control[H]` after a rejected step of length `h`; an `error` that is not finite shrinks it most."""
    factor = 1.0 / shrink
    if math.isfinite(error):
        factor = min(factor, error**exponent / safety)
    control[H] = h / factor
    counters[LAST_REJECTED] = 1

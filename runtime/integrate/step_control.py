"""Step size: error norms, Hairer's controller, the first step, landing on stop times, the fixed grid."""

import math

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at

EPS = float(np.finfo(float).eps)
SAFETY = 0.9
_FARTHEST = 100.0  # times a trial step that the first step may be
_FIRST_STEP_TRIALS = 5


@jitted
def error_scale(control, y0, y1):
    """Return the tolerance of one component, never below its round-off."""
    size = max(abs(y0), abs(y1))
    return max(control[at.ATOL] + control[at.RTOL] * size, 4.0 * EPS * size + 1e-300)


@jitted
def error_norm(control, n, y0, y1, error):
    """Return the root mean square of the first `n` components of `error`, each in units of its tolerance."""
    total = 0.0
    for i in range(n):
        ratio = error[i] / error_scale(control, y0[i], y1[i])
        total += ratio * ratio
    return math.sqrt(total / n)


@jitted
def first_step(order, loop, row, y_trial):
    """Return a first step size [s]: Hairer's HINIT (dopri5.f; Hairer, Nørsett, Wanner 1993, II.4), repeated.

    HINIT measures the derivative's change over a tiny Euler step and goes at most a hundred times as far. A mechanism
    that starts at rest has rates whose scale is the absolute tolerance alone there, so that the tiny step is far too
    tiny, and four or five steps would go by until the step has grown. Where the hundredfold is the limit, it is
    the next Euler step therefore, and scales are those of its end.

    Parameters
    ----------
    order : int
    row, y_trial : ndarray
        Scratch: one rhs row, one state.
    """
    n = loop.sizes[at.NQ] + loop.sizes[at.NV]
    size_f, size_y = 0.0, 0.0
    for i in range(n):
        scale = error_scale(loop.control, loop.y[i], loop.y[i])
        size_f += (loop.f[i] / scale) ** 2
        size_y += (loop.y[i] / scale) ** 2
    h = 1e-6
    # Infinite where a component starts at zero and nothing but rtol is given: that says nothing about the step.
    if size_f > 1e-10 and size_y > 1e-10 and math.isfinite(size_f):
        h = 0.01 * math.sqrt(size_y / size_f)
    longest = min(longest_step(loop.control), loop.control[at.T_STOP] - loop.control[at.T])
    h = min(h, longest)
    for trial in range(_FIRST_STEP_TRIALS):
        steepest = steepest_change(loop, h, row, y_trial)
        if not math.isfinite(steepest):
            return h if trial == 0 else h / _FARTHEST
        h_order = max(1e-6, 1e-3 * h) if steepest <= 1e-15 else (0.01 / steepest) ** (1.0 / order)
        if h_order <= _FARTHEST * h or h >= longest:
            return max(min(h_order, longest_step(loop.control)), loop.control[at.H_MIN])
        h = min(_FARTHEST * h, longest)
    return max(h, loop.control[at.H_MIN])


@jitted
def steepest_change(loop, h, row, y_trial):
    """Return the larger of |y'| and |y''|, in units of tolerances, as an Euler step of length `h` sees them."""
    for i in range(loop.y.shape[0]):
        y_trial[i] = loop.y[i] + h * loop.f[i]
    call_kernel(loop.addresses[at.RHS], loop.control[at.T] + h, y_trial, loop.p, row)
    loop.counters[at.RHS_CALLS] += 1
    size_f, change = 0.0, 0.0
    for i in range(loop.sizes[at.NQ] + loop.sizes[at.NV]):
        scale = error_scale(loop.control, loop.y[i], y_trial[i])
        size_f += (loop.f[i] / scale) ** 2
        change += ((row[i] - loop.f[i]) / scale) ** 2
    return max(math.sqrt(change) / h, math.sqrt(size_f))


@jitted
def longest_step(control):
    """Return how long a step of an adaptive method may be [s].

    Nothing here may depend on where the run ends: it is the time that the run has covered so far which says how far it
    may be safe to look ahead.
    """
    covered = control[at.T] - control[at.T_START]
    return min(control[at.H_MAX], control[at.H_BASE] + control[at.H_SHARE] * covered)


@jitted
def room_for_steps(loop, done):
    """Whether a call that has taken `done` steps may take another one: there is Python's turn, and the step log."""
    share = loop.counters[at.MAX_STEPS_PER_CALL]
    return done < share and loop.counters[at.N_LOGGED_STEPS] < loop.step_log.shape[0]


@jitted
def watch_is_near(control):
    """Whether the next step may pass the time that is watched."""
    return control[at.T] + 1.01 * min(control[at.H], longest_step(control)) >= control[at.T_WATCH]


@jitted
def step_end(control):
    """Return where the next step of an adaptive method ends: after `control[H]`, or exactly at the stop time."""
    t, stop = control[at.T], control[at.T_STOP]
    h = min(control[at.H], longest_step(control))
    # A step stretched by 1 % spares a tiny one after it (dopri5.f).
    return stop if t + 1.01 * h >= stop else t + h


@jitted
def grid_end(loop):
    """Return where the next step of a fixed-step method ends: T_GRID + k H, or exactly at the stop time."""
    h = loop.control[at.H]
    k = loop.counters[at.GRID_STEP] + 1
    while loop.control[at.T_GRID] + k * h <= loop.control[at.T] + 1e-9 * h:
        k += 1
    loop.counters[at.GRID_STEP] = k - 1
    t1 = loop.control[at.T_GRID] + k * h
    return loop.control[at.T_STOP] if t1 >= loop.control[at.T_STOP] - 1e-9 * h else t1


@jitted
def grid_length(control, t0, t1):
    """Return the length of a step of the grid [s]: exactly `control[H]` unless the step is cut at a stop time.

    The difference of the times carries the round-off of time, which would jolt a method that conserves what
    belongs to its step.
    """
    h = t1 - t0
    return control[at.H] if abs(h - control[at.H]) <= 1e-9 * control[at.H] + 4.0 * EPS * abs(t1) else h


@jitted
def smallest_step(control):
    """The lower limit of a step [s]: the one that is set, or the round-off of time.

    Some roundings more than the two that a step's length may be off by: a step that can no longer be told from the
    one that failed would be tried for ever.
    """
    return max(control[at.H_MIN], 16.0 * EPS * abs(control[at.T]))


@jitted
def too_small(control):
    """Whether the step size has reached its lower limit."""
    return control[at.H] <= smallest_step(control)


@jitted
def accept_step(method, error, h, loop):
    """Set `control[H]` after an accepted step of length `h`: Hairer's controller with PI stabilisation.

    Its numbers are `exponent`, `beta`, `shrink`, `grow` and `safety` of the method.
    """
    wanted = loop.control[at.H]
    factor = error**method.exponent if error > 0.0 else 0.0
    if method.beta != 0.0:
        factor /= loop.control[at.ERROR_OLD] ** method.beta
    factor = max(1.0 / method.grow, min(1.0 / method.shrink, factor / method.safety))
    h_new = h / factor
    if h < wanted:
        # The step was cut at a stop time, which says nothing against the step that the method wanted.
        h_new = max(h_new, wanted)
    if loop.counters[at.LAST_REJECTED]:
        h_new = min(h_new, h)
    loop.control[at.H] = min(h_new, longest_step(loop.control))
    loop.control[at.ERROR_OLD] = max(error, 1e-4)
    loop.counters[at.LAST_REJECTED] = 0


@jitted
def reject_step(method, error, h, loop):
    """Set `control[H]` after a rejected step of length `h`; an `error` that is not finite shrinks it most."""
    factor = 1.0 / method.shrink
    if math.isfinite(error):
        factor = min(factor, error**method.exponent / method.safety)
    loop.control[at.H] = h / factor
    loop.counters[at.LAST_REJECTED] = 1

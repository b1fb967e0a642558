"""What a step loop reads and carries on, as one record, and what all step loops do."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.step_control import room_for_steps, watch_is_near


@jitted
def copy(source, target):
    """Copy `source` into the first entries of `target`."""
    for i in range(source.shape[0]):
        target[i] = source[i]


@jitted
def add_compensated(increment, i, y, rest):
    """Add `increment` to `y[i]`, where `y[i] + rest[i]` is the sum as it would be without rounding.

    Kahan, Comm. ACM 8 (1965) 40; as in Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), VIII.5. The
    terms are smaller than the sum.
    """
    term = rest[i] + increment
    total = y[i] + term
    rest[i] = (y[i] - total) + term
    y[i] = total


@jitted
def all_finite(values, n):
    """Whether the first `n` values are finite."""
    total = 0.0
    for i in range(n):
        total += values[i] * 0.0
    return total == 0.0


@jitted
def evaluate(loop, t, y, row):
    """Evaluate the right-hand side into `row`; returns whether its derivatives are finite."""
    call_kernel(loop.addresses[at.RHS], t, y, loop.p, row)
    loop.counters[at.RHS_CALLS] += 1
    return all_finite(row, loop.sizes[at.NY])


class Loop(NamedTuple):
    """The arrays of one run, the same for all step loops; `layout.py` has their indexes, docs/step-loops.md more.

    Whatever a loop carries from step to step is in `control`, `counters`, `y`, `f`, `work` or `dense`, or resuming
    breaks.

    Attributes
    ----------
    addresses : ndarray of uint64, shape (N_KERNELS,)
        Of kernels; 0 where a run does not need one.
    sizes : ndarray of int64, shape (N_SIZES + NE + number of quaternions + 1,)
    p : ndarray
        Parameters, inputs and what was precomputed from them.
    control : ndarray, shape (N_CONTROL + N_EVENT_BLOCKS * NE,)
    counters : ndarray of int64, shape (N_COUNTERS,)
    y, f : ndarray, shapes (NY,), (N_ROW,)
        The state at `control[T]`, and its rhs row, valid if `counters[F_VALID]`.
    work : ndarray
        As long as the method's `work_size` says.
    frame_times, frames : ndarray, shapes (F,), (F, NY)
    step_log : ndarray, shape (S, 2)
        t and h of accepted steps.
    dense : ndarray, shape (8, NY)
        Dense output of the last accepted step.
    """

    addresses: np.ndarray
    sizes: np.ndarray
    p: np.ndarray
    control: np.ndarray
    counters: np.ndarray
    y: np.ndarray
    f: np.ndarray
    work: np.ndarray
    frame_times: np.ndarray
    frames: np.ndarray
    step_log: np.ndarray
    dense: np.ndarray


@jitted
def take_steps(step, method, loop, w):
    """Take steps until something is for Python to do: what the loops of all families do, once they have begun.

    Parameters
    ----------
    step : jitted function (method, loop, w) -> status
        Tries steps until one is accepted, and hands that to `finish_step`. A function of one family, so each family's
        loop is compiled with its own.
    method, w : named tuple
        The method's coefficients and its work arrays.

    Returns
    -------
    int
        RUNNING where the call has had its share of steps, or what `step` returned last.
    """
    done = 0
    while room_for_steps(loop, done):
        if watch_is_near(loop.control):
            return at.NEAR_WATCH
        status = step(method, loop, w)
        if status != at.RUNNING:
            return status
        done += 1
    return at.RUNNING

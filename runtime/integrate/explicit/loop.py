"""Explicit Runge-Kutta methods, adaptive and with a fixed step: one loop for all tableaus and models."""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size, finish_step, needs_dense
from symgen.runtime.integrate.baumgarte import hold_stabilisation, relaxation_time, release_stabilisation
from symgen.runtime.integrate.dense import hermite_dense
from symgen.runtime.integrate.explicit.dop853 import dop853_error, dop853_new_state, dop853_stages
from symgen.runtime.integrate.explicit.tableau import NO_ESTIMATE, TWO_ESTIMATES
from symgen.runtime.integrate.loop import all_finite, copy, evaluate, take_steps
from symgen.runtime.integrate.projection import (
    count_energy,
    project_in_passing,
    project_state,
    projection_size,
    scale_energy,
)
from symgen.runtime.integrate.step_control import (
    EPS,
    accept_step,
    error_norm,
    error_scale,
    first_step,
    grid_end,
    reject_step,
    step_end,
    too_small,
)

STIFF_AFTER = 15  # signs in a row, with fewer than NON_STIFF_AFTER steps in between that say otherwise
NON_STIFF_AFTER = 6
LOOK_EVERY = 8


@jitted
def watch_stiffness(bound, loop, h, y_new, f_new, y_stage, f_stage):
    """Count signs that stability, not accuracy, limits the step: h |f1 - f2| / |y1 - y2| > bound.

    Hairer, Wanner, Solving ODEs II (1996), IV.2, and dopri5.f, dop853.f.

    Parameters
    ----------
    bound : float
        Extent of the stability region on the negative real axis.
    y_new, f_new : ndarray
        State and derivative at the end of the step.
    y_stage, f_stage : ndarray
        The same of another stage with node 1.
    """
    if loop.counters[at.STIFF_COUNT] == 0 and loop.counters[at.STEPS] % LOOK_EVERY != 0:
        return
    n = loop.sizes[at.NQ] + loop.sizes[at.NV]
    df, dy, size = 0.0, 0.0, 0.0
    for i in range(n):
        df += (f_new[i] - f_stage[i]) ** 2
        dy += (y_new[i] - y_stage[i]) ** 2
        size += y_new[i] ** 2
    # Two stages that agree to round-off say nothing.
    if dy > (64.0 * EPS) ** 2 * size and h * math.sqrt(df / dy) > bound:
        loop.counters[at.NON_STIFF_COUNT] = 0
        loop.counters[at.STIFF_COUNT] += 1
    elif loop.counters[at.STIFF_COUNT] > 0:
        loop.counters[at.NON_STIFF_COUNT] += 1
        if (
            loop.counters[at.NON_STIFF_COUNT] >= NON_STIFF_AFTER
            and loop.counters[at.STIFF_COUNT] < STIFF_AFTER
        ):
            loop.counters[at.STIFF_COUNT] = 0
            loop.counters[at.NON_STIFF_COUNT] = 0


N_STATES = 4


class ErkWork(NamedTuple):
    """Work arrays of an explicit Runge-Kutta method.

    Attributes
    ----------
    stages : ndarray, shape (n_rows, N_ROW)
        Derivatives at the stages.
    states : ndarray, shape (N_STATES, NY)
        Argument of a stage, new state, two error estimates.
    scratch : ndarray
        See `finish_step`.
    """

    stages: np.ndarray
    states: np.ndarray
    scratch: np.ndarray


@jitted
def erk_work_size(n_rows, sizes):
    """Length of `work` for a tableau of `n_rows` rows."""
    return n_rows * sizes[at.N_ROW] + N_STATES * sizes[at.NY] + finish_scratch_size(sizes)


@jitted
def erk_work(n_rows, sizes, work):
    """Divide `work`, of length `erk_work_size(n_rows, sizes)`, into an `ErkWork`."""
    ny, n_row = sizes[at.NY], sizes[at.N_ROW]
    stages, rest = work[: n_rows * n_row].reshape((n_rows, n_row)), work[n_rows * n_row :]
    states, rest = rest[: N_STATES * ny].reshape((N_STATES, ny)), rest[N_STATES * ny :]
    return ErkWork(stages, states, rest)


@jitted
def advance_erk(method, loop):
    """Advance with an explicit Runge-Kutta method until something is for Python to do.

    Arguments and result are those of all step loops, see docs/step-loops.md; `method` is an `ErkTableau`.
    """
    w = erk_work(method.n_rows, loop.sizes, loop.work)
    if not loop.counters[at.F_VALID]:
        if not evaluate(loop, loop.control[at.T], loop.y, loop.f):
            return at.NOT_FINITE
        loop.counters[at.F_VALID] = 1
    if method.estimate != NO_ESTIMATE and loop.control[at.H] <= 0.0:
        loop.control[at.H] = first_step(method.order, loop, w.stages[0], w.states[0])
        loop.control[at.ERROR_OLD] = 1e-4
    return take_steps(erk_step, method, loop, w)


@jitted
def erk_step(method, loop, w):
    """Take an accepted step, or one of the grid, and record it; returns a status."""
    t0 = loop.control[at.T]
    if method.estimate == NO_ESTIMATE:
        status, t1 = fixed_step(method, loop, w)
    else:
        status, t1 = adaptive_step(method, loop, w)
    if status != at.RUNNING:
        return status
    return commit_step(method, loop, t0, t1, w)


@jitted
def adaptive_step(method, loop, w):
    """Try steps until one is accepted.

    `w.states[1]` is then the new state, row `n_stages - fsal` of `w.stages` its derivative.

    Returns
    -------
    tuple
        Status and the time of the new state [s].
    """
    cause = at.STEP_TOO_SMALL
    while True:
        t, t1 = loop.control[at.T], step_end(loop.control)
        h = t1 - t
        if too_small(loop.control):
            return cause, t
        copy(loop.f, w.stages[0])
        buffer = w.scratch[: projection_size(loop.sizes)]
        hold_stabilisation(loop, t, relaxation_time(loop, h), w.stages[0], buffer)
        take_stages(method, loop, t, h, w)
        error = estimate_error(method, loop, h, w)
        cause = at.STEP_TOO_SMALL
        if error <= 1.0:
            cause = reach_end(method, loop, t1, w)
            if cause == at.RUNNING:
                accept_step(method, error, h, loop)
                return at.RUNNING, t1
            error = math.inf
        elif not math.isfinite(error):
            cause = at.NOT_FINITE
        reject_step(method, error, h, loop)
        loop.counters[at.REJECTED] += 1


@jitted
def fixed_step(method, loop, w):
    """Take one step of the fixed grid; returns status and the time of the new state [s]."""
    copy(loop.f, w.stages[0])
    t, t1 = loop.control[at.T], grid_end(loop)
    hold_stabilisation(loop, t, t1 - t, w.stages[0], w.scratch[: projection_size(loop.sizes)])
    take_stages(method, loop, t, t1 - t, w)
    return reach_end(method, loop, t1, w), t1


@jitted
def take_stages(method, loop, t, h, w):
    """Fill the stages from 1 on, `w.states[0]` (argument of the stage before the new state), `w.states[1]`."""
    k, states = w.stages, w.states
    if method.estimate == TWO_ESTIMATES:
        dop853_stages(method, loop.addresses[at.RHS], t, h, loop.y, loop.p, k, states[0])
        dop853_new_state(method.b, h, loop.y, k, states[1])
    else:
        last = method.n_stages - method.fsal
        erk_stages(method, loop, 1, last, t, h, k, states[0])
        erk_sum(method.a[last], last, h, loop.y, k, states[1])
        if method.fsal:
            call_kernel(loop.addresses[at.RHS], t + h, states[1], loop.p, k[method.n_stages - 1])
    loop.counters[at.RHS_CALLS] += method.n_stages - 1


@jitted
def erk_stages(method, loop, first, end, t, h, k, y_stage):
    """Fill rows `first` to `end` - 1 of `k`; rows before are given, `y_stage` is left at the last argument."""
    for s in range(first, end):
        erk_sum(method.a[s], s, h, loop.y, k, y_stage)
        call_kernel(loop.addresses[at.RHS], t + method.c[s] * h, y_stage, loop.p, k[s])


@jitted(distinct_arrays=True)
def erk_sum(weights, n_rows, h, y, k, out):
    """Write y + h Σ weights[j] k[j] over the first `n_rows` rows to `out`."""
    n = y.shape[0]
    first = h * weights[0]
    for i in range(n):
        out[i] = y[i] + first * k[0, i]
    for j in range(1, n_rows):
        weight = h * weights[j]
        if weight != 0.0:
            for i in range(n):
                out[i] += weight * k[j, i]


@jitted
def estimate_error(method, loop, h, w):
    """Return the error of the step in units of the tolerance; work is left out, it follows the motion."""
    k = w.stages
    n = loop.sizes[at.NQ] + loop.sizes[at.NV]
    y_new, error = w.states[1], w.states[2]
    if method.estimate == TWO_ESTIMATES:
        third = w.states[3]
        dop853_error(method.error, k, n, error, third)
        return h * norm_of_two(loop.control, n, loop.y, y_new, error, third)
    for i in range(n):
        error[i] = 0.0
    for j in range(method.n_stages):
        weight = h * method.error[0, j]
        for i in range(n):
            error[i] += weight * k[j, i]
    return error_norm(loop.control, n, loop.y, y_new, error)


@jitted
def norm_of_two(control, n, y0, y1, fifth, third):
    """Return dop853's error norm of its two estimates, the error of one being in doubt where the other's is large."""
    sum_5, sum_3 = 0.0, 0.0
    for i in range(n):
        scale = error_scale(control, y0[i], y1[i])
        sum_5 += (fifth[i] / scale) ** 2
        sum_3 += (third[i] / scale) ** 2
    # dop853.f: both vanish together, at rest or on a polynomial.
    below = sum_5 + 0.01 * sum_3
    return sum_5 / math.sqrt(n * below) if below != 0.0 else 0.0


@jitted
def reach_end(method, loop, t1, w):
    """Project the new state and evaluate its derivative; returns why that failed, or RUNNING."""
    y_new, row = w.states[1], w.stages[method.n_stages - method.fsal]
    if loop.addresses[at.PROJECT] != 0:
        buffer = w.scratch[: projection_size(loop.sizes)]
        if method.estimate == NO_ESTIMATE or t1 >= loop.control[at.T_STOP]:
            status = project_state(loop, t1, y_new, buffer)
        else:
            status = project_in_passing(loop, t1, y_new, buffer)
        if status != at.RUNNING:
            return status
        scale_energy(loop, t1, y_new, w.scratch)
    held = release_stabilisation(loop)
    if held or loop.addresses[at.PROJECT] != 0 or not method.fsal:
        if not evaluate(loop, t1, y_new, row):
            return at.NOT_FINITE
    if loop.sizes[at.NM] > 0:
        least = loop.control[at.MIN_PIVOT_RATIO]
        for s in range(1, method.n_stages - method.fsal + 1):
            least = min(least, w.stages[s, loop.sizes[at.N_ROW] - 1])
        loop.control[at.MIN_PIVOT_RATIO] = least
    if not (all_finite(y_new, loop.sizes[at.NY]) and all_finite(row, loop.sizes[at.NY])):
        return at.NOT_FINITE
    if method.stiff_bound > 0.0:
        before = w.stages[method.n_stages - method.fsal - 1]
        watch_stiffness(method.stiff_bound, loop, t1 - loop.control[at.T], y_new, row, w.states[0], before)
    return at.RUNNING


@jitted
def commit_step(method, loop, t0, t1, w):
    """Make the new state the current one, with dense output where somebody reads it, and record the step."""
    if needs_dense(loop, t1):
        erk_dense(method, loop, t0, t1 - t0, w)
    count_energy(loop)
    copy(w.states[1], loop.y)
    copy(w.stages[method.n_stages - method.fsal], loop.f)
    status = finish_step(loop, t0, t1, loop.dense, method.n_dense, w.scratch)
    row = loop.counters[at.NEXT_FRAME] - 1
    in_passing = status == at.RUNNING and method.estimate != NO_ESTIMATE and loop.addresses[at.PROJECT] != 0
    if in_passing and row >= 0 and loop.frame_times[row] == t1:
        # The state goes on as it is, watched or not; what is shown is on the constraints.
        project_state(loop, t1, loop.frames[row], w.scratch[: projection_size(loop.sizes)])
    return status


@jitted
def erk_dense(method, loop, t, h, w):
    """Fill the dense output of the step; further stages are taken here, so only for steps that need them."""
    first_extra = method.n_stages + 1 - method.fsal
    erk_stages(method, loop, first_extra, method.n_rows, t, h, w.stages, w.states[0])
    loop.counters[at.RHS_CALLS] += method.n_rows - first_extra
    combine_dense(method, loop, h, w)


@jitted
def combine_dense(method, loop, h, w):
    """Fill the dense output from all stages, those that it takes for itself among them."""
    ny, k, dense = loop.sizes[at.NY], w.stages, loop.dense
    hermite_dense(loop.y, w.states[1], k[0], k[method.n_stages - method.fsal], h, ny, dense)
    for r in range(method.n_dense - 4):
        for i in range(ny):
            dense[4 + r, i] = 0.0
        for j in range(method.n_rows):
            weight = h * method.dense[r, j]
            if weight != 0.0:
                for i in range(ny):
                    dense[4 + r, i] += weight * k[j, i]

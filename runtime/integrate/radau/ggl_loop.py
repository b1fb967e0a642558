"""Radau IIA of order 5, 9 and 13 on the stabilised index-2 equations of Gear, Gupta and Leimkuhler."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.after_step import finish_step, needs_dense
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.ggl import divide_blocks, set_blocks
from symgen.runtime.integrate.layout import (
    MAX_STEPS_PER_CALL,
    MIN_PIVOT_RATIO,
    N_LOGGED_STEPS,
    N_ROW,
    NEAR_WATCH,
    NOT_FINITE,
    NQ,
    NV,
    NY,
    RUNNING,
    STEP_TOO_SMALL,
    T,
)
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.radau.error import set_tolerances
from symgen.runtime.integrate.radau.ggl_course import fit_turns, keep_course, sample_turns
from symgen.runtime.integrate.radau.ggl_error import estimate_index2
from symgen.runtime.integrate.radau.ggl_stages import factor_index2, predict_index2, solve_index2
from symgen.runtime.integrate.radau.ggl_turns import KEEP_TURN, largest_turn, to_body_axes, turn_blocks
from symgen.runtime.integrate.radau.ggl_work import ggl_work
from symgen.runtime.integrate.radau.loop import (
    accept_radau,
    begin_radau,
    radau_dense,
    reject_radau,
    shrink_step,
)
from symgen.runtime.integrate.radau.stages import integrate_work
from symgen.runtime.integrate.radau.turns import place
from symgen.runtime.integrate.radau.work import (
    F_NEW,
    FACTORED_FOR,
    HAVE_FACTORS,
    HAVE_HISTORY,
    HAVE_JACOBIAN,
    JACOBIAN_IS_FRESH,
    STAGES,
    Y_NEW,
)
from symgen.runtime.integrate.step_control import step_end, too_small, watch_is_near


@jitted
def advance_radau_ggl(
    method, addresses, sizes, p, control, counters, y, f, work, frame_times, frames, step_log, dense
):
    """Advance with Radau IIA on index-2 equations until something is for Python to do.

    Hairer, Lubich, Roche, The Numerical Solution of Differential-Algebraic Systems by Runge-Kutta Methods (1989): order
    2 s - 1 in positions and rates. Tolerances, controllers and tests are those of `advance_radau`. The end of a step
    satisfies the constraints up to Newton's remainder, which the projection takes away.
    Arguments and result are those of all step loops, see docs/architecture.md; `method` is a `RadauGgl`.
    """
    w = ggl_work(method, sizes, work)
    if not begin_radau(method, addresses, sizes, p, control, counters, y, f, w):
        return NOT_FINITE
    done = 0
    while done < counters[MAX_STEPS_PER_CALL] and counters[N_LOGGED_STEPS] < step_log.shape[0]:
        if watch_is_near(control):
            return NEAR_WATCH
        t0 = control[T]
        status, t1 = index2_step(method, addresses, sizes, p, control, counters, y, f, w, dense)
        if status != RUNNING:
            return status
        status = commit_index2(
            method, addresses, sizes, p, control, counters, t0, t1, y, f, w, frame_times, frames, step_log, dense
        )  # fmt: skip
        if status != RUNNING:
            return status
        done += 1
    return RUNNING


@jitted
def index2_step(method, addresses, sizes, p, control, counters, y, f, w, dense):
    """Try steps until one is accepted: `w.states[Y_NEW]` is then the new state, `w.rows[F_NEW]` its rhs row.

    Returns
    -------
    tuple
        Status and the time of the new state [s].
    """
    set_tolerances(method, sizes, control, y, w)
    cause = STEP_TOO_SMALL
    while True:
        t, t1 = control[T], step_end(control)
        h = t1 - t
        if too_small(control):
            return cause, t
        if not counters[HAVE_JACOBIAN]:
            b = divide_blocks(sizes, w.blocks)
            status = set_blocks(addresses, sizes, p, counters, t, y, f, w.implicit, b)
            if status != RUNNING:
                return status, t
            turn_blocks(sizes, y, f, b)
            counters[HAVE_JACOBIAN], counters[JACOBIAN_IS_FRESH], counters[HAVE_FACTORS] = 1, 1, 0
        cause = try_index2(method, h, addresses, sizes, p, control, counters, t, y, w, dense)
        if cause != RUNNING:
            shrink_step(cause, h, control, counters, w)
            continue
        error = estimate_index2(method, h, addresses, sizes, p, counters, t, y, f, w)
        cause = STEP_TOO_SMALL if math.isfinite(error) else NOT_FINITE
        if error < 1.0:
            cause = reach_end(method, h, addresses, sizes, p, control, counters, t, t1, y, w)
            if cause == RUNNING:
                accept_radau(method, error, h, control, counters, w)
                if largest_turn(sizes, w) > KEEP_TURN:
                    counters[HAVE_JACOBIAN] = 0
                return RUNNING, t1
            error = math.inf
        reject_radau(method, error, h, control, counters, w)


@jitted
def try_index2(method, h, addresses, sizes, p, control, counters, t, y, w, dense):
    """Solve the stages of a step of length `h`; returns RUNNING or why that failed."""
    # Lengths of equal steps differ by round-off of time, which is nothing to Newton.
    if not counters[HAVE_FACTORS] or abs(h - w.numbers[FACTORED_FOR]) > 1e-6 * h:
        counters[HAVE_FACTORS] = 0
        status = factor_index2(method, h, sizes, counters, w)
        if status != RUNNING:
            return status
        counters[HAVE_FACTORS] = 1
    extrapolate = counters[HAVE_HISTORY] != 0
    if not predict_index2(method, h, extrapolate, addresses, sizes, p, control, counters, t, y, dense, w):
        return NOT_FINITE
    return solve_index2(method, h, addresses, sizes, p, counters, t, y, w)


@jitted
def reach_end(method, h, addresses, sizes, p, control, counters, t0, t1, y, w):
    """Write the new state and its rhs row; returns why not, or RUNNING."""
    to_body_axes(sizes, y, w)
    if not integrate_work(method, h, addresses, sizes, p, counters, t0, y, w):
        return NOT_FINITE
    y_new, row = w.states[Y_NEW], w.rows[F_NEW]
    place(sizes, y, w.states[STAGES + len(method.c) - 1], y_new)
    status = project_state(
        addresses, sizes, p, t1, y_new, control, counters, w.scratch[: projection_size(sizes)]
    )
    if status != RUNNING:
        return status
    if not evaluate(addresses, sizes, p, counters, t1, y_new, row):
        return NOT_FINITE
    control[MIN_PIVOT_RATIO] = min(control[MIN_PIVOT_RATIO], row[sizes[N_ROW] - 1])
    return RUNNING if all_finite(y_new, sizes[NY]) else NOT_FINITE


@jitted
def commit_index2(
    method, addresses, sizes, p, control, counters, t0, t1, y, f, w, frame_times, frames, step_log, dense
):
    """Make the new state the current one, with dense output, and record the step."""
    keep_course(method, sizes, y, w)
    n_terms, turned_is_read = len(method.c) + 1, False
    if sizes[NQ] > sizes[NV] and needs_dense(sizes, counters, frame_times, t1):
        n_terms, turned_is_read = dense.shape[0], True
        sample_turns(method, sizes, y, w)
    radau_dense(method, sizes, y, w, dense)
    if turned_is_read:
        fit_turns(method, sizes, w, dense)
    copy(w.states[Y_NEW], y)
    copy(w.rows[F_NEW], f)
    return finish_step(
        addresses, sizes, p, control, counters, t0, t1, y, dense, n_terms, w.scratch,
        frame_times, frames, step_log,
    )  # fmt: skip

"""Radau IIA of order 5, 9 and 13 on the stabilised index-2 equations of Gear, Gupta and Leimkuhler."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_step, needs_dense
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.ggl import divide_blocks, set_blocks
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.radau.error import set_tolerances
from symgen.runtime.integrate.radau.ggl_dense_output import (
    fit_rotations,
    keep_rotation_polynomials,
    sample_rotations,
)
from symgen.runtime.integrate.radau.ggl_error import estimate_index2
from symgen.runtime.integrate.radau.ggl_rotations import (
    KEEP_ROTATION,
    largest_rotation,
    rotate_blocks,
    to_body_axes,
)
from symgen.runtime.integrate.radau.ggl_stages import factor_index2, predict_index2, solve_index2
from symgen.runtime.integrate.radau.ggl_work import ggl_work
from symgen.runtime.integrate.radau.loop import (
    accept_radau,
    begin_radau,
    radau_dense,
    reject_radau,
    shrink_step,
)
from symgen.runtime.integrate.radau.rotation_increments import place
from symgen.runtime.integrate.radau.stages import integrate_work
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
def advance_radau_ggl(method, loop):
    """Advance with Radau IIA on index-2 equations until something is for Python to do.

    Hairer, Lubich, Roche, The Numerical Solution of Differential-Algebraic Systems by Runge-Kutta Methods (1989): order
    2 s - 1 in positions and rates. Tolerances, controllers and tests are those of `advance_radau`. The end of a step
    satisfies the constraints up to Newton's remainder, which the projection takes away.
    Arguments and result are those of all step loops, see docs/architecture.md; `method` is a `RadauGgl`.
    """
    w = ggl_work(method, loop.sizes, loop.work)
    if not begin_radau(method, loop, w):
        return at.NOT_FINITE
    done = 0
    while (
        done < loop.counters[at.MAX_STEPS_PER_CALL]
        and loop.counters[at.N_LOGGED_STEPS] < loop.step_log.shape[0]
    ):
        if watch_is_near(loop.control):
            return at.NEAR_WATCH
        t0 = loop.control[at.T]
        status, t1 = index2_step(method, loop, w)
        if status != at.RUNNING:
            return status
        status = commit_index2(method, loop, t0, t1, w)
        if status != at.RUNNING:
            return status
        done += 1
    return at.RUNNING


@jitted
def index2_step(method, loop, w):
    """Try steps until one is accepted: `w.states[Y_NEW]` is then the new state, `w.rows[F_NEW]` its rhs row.

    Returns
    -------
    tuple
        Status and the time of the new state [s].
    """
    set_tolerances(method, loop, w)
    cause = at.STEP_TOO_SMALL
    while True:
        t, t1 = loop.control[at.T], step_end(loop.control)
        h = t1 - t
        if too_small(loop.control):
            return cause, t
        if not loop.counters[HAVE_JACOBIAN]:
            b = divide_blocks(loop.sizes, w.blocks)
            status = set_blocks(loop, t, loop.y, loop.f, w.implicit, b)
            if status != at.RUNNING:
                return status, t
            rotate_blocks(loop.sizes, loop.y, loop.f, b)
            loop.counters[HAVE_JACOBIAN], loop.counters[JACOBIAN_IS_FRESH], loop.counters[HAVE_FACTORS] = (
                1,
                1,
                0,
            )
        cause = try_index2(method, h, loop, t, w)
        if cause != at.RUNNING:
            shrink_step(cause, h, loop, w)
            continue
        error = estimate_index2(method, h, loop, t, w)
        cause = at.STEP_TOO_SMALL if math.isfinite(error) else at.NOT_FINITE
        if error < 1.0:
            cause = reach_end(method, h, loop, t, t1, w)
            if cause == at.RUNNING:
                accept_radau(method, error, h, loop, w)
                if largest_rotation(loop.sizes, w) > KEEP_ROTATION:
                    loop.counters[HAVE_JACOBIAN] = 0
                return at.RUNNING, t1
            error = math.inf
        reject_radau(method, error, h, loop, w)


@jitted
def try_index2(method, h, loop, t, w):
    """Solve the stages of a step of length `h`; returns RUNNING or why that failed."""
    # Lengths of equal steps differ by round-off of time, which is nothing to Newton.
    if not loop.counters[HAVE_FACTORS] or abs(h - w.numbers[FACTORED_FOR]) > 1e-6 * h:
        loop.counters[HAVE_FACTORS] = 0
        status = factor_index2(method, h, loop, w)
        if status != at.RUNNING:
            return status
        loop.counters[HAVE_FACTORS] = 1
    extrapolate = loop.counters[HAVE_HISTORY] != 0
    if not predict_index2(method, h, extrapolate, loop, t, w):
        return at.NOT_FINITE
    return solve_index2(method, h, loop, t, w)


@jitted
def reach_end(method, h, loop, t0, t1, w):
    """Write the new state and its rhs row; returns why not, or RUNNING."""
    to_body_axes(loop.sizes, loop.y, w)
    if not integrate_work(method, h, loop, t0, w):
        return at.NOT_FINITE
    y_new, row = w.states[Y_NEW], w.rows[F_NEW]
    place(loop.sizes, loop.y, w.states[STAGES + len(method.c) - 1], y_new)
    status = project_state(loop, t1, y_new, w.scratch[: projection_size(loop.sizes)])
    if status != at.RUNNING:
        return status
    if not evaluate(loop, t1, y_new, row):
        return at.NOT_FINITE
    loop.control[at.MIN_PIVOT_RATIO] = min(loop.control[at.MIN_PIVOT_RATIO], row[loop.sizes[at.N_ROW] - 1])
    return at.RUNNING if all_finite(y_new, loop.sizes[at.NY]) else at.NOT_FINITE


@jitted
def commit_index2(method, loop, t0, t1, w):
    """Make the new state the current one, with dense output, and record the step."""
    keep_rotation_polynomials(method, loop.sizes, loop.y, w)
    n_terms, rotated_is_read = len(method.c) + 1, False
    if loop.sizes[at.NQ] > loop.sizes[at.NV] and needs_dense(loop, t1):
        n_terms, rotated_is_read = loop.dense.shape[0], True
        sample_rotations(method, loop.sizes, loop.y, w)
    radau_dense(method, loop.sizes, loop.y, w, loop.dense)
    if rotated_is_read:
        fit_rotations(method, loop.sizes, w, loop.dense)
    copy(w.states[Y_NEW], loop.y)
    copy(w.rows[F_NEW], loop.f)
    return finish_step(loop, t0, t1, loop.dense, n_terms, w.scratch)

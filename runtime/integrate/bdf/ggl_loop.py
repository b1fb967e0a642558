"""Numerical differentiation formulas on the stabilised index-2 equations of Gear, Gupta and Leimkuhler."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.after_step import finish_step, needs_dense
from symgen.runtime.integrate.bdf.control import choose_step_and_order, shorten_step
from symgen.runtime.integrate.bdf.ggl_newton import solve_index2
from symgen.runtime.integrate.bdf.ggl_work import bdf_ggl_work
from symgen.runtime.integrate.bdf.history import add_point, history_dense, predict, resample
from symgen.runtime.integrate.bdf.loop import (
    FAILURES_TO_RESTART,
    N_DENSE,
    continue_from_event,
    norm,
    reach_end,
    restart,
    set_tolerances,
    step_end,
)
from symgen.runtime.integrate.bdf.work import (
    CHANGE,
    FAILURES,
    HAVE_JACOBIAN,
    KEPT,
    NEWEST,
    ORDER,
    SPACING,
    Y_NEW,
)
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.layout import (
    EVENT,
    F_VALID,
    MAX_STEPS_PER_CALL,
    N_LOGGED_STEPS,
    NEAR_WATCH,
    NOT_FINITE,
    RUNNING,
    STEP_TOO_SMALL,
    T,
)
from symgen.runtime.integrate.step_control import EPS, too_small, watch_is_near


@jitted
def advance_bdf_ggl(
    method, addresses, sizes, p, control, counters, y, f, work, frame_times, frames, step_log, dense
):
    """Advance with `Formulas` of variable order on index-2 equations until something is for Python to do.

    Steps, orders and history are those of `advance_bdf`, which see; Lötstedt, Petzold, Math. Comp. 46 (1986) 491,
    prove their order for these equations. Multipliers have no part in the error; what Newton leaves of the constraints
    is projected away.
    """
    w = bdf_ggl_work(sizes, work)
    if not counters[F_VALID]:
        if not continue_from_event(addresses, sizes, p, control, counters, y, w):
            counters[HAVE_JACOBIAN] = 0
            if not restart(addresses, sizes, p, control, counters, y, f, w):
                return NOT_FINITE
        counters[F_VALID] = 1
    done = 0
    while done < counters[MAX_STEPS_PER_CALL] and counters[N_LOGGED_STEPS] < step_log.shape[0]:
        if watch_is_near(control):
            return NEAR_WATCH
        t0 = control[T]
        status, t1, error = index2_step(method, addresses, sizes, p, control, counters, y, f, w)
        if status != RUNNING:
            return status
        add_point(sizes, counters[ORDER], w)
        w.numbers[NEWEST] = t1
        if needs_dense(sizes, counters, frame_times, t1):
            history_dense(method, sizes, counters[ORDER], y, w, dense)
        copy(w.states[Y_NEW], y)
        choose_step_and_order(method, error, sizes, control, counters, w)
        status = finish_step(
            addresses, sizes, p, control, counters, t0, t1, y, dense, N_DENSE, w.scratch,
            frame_times, frames, step_log,
        )  # fmt: skip
        if status == EVENT:
            copy(y, w.states[KEPT])
        if status != RUNNING:
            return status
        done += 1
    return RUNNING


@jitted
def index2_step(method, addresses, sizes, p, control, counters, y, f, w):
    """Try steps until one is accepted: `w.states[Y_NEW]` is then the new state, `w.states[CHANGE]` what predicts not.

    Returns
    -------
    tuple
        Status, the time of the new state [s], and the estimated error in units of the tolerance.
    """
    cause = STEP_TOO_SMALL
    while True:
        t, t1 = control[T], step_end(control)
        if too_small(control):
            return cause, t, 0.0
        h = t1 - t
        if abs(h - w.numbers[SPACING]) > 1e-9 * h + 4.0 * EPS * abs(t1):
            resample(sizes, counters, 0.0, h / w.numbers[SPACING], w)
        h = w.numbers[SPACING]
        order = counters[ORDER]
        predict(method, sizes, order, w)
        set_tolerances(sizes, control, w)
        error = math.inf
        cause = solve_index2(method.alpha[order] / h, addresses, sizes, p, counters, t1, w)
        solved = cause == RUNNING
        if solved:
            error = method.error[order] * norm(sizes, w.states[CHANGE], w)
            cause = STEP_TOO_SMALL if math.isfinite(error) else NOT_FINITE
        if error <= 1.0:
            cause = reach_end(method.alpha[order] / h, addresses, sizes, p, control, counters, t1, w)
            if cause == RUNNING:
                return RUNNING, t1, error
            error = math.inf
        shorten_step(solved, error, h, control, counters, w)
        if counters[FAILURES] >= FAILURES_TO_RESTART and order > 1:
            if not restart(addresses, sizes, p, control, counters, y, f, w):
                return NOT_FINITE, t, 0.0

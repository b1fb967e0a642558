"""Numerical differentiation formulas on the stabilised index-2 equations of Gear, Gupta and Leimkuhler."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
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
from symgen.runtime.integrate.step_control import EPS, too_small, watch_is_near


@jitted
def advance_bdf_ggl(method, loop):
    """Advance with `Formulas` of variable order on index-2 equations until something is for Python to do.

    Steps, orders and history are those of `advance_bdf`, which see; Lötstedt, Petzold, Math. Comp. 46 (1986) 491,
    prove their order for these equations. Multipliers have no part in the error; what Newton leaves of the constraints
    is projected away.
    """
    w = bdf_ggl_work(loop.sizes, loop.work)
    if not loop.counters[at.F_VALID]:
        if not continue_from_event(loop, w):
            loop.counters[HAVE_JACOBIAN] = 0
            if not restart(loop, w):
                return at.NOT_FINITE
        loop.counters[at.F_VALID] = 1
    done = 0
    while (
        done < loop.counters[at.MAX_STEPS_PER_CALL]
        and loop.counters[at.N_LOGGED_STEPS] < loop.step_log.shape[0]
    ):
        if watch_is_near(loop.control):
            return at.NEAR_WATCH
        t0 = loop.control[at.T]
        status, t1, error = index2_step(method, loop, w)
        if status != at.RUNNING:
            return status
        add_point(loop.sizes, loop.counters[ORDER], w)
        w.numbers[NEWEST] = t1
        if needs_dense(loop, t1):
            history_dense(method, loop.sizes, loop.counters[ORDER], loop.y, w, loop.dense)
        copy(w.states[Y_NEW], loop.y)
        choose_step_and_order(method, error, loop, w)
        status = finish_step(loop, t0, t1, loop.dense, N_DENSE, w.scratch)
        if status == at.EVENT:
            copy(loop.y, w.states[KEPT])
        if status != at.RUNNING:
            return status
        done += 1
    return at.RUNNING


@jitted
def index2_step(method, loop, w):
    """Try steps until one is accepted: `w.states[Y_NEW]` is then the new state, `w.states[CHANGE]` what predicts not.

    Returns
    -------
    tuple
        Status, the time of the new state [s], and the estimated error in units of the tolerance.
    """
    cause = at.STEP_TOO_SMALL
    while True:
        t, t1 = loop.control[at.T], step_end(loop.control)
        if too_small(loop.control):
            return cause, t, 0.0
        h = t1 - t
        if abs(h - w.numbers[SPACING]) > 1e-9 * h + 4.0 * EPS * abs(t1):
            resample(loop, 0.0, h / w.numbers[SPACING], w)
        h = w.numbers[SPACING]
        order = loop.counters[ORDER]
        predict(method, loop.sizes, order, w)
        set_tolerances(loop, w)
        error = math.inf
        cause = solve_index2(method.alpha[order] / h, loop, t1, w)
        solved = cause == at.RUNNING
        if solved:
            error = method.error[order] * norm(loop.sizes, w.states[CHANGE], w)
            cause = at.STEP_TOO_SMALL if math.isfinite(error) else at.NOT_FINITE
        if error <= 1.0:
            cause = reach_end(method.alpha[order] / h, loop, t1, w)
            if cause == at.RUNNING:
                return at.RUNNING, t1, error
            error = math.inf
        shorten_step(solved, error, h, loop, w)
        if loop.counters[FAILURES] >= FAILURES_TO_RESTART and order > 1:
            if not restart(loop, w):
                return at.NOT_FINITE, t, 0.0

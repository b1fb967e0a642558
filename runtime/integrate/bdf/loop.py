"""Numerical differentiation formulas of variable order, 1 to 5, and step, for stiff systems."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.after_step import finish_step, needs_dense
from symgen.runtime.integrate.bdf.control import choose_step_and_order, shorten_step
from symgen.runtime.integrate.bdf.history import WORK_BY_POWER, add_point, history_dense, predict, resample
from symgen.runtime.integrate.bdf.newton import solve_step
from symgen.runtime.integrate.bdf.singular import allow_for_singularity, is_near_singular, leave_singularity
from symgen.runtime.integrate.bdf.work import (
    CHANGE,
    FAILURES,
    HAVE_HISTORY,
    HAVE_JACOBIAN,
    JACOBIAN_IS_FRESH,
    KEPT,
    N_EQUAL,
    NEWEST,
    NEWTON_BOUND,
    ORDER,
    PAST,
    POWER,
    POWER_BEFORE,
    PREDICTED,
    SCALE,
    SPACING,
    Y_NEW,
    bdf_work,
)
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.layout import (
    EVENT,
    F_VALID,
    LAST_REJECTED,
    MAX_STEPS_PER_CALL,
    MIN_PIVOT_RATIO,
    N_LOGGED_STEPS,
    N_ROW,
    NEAR_WATCH,
    NEWTON_TOL,
    NM,
    NOT_FINITE,
    NQ,
    NV,
    NW,
    NY,
    RTOL,
    RUNNING,
    STEP_TOO_SMALL,
    T_STOP,
    H,
    T,
)
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.step_control import (
    EPS,
    error_scale,
    first_step,
    longest_step,
    too_small,
    watch_is_near,
)

N_DENSE = 6
# So many failures in a row say that the past is no guide to the future.
FAILURES_TO_RESTART = 4
ROUND_OFF = 16.0 * EPS


@jitted
def advance_bdf(
    method, addresses, sizes, p, control, counters, y, f, work, frame_times, frames, step_log, dense
):
    """Advance with `Formulas` of variable order until something is for Python to do.

    Shampine, Reichelt, SIAM J. Sci. Comput. 18 (1997) 1: backward differences over points of equal distance, which
    are interpolated to new distances when the step changes. q is eliminated from the Newton systems, which have the
    size of v. Only the newest point is projected onto the constraints, and so are all those behind it: Eich, SIAM J.
    Numer. Anal. 30 (1993) 1467, proves that this keeps the order. Where an event stops a step and nothing changes the
    state, the history is moved there. Work is a component like others, but has no part in any norm. The row `f` serves
    as scratch; F_VALID says that nobody has changed the state. Arguments and result are those of all step loops, see
    docs/architecture.md.
    """
    w = bdf_work(sizes, work)
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
        status, t1, error = bdf_step(method, addresses, sizes, p, control, counters, y, f, w)
        if status != RUNNING:
            return status
        add_point(sizes, counters[ORDER], w)
        w.numbers[NEWEST] = t1
        if needs_dense(sizes, counters, frame_times, t1):
            history_dense(method, sizes, counters[ORDER], y, w, dense)
        copy(w.states[Y_NEW], y)
        choose_step_and_order(method, error, sizes, control, counters, w)
        leave_singularity(control, w)
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
def continue_from_event(addresses, sizes, p, control, counters, y, w):
    """Move the history to the event that stopped the last call; False where there is none for the state `y`."""
    if not counters[HAVE_HISTORY] or control[H] <= 0.0:
        return False
    for i in range(sizes[NY]):
        if y[i] != w.states[KEPT, i]:
            return False
    resample(sizes, counters, (control[T] - w.numbers[NEWEST]) / w.numbers[SPACING], 1.0, w)
    copy(y, w.differences[0])
    w.numbers[NEWEST] = control[T]
    if sizes[NW] > 0:
        if not evaluate(addresses, sizes, p, counters, control[T], y, w.row):
            return False
        w.numbers[POWER] = w.row[sizes[NQ] + sizes[NV]]
    return True


@jitted
def restart(addresses, sizes, p, control, counters, y, f, w):
    """Begin with order 1 and a step that suits it; returns whether derivatives are finite."""
    if not evaluate(addresses, sizes, p, counters, control[T], y, f):
        return False
    h = first_step(2, addresses, sizes, p, control, counters, y, f, w.row, w.states[Y_NEW])
    control[H] = min(h, control[H]) if control[H] > 0.0 else h
    h = min(control[H], longest_step(control))
    for i in range(sizes[NY]):
        for j in range(2, w.differences.shape[0]):
            w.differences[j, i] = 0.0
        w.differences[0, i], w.differences[1, i] = y[i], h * f[i]
    w.numbers[SPACING], w.numbers[NEWEST] = h, control[T]
    if sizes[NW] > 0:
        w.numbers[POWER] = f[sizes[NQ] + sizes[NV]]
    counters[ORDER], counters[N_EQUAL], counters[FAILURES], counters[HAVE_HISTORY] = 1, 0, 0, 1
    return True


@jitted
def step_end(control):
    """Return where the next step ends: after `control[H]`, at the stop time, or halfway to it."""
    t, stop = control[T], control[T_STOP]
    h = min(control[H], longest_step(control))
    if t + 1.01 * h >= stop:
        return stop
    # Of two steps up to the stop time none may be tiny: the next ones could grow from there only slowly.
    return t + 0.5 * (stop - t) if t + 2.0 * h > stop else t + h


@jitted
def bdf_step(method, addresses, sizes, p, control, counters, y, f, w):
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
        allow_for_singularity(sizes, w)
        error = math.inf
        cause = solve_step(method.alpha[order] / h, addresses, sizes, p, counters, t1, w)
        solved = cause == RUNNING
        if solved:
            allow_for_singularity(sizes, w)
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


@jitted
def set_tolerances(sizes, control, w):
    """Set the tolerance of every component, and Newton's; a quaternion's size is 1."""
    predicted, scale = w.states[PREDICTED], w.states[SCALE]
    for i in range(sizes[NQ] + sizes[NV]):
        scale[i] = error_scale(control, predicted[i], predicted[i])
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        for j in range(i, i + 4):
            scale[j] = error_scale(control, 1.0, 1.0)
    if sizes[NM] > 0:
        nq = sizes[NQ]
        raise_to_round_off(predicted[:nq], scale[:nq])
        raise_to_round_off(predicted[nq : nq + sizes[NV]], scale[nq : nq + sizes[NV]])
    w.numbers[NEWTON_BOUND] = control[NEWTON_TOL]
    if control[NEWTON_TOL] <= 0.0:
        w.numbers[NEWTON_BOUND] = max(10.0 * EPS / max(control[RTOL], EPS), 0.05)


@jitted
def raise_to_round_off(values, scale):
    """Raise tolerances to the round-off of the largest value: projection spreads that over all."""
    largest = 0.0
    for i in range(values.shape[0]):
        largest = max(largest, abs(values[i]))
    for i in range(values.shape[0]):
        scale[i] = max(scale[i], ROUND_OFF * largest)


@jitted
def norm(sizes, change, w):
    """Return the root mean square of the changes of positions and rates, each in units of its tolerance."""
    n = sizes[NQ] + sizes[NV]
    total = 0.0
    for i in range(n):
        total += (change[i] / w.states[SCALE, i]) ** 2
    return math.sqrt(total / n)


@jitted
def reach_end(g, addresses, sizes, p, control, counters, t1, w):
    """Bring the new state onto the constraints, and add work; returns why that failed, or RUNNING."""
    n = sizes[NQ] + sizes[NV]
    y, change = w.states[Y_NEW], w.states[CHANGE]
    if sizes[NM] > 0:
        control[MIN_PIVOT_RATIO] = min(control[MIN_PIVOT_RATIO], w.row[sizes[N_ROW] - 1])
    copy(y, w.states[KEPT])
    status = project_state(addresses, sizes, p, t1, y, control, counters, w.scratch[: projection_size(sizes)])
    if status != RUNNING:
        return status
    if is_near_singular(sizes, w):
        copy(w.states[KEPT, sizes[NQ] : n], y[sizes[NQ] : n])
    for i in range(n):
        change[i] += y[i] - w.states[KEPT, i]
    if sizes[NW] > 0:
        by_power = counters[ORDER] <= WORK_BY_POWER
        if by_power and not evaluate_middle(addresses, sizes, p, counters, t1, w):
            return NOT_FINITE
        between = w.row[n]
        # The row is that of the last iterate but one.
        if not evaluate(addresses, sizes, p, counters, t1, y, w.row):
            return NOT_FINITE
        before, after = w.numbers[POWER], w.row[n]
        change[n] = after / g - w.states[PAST, n]
        if by_power:
            done = w.numbers[SPACING] / 6.0 * (before + 4.0 * between + after)
            change[n] = w.differences[0, n] + done - w.states[PREDICTED, n]
        y[n] = w.states[PREDICTED, n] + change[n]
        w.numbers[POWER_BEFORE], w.numbers[POWER] = before, after
    counters[LAST_REJECTED], counters[FAILURES], counters[JACOBIAN_IS_FRESH] = 0, 0, 0
    return RUNNING if all_finite(y, sizes[NY]) else NOT_FINITE


@jitted
def evaluate_middle(addresses, sizes, p, counters, t1, w):
    """Evaluate the row in the middle of a step of order 1 or 2, on its polynomial; returns whether it is finite."""
    middle, new = w.scratch[: sizes[NY]], w.states[Y_NEW]
    for i in range(sizes[NQ] + sizes[NV]):
        last = w.differences[0, i]
        middle[i] = 0.5 * (last + new[i])
        if counters[ORDER] == 2:
            # The second difference of the new point and the two before it.
            middle[i] -= 0.125 * (new[i] - last - w.differences[1, i])
    return evaluate(addresses, sizes, p, counters, t1 - 0.5 * w.numbers[SPACING], middle, w.row)

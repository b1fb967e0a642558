"""RATTLE and symmetric compositions of it with a fixed step: symmetric, symplectic, on the constraints."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.after_step import finish_step, needs_dense
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.layout import (
    F_VALID,
    MAX_STEPS_PER_CALL,
    MIN_PIVOT_RATIO,
    N_LOGGED_STEPS,
    N_ROW,
    NEAR_WATCH,
    NEXT_FRAME,
    NM,
    NOT_FINITE,
    NQ,
    NV,
    NW,
    NY,
    RUNNING,
    T,
)
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, quaternion_rate
from symgen.runtime.integrate.rattle.step import rattle_step, take_start
from symgen.runtime.integrate.rattle.work import (
    HAVE_GUESS,
    HAVE_START,
    PROBE,
    REST,
    Y_OLD,
    Y_SUB,
    keep_guess,
    rattle_work,
    restore_guess,
)
from symgen.runtime.integrate.step_control import grid_end, grid_length, watch_is_near

N_DENSE_TERMS = 8


@jitted
def advance_rattle(
    method, addresses, sizes, p, control, counters, y, f, work, frame_times, frames, step_log, dense
):
    """Advance with a `Rattle` composition until something is for Python to do.

    Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), VII.1.4 and V.3.2. Frames are steps of their own
    from the step's start, so they have the method's order; a quintic serves events. Arguments and result are those
    of all step loops, see docs/architecture.md.
    """
    w = rattle_work(sizes, work)
    if not counters[F_VALID]:
        if not evaluate(addresses, sizes, p, counters, control[T], y, f):
            return NOT_FINITE
        counters[F_VALID], counters[HAVE_START], counters[HAVE_GUESS] = 1, 0, 0
        for i in range(sizes[NV]):
            w.vectors[PROBE, i] = y[sizes[NQ] + i]
        for i in range(sizes[NQ]):
            w.states[REST, i] = 0.0
    done = 0
    while done < counters[MAX_STEPS_PER_CALL] and counters[N_LOGGED_STEPS] < step_log.shape[0]:
        if watch_is_near(control):
            return NEAR_WATCH
        t0 = control[T]
        t1 = grid_end(control, counters)
        h = grid_length(control, t0, t1)
        if not counters[HAVE_START]:
            take_start(method, addresses, sizes, p, counters, t0, y, w)
            counters[HAVE_START] = 1
        copy(y, w.states[Y_OLD])
        status = compose(method, h, addresses, sizes, p, control, counters, t0, f, w)
        if status == RUNNING:
            status = reach_end(addresses, sizes, p, control, counters, t1, w)
        if status != RUNNING:
            return status
        first_frame = counters[NEXT_FRAME]
        dense_is_read = needs_dense(sizes, counters, frame_times, t1)
        if dense_is_read:
            rattle_dense(method, h, sizes, y, w.states[Y_SUB], f, w.row, dense)
        copy(w.states[Y_SUB], y)
        copy(w.row, f)
        status = finish_step(
            addresses, sizes, p, control, counters, t0, t1, y, dense, N_DENSE_TERMS, w.scratch,
            frame_times, frames, step_log,
        )  # fmt: skip
        if dense_is_read:
            refine_frames(
                method, addresses, sizes, p, control, counters, t0, first_frame, frame_times, frames, w
            )
        if status != RUNNING:
            return status
        done += 1
    return RUNNING


@jitted
def compose(method, h, addresses, sizes, p, control, counters, t0, f, w):
    """Take the RATTLE steps of a step of length `h` from Y_OLD, whose rhs row is `f`, to Y_SUB; returns a status.

    Work is integrated by the trapezoidal rule over each of them, so with the composition's order.
    """
    n, y = sizes[NQ] + sizes[NV], w.states[Y_SUB]
    copy(w.states[Y_OLD], y)
    if sizes[NW] > 0:
        copy(f, w.row)
    for s in range(method.steps.shape[0]):
        part = h * method.steps[s]
        status = rattle_step(
            method, part, addresses, sizes, p, control, counters, t0 + h * method.times[s], y, w
        )
        if status != RUNNING:
            return status
        if sizes[NW] > 0:
            before = w.row[n]
            if not evaluate(addresses, sizes, p, counters, t0 + h * method.times[s + 1], y, w.row):
                return NOT_FINITE
            y[n] += 0.5 * part * (before + w.row[n])
    return RUNNING


@jitted
def reach_end(addresses, sizes, p, control, counters, t1, w):
    """Evaluate the rhs row of the new state; returns a status."""
    if not evaluate(addresses, sizes, p, counters, t1, w.states[Y_SUB], w.row):
        return NOT_FINITE
    if sizes[NM] > 0:
        control[MIN_PIVOT_RATIO] = min(control[MIN_PIVOT_RATIO], w.row[sizes[N_ROW] - 1])
    return RUNNING if all_finite(w.states[Y_SUB], sizes[NY]) else NOT_FINITE


@jitted
def rattle_dense(method, h, sizes, y, y_new, f, row, dense):
    """Fill `dense`: quintics for positions, their derivatives for velocities, cubics for work and for what turns."""
    nq, nv, ny = sizes[NQ], sizes[NV], sizes[NY]
    for i in range(ny):
        dense[0, i] = y[i]
        dense[1, i] = y_new[i] - y[i]
        for r in range(2, N_DENSE_TERMS):
            dense[r, i] = 0.0
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            j = nq + i - k
            bend_quintic(method, h, i, y[j], y_new[j], f[j], row[j], dense)
            for r in range(5):
                for s in range(4):
                    dense[2 + r, j] += method.rates[r, s] * dense[2 + s, i] / h
        if end < nq:
            j = nq + end - k
            before, after = second_derivative(y, f, end, j), second_derivative(y_new, row, end, j)
            for i in range(4):
                bend_quintic(method, h, end + i, f[end + i], row[end + i], before[i], after[i], dense)
            for i in range(j, j + 3):
                bend_cubic(h, i, f, row, dense)
        start = end + 4
    for i in range(nq + nv, ny):
        bend_cubic(h, i, f, row, dense)


@jitted
def bend_quintic(method, h, i, v0, v1, a0, a1, dense):
    """Write the rows of `dense` behind the second one, of first and second derivatives at both ends."""
    data = (h * v0 - dense[1, i], h * v1 - dense[1, i], h * h * a0, h * h * a1)
    for r in range(4):
        for j in range(4):
            dense[2 + r, i] += method.bends[r, j] * data[j]


@jitted
def bend_cubic(h, i, f, row, dense):
    """Write the rows of `dense` behind the second one, of derivatives at both ends."""
    dense[2, i] = h * f[i] - dense[1, i]
    dense[3, i] = dense[1, i] - h * row[i]


@jitted
def second_derivative(y, f, i, j):
    """Return that of the quaternion at `i`, whose rates are at `j`, by the rhs row `f`."""
    w, x, y_, z = quaternion_rate(f, i, y[j], y[j + 1], y[j + 2])
    a, b, c, d = quaternion_rate(y, i, f[j], f[j + 1], f[j + 2])
    return w + a, x + b, y_ + c, z + d


@jitted
def refine_frames(method, addresses, sizes, p, control, counters, t0, first_frame, frame_times, frames, w):
    """Replace frames that dense output has written by steps from the start of the step to their times.

    Where such a step does not converge the frame stays. The next step is not to notice: it starts as it would have.
    """
    keep_guess(w)
    y, row = w.states[Y_SUB], w.row
    for k in range(first_frame, counters[NEXT_FRAME]):
        length = frame_times[k] - t0
        if length <= 0.0 or frame_times[k] >= control[T]:
            continue
        take_start(method, addresses, sizes, p, counters, t0, w.states[Y_OLD], w)
        if sizes[NW] > 0 and not evaluate(addresses, sizes, p, counters, t0, w.states[Y_OLD], row):
            continue
        if compose(method, length, addresses, sizes, p, control, counters, t0, row, w) == RUNNING:
            copy(y, frames[k])
        restore_guess(w)
    counters[HAVE_START] = 0

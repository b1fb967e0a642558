"""RATTLE and symmetric compositions of it with a fixed step: symmetric, symplectic, on the constraints."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_step, needs_dense
from symgen.runtime.integrate.loop import all_finite, copy, evaluate, take_steps
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
from symgen.runtime.integrate.step_control import grid_end, grid_length

N_DENSE_TERMS = 8


@jitted
def advance_rattle(method, loop):
    """Advance with a `Rattle` composition until something is for Python to do.

    Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), VII.1.4 and V.3.2. Frames are steps of their own
    from the step's start, so they have the method's order; a quintic serves events. Arguments and result are those
    of all step loops, see docs/step-loops.md.
    """
    w = rattle_work(loop.sizes, loop.work)
    if not loop.counters[at.F_VALID]:
        if not evaluate(loop, loop.control[at.T], loop.y, loop.f):
            return at.NOT_FINITE
        loop.counters[at.F_VALID], loop.counters[HAVE_START], loop.counters[HAVE_GUESS] = 1, 0, 0
        for i in range(loop.sizes[at.NV]):
            w.vectors[PROBE, i] = loop.y[loop.sizes[at.NQ] + i]
        for i in range(loop.sizes[at.NQ]):
            w.states[REST, i] = 0.0
    return take_steps(composed_step, method, loop, w)


@jitted
def composed_step(method, loop, w):
    """Take one step of the grid and record it; returns a status."""
    t0 = loop.control[at.T]
    t1 = grid_end(loop)
    h = grid_length(loop.control, t0, t1)
    if not loop.counters[HAVE_START]:
        take_start(method, loop, t0, loop.y, w)
        loop.counters[HAVE_START] = 1
    copy(loop.y, w.states[Y_OLD])
    status = compose(method, h, loop, t0, loop.f, w)
    if status == at.RUNNING:
        status = reach_end(loop, t1, w)
    if status != at.RUNNING:
        return status
    first_frame = loop.counters[at.NEXT_FRAME]
    dense_is_read = needs_dense(loop, t1)
    if dense_is_read:
        rattle_dense(method, h, loop.sizes, loop.y, w.states[Y_SUB], loop.f, w.row, loop.dense)
    copy(w.states[Y_SUB], loop.y)
    copy(w.row, loop.f)
    status = finish_step(loop, t0, t1, loop.dense, N_DENSE_TERMS, w.scratch)
    if dense_is_read:
        refine_frames(method, loop, t0, first_frame, w)
    return status


@jitted
def compose(method, h, loop, t0, f, w):
    """Take the RATTLE steps of a step of length `h` from Y_OLD, whose rhs row is `f`, to Y_SUB; returns a status.

    Work is integrated by the trapezoidal rule over each of them, so with the composition's order.
    """
    n, y = loop.sizes[at.NQ] + loop.sizes[at.NV], w.states[Y_SUB]
    copy(w.states[Y_OLD], y)
    if loop.sizes[at.NW] > 0:
        copy(f, w.row)
    for s in range(method.steps.shape[0]):
        part = h * method.steps[s]
        status = rattle_step(method, part, loop, t0 + h * method.times[s], y, w)
        if status != at.RUNNING:
            return status
        if loop.sizes[at.NW] > 0:
            before = w.row[n]
            if not evaluate(loop, t0 + h * method.times[s + 1], y, w.row):
                return at.NOT_FINITE
            y[n] += 0.5 * part * (before + w.row[n])
    return at.RUNNING


@jitted
def reach_end(loop, t1, w):
    """Evaluate the rhs row of the new state; returns a status."""
    if not evaluate(loop, t1, w.states[Y_SUB], w.row):
        return at.NOT_FINITE
    if loop.sizes[at.NM] > 0:
        loop.control[at.MIN_PIVOT_RATIO] = min(
            loop.control[at.MIN_PIVOT_RATIO], w.row[loop.sizes[at.N_ROW] - 1]
        )
    return at.RUNNING if all_finite(w.states[Y_SUB], loop.sizes[at.NY]) else at.NOT_FINITE


@jitted
def rattle_dense(method, h, sizes, y, y_new, f, row, dense):
    """Fill `dense`: quintics for positions, their derivatives for velocities, cubics for work and for what turns."""
    nq, nv, ny = sizes[at.NQ], sizes[at.NV], sizes[at.NY]
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
    dense[3, i] = dense[1, i] - dense[2, i] - h * row[i]


@jitted
def second_derivative(y, f, i, j):
    """Return that of the quaternion at `i`, whose rates are at `j`, by the rhs row `f`."""
    w, x, y_, z = quaternion_rate(f, i, y[j], y[j + 1], y[j + 2])
    a, b, c, d = quaternion_rate(y, i, f[j], f[j + 1], f[j + 2])
    return w + a, x + b, y_ + c, z + d


@jitted
def refine_frames(method, loop, t0, first_frame, w):
    """Replace frames that dense output has written by steps from the start of the step to their times.

    Where such a step does not converge the frame stays. The next step is not to notice: it starts as it would have.
    """
    keep_guess(w)
    y, row = w.states[Y_SUB], w.row
    for k in range(first_frame, loop.counters[at.NEXT_FRAME]):
        length = loop.frame_times[k] - t0
        if length <= 0.0 or loop.frame_times[k] >= loop.control[at.T]:
            continue
        take_start(method, loop, t0, w.states[Y_OLD], w)
        if loop.sizes[at.NW] > 0 and not evaluate(loop, t0, w.states[Y_OLD], row):
            continue
        if compose(method, length, loop, t0, row, w) == at.RUNNING:
            copy(y, loop.frames[k])
        restore_guess(w)
    loop.counters[HAVE_START] = 0

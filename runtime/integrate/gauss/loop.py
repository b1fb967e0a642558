"""Gauss collocation of order 4 to 16 with a fixed step: symmetric, and symplectic where the mass matrix is constant."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_step, needs_dense
from symgen.runtime.integrate.gauss.stages import (
    EXTRAPOLATED_FOR,
    FRAME,
    H_HISTORY,
    HAVE_FACTORS,
    HAVE_HISTORY,
    HAVE_JACOBIAN,
    MAX_SWEEPS,
    NEXT_STEP,
    gauss_work,
    interpolation,
    place_stages,
    solve_stages,
)
from symgen.runtime.integrate.loop import add_compensated, all_finite, copy, take_steps
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.quaternions import keep_lengths, n_quaternions, quaternion_at
from symgen.runtime.integrate.step_control import grid_end, grid_length

N_DENSE_TERMS = 8


@jitted
def advance_gauss(method, loop):
    """Advance with a `Gauss` method until something is for Python to do.

    Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), VIII.6, for q'' = a(t, q, v): the unknowns are
    accelerations. Fixed-point iteration until that fails once, from then on Newton's. Frames are steps of their own
    from the step's start, so they have the method's order; the collocation polynomial serves events. Quaternions keep
    their length, see `rotation_increments`. The row `f` is not used; F_VALID says that nobody has changed the state.
    Arguments and result are those of all step loops, see docs/step-loops.md.
    """
    w = gauss_work(method, loop.sizes, loop.work)
    if not loop.counters[at.F_VALID]:
        loop.counters[at.F_VALID] = 1
        loop.counters[HAVE_HISTORY], loop.counters[HAVE_JACOBIAN], loop.counters[HAVE_FACTORS] = 0, 0, 0
        for i in range(loop.sizes[at.NY]):
            w.states[method.c.shape[0] + 1, i] = 0.0
    return take_steps(gauss_step, method, loop, w)


@jitted
def gauss_step(method, loop, w):
    """Take one step of the grid and record it, frames in it by steps of their own; returns a status."""
    n = method.c.shape[0]
    y_new, rest, y_old = w.states[n], w.states[n + 1], w.states[n + 2]
    t0 = loop.control[at.T]
    t1 = grid_end(loop)
    h = grid_length(loop.control, t0, t1)
    prepare_history(method, h, loop.counters, w)
    status = solve_stages(NEXT_STEP, method, h, loop, t0, loop.y, w)
    if status == at.RUNNING:
        copy(loop.y, y_old)
        copy(loop.y, y_new)
        status = reach_end(method, h, loop, t1, y_new, rest, w)
    if status != at.RUNNING:
        return status
    keep_history(h, loop, w)
    dense_is_read = needs_dense(loop, t1)
    if dense_is_read:
        gauss_dense(method, h, loop.sizes, loop.y, y_new, w, loop.dense)
    copy(y_new, loop.y)
    first_frame = loop.counters[at.NEXT_FRAME]
    status = finish_step(loop, t0, t1, loop.dense, N_DENSE_TERMS, w.scratch)
    if dense_is_read:
        refine_frames(method, h, loop, t0, first_frame, w)
    return status


@jitted
def prepare_history(method, h, counters, w):
    """Make the weights with which the last step's collocation polynomial is continued over a step of length `h`."""
    if counters[HAVE_HISTORY]:
        stretch = h / w.numbers[H_HISTORY]
        if w.numbers[EXTRAPOLATED_FOR] != stretch:
            interpolation(method, 1.0, stretch, w.weights[NEXT_STEP])
            w.numbers[EXTRAPOLATED_FOR] = stretch


@jitted
def keep_history(h, loop, w):
    """Keep the accelerations of the stages for the next step."""
    nq = loop.sizes[at.NQ]
    for i in range(loop.sizes[at.NV]):
        for s in range(w.rows.shape[0]):
            w.history[i, s] = w.rows[s, nq + i]
    w.numbers[H_HISTORY] = h
    loop.counters[HAVE_HISTORY] = 1


@jitted
def reach_end(method, h, loop, t1, y_new, rest, w):
    """Add the step to `y_new`, which is `y` so far, and project it onto the constraints; returns a status."""
    n, nq, nv = method.c.shape[0], loop.sizes[at.NQ], loop.sizes[at.NV]
    if not place_stages(method, h, MAX_SWEEPS, loop.sizes, loop.y, w):
        return at.NEWTON_FAILED
    for i in range(nq):
        travel = 0.0
        for s in range(n):
            travel += w.travels[i, s]
        add_compensated(travel, i, y_new, rest)
    for i in range(nv):
        impulse = 0.0
        for s in range(n):
            impulse += w.impulses[i, s]
        add_compensated(impulse, nq + i, y_new, rest)
    keep_lengths(loop.sizes, y_new, rest)
    if loop.sizes[at.NW] > 0:
        work = 0.0
        for s in range(n):
            work += h * method.b[s] * w.rows[s, nq + nv]
        add_compensated(work, nq + nv, y_new, rest)
    if loop.sizes[at.NM] > 0:
        for s in range(n):
            loop.control[at.MIN_PIVOT_RATIO] = min(
                loop.control[at.MIN_PIVOT_RATIO], w.rows[s, loop.sizes[at.N_ROW] - 1]
            )
        status = project_state(loop, t1, y_new, w.scratch[: projection_size(loop.sizes)])
        if status != at.RUNNING:
            return status
        # What is left of the sums stays: mostly projection moves the state by less than round-off, and to forget them
        # each time would let energy drift by it.
    return at.RUNNING if all_finite(y_new, loop.sizes[at.NY]) else at.NOT_FINITE


@jitted
def gauss_dense(method, h, sizes, y, y_new, w, dense):
    """Fill `dense` with the collocation polynomial, up to degree 7; what projection moved is added in proportion."""
    n, nq = method.c.shape[0], sizes[at.NQ]
    for i in range(sizes[at.NY]):
        dense[0, i] = y[i]
        dense[1, i] = y_new[i] - y[i]
    for r in range(6):
        start = 0
        for k in range(n_quaternions(sizes) + 1):
            end = quaternion_at(sizes, k)
            for i in range(start, end):
                by_q = 0.0
                for s in range(n):
                    by_q += method.dense_q[r, s] * w.rows[s, nq + i - k]
                dense[2 + r, i] = h * h * by_q
            for i in range(end, end + 4 if end < nq else end):
                dense[2 + r, i] = h * dot(method.dense_v[r], w.rows, i)
            start = end + 4
        for i in range(nq, sizes[at.NY]):
            dense[2 + r, i] = h * dot(method.dense_v[r], w.rows, i)


@jitted
def dot(weights, rows, i):
    """Return the sum of the derivatives of component `i` at the stages, weighted."""
    total = 0.0
    for s in range(rows.shape[0]):
        total += weights[s] * rows[s, i]
    return total


@jitted
def refine_frames(method, h, loop, t0, first_frame, w):
    """Replace frames that dense output has written by steps from the start of the step to their times.

    The stages start from the collocation polynomial, so few iterations do. Where they do not converge the frame stays.
    """
    n, nq, nv, y_old = (
        method.c.shape[0],
        loop.sizes[at.NQ],
        loop.sizes[at.NV],
        w.states[method.c.shape[0] + 2],
    )
    is_projected = False
    for row in range(first_frame, loop.counters[at.NEXT_FRAME]):
        length = loop.frame_times[row] - t0
        if length <= 0.0 or loop.frame_times[row] >= loop.control[at.T]:
            continue
        interpolation(method, 0.0, length / h, w.weights[FRAME])
        if solve_stages(FRAME, method, length, loop, t0, y_old, w) != at.RUNNING:
            continue
        if not place_stages(method, length, MAX_SWEEPS, loop.sizes, y_old, w):
            continue
        frame = loop.frames[row]
        for i in range(loop.sizes[at.NY]):
            total = 0.0
            for s in range(n):
                if i < nq:
                    total += w.travels[i, s]
                elif i < nq + nv:
                    total += w.impulses[i - nq, s]
                else:
                    total += length * method.b[s] * w.rows[s, i]
            frame[i] = y_old[i] + total
        if loop.sizes[at.NM] > 0:
            buffer = w.scratch[: projection_size(loop.sizes)]
            project_state(loop, loop.frame_times[row], frame, buffer)
            is_projected = True
    row = loop.counters[at.NEXT_FRAME]
    if is_projected and row < loop.frames.shape[0]:
        # As in `after_step.write_frames`: frames must not tell the guard where the run is.
        copy(loop.y, loop.frames[row])
        project_state(loop, loop.control[at.T], loop.frames[row], w.scratch[: projection_size(loop.sizes)])

"""Implicit Euler and implicit midpoint with a fixed step; their Newton systems have the size of v."""

import math
from typing import NamedTuple

import numpy as np

from runtime.code.jitted import jitted
from runtime.integrate.after_step import finish_scratch_size, finish_step
from runtime.integrate.copying import copy
from runtime.integrate.evaluation import all_finite, evaluate
from runtime.integrate.jacobian import acceleration_jacobian, jacobian_work_size
from runtime.integrate.layout import (
    F_VALID,
    FACTORISATIONS,
    MAX_STEPS_PER_CALL,
    MIN_PIVOT_RATIO,
    N_LOGGED_STEPS,
    N_ROW,
    NEWTON_FAILED,
    NEWTON_ITERATIONS,
    NEWTON_TOL,
    NM,
    NOT_FINITE,
    NV,
    NW,
    NY,
    RUNNING,
    T,
)
from runtime.integrate.linear import lu_factor, lu_solve
from runtime.integrate.newton import (
    DIVERGED,
    ITERATING,
    N_MONITOR,
    RATE,
    forget_rate,
    judge_correction,
    start_newton,
)
from runtime.integrate.projection import project_state, projection_size
from runtime.integrate.step_control import error_scale, grid_end

# Of the tolerance; an error that Newton leaves is not seen by anything else here, and adds up over the steps.
DEFAULT_NEWTON_TOL = 1e-3
KEEP_JACOBIAN_RATE = 0.2

# Counters of this family: whether work holds a Jacobian, factors (for the stage length FACTORED_FOR), and the
# accelerations of the last step.
HAVE_JACOBIAN, HAVE_FACTORS, HAVE_ACCELERATION = range(16, 19)

FACTORED_FOR = N_MONITOR  # in `numbers`, behind Newton's monitor
N_NUMBERS = N_MONITOR + 1


class OneStage(NamedTuple):
    """A one-stage implicit method: Y = y + s f(t + s, Y) with s = θ h, then y_new = y + (Y - y) / θ.

    Attributes
    ----------
    theta : float
        1: implicit Euler, order 1. 1/2: implicit midpoint, order 2, symplectic.
    n_dense : int
        Rows of the dense output.
    """

    theta: float
    n_dense: int


IMPLICIT_EULER = OneStage(1.0, 2)
IMPLICIT_MIDPOINT = OneStage(0.5, 3)


# Rows of `vectors` and `states`.
ACCELERATION, CORRECTION = range(2)
STAGE, Y_NEW = range(2)


class StageWork(NamedTuple):
    """Work arrays of `advance_implicit`. They are few, because each makes every call of a jitted function longer.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    jacobian : ndarray, shape (nv, 2 nv)
        [∂a/∂q, ∂a/∂v].
    matrix, pivots : ndarray, shapes (nv, nv), (nv,)
        Factors of the Newton matrix.
    vectors : ndarray, shape (2, nv)
        Accelerations of the last step; a correction of v.
    states : ndarray, shape (2, NY)
        The stage; the new state.
    row : ndarray, shape (N_ROW,)
        The rhs row of the stage.
    implicit : ndarray
        See `acceleration_jacobian`.
    scratch : ndarray
        See `finish_step`.
    """

    numbers: np.ndarray
    jacobian: np.ndarray
    matrix: np.ndarray
    pivots: np.ndarray
    vectors: np.ndarray
    states: np.ndarray
    row: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def implicit_work_size(sizes):
    """Length of `work` for `advance_implicit`."""
    nv = sizes[NV]
    own = N_NUMBERS + 3 * nv * nv + 3 * nv + 2 * sizes[NY] + sizes[N_ROW]
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def stage_work(sizes, work):
    """Divide `work`, of length `implicit_work_size(sizes)`, into a `StageWork`."""
    nv, ny = sizes[NV], sizes[NY]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    jacobian, rest = rest[: 2 * nv * nv].reshape((nv, 2 * nv)), rest[2 * nv * nv :]
    matrix, rest = rest[: nv * nv].reshape((nv, nv)), rest[nv * nv :]
    pivots, rest = rest[:nv].view(np.int64), rest[nv:]
    vectors, rest = rest[: 2 * nv].reshape((2, nv)), rest[2 * nv :]
    states, rest = rest[: 2 * ny].reshape((2, ny)), rest[2 * ny :]
    row, rest = rest[: sizes[N_ROW]], rest[sizes[N_ROW] :]
    n = jacobian_work_size(sizes)
    return StageWork(numbers, jacobian, matrix, pivots, vectors, states, row, rest[:n], rest[n:])


@jitted
def advance_implicit(
    method, addresses, sizes, p, control, counters, y, f, work, frame_times, frames, step_log, dense
):
    """Advance with a one-stage implicit method until something is for Python to do.

    Arguments and result are those of all step loops, see docs/architecture.md; `method` is a `OneStage`.
    The row `f` is not used. `control[NEWTON_TOL]` is in units of the error tolerance; 0 means
    DEFAULT_NEWTON_TOL.
    """
    w = stage_work(sizes, work)
    counters[F_VALID] = 0
    done = 0
    while done < counters[MAX_STEPS_PER_CALL] and counters[N_LOGGED_STEPS] < step_log.shape[0]:
        t0 = control[T]
        t1 = grid_end(control, counters)
        status = solve_stage(method.theta * (t1 - t0), addresses, sizes, p, control, counters, t0, y, w)
        if status == RUNNING:
            status = reach_end(method, addresses, sizes, p, control, counters, t0, t1, y, w)
        if status != RUNNING:
            return status
        one_stage_dense(method, sizes, t1 - t0, y, w.states[Y_NEW], dense)
        copy(w.states[Y_NEW], y)
        status = finish_step(
            addresses, sizes, p, control, counters, t0, t1, y, dense, method.n_dense, w.scratch,
            frame_times, frames, step_log,
        )  # fmt: skip
        if status != RUNNING:
            return status
        done += 1
    return RUNNING


@jitted
def solve_stage(s, addresses, sizes, p, control, counters, t0, y, w):
    """Solve Y = y + s f(t0 + s, Y) for the stage; where that fails, once more with a fresh Jacobian."""
    if counters[HAVE_JACOBIAN]:
        predict(s, sizes, counters, y, w)
        if iterate(s, addresses, sizes, p, control, counters, t0, y, w) == RUNNING:
            return RUNNING
        # What the last step says may be what misled Newton.
        counters[HAVE_ACCELERATION] = 0
    predict(s, sizes, counters, y, w)
    if not evaluate(addresses, sizes, p, counters, t0 + s, w.states[STAGE], w.row):
        return NOT_FINITE
    status = acceleration_jacobian(
        addresses, sizes, p, counters, t0 + s, w.states[STAGE], w.row, w.implicit, w.jacobian
    )
    if status != RUNNING:
        return status
    counters[HAVE_JACOBIAN] = 1
    counters[HAVE_FACTORS] = 0
    return iterate(s, addresses, sizes, p, control, counters, t0, y, w)


@jitted
def predict(s, sizes, counters, y, w):
    """Guess the stage: the accelerations of the last step go on, or none."""
    nv = sizes[NV]
    for i in range(nv):
        rise = s * w.vectors[ACCELERATION, i] if counters[HAVE_ACCELERATION] else 0.0
        w.states[STAGE, nv + i] = y[nv + i] + rise
        w.states[STAGE, i] = y[i] + s * w.states[STAGE, nv + i]


@jitted
def iterate(s, addresses, sizes, p, control, counters, t0, y, w):
    """Improve the stage by simplified Newton; returns RUNNING, or why it does not converge."""
    # Lengths of steps on the grid differ by round-off of time, which is nothing to Newton.
    if not counters[HAVE_FACTORS] or abs(s - w.numbers[FACTORED_FOR]) > 1e-6 * s:
        status = factor_stage(s, counters, w)
        if status != RUNNING:
            return status
    tolerance = control[NEWTON_TOL] if control[NEWTON_TOL] > 0.0 else DEFAULT_NEWTON_TOL
    start_newton(w.numbers)
    verdict = ITERATING
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        if not evaluate(addresses, sizes, p, counters, t0 + s, w.states[STAGE], w.row):
            return NOT_FINITE
        size = correct_stage(s, sizes, control, y, w)
        counters[NEWTON_ITERATIONS] += 1
        verdict = judge_correction(iteration, size, tolerance, w.numbers)
    if verdict == DIVERGED:
        return NEWTON_FAILED
    if w.numbers[RATE] > KEEP_JACOBIAN_RATE:
        counters[HAVE_JACOBIAN] = 0
    return RUNNING


@jitted
def factor_stage(s, counters, w):
    """Factor I - s ∂a/∂v - s² ∂a/∂q."""
    nv = w.matrix.shape[0]
    for i in range(nv):
        for j in range(nv):
            w.matrix[i, j] = -s * (w.jacobian[i, nv + j] + s * w.jacobian[i, j])
        w.matrix[i, i] += 1.0
    counters[FACTORISATIONS] += 1
    counters[HAVE_FACTORS] = 1
    w.numbers[FACTORED_FOR] = s
    forget_rate(w.numbers)
    return lu_factor(w.matrix, w.pivots)


@jitted
def correct_stage(s, sizes, control, y, w):
    """Correct the stage, whose derivative is `w.row`, by Newton; returns the size of the correction."""
    nv = sizes[NV]
    for i in range(nv):
        w.vectors[CORRECTION, i] = y[nv + i] + s * w.row[nv + i] - w.states[STAGE, nv + i]
    lu_solve(w.matrix, w.pivots, w.vectors[CORRECTION])
    total = 0.0
    for i in range(nv):
        dv = w.vectors[CORRECTION, i]
        dq = s * dv
        w.states[STAGE, nv + i] += dv
        # Not q + dq: so q = q0 + s v holds to round-off, whatever Newton leaves in v.
        w.states[STAGE, i] = y[i] + s * w.states[STAGE, nv + i]
        total += (dq / error_scale(control, y[i], w.states[STAGE, i])) ** 2
        total += (dv / error_scale(control, y[nv + i], w.states[STAGE, nv + i])) ** 2
    return math.sqrt(total / (2 * nv))


@jitted
def reach_end(method, addresses, sizes, p, control, counters, t0, t1, y, w):
    """Write the new state to `w.states[Y_NEW]`, on the constraints; returns why not, or RUNNING."""
    nv, n, h = sizes[NV], 2 * sizes[NV], t1 - t0
    s = method.theta * h
    for i in range(nv):
        w.vectors[ACCELERATION, i] = (w.states[STAGE, nv + i] - y[nv + i]) / s
        w.states[Y_NEW, nv + i] = y[nv + i] + h * w.vectors[ACCELERATION, i]
        w.states[Y_NEW, i] = y[i] + h * w.states[STAGE, nv + i]
    counters[HAVE_ACCELERATION] = 1
    if sizes[NW] > 0:
        # The row is that of the last iterate but one.
        if not evaluate(addresses, sizes, p, counters, t0 + s, w.states[STAGE], w.row):
            return NOT_FINITE
        w.states[Y_NEW, n] = y[n] + h * w.row[n]
    if sizes[NM] > 0:
        control[MIN_PIVOT_RATIO] = min(control[MIN_PIVOT_RATIO], w.row[sizes[N_ROW] - 1])
        status = project_state(
            addresses, sizes, p, t1, w.states[Y_NEW], control, counters, w.scratch[: projection_size(sizes)]
        )
        if status != RUNNING:
            return status
    return RUNNING if all_finite(w.states[Y_NEW], sizes[NY]) else NOT_FINITE


@jitted
def one_stage_dense(method, sizes, h, y0, y1, dense):
    """Fill `dense` with the method's own interpolant: v linear, q linear (Euler) or the integral of v."""
    nv = sizes[NV]
    for i in range(sizes[NY]):
        dense[0, i] = y0[i]
        dense[1, i] = y1[i] - y0[i]
        dense[2, i] = 0.0
    if method.n_dense == 3:
        for i in range(nv):
            dense[2, i] = -0.5 * h * dense[1, nv + i]

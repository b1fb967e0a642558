"""Implicit Euler and implicit midpoint with a fixed step; their Newton systems have the size of v."""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size, finish_step, needs_dense
from symgen.runtime.integrate.jacobian import acceleration_jacobian, jacobian_work_size
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.loop import all_finite, copy, evaluate, take_steps
from symgen.runtime.integrate.newton import (
    DIVERGED,
    ITERATING,
    N_MONITOR,
    RATE,
    forget_rate,
    judge_correction,
    start_newton,
)
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.quaternions import (
    chart_variation,
    n_quaternions,
    quaternion_at,
    quaternion_rate,
    retract,
)
from symgen.runtime.integrate.step_control import error_scale, grid_end

FACTORED_FOR = N_MONITOR  # in `numbers`, behind Newton's monitor
N_NUMBERS = N_MONITOR + 1

# Rows of `vectors` and `states`.
ACCELERATION, CORRECTION = range(2)
STAGE, Y_NEW = range(2)


class StageWork(NamedTuple):
    """Work arrays of `advance_implicit`. They are few, because each makes every call of a jitted function longer.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    jacobian : ndarray, shape (nv, 2 nv)
        See `acceleration_jacobian`.
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
    nv = sizes[at.NV]
    own = N_NUMBERS + 3 * nv * nv + 3 * nv + 2 * sizes[at.NY] + sizes[at.N_ROW]
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def stage_work(sizes, work):
    """Divide `work`, of length `implicit_work_size(sizes)`, into a `StageWork`."""
    nv, ny = sizes[at.NV], sizes[at.NY]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    jacobian, rest = rest[: 2 * nv * nv].reshape((nv, 2 * nv)), rest[2 * nv * nv :]
    matrix, rest = rest[: nv * nv].reshape((nv, nv)), rest[nv * nv :]
    pivots, rest = rest[:nv].view(np.int64), rest[nv:]
    vectors, rest = rest[: 2 * nv].reshape((2, nv)), rest[2 * nv :]
    states, rest = rest[: 2 * ny].reshape((2, ny)), rest[2 * ny :]
    row, rest = rest[: sizes[at.N_ROW]], rest[sizes[at.N_ROW] :]
    n = jacobian_work_size(sizes)
    return StageWork(numbers, jacobian, matrix, pivots, vectors, states, row, rest[:n], rest[n:])


@jitted
def one_stage_dense(method, sizes, h, y0, y1, dense):
    """Fill `dense` with the method's own interpolant: v linear, q linear (Euler) or the integral of v."""
    nq = sizes[at.NQ]
    for i in range(sizes[at.NY]):
        dense[0, i] = y0[i]
        dense[1, i] = y1[i] - y0[i]
        dense[2, i] = 0.0
    if method.n_dense == 3:
        start = 0
        for k in range(n_quaternions(sizes) + 1):
            end = quaternion_at(sizes, k)
            for i in range(start, end):
                dense[2, i] = -0.5 * h * dense[1, nq + i - k]
            if end < nq:
                bend_quaternion(h, y0, y1, end, nq + end - k, dense[2])
            start = end + 4


@jitted
def bend_quaternion(h, y0, y1, i, j, bend):
    """Write half the change of h q' over the step for the quaternion at `i`, whose rates are at `j`."""
    w0, x0, y_0, z0 = quaternion_rate(y0, i, y0[j], y0[j + 1], y0[j + 2])
    w1, x1, y_1, z1 = quaternion_rate(y1, i, y1[j], y1[j + 1], y1[j + 2])
    bend[i], bend[i + 1] = 0.5 * h * (w0 - w1), 0.5 * h * (x0 - x1)
    bend[i + 2], bend[i + 3] = 0.5 * h * (y_0 - y_1), 0.5 * h * (z0 - z1)


# Of the tolerance; an error that Newton leaves is not seen by anything else here, and adds up over the steps.
DEFAULT_NEWTON_TOL = 1e-3
KEEP_JACOBIAN_RATE = 0.2

# Counters of this family: whether work holds a Jacobian, factors (for the stage length FACTORED_FOR), and the
# accelerations of the last step.
HAVE_JACOBIAN, HAVE_FACTORS, HAVE_ACCELERATION = range(16, 19)


class OneStage(NamedTuple):
    """A one-stage implicit method: Y = y + s f(t + s, Y) with s = θ h, then y_new = y + (Y - y) / θ.

    Quaternions are turned by s times the stage's angular velocity, then by h times it: as the addition of
    angles it stands for, that is exact for a steady rotation.

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


@jitted
def advance_implicit(method, loop):
    """Advance with a one-stage implicit method until something is for Python to do.

    Arguments and result are those of all step loops, see docs/step-loops.md; `method` is a `OneStage`.
    The row `f` is not used. `control[NEWTON_TOL]` is in units of the error tolerance; 0 means
    DEFAULT_NEWTON_TOL.
    """
    w = stage_work(loop.sizes, loop.work)
    loop.counters[at.F_VALID] = 0
    return take_steps(implicit_step, method, loop, w)


@jitted
def implicit_step(method, loop, w):
    """Take one step of the grid and record it; returns a status."""
    t0 = loop.control[at.T]
    t1 = grid_end(loop)
    status = solve_stage(method.theta * (t1 - t0), loop, t0, w)
    if status == at.RUNNING:
        status = reach_end(method, loop, t0, t1, w)
    if status != at.RUNNING:
        return status
    one_stage_dense(method, loop.sizes, t1 - t0, loop.y, w.states[Y_NEW], loop.dense)
    if method.n_dense == 3 and loop.sizes[at.NW] > 0 and needs_dense(loop, t1):
        bend_work(loop, t0, t1, w)
    copy(w.states[Y_NEW], loop.y)
    return finish_step(loop, t0, t1, loop.dense, method.n_dense, w.scratch)


@jitted
def bend_work(loop, t0, t1, w):
    """Let the dense output of work change as the power at both ends does: events cut steps there."""
    n = loop.sizes[at.NQ] + loop.sizes[at.NV]
    if evaluate(loop, t0, loop.y, w.row):
        before = w.row[n]
        if evaluate(loop, t1, w.states[Y_NEW], w.row):
            loop.dense[2, n] = 0.5 * (t1 - t0) * (before - w.row[n])


@jitted
def solve_stage(s, loop, t0, w):
    """Solve Y = y + s f(t0 + s, Y) for the stage; where that fails, once more with a fresh Jacobian."""
    if loop.counters[HAVE_JACOBIAN]:
        predict(s, loop, w)
        if iterate(s, loop, t0, w) == at.RUNNING:
            return at.RUNNING
        # What the last step says may be what misled Newton.
        loop.counters[HAVE_ACCELERATION] = 0
    predict(s, loop, w)
    if not evaluate(loop, t0 + s, w.states[STAGE], w.row):
        return at.NOT_FINITE
    status = acceleration_jacobian(loop, t0 + s, w.states[STAGE], w.row, w.implicit, w.jacobian)
    if status != at.RUNNING:
        return status
    loop.counters[HAVE_JACOBIAN] = 1
    loop.counters[HAVE_FACTORS] = 0
    return iterate(s, loop, t0, w)


@jitted
def predict(s, loop, w):
    """Guess the stage: the accelerations of the last step go on, or none."""
    nq = loop.sizes[at.NQ]
    for i in range(loop.sizes[at.NV]):
        rise = s * w.vectors[ACCELERATION, i] if loop.counters[HAVE_ACCELERATION] else 0.0
        w.states[STAGE, nq + i] = loop.y[nq + i] + rise
    retract(loop.sizes, loop.y, s, w.states[STAGE], nq, w.states[STAGE])


@jitted
def iterate(s, loop, t0, w):
    """Improve the stage by simplified Newton; returns RUNNING, or why it does not converge."""
    # Lengths of steps on the grid differ by round-off of time, which is nothing to Newton.
    if not loop.counters[HAVE_FACTORS] or abs(s - w.numbers[FACTORED_FOR]) > 1e-6 * s:
        status = factor_stage(s, loop, w)
        if status != at.RUNNING:
            return status
    tolerance = loop.control[at.NEWTON_TOL] if loop.control[at.NEWTON_TOL] > 0.0 else DEFAULT_NEWTON_TOL
    start_newton(w.numbers)
    verdict = ITERATING
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        if not evaluate(loop, t0 + s, w.states[STAGE], w.row):
            return at.NOT_FINITE
        size = correct_stage(s, loop, w)
        loop.counters[at.NEWTON_ITERATIONS] += 1
        verdict = judge_correction(iteration, size, tolerance, w.numbers)
    if verdict == DIVERGED:
        return at.NEWTON_FAILED
    if w.numbers[RATE] > KEEP_JACOBIAN_RATE:
        loop.counters[HAVE_JACOBIAN] = 0
    return at.RUNNING


@jitted
def factor_stage(s, loop, w):
    """Factor I - s ∂a/∂v - s² ∂a/∂q, where the rates of a quaternion turn it by `chart_variation`."""
    nv = w.matrix.shape[0]
    for i in range(nv):
        for j in range(nv):
            w.matrix[i, j] = -s * (w.jacobian[i, nv + j] + s * w.jacobian[i, j])
        w.matrix[i, i] += 1.0
    for k in range(n_quaternions(loop.sizes)):
        j = quaternion_at(loop.sizes, k) - k
        factor_rotations(s, j, loop.sizes[at.NQ] + j, w)
    loop.counters[at.FACTORISATIONS] += 1
    loop.counters[HAVE_FACTORS] = 1
    w.numbers[FACTORED_FOR] = s
    forget_rate(w.numbers)
    return lu_factor(w.matrix, w.pivots)


@jitted
def factor_rotations(s, j, first, w):
    """Make the columns of the Newton matrix for the rates of a quaternion, from `j`; in states from `first`."""
    a, b, c = s * w.states[STAGE, first], s * w.states[STAGE, first + 1], s * w.states[STAGE, first + 2]
    for column in range(3):
        along = 1.0 if column == 0 else 0.0, 1.0 if column == 1 else 0.0, 1.0 if column == 2 else 0.0
        x, y, z = chart_variation(a, b, c, along[0], along[1], along[2])
        for i in range(w.matrix.shape[0]):
            turned = w.jacobian[i, j] * x + w.jacobian[i, j + 1] * y + w.jacobian[i, j + 2] * z
            w.matrix[i, j + column] += s * s * (w.jacobian[i, j + column] - turned)


@jitted
def correct_stage(s, loop, w):
    """Correct the stage, whose derivative is `w.row`, by Newton; returns the size of the correction."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    for i in range(nv):
        w.vectors[CORRECTION, i] = loop.y[nq + i] + s * w.row[nq + i] - w.states[STAGE, nq + i]
    lu_solve(w.matrix, w.pivots, w.vectors[CORRECTION])
    total = 0.0
    for i in range(nv):
        dv = w.vectors[CORRECTION, i]
        w.states[STAGE, nq + i] += dv
        total += (dv / error_scale(loop.control, loop.y[nq + i], w.states[STAGE, nq + i])) ** 2
    # Not q + s dv: so q = q0 + s v holds to round-off, whatever Newton leaves in v.
    retract(loop.sizes, loop.y, s, w.states[STAGE], nq, w.states[STAGE])
    return math.sqrt((total + size_of_move(s, loop, w)) / (2 * nv))


@jitted
def size_of_move(s, loop, w):
    """Return the sum of squares of the correction's part in positions, in tolerances; a quaternion's size is 1."""
    total = 0.0
    start = 0
    for k in range(n_quaternions(loop.sizes) + 1):
        end = quaternion_at(loop.sizes, k)
        for i in range(start, end):
            scale = error_scale(loop.control, loop.y[i], w.states[STAGE, i])
            total += (s * w.vectors[CORRECTION, i - k] / scale) ** 2
        if end < loop.sizes[at.NQ]:
            scale = error_scale(loop.control, 1.0, 1.0)
            for i in range(end - k, end - k + 3):
                total += (s * w.vectors[CORRECTION, i] / scale) ** 2
        start = end + 4
    return total


@jitted
def reach_end(method, loop, t0, t1, w):
    """Write the new state to `w.states[Y_NEW]`, on the constraints; returns why not, or RUNNING."""
    nq, n, h = loop.sizes[at.NQ], loop.sizes[at.NQ] + loop.sizes[at.NV], t1 - t0
    s = method.theta * h
    for i in range(loop.sizes[at.NV]):
        w.vectors[ACCELERATION, i] = (w.states[STAGE, nq + i] - loop.y[nq + i]) / s
        w.states[Y_NEW, nq + i] = loop.y[nq + i] + h * w.vectors[ACCELERATION, i]
    retract(loop.sizes, loop.y, h, w.states[STAGE], nq, w.states[Y_NEW])
    loop.counters[HAVE_ACCELERATION] = 1
    if loop.sizes[at.NW] > 0:
        # The row is that of the last iterate but one.
        if not evaluate(loop, t0 + s, w.states[STAGE], w.row):
            return at.NOT_FINITE
        w.states[Y_NEW, n] = loop.y[n] + h * w.row[n]
    if loop.sizes[at.NM] > 0:
        loop.control[at.MIN_PIVOT_RATIO] = min(
            loop.control[at.MIN_PIVOT_RATIO], w.row[loop.sizes[at.N_ROW] - 1]
        )
    status = project_state(loop, t1, w.states[Y_NEW], w.scratch[: projection_size(loop.sizes)])
    if status != at.RUNNING:
        return status
    return at.RUNNING if all_finite(w.states[Y_NEW], loop.sizes[at.NY]) else at.NOT_FINITE

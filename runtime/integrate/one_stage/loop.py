"""Implicit Euler and implicit midpoint with a fixed step; their Newton systems have the size of v."""

import math
from typing import NamedTuple

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.after_step import finish_step
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.jacobian import acceleration_jacobian
from symgen.runtime.integrate.layout import (
    F_VALID,
    FACTORISATIONS,
    MAX_STEPS_PER_CALL,
    MIN_PIVOT_RATIO,
    N_LOGGED_STEPS,
    N_ROW,
    NEAR_WATCH,
    NEWTON_FAILED,
    NEWTON_ITERATIONS,
    NEWTON_TOL,
    NM,
    NOT_FINITE,
    NQ,
    NV,
    NW,
    NY,
    RUNNING,
    T,
)
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.newton import (
    DIVERGED,
    ITERATING,
    RATE,
    forget_rate,
    judge_correction,
    start_newton,
)
from symgen.runtime.integrate.one_stage.dense import one_stage_dense
from symgen.runtime.integrate.one_stage.work import (
    ACCELERATION,
    CORRECTION,
    FACTORED_FOR,
    STAGE,
    Y_NEW,
    stage_work,
)
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.quaternions import (
    chart_variation,
    move,
    n_quaternions,
    quaternion_at,
)
from symgen.runtime.integrate.step_control import error_scale, grid_end, watch_is_near

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
        if watch_is_near(control):
            return NEAR_WATCH
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
    nq = sizes[NQ]
    for i in range(sizes[NV]):
        rise = s * w.vectors[ACCELERATION, i] if counters[HAVE_ACCELERATION] else 0.0
        w.states[STAGE, nq + i] = y[nq + i] + rise
    move(sizes, y, s, w.states[STAGE], nq, w.states[STAGE])


@jitted
def iterate(s, addresses, sizes, p, control, counters, t0, y, w):
    """Improve the stage by simplified Newton; returns RUNNING, or why it does not converge."""
    # Lengths of steps on the grid differ by round-off of time, which is nothing to Newton.
    if not counters[HAVE_FACTORS] or abs(s - w.numbers[FACTORED_FOR]) > 1e-6 * s:
        status = factor_stage(s, sizes, counters, w)
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
def factor_stage(s, sizes, counters, w):
    """Factor I - s ∂a/∂v - s² ∂a/∂q, where the rates of a quaternion turn it by `chart_variation`."""
    nv = w.matrix.shape[0]
    for i in range(nv):
        for j in range(nv):
            w.matrix[i, j] = -s * (w.jacobian[i, nv + j] + s * w.jacobian[i, j])
        w.matrix[i, i] += 1.0
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        factor_turns(s, j, sizes[NQ] + j, w)
    counters[FACTORISATIONS] += 1
    counters[HAVE_FACTORS] = 1
    w.numbers[FACTORED_FOR] = s
    forget_rate(w.numbers)
    return lu_factor(w.matrix, w.pivots)


@jitted
def factor_turns(s, j, first, w):
    """Make the columns of the Newton matrix for the rates of a quaternion, from `j`; in states from `first`."""
    a, b, c = s * w.states[STAGE, first], s * w.states[STAGE, first + 1], s * w.states[STAGE, first + 2]
    for column in range(3):
        along = 1.0 if column == 0 else 0.0, 1.0 if column == 1 else 0.0, 1.0 if column == 2 else 0.0
        x, y, z = chart_variation(a, b, c, along[0], along[1], along[2])
        for i in range(w.matrix.shape[0]):
            turned = w.jacobian[i, j] * x + w.jacobian[i, j + 1] * y + w.jacobian[i, j + 2] * z
            w.matrix[i, j + column] += s * s * (w.jacobian[i, j + column] - turned)


@jitted
def correct_stage(s, sizes, control, y, w):
    """Correct the stage, whose derivative is `w.row`, by Newton; returns the size of the correction."""
    nq, nv = sizes[NQ], sizes[NV]
    for i in range(nv):
        w.vectors[CORRECTION, i] = y[nq + i] + s * w.row[nq + i] - w.states[STAGE, nq + i]
    lu_solve(w.matrix, w.pivots, w.vectors[CORRECTION])
    total = 0.0
    for i in range(nv):
        dv = w.vectors[CORRECTION, i]
        w.states[STAGE, nq + i] += dv
        total += (dv / error_scale(control, y[nq + i], w.states[STAGE, nq + i])) ** 2
    # Not q + s dv: so q = q0 + s v holds to round-off, whatever Newton leaves in v.
    move(sizes, y, s, w.states[STAGE], nq, w.states[STAGE])
    return math.sqrt((total + size_of_move(s, sizes, control, y, w)) / (2 * nv))


@jitted
def size_of_move(s, sizes, control, y, w):
    """Return the sum of squares of the correction's part in positions, in tolerances; a quaternion's size is 1."""
    total = 0.0
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            scale = error_scale(control, y[i], w.states[STAGE, i])
            total += (s * w.vectors[CORRECTION, i - k] / scale) ** 2
        if end < sizes[NQ]:
            scale = error_scale(control, 1.0, 1.0)
            for i in range(end - k, end - k + 3):
                total += (s * w.vectors[CORRECTION, i] / scale) ** 2
        start = end + 4
    return total


@jitted
def reach_end(method, addresses, sizes, p, control, counters, t0, t1, y, w):
    """Write the new state to `w.states[Y_NEW]`, on the constraints; returns why not, or RUNNING."""
    nq, n, h = sizes[NQ], sizes[NQ] + sizes[NV], t1 - t0
    s = method.theta * h
    for i in range(sizes[NV]):
        w.vectors[ACCELERATION, i] = (w.states[STAGE, nq + i] - y[nq + i]) / s
        w.states[Y_NEW, nq + i] = y[nq + i] + h * w.vectors[ACCELERATION, i]
    move(sizes, y, h, w.states[STAGE], nq, w.states[Y_NEW])
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

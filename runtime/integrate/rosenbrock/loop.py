"""The Rosenbrock method Rodas5P for stiff systems: adaptive steps, no iterations, a Jacobian for every step."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.after_step import finish_step, needs_dense
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.dense import evaluate_dense
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.jacobian import acceleration_jacobian
from symgen.runtime.integrate.layout import (
    ERROR_OLD,
    F_VALID,
    FACTORISATIONS,
    MAX_STEPS_PER_CALL,
    MIN_PIVOT_RATIO,
    N_LOGGED_STEPS,
    N_ROW,
    NEAR_WATCH,
    NM,
    NOT_FINITE,
    NQ,
    NV,
    NW,
    NY,
    REJECTED,
    RUNNING,
    STEP_TOO_SMALL,
    H,
    T,
)
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.radau.turns import factor_turns
from symgen.runtime.integrate.rosenbrock.coefficients import LOBATTO, N_STAGES
from symgen.runtime.integrate.rosenbrock.moves import (
    add_divided_rates,
    bend,
    place,
    stage_rates,
    turn_dense,
)
from symgen.runtime.integrate.rosenbrock.work import (
    F_LATER,
    F_NEW,
    POWER,
    SLOPE,
    STAGE,
    Y_NEW,
    Y_STAGE,
    rodas_work,
)
from symgen.runtime.integrate.step_control import (
    SAFETY,
    accept_step,
    error_norm,
    error_scale,
    first_step,
    reject_step,
    step_end,
    too_small,
    watch_is_near,
)

N_DENSE = 5
EXPONENT, BETA, SHRINK, GROW = 0.17, 0.04, 0.2, 6.0
# Of the step, for the derivative by time: truncation, of second order, is below round-off then.
TIME_SHIFT = 1e-4


@jitted
def advance_rodas5p(
    method, addresses, sizes, p, control, counters, y, f, work, frame_times, frames, step_log, dense
):
    """Advance with a `Rosenbrock` method until something is for Python to do.

    Steinebach, BIT 63 (2023) 27; Hairer, Wanner, Solving ODEs II (1996), IV.7. q is eliminated from the linear systems,
    which have the size of v; a quaternion is integrated as the rotation vector from the start of the step; constrained
    models are integrated in their accelerations and projected after every step; work is a quadrature over the dense
    output and has no part in any norm. Arguments and result are those of all step loops, see docs/architecture.md.
    """
    w = rodas_work(sizes, work)
    if not counters[F_VALID]:
        if not evaluate(addresses, sizes, p, counters, control[T], y, f):
            return NOT_FINITE
        counters[F_VALID] = 1
    if control[H] <= 0.0:
        control[H] = first_step(
            5, addresses, sizes, p, control, counters, y, f, w.rows[STAGE], w.states[Y_STAGE]
        )
        control[ERROR_OLD] = 1e-4
    done = 0
    while done < counters[MAX_STEPS_PER_CALL] and counters[N_LOGGED_STEPS] < step_log.shape[0]:
        if watch_is_near(control):
            return NEAR_WATCH
        t0 = control[T]
        status, t1 = rodas_step(method, addresses, sizes, p, control, counters, y, f, w)
        if status != RUNNING:
            return status
        if sizes[NW] > 0 or needs_dense(sizes, counters, frame_times, t1):
            rodas_dense(method, sizes, y, w, dense)
        if sizes[NW] > 0:
            integrate_work(method, addresses, sizes, p, counters, t0, t1 - t0, y, f, w, dense)
            if not math.isfinite(w.states[Y_NEW, sizes[NY] - 1]):
                return NOT_FINITE
        copy(w.states[Y_NEW], y)
        copy(w.rows[F_NEW], f)
        status = finish_step(
            addresses, sizes, p, control, counters, t0, t1, y, dense, N_DENSE, w.scratch,
            frame_times, frames, step_log,
        )  # fmt: skip
        if status != RUNNING:
            return status
        done += 1
    return RUNNING


@jitted
def rodas_step(method, addresses, sizes, p, control, counters, y, f, w):
    """Try steps until one is accepted: `w.states[Y_NEW]` is then the new state, `w.rows[F_NEW]` its rhs row.

    Returns
    -------
    tuple
        Status and the time of the new state [s].
    """
    status = linearise(method, addresses, sizes, p, control, counters, y, f, w)
    if status != RUNNING:
        return status, control[T]
    while True:
        t, t1 = control[T], step_end(control)
        h = t1 - t
        error = math.inf
        cause = take_stages(method, h, addresses, sizes, p, counters, t, t1, y, f, w)
        if cause == RUNNING:
            error = estimate_error(sizes, control, y, w)
            cause = STEP_TOO_SMALL if math.isfinite(error) else NOT_FINITE
        if error <= 1.0:
            cause = reach_end(addresses, sizes, p, control, counters, t1, w)
            if cause == RUNNING:
                accept_step(EXPONENT, BETA, SHRINK, GROW, SAFETY, error, h, control, counters)
                return RUNNING, t1
            error = math.inf
        reject_step(EXPONENT, SHRINK, SAFETY, error, h, control, counters)
        counters[REJECTED] += 1
        if too_small(control):
            return cause, t


@jitted
def estimate_error(sizes, control, y, w):
    """Return the size of the last increment in tolerances."""
    nq, nv, error, y_new = sizes[NQ], sizes[NV], w.increments[N_STAGES - 1], w.states[Y_NEW]
    if nq == nv:
        return error_norm(control, 2 * nv, y, y_new, error)
    total, start = 0.0, 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, min(end + 3, nq)):
            j = i - k
            tolerance = error_scale(control, y[i], y_new[i]) if i < end else error_scale(control, 1.0, 1.0)
            total += (error[j] / tolerance) ** 2
            total += (error[nv + j] / error_scale(control, y[nq + j], y_new[nq + j])) ** 2
        start = end + 4
    return math.sqrt(total / (2 * nv))


@jitted
def linearise(method, addresses, sizes, p, control, counters, y, f, w):
    """Differentiate the accelerations at the start of the step by q, v and t; returns a status."""
    t, nq, nv = control[T], sizes[NQ], sizes[NV]
    if method.time_dependent:
        later, earlier = t + TIME_SHIFT * control[H], t - TIME_SHIFT * control[H]
        finite = evaluate(addresses, sizes, p, counters, later, y, w.rows[F_LATER])
        if not (finite and evaluate(addresses, sizes, p, counters, earlier, y, w.rows[STAGE])):
            return NOT_FINITE
        for i in range(nv):
            rise = w.rows[F_LATER, nq + i] - w.rows[STAGE, nq + i]
            w.vectors[SLOPE, i] = rise / (later - earlier) if later > earlier else 0.0
    else:
        for i in range(nv):
            w.vectors[SLOPE, i] = 0.0
    return acceleration_jacobian(addresses, sizes, p, counters, t, y, f, w.implicit, w.jacobian)


@jitted
def take_stages(method, h, addresses, sizes, p, counters, t, t1, y, f, w):
    """Compute the increments of a step of length `h`, and its end in `w.states[Y_NEW]`; returns a status."""
    status = factor(method, h, sizes, counters, y, w)
    if status != RUNNING:
        return status
    copy(f, w.rows[STAGE])
    copy(y, w.states[Y_NEW])
    for s in range(N_STAGES):
        if s > 0:
            place(method.a[s], s, sizes, y, w, w.states[Y_STAGE])
            time = t1 if method.nodes[s] == 1.0 else t + method.nodes[s] * h
            if not evaluate(addresses, sizes, p, counters, time, w.states[Y_STAGE], w.rows[STAGE]):
                return NOT_FINITE
        solve_increment(s, method, h, sizes, y, w)
    place(method.end, N_STAGES, sizes, y, w, w.states[Y_NEW])
    return RUNNING


@jitted
def factor(method, h, sizes, counters, y, w):
    """Factor g - B - A/g; returns a status.

    With J = [0 I; A B], (g - J) (x, z) = (r, s) is (g - B - A/g) z = s + A r/g and x = (r + z)/g. For the rotation
    vector of a quaternion, 1/g becomes the inverse of g + ω× / 2.
    """
    nv, g = w.matrix.shape[0], 1.0 / (h * method.gamma)
    for i in range(nv):
        for j in range(nv):
            w.matrix[i, j] = -w.jacobian[i, nv + j] - w.jacobian[i, j] / g
        w.matrix[i, i] += g
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        factor_turns(g, j, y, sizes[NQ] + j, w.jacobian, w.matrix)
    counters[FACTORISATIONS] += 1
    return lu_factor(w.matrix, w.pivots)


@jitted
def solve_increment(s, method, h, sizes, y, w):
    """Solve for increment `s`, with the rhs row of its stage in `w.rows[STAGE]`."""
    nv, g = sizes[NV], 1.0 / (h * method.gamma)
    increment = w.increments[s]
    stage_rates(s, method, h, sizes, y, w, increment)
    for i in range(nv):
        total = increment[nv + i] + h * method.slopes[s] * w.vectors[SLOPE, i]
        for j in range(nv):
            total += w.jacobian[i, j] * increment[j]
        increment[nv + i] = total
    lu_solve(w.matrix, w.pivots, increment[nv:])
    add_divided_rates(g, sizes, y, increment)


@jitted
def reach_end(addresses, sizes, p, control, counters, t1, w):
    """Project the new state and evaluate its rhs row; returns a status."""
    if sizes[NM] > 0:
        control[MIN_PIVOT_RATIO] = min(control[MIN_PIVOT_RATIO], w.rows[STAGE, sizes[N_ROW] - 1])
    status = project_state(
        addresses, sizes, p, t1, w.states[Y_NEW], control, counters, w.scratch[: projection_size(sizes)]
    )
    if status != RUNNING:
        return status
    if not evaluate(addresses, sizes, p, counters, t1, w.states[Y_NEW], w.rows[F_NEW]):
        return NOT_FINITE
    return RUNNING if all_finite(w.states[Y_NEW], sizes[NY]) else NOT_FINITE


@jitted
def rodas_dense(method, sizes, y, w, dense):
    """Fill `dense` with the published dense output; what projection moved is added in proportion to time."""
    for i in range(sizes[NY]):
        dense[0, i] = y[i]
        dense[1, i] = w.states[Y_NEW, i] - y[i]
    nq, nv = sizes[NQ], sizes[NV]
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            for r in range(3):
                dense[2 + r, i] = bend(method, r, i - k, w)
        if end < nq:
            turn_dense(method, end, end - k, y, w, dense)
        start = end + 4
    for i in range(nv):
        for r in range(3):
            dense[2 + r, nq + i] = bend(method, r, nv + i, w)


@jitted
def integrate_work(method, addresses, sizes, p, counters, t0, h, y, f, w, dense):
    """Integrate the power along the dense output by Lobatto's rule, of order 6, and make its dense output."""
    n = sizes[NQ] + sizes[NV]
    power = w.vectors[POWER]
    power[0] = h * f[n]
    for k in range(2):
        evaluate_dense(LOBATTO[k], dense, N_DENSE, n, w.states[Y_STAGE])
        evaluate(addresses, sizes, p, counters, t0 + LOBATTO[k] * h, w.states[Y_STAGE], w.rows[F_LATER])
        power[1 + k] = h * w.rows[F_LATER, n]
    work = (power[0] + 5.0 * (power[1] + power[2]) + h * w.rows[F_NEW, n]) / 12.0
    w.states[Y_NEW, n] = y[n] + work
    dense[0, n] = y[n]
    dense[1, n] = work
    for r in range(3):
        total = 0.0
        for k in range(3):
            total += method.work[r, k] * (power[k] - work)
        dense[2 + r, n] = total

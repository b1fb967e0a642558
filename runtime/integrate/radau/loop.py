"""Radau IIA of order 5, 9 and 13, for stiff systems: adaptive steps, Jacobian and factors kept while they serve."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.after_step import finish_step
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.jacobian import acceleration_jacobian
from symgen.runtime.integrate.layout import (
    ERROR_OLD,
    F_VALID,
    H_LAST,
    LAST_REJECTED,
    MAX_STEPS_PER_CALL,
    MIN_PIVOT_RATIO,
    N_LOGGED_STEPS,
    N_ROW,
    NEAR_WATCH,
    NM,
    NOT_FINITE,
    NY,
    REJECTED,
    RUNNING,
    SINGULAR_MATRIX,
    STEP_TOO_SMALL,
    H,
    T,
)
from symgen.runtime.integrate.newton import MAX_ITERATIONS, OVERSHOOT, RATE
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.radau.error import estimate_error, set_tolerances
from symgen.runtime.integrate.radau.stages import factor_stages, integrate_work, predict_stages, solve_stages
from symgen.runtime.integrate.radau.turns import place, turns_to_increments
from symgen.runtime.integrate.radau.work import (
    F_NEW,
    F_STAGES,
    FACTORED_FOR,
    HAVE_FACTORS,
    HAVE_HISTORY,
    HAVE_JACOBIAN,
    ITERATIONS,
    JACOBIAN_IS_FRESH,
    LAST_RATE,
    STAGES,
    Y_NEW,
    Y_STAGE,
    radau_work,
)
from symgen.runtime.integrate.step_control import (
    SAFETY,
    first_step,
    longest_step,
    step_end,
    too_small,
    watch_is_near,
)

SHRINK, GROW = 0.2, 8.0
# A step that would grow by less than this is kept, and with it the factors.
KEEP_STEP = 1.2
# With a rate of contraction below this the Jacobian serves another step.
KEEP_JACOBIAN_RATE = 1e-2
# Where Newton contracts more slowly than this, the step must not grow.
GROW_RATE = 0.1


@jitted
def advance_radau(
    method, addresses, sizes, p, control, counters, y, f, work, frame_times, frames, step_log, dense
):
    """Advance with Radau IIA until something is for Python to do.

    Hairer, Wanner, Solving ODEs II (1996), IV.8; J. Comput. Appl. Math. 111 (1999) 93, and radau.f, whose tolerances,
    controllers and tests these are. Deviations: the number of stages stays; q is eliminated from the Newton systems; 12
    iterations, and corrections that are round-off are recognised; a Jacobian is kept up to a higher rate of
    contraction, and a slow contraction keeps the step from growing; the state is projected onto the constraints after
    acceptance, before the evaluation at the new point; work is a quadrature and has no part in any norm; quaternions
    are collocated by the rotation vector that turns them from the start of the step.
    Arguments and result are those of all step loops, see docs/architecture.md; `method` is a `RadauIIA`.
    """
    w = radau_work(method, sizes, work)
    if not begin_radau(method, addresses, sizes, p, control, counters, y, f, w):
        return NOT_FINITE
    done = 0
    while done < counters[MAX_STEPS_PER_CALL] and counters[N_LOGGED_STEPS] < step_log.shape[0]:
        if watch_is_near(control):
            return NEAR_WATCH
        t0 = control[T]
        status, t1 = radau_step(method, addresses, sizes, p, control, counters, y, f, w, dense)
        if status != RUNNING:
            return status
        status = commit_radau(
            method,
            addresses,
            sizes,
            p,
            control,
            counters,
            t0,
            t1,
            y,
            f,
            w,
            frame_times,
            frames,
            step_log,
            dense,
        )
        if status != RUNNING:
            return status
        done += 1
    return RUNNING


@jitted
def begin_radau(method, addresses, sizes, p, control, counters, y, f, w):
    """Evaluate where a run begins and choose its first step, unless that is done; returns whether all is finite."""
    if not counters[F_VALID]:
        if not evaluate(addresses, sizes, p, counters, control[T], y, f):
            return False
        counters[F_VALID] = 1
        counters[HAVE_JACOBIAN] = 0
        counters[HAVE_HISTORY] = 0
        w.numbers[LAST_RATE] = 0.0
    if control[H] <= 0.0:
        control[H] = first_step(
            len(method.c) + 1, addresses, sizes, p, control, counters, y, f, w.rows[F_NEW], w.states[Y_STAGE]
        )
    return True


@jitted
def commit_radau(
    method, addresses, sizes, p, control, counters, t0, t1, y, f, w, frame_times, frames, step_log, dense
):
    """Make the new state the current one, with dense output, and record the step."""
    radau_dense(method, sizes, y, w, dense)
    copy(w.states[Y_NEW], y)
    copy(w.rows[F_NEW], f)
    return finish_step(
        addresses, sizes, p, control, counters, t0, t1, y, dense, len(method.c) + 1, w.scratch,
        frame_times, frames, step_log,
    )  # fmt: skip


@jitted
def radau_step(method, addresses, sizes, p, control, counters, y, f, w, dense):
    """Try steps until one is accepted: `w.states[Y_NEW]` is then the new state, `w.rows[F_NEW]` its rhs row.

    Returns
    -------
    tuple
        Status and the time of the new state [s].
    """
    set_tolerances(method, sizes, control, y, w)
    cause = STEP_TOO_SMALL
    while True:
        t, t1 = control[T], step_end(control)
        h = t1 - t
        if too_small(control):
            return cause, t
        if not counters[HAVE_JACOBIAN]:
            status = acceleration_jacobian(addresses, sizes, p, counters, t, y, f, w.implicit, w.jacobian)
            if status != RUNNING:
                return status, t
            counters[HAVE_JACOBIAN], counters[JACOBIAN_IS_FRESH], counters[HAVE_FACTORS] = 1, 1, 0
        cause = try_step(method, h, addresses, sizes, p, control, counters, t, y, f, w, dense)
        if cause != RUNNING:
            shrink_step(cause, h, control, counters, w)
            continue
        error = estimate_error(method, h, addresses, sizes, p, counters, t, y, f, w)
        cause = STEP_TOO_SMALL if math.isfinite(error) else NOT_FINITE
        if error < 1.0:
            cause = reach_end(method, h, addresses, sizes, p, control, counters, t, t1, y, w)
            if cause == RUNNING:
                accept_radau(method, error, h, control, counters, w)
                return RUNNING, t1
            error = math.inf
        reject_radau(method, error, h, control, counters, w)


@jitted
def try_step(method, h, addresses, sizes, p, control, counters, t, y, f, w, dense):
    """Solve the stages of a step of length `h`; returns RUNNING or why that failed."""
    # Lengths of equal steps differ by round-off of time, which is nothing to Newton.
    if not counters[HAVE_FACTORS] or abs(h - w.numbers[FACTORED_FOR]) > 1e-6 * h:
        counters[HAVE_FACTORS] = 0
        status = factor_stages(method, h, sizes, counters, y, w)
        if status != RUNNING:
            return status
        counters[HAVE_FACTORS] = 1
    predict_stages(method, h, counters[HAVE_HISTORY] != 0, sizes, control, y, dense, w)
    return solve_stages(method, h, addresses, sizes, p, control, counters, t, y, w)


@jitted
def shrink_step(cause, h, control, counters, w):
    """Shorten the step after Newton failed: by as much as it was too slow, else to half."""
    factor = 0.5
    if cause != SINGULAR_MATRIX and w.numbers[OVERSHOOT] > 0.0:
        rest = 4.0 + MAX_ITERATIONS - 1.0 - w.numbers[ITERATIONS]
        factor = 0.8 * max(1e-4, min(20.0, w.numbers[OVERSHOOT])) ** (-1.0 / rest)
    control[H] = h * factor
    counters[LAST_REJECTED] = 1
    counters[REJECTED] += 1
    counters[HAVE_FACTORS] = 0
    if not counters[JACOBIAN_IS_FRESH]:
        counters[HAVE_JACOBIAN] = 0


@jitted
def reach_end(method, h, addresses, sizes, p, control, counters, t0, t1, y, w):
    """Write the new state and its rhs row, on the constraints; returns why not, or RUNNING."""
    if not integrate_work(method, h, addresses, sizes, p, counters, t0, y, w):
        return NOT_FINITE
    n = len(method.c)
    place(sizes, y, w.states[STAGES + n - 1], w.states[Y_NEW])
    if sizes[NM] > 0:
        for s in range(n):
            ratio = w.rows[F_STAGES + s, sizes[N_ROW] - 1]
            control[MIN_PIVOT_RATIO] = min(control[MIN_PIVOT_RATIO], ratio)
    status = project_state(
        addresses, sizes, p, t1, w.states[Y_NEW], control, counters, w.scratch[: projection_size(sizes)]
    )
    if status != RUNNING:
        return status
    if not evaluate(addresses, sizes, p, counters, t1, w.states[Y_NEW], w.rows[F_NEW]):
        return NOT_FINITE
    return RUNNING if all_finite(w.states[Y_NEW], sizes[NY]) else NOT_FINITE


@jitted
def quotient(method, error, w):
    """Return h / h_new of the elementary controller, which is shy of steps that took many iterations."""
    safety = SAFETY * (1.0 + 2.0 * MAX_ITERATIONS) / (w.numbers[ITERATIONS] + 2.0 * MAX_ITERATIONS)
    return max(1.0 / GROW, min(1.0 / SHRINK, error ** (1.0 / (len(method.c) + 1.0)) / min(SAFETY, safety)))


@jitted
def accept_radau(method, error, h, control, counters, w):
    """Set `control[H]` after an accepted step: Gustafsson's predictive controller (IV.8, (8.25))."""
    wanted, power = control[H], 1.0 / (len(method.c) + 1.0)
    factor = quotient(method, error, w)
    if counters[HAVE_HISTORY]:
        predicted = control[H_LAST] / h * (error**2 / control[ERROR_OLD]) ** power / SAFETY
        factor = max(factor, max(1.0 / GROW, min(1.0 / SHRINK, predicted)))
        # As in Gustafsson, Söderlind, SIAM J. Sci. Comput. 18 (1997) 23; but the exponent was found by trial: with
        # stiff joints that turn, the error asks again and again for steps for which Newton then diverges.
        factor = max(factor, min(1.0, (w.numbers[LAST_RATE] / GROW_RATE) ** (1.0 / 3.0)))
    h_new = min(h / factor, longest_step(control))
    if counters[LAST_REJECTED]:
        h_new = min(h_new, h)
    keep_jacobian = w.numbers[RATE] <= KEEP_JACOBIAN_RATE
    if keep_jacobian and h <= h_new <= KEEP_STEP * h:
        h_new = h
    # A step that was cut at a stop time says nothing against the step that the method wanted.
    control[H] = max(h_new, wanted) if h < wanted else h_new
    control[ERROR_OLD] = max(error, 1e-2)
    counters[LAST_REJECTED] = 0
    counters[HAVE_HISTORY] = 1
    counters[HAVE_JACOBIAN] = 1 if keep_jacobian else 0
    counters[JACOBIAN_IS_FRESH] = 0


@jitted
def reject_radau(method, error, h, control, counters, w):
    """Set `control[H]` after a step with too large an error."""
    if not counters[HAVE_HISTORY]:
        control[H] = 0.1 * h
    else:
        control[H] = h / (quotient(method, error, w) if math.isfinite(error) else 1.0 / SHRINK)
    counters[LAST_REJECTED] = 1
    counters[REJECTED] += 1
    if not counters[JACOBIAN_IS_FRESH]:
        counters[HAVE_JACOBIAN] = 0


@jitted
def radau_dense(method, sizes, y, w, dense):
    """Fill `dense` with the collocation polynomial; what projection moved is added in proportion to time."""
    n = len(method.c)
    for s in range(n):
        turns_to_increments(sizes, y, w.states[STAGES + s])
    for i in range(sizes[NY]):
        dense[0, i] = y[i]
        dense[1, i] = w.states[Y_NEW, i] - y[i]
        for r in range(n - 1):
            total = 0.0
            for s in range(n):
                total += method.rows[r, s] * w.states[STAGES + s, i]
            dense[2 + r, i] = total

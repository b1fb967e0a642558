"""Explicit Runge-Kutta methods in independent coordinates: the others follow from the constraints at every stage."""

import math

from runtime.code.bridge import call_kernel
from runtime.code.jitted import jitted
from runtime.integrate.after_step import finish_step, needs_dense
from runtime.integrate.copying import copy
from runtime.integrate.evaluation import all_finite, evaluate
from runtime.integrate.explicit.loop import erk_dense, erk_sum, estimate_error
from runtime.integrate.explicit.tableaus import NO_ESTIMATE
from runtime.integrate.layout import (
    ERROR_OLD,
    F_VALID,
    MAX_STEPS_PER_CALL,
    MIN_PIVOT_RATIO,
    N_LOGGED_STEPS,
    N_ROW,
    NOT_FINITE,
    NY,
    PARTITION_LOST,
    PROJECTION_FAILED,
    REJECTED,
    RHS,
    RHS_CALLS,
    RUNNING,
    STEP_TOO_SMALL,
    H,
    T,
)
from runtime.integrate.partition.choice import choose_partition, is_worn
from runtime.integrate.partition.dependents import solve_dependents
from runtime.integrate.partition.work import LATEST, partition_work
from runtime.integrate.step_control import accept_step, first_step, grid_end, reject_step, step_end, too_small

# Where steps shrink to nothing while a pivot is below this, it is the constraints that stop them.
_NEARLY_LOST = 1e-2


@jitted
def advance_partition(
    method, addresses, sizes, p, control, counters, y, f, work, frame_times, frames, step_log, dense
):
    """Advance with an explicit Runge-Kutta method in independent coordinates until something is for Python to do.

    `y` holds all coordinates and rates; those that depend on the others are solved for before every evaluation, so that
    only the independent ones are integrated. After a step that leaves the partition worn, another is chosen. Frames and
    events use the method's dense output. Arguments and result are those of all step loops, see
    docs/architecture.md; `method` is an `ErkTableau`.
    """
    w = partition_work(method.n_rows, sizes, work)
    if not counters[F_VALID]:
        status = begin(method, addresses, sizes, p, control, counters, y, f, w)
        if status != RUNNING:
            return status
    done = 0
    while done < counters[MAX_STEPS_PER_CALL] and counters[N_LOGGED_STEPS] < step_log.shape[0]:
        t0 = control[T]
        if is_worn(w):
            status = choose_partition(addresses, sizes, p, counters, t0, y, w)
            if status != RUNNING:
                return status
        if method.estimate == NO_ESTIMATE:
            t1 = grid_end(control, counters)
            status = take_step(method, addresses, sizes, p, control, counters, t0, t1, y, f, w)
        else:
            status, t1 = adaptive_step(method, addresses, sizes, p, control, counters, y, f, w)
        if status != RUNNING:
            return status
        if needs_dense(sizes, counters, frame_times, t1):
            erk_dense(method, addresses, sizes, p, counters, t0, t1 - t0, y, w.stages, w.states, dense)
        copy(w.states[1], y)
        copy(w.stages[method.n_stages - method.fsal], f)
        status = finish_step(
            addresses, sizes, p, control, counters, t0, t1, y, dense, method.n_dense, w.scratch,
            frame_times, frames, step_log,
        )  # fmt: skip
        if status != RUNNING:
            return status
        done += 1
    return RUNNING


@jitted
def begin(method, addresses, sizes, p, control, counters, y, f, w):
    """Choose a partition and, where that is open, the first step; returns a status."""
    t = control[T]
    status = choose_partition(addresses, sizes, p, counters, t, y, w)
    if status != RUNNING:
        return status
    if not evaluate(addresses, sizes, p, counters, t, y, f):
        return NOT_FINITE
    counters[F_VALID] = 1
    if method.estimate != NO_ESTIMATE and control[H] <= 0.0:
        control[H] = first_step(
            method.order, addresses, sizes, p, control, counters, y, f, w.stages[0], w.states[0]
        )
        control[ERROR_OLD] = 1e-4
    return RUNNING


@jitted
def adaptive_step(method, addresses, sizes, p, control, counters, y, f, w):
    """Try steps until one is accepted; returns status and the time of the new state [s]."""
    cause = STEP_TOO_SMALL
    while True:
        t, t1 = control[T], step_end(control)
        h = t1 - t
        if too_small(control):
            lost = cause == PROJECTION_FAILED or w.numbers[LATEST] < _NEARLY_LOST
            return (PARTITION_LOST if lost else cause), t
        cause = take_step(method, addresses, sizes, p, control, counters, t, t1, y, f, w)
        error = math.inf
        if cause == RUNNING:
            error = estimate_error(method, sizes, control, h, y, w.stages, w.states)
            if error <= 1.0:
                accept_step(
                    method.exponent, method.beta, method.shrink, method.grow, method.safety, error, h, control,
                    counters,
                )  # fmt: skip
                return RUNNING, t1
            cause = STEP_TOO_SMALL if math.isfinite(error) else NOT_FINITE
        reject_step(method.exponent, method.shrink, method.safety, error, h, control, counters)
        counters[REJECTED] += 1


@jitted
def take_step(method, addresses, sizes, p, control, counters, t, t1, y, f, w):
    """Fill the stages of a step from `t` to `t1`, the new state and its derivative; returns a status."""
    h, last = t1 - t, method.n_stages - method.fsal
    copy(f, w.stages[0])
    for s in range(1, last + 1):
        argument = w.states[1] if s == last else w.states[0]
        place = t1 if s == last else t + method.c[s] * h
        erk_sum(method.a[s], s, h, y, w.stages, argument)
        status = solve_dependents(addresses, sizes, p, control, counters, place, argument, w)
        if status != RUNNING:
            return status
        call_kernel(addresses[RHS], place, argument, p, w.stages[s])
        counters[RHS_CALLS] += 1
        control[MIN_PIVOT_RATIO] = min(control[MIN_PIVOT_RATIO], w.stages[s, sizes[N_ROW] - 1])
    if all_finite(w.states[1], sizes[NY]) and all_finite(w.stages[last], sizes[NY]):
        return RUNNING
    return NOT_FINITE

"""Explicit Runge-Kutta methods in independent coordinates: the others follow from the constraints at every stage."""

import math

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.after_step import finish_step, needs_dense
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.energy_scaling import count_energy, scale_energy
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.explicit.loop import combine_dense, erk_sum, norm_of_two
from symgen.runtime.integrate.explicit.tableau import NO_ESTIMATE, TWO_ESTIMATES
from symgen.runtime.integrate.layout import (
    ERROR_OLD,
    F_VALID,
    MAX_STEPS_PER_CALL,
    MIN_PIVOT_RATIO,
    N_LOGGED_STEPS,
    N_ROW,
    NEAR_WATCH,
    NOT_FINITE,
    NQ,
    NV,
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
from symgen.runtime.integrate.partition.choice import LEAST, choose_partition, is_worn, measure, serves
from symgen.runtime.integrate.partition.dependents import solve_dependents
from symgen.runtime.integrate.partition.work import END, LATEST, N_NUMBERS, START, partition_work
from symgen.runtime.integrate.step_control import (
    accept_step,
    error_norm,
    first_step,
    grid_end,
    reject_step,
    step_end,
    too_small,
    watch_is_near,
)

# Where steps shrink to nothing while a pivot is below this, it is the constraints that stop them.
_NEARLY_LOST = 1e-2
_APART = 1e-6
# Errors across the constraints are taken off at a slant, so that a part of them stays: on random mechanisms, errors are
# those of projection at the same tolerance, but for this factor.
_CAUTION = 2.0


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
        if watch_is_near(control):
            return NEAR_WATCH
        t0 = control[T]
        if is_worn(w):
            status = choose_partition(addresses, sizes, p, counters, t0, y, w)
            if status != RUNNING:
                return status
        if method.estimate == NO_ESTIMATE:
            t1 = grid_end(control, counters)
            status = fixed_step(method, addresses, sizes, p, control, counters, t0, t1, y, f, w)
        else:
            status, t1 = adaptive_step(method, addresses, sizes, p, control, counters, y, f, w)
        if status != RUNNING:
            return status
        if needs_dense(sizes, counters, frame_times, t1):
            take_dense(method, addresses, sizes, p, control, counters, t0, t1 - t0, y, w, dense)
        count_energy(addresses, control)
        copy(w.numbers[END:N_NUMBERS], w.numbers[START:END])
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
            lost = cause == PROJECTION_FAILED or abs(w.numbers[LATEST]) < _NEARLY_LOST
            return (PARTITION_LOST if lost else cause), t
        cause = take_step(method, addresses, sizes, p, control, counters, t, t1, y, f, w)
        error = math.inf
        if cause == RUNNING:
            error = step_error(method, addresses, sizes, p, control, counters, t1, h, y, w)
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
def fixed_step(method, addresses, sizes, p, control, counters, t, t1, y, f, w):
    """Take a step of the grid; where it leaves what the partition can describe, with another; returns a status."""
    status = take_step(method, addresses, sizes, p, control, counters, t, t1, y, f, w)
    if status == PROJECTION_FAILED:
        status = choose_partition(addresses, sizes, p, counters, t, y, w)
        if status == RUNNING:
            status = take_step(method, addresses, sizes, p, control, counters, t, t1, y, f, w)
    return status


@jitted
def take_step(method, addresses, sizes, p, control, counters, t, t1, y, f, w):
    """Fill the stages of a step from `t` to `t1`, the new state and its derivative; returns a status."""
    h, last = t1 - t, method.n_stages - method.fsal
    least = LEAST if method.estimate != NO_ESTIMATE else 0.0
    copy(f, w.stages[0])
    for s in range(1, last + 1):
        argument = w.states[1] if s == last else w.states[0]
        place = t1 if s == last else t + method.c[s] * h
        erk_sum(method.a[s], s, h, y, w.stages, argument)
        status = solve_dependents(addresses, sizes, p, control, counters, place, argument, w)
        if status == RUNNING and not serves(least, counters, w):
            status = PROJECTION_FAILED
        if status != RUNNING:
            return status
        if s == last:
            scale_energy(addresses, sizes, p, t1, argument, control, w.scratch)
        call_kernel(addresses[RHS], place, argument, p, w.stages[s])
        counters[RHS_CALLS] += 1
        control[MIN_PIVOT_RATIO] = min(control[MIN_PIVOT_RATIO], w.stages[s, sizes[N_ROW] - 1])
    if not measure(END, addresses, sizes, p, counters, t1, w.states[1], w):
        return PROJECTION_FAILED
    if all_finite(w.states[1], sizes[NY]) and all_finite(w.stages[last], sizes[NY]):
        return RUNNING
    return NOT_FINITE


@jitted
def step_error(method, addresses, sizes, p, control, counters, t1, h, y, w):
    """Return the error of a step in units of the tolerance, in the dependent coordinates and rates as well.

    Their error is what that of the others makes of them, so they are solved for in the solutions of lower order too.
    That alone would not see errors across the constraints, which say that a step is too long.
    """
    y_new = w.states[1]
    for e in range(method.estimate):
        sum_errors(method, e, sizes, h, w.stages, w.states[2 + e])
    error = estimates_norm(method, sizes, control, y, w)
    if not error <= 1.0:
        return error
    for e in range(method.estimate):
        difference = w.states[2 + e]
        # The difference of two solutions that are very near each other would be the rounding of both.
        apart = part_of_motion(sizes, y_new, difference)
        scale = max(1.0, _APART / apart) if apart > 0.0 else 1.0
        for i in range(sizes[NY]):
            difference[i] = y_new[i] - scale * difference[i]
        if solve_dependents(addresses, sizes, p, control, counters, t1, difference, w) != RUNNING:
            return math.inf
        for i in range(sizes[NY]):
            difference[i] = (y_new[i] - difference[i]) / scale
    return _CAUTION * max(error, estimates_norm(method, sizes, control, y, w))


@jitted
def sum_errors(method, e, sizes, h, k, out):
    """Write estimate `e` of the error of (q, v) to `out`; work is left out, it follows the motion."""
    for i in range(sizes[NY]):
        out[i] = 0.0
    for j in range(method.n_stages):
        weight = h * method.error[e, j]
        if weight != 0.0:
            for i in range(sizes[NQ] + sizes[NV]):
                out[i] += weight * k[j, i]


@jitted
def estimates_norm(method, sizes, control, y, w):
    """Return the size of the estimates in `w.states` in units of the tolerance."""
    n = sizes[NQ] + sizes[NV]
    if method.estimate == TWO_ESTIMATES:
        return norm_of_two(control, n, y, w.states[1], w.states[2], w.states[3])
    return error_norm(control, n, y, w.states[1], w.states[2])


@jitted
def part_of_motion(sizes, y, change):
    """Return the largest change of a coordinate in parts of the largest coordinate, or of a rate likewise."""
    largest = 0.0
    for first, end in ((0, sizes[NQ]), (sizes[NQ], sizes[NQ] + sizes[NV])):
        moved, size = 0.0, 0.0
        for i in range(first, end):
            moved, size = max(moved, abs(change[i])), max(size, abs(y[i]))
        if size > 0.0:
            largest = max(largest, moved / size)
    return largest


@jitted
def take_dense(method, addresses, sizes, p, control, counters, t, h, y, w, dense):
    """Fill the dense output of the step, whose further stages lie on the constraints as all others do."""
    for s in range(method.n_stages + 1 - method.fsal, method.n_rows):
        erk_sum(method.a[s], s, h, y, w.stages, w.states[0])
        solve_dependents(addresses, sizes, p, control, counters, t + method.c[s] * h, w.states[0], w)
        call_kernel(addresses[RHS], t + method.c[s] * h, w.states[0], p, w.stages[s])
        counters[RHS_CALLS] += 1
    combine_dense(method, sizes, h, y, w.stages, w.states, dense)

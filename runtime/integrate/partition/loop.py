"""Explicit Runge-Kutta methods in independent coordinates: the others follow from the constraints at every stage."""

import math

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_step, needs_dense
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.energy_scaling import count_energy, scale_energy
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.explicit.loop import combine_dense, erk_sum, norm_of_two
from symgen.runtime.integrate.explicit.tableau import NO_ESTIMATE, TWO_ESTIMATES
from symgen.runtime.integrate.loop import take_steps
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
)

# Where steps shrink to nothing while a pivot is below this, it is the constraints that stop them.
_NEARLY_LOST = 1e-2
_APART = 1e-6
# Errors across the constraints are taken off at a slant, so that a part of them stays: on random mechanisms, errors are
# those of projection at the same tolerance, but for this factor.
_CAUTION = 2.0


@jitted
def advance_partition(method, loop):
    """Advance with an explicit Runge-Kutta method in independent coordinates until something is for Python to do.

    `y` holds all coordinates and rates; those that depend on the others are solved for before every evaluation, so that
    only the independent ones are integrated. After a step that leaves the partition worn, another is chosen. Frames and
    events use the method's dense output. Arguments and result are those of all step loops, see
    docs/step-loops.md; `method` is an `ErkTableau`.
    """
    w = partition_work(method.n_rows, loop.sizes, loop.work)
    if not loop.counters[at.F_VALID]:
        status = begin(method, loop, w)
        if status != at.RUNNING:
            return status
    return take_steps(partitioned_step, method, loop, w)


@jitted
def partitioned_step(method, loop, w):
    """Take a step in a partition that serves, and record it; returns a status."""
    t0 = loop.control[at.T]
    if is_worn(w):
        status = choose_partition(loop, t0, w)
        if status != at.RUNNING:
            return status
    if method.estimate == NO_ESTIMATE:
        t1 = grid_end(loop)
        status = fixed_step(method, loop, t0, t1, w)
    else:
        status, t1 = adaptive_step(method, loop, w)
    if status != at.RUNNING:
        return status
    if needs_dense(loop, t1):
        take_dense(method, loop, t0, t1 - t0, w)
    count_energy(loop)
    copy(w.numbers[END:N_NUMBERS], w.numbers[START:END])
    copy(w.states[1], loop.y)
    copy(w.stages[method.n_stages - method.fsal], loop.f)
    return finish_step(loop, t0, t1, loop.dense, method.n_dense, w.scratch)


@jitted
def begin(method, loop, w):
    """Choose a partition and, where that is open, the first step; returns a status."""
    t = loop.control[at.T]
    status = choose_partition(loop, t, w)
    if status != at.RUNNING:
        return status
    if not evaluate(loop, t, loop.y, loop.f):
        return at.NOT_FINITE
    loop.counters[at.F_VALID] = 1
    if method.estimate != NO_ESTIMATE and loop.control[at.H] <= 0.0:
        loop.control[at.H] = first_step(method.order, loop, w.stages[0], w.states[0])
        loop.control[at.ERROR_OLD] = 1e-4
    return at.RUNNING


@jitted
def adaptive_step(method, loop, w):
    """Try steps until one is accepted; returns status and the time of the new state [s]."""
    cause = at.STEP_TOO_SMALL
    while True:
        t, t1 = loop.control[at.T], step_end(loop.control)
        h = t1 - t
        if too_small(loop.control):
            lost = cause == at.PROJECTION_FAILED or abs(w.numbers[LATEST]) < _NEARLY_LOST
            return (at.PARTITION_LOST if lost else cause), t
        cause = take_step(method, loop, t, t1, w)
        error = math.inf
        if cause == at.RUNNING:
            error = step_error(method, loop, t1, h, w)
            if error <= 1.0:
                accept_step(method, error, h, loop)
                return at.RUNNING, t1
            cause = at.STEP_TOO_SMALL if math.isfinite(error) else at.NOT_FINITE
        reject_step(method, error, h, loop)
        loop.counters[at.REJECTED] += 1


@jitted
def fixed_step(method, loop, t, t1, w):
    """Take a step of the grid; where it leaves what the partition can describe, with another; returns a status."""
    status = take_step(method, loop, t, t1, w)
    if status == at.PROJECTION_FAILED:
        status = choose_partition(loop, t, w)
        if status == at.RUNNING:
            status = take_step(method, loop, t, t1, w)
    return status


@jitted
def take_step(method, loop, t, t1, w):
    """Fill the stages of a step from `t` to `t1`, the new state and its derivative; returns a status."""
    h, last = t1 - t, method.n_stages - method.fsal
    least = LEAST if method.estimate != NO_ESTIMATE else 0.0
    copy(loop.f, w.stages[0])
    for s in range(1, last + 1):
        argument = w.states[1] if s == last else w.states[0]
        place = t1 if s == last else t + method.c[s] * h
        erk_sum(method.a[s], s, h, loop.y, w.stages, argument)
        status = solve_dependents(loop, place, argument, w)
        if status == at.RUNNING and not serves(least, loop.counters, w):
            status = at.PROJECTION_FAILED
        if status != at.RUNNING:
            return status
        if s == last:
            scale_energy(loop, t1, argument, w.scratch)
        call_kernel(loop.addresses[at.RHS], place, argument, loop.p, w.stages[s])
        loop.counters[at.RHS_CALLS] += 1
        loop.control[at.MIN_PIVOT_RATIO] = min(
            loop.control[at.MIN_PIVOT_RATIO], w.stages[s, loop.sizes[at.N_ROW] - 1]
        )
    if not measure(END, loop, t1, w.states[1], w):
        return at.PROJECTION_FAILED
    if all_finite(w.states[1], loop.sizes[at.NY]) and all_finite(w.stages[last], loop.sizes[at.NY]):
        return at.RUNNING
    return at.NOT_FINITE


@jitted
def step_error(method, loop, t1, h, w):
    """Return the error of a step in units of the tolerance, in the dependent coordinates and rates as well.

    Their error is what that of the others makes of them, so they are solved for in the solutions of lower order too.
    That alone would not see errors across the constraints, which say that a step is too long.
    """
    y_new = w.states[1]
    for e in range(method.estimate):
        sum_errors(method, e, loop.sizes, h, w.stages, w.states[2 + e])
    error = estimates_norm(method, loop, w)
    if not error <= 1.0:
        return error
    for e in range(method.estimate):
        difference = w.states[2 + e]
        # The difference of two solutions that are very near each other would be the rounding of both.
        apart = part_of_motion(loop.sizes, y_new, difference)
        scale = max(1.0, _APART / apart) if apart > 0.0 else 1.0
        for i in range(loop.sizes[at.NY]):
            difference[i] = y_new[i] - scale * difference[i]
        if solve_dependents(loop, t1, difference, w) != at.RUNNING:
            return math.inf
        for i in range(loop.sizes[at.NY]):
            difference[i] = (y_new[i] - difference[i]) / scale
    return _CAUTION * max(error, estimates_norm(method, loop, w))


@jitted
def sum_errors(method, e, sizes, h, k, out):
    """Write estimate `e` of the error of (q, v) to `out`; work is left out, it follows the motion."""
    for i in range(sizes[at.NY]):
        out[i] = 0.0
    for j in range(method.n_stages):
        weight = h * method.error[e, j]
        if weight != 0.0:
            for i in range(sizes[at.NQ] + sizes[at.NV]):
                out[i] += weight * k[j, i]


@jitted
def estimates_norm(method, loop, w):
    """Return the size of the estimates in `w.states` in units of the tolerance."""
    n = loop.sizes[at.NQ] + loop.sizes[at.NV]
    if method.estimate == TWO_ESTIMATES:
        return norm_of_two(loop.control, n, loop.y, w.states[1], w.states[2], w.states[3])
    return error_norm(loop.control, n, loop.y, w.states[1], w.states[2])


@jitted
def part_of_motion(sizes, y, change):
    """Return the largest change of a coordinate in parts of the largest coordinate, or of a rate likewise."""
    largest = 0.0
    for first, end in ((0, sizes[at.NQ]), (sizes[at.NQ], sizes[at.NQ] + sizes[at.NV])):
        moved, size = 0.0, 0.0
        for i in range(first, end):
            moved, size = max(moved, abs(change[i])), max(size, abs(y[i]))
        if size > 0.0:
            largest = max(largest, moved / size)
    return largest


@jitted
def take_dense(method, loop, t, h, w):
    """Fill the dense output of the step, whose further stages lie on the constraints as all others do."""
    for s in range(method.n_stages + 1 - method.fsal, method.n_rows):
        erk_sum(method.a[s], s, h, loop.y, w.stages, w.states[0])
        solve_dependents(loop, t + method.c[s] * h, w.states[0], w)
        call_kernel(loop.addresses[at.RHS], t + method.c[s] * h, w.states[0], loop.p, w.stages[s])
        loop.counters[at.RHS_CALLS] += 1
    combine_dense(method, loop, h, w)

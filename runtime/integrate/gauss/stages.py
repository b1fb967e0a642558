"""The stages of Gauss collocation for q'' = a(t, q, v): start, fixed-point or Newton iteration, when that stops."""

import math

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.evaluation import evaluate
from symgen.runtime.integrate.gauss.newton import correct_by_newton, factor_stages
from symgen.runtime.integrate.gauss.rotation_increments import (
    MAX_SWEEPS,
    reset_rotations,
    solve_stage_rotations,
)
from symgen.runtime.integrate.gauss.sums import add_up
from symgen.runtime.integrate.gauss.work import (
    HAVE_FACTORS,
    HAVE_HISTORY,
    HAVE_JACOBIAN,
    SMALLEST,
    STALLS,
    STIFF,
)
from symgen.runtime.integrate.jacobian import acceleration_jacobian
from symgen.runtime.integrate.newton import CONVERGED, DIVERGED, ITERATING
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.step_control import error_scale

MAX_ITERATIONS = 50
# Corrections of this size that no longer shrink are round-off for certain; in units of the rates.
ROUND_OFF = 64.0 * float(np.finfo(float).eps)
# Larger ones count as progress below this ratio to the smallest so far. So many without progress (Newton's contract
# fast if at all) end the iteration: it has converged where they are that small in tolerances.
PROGRESS = 0.9
MAX_STALLS, MAX_STALLS_OF_NEWTON = 5, 2
NOISE_TOL = 0.1
DIVERGENCE = 16.0
# Newton that takes more iterations than this wants a new Jacobian for the next step.
KEEP_JACOBIAN_ITERATIONS = 8


@jitted
def interpolation(method, start, stretch, weights):
    """Write the values of the Lagrange polynomials of the nodes at start + stretch c_i, polynomial j in row j."""
    n = method.c.shape[0]
    for i in range(n):
        place = start + stretch * method.c[i]
        for j in range(n):
            value = method.barycentric[j]
            for k in range(n):
                if k != j:
                    value *= place - method.c[k]
            weights[j, i] = value


@jitted
def predict(which, method, h, loop, t, y, w):
    """Guess the impulses: the last step's collocation polynomial goes on, or the acceleration at the start does.

    `which` says which of `w.weights` to use. Returns whether accelerations are finite.
    """
    n, nq, nv = method.c.shape[0], loop.sizes[at.NQ], loop.sizes[at.NV]
    if not loop.counters[HAVE_HISTORY]:
        if not evaluate(loop, t, y, w.rows[0]):
            return False
        for i in range(nv):
            for s in range(n):
                w.impulses[i, s] = h * method.b[s] * w.rows[0, nq + i]
        return True
    for i in range(nv):
        for s in range(n):
            w.impulses[i, s] = 0.0
        for j in range(n):
            acceleration = w.history[i, j]
            for s in range(n):
                w.impulses[i, s] += w.weights[which, j, s] * acceleration
        for s in range(n):
            w.impulses[i, s] *= h * method.b[s]
    return True


@jitted
def solve_stages(which, method, h, loop, t0, y, w):
    """Solve for the impulses of a step of length `h`; returns RUNNING, or why that failed."""
    if not predict(which, method, h, loop, t0, y, w):
        return at.NOT_FINITE
    if not loop.counters[STIFF]:
        if iterate(method, h, loop, t0, y, w) == at.RUNNING:
            return at.RUNNING
        loop.counters[STIFF] = 1
        loop.counters[HAVE_HISTORY] = 0
        if not predict(which, method, h, loop, t0, y, w):
            return at.NOT_FINITE
    if loop.counters[HAVE_JACOBIAN]:
        status = factor_stages(method, h, loop, y, w)
        if status == at.RUNNING:
            status = iterate(method, h, loop, t0, y, w)
        if status == at.RUNNING:
            return at.RUNNING
        # What the last step says may be what misled Newton.
        loop.counters[HAVE_HISTORY] = 0
        if not predict(which, method, h, loop, t0, y, w):
            return at.NOT_FINITE
    if not evaluate(loop, t0, y, w.rows[0]):
        return at.NOT_FINITE
    status = acceleration_jacobian(loop, t0, y, w.rows[0], w.implicit, w.jacobian)
    if status != at.RUNNING:
        return status
    loop.counters[HAVE_JACOBIAN], loop.counters[HAVE_FACTORS] = 1, 0
    status = factor_stages(method, h, loop, y, w)
    if status != at.RUNNING:
        return status
    return iterate(method, h, loop, t0, y, w)


@jitted
def iterate(method, h, loop, t0, y, w):
    """Improve the impulses until rounding keeps them from changing less; returns RUNNING, or why not.

    To stop at a tolerance would leave errors of one sign, and energy would drift (Hairer, McLachlan, Razakarivony, BIT
    48 (2008) 231).
    """
    n = method.c.shape[0]
    reset_rotations(method, loop.sizes, y, w)
    w.numbers[SMALLEST], w.numbers[STALLS] = math.inf, 0.0
    max_stalls = MAX_STALLS_OF_NEWTON if loop.counters[STIFF] else MAX_STALLS
    verdict = ITERATING
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        # Iterations of fixed points sweep over quaternions as they go; Newton's take rates for all that is unknown.
        n_sweeps = MAX_SWEEPS if loop.counters[STIFF] or iteration == 1 else 1
        place_stages(method, h, n_sweeps, loop.sizes, y, w)
        for s in range(n):
            if not evaluate(loop, t0 + method.c[s] * h, w.states[s], w.rows[s]):
                return at.NOT_FINITE
        if loop.counters[STIFF]:
            correct_by_newton(method, h, loop.sizes, w)
        else:
            correct_by_substitution(method, h, loop.sizes, w)
        loop.counters[at.NEWTON_ITERATIONS] += 1
        verdict = judge_change(iteration, max_stalls, loop, y, w)
    if iteration > KEEP_JACOBIAN_ITERATIONS:
        loop.counters[HAVE_JACOBIAN] = 0
    return at.RUNNING if verdict == CONVERGED else at.NEWTON_FAILED


@jitted
def place_stages(method, h, n_sweeps, sizes, y, w):
    """Write the stages' arguments, v = v0 + Σ mu L, then q = q0 + Σ mu h b q', and `w.travels` = h b q'.

    Returns whether the sweeps over quaternions have settled.
    """
    n, nq, nv = method.c.shape[0], sizes[at.NQ], sizes[at.NV]
    rest = w.states[n + 1]
    add_up(method.mu, w.impulses, w.sums)
    if nq == nv:  # loops from 0 need no checks of their indexes
        for i in range(nv):
            for s in range(n):
                v = y[nv + i] + (rest[nv + i] + w.sums[i, s])
                w.states[s, nv + i] = v
                w.travels[i, s] = h * method.b[s] * v
        add_up(method.mu, w.travels, w.sums)
        for i in range(nv):
            for s in range(n):
                w.states[s, i] = y[i] + (rest[i] + w.sums[i, s])
        return True
    for i in range(nv):
        for s in range(n):
            w.states[s, nq + i] = y[nq + i] + (rest[nq + i] + w.sums[i, s])
    settled, start = True, 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            for s in range(n):
                w.travels[i, s] = h * method.b[s] * w.states[s, nq + i - k]
        add_up(method.mu, w.travels[start:end], w.sums[start:end])
        for i in range(start, end):
            for s in range(n):
                w.states[s, i] = y[i] + (rest[i] + w.sums[i, s])
        if end < nq:
            settled = solve_stage_rotations(method, h, n_sweeps, end, nq + end - k, y, w) and settled
        start = end + 4
    return settled


@jitted
def correct_by_substitution(method, h, sizes, w):
    """Replace the impulses by those of the accelerations at the stages; their largest changes go to `w.change`."""
    nq = sizes[at.NQ]
    for i in range(sizes[at.NV]):
        largest = 0.0
        for s in range(method.c.shape[0]):
            impulse = h * method.b[s] * w.rows[s, nq + i]
            largest = max(largest, abs(impulse - w.impulses[i, s]))
            w.impulses[i, s] = impulse
        w.change[i] = largest


@jitted
def judge_change(iteration, max_stalls, loop, y, w):
    """Judge the changes `w.change` of the impulses: ITERATING, CONVERGED or DIVERGED.

    Converged is what no longer shrinks, once it is as small as round-off of the rates. Forces that nearly cancel leave
    more round-off than that: changes that make no progress for several iterations, but are well below the tolerance,
    are taken for it.
    """
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    largest = 0.0
    for i in range(nv):
        largest = max(largest, abs(y[nq + i]) + abs(w.impulses[i, 0]))
    size = 0.0
    for i in range(nv):
        change = w.change[i]
        if not math.isfinite(change):
            return DIVERGED
        if change > 0.0:
            rate = abs(y[nq + i]) + abs(w.impulses[i, 0])
            size = max(size, change / max(rate, 1e-3 * largest, change))
    if size == 0.0 or w.numbers[SMALLEST] <= size <= ROUND_OFF:
        return CONVERGED
    w.numbers[STALLS] = 0.0 if size < PROGRESS * w.numbers[SMALLEST] else w.numbers[STALLS] + 1.0
    if w.numbers[STALLS] > 0.0:
        is_noise = size_in_tolerances(loop, y, w) <= NOISE_TOL
        if size > DIVERGENCE * w.numbers[SMALLEST] and not is_noise:
            return DIVERGED
        if w.numbers[STALLS] >= max_stalls:
            return CONVERGED if is_noise else DIVERGED
    w.numbers[SMALLEST] = min(w.numbers[SMALLEST], size)
    return ITERATING if iteration < MAX_ITERATIONS else DIVERGED


@jitted
def size_in_tolerances(loop, y, w):
    """Return the largest change of an impulse in units of its rate's tolerance."""
    size = 0.0
    for i in range(loop.sizes[at.NV]):
        rate = abs(y[loop.sizes[at.NQ] + i]) + abs(w.impulses[i, 0])
        size = max(size, w.change[i] / error_scale(loop.control, rate, rate))
    return size

"""Solve for the mean rate of a RATTLE step, the first line of `step`, and the constraints at its end."""

import math

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.newton import CONVERGED, DIVERGED, ITERATING
from symgen.runtime.integrate.quaternions import by_rotation, n_quaternions, quaternion_at
from symgen.runtime.integrate.rattle.push import push
from symgen.runtime.integrate.rattle.rotation_increments import add_rotated, rotation_newton, travel
from symgen.runtime.integrate.rattle.work import (
    END,
    MEAN,
    MOMENTUM,
    PUSH,
    REST,
    SMALLEST,
    STALLS,
    START,
    TRAVEL,
    TRIAL,
    TURN,
)
from symgen.runtime.integrate.saddle import border, factor, solve
from symgen.runtime.integrate.step_control import error_scale

MAX_ITERATIONS = 50
# Corrections of this size that no longer shrink are round-off for certain, in units of the rates or of positions over
# h. Larger ones count as progress below PROGRESS times the smallest so far; so many without progress end the iteration.
EPS = float(np.finfo(float).eps)
ROUND_OFF, ROUND_OFF_OF_POSITIONS = 64.0 * EPS, 4.0 * EPS
PROGRESS = 0.5
MAX_STALLS = 3
NOISE_TOL = 0.1
DIVERGENCE = 1e3
# So is what the next correction would be below, if the iteration goes on contracting as it did.
NEGLIGIBLE = EPS / 64.0


@jitted
def solve_mean(method, h, loop, t0, y, w):
    """Solve for the mean rate and the impulses at the start, until rounding keeps them from changing less.

    To stop at a tolerance would leave errors of one sign, and energy would drift.
    """
    nv, m = loop.sizes[at.NV], loop.sizes[at.NM]
    for i in range(nv):
        total = 0.0
        for j in range(nv):
            total += w.masses[START, i * nv + j] * y[loop.sizes[at.NQ] + j]
        w.vectors[MOMENTUM, i] = total
    w.numbers[SMALLEST], w.numbers[STALLS] = math.inf, 0.0
    trusted = False
    verdict = ITERATING
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        place_residual(method, h, loop, t0, y, w)
        if iteration == 1:
            trusted = factor_newton(method, h, loop, t0 + h, w)
        status = solve(trusted, nv, w)
        if status != at.RUNNING:
            return status
        loop.counters[at.NEWTON_ITERATIONS] += 1
        verdict = judge_correction(iteration, h, loop, y, w)
        for i in range(nv):
            w.vectors[MEAN, i] -= w.right[i, 0]
        for k in range(m):
            w.impulses[START, k] -= w.right[nv + k, 0]
    return at.RUNNING if verdict == CONVERGED else at.NEWTON_FAILED


@jitted
def place_residual(method, h, loop, t0, y, w):
    """Write the residual of the first line, then g(q1)/h, to `w.right`; leaves q1 in TRIAL."""
    nq, nv, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NM]
    q1 = w.states[TRIAL]
    push(method, START, h, loop, t0, y, w)
    travel(h, loop.sizes, y, w)
    for i in range(nq):
        q1[i] = y[i] + (w.states[REST, i] + w.states[TRAVEL, i])
    if not method.constant_mass:
        call_kernel(loop.addresses[at.MASS_MATRIX], t0 + h, q1, loop.p, w.masses[END])
    for i in range(nv):
        total = -w.vectors[MOMENTUM, i] - w.vectors[PUSH, i]
        for j in range(nv):
            mean_mass = 0.5 * (w.masses[START, i * nv + j] + w.masses[END, i * nv + j])
            total += mean_mass * w.vectors[MEAN, j]
        for k in range(m):
            total -= w.gradients[START, k * nv + i] * w.impulses[START, k]
        w.right[i, 0] = total
    add_rotated(h, loop.sizes, w)
    if m > 0:
        call_kernel(loop.addresses[at.CONSTRAINT_RESIDUAL], t0 + h, q1, loop.p, w.residual)
        add_rounded(loop.sizes, y, q1, w)
    for k in range(m):
        w.right[nv + k, 0] = w.residual[k] / h


@jitted
def add_rounded(sizes, y, q1, w):
    """Add to g(q1) what the part of q1 that rounding has dropped makes of it.

    An angle that has turned many times is coarse; divided by h, that would jolt the rates.
    """
    nv, m, start = sizes[at.NV], sizes[at.NM], 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            add_dropped(dropped(i, y, q1, w), i - k, nv, m, w)
        if end < sizes[at.NQ]:
            a, b, c = by_rotation(
                q1, end, dropped(end, y, q1, w), dropped(end + 1, y, q1, w), dropped(end + 2, y, q1, w),
                dropped(end + 3, y, q1, w),
            )  # fmt: skip
            # A turn is 4 Nᵀ of what it changes of the quaternion.
            add_dropped(4.0 * a, end - k, nv, m, w)
            add_dropped(4.0 * b, end - k + 1, nv, m, w)
            add_dropped(4.0 * c, end - k + 2, nv, m, w)
        start = end + 4


@jitted
def dropped(i, y, q1, w):
    """Return the part of entry `i` of q1 that rounding has dropped."""
    return (y[i] - q1[i]) + (w.states[REST, i] + w.states[TRAVEL, i])


@jitted
def add_dropped(move, j, nv, m, w):
    """Add to g(q1) what the `move` of what rate `j` moves makes of it."""
    for k in range(m):
        w.residual[k] += w.gradients[END, k * nv + j] * move


@jitted
def factor_newton(method, h, loop, t1, w):
    """Factor the derivative of the residual, but for terms of h² and forces that depend on rates."""
    nv = loop.sizes[at.NV]
    for i in range(nv):
        for j in range(nv):
            w.matrix[i, j] = 0.5 * (w.masses[START, i * nv + j] + w.masses[END, i * nv + j])
            if not method.constant_mass:
                w.matrix[i, j] -= 0.5 * h * (w.slopes[TURN, i, j] - w.slopes[TURN, j, i])
    if loop.sizes[at.NM] > 0:
        call_kernel(loop.addresses[at.CONSTRAINT_JACOBIAN], t1, w.states[TRIAL], loop.p, w.gradients[END])
    border(w.gradients[START], w.gradients[END], nv, w)
    rotation_newton(h, loop.sizes, w)
    return factor(loop.counters, w)


@jitted
def judge_correction(iteration, h, loop, y, w):
    """Judge the correction `w.right` of the mean rate: ITERATING, CONVERGED or DIVERGED.

    Converged is what no longer shrinks, once it is as small as round-off of rates and positions. Forces that nearly
    cancel leave more than that: corrections that make no progress, but are well below the tolerance, are taken for it.
    """
    fastest, farthest, nv = 0.0, 0.0, loop.sizes[at.NV]
    for i in range(nv):
        fastest = max(fastest, abs(w.vectors[MEAN, i]))
    for i in range(loop.sizes[at.NQ]):
        farthest = max(farthest, abs(y[i]))
    size, largest, in_tolerances = 0.0, 0.0, 0.0
    for i in range(nv):
        change, rate = abs(w.right[i, 0]), abs(w.vectors[MEAN, i])
        if not math.isfinite(change):
            return DIVERGED
        if change > 0.0:
            largest = max(largest, change)
            size = max(size, change / max(rate, 1e-3 * fastest, change))
            in_tolerances = max(in_tolerances, change / error_scale(loop.control, rate, rate))
    smallest = w.numbers[SMALLEST]
    is_noise = size <= ROUND_OFF or largest <= ROUND_OFF_OF_POSITIONS * farthest / abs(h)
    if size == 0.0 or (smallest <= size and is_noise):
        return CONVERGED
    if iteration > 1 and size * size <= NEGLIGIBLE * smallest:
        return CONVERGED
    is_noise = is_noise or in_tolerances <= NOISE_TOL
    w.numbers[STALLS] = 0.0 if size < PROGRESS * smallest else w.numbers[STALLS] + 1.0
    if size > DIVERGENCE * smallest and not is_noise:
        return DIVERGED
    if w.numbers[STALLS] >= MAX_STALLS and is_noise:
        return CONVERGED
    w.numbers[SMALLEST] = min(smallest, size)
    return ITERATING if iteration < MAX_ITERATIONS else DIVERGED

"""One RATTLE step, for mass matrices that may change with the positions.

With L = T - V and the discrete Lagrangian h/2 (L(q0, u) + L(q1, u)), u = (q1 - q0)/h, the position-momentum form of
Marsden, West, Acta Numerica 10 (2001) 357, with constraints, reads, for M0 = M(q0), M1 = M(q1) and p = M v,

    p0 = (M0 + M1)/2 u - h/2 (L_q + Q)(q0, u) - G0ᵀ μ0,    g(q1) = 0,
    p1 = (M0 + M1)/2 u + h/2 (L_q + Q)(q1, u) + G1ᵀ μ1,    G1 v1 = 0.

It is symmetric and symplectic, of order 2, keeps both levels of constraints, and is RATTLE (Andersen, J. Comput. Phys.
52 (1983) 24) where M is constant. M is never inverted by itself, so coordinates without mass are welcome where
constraints determine them. Quaternions are turned by h u: see `rotation_increments`.
"""

import math

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.jacobian import by_positions
from symgen.runtime.integrate.linear import border, factor, solve
from symgen.runtime.integrate.loop import add_compensated, copy
from symgen.runtime.integrate.newton import CONVERGED, DIVERGED, ITERATING
from symgen.runtime.integrate.quaternions import (
    by_rotation,
    chart_rate,
    chart_variation,
    keep_lengths,
    n_quaternions,
    quaternion_at,
)
from symgen.runtime.integrate.rattle.work import (
    END,
    H_GUESS,
    HALF_CHANGE,
    HAVE_GUESS,
    MEAN,
    MOMENTUM,
    PROBE,
    PUSH,
    REST,
    SMALLEST,
    STALLS,
    START,
    TRAVEL,
    TRIAL,
    TURN,
)
from symgen.runtime.integrate.step_control import error_scale

# For the rates of a quaternion, whose momentum turns with the body, f + M' u + ω×(M u).


@jitted
def push(method, which, h, loop, t, y, w):
    """Write h/2 (L_q + Q) at the positions of `y` and the mean rate to PUSH; -∂(M u)/∂q to the block TURN of slopes."""
    nq, nv, state = loop.sizes[at.NQ], loop.sizes[at.NV], w.states[TRIAL]
    for i in range(nq):
        state[i] = y[i]
    for i in range(nv):
        state[nq + i] = w.vectors[MEAN, i]
    call_kernel(loop.addresses[at.FORCES], t, state, loop.p, w.vectors[PUSH])
    add_rotation(which, loop.sizes, w)
    for i in range(nv):
        w.vectors[PUSH, i] *= 0.5 * h
    if method.constant_mass:
        return
    slope(loop, t, y, True, w, w.slopes[TURN])
    for i in range(nv):
        for j in range(nv):
            w.slopes[TURN, i, j] -= w.slopes[which, i, j]
            w.vectors[PUSH, i] -= 0.5 * h * w.slopes[TURN, i, j] * w.vectors[MEAN, j]


@jitted
def slope(loop, t, y, moving, w, out):
    """Write -∂residual/∂q at (q, PROBE) with λ = 0 and a = MEAN, or 0 where `moving` is not set, to `out`."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    n_columns = w.arguments.shape[0]
    for i in range(n_columns):
        w.arguments[i] = 0.0
    for i in range(nq):
        w.arguments[i] = y[i]
    for i in range(nv):
        w.arguments[nq + i] = w.vectors[PROBE, i]
        if moving:
            w.arguments[nq + nv + i] = w.vectors[MEAN, i]
    call_kernel(loop.addresses[at.RESIDUAL_JACOBIAN], t, w.arguments, loop.p, w.derivative)
    loop.counters[at.JACOBIANS] += 1
    for i in range(nv):
        by_positions(loop.sizes, y, w.derivative[i * n_columns : (i + 1) * n_columns], out[i])


@jitted
def add_rotation(which, sizes, w):
    """Add ω×(M u) for the rates of every quaternion to PUSH."""
    nv, u, force = sizes[at.NV], w.vectors[MEAN], w.vectors[PUSH]
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        mass = w.masses[which]
        x, y, z = momentum(j, nv, mass, u), momentum(j + 1, nv, mass, u), momentum(j + 2, nv, mass, u)
        force[j] += u[j + 1] * z - u[j + 2] * y
        force[j + 1] += u[j + 2] * x - u[j] * z
        force[j + 2] += u[j] * y - u[j + 1] * x


@jitted
def momentum(i, nv, mass, rates):
    """Return entry `i` of M times `rates`."""
    total = 0.0
    for j in range(nv):
        total += mass[i * nv + j] * rates[j]
    return total


# Variational integrators on Lie groups (Bou-Rabee, Marsden, Found. Comput. Math. 9 (2009) 197): with the matrix R(θ) of
# `chart_rate`, which makes θ' of an angular velocity, the momentum (M0 + M1)/2 u of the module `step` becomes R(θ)
# times it at the start and R(-θ) times it at the end. These are one vector in space, so angular momentum is kept
# exactly.


@jitted
def travel(h, sizes, y, w):
    """Write what the mean rate changes of the positions of `y` to TRAVEL."""
    u, out = w.vectors[MEAN], w.states[TRAVEL]
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            out[i] = h * u[i - k]
        if end < sizes[at.NQ]:
            j = end - k
            change = rotation_change(y, end, h * u[j], h * u[j + 1], h * u[j + 2])
            out[end], out[end + 1], out[end + 2], out[end + 3] = change
        start = end + 4


@jitted
def rotation_change(q, i, a, b, c):
    """Return what the rotation vector (a, b, c) [rad] changes of the quaternion `q[i:i+4]`, to its own round-off."""
    half = 0.5 * math.sqrt(a * a + b * b + c * c)
    quarter = math.sin(0.5 * half)
    fall = -2.0 * quarter * quarter
    sinc = 0.5 * (math.sin(half) / half if half > 0.0 else 1.0)
    a, b, c = sinc * a, sinc * b, sinc * c
    w, x, y, z = q[i], q[i + 1], q[i + 2], q[i + 3]
    return (
        w * fall - x * a - y * b - z * c,
        x * fall + w * a + y * c - z * b,
        y * fall + w * b + z * a - x * c,
        z * fall + w * c + x * b - y * a,
    )


@jitted
def mean_momentum(j, nv, w):
    """Return the three entries from `j` on of (M0 + M1)/2 u."""
    u, m0, m1 = w.vectors[MEAN], w.masses[START], w.masses[END]
    return (
        0.5 * (momentum(j, nv, m0, u) + momentum(j, nv, m1, u)),
        0.5 * (momentum(j + 1, nv, m0, u) + momentum(j + 1, nv, m1, u)),
        0.5 * (momentum(j + 2, nv, m0, u) + momentum(j + 2, nv, m1, u)),
    )


@jitted
def add_rotated(h, sizes, w):
    """Add what R(h u) makes of the mean momenta of all that turns to `w.right`."""
    u = w.vectors[MEAN]
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        before = mean_momentum(j, sizes[at.NV], w)
        after = chart_rate(h * u[j], h * u[j + 1], h * u[j + 2], before[0], before[1], before[2])
        for axis in range(3):
            w.right[j + axis, 0] += after[axis] - before[axis]


@jitted
def rotation_newton(h, sizes, w):
    """Make `w.matrix`, with its borders, that of a step that turns: R(θ) p is p + θ×p/2 but for terms of h²."""
    nv, u = sizes[at.NV], w.vectors[MEAN]
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        x, y, z = 0.5 * h * u[j], 0.5 * h * u[j + 1], 0.5 * h * u[j + 2]
        for i in range(nv):
            m = (mean_mass(j, i, nv, w), mean_mass(j + 1, i, nv, w), mean_mass(j + 2, i, nv, w))
            w.matrix[j, i] += y * m[2] - z * m[1]
            w.matrix[j + 1, i] += z * m[0] - x * m[2]
            w.matrix[j + 2, i] += x * m[1] - y * m[0]
        p = mean_momentum(j, nv, w)
        for axis in range(3):
            after, last = (axis + 1) % 3, (axis + 2) % 3
            w.matrix[j + axis, j + after] += 0.5 * h * p[last]
            w.matrix[j + axis, j + last] -= 0.5 * h * p[after]
        for r in range(nv, nv + sizes[at.NM]):
            # A row times the matrix of `chart_variation`: its transpose, which is that of the opposite turn.
            row = w.matrix[r]
            turned = chart_variation(-h * u[j], -h * u[j + 1], -h * u[j + 2], row[j], row[j + 1], row[j + 2])
            row[j], row[j + 1], row[j + 2] = turned


@jitted
def mean_mass(i, j, nv, w):
    """Return an entry of (M0 + M1)/2."""
    return 0.5 * (w.masses[START, i * nv + j] + w.masses[END, i * nv + j])


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


@jitted
def rattle_step(method, h, loop, t0, y, w):
    """Advance (q, v) in `y` by `h` [s], in place; the arrays of the END become those of the START. Returns a status."""
    nq, nv, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NM]
    guess(h, loop.counters, nq, nv, y, w)
    status = solve_mean(method, h, loop, t0, y, w)
    if status != at.RUNNING:
        return status
    travel(h, loop.sizes, y, w)
    for i in range(nq):
        add_compensated(w.states[TRAVEL, i], i, y, w.states[REST])
    keep_lengths(loop.sizes, y, w.states[REST])
    status = end_rates(method, h, loop, t0 + h, y, w)
    if status != at.RUNNING:
        return status
    for i in range(nv):
        w.vectors[HALF_CHANGE, i] = y[nq + i] - w.vectors[MEAN, i]
    for k in range(m):
        w.impulses[START, k] = w.impulses[END, k]
    copy(w.masses[END], w.masses[START])
    copy(w.gradients[END], w.gradients[START])
    for i in range(nv):
        copy(w.slopes[END, i], w.slopes[START, i])
    w.numbers[H_GUESS] = h
    loop.counters[HAVE_GUESS] = 1
    return at.RUNNING


@jitted
def take_start(method, loop, t, y, w):
    """Evaluate what a step needs of the positions that it starts from."""
    call_kernel(loop.addresses[at.MASS_MATRIX], t, y, loop.p, w.masses[START])
    copy(w.masses[START], w.masses[END])
    if loop.sizes[at.NM] > 0:
        call_kernel(loop.addresses[at.CONSTRAINT_JACOBIAN], t, y, loop.p, w.gradients[START])
        copy(w.gradients[START], w.gradients[END])
    if not method.constant_mass:
        slope(loop, t, y, False, w, w.slopes[START])


@jitted
def guess(h, counters, nq, nv, y, w):
    """Guess the mean rate and the constraints' impulses: accelerations and multipliers go on, or none."""
    stretch = h / w.numbers[H_GUESS] if counters[HAVE_GUESS] else 0.0
    for i in range(nv):
        w.vectors[MEAN, i] = y[nq + i] + stretch * w.vectors[HALF_CHANGE, i]
    for k in range(w.impulses.shape[1]):
        w.impulses[START, k] *= stretch


@jitted
def end_rates(method, h, loop, t1, y, w):
    """Replace the rates in `y`, whose positions are those at `t1`, by the end's; returns a status."""
    nq, nv, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NM]
    if not method.constant_mass:
        call_kernel(loop.addresses[at.MASS_MATRIX], t1, y, loop.p, w.masses[END])
        for i in range(nv):
            w.vectors[PROBE, i] = w.vectors[MEAN, i]
        slope(loop, t1, y, False, w, w.slopes[END])
    push(method, END, h, loop, t1, y, w)
    if m > 0:
        call_kernel(loop.addresses[at.CONSTRAINT_JACOBIAN], t1, y, loop.p, w.gradients[END])
        call_kernel(loop.addresses[at.CONSTRAINT_RESIDUAL], t1, w.states[TRIAL], loop.p, w.residual)
    # The unknown is v1 - u: what the constraints' residual at u says includes their rate in time.
    for i in range(nv):
        total = w.vectors[PUSH, i]
        for j in range(nv):
            w.matrix[i, j] = w.masses[END, i * nv + j]
            difference = w.masses[START, i * nv + j] - w.masses[END, i * nv + j]
            total += 0.5 * difference * w.vectors[MEAN, j]
        w.right[i, 0] = total
    add_rotated(-h, loop.sizes, w)
    for k in range(m):
        w.right[nv + k, 0] = -w.residual[loop.sizes[at.NH] + k]
    border(w.gradients[END], w.gradients[END], nv, w)
    status = solve(factor(loop.counters, w), nv, w)
    finite = 0.0
    for i in range(nv):
        y[nq + i] = w.vectors[MEAN, i] + w.right[i, 0]
        finite += 0.0 * y[nq + i]
    for k in range(m):
        w.impulses[END, k] = w.right[nv + k, 0]
    if status != at.RUNNING:
        return status
    return at.RUNNING if finite == 0.0 else at.NOT_FINITE

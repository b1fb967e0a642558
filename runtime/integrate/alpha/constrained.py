"""One step of the generalised-α method whose positions satisfy the constraints: index 3, or stabilised index 2.

Index 3 (Arnold, Brüls, Multibody Syst. Dyn. 18 (2007) 185): M a = f + Gᵀλ and g = 0 hold at the ends of steps, with
Newmark's formulas between; velocities follow. Stabilised index 2 (Arnold, Brüls, Cardona, Numer. Math. 129 (2015)
149): G v = 0 as well, and positions move by h G(q0)ᵀη besides. Residuals of positions are divided by what an
acceleration moves them, so that Newton's matrix does not depend on h (Bottasso, Bauchau, Cardona, SIAM J. Sci.
Comput. 29 (2007) 397). What a step travels turns quaternions as a rotation vector (Brüls, Cardona, Arnold, Mech. Mach.
Theory 48 (2012) 121), η included (Arnold, Cardona, Brüls in: Structure-preserving Integrators in Nonlinear Structural
Dynamics and Flexible Multibody Dynamics (2016) 91).
"""

import math

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.alpha.by_travel import by_travel, dot, gradient_by_travel
from symgen.runtime.integrate.alpha.constrained_work import (
    ACCELERATION,
    AVERAGE,
    END,
    FACTORED_FOR,
    HAVE_FACTORS,
    NEW_ACCELERATION,
    NEW_AVERAGE,
    NEW_RATE,
    RATE,
    SLOPE,
    START,
    TRAVEL,
    TRUSTED,
)
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.newton import (
    DIVERGED,
    ITERATING,
    forget_rate,
    judge_correction,
    start_newton,
)
from symgen.runtime.integrate.newton import RATE as CONTRACTION
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, retract
from symgen.runtime.integrate.saddle import factor, solve
from symgen.runtime.integrate.step_control import error_scale

# Of the tolerance; multipliers carry what Newton leaves, divided by h².
DEFAULT_NEWTON_TOL = 1e-5
KEEP_JACOBIAN_RATE = 0.2
ROUND_OFF = 4.0 * float(np.finfo(float).eps)


@jitted
def solve_end(method, h, loop, t0, t1, w):
    """Solve for accelerations and multipliers at `t1` from the guess; where that fails, once more from the start's."""
    if method.stabilised:
        call_kernel(loop.addresses[at.CONSTRAINT_JACOBIAN], t0, loop.y, loop.p, w.gradient)
    place_end(method, h, loop.sizes, loop.y, w)
    # Lengths of steps on the grid differ by round-off of time, which is nothing to Newton.
    if loop.counters[HAVE_FACTORS] and abs(h - w.numbers[FACTORED_FOR]) <= 1e-6 * h:
        if iterate(method, h, loop, t1, w) == at.RUNNING:
            return at.RUNNING
        guess_start(loop.sizes, w)
        place_end(method, h, loop.sizes, loop.y, w)
    factor_end(method, h, loop, t1, w)
    return iterate(method, h, loop, t1, w)


@jitted
def guess_start(sizes, w):
    """Guess that accelerations and multipliers stay."""
    copy(w.vectors[ACCELERATION], w.vectors[NEW_ACCELERATION])
    copy(w.multipliers[START], w.multipliers[END])
    for k in range(sizes[at.NH]):
        w.stabiliser[k] = 0.0


@jitted
def carry_on(sizes, w):
    """Make the end of the step the start of the next; accelerations and multipliers are guessed to go on."""
    copy(w.vectors[NEW_AVERAGE], w.vectors[AVERAGE])
    copy(w.vectors[NEW_RATE], w.vectors[RATE])
    for i in range(sizes[at.NV]):
        old, new = w.vectors[ACCELERATION, i], w.vectors[NEW_ACCELERATION, i]
        w.vectors[ACCELERATION, i] = new
        w.vectors[NEW_ACCELERATION, i] = 2.0 * new - old
    for k in range(sizes[at.NM]):
        before, now = w.multipliers[START, k], w.multipliers[END, k]
        w.multipliers[START, k] = now
        w.multipliers[END, k] = 2.0 * now - before


@jitted
def iterate(method, h, loop, t1, w):
    """Improve the guess by simplified Newton; returns a status."""
    nv, m = loop.sizes[at.NV], loop.sizes[at.NM]
    tolerance = loop.control[at.NEWTON_TOL] if loop.control[at.NEWTON_TOL] > 0.0 else DEFAULT_NEWTON_TOL
    start_newton(w.numbers)
    verdict = ITERATING
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        place_residual(method, h, loop, t1, w)
        status = solve(loop.counters[TRUSTED], nv, w)
        if status != at.RUNNING:
            return status
        for i in range(nv):
            w.vectors[NEW_ACCELERATION, i] -= w.right[i, 0]
        for k in range(m):
            w.multipliers[END, k] -= w.right[nv + k, 0]
        for k in range(w.right.shape[0] - nv - m):
            w.stabiliser[k] -= w.right[nv + m + k, 0]
        place_end(method, h, loop.sizes, loop.y, w)
        loop.counters[at.NEWTON_ITERATIONS] += 1
        size = size_of_correction(method, h, loop, w)
        verdict = judge_correction(iteration, size, tolerance, w.numbers)
    if verdict == DIVERGED:
        return at.NEWTON_FAILED
    if w.numbers[CONTRACTION] > KEEP_JACOBIAN_RATE:
        loop.counters[HAVE_FACTORS] = 0
    return at.RUNNING


@jitted
def leverage(method, h):
    """Return by how much q and v at the end of the step change with a there."""
    share = (1.0 - method.alpha_f) / (1.0 - method.alpha_m)
    return h * h * method.beta * share, h * method.gamma * share


@jitted
def place_end(method, h, sizes, y, w):
    """Write A, v, and (q, v, a, λ) at the end of the step, in `w.arguments`, that belong to a, λ and η there."""
    nq, nv = sizes[at.NQ], sizes[at.NV]
    beta, gamma = method.beta, method.gamma
    by_q, _ = leverage(method, h)
    for i in range(nv):
        old, now = w.vectors[AVERAGE, i], w.vectors[NEW_ACCELERATION, i]
        mixed = (1.0 - method.alpha_f) * now + method.alpha_f * w.vectors[ACCELERATION, i]
        new = (mixed - method.alpha_m * old) / (1.0 - method.alpha_m)
        w.vectors[NEW_AVERAGE, i] = new
        rate = w.vectors[RATE, i] + h * ((1.0 - gamma) * old + gamma * new)
        w.vectors[NEW_RATE, i] = rate
        travel = h * (w.vectors[RATE, i] + h * ((0.5 - beta) * old + beta * new))
        if method.stabilised:
            for k in range(sizes[at.NH]):
                travel += by_q * w.gradient[k * nv + i] * w.stabiliser[k]
        w.vectors[TRAVEL, i] = travel
        w.arguments[nq + i] = rate
        w.arguments[nq + nv + i] = now
    retract(sizes, y, 1.0, w.vectors[TRAVEL], 0, w.arguments)
    for k in range(sizes[at.NM]):
        w.arguments[nq + 2 * nv + k] = w.multipliers[END, k]


@jitted
def place_residual(method, h, loop, t1, w):
    """Write what the equations leave at the end of the step to `w.right`."""
    nv, nh, m = loop.sizes[at.NV], loop.sizes[at.NH], loop.sizes[at.NM]
    by_q, by_v = leverage(method, h)
    call_kernel(loop.addresses[at.RESIDUAL], t1, w.arguments, loop.p, w.residual)
    call_kernel(loop.addresses[at.CONSTRAINT_RESIDUAL], t1, w.arguments, loop.p, w.drift)
    for i in range(nv):
        w.right[i, 0] = w.residual[i]
    for k in range(m):
        if k < nh and not method.stabilised:
            w.right[nv + k, 0] = w.drift[k] / by_q
        else:
            w.right[nv + k, 0] = w.drift[nh + k] / by_v
    for k in range(w.right.shape[0] - nv - m):
        w.right[nv + m + k, 0] = w.drift[k] / by_q


@jitted
def factor_end(method, h, loop, t1, w):
    """Factor the derivative of `place_residual` by (a, λ, η)."""
    nq, nv, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NM]
    n_columns, n_state = w.arguments.shape[0], nq + nv
    by_q, by_v = leverage(method, h)
    if method.stabilised or m > loop.sizes[at.NH]:
        rotation_of_constraints(loop, t1, w)
    call_kernel(loop.addresses[at.RESIDUAL_JACOBIAN], t1, w.arguments, loop.p, w.derivative)
    loop.counters[at.JACOBIANS] += 1
    for i in range(w.matrix.shape[0]):
        for j in range(w.matrix.shape[0]):
            w.matrix[i, j] = 0.0
    for i in range(nv):
        row = w.derivative[i * n_columns : (i + 1) * n_columns]
        by_travel(loop.sizes, row, w)
        for j in range(nv):
            w.matrix[i, j] = row[n_state + j] + by_v * row[nq + j] + by_q * w.vectors[SLOPE, j]
        for k in range(m):
            w.matrix[i, nv + k] = row[n_state + nv + k]
    for k in range(m):
        if method.stabilised or k >= loop.sizes[at.NH]:
            first = (nv + k) * n_columns + n_state
            for j in range(nv):
                w.matrix[nv + k, j] = w.derivative[first + j] + by_q / by_v * w.turn[k, j]
        else:
            gradient_by_travel(k, loop.sizes, w)
            for j in range(nv):
                w.matrix[nv + k, j] = w.vectors[SLOPE, j]
    if method.stabilised:
        border_with_stabiliser(by_q, by_v, loop.sizes, w)
    loop.counters[TRUSTED] = 1 if factor(loop.counters, w) else 0
    loop.counters[HAVE_FACTORS] = 1
    w.numbers[FACTORED_FOR] = h
    forget_rate(w.numbers)


@jitted
def rotation_of_constraints(loop, t1, w):
    """Write ∂(G v)/∂q to `w.turn`: what ∂(G a - γ)/∂q, linear in a, gains from a + v in place of a."""
    nq, nv, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NM]
    n_columns, first = w.arguments.shape[0], nq + nv
    for more in range(2):
        for i in range(nv):
            a = w.vectors[NEW_ACCELERATION, i]
            w.arguments[first + i] = a + w.arguments[nq + i] if more else a
        call_kernel(loop.addresses[at.RESIDUAL_JACOBIAN], t1, w.arguments, loop.p, w.derivative)
        for k in range(m):
            by_travel(loop.sizes, w.derivative[(nv + k) * n_columns : (nv + k + 1) * n_columns], w)
            for j in range(nv):
                entry = w.vectors[SLOPE, j]
                w.turn[k, j] = entry - w.turn[k, j] if more else entry
    for i in range(nv):
        w.arguments[first + i] = w.vectors[NEW_ACCELERATION, i]
    loop.counters[at.JACOBIANS] += 2


@jitted
def border_with_stabiliser(by_q, by_v, sizes, w):
    """Write the rows of g = 0 and the columns of η, which moves positions along G at the start, to `w.matrix`."""
    nv, nh, m, n_columns = sizes[at.NV], sizes[at.NH], sizes[at.NM], w.arguments.shape[0]
    slope = w.vectors[SLOPE]
    for i in range(nv):
        by_travel(sizes, w.derivative[i * n_columns : (i + 1) * n_columns], w)
        for k in range(nh):
            w.matrix[i, nv + m + k] = by_q * dot(slope, w.gradient[k * nv : (k + 1) * nv])
    for r in range(m):
        for k in range(nh):
            w.matrix[nv + r, nv + m + k] = by_q / by_v * dot(w.turn[r], w.gradient[k * nv : (k + 1) * nv])
    for r in range(nh):
        gradient_by_travel(r, sizes, w)
        copy(slope, w.matrix[nv + m + r, :nv])
        for k in range(nh):
            w.matrix[nv + m + r, nv + m + k] = dot(slope, w.gradient[k * nv : (k + 1) * nv])


@jitted
def size_of_correction(method, h, loop, w):
    """Return the size of the correction `w.right` in positions and rates, in tolerances, beyond round-off.

    Constraints hold to round-off of positions, which shows divided by h in rates.
    """
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    by_q, by_v = leverage(method, h)
    farthest = 0.0
    for i in range(nq):
        farthest = max(farthest, abs(w.arguments[i]))
    noise = ROUND_OFF * farthest
    total, start = 0.0, 0
    for k in range(n_quaternions(loop.sizes) + 1):
        end = quaternion_at(loop.sizes, k)
        for i in range(start, min(end + 3, nq)):
            j = i - k
            change, v, q = abs(w.right[j, 0]), w.arguments[nq + j], w.arguments[i] if i < end else 1.0
            in_q = max(0.0, by_q * change - noise) / error_scale(loop.control, q, q)
            in_v = max(0.0, by_v * change - noise / h) / error_scale(loop.control, v, v)
            total += in_q * in_q + in_v * in_v + 0.0 * change
        start = end + 4
    return math.sqrt(total / (2 * nv))

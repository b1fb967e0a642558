"""One RATTLE step, for mass matrices that may change with the positions.

With L = T - V and the discrete Lagrangian h/2 (L(q0, u) + L(q1, u)), u = (q1 - q0)/h, the position-momentum form of
Marsden, West, Acta Numerica 10 (2001) 357, with constraints, reads, for M0 = M(q0), M1 = M(q1) and p = M v,

    p0 = (M0 + M1)/2 u - h/2 (L_q + Q)(q0, u) - G0ᵀ μ0,    g(q1) = 0,
    p1 = (M0 + M1)/2 u + h/2 (L_q + Q)(q1, u) + G1ᵀ μ1,    G1 v1 = 0.

It is symmetric and symplectic, of order 2, keeps both levels of constraints, and is RATTLE (Andersen, J. Comput. Phys.
52 (1983) 24) where M is constant. M is never inverted by itself, so coordinates without mass are welcome where
constraints determine them. Quaternions are turned by h u: see `rotation_increments`.
"""

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.compensated import add_compensated
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.quaternions import keep_lengths
from symgen.runtime.integrate.rattle.mean_rate import solve_mean
from symgen.runtime.integrate.rattle.push import push, slope
from symgen.runtime.integrate.rattle.rotation_increments import add_rotated, travel
from symgen.runtime.integrate.rattle.work import (
    END,
    H_GUESS,
    HALF_CHANGE,
    HAVE_GUESS,
    MEAN,
    PROBE,
    PUSH,
    REST,
    START,
    TRAVEL,
    TRIAL,
)
from symgen.runtime.integrate.saddle import border, factor, solve


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

"""What takes over when a model's straight-line solution loses rank; the same code for all models."""

from __future__ import annotations

import math

import numpy as np

from runtime.code.bridge import call_kernel
from runtime.code.numba_setup import jit
from runtime.constraints.rank_revealing import constrained_solve, factor_constraints, factor_mass

# The context: addresses, sizes (all 64 bits wide), and behind them where in q each quaternion begins.
MASS_MATRIX, FORCES, CONSTRAINT_JACOBIAN, GAMMA, CONSTRAINT_RESIDUAL, ENERGY, RHS = range(7)
NQ, NV, NH, M, NW, NP, TIME_DEPENDENT, N_QUATERNIONS = range(7, 15)
N_CONTEXT = 15


@jit
def robust_rhs(context, t, y, p, out):
    """Overwrite accelerations, multipliers and pivot ratio of a row that the straight-line `rhs` has written.

    The pivot ratio becomes that of the pivoted factor, or 0 when constraints depend on each other (then the
    multipliers are the shortest of many). The power stays where no multiplier can enter it; else it is dE/dt,
    differentiated numerically along the motion.
    """
    nq, nv, m, nw = context[NQ], context[NV], context[M], context[NW]
    ny = nq + nv + nw
    mass, jacobian, z, lower, order, scale, shift = _factors(context, t, y, p)
    rank, ratio = factor_constraints(mass, jacobian, z, lower, order, scale)
    f, gamma = np.zeros(nv), np.zeros(m)
    call_kernel(np.uint64(context[FORCES]), t, y, p, f)
    call_kernel(np.uint64(context[GAMMA]), t, y, p, gamma)
    _add_shift(shift, jacobian, gamma, f)
    multipliers = out[ny : ny + m]
    constrained_solve(mass, z, lower, order, scale, rank, f, gamma, out[nq : nq + nv], multipliers)
    out[ny + m] = ratio if rank == m else 0.0
    if nw and (context[TIME_DEPENDENT] or not math.isfinite(out[nq + nv])):
        out[nq + nv] = _power(context, t, y, p, out)


@jit
def robust_project(context, t, y, p, out):
    """Write what `project` should have: a Gauss step on positions, to unit quaternions, then one on velocities."""
    nq, nv, nh, m = context[NQ], context[NV], context[NH], context[M]
    n = nq + nv
    mass, jacobian, z, lower, order, scale, shift = _factors(context, t, y, p)
    rank, _ = factor_constraints(mass, jacobian, z, lower, order, scale)
    residual, target = np.zeros(nh + m), np.zeros(m)
    step, multipliers, f = np.zeros(nv), np.zeros(m), np.zeros(nv)
    moved, row = np.empty(n), np.zeros(n + context[NW] + m + 1)

    call_kernel(np.uint64(context[CONSTRAINT_RESIDUAL]), t, y, p, residual)
    for i in range(nh):
        out[n + i] = residual[i]
        target[i] = -residual[i]
    _add_shift(shift, jacobian, target, f)
    constrained_solve(mass, z, lower, order, scale, rank, f, target, step, multipliers)
    # The step is one of rates. qdot = N(q) v is linear in v, so `rhs` turns it into one of coordinates.
    for i in range(nq):
        moved[i] = y[i]
    for i in range(nv):
        moved[nq + i] = step[i]
    call_kernel(np.uint64(context[RHS]), t, moved, p, row)
    for i in range(nq):
        moved[i] = y[i] + row[i]
    for k in range(context[N_QUATERNIONS]):
        _scale_to_unit(moved, context[N_CONTEXT + k])
    for i in range(nq):
        out[i] = moved[i]
    for i in range(nv):
        moved[nq + i] = y[nq + i]

    call_kernel(np.uint64(context[CONSTRAINT_RESIDUAL]), t, moved, p, residual)
    for i in range(m):
        out[n + nh + i] = residual[nh + i]
        target[i] = -residual[nh + i]
    for i in range(nv):
        f[i] = 0.0
    _add_shift(shift, jacobian, target, f)
    constrained_solve(mass, z, lower, order, scale, rank, f, target, step, multipliers)
    for i in range(nv):
        out[nq + i] = y[nq + i] + step[i]


@jit
def _scale_to_unit(q, i):
    length = math.sqrt(q[i] ** 2 + q[i + 1] ** 2 + q[i + 2] ** 2 + q[i + 3] ** 2)
    for j in range(i, i + 4):
        q[j] /= length


@jit
def _factors(context, t, y, p):
    """Evaluate M and G, factor M, and make room for the factor of S."""
    nv, m = context[NV], context[M]
    mass, jacobian = np.zeros(nv * nv), np.zeros(m * nv)
    call_kernel(np.uint64(context[MASS_MATRIX]), t, y, p, mass)
    call_kernel(np.uint64(context[CONSTRAINT_JACOBIAN]), t, y, p, jacobian)
    mass, jacobian = mass.reshape((nv, nv)), jacobian.reshape((m, nv))
    shift = factor_mass(mass, jacobian)
    z, lower = np.empty((m, nv)), np.empty((m, m))
    return mass, jacobian, z, lower, np.empty(m, np.int64), np.empty(m), shift


@jit
def _add_shift(shift, jacobian, gamma, f):
    if shift != 0.0:  # also when it is nan, which then marks the result
        for k in range(gamma.shape[0]):
            for i in range(f.shape[0]):
                f[i] += shift * jacobian[k, i] * gamma[k]


@jit
def _power(context, t, y, p, row):
    """Return dE/dt along the motion (five-point formula, error about 1e-12 of E per time scale)."""
    n = context[NQ] + context[NV]
    size, speed = 1.0, 1.0
    for i in range(n):
        size = max(size, abs(y[i]))
        speed = max(speed, abs(row[i]))
    h = 1e-3 * size / speed
    shifted, energy = np.empty(n), np.zeros(2)
    total = 0.0
    for k, weight in ((-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0)):
        for i in range(n):
            shifted[i] = y[i] + k * h * row[i]
        call_kernel(np.uint64(context[ENERGY]), t + k * h, shifted, p, energy)
        total += weight * (energy[0] + energy[1])
    return total / (12.0 * h)

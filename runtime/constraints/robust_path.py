"""What takes over when a model's straight-line solution loses rank; the same code for all models.

Near a configuration where the constraints lose rank, the accelerations that they ask for have a pole just off the
constraints, where the stages of a step lie. There they are taken at the nearest state of the branch that the motion is
on, and so are a smooth function of the state up to the singular configuration itself.
"""

from __future__ import annotations

import math

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.constraints.beside import BESIDE, accelerations_beside
from symgen.runtime.constraints.branch import (
    CONSTRAINT_RESIDUAL,
    ENERGY,
    FORCES,
    GAMMA,
    NEAR_SINGULAR,
    NH,
    NQ,
    NV,
    NW,
    TIME_DEPENDENT,
    USUAL_RANK,
    M,
    buffers,
    factor,
    is_on_branch,
    move_to_branch,
    position_step,
    solve,
    velocity_step,
)
from symgen.runtime.constraints.rank_revealing import RANK_TOLERANCE, truncated
from symgen.runtime.integrate.copying import copy

# Of the first pivot. Closer to a singular configuration the constraint is left out of accelerations that are not
# interpolated: what is missing in them lies across the branch, and goes when the next state is moved to it.
_LEAST_PIVOT = 1e-8


@jitted
def robust_rhs(context, t, y, p, out, weights, order, work):
    """Overwrite accelerations, multipliers and pivot ratio of a row that the straight-line `rhs` has written.

    The pivot ratio becomes that of the pivoted factor, or 0 when constraints depend on each other (then the
    multipliers are the shortest of many). The power stays where no multiplier can enter it; else it is dE/dt,
    differentiated numerically along the motion.

    Parameters
    ----------
    context : ndarray of int64
    t : float [s]
    y, p, out : ndarray
        As of a kernel.
    weights : ndarray, shape (m * nv + m + nv,) or empty
        By which the squares of a row of G sum up to its size, then the scales of residuals, then characteristic sizes;
        see `row_weights.py`.
    order : ndarray of int64, shape (m,)
        A buffer.
    work : ndarray, shape (work_size(...),)
        A buffer.
    """
    nq, nv, m, nw = context[NQ], context[NV], context[M], context[NW]
    n, ny = nq + nv, nq + nv + nw
    b = buffers(context, order, work)
    copy(y[:n], b.place)
    rank, on_branch, ratio, beside = 0, 0, 0.0, False
    if context[NEAR_SINGULAR] == 0:
        rank, ratio, _ = factor(context, t, b, p, weights, RANK_TOLERANCE)
    if rank < m:
        on_branch = is_on_branch(context, t, b, p, weights) or move_to_branch(context, t, b, p, weights)
        if on_branch > 0:
            rank, ratio = truncated(b.lower, on_branch, _LEAST_PIVOT)
            beside = rank < context[USUAL_RANK] or ratio < BESIDE**2
        else:
            copy(y[:n], b.place)
            rank, ratio, _ = factor(context, t, b, p, weights, RANK_TOLERANCE)
    call_kernel(np.uint64(context[FORCES]), t, b.place, p, b.forces)
    call_kernel(np.uint64(context[GAMMA]), t, b.place, p, b.target)
    solve(b, rank)
    copy(b.step, out[nq:n])
    copy(b.multipliers, out[ny : ny + m])
    out[ny + m] = ratio if rank == m else 0.0
    if beside and accelerations_beside(context, t, b, p, weights, on_branch):
        copy(b.total, out[nq:n])
    if nw and (context[TIME_DEPENDENT] or not math.isfinite(out[n])):
        out[n] = _power(context, t, y, p, out, b)


@jitted
def robust_project(context, t, y, p, out, weights, order, work):
    """Write what `project` should have: positions, unit quaternions and velocities on the constraints."""
    nh, n = context[NH], context[NQ] + context[NV]
    b = buffers(context, order, work)
    copy(y[:n], b.place)
    call_kernel(np.uint64(context[CONSTRAINT_RESIDUAL]), t, b.place, p, b.residual)
    copy(b.residual[:nh], out[n:])
    if not move_to_branch(context, t, b, p, weights):
        copy(y[:n], b.place)
        rank, _, _ = factor(context, t, b, p, weights, RANK_TOLERANCE)
        position_step(context, t, b, p, rank)
        velocity_step(context, t, b, p, rank)
    copy(b.place, out)
    copy(b.residual[nh:], out[n + nh :])  # that of the old velocities at the new positions


@jitted
def _power(context, t, y, p, row, b):
    """Return dE/dt along the motion (five-point formula, error about 1e-12 of E per time scale)."""
    n = context[NQ] + context[NV]
    size, speed = 1.0, 1.0
    for i in range(n):
        size = max(size, abs(y[i]))
        speed = max(speed, abs(row[i]))
    h = 1e-3 * size / speed
    energy = b.row[:2]
    total = 0.0
    for k, weight in ((-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0)):
        for i in range(n):
            b.moved[i] = y[i] + k * h * row[i]
        call_kernel(np.uint64(context[ENERGY]), t + k * h, b.moved, p, energy)
        total += weight * (energy[0] + energy[1])
    return total / (12.0 * h)


robust_rhs.title = robust_project.title = "the path for dependent constraints (once per machine)"

"""What takes over when a model's straight-line solution loses rank; the same code for all models.

Near a configuration where the constraints lose rank, the accelerations that they ask for have a pole just off the
constraints, where the stages of a step lie. There they are taken at the nearest state of the branch that the motion is
on, and so are a smooth function of the state up to the singular configuration itself.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from runtime.code.bridge import call_kernel
from runtime.code.jitted import jitted
from runtime.constraints.rank_revealing import (
    RANK_TOLERANCE,
    buffer_size,
    constrained_solve,
    factor_constraints,
    factor_mass,
)
from runtime.integrate.copying import copy

# The context: addresses, sizes (all 64 bits wide), and behind them where in q each quaternion begins.
MASS_MATRIX, FORCES, CONSTRAINT_JACOBIAN, GAMMA, CONSTRAINT_RESIDUAL, ENERGY, RHS = range(7)
# NEAR_SINGULAR: a row of G vanishes nearby; ILL_CONDITIONED: straight-line code loses too many digits (1 or 0).
NQ, NV, NH, M, NW, NP, TIME_DEPENDENT, NEAR_SINGULAR, ILL_CONDITIONED, N_QUATERNIONS = range(7, 17)
N_CONTEXT = 17

_ON_BRANCH = 1e-12  # of the first pivot: below, a constraint says nothing even on the branch
_ROUND_OFF = 3e-14  # of characteristic sizes, or of the velocity in the metric of M
_MOST_STEPS = 6
_CONVERGES = 0.25  # what a Gauss step may leave of the residual
_SAME_PIVOT = 0.5  # by how much the last pivot may change in the last step
# Of the first pivot, which is d² at the distance d from a singular configuration. Round-off of the positions makes
# accelerations uncertain by 1e-16/d³. Too close, they are taken without the constraint: what is missing in them lies
# across the branch, and goes when the next state is moved to it.
_LEAST_PIVOT = 1e-8


class Buffers(NamedTuple):
    """Parts of `work`, by what they hold."""

    place: np.ndarray  # (nq + nv,): q, v
    mass: np.ndarray  # (nv, nv): factor of M, or of M + s GᵀG
    kept: np.ndarray  # (nv, nv)
    jacobian: np.ndarray  # (m, nv): G
    z: np.ndarray  # (m, nv): from here on see `factor_constraints`
    lower: np.ndarray  # (m, m)
    order: np.ndarray  # (m,)
    scale: np.ndarray  # (m,)
    sizes: np.ndarray  # (m,)
    shift: np.ndarray  # (1,): s
    solver: np.ndarray
    forces: np.ndarray  # (nv,)
    target: np.ndarray  # (m,)
    step: np.ndarray  # (nv,)
    multipliers: np.ndarray  # (m,)
    residual: np.ndarray  # (nh + m,)
    moved: np.ndarray  # (nq + nv,)
    row: np.ndarray  # (n_row,)


@jitted
def work_size(nq, nv, nh, m, nw):
    """Length of the buffer `work` below."""
    matrices = 2 * nv * nv + 2 * m * nv + m * m + buffer_size(m)
    return matrices + 2 * (nq + nv) + 2 * nv + 4 * m + 1 + nh + m + (nq + nv + nw + m + 1)


@jitted
def _buffers(context, order, work):
    nq, nv, nh, m = context[NQ], context[NV], context[NH], context[M]
    n = nq + nv
    place, work = work[:n], work[n:]
    mass, work = work[: nv * nv].reshape((nv, nv)), work[nv * nv :]
    kept, work = work[: nv * nv].reshape((nv, nv)), work[nv * nv :]
    jacobian, work = work[: m * nv].reshape((m, nv)), work[m * nv :]
    z, work = work[: m * nv].reshape((m, nv)), work[m * nv :]
    lower, work = work[: m * m].reshape((m, m)), work[m * m :]
    scale, sizes, shift, work = work[:m], work[m : 2 * m], work[2 * m : 2 * m + 1], work[2 * m + 1 :]
    solver, work = work[: buffer_size(m)], work[buffer_size(m) :]
    forces, step, work = work[:nv], work[nv : 2 * nv], work[2 * nv :]
    target, multipliers, work = work[:m], work[m : 2 * m], work[2 * m :]
    residual, moved, row = work[: nh + m], work[nh + m :][:n], work[nh + m + n :]
    return Buffers(
        place, mass, kept, jacobian, z, lower, order, scale, sizes, shift, solver, forces, target, step,
        multipliers, residual, moved, row,
    )  # fmt: skip


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
    weights : ndarray, shape (m * nv + m,) or empty
        By which the squares of a row of G sum up to its size, then the scales of residuals; see `row_weights.py`.
    order : ndarray of int64, shape (m,)
        A buffer.
    work : ndarray, shape (work_size(...),)
        A buffer.
    """
    nq, nv, m, nw = context[NQ], context[NV], context[M], context[NW]
    n, ny = nq + nv, nq + nv + nw
    b = _buffers(context, order, work)
    copy(y[:n], b.place)
    rank, ratio, _ = _factor(context, t, b, p, weights, RANK_TOLERANCE)
    if context[NEAR_SINGULAR] != 0 or rank < m:
        if _is_on_branch(context, t, b, p, weights) or _move_to_branch(context, t, b, p, weights):
            rank, ratio, _ = _factor(context, t, b, p, weights, _LEAST_PIVOT)
        else:
            copy(y[:n], b.place)
            rank, ratio, _ = _factor(context, t, b, p, weights, RANK_TOLERANCE)
    call_kernel(np.uint64(context[FORCES]), t, b.place, p, b.forces)
    call_kernel(np.uint64(context[GAMMA]), t, b.place, p, b.target)
    _solve(b, rank)
    copy(b.step, out[nq:n])
    copy(b.multipliers, out[ny : ny + m])
    out[ny + m] = ratio if rank == m else 0.0
    if nw and (context[TIME_DEPENDENT] or not math.isfinite(out[n])):
        out[n] = _power(context, t, y, p, out, b)


@jitted
def robust_project(context, t, y, p, out, weights, order, work):
    """Write what `project` should have: positions, unit quaternions and velocities on the constraints."""
    nh, n = context[NH], context[NQ] + context[NV]
    b = _buffers(context, order, work)
    copy(y[:n], b.place)
    call_kernel(np.uint64(context[CONSTRAINT_RESIDUAL]), t, b.place, p, b.residual)
    copy(b.residual[:nh], out[n:])
    if not _move_to_branch(context, t, b, p, weights):
        copy(y[:n], b.place)
        rank, _, _ = _factor(context, t, b, p, weights, RANK_TOLERANCE)
        _position_step(context, t, b, p, rank)
        _velocity_step(context, t, b, p, rank)
    copy(b.place, out)
    copy(b.residual[nh:], out[n + nh :])  # that of the old velocities at the new positions


@jitted
def _move_to_branch(context, t, b, p, weights):
    """Bring (q, v) onto the constraints, however nearly they depend on each other; False where that leads astray.

    Gauss steps converge on the nearest branch as long as that is nearer than the singular configuration. Where it is
    not, they change the last pivot, which measures the distance from that configuration.
    """
    rank, _, pivot = _factor(context, t, b, p, weights, _ON_BRANCH)
    before, same = math.inf, True
    for _ in range(_MOST_STEPS if context[NH] > 0 else 0):
        size = _position_step(context, t, b, p, rank)
        old, old_rank = pivot, rank
        rank, _, pivot = _factor(context, t, b, p, weights, _ON_BRANCH)
        same = rank == old_rank and abs(pivot - old) <= _SAME_PIVOT * old
        if size == 0.0 or not size <= _CONVERGES * before:
            break
        before = size
    _velocity_step(context, t, b, p, rank)
    return same


@jitted
def _is_on_branch(context, t, b, p, weights):
    """Whether (q, v) fits the constraints as well as round-off lets it: moving it would add noise, and nothing else.

    Round-off of the positions leaves velocities uncertain by its ratio to the distance from the singular configuration.
    """
    nq, nv, nh, m = context[NQ], context[NV], context[NH], context[M]
    if weights.shape[0] == 0:
        return False
    scales = weights[m * nv :]
    _, ratio, _ = _factor(context, t, b, p, weights, _ON_BRANCH)
    call_kernel(np.uint64(context[CONSTRAINT_RESIDUAL]), t, b.place, p, b.residual)
    for i in range(nh):
        if not abs(b.residual[i]) * scales[i] <= _ROUND_OFF:
            return False
    velocity, speed = 0.0, 0.0
    for i in range(m):
        velocity = max(velocity, abs(b.residual[nh + i]) * b.scale[i])
    for i in range(nv):
        speed += (b.mass[i, i] * b.place[nq + i]) ** 2
    return velocity**2 * ratio <= _ROUND_OFF**2 * speed


@jitted
def _position_step(context, t, b, p, rank):
    """Make a Gauss step on the positions, to unit quaternions; returns the size of the residual before it."""
    nq, nh, m = context[NQ], context[NH], context[M]
    call_kernel(np.uint64(context[CONSTRAINT_RESIDUAL]), t, b.place, p, b.residual)
    size = 0.0
    for i in range(m):
        b.target[i] = -b.residual[i] if i < nh else 0.0
        size = max(size, abs(b.target[i]) * b.scale[i])
    _fill(b.forces, 0.0)
    _solve(b, rank)
    # The step is one of rates. qdot = N(q) v is linear in v, so `rhs` turns it into one of coordinates.
    copy(b.place[:nq], b.moved)
    copy(b.step, b.moved[nq:])
    call_kernel(np.uint64(context[RHS]), t, b.moved, p, b.row)
    for i in range(nq):
        b.place[i] += b.row[i]
    for k in range(context[N_QUATERNIONS]):
        _scale_to_unit(b.place, context[N_CONTEXT + k])
    return size


@jitted
def _velocity_step(context, t, b, p, rank):
    """Make a Gauss step on the velocities; the residual before it stays in its buffer."""
    nq, nh = context[NQ], context[NH]
    call_kernel(np.uint64(context[CONSTRAINT_RESIDUAL]), t, b.place, p, b.residual)
    for i in range(context[M]):
        b.target[i] = -b.residual[nh + i]
    _fill(b.forces, 0.0)
    _solve(b, rank)
    for i in range(context[NV]):
        b.place[nq + i] += b.step[i]


@jitted
def _factor(context, t, b, p, weights, tolerance):
    """Factor M and S at `b.place`; returns rank, ratio of last to first pivot, and last pivot."""
    nv, m = context[NV], context[M]
    mass, jacobian = b.mass.reshape(nv * nv), b.jacobian.reshape(m * nv)
    _fill(mass, 0.0)
    _fill(jacobian, 0.0)
    call_kernel(np.uint64(context[MASS_MATRIX]), t, b.place, p, mass)
    call_kernel(np.uint64(context[CONSTRAINT_JACOBIAN]), t, b.place, p, jacobian)
    row_sizes(jacobian, weights, b.sizes)
    b.shift[0] = factor_mass(b.mass, b.kept, b.jacobian)
    rank, ratio = factor_constraints(b.mass, b.jacobian, b.sizes, tolerance, b.z, b.lower, b.order, b.scale)
    return rank, ratio, b.lower[rank - 1, rank - 1] ** 2 if rank > 0 else 0.0


@jitted
def row_sizes(jacobian, weights, out):
    """Write how large each row of G is compared with what it is nearby, squared and at most 1."""
    m = out.shape[0]
    nv = jacobian.shape[0] // m
    _fill(out, 1.0)
    if weights.shape[0] == 0:
        return
    for i in range(m):
        size = 0.0
        for k in range(i * nv, (i + 1) * nv):
            size += jacobian[k] * jacobian[k] * weights[k]
        out[i] = min(1.0, size)


@jitted
def _solve(b, rank):
    """Solve for `b.step` and `b.multipliers` with `b.forces`, which is overwritten, and `b.target` on the right."""
    if b.shift[0] != 0.0:  # also when it is nan, which then marks the result
        for k in range(b.target.shape[0]):
            for i in range(b.forces.shape[0]):
                b.forces[i] += b.shift[0] * b.jacobian[k, i] * b.target[k]
    constrained_solve(
        b.mass, b.z, b.lower, b.order, b.scale, rank, b.forces, b.target, b.step, b.multipliers, b.solver
    )


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


@jitted
def _scale_to_unit(q, i):
    length = math.sqrt(q[i] ** 2 + q[i + 1] ** 2 + q[i + 2] ** 2 + q[i + 3] ** 2)
    for j in range(i, i + 4):
        q[j] /= length


@jitted
def _fill(array, value):
    for i in range(array.shape[0]):
        array[i] = value


robust_rhs.title = robust_project.title = "the path for dependent constraints (once per machine)"

"""States on the constraints where these (nearly) depend on each other: moving to one, factoring and solving there."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.constraints.rank_revealing import (
    buffer_size,
    constrained_solve,
    factor_constraints,
    factor_mass,
)
from symgen.runtime.integrate.copying import copy

# The context: addresses, sizes (all 64 bits wide), and behind them where in q each quaternion begins.
MASS_MATRIX, FORCES, CONSTRAINT_JACOBIAN, GAMMA, CONSTRAINT_RESIDUAL, ENERGY, RHS = range(7)
# NEAR_SINGULAR: a row of G vanishes nearby; ILL_CONDITIONED: straight-line code loses too many digits (1 or 0).
# USUAL_RANK: of G where it is not singular, 0 where that is not known.
NQ, NV, NH, M, NW, NP, TIME_DEPENDENT, NEAR_SINGULAR, ILL_CONDITIONED, USUAL_RANK, N_QUATERNIONS = range(
    7, 18
)
N_CONTEXT = 18

ON_BRANCH = 1e-12  # of the first pivot: below, a constraint says nothing even on the branch
_ROUND_OFF = 3e-14  # of characteristic sizes, or of the velocity in the metric of M
_MOST_STEPS = 6
_CONVERGES = 0.25  # what a Gauss step may leave of the residual
_SAME_VOLUME = 0.5  # by how much the product of the pivots may change in the last step


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
    centre: np.ndarray  # (nq + nv,): from here to `eight` see `robust_path.py`
    along: np.ndarray  # (nq,)
    total: np.ndarray  # (nv,)
    direct: np.ndarray  # (nv,)
    eight: np.ndarray  # (nv,)
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
    return matrices + 3 * (nq + nv) + nq + 5 * nv + 4 * m + 1 + nh + m + (nq + nv + nw + m + 1)


@jitted
def buffers(context, order, work):
    """`work` in its parts."""
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
    centre, along, work = work[:n], work[n : n + nq], work[n + nq :]
    total, direct, eight, work = work[:nv], work[nv : 2 * nv], work[2 * nv : 3 * nv], work[3 * nv :]
    forces, step, work = work[:nv], work[nv : 2 * nv], work[2 * nv :]
    target, multipliers, work = work[:m], work[m : 2 * m], work[2 * m :]
    residual, moved, row = work[: nh + m], work[nh + m :][:n], work[nh + m + n :]
    return Buffers(
        place, mass, kept, jacobian, z, lower, order, scale, sizes, shift, solver, centre, along, total, direct,
        eight, forces, target, step, multipliers, residual, moved, row,
    )  # fmt: skip


@jitted
def move_to_branch(context, t, b, p, weights):
    """Bring (q, v) onto the constraints, however nearly they depend on each other; returns the rank, 0 if lost.

    The factor is then that of the new place, at the tolerance ON_BRANCH.

    Gauss steps converge on the nearest branch as long as that is nearer than the singular configuration. Where it is
    not, they change the product of the pivots, which falls with the distance from that configuration. (Which pivot is
    the last, and how large, jumps with their order.)
    """
    rank, _, volume = factor(context, t, b, p, weights, ON_BRANCH)
    before, same = math.inf, True
    for _ in range(_MOST_STEPS if context[NH] > 0 else 0):
        size = position_step(context, t, b, p, rank)
        old, old_rank = volume, rank
        rank, _, volume = factor(context, t, b, p, weights, ON_BRANCH)
        same = rank == old_rank and abs(volume - old) <= _SAME_VOLUME * old
        if size == 0.0 or not size <= _CONVERGES * before:
            break
        before = size
    velocity_step(context, t, b, p, rank)
    return rank if same else 0


@jitted
def is_on_branch(context, t, b, p, weights):
    """Whether (q, v) fits the constraints as well as round-off lets it: moving it would add noise, and nothing else.

    Round-off of the positions leaves velocities uncertain by its ratio to the distance from the singular configuration.
    Returns the rank, and leaves the factor behind, at the tolerance ON_BRANCH; 0 where it does not fit.
    """
    nq, nv, nh, m = context[NQ], context[NV], context[NH], context[M]
    if weights.shape[0] == 0:
        return 0
    scales = weights[m * nv :]
    call_kernel(np.uint64(context[CONSTRAINT_RESIDUAL]), t, b.place, p, b.residual)
    for i in range(nh):
        if not abs(b.residual[i]) * scales[i] <= _ROUND_OFF:
            return 0
    rank, ratio, _ = factor(context, t, b, p, weights, ON_BRANCH)
    velocity, speed = 0.0, 0.0
    for i in range(m):
        velocity = max(velocity, abs(b.residual[nh + i]) * b.scale[i])
    for i in range(nv):
        speed += (b.mass[i, i] * b.place[nq + i]) ** 2
    return rank if velocity**2 * ratio <= _ROUND_OFF**2 * speed else 0


@jitted
def position_step(context, t, b, p, rank):
    """Make a Gauss step on the positions, to unit quaternions; returns the size of the residual before it."""
    nq, nh, m = context[NQ], context[NH], context[M]
    call_kernel(np.uint64(context[CONSTRAINT_RESIDUAL]), t, b.place, p, b.residual)
    size = 0.0
    for i in range(m):
        b.target[i] = -b.residual[i] if i < nh else 0.0
        size = max(size, abs(b.target[i]) * b.scale[i])
    fill(b.forces, 0.0)
    solve(b, rank)
    # The step is one of rates. qdot = N(q) v is linear in v, so `rhs` turns it into one of coordinates.
    copy(b.place[:nq], b.moved)
    copy(b.step, b.moved[nq:])
    call_kernel(np.uint64(context[RHS]), t, b.moved, p, b.row)
    for i in range(nq):
        b.place[i] += b.row[i]
    make_unit(context, b.place)
    return size


@jitted
def velocity_step(context, t, b, p, rank):
    """Make a Gauss step on the velocities; the residual before it stays in its buffer."""
    nq, nh = context[NQ], context[NH]
    call_kernel(np.uint64(context[CONSTRAINT_RESIDUAL]), t, b.place, p, b.residual)
    for i in range(context[M]):
        b.target[i] = -b.residual[nh + i]
    fill(b.forces, 0.0)
    solve(b, rank)
    for i in range(context[NV]):
        b.place[nq + i] += b.step[i]


@jitted
def factor(context, t, b, p, weights, tolerance):
    """Factor M and S at `b.place`; returns rank, ratio of last to first pivot, and product of pivots."""
    nv, m = context[NV], context[M]
    mass, jacobian = b.mass.reshape(nv * nv), b.jacobian.reshape(m * nv)
    fill(mass, 0.0)
    fill(jacobian, 0.0)
    call_kernel(np.uint64(context[MASS_MATRIX]), t, b.place, p, mass)
    call_kernel(np.uint64(context[CONSTRAINT_JACOBIAN]), t, b.place, p, jacobian)
    row_sizes(jacobian, weights, b.sizes)
    b.shift[0] = factor_mass(b.mass, b.kept, b.jacobian)
    rank, ratio = factor_constraints(b.mass, b.jacobian, b.sizes, tolerance, b.z, b.lower, b.order, b.scale)
    volume = 1.0  # the determinant of the rows that count, whatever their order
    for i in range(rank):
        volume *= b.lower[i, i] ** 2
    return rank, ratio, volume


@jitted
def row_sizes(jacobian, weights, out):
    """Write how large each row of G is compared with what it is nearby, squared and at most 1."""
    m = out.shape[0]
    nv = jacobian.shape[0] // m
    fill(out, 1.0)
    if weights.shape[0] == 0:
        return
    for i in range(m):
        size = 0.0
        for k in range(i * nv, (i + 1) * nv):
            size += jacobian[k] * jacobian[k] * weights[k]
        out[i] = min(1.0, size)


@jitted
def solve(b, rank):
    """Solve for `b.step` and `b.multipliers` with `b.forces`, which is overwritten, and `b.target` on the right."""
    if b.shift[0] != 0.0:  # also when it is nan, which then marks the result
        for k in range(b.target.shape[0]):
            for i in range(b.forces.shape[0]):
                b.forces[i] += b.shift[0] * b.jacobian[k, i] * b.target[k]
    constrained_solve(b, rank)


@jitted
def make_unit(context, q):
    """Give all quaternions in q their length."""
    for k in range(context[N_QUATERNIONS]):
        _scale_to_unit(q, context[N_CONTEXT + k])


@jitted
def _scale_to_unit(q, i):
    length = math.sqrt(q[i] ** 2 + q[i + 1] ** 2 + q[i + 2] ** 2 + q[i + 3] ** 2)
    for j in range(i, i + 4):
        q[j] /= length


@jitted
def fill(array, value):
    """Write one value everywhere."""
    for i in range(array.shape[0]):
        array[i] = value

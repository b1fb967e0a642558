"""States on the constraints where these (nearly) depend on each other: moving to one, factoring and solving there."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.linear import ONE, unsigned
from symgen.runtime.integrate.loop import copy

# M is factored by Cholesky, S = G M⁻¹ Gᵀ by Cholesky with diagonal pivoting, stopped at the rank. `a` comes
# from a set of independent rows; the multipliers are those of least norm among all that give this `a`.

# Relative to the largest pivot of S with its diagonal scaled to 1. A value that follows the integration's
# tolerance makes most runs through a change point fail.
RANK_TOLERANCE = 1e-4
# Of the largest pivot: a row that comes first stays first. Off the constraints each choice of independent rows gives
# other accelerations, so that an order that follows round-off makes them jump between the stages of a step.
_NEARLY_AS_LARGE = 0.1
_SINGULAR_MASS = 1e-12
_TINY_INERTIA = 1e-8  # of the largest: where a constraint carries the coordinate, as many digits are lost


@jitted
def cholesky(a, n):
    """Replace the leading n × n block by its Cholesky factor L, and above it Lᵀ; False if it is indefinite.

    Only the block's upper triangle is read. What is zero costs nothing: most rates have little to do with each other.
    """
    n = unsigned(n)
    for k in range(n):
        pivot = a[k, k]
        for i in range(k):
            pivot -= a[i, k] * a[i, k]
        if not pivot > _SINGULAR_MASS * abs(a[k, k]):
            return False
        root = math.sqrt(pivot)
        a[k, k] = root
        for j in range(k + ONE, n):
            if a[k, j] != 0.0:
                a[k, j] /= root
            a[j, k] = a[k, j]
        for i in range(k + ONE, n):
            value = a[k, i]
            if value != 0.0:
                for j in range(i + ONE, n):
                    a[i, j] -= value * a[k, j]
    return True


@jitted
def forward_substitution(lower, n, x):
    """Replace x by L⁻¹x; Lᵀ stands above L."""
    n = unsigned(n)
    for k in range(n):
        if x[k] != 0.0:
            x[k] /= lower[k, k]
            value = x[k]
            for i in range(k + ONE, n):
                x[i] -= lower[k, i] * value


@jitted
def back_substitution(lower, n, x):
    """Replace x by L⁻ᵀx; Lᵀ stands above L."""
    n = unsigned(n)
    for k in range(n):
        i = n - k - ONE
        total = x[i]
        for j in range(i + ONE, n):
            total -= lower[i, j] * x[j]
        x[i] = total / lower[i, i]


@jitted
def factor_mass(mass, kept, jacobian):
    """Factor M in place; if (nearly) singular, M + s GᵀG, which has the same solution once s Gᵀγ is added to f.

    Returns s (0 when M is definite), or nan when that is singular too: the motion is not determined. `kept` is a
    buffer as large as M.
    """
    n, m = mass.shape[0], jacobian.shape[0]
    for i in range(n):
        for j in range(n):
            kept[i, j] = mass[i, j]
    least, most = math.inf, 0.0
    for i in range(n):
        least, most = min(least, kept[i, i]), max(most, kept[i, i])
    if least > _TINY_INERTIA * most and cholesky(mass, n):
        return 0.0
    trace_mass, trace_g = 0.0, 0.0
    for i in range(n):
        trace_mass += abs(kept[i, i])
        for k in range(m):
            trace_g += jacobian[k, i] * jacobian[k, i]
    shift = (trace_mass if trace_mass > 0.0 else 1.0) / trace_g
    for i in range(n):
        for j in range(n):
            for k in range(m):
                kept[i, j] += shift * jacobian[k, i] * jacobian[k, j]
            mass[i, j] = kept[i, j]
    if cholesky(mass, n):
        return shift
    for i in range(n):
        for j in range(n):
            mass[i, j] = kept[i, j]
            for k in range(m):
                mass[i, j] -= shift * jacobian[k, i] * jacobian[k, j]
    return 0.0 if least > 0.0 and cholesky(mass, n) else math.nan


@jitted
def factor_constraints(lower_mass, jacobian, sizes, tolerance, z, lower, order, scale):
    """Factor E S E with pivoting, E = diag(scale); return the rank and the ratio of last to first pivot.

    Parameters
    ----------
    lower_mass : ndarray, shape (n, n)
        Cholesky factor of M.
    jacobian : ndarray, shape (m, n)
    sizes : ndarray, shape (m,)
        How large each row of the Jacobian is compared with what it is nearby, squared, at most 1.
    tolerance : float
        Pivots below this part of the first count as zero.
    z : ndarray, shape (n, m)
        Written: L⁻¹Gᵀ.
    lower : ndarray, shape (m, m)
        Written: the factor, rows in the order of the pivots.
    order : ndarray of int64, shape (m,)
        Written: which constraint each pivot is.
    scale : ndarray, shape (m,)
        Written: makes the diagonal of S `sizes`, so that units of constraints do not matter, and a row that vanishes
        is seen.
    """
    n, m = unsigned(z.shape[0]), unsigned(z.shape[1])
    for k in range(n):
        for j in range(m):
            z[k, j] = jacobian[j, k]
    for j in range(m):
        scale[j] = 0.0
    for k in range(n):
        pivot = lower_mass[k, k]
        for j in range(m):
            if z[k, j] != 0.0:
                z[k, j] /= pivot
                scale[j] += z[k, j] * z[k, j]
        for i in range(k + ONE, n):
            value = lower_mass[k, i]
            if value != 0.0:
                for j in range(m):
                    z[i, j] -= value * z[k, j]
    trace = 0.0
    for j in range(m):
        square = scale[j]
        scale[j] = math.sqrt(sizes[j] / square) if square != 0.0 else 1.0
        order[j] = j
        trace += square
    if not math.isfinite(trace):
        # Comparisons with nan would call these rows dependent, and lose them.
        for i in range(m):
            for j in range(m):
                lower[i, j] = math.nan
        return np.int64(m), math.nan
    for i in range(m):
        for j in range(m):
            lower[i, j] = 0.0
    for k in range(n):
        for i in range(m):
            value = z[k, i]
            if value != 0.0:
                for j in range(i + ONE):
                    lower[i, j] += value * z[k, j]
    for i in range(m):
        for j in range(i + ONE):
            lower[i, j] = lower[i, j] * scale[i] * scale[j]
            lower[j, i] = lower[i, j]
    ratio, first = 0.0, 0.0
    for k in range(m):
        best = k
        for i in range(k + ONE, m):
            if lower[i, i] > lower[best, best]:
                best = i
        if k == 0:
            first = lower[best, best]
        pivot = best
        if lower[k, k] > max(_NEARLY_AS_LARGE * lower[best, best], tolerance * first):
            pivot = k
        value = lower[pivot, pivot]
        if not (value > tolerance * first and value > 0.0):
            return np.int64(k), ratio
        ratio = value / first
        _swap(lower, order, k, pivot)
        root = math.sqrt(value)
        lower[k, k] = root
        for i in range(k + ONE, m):
            if lower[k, i] != 0.0:
                lower[k, i] /= root
            lower[i, k] = lower[k, i]
        for i in range(k + ONE, m):
            part = lower[k, i]
            if part != 0.0:
                for j in range(k + ONE, m):
                    lower[i, j] -= part * lower[k, j]
    return np.int64(m), ratio


@jitted
def truncated(lower, rank, tolerance):
    """Return rank and ratio of last to first pivot as `factor_constraints` would have with another tolerance."""
    first = lower[0, 0] ** 2
    ratio = 0.0
    for k in range(rank):
        value = lower[k, k] ** 2
        if not value > tolerance * first:
            return k, ratio
        ratio = value / first
    return rank, ratio


@jitted
def least_pivot(lower, rank, x):
    """Return the least that any of the independent rows leaves for a pivot if it comes last: 1 / max diag((E S E)⁻¹).

    Other than the last pivot this does not jump when the order of the pivots changes. `x` is a buffer of `rank`.
    """
    largest = 0.0
    for i in range(rank):
        for k in range(rank):
            x[k] = 1.0 if k == i else 0.0
        forward_substitution(lower, rank, x)
        total = 0.0
        for k in range(i, rank):
            total += x[k] * x[k]
        largest = max(largest, total)
    return 1.0 / largest if largest > 0.0 else 0.0


@jitted
def _swap(lower, order, k, pivot):
    """Exchange rows and columns k and pivot."""
    if pivot == k:
        return
    m = order.shape[0]
    order[k], order[pivot] = order[pivot], order[k]
    for j in range(m):
        lower[k, j], lower[pivot, j] = lower[pivot, j], lower[k, j]
    for i in range(m):
        lower[i, k], lower[i, pivot] = lower[i, pivot], lower[i, k]


@jitted
def buffer_size(m):
    """Length of the buffer of `constrained_solve`."""
    return m + 2 * m * m


@jitted
def constrained_solve(b, rank):
    """Solve for `b.step` and `b.multipliers` with the factors above and `b.forces`, `b.target` on the right.

    `b` is a `branch.Buffers`. `b.forces` (with s Gᵀγ in it if M was singular) is overwritten.
    """
    lower_mass, z, lower, order, scale = b.mass, b.z, b.lower, b.order, b.scale
    f, gamma, a, multipliers = b.forces, b.target, b.step, b.multipliers
    n, m = unsigned(z.shape[0]), unsigned(z.shape[1])
    basic, asked = b.solver[:m], b.solver[m : 2 * m]
    forward_substitution(lower_mass, n, f)
    for j in range(m):
        multipliers[j] = 0.0
        asked[j] = gamma[j]
    for k in range(n):
        for j in range(m):
            asked[j] -= z[k, j] * f[k]
    for i in range(rank):
        j = order[i]
        basic[i] = asked[j] * scale[j]
    forward_substitution(lower, rank, basic)
    back_substitution(lower, rank, basic)
    for k in range(n):
        a[k] = f[k]
    for i in range(rank):
        j = order[i]
        multipliers[j] = basic[i] * scale[j]
        for k in range(n):
            a[k] += z[k, j] * multipliers[j]
    back_substitution(lower_mass, n, a)
    if 0 < rank < z.shape[1]:
        _least_norm(lower, order, scale, rank, multipliers, b.solver)


@jitted
def _least_norm(lower, order, scale, rank, multipliers, buffer):
    """Take from the multipliers their part in the null space of Gᵀ."""
    m = order.shape[0]
    free = m - rank
    part = buffer[:m]
    null = buffer[m:][: free * m].reshape((free, m))  # rows span the null space
    gram = buffer[m + m * m :][: free * free].reshape((free, free))
    for c in range(free):
        row = null[c]
        for k in range(m):
            row[k] = -lower[rank + c, k] if k < rank else 0.0
        back_substitution(lower, rank, row)
        row[rank + c] = 1.0
        for k in range(m):
            row[k] *= scale[order[k]]
    for c in range(free):
        for d in range(free):
            gram[c, d] = 0.0
            for k in range(m):
                gram[c, d] += null[c, k] * null[d, k]
    cholesky(gram, free)
    for _ in range(2):  # rows of very different scales leave too much after once
        for c in range(free):
            part[c] = 0.0
            for k in range(m):
                part[c] += null[c, k] * multipliers[order[k]]
        forward_substitution(gram, free, part)
        back_substitution(gram, free, part)
        for c in range(free):
            for k in range(m):
                multipliers[order[k]] -= null[c, k] * part[c]


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
_SETTLED = 1e-12  # of the first residual: what a step changes from here on is round-off, and no factor
_CHORD = 1e-6  # of characteristic sizes: after a residual up to that, the factor before the step is good for another
_SAME_VOLUME = 0.5  # by how much the product of the pivots may change in the last step


class Buffers(NamedTuple):
    """Parts of `work`, by what they hold."""

    place: np.ndarray  # (nq + nv,): q, v
    mass: np.ndarray  # (nv, nv): factor of M, or of M + s GᵀG
    kept: np.ndarray  # (nv, nv)
    jacobian: np.ndarray  # (m, nv): G
    z: np.ndarray  # (nv, m): from here on see `factor_constraints`
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
    z, work = work[: m * nv].reshape((nv, m)), work[m * nv :]
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
    the last, and how large, jumps with their order.) Close to the branch a factor serves for several steps: what they
    leave is a millionth, over the square of the distance.
    """
    rank, _, volume = factor(context, t, b, p, weights, ON_BRANCH)
    before, first, same, fresh = math.inf, 0.0, True, True
    for _ in range(_MOST_STEPS if context[NH] > 0 else 0):
        size = position_step(context, t, b, p, rank)
        first = max(first, size)
        if size <= _SETTLED * first:
            break
        converges = size <= _CONVERGES * before
        fresh = size > _ROUND_OFF and not (converges and size <= _CHORD)
        if fresh:
            rank, volume, same = _factor_anew(context, t, b, p, weights, rank, volume)
        if size <= _ROUND_OFF or (size > _CHORD and not converges):
            break
        before = size
    if not fresh:
        rank, volume, same = _factor_anew(context, t, b, p, weights, rank, volume)
    velocity_step(context, t, b, p, rank)
    return rank if same else 0


@jitted
def _factor_anew(context, t, b, p, weights, rank, volume):
    """Factor behind a step; returns rank and product of pivots, and whether they are about what they were."""
    now, _, product = factor(context, t, b, p, weights, ON_BRANCH)
    return now, product, now == rank and abs(product - volume) <= _SAME_VOLUME * volume


@jitted
def is_on_branch(context, t, b, p, weights):
    """Whether (q, v) fits the constraints as well as round-off lets it: moving it would add noise, and nothing else.

    Round-off of the positions leaves velocities uncertain by its ratio to the distance from the singular configuration.
    Returns the rank, and leaves the factor behind, at the tolerance ON_BRANCH; 0 where it does not fit.
    """
    nq, nv, nh, m = context[NQ], context[NV], context[NH], context[M]
    if weights.shape[0] == 0 or not fits_positions(context, t, b, p, weights):
        return 0
    rank, ratio, _ = factor(context, t, b, p, weights, ON_BRANCH)
    velocity, speed = 0.0, 0.0
    for i in range(m):
        velocity = max(velocity, abs(b.residual[nh + i]) * b.scale[i])
    for i in range(nv):
        speed += (b.mass[i, i] * b.place[nq + i]) ** 2
    return rank if velocity**2 * ratio <= _ROUND_OFF**2 * speed else 0


@jitted
def fits_positions(context, t, b, p, weights):
    """Whether q fits the constraints as well as round-off lets it; the residual stays in its buffer."""
    scales = weights[context[M] * context[NV] :]
    call_kernel(np.uint64(context[CONSTRAINT_RESIDUAL]), t, b.place, p, b.residual)
    for i in range(context[NH]):
        if not abs(b.residual[i]) * scales[i] <= _ROUND_OFF:
            return False
    return True


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

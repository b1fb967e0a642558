"""What takes over when a model's straight-line solution loses rank; the same code for all models.

Near a configuration where the constraints lose rank, the accelerations that they ask for have a pole just off the
constraints, where the stages of a step lie. There they are taken at the nearest state of the branch that the motion is
on, and so are a smooth function of the state up to the singular configuration itself.

Accelerations so close to a singular configuration that round-off would decide them: interpolated along the branch.

At the distance d from such a configuration, round-off of the positions makes accelerations uncertain by 1e-16/d³. On
the branch itself they are a smooth function of the way along it, through the configuration and beyond. So they are
taken at places before and behind, with the velocity that the state's becomes there, and interpolated. The branch of a
mechanism of one freedom is a curve, which all of a passage has in common: its places are found once, and from there on
accelerations follow from how it bends and from the forces along it, which no pole is in (`curve.py`).
"""

from __future__ import annotations

import math

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.constraints.branch import (
    CONSTRAINT_JACOBIAN,
    CONSTRAINT_RESIDUAL,
    ENERGY,
    FORCES,
    GAMMA,
    MASS_MATRIX,
    NEAR_SINGULAR,
    NH,
    NQ,
    NV,
    NW,
    ON_BRANCH,
    RANK_TOLERANCE,
    RHS,
    TIME_DEPENDENT,
    USUAL_RANK,
    M,
    buffers,
    factor,
    fill,
    fits_positions,
    is_on_branch,
    least_pivot,
    make_unit,
    move_to_branch,
    position_step,
    solve,
    truncated,
    velocity_step,
)
from symgen.runtime.constraints.curve import FARTHEST, INNER_PLACES, PLACES, curve_in, fit, follow
from symgen.runtime.integrate.loop import copy

# Ratios of pivots are (c d)²: at this distance interpolation begins, at the others its nearest place is, at most and at
# least. Round-off falls with the third power of the distance; the error of the interpolation grows with its tenth.
BESIDE = 2e-2
_CLEAREST, _CLEAR, _NEARER = 4e-2, 6e-3, 0.6
_TRIAL = 0.05  # of characteristic sizes: how far c is looked for
_ROUND_OFF = (
    2e-15  # what it makes of accelerations at a distance of 1, in parts of size times speed squared, at most
)
_FARTHEST = 0.1  # of characteristic sizes: the distance between places at most
_SAME_SIDE = 0.1  # by how much a distance may differ from the mean of its neighbours if all lie on one side
_SMOOTH = 1e-9  # of size times speed squared: by how much ten places and the inner eight of them may differ
_SAME_WAY = 0.5  # of the velocity at the centre: what a place of the curve has of it
_ACROSS = 1e-2  # of the kinetic energy: what goes across a curve has another branch
_OFF_CURVE = 1e-3  # of characteristic sizes: states that are as far off are for the branch at large
# Lagrange's, for the middle of ten places, -5 to -1 and 1 to 5, and what is left of it without those of eight places.
_WEIGHTS = (5.0 / 6.0, -10.0 / 21.0, 5.0 / 28.0, -5.0 / 126.0, 1.0 / 252.0)
_OF_EIGHT = (1.0 / 30.0, -8.0 / 105.0, 9.0 / 140.0, -8.0 / 315.0, 1.0 / 252.0)


@jitted
def accelerations_beside(context, t, b, p, weights, rank):
    """Write the accelerations at `b.place`, on the branch, to `b.total`; False where none are found.

    A mechanism that nearly has a change point turns off just before it, in a curve that no interpolation follows: what
    round-off does not explain is not interpolated.

    Parameters
    ----------
    rank : int
        Of the factor, which is that of this place at the tolerance ON_BRANCH.
    """
    nq, nv, m = context[NQ], context[NV], context[M]
    if weights.shape[0] == 0 or context[USUAL_RANK] == 0:
        return False
    copy(b.place, b.centre)
    call_kernel(np.uint64(context[RHS]), t, b.centre, p, b.row)
    copy(b.row[:nq], b.along)
    speed, sizes = 0.0, weights[m * nv + m :]
    for i in range(nv):
        speed = max(speed, abs(b.centre[nq + i]) / sizes[i])
    if not (speed > 0.0 and math.isfinite(speed)):
        return False
    here = math.sqrt(least_pivot(b.lower, rank, b.solver)) if rank == context[USUAL_RANK] else 0.0
    if here > 0.0:
        _accelerations_here(context, t, b, p, rank)
        copy(b.step, b.direct)
    slope = _slope(context, t, b, p, weights, _TRIAL / speed, here)
    if slope <= 0.0:
        return False
    clear = _CLEAREST
    while True:
        narrow = clear * _NEARER < _CLEAR
        spacing = ((_CLEAR if narrow else clear) + here) / slope
        if spacing * speed <= _FARTHEST:
            if _may_have_curve(context, weights):
                difference = _lay_curve(context, t, b, p, weights, spacing)
            else:
                difference = _interpolate(context, t, b, p, weights, spacing)
            if difference <= _SMOOTH * speed**2 or (narrow and math.isfinite(difference)):
                break
        if narrow:
            return False
        clear *= _NEARER
    if here > 0.0:
        explained = _ROUND_OFF * speed**2 / here**3
        for i in range(nv):
            if abs(b.total[i] - b.direct[i]) > explained * sizes[i]:
                copy(b.direct, b.total)
                return True
    if _may_have_curve(context, weights):
        _curve(context, weights).known[0] = 1.0
    return True


@jitted
def _may_have_curve(context, weights):
    """Whether the branch is a curve: `kkt` has seen to an array for one, and there is one freedom."""
    m, nv = context[M], context[NV]
    return context[USUAL_RANK] == nv - 1 and weights.shape[0] > m * nv + m + nv


@jitted
def _curve(context, weights):
    """The curve, of which there may be one."""
    m, nv = context[M], context[NV]
    return curve_in(weights[m * nv + m + nv :], nv)


@jitted
def _lay_curve(context, t, b, p, weights, spacing):
    """Lay the curve through places `spacing` [s] apart, and write accelerations at the centre to `b.total`.

    Returns
    -------
    float
        As `_interpolate` of the inner places.
    """
    nq, m, curve = context[NQ], context[M], _curve(context, weights)
    sizes, square = weights[m * nq + m :], 0.0
    curve.known[0] = 0.0
    copy(b.centre[:nq], curve.centre)
    copy(b.centre[nq:], b.along)  # another spacing has left its tangent there
    for i in range(nq):
        curve.functional[i] = b.along[i] / sizes[i] ** 2
        square += b.along[i] * curve.functional[i]
    for i in range(nq):
        curve.functional[i] /= square * spacing
    for k in range(PLACES):
        shift = (1.0 if k % 2 else -1.0) * (k // 2 + 1) * spacing
        if not _moved_along(context, t, b, p, weights, shift):
            return math.inf
        rank, _, _ = factor(context, t, b, p, weights, ON_BRANCH)  # that may be a step older
        velocity_step(context, t, b, p, rank)
        if k < 2:  # the places next to the configuration, on either side
            curve.root[k] = math.sqrt(least_pivot(b.lower, rank, b.solver))
        x, rate = 0.0, 0.0
        for i in range(nq):
            x += curve.functional[i] * (b.place[i] - curve.centre[i])
            rate += curve.functional[i] * b.place[nq + i]
        if not rate * spacing > _SAME_WAY:
            return math.inf
        curve.nodes[2 * k] = curve.nodes[2 * k + 1] = x
        for i in range(nq):
            curve.coefficients[2 * k, i] = b.place[i] - curve.centre[i]
            curve.coefficients[2 * k + 1, i] = b.place[nq + i] / rate
    fit(curve)
    behind = -curve.root[0]
    curve.root[1] = (curve.root[1] - behind) / (curve.nodes[2] - curve.nodes[0])
    curve.root[0] = behind - curve.root[1] * curve.nodes[0]
    follow(curve, INNER_PLACES, 0.0, b.moved[:nq], b.along, b.eight)
    copy(b.centre, b.place)
    follow(curve, PLACES, 0.0, b.moved[:nq], b.along, b.total)
    difference = 0.0
    for i in range(nq):
        difference = max(difference, abs(b.total[i] - b.eight[i]) / sizes[i])
    _bend_along(context, t, b, p, 1.0 / spacing)
    return difference / spacing**2


@jitted
def _bend_along(context, t, b, p, rate):
    """Replace d²q/dx² in `b.total` by accelerations at `b.place`, with the tangent in `b.along` and dx/dt.

    Of M a = f + Gᵀλ the part along the tangent, which constraints do not act on: they change the rate alone.
    """
    n, mass = context[NV], b.mass
    flat = mass.reshape(n * n)
    fill(flat, 0.0)
    fill(b.forces, 0.0)
    call_kernel(np.uint64(context[MASS_MATRIX]), t, b.place, p, flat)
    call_kernel(np.uint64(context[FORCES]), t, b.place, p, b.forces)
    inertia, force = 0.0, 0.0
    for i in range(n):
        moved = bent = 0.0
        for j in range(n):
            moved += mass[i, j] * b.along[j]
            bent += mass[i, j] * b.total[j]
        inertia += b.along[i] * moved
        force += b.along[i] * (b.forces[i] - rate**2 * bent)
    change = force / inertia
    for i in range(n):
        b.total[i] = b.total[i] * rate**2 + b.along[i] * change


@jitted
def _move_to_curve(context, t, b, p, weights):
    """Bring (q, v) to the nearest place of a curve that is known, in the metric of M; returns dx/dt.

    The tangent is then in `b.along`, the second derivative in `b.total`. Not a number where the state is not near to
    the curve, or does not go along it.
    """
    n, curve, mass = context[NV], _curve(context, weights), b.mass
    q, v, flat = b.moved[:n], b.place[n:], mass.reshape(n * n)
    sizes = weights[context[M] * n + context[M] :]
    x = 0.0
    for i in range(n):
        x += curve.functional[i] * (b.place[i] - curve.centre[i])
    if not abs(x) <= FARTHEST:
        return math.nan
    follow(curve, PLACES, x, q, b.along, b.total)
    fill(flat, 0.0)
    call_kernel(np.uint64(context[MASS_MATRIX]), t, b.moved, p, flat)
    inertia = beside = momentum = energy = 0.0
    for i in range(n):
        moved = rate = 0.0
        for j in range(n):
            moved += mass[i, j] * b.along[j]
            rate += mass[i, j] * v[j]
        inertia += b.along[i] * moved
        beside += moved * (b.place[i] - q[i])
        momentum += moved * v[i]
        energy += rate * v[i]
    rate = momentum / inertia
    if not energy - rate * momentum <= _ACROSS * energy:
        return math.nan
    follow(curve, PLACES, x + beside / inertia, q, b.along, b.total)
    for i in range(n):
        if not abs(b.place[i] - q[i]) <= _OFF_CURVE * sizes[i]:
            return math.nan
    for i in range(n):
        b.place[i], v[i] = q[i], rate * b.along[i]
    return rate if fits_positions(context, t, b, p, weights) else math.nan


@jitted
def _follow_curve(context, t, b, p, weights):
    """Move to a curve that is known, and write accelerations there to `b.total`; whether there is one, and near."""
    if not _may_have_curve(context, weights) or _curve(context, weights).known[0] != 1.0:
        return False
    rate = _move_to_curve(context, t, b, p, weights)
    if not math.isfinite(rate):
        return False
    _bend_along(context, t, b, p, rate)
    return True


@jitted
def _write_along(context, t, b, p, weights, out):
    """Write what `_follow_curve` has found to a row, with multipliers and pivot ratio; whether no factor is needed.

    That has left M and the forces, too. Straight-line code has no pole there, as nothing is off
    the constraints; whether its multipliers are right, M a = f + Gᵀλ tells.
    """
    nq, nv, m, curve = context[NQ], context[NV], context[M], _curve(context, weights)
    n, ny, size, left = nq + nv, nq + nv + context[NW], 0.0, 0.0
    root = curve.root[0]
    for i in range(nq):
        root += curve.root[1] * curve.functional[i] * (b.place[i] - curve.centre[i])
    if not (m == context[USUAL_RANK] and root**2 > _FAR_ENOUGH * _LEAST_PIVOT):
        return False
    jacobian = b.jacobian.reshape(m * nv)
    fill(jacobian, 0.0)
    call_kernel(np.uint64(context[RHS]), t, b.place, p, b.row)
    call_kernel(np.uint64(context[CONSTRAINT_JACOBIAN]), t, b.place, p, jacobian)
    multipliers = b.row[ny : ny + m]
    for i in range(nv):
        b.step[i], b.direct[i] = -b.forces[i], abs(b.forces[i])
        for j in range(nv):
            b.step[i] += b.mass[i, j] * b.total[j]
    for k in range(m):
        value = multipliers[k]
        for i in range(nv):
            term = b.jacobian[k, i] * value
            b.step[i] -= term
            b.direct[i] += abs(term)
    for i in range(nv):
        size, left = max(size, b.direct[i]), max(left, abs(b.step[i]))
    if not (left <= _BALANCED * size and math.isfinite(size)):
        return False
    copy(b.total, out[nq:n])
    copy(multipliers, out[ny : ny + m])
    out[ny + m] = root**2
    return True


@jitted
def _interpolate(context, t, b, p, weights, spacing):
    """Write the accelerations interpolated between ten places, `spacing` [s] apart, to `b.total`.

    Returns
    -------
    float
        By how much the inner eight places alone would give another result, at most, in parts of characteristic sizes;
        infinite where the branch is lost.
    """
    nv, sizes = context[NV], weights[context[M] * context[NV] + context[M] :]
    fill(b.total, 0.0)
    fill(b.eight, 0.0)
    for k, weight in enumerate(_WEIGHTS):
        for shift in ((k + 1) * spacing, -(k + 1) * spacing):
            if not _accelerations_at(context, t, b, p, weights, shift):
                return math.inf
            for i in range(nv):
                b.total[i] += weight * b.step[i]
                b.eight[i] += _OF_EIGHT[k] * b.step[i]
    difference = 0.0
    for i in range(nv):
        difference = max(difference, abs(b.eight[i]) / sizes[i])
    return difference


@jitted
def _slope(context, t, b, p, weights, trial, here):
    """Return how fast the motion leaves the configuration behind [distance a second]; 0 where that is not seen."""
    rank = context[USUAL_RANK]
    ahead = behind = 0.0
    if _moved_along(context, t, b, p, weights, trial):
        ahead = math.sqrt(least_pivot(b.lower, rank, b.solver))
    if _moved_along(context, t, b, p, weights, -trial):
        behind = math.sqrt(least_pivot(b.lower, rank, b.solver))
    if not (ahead > 0.0 and behind > 0.0):
        return 0.0
    mean = 0.5 * (ahead + behind)
    return (0.5 * abs(ahead - behind) if abs(mean - here) <= _SAME_SIDE * mean else mean) / trial


@jitted
def _accelerations_at(context, t, b, p, weights, shift):
    """Write the accelerations `shift` [s] from the centre to `b.step`; False where the branch or the rank is lost."""
    rank = _moved_along(context, t, b, p, weights, shift)
    if rank == 0:
        return False
    _accelerations_here(context, t + shift, b, p, rank)
    return True


@jitted
def _moved_along(context, t, b, p, weights, shift):
    """Move to the place `shift` [s] from the centre; returns the rank, 0 where that or the branch is lost."""
    nq = context[NQ]
    copy(b.centre, b.place)
    for i in range(nq):
        b.place[i] += shift * b.along[i]
    make_unit(context, b.place)
    rank = move_to_branch(context, t + shift, b, p, weights)
    return rank if rank >= context[USUAL_RANK] else 0


@jitted
def _accelerations_here(context, t, b, p, rank):
    """Write the accelerations at `b.place` to `b.step`, with the factor as it is."""
    call_kernel(np.uint64(context[FORCES]), t, b.place, p, b.forces)
    call_kernel(np.uint64(context[GAMMA]), t, b.place, p, b.target)
    solve(b, rank)


# Of the first pivot. Closer to a singular configuration the constraint is left out of accelerations that are not
# interpolated: what is missing in them lies across the branch, and goes when the next state is moved to it.
_LEAST_PIVOT = 1e-8
_FAR_ENOUGH = 4.0  # times that: all constraints count, for certain
_BALANCED = 1e-11  # of the largest forces: what accelerations and multipliers may leave of them


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
    weights : ndarray, shape (m * nv + m + nv,), (m * nv + m + nv + curve_size(nq),) or empty
        By which the squares of a row of G sum up to its size, then the scales of residuals, then characteristic sizes;
        see `row_weights.py`. Where the branch may be a curve, that is behind them, see `curve.py`.
    order : ndarray of int64, shape (m,)
        A buffer.
    work : ndarray, shape (work_size(...),)
        A buffer.
    """
    n, nw = context[NQ] + context[NV], context[NW]
    b = buffers(context, order, work)
    copy(y[:n], b.place)
    is_along = _follow_curve(context, t, b, p, weights)
    if not (is_along and _write_along(context, t, b, p, weights, out)):
        if not is_along:
            copy(y[:n], b.place)
        _write_by_factors(context, t, b, p, weights, out, is_along)
    if nw and (context[TIME_DEPENDENT] or not math.isfinite(out[n])):
        out[n] = _power(context, t, y, p, out, b)


@jitted
def _write_by_factors(context, t, b, p, weights, out, is_along):
    """Write accelerations, multipliers and pivot ratio at `b.place` to a row.

    Parameters
    ----------
    is_along : bool
        Whether that is a place of a curve, with the accelerations in `b.total`.
    """
    nq, nv, m, ny = context[NQ], context[NV], context[M], context[NQ] + context[NV] + context[NW]
    rank, on_branch, ratio, beside = 0, 0, 0.0, False
    copy(b.place, b.centre)
    if is_along:
        on_branch, _, _ = factor(context, t, b, p, weights, ON_BRANCH)
        rank, ratio = truncated(b.lower, on_branch, _LEAST_PIVOT)
    elif context[NEAR_SINGULAR] == 0:
        rank, ratio, _ = factor(context, t, b, p, weights, RANK_TOLERANCE)
    if rank < m and not is_along:
        on_branch = is_on_branch(context, t, b, p, weights) or move_to_branch(context, t, b, p, weights)
        if on_branch > 0:
            rank, ratio = truncated(b.lower, on_branch, _LEAST_PIVOT)
            beside = rank < context[USUAL_RANK] or ratio < BESIDE**2
        else:
            copy(b.centre, b.place)
            rank, ratio, _ = factor(context, t, b, p, weights, RANK_TOLERANCE)
    call_kernel(np.uint64(context[FORCES]), t, b.place, p, b.forces)
    call_kernel(np.uint64(context[GAMMA]), t, b.place, p, b.target)
    solve(b, rank)
    copy(b.step, out[nq : nq + nv])
    copy(b.multipliers, out[ny : ny + m])
    out[ny + m] = ratio if rank == m else 0.0
    if is_along or (beside and accelerations_beside(context, t, b, p, weights, on_branch)):
        copy(b.total, out[nq : nq + nv])


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

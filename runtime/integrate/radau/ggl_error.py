"""The error of a step of a Radau method for index-2 equations: that of positions and rates."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.evaluation import evaluate
from symgen.runtime.integrate.ggl import divide_blocks, half_rotated, recover
from symgen.runtime.integrate.linear import lu_solve
from symgen.runtime.integrate.quaternions import chart_rate, n_quaternions, quaternion_at, retract
from symgen.runtime.integrate.radau.error import weighted
from symgen.runtime.integrate.radau.ggl_rotations import rotate_entries
from symgen.runtime.integrate.radau.work import ERROR, F_NEW, HAVE_HISTORY, SCALE, STAGES, Y_STAGE


@jitted
def estimate_index2(method, h, loop, t, w):
    """Return the estimated error of the step in units of the tolerance.

    The estimate is that of `estimate_error`, filtered by the Newton matrix with its constraints, as radau5.f does for
    implicit systems: so it satisfies them. λ and μ, whose index is 2, have no part in it: multipliers of results come
    from positions and rates.
    """
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    error = filter_index2(method, h, loop.sizes, loop.y, loop.f, False, w)
    if error >= 1.0 and (loop.counters[at.LAST_REJECTED] or not loop.counters[HAVE_HISTORY]):
        retract(loop.sizes, loop.y, 1.0, w.pairs[ERROR], 0, w.states[Y_STAGE])
        for i in range(nv):
            w.states[Y_STAGE, nq + i] = loop.y[nq + i] + w.pairs[ERROR, nv + i]
        rotate_all(-1.0, loop.sizes, w.pairs[ERROR], w.states[Y_STAGE])
        if not evaluate(loop, t, w.states[Y_STAGE], w.rows[F_NEW]):
            return math.inf
        rotate_all(1.0, loop.sizes, w.pairs[ERROR], w.rows[F_NEW])
        error = filter_index2(method, h, loop.sizes, loop.y, w.rows[F_NEW], True, w)
    return max(error, 1e-10) if math.isfinite(error) else error


@jitted
def filter_index2(method, h, sizes, y, row, again, w):
    """Write the filtered error to `w.pairs[ERROR]`; `again`: it is there already, and `row` belongs to y + error.

    With s₁, s₂ the defects of positions and rates, which take the place of 0 and -r₂ in the module `ggl`:
    Δv = Δu - C Δμ - s₁ and Δμ = H Δu / g - G s₁.
    """
    nq, nv, m, nh = sizes[at.NQ], sizes[at.NV], sizes[at.NM], sizes[at.NH]
    b = divide_blocks(sizes, w.blocks)
    g = method.mu / h
    x = w.real_vector
    slip, pushed = w.residuals[0], w.residuals[1]
    for i in range(nv):
        # v0 + eᵀZ_q / h, in which v0 cancels.
        total = w.pairs[ERROR, nv + i] if again else 0.0
        for s in range(len(method.c)):
            rate = w.states[STAGES + s, nq + i]
            for k in range(nh):
                rate += b.steer[i, k] * w.multipliers[s, m + k]
            total += method.error_a[s] * rate
        slip[i] = total
        pushed[i] = row[nq + i] + weighted(method, method.error, nq + i, w) / h
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        slip_of_rotation(method, h, i, i - k, nq + i - k, nv, y, again, slip, w)
        along = half_rotated(i - k, b.spin, slip)
        for axis in range(3):
            pushed[i - k + axis] -= along[axis]  # by_rates has M W in it
    for k in range(m):
        total = 0.0
        for j in range(nv):
            total += b.gradients[k, j] * slip[j]
        x[nv + k] = 0.0 if k < nh else total
        if k < nh:
            x[nv + m + k] = -total
    for i in range(nv):
        total = 0.0
        for j in range(nv):
            total += b.mass[i, j] * (pushed[j] + g * slip[j]) + b.by_rates[i, j] * slip[j]
        for k in range(nh):
            total += b.damped[i, k] * x[nv + m + k]
        x[i] = total
    lu_solve(w.real, w.pivots[0], x[: nv + m])
    for i in range(nv):
        w.pairs[ERROR, i] = x[i] / g
    recover(g, sizes, b, x)
    total = 0.0
    for i in range(nv):
        w.pairs[ERROR, nv + i] = x[i] - slip[i]
    for i in range(2 * nv):
        total += (w.pairs[ERROR, i] / w.pairs[SCALE, i]) ** 2
    return math.sqrt(total / (2 * nv))


@jitted
def rotate_all(sense, sizes, error, x):
    """Turn angular velocities of a state, or their derivatives in an rhs row, by `sense` times errors of rotation."""
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        rotate_entries(sense, error, j, x, sizes[at.NQ] + j)


@jitted
def slip_of_rotation(method, h, i, column, first, nv, y, again, slip, w):
    """Write the defect of the rotation vector at `i`, whose angular velocity is at `first`, from `column` on."""
    error, j = w.pairs[ERROR], nv + column
    x, y_, z = y[first], y[first + 1], y[first + 2]
    if again:
        u, v, w_ = x + error[j], y_ + error[j + 1], z + error[j + 2]
        x, y_, z = chart_rate(-error[column], -error[column + 1], -error[column + 2], u, v, w_)
    slip[column] = x + weighted(method, method.error, i, w) / h
    slip[column + 1] = y_ + weighted(method, method.error, i + 1, w) / h
    slip[column + 2] = z + weighted(method, method.error, i + 2, w) / h

"""The stabilised index-2 equations of Gear, Gupta and Leimkuhler for the Radau methods: systems of v and λ."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_step, needs_dense
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.ggl import (
    divide_blocks,
    equation_residuals,
    half_rotated,
    recover,
    set_blocks,
    set_shifted,
    solve_shifted,
)
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.quaternions import chart_rate, n_quaternions, quaternion_at
from symgen.runtime.integrate.radau.error import norm_of_error, weighted
from symgen.runtime.integrate.radau.ggl_dense_output import (
    fit_rotations,
    keep_rotation_polynomials,
    predict_rotations_index2,
    sample_rotations,
)
from symgen.runtime.integrate.radau.ggl_rotations import (
    KEEP_ROTATION,
    largest_rotation,
    reset_rotations,
    rotate_blocks,
    rotate_entries,
    solve_rotations_index2,
    to_body_axes,
    to_start_axes,
)
from symgen.runtime.integrate.radau.newton import Equations
from symgen.runtime.integrate.radau.rotation_increments import place
from symgen.runtime.integrate.radau.stages import (
    evaluate_stage,
    integrate_work,
    place_end,
    predict_rates,
    radau_dense,
)
from symgen.runtime.integrate.radau.transform import shift_of
from symgen.runtime.integrate.radau.work import (
    ERROR,
    F_NEW,
    F_STAGES,
    HAVE_JACOBIAN,
    SCALE,
    STAGES,
    Y_NEW,
    Y_STAGE,
)


@jitted
def differentiate_index2(method, loop, t, w):
    """Take the derivatives of the equations, those by rates in the axes of the start of the step; returns a status."""
    b = divide_blocks(loop.sizes, w.blocks)
    status = set_blocks(loop, t, loop.y, loop.f, w.implicit, b)
    if status == at.RUNNING:
        rotate_blocks(loop.sizes, loop.y, loop.f, b)
    return status


@jitted
def factor_index2(method, h, loop, w):
    """Factor the real and the complex Newton matrices for a step of length `h`; returns a status."""
    b = divide_blocks(loop.sizes, w.blocks)
    set_shifted(method.mu / h, loop.sizes[at.NH], b, w.real)
    status = lu_factor(w.real, w.pivots[0])
    for k in range(len(method.c) // 2):
        if status == at.RUNNING:
            set_shifted(shift_of(method, k, 1.0 / h), loop.sizes[at.NH], b, w.complex[k])
            status = lu_factor(w.complex[k], w.pivots[k + 1])
    return status


@jitted
def predict_index2(method, h, extrapolate, loop, t0, w):
    """Start Newton as `predict_stages` does, with the multipliers that the accelerations of that motion take.

    Those of the start of the step would do for convergence, but their first correction would dwarf that of the rates,
    which says nothing of the rate of contraction then.

    Returns
    -------
    bool
        Whether all is finite.
    """
    first = loop.sizes[at.NQ] + loop.sizes[at.NV] + loop.sizes[at.NW]
    predict_rates(method, h, extrapolate, loop, w)
    predict_rotations_index2(method, h, extrapolate, loop, w)
    for s in range(len(method.c)):
        for k in range(loop.sizes[at.NM], loop.sizes[at.NM] + loop.sizes[at.NH]):
            w.multipliers[s, k] = 0.0
    reset_rotations(method, loop.sizes, w)
    if not retract_index2(method, h, loop.sizes, loop.y, w):
        return False
    to_body_axes(loop.sizes, loop.y, w)
    for s in range(len(method.c)):
        if not evaluate_stage(s, method, h, loop, t0, w):
            return False
        for k in range(loop.sizes[at.NM]):
            w.multipliers[s, k] = w.rows[F_STAGES + s, first + k]
    to_start_axes(loop.sizes, loop.y, w)
    return True


@jitted
def retract_index2(method, h, sizes, y, w):
    """Set the stages' increments of q to the integral of v + C μ; returns whether quaternions could be turned by it."""
    nq, n = sizes[at.NQ], len(method.c)
    b = divide_blocks(sizes, w.blocks)
    for s in range(n):
        steer(b, w.states[STAGES + s, nq:], w.multipliers[s, sizes[at.NM] :], w.steered[s])
    settled, start = True, 0
    if nq == sizes[at.NV]:  # loops from 0 need no checks of their indexes
        for i in range(nq):
            travel_index2(method, h, i, i, nq, y, w)
        return True
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            travel_index2(method, h, i, i - k, nq, y, w)
        if end < nq:
            settled = solve_rotations_index2(method, h, end, end - k, sizes, y, w) and settled
        start = end + 4
    return settled


@jitted
def travel_index2(method, h, i, j, nq, y, w):
    """Set the stages' increments of coordinate `i` to the integral of its rate `j`."""
    n = len(method.c)
    for s in range(n):
        total = method.c[s] * y[nq + j]
        for r in range(n):
            total += method.a[s, r] * w.steered[r, j]
        w.states[STAGES + s, i] = h * total


@jitted
def steer(b, rates, multipliers, out):
    """Write `rates` + C `multipliers` to `out`."""
    for i in range(out.shape[0]):
        total = rates[i]
        for k in range(b.steer.shape[1]):
            total += b.steer[i, k] * multipliers[k]
        out[i] = total


@jitted
def improve_index2(method, h, loop, t, w):
    """Correct the stages once; returns a status and the size of the correction in tolerances."""
    for s in range(len(method.c)):
        stage_residuals(s, method, h, loop, t, w)
    correct_residuals(method, h, loop.sizes, w)
    size = correct_index2(method, h, loop.sizes, w)
    if not math.isfinite(size):
        return at.NOT_FINITE, size
    if not retract_index2(method, h, loop.sizes, loop.y, w):
        return at.NEWTON_FAILED, size
    return at.RUNNING, size


@jitted
def stage_residuals(s, method, h, loop, t0, w):
    """Write the residuals of stage `s`, with the accelerations that the stages' rates say."""
    nq, nv, stage = loop.sizes[at.NQ], loop.sizes[at.NV], w.states[STAGES + s]
    place(loop.sizes, loop.y, stage, w.states[Y_STAGE])
    for i in range(nv):
        total = 0.0
        for r in range(len(method.c)):
            total += method.a_inverse[s, r] * w.states[STAGES + r, nq + i]
        w.arguments[nq + nv + i] = total / h
    for k in range(loop.sizes[at.NM]):
        w.arguments[nq + 2 * nv + k] = w.multipliers[s, k]
    for k in range(n_quaternions(loop.sizes)):
        i = quaternion_at(loop.sizes, k)
        rotate_entries(-1.0, stage, i, w.states[Y_STAGE], nq + i - k)
        rotate_entries(-1.0, stage, i, w.arguments, nq + nv + i - k)
    t = t0 + method.c[s] * h
    equation_residuals(loop, t, w.states[Y_STAGE], w.arguments, w.equations, w.residuals[s])
    for k in range(n_quaternions(loop.sizes)):
        i = quaternion_at(loop.sizes, k)
        rotate_entries(1.0, stage, i, w.residuals[s], i - k)


@jitted
def correct_residuals(method, h, sizes, w):
    """Replace the residuals of the stages by corrections of their rates and multipliers."""
    n = len(method.c)
    b = divide_blocks(sizes, w.blocks)
    forth, back = method.from_stages, method.to_stages
    for i in range(w.residuals.shape[1]):
        total = 0.0
        for s in range(n):
            total += forth[0, s] * w.residuals[s, i]
        w.real_vector[i] = total
        for k in range(n // 2):
            real, imag = 0.0, 0.0
            for s in range(n):
                real += forth[2 * k + 1, s] * w.residuals[s, i]
                imag += forth[2 * k + 2, s] * w.residuals[s, i]
            w.complex_vectors[k, i] = complex(real, imag)
    solve_shifted(method.mu / h, sizes, b, w.real, w.pivots[0], w.real_vector)
    for k in range(n // 2):
        g = shift_of(method, k, 1.0 / h)
        solve_shifted(g, sizes, b, w.complex[k], w.pivots[k + 1], w.complex_vectors[k])
    for i in range(w.residuals.shape[1]):
        for s in range(n):
            total = back[s, 0] * w.real_vector[i]
            for k in range(n // 2):
                x = w.complex_vectors[k, i]
                total += back[s, 2 * k + 1] * x.real + back[s, 2 * k + 2] * x.imag
            w.residuals[s, i] = total


@jitted
def correct_index2(method, h, sizes, w):
    """Add the corrections; returns the size of those of positions and rates in tolerances.

    Multipliers have no part in it: they follow from the rates, and what is left of them is gone in the next iteration.
    """
    nq, nv, n = sizes[at.NQ], sizes[at.NV], len(method.c)
    b = divide_blocks(sizes, w.blocks)
    total = 0.0
    for s in range(n):
        change = w.residuals[s]
        for k in range(sizes[at.NM] + sizes[at.NH]):
            w.multipliers[s, k] += change[nv + k]
        for i in range(nv):
            w.states[STAGES + s, nq + i] += change[i]
            total += (change[i] / w.pairs[SCALE, nv + i]) ** 2
        steer(b, change, change[nv + sizes[at.NM] :], w.steered[s])
    for i in range(nv):
        for s in range(n):
            moved = 0.0
            for r in range(n):
                moved += method.a[s, r] * w.steered[r, i]
            total += (h * moved / w.pairs[SCALE, i]) ** 2
    return math.sqrt(total / (2 * nv * n))


@jitted
def filter_index2(method, h, loop, row, again, w):
    """Write the filtered error to `w.pairs[ERROR]` and return its norm.

    The estimate is that of all Radau methods, filtered by the Newton matrix with its constraints, as radau5.f does for
    implicit systems: so it satisfies them. λ and μ, whose index is 2, have no part in it: multipliers of results come
    from positions and rates.
    With s₁, s₂ the defects of positions and rates, which take the place of 0 and -r₂ in the module `ggl`:
    Δv = Δu - C Δμ - s₁ and Δμ = H Δu / g - G s₁.
    """
    sizes = loop.sizes
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
        slip_of_rotation(method, h, k, loop, again, slip, w)
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
    for i in range(nv):
        w.pairs[ERROR, nv + i] = x[i] - slip[i]
    return norm_of_error(w)


@jitted
def rotate_all(sense, sizes, error, x):
    """Turn angular velocities of a state, or their derivatives in an rhs row, by `sense` times errors of rotation."""
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        rotate_entries(sense, error, j, x, sizes[at.NQ] + j)


@jitted
def slip_of_rotation(method, h, k, loop, again, slip, w):
    """Write the defect of the rotation vector of quaternion `k` to its place in `slip`."""
    sizes, y, error = loop.sizes, loop.y, w.pairs[ERROR]
    i = quaternion_at(sizes, k)
    column = i - k
    first, j = sizes[at.NQ] + column, sizes[at.NV] + column
    x, y_, z = y[first], y[first + 1], y[first + 2]
    if again:
        u, v, w_ = x + error[j], y_ + error[j + 1], z + error[j + 2]
        x, y_, z = chart_rate(-error[column], -error[column + 1], -error[column + 2], u, v, w_)
    slip[column] = x + weighted(method, method.error, i, w) / h
    slip[column + 1] = y_ + weighted(method, method.error, i + 1, w) / h
    slip[column + 2] = z + weighted(method, method.error, i + 2, w) / h


@jitted
def n_places_index2(method, loop):
    """Return how many places dense output of quaternions goes through, see `sample_rotations`."""
    return loop.dense.shape[0]


@jitted
def reach_end_index2(method, h, loop, t, t1, w):
    """Write the new state, on the constraints, and its rhs row; returns why not, or RUNNING."""
    to_body_axes(loop.sizes, loop.y, w)
    if not integrate_work(method, h, loop, t, w):
        return at.NOT_FINITE
    status = place_end(method, loop, t1, w)
    if status == at.RUNNING:
        ratio = w.rows[F_NEW, loop.sizes[at.N_ROW] - 1]
        loop.control[at.MIN_PIVOT_RATIO] = min(loop.control[at.MIN_PIVOT_RATIO], ratio)
    return status


@jitted
def commit_index2(method, loop, t, t1, w):
    """Make the new state the current one, with dense output, and record the step."""
    if largest_rotation(loop.sizes, w) > KEEP_ROTATION:
        loop.counters[HAVE_JACOBIAN] = 0
    keep_rotation_polynomials(method, loop.sizes, loop.y, w)
    n_terms, rotated_is_read = len(method.c) + 1, False
    if loop.sizes[at.NQ] > loop.sizes[at.NV] and needs_dense(loop, t1):
        n_terms, rotated_is_read = loop.dense.shape[0], True
        sample_rotations(method, loop.sizes, loop.y, w)
    radau_dense(method, loop.sizes, loop.y, w, loop.dense)
    if rotated_is_read:
        fit_rotations(method, loop.sizes, w, loop.dense)
    copy(w.states[Y_NEW], loop.y)
    copy(w.rows[F_NEW], loop.f)
    return finish_step(loop, t, t1, loop.dense, n_terms, w.scratch)


INDEX2 = Equations(
    differentiate_index2, factor_index2, predict_index2, improve_index2, filter_index2, rotate_all,
    n_places_index2, reach_end_index2, commit_index2,
)  # fmt: skip

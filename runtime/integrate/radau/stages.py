"""The stages of the Radau methods in transformed variables, reduced to the size of v: their start, corrections, end."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_step
from symgen.runtime.integrate.loop import all_finite, copy, evaluate
from symgen.runtime.integrate.projection import count_energy, project_state, projection_size, scale_energy
from symgen.runtime.integrate.quaternions import (
    chart_rate,
    n_quaternions,
    quaternion_at,
    rotate,
    solve_rotation,
)
from symgen.runtime.integrate.radau.work import (
    DX,
    F_NEW,
    F_STAGES,
    SCALE,
    STAGES,
    Y_NEW,
    Y_STAGE,
    add_correction,
    restore_stages,
    set_defect,
    shift_of,
    transform_stages,
)


@jitted
def place(sizes, y, increments, out):
    """Write the state that is `increments` away from `y`: rotation vectors turn quaternions, the rest is added."""
    for i in range(sizes[at.NY]):
        out[i] = y[i] + increments[i]
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        rotate(y, i, increments[i], increments[i + 1], increments[i + 2], out)


@jitted
def rotations_to_increments(sizes, y, increments):
    """Replace rotation vectors by the increments of the quaternions that they turn."""
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        rotate(y, i, increments[i], increments[i + 1], increments[i + 2], increments)
        for j in range(i, i + 4):
            increments[j] -= y[j]


@jitted
def error_between_places(n_places, sizes, w):
    """Return by how much dense output through so many places is off quaternions, in units of their tolerance.

    While a body spins evenly, rotation vectors are straight lines, however far it turns in a step; but its quaternion
    is cos and sin of half the angle φ. A polynomial through n places is off these by up to 2 (φ/8)^n / n! (those of
    Chebyshev, for which this holds, are the best).
    """
    z, largest = w.states[STAGES + w.rotation_rates.shape[0] - 1], 0.0
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        part = 0.125 * math.sqrt(z[i] * z[i] + z[i + 1] * z[i + 1] + z[i + 2] * z[i + 2])
        error = 2.0
        for j in range(n_places):
            error *= part / (j + 1.0)
        largest = max(largest, error / w.pairs[SCALE, i - k])
    return largest


@jitted
def set_rotation_rates(method, i, first, y, w):
    """Write the derivatives of the stages' rotation vectors, at `i`; the angular velocity is at `first`."""
    for s in range(len(method.c)):
        z = w.states[STAGES + s]
        u, v, w_ = y[first] + z[first], y[first + 1] + z[first + 1], y[first + 2] + z[first + 2]
        w.rotation_rates[s, 0], w.rotation_rates[s, 1], w.rotation_rates[s, 2] = chart_rate(
            z[i], z[i + 1], z[i + 2], u, v, w_
        )


@jitted
def predict_rotations(method, h, i, column, first, y, w):
    """Guess the stages' rotation vectors at `i` from their angular velocities, by sweeps of their equations."""
    n = len(method.c)
    for s in range(n):
        for j in range(i, i + 3):
            w.states[STAGES + s, j] = 0.0
    for _ in range(n):  # each sweep gains one order of h
        set_rotation_rates(method, i, first, y, w)
        for s in range(n):
            for axis in range(3):
                total = 0.0
                for j in range(n):
                    total += method.a[s, j] * w.rotation_rates[j, axis]
                w.states[STAGES + s, i + axis] = h * total
    for axis in range(3):
        transform_stages(method, i + axis, column + axis, w)


@jitted
def factor_rotations(g, j, y, first, jacobian, matrix):
    """Make the columns from `j` on, of the rates of a quaternion, which are in `y` from `first`."""
    a, b, c = -y[first], -y[first + 1], -y[first + 2]
    for i in range(matrix.shape[0]):
        u, v, w = jacobian[i, j], jacobian[i, j + 1], jacobian[i, j + 2]
        # A row times the inverse of a matrix: the inverse of its transpose, which turns the other way.
        x, y_, z = solve_rotation(g, a, b, c, u, v, w)
        matrix[i, j] += u / g - x
        matrix[i, j + 1] += v / g - y_
        matrix[i, j + 2] += w / g - z


@jitted
def set_rotation_defect(method, per_h, i, column, first, y, w):
    """Set the transformed defects of a quaternion's rotation vector, solved for it."""
    set_rotation_rates(method, i, first, y, w)
    for axis in range(3):
        set_defect(method, per_h, w.rotation_rates, 0, axis, column + axis, w)
    solve_rotations(method.mu * per_h, column, first, y, w.real_vectors[DX])
    n_pairs = len(method.c) // 2
    for k in range(n_pairs):
        solve_rotations(shift_of(method, k, per_h), column, first, y, w.complex_vectors[n_pairs + k])


@jitted
def solve_rotations(g, i, first, y, vector):
    """Multiply the three entries of `vector` from `i` on by (g - K)⁻¹, see `solve_rotation`."""
    vector[i], vector[i + 1], vector[i + 2] = solve_rotation(
        g, y[first], y[first + 1], y[first + 2], vector[i], vector[i + 1], vector[i + 2]
    )


@jitted
def add_rotation(g, column, j, first, y, vector):
    """Add (g - K)⁻¹ times the three entries of `vector` from `j` on to those from `column` on."""
    x, y_, z = solve_rotation(
        g, y[first], y[first + 1], y[first + 2], vector[j], vector[j + 1], vector[j + 2]
    )
    vector[column] += x
    vector[column + 1] += y_
    vector[column + 2] += z


@jitted
def correct_rotations(method, per_h, sizes, column, first, y, w):
    """Correct a quaternion's transformed rotation vectors after the rates; returns the squares, in tolerances."""
    j, n_pairs = sizes[at.NV] + column, len(method.c) // 2
    add_rotation(method.mu * per_h, column, j, first, y, w.real_vectors[DX])
    for k in range(n_pairs):
        add_rotation(shift_of(method, k, per_h), column, j, first, y, w.complex_vectors[n_pairs + k])
    total = 0.0
    for i in range(column, column + 3):
        total += add_correction(method, i, w) / w.pairs[SCALE, i] ** 2
    return total


@jitted
def predict_stages(method, h, extrapolate, loop, t, w):
    """Start Newton from the last step's collocation polynomial, or from zero increments of v; returns True."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    predict_rates(method, h, extrapolate, loop, w)
    for i in range(nv):
        transform_stages(method, nq + i, nv + i, w)
    retract_positions(method, h, loop.sizes, loop.y, w)
    for k in range(n_quaternions(loop.sizes)):
        i = quaternion_at(loop.sizes, k)
        predict_rotations(method, h, i, i - k, nq + i - k, loop.y, w)
    return True


@jitted
def predict_rates(method, h, extrapolate, loop, w):
    """Set the stages' increments of v to those of the last step's collocation polynomial, or to zero."""
    nq, nv, n = loop.sizes[at.NQ], loop.sizes[at.NV], len(method.c)
    for s in range(n):
        theta = 1.0 + method.c[s] * h / loop.control[at.H_LAST] if extrapolate else 1.0
        for i in range(nq, nq + nv):
            w.states[STAGES + s, i] = 0.0
            if extrapolate:
                bend = loop.dense[n, i]
                for j in range(n - 1, 1, -1):
                    bend = bend * (theta if j % 2 == 0 else 1.0 - theta) + loop.dense[j, i]
                w.states[STAGES + s, i] = (theta - 1.0) * (loop.dense[1, i] - theta * bend)


@jitted
def retract_positions(method, h, sizes, y, w):
    """Set the stages' increments of q to the integral of v: h (c v0 + a Z_v); those of quaternions stay."""
    n = len(method.c)
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            j = sizes[at.NQ] + i - k
            for s in range(n):
                total = method.c[s] * y[j]
                for r in range(n):
                    total += method.a[s, r] * w.states[STAGES + r, j]
                w.states[STAGES + s, i] = h * total
        start = end + 4


@jitted
def correct_stages(solve, method, h, loop, t, w):
    """Correct the stages once; returns a status and the size of the correction in tolerances.

    `solve` (method, h, loop, w) turns the defects into corrections of the rates.
    """
    for s in range(len(method.c)):
        if not evaluate_stage(s, method, h, loop, t, w):
            return at.NOT_FINITE, 0.0
    sizes, y = loop.sizes, loop.y
    nq, nv, per_h = sizes[at.NQ], sizes[at.NV], 1.0 / h
    for i in range(nv):
        set_defect(method, per_h, w.rows, F_STAGES, nq + i, nv + i, w)
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        set_rotation_defect(method, per_h, i, i - k, nq + i - k, y, w)
    solve(method, h, loop, w)
    total = 0.0
    for i in range(nv):
        total += add_correction(method, nv + i, w) / w.pairs[SCALE, nv + i] ** 2
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k) - k
        for i in range(start, end):
            total += squared_move(method, h, nv + i, w) / w.pairs[SCALE, i] ** 2
        if end < nv:
            total += correct_rotations(method, per_h, sizes, end, nq + end, y, w)
        start = end + 3
    retract_stages(method, h, sizes, y, w)
    return at.RUNNING, math.sqrt(total / (2 * nv * len(method.c)))


@jitted
def evaluate_stage(s, method, h, loop, t0, w):
    """Evaluate the rhs row of stage `s`; returns whether its derivatives are finite."""
    place(loop.sizes, loop.y, w.states[STAGES + s], w.states[Y_STAGE])
    t = t0 + method.c[s] * h
    return evaluate(loop, t, w.states[Y_STAGE], w.rows[F_STAGES + s])


@jitted
def squared_move(method, h, column, w):
    """Return the sum of the squares by which the correction of a rate, in `column`, corrects its position."""
    n_pairs, shifts = len(method.c) // 2, method.inverse_squares
    total = shifts[0] * w.real_vectors[DX, column] ** 2
    for k in range(n_pairs):
        x = w.complex_vectors[n_pairs + k, column]
        total += shifts[1 + k] * (x.real * x.real + x.imag * x.imag)
    return h * h * total


@jitted
def retract_stages(method, h, sizes, y, w):
    """Set the stages from the transformed increments."""
    nq, nv = sizes[at.NQ], sizes[at.NV]
    for i in range(nv):
        restore_stages(method, nq + i, nv + i, w)
    retract_positions(method, h, sizes, y, w)
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        for column in range(3):
            restore_stages(method, i + column, i - k + column, w)


@jitted
def reach_end_by_accelerations(method, h, loop, t, t1, w):
    """Write the new state and its rhs row, on the constraints; returns why not, or RUNNING."""
    if not integrate_work(method, h, loop, t, w):
        return at.NOT_FINITE
    n = len(method.c)
    if loop.sizes[at.NM] > 0:
        for s in range(n):
            ratio = w.rows[F_STAGES + s, loop.sizes[at.N_ROW] - 1]
            loop.control[at.MIN_PIVOT_RATIO] = min(loop.control[at.MIN_PIVOT_RATIO], ratio)
    return place_end(method, loop, t1, w)


@jitted
def integrate_work(method, h, loop, t0, w):
    """Set the stages' increments of work by the method's quadrature; returns whether power is finite.

    Newton's last rows belong to the iterate before the last correction: too crude for an energy balance.
    """
    if loop.sizes[at.NW] == 0:
        return True
    n, n_stages = loop.sizes[at.NQ] + loop.sizes[at.NV], len(method.c)
    for s in range(n_stages):
        if not evaluate_stage(s, method, h, loop, t0, w):
            return False
    for s in range(n_stages):
        total = 0.0
        for r in range(n_stages):
            total += method.a[s, r] * w.rows[F_STAGES + r, n]
        w.states[STAGES + s, n] = h * total
    return True


@jitted
def place_end(method, loop, t1, w):
    """Write the state at the last stage, on the constraints, and its rhs row; returns a status."""
    y_new = w.states[Y_NEW]
    place(loop.sizes, loop.y, w.states[STAGES + len(method.c) - 1], y_new)
    status = project_state(loop, t1, y_new, w.scratch[: projection_size(loop.sizes)])
    if status != at.RUNNING:
        return status
    scale_energy(loop, t1, y_new, w.scratch)
    if not evaluate(loop, t1, y_new, w.rows[F_NEW]):
        return at.NOT_FINITE
    return at.RUNNING if all_finite(y_new, loop.sizes[at.NY]) else at.NOT_FINITE


@jitted
def commit_accelerations(method, loop, t, t1, w):
    """Make the new state the current one, with dense output, and record the step."""
    radau_dense(method, loop.sizes, loop.y, w, loop.dense)
    count_energy(loop)
    copy(w.states[Y_NEW], loop.y)
    copy(w.rows[F_NEW], loop.f)
    return finish_step(loop, t, t1, loop.dense, len(method.c) + 1, w.scratch)


@jitted
def radau_dense(method, sizes, y, w, dense):
    """Fill `dense` with the collocation polynomial; what projection moved is added in proportion to time."""
    n = len(method.c)
    for s in range(n):
        rotations_to_increments(sizes, y, w.states[STAGES + s])
    for i in range(sizes[at.NY]):
        dense[0, i] = y[i]
        dense[1, i] = w.states[Y_NEW, i] - y[i]
        for r in range(n - 1):
            total = 0.0
            for s in range(n):
                total += method.rows[r, s] * w.states[STAGES + s, i]
            dense[2 + r, i] = total

"""The stages of the Radau methods in transformed variables, reduced to the size of v: their start, corrections, end."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_step
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.radau.rotation_increments import (
    correct_rotations,
    place,
    predict_rotations,
    rotations_to_increments,
    set_rotation_defect,
)
from symgen.runtime.integrate.radau.transform import (
    add_correction,
    restore_stages,
    set_defect,
    transform_stages,
)
from symgen.runtime.integrate.radau.work import DX, F_NEW, F_STAGES, SCALE, STAGES, Y_NEW, Y_STAGE


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
    if not evaluate(loop, t1, y_new, w.rows[F_NEW]):
        return at.NOT_FINITE
    return at.RUNNING if all_finite(y_new, loop.sizes[at.NY]) else at.NOT_FINITE


@jitted
def commit_accelerations(method, loop, t, t1, w):
    """Make the new state the current one, with dense output, and record the step."""
    radau_dense(method, loop.sizes, loop.y, w, loop.dense)
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

"""The stages of the Radau methods: simplified Newton in transformed variables, reduced to the size of v."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.evaluation import evaluate
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.newton import (
    CONVERGED,
    DIVERGED,
    EPS,
    ITERATING,
    RATE,
    forget_rate,
    judge_correction,
    start_newton,
)
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.radau.rotation_increments import (
    correct_rotations,
    factor_rotations,
    place,
    predict_rotations,
    rotation_defect,
)
from symgen.runtime.integrate.radau.transform import (
    add_correction,
    restore_stages,
    set_defect,
    shift_of,
    transform_stages,
)
from symgen.runtime.integrate.radau.work import (
    DX,
    F_STAGES,
    FACTORED_FOR,
    ITERATIONS,
    LAST_RATE,
    NEWTON_BOUND,
    SCALE,
    STAGES,
    Y_STAGE,
)

# Corrections below this many times the round-off of positions, that no longer shrink, are taken for it.
ROUND_OFF = 4.0
_FADING = 0.5


@jitted
def factor_stages(method, h, loop, w):
    """Factor the real and the complex Newton matrices for a step of length `h`; returns a status.

    With J = [0 I; A B], (g - J) (Δq, Δv) = (0, r) is Δq = Δv / g and (g - B - A/g) Δv = r: as q' = v is
    linear, the stages satisfy it exactly, and its residual is zero. For the rotation vector of a quaternion, 1/g
    becomes the inverse of g + ω× / 2 (`solve_rotation`), and its equation has a residual.
    """
    set_matrix(method.mu / h, loop.sizes, loop.y, w.jacobian, w.real)
    loop.counters[at.FACTORISATIONS] += 1
    w.numbers[FACTORED_FOR] = h
    forget_rate(w.numbers)
    status = lu_factor(w.real, w.pivots[0])
    for k in range(len(method.c) // 2):
        if status == at.RUNNING:
            set_matrix(shift_of(method, k, 1.0 / h), loop.sizes, loop.y, w.jacobian, w.complex[k])
            status = lu_factor(w.complex[k], w.pivots[k + 1])
    return status


@jitted
def set_matrix(g, sizes, y, jacobian, matrix):
    """Write the Newton matrix for the real or complex shift `g`."""
    nv = matrix.shape[0]
    inverse = 1.0 / g
    for i in range(nv):
        for j in range(nv):
            matrix[i, j] = -jacobian[i, nv + j] - inverse * jacobian[i, j]
        matrix[i, i] += g
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        factor_rotations(g, j, y, sizes[at.NQ] + j, jacobian, matrix)


@jitted
def predict_stages(method, h, extrapolate, loop, w):
    """Start Newton from the last step's collocation polynomial, or from zero increments of v."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    predict_rates(method, h, extrapolate, loop, w)
    for i in range(nv):
        transform_stages(method, nq + i, nv + i, w)
    retract_positions(method, h, loop.sizes, loop.y, w)
    for k in range(n_quaternions(loop.sizes)):
        i = quaternion_at(loop.sizes, k)
        predict_rotations(method, h, i, i - k, nq + i - k, loop.y, w)


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
def solve_stages(method, h, loop, t0, w):
    """Improve the stages by simplified Newton; returns RUNNING, or why it does not converge."""
    start_newton(w.numbers)
    verdict, size, rate = ITERATING, 0.0, 0.0
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        for s in range(len(method.c)):
            if not evaluate_stage(s, method, h, loop, t0, w):
                return at.NOT_FINITE
        size = correct_stages(method, h, loop.sizes, loop.y, w)
        retract_stages(method, h, loop.sizes, loop.y, w)
        loop.counters[at.NEWTON_ITERATIONS] += 1
        verdict = judge_correction(iteration, size, w.numbers[NEWTON_BOUND], w.numbers)
        if iteration == 2:
            rate = w.numbers[RATE]
    return finish_newton(verdict, iteration, size, rate, method, h, loop.sizes, loop.y, w)


@jitted
def finish_newton(verdict, iteration, size, rate, method, h, sizes, y, w):
    """Return RUNNING where the iterations converged, be it to round-off that grows; keep what the next step asks for.

    Parameters
    ----------
    size : float
        Of the last correction, in tolerances.
    rate : float
        Of contraction in the second iteration, before round-off had a part in it.
    """
    if verdict == DIVERGED and iteration > 2 and size <= ROUND_OFF * round_off(method, h, sizes, y, w):
        verdict = CONVERGED
        w.numbers[RATE] = rate
    w.numbers[ITERATIONS] = iteration
    # One iteration tells nothing of the rate: what was known of it fades, or steps would never grow again.
    w.numbers[LAST_RATE] = w.numbers[RATE] if iteration > 1 else _FADING * w.numbers[LAST_RATE]
    return at.RUNNING if verdict == CONVERGED else at.NEWTON_FAILED


@jitted
def round_off(method, h, sizes, y, w):
    """Return the size of transformed rates whose motion within the step is the round-off of positions, in tolerances.

    Stiff forces turn that round-off into corrections which no iteration makes smaller, and shorter steps make larger.
    """
    total = 0.0
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            total += (y[i] / w.pairs[SCALE, sizes[at.NV] + i - k]) ** 2
        if end < sizes[at.NQ]:
            for i in range(end - k, end - k + 3):
                total += 1.0 / w.pairs[SCALE, sizes[at.NV] + i] ** 2
        start = end + 4
    return EPS * method.amplification * method.mu / h * math.sqrt(total / (2 * sizes[at.NV]))


@jitted
def evaluate_stage(s, method, h, loop, t0, w):
    """Evaluate the rhs row of stage `s`; returns whether its derivatives are finite."""
    place(loop.sizes, loop.y, w.states[STAGES + s], w.states[Y_STAGE])
    t = t0 + method.c[s] * h
    return evaluate(loop, t, w.states[Y_STAGE], w.rows[F_STAGES + s])


@jitted
def correct_stages(method, h, sizes, y, w):
    """Correct the transformed increments; returns the size of the correction in tolerances."""
    nq, nv, n_pairs = sizes[at.NQ], sizes[at.NV], len(method.c) // 2
    per_h = 1.0 / h
    for i in range(nv):
        set_defect(method, per_h, w.rows, F_STAGES, nq + i, nv + i, w)
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        rotation_defect(method, per_h, sizes, i, i - k, nq + i - k, y, w)
    lu_solve(w.real, w.pivots[0], w.real_vectors[DX, nv:])
    for k in range(n_pairs):
        lu_solve(w.complex[k], w.pivots[k + 1], w.complex_vectors[n_pairs + k, nv:])
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
    return math.sqrt(total / (2 * nv * len(method.c)))


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

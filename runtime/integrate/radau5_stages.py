"""The stages of radau5: simplified Newton in transformed variables, reduced to the size of v."""

import math

from runtime.code.jitted import jitted
from runtime.integrate.evaluation import evaluate
from runtime.integrate.layout import (
    FACTORISATIONS,
    H_LAST,
    NEWTON_FAILED,
    NEWTON_ITERATIONS,
    NOT_FINITE,
    NQ,
    NV,
    NW,
    RUNNING,
)
from runtime.integrate.linear import lu_factor, lu_solve
from runtime.integrate.newton import CONVERGED, ITERATING, RATE, forget_rate, judge_correction, start_newton
from runtime.integrate.quaternions import n_quaternions, quaternion_at
from runtime.integrate.radau5_transform import (
    add_correction,
    restore_stages,
    set_defect,
    transform_stages,
)
from runtime.integrate.radau5_turns import (
    correct_turns,
    factor_turns,
    place,
    predict_turns,
    turning_defect,
)
from runtime.integrate.radau5_work import (
    DX,
    FACTORED_FOR,
    ITERATIONS,
    LAST_RATE,
    NEWTON_BOUND,
    SCALE,
    Y_STAGE,
)


@jitted
def factor_stages(method, h, sizes, counters, y, w):
    """Factor the real and the complex Newton matrix for a step of length `h`; returns a status.

    With J = [0 I; A B], (g - J) (Δq, Δv) = (0, r) is Δq = Δv / g and (g - B - A/g) Δv = r: as q' = v is
    linear, the stages satisfy it exactly, and its residual is zero. For the rotation vector of a quaternion, 1/g
    becomes the inverse of g + ω× / 2 (`solve_turning`), and its equation has a residual.
    """
    nv = w.real.shape[0]
    g, g_complex = method.mu / h, complex(method.nu_real / h, method.nu_imag / h)
    inverse, inverse_complex = 1.0 / g, 1.0 / g_complex
    for i in range(nv):
        for j in range(nv):
            by_q, by_v = w.jacobian[i, j], w.jacobian[i, nv + j]
            w.real[i, j] = -by_v - inverse * by_q
            w.complex[i, j] = -by_v - inverse_complex * by_q
        w.real[i, i] += g
        w.complex[i, i] += g_complex
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        factor_turns(g, j, y, sizes[NQ] + j, w.jacobian, w.real)
        factor_turns(g_complex, j, y, sizes[NQ] + j, w.jacobian, w.complex)
    counters[FACTORISATIONS] += 1
    w.numbers[FACTORED_FOR] = h
    forget_rate(w.numbers)
    status = lu_factor(w.real, w.pivots[0])
    return status if status != RUNNING else lu_factor(w.complex, w.pivots[1])


@jitted
def predict_stages(method, h, extrapolate, sizes, control, y, dense, w):
    """Start Newton from the last step's collocation polynomial, or from zero increments of v."""
    nq, nv = sizes[NQ], sizes[NV]
    for s in range(3):
        theta = 1.0 + method.c[s] * h / control[H_LAST] if extrapolate else 1.0
        for i in range(nq, nq + nv):
            w.states[s, i] = 0.0
            if extrapolate:
                bend = dense[2, i] + theta * dense[3, i]
                w.states[s, i] = (theta - 1.0) * (dense[1, i] - theta * bend)
    for i in range(nv):
        transform_stages(method, nq + i, nv + i, w)
    move_positions(method, h, sizes, y, w.states)
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        predict_turns(method, h, i, i - k, nq + i - k, y, w)


@jitted
def move_positions(method, h, sizes, y, stages):
    """Set the stages' increments of q to the integral of v: h (c v0 + a Z_v); those of quaternions stay."""
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for s in range(3):
            c, a0, a1, a2 = method.c[s], method.a[s, 0], method.a[s, 1], method.a[s, 2]
            for i in range(start, end):
                j = sizes[NQ] + i - k
                stages[s, i] = h * (c * y[j] + a0 * stages[0, j] + a1 * stages[1, j] + a2 * stages[2, j])
        start = end + 4


@jitted
def solve_stages(method, h, addresses, sizes, p, control, counters, t0, y, w):
    """Improve the stages by simplified Newton; returns RUNNING, or why it does not converge."""
    start_newton(w.numbers)
    verdict = ITERATING
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        for s in range(3):
            if not evaluate_stage(s, method, h, addresses, sizes, p, counters, t0, y, w):
                return NOT_FINITE
        size = correct_stages(method, h, sizes, y, w)
        move_stages(method, h, sizes, y, w)
        counters[NEWTON_ITERATIONS] += 1
        verdict = judge_correction(iteration, size, w.numbers[NEWTON_BOUND], w.numbers)
    w.numbers[ITERATIONS] = iteration
    if iteration > 1:
        w.numbers[LAST_RATE] = w.numbers[RATE]
    return RUNNING if verdict == CONVERGED else NEWTON_FAILED


@jitted
def evaluate_stage(s, method, h, addresses, sizes, p, counters, t0, y, w):
    """Evaluate the rhs row of stage `s`; returns whether its derivatives are finite."""
    place(sizes, y, w.states[s], w.states[Y_STAGE])
    return evaluate(addresses, sizes, p, counters, t0 + method.c[s] * h, w.states[Y_STAGE], w.rows[s])


@jitted
def correct_stages(method, h, sizes, y, w):
    """Correct the transformed increments; returns the size of the correction in tolerances."""
    nq, nv = sizes[NQ], sizes[NV]
    g, g_complex = method.mu / h, complex(method.nu_real / h, method.nu_imag / h)
    for i in range(nv):
        set_defect(method, g, g_complex, w.rows[0, nq + i], w.rows[1, nq + i], w.rows[2, nq + i], nv + i, w)
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        turning_defect(method, g, g_complex, sizes, i, i - k, nq + i - k, y, w)
    lu_solve(w.real, w.pivots[0], w.real_vectors[DX, nv:])
    lu_solve(w.complex, w.pivots[1], w.complex_vectors[DX, nv:])
    total = 0.0
    squared, squared_complex = 1.0 / g**2, 1.0 / (g_complex.real**2 + g_complex.imag**2)
    for i in range(nv):
        real, other = add_correction(nv + i, w)
        total += (real + other) / w.pairs[SCALE, nv + i] ** 2
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k) - k
        for i in range(start, end):
            x = w.complex_vectors[DX, nv + i]
            moved = squared * w.real_vectors[DX, nv + i] ** 2 + squared_complex * (x.real**2 + x.imag**2)
            total += moved / w.pairs[SCALE, i] ** 2
        if end < nv:
            total += correct_turns(g, g_complex, sizes, end, nq + end, y, w)
        start = end + 3
    return math.sqrt(total / (6 * nv))


@jitted
def move_stages(method, h, sizes, y, w):
    """Set the stages from the transformed increments."""
    nq, nv = sizes[NQ], sizes[NV]
    for i in range(nv):
        restore_stages(method, nq + i, nv + i, w)
    move_positions(method, h, sizes, y, w.states)
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        for column in range(3):
            restore_stages(method, i + column, i - k + column, w)


@jitted
def integrate_work(method, h, addresses, sizes, p, counters, t0, y, w):
    """Set the stages' increments of work by the method's quadrature; returns whether power is finite.

    Newton's last rows belong to the iterate before the last correction: too crude for an energy balance.
    """
    if sizes[NW] == 0:
        return True
    n = sizes[NQ] + sizes[NV]
    for s in range(3):
        if not evaluate_stage(s, method, h, addresses, sizes, p, counters, t0, y, w):
            return False
    for s in range(3):
        w.states[s, n] = h * (
            method.a[s, 0] * w.rows[0, n] + method.a[s, 1] * w.rows[1, n] + method.a[s, 2] * w.rows[2, n]
        )
    return True

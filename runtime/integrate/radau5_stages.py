"""The stages of radau5: simplified Newton in transformed variables, reduced to the size of v."""

import math
from typing import NamedTuple

import numpy as np

from runtime.code.jitted import jitted
from runtime.integrate.after_step import finish_scratch_size
from runtime.integrate.evaluation import evaluate
from runtime.integrate.jacobian import jacobian_work_size
from runtime.integrate.layout import (
    FACTORISATIONS,
    H_LAST,
    N_ROW,
    NEWTON_FAILED,
    NEWTON_ITERATIONS,
    NOT_FINITE,
    NV,
    NW,
    NY,
    RUNNING,
)
from runtime.integrate.linear import lu_factor, lu_solve
from runtime.integrate.newton import (
    CONVERGED,
    ITERATING,
    N_MONITOR,
    RATE,
    forget_rate,
    judge_correction,
    start_newton,
)

# Counters of this family: whether work holds a Jacobian, one of the present state, factors; and whether
# `dense` and ERROR_OLD are those of the step before.
HAVE_JACOBIAN, JACOBIAN_IS_FRESH, HAVE_FACTORS, HAVE_HISTORY = range(16, 20)

# `numbers` of the work arrays: Newton's monitor, then these.
FACTORED_FOR, NEWTON_BOUND, ITERATIONS, LAST_RATE = range(N_MONITOR, N_MONITOR + 4)
N_NUMBERS = N_MONITOR + 4


# Rows of `states`, of `rows`, of `real_vectors` and `complex_vectors`, of `pairs`, behind those of the three stages.
Y_STAGE, Y_NEW = 3, 4
F_NEW = 3
X, DX = range(2)
SCALE, ERROR = range(2)


class RadauWork(NamedTuple):
    """Work arrays of radau5. They are few, because every array makes every call of a jitted function longer.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    jacobian : ndarray, shape (nv, 2 nv)
        [A, B] = [∂a/∂q, ∂a/∂v].
    real, complex : ndarray, shape (nv, nv)
        Factors of μ/h - B - A h/μ and ν/h - B - A h/ν.
    pivots : ndarray of int64, shape (2, nv)
        Of both.
    states : ndarray, shape (5, NY)
        Increments of (q, v, w) from the start of the step to each stage; the argument of a stage; the new state.
    rows : ndarray, shape (4, N_ROW)
        The rhs rows of the stages and of the new state.
    real_vectors, complex_vectors : ndarray, shape (2, nv)
        The increments of v, transformed, and their corrections.
    pairs : ndarray, shape (2, 2 nv)
        Tolerance and estimated error of every component.
    implicit : ndarray
        See `acceleration_jacobian`.
    scratch : ndarray
        See `finish_step`.
    """

    numbers: np.ndarray
    jacobian: np.ndarray
    real: np.ndarray
    complex: np.ndarray
    pivots: np.ndarray
    states: np.ndarray
    rows: np.ndarray
    real_vectors: np.ndarray
    complex_vectors: np.ndarray
    pairs: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def radau_work_size(sizes):
    """Length of `work` for `advance_radau5`."""
    nv, ny, n_row = sizes[NV], sizes[NY], sizes[N_ROW]
    own = N_NUMBERS + 5 * nv * nv + 12 * nv + 5 * ny + 4 * n_row
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def radau_work(sizes, work):
    """Divide `work`, of length `radau_work_size(sizes)`, into a `RadauWork`."""
    nv, ny, n_row = sizes[NV], sizes[NY], sizes[N_ROW]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    jacobian, rest = rest[: 2 * nv * nv].reshape((nv, 2 * nv)), rest[2 * nv * nv :]
    real, rest = rest[: nv * nv].reshape((nv, nv)), rest[nv * nv :]
    complex_, rest = rest[: 2 * nv * nv].view(np.complex128).reshape((nv, nv)), rest[2 * nv * nv :]
    pivots, rest = rest[: 2 * nv].view(np.int64).reshape((2, nv)), rest[2 * nv :]
    states, rest = rest[: 5 * ny].reshape((5, ny)), rest[5 * ny :]
    rows, rest = rest[: 4 * n_row].reshape((4, n_row)), rest[4 * n_row :]
    real_vectors, rest = rest[: 2 * nv].reshape((2, nv)), rest[2 * nv :]
    complex_vectors, rest = rest[: 4 * nv].view(np.complex128).reshape((2, nv)), rest[4 * nv :]
    pairs, rest = rest[: 4 * nv].reshape((2, 2 * nv)), rest[4 * nv :]
    n = jacobian_work_size(sizes)
    return RadauWork(
        numbers, jacobian, real, complex_, pivots, states, rows, real_vectors, complex_vectors, pairs,
        rest[:n], rest[n:],
    )  # fmt: skip


@jitted
def factor_stages(method, h, counters, w):
    """Factor the real and the complex Newton matrix for a step of length `h`; returns a status.

    With J = [0 I; A B], (g - J) (Δq, Δv) = (0, r) is Δq = Δv / g and (g - B - A/g) Δv = r: as q' = v is
    linear, the stages satisfy it exactly, and its residual is zero.
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
    counters[FACTORISATIONS] += 1
    w.numbers[FACTORED_FOR] = h
    forget_rate(w.numbers)
    status = lu_factor(w.real, w.pivots[0])
    return status if status != RUNNING else lu_factor(w.complex, w.pivots[1])


@jitted
def predict_stages(method, h, extrapolate, sizes, control, y, dense, w):
    """Start Newton from the last step's collocation polynomial, or from zero increments of v."""
    nv = sizes[NV]
    for s in range(3):
        theta = 1.0 + method.c[s] * h / control[H_LAST] if extrapolate else 1.0
        for i in range(nv, 2 * nv):
            w.states[s, i] = 0.0
            if extrapolate:
                bend = dense[2, i] + theta * dense[3, i]
                w.states[s, i] = (theta - 1.0) * (dense[1, i] - theta * bend)
    t = method.from_stages
    for i in range(nv):
        z0, z1, z2 = w.states[0, nv + i], w.states[1, nv + i], w.states[2, nv + i]
        w.real_vectors[X, i] = t[0, 0] * z0 + t[0, 1] * z1 + t[0, 2] * z2
        w.complex_vectors[X, i] = complex(
            t[1, 0] * z0 + t[1, 1] * z1 + t[1, 2] * z2, t[2, 0] * z0 + t[2, 1] * z1 + t[2, 2] * z2
        )
    move_positions(method, h, nv, y, w.states)


@jitted
def move_positions(method, h, nv, y, stages):
    """Set the stages' increments of q to the integral of v: h (c v0 + a Z_v)."""
    for s in range(3):
        c, a0, a1, a2 = method.c[s], method.a[s, 0], method.a[s, 1], method.a[s, 2]
        for i in range(nv):
            j = nv + i
            stages[s, i] = h * (c * y[j] + a0 * stages[0, j] + a1 * stages[1, j] + a2 * stages[2, j])


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
        size = correct_stages(method, h, sizes[NV], w)
        move_stages(method, h, sizes[NV], y, w)
        counters[NEWTON_ITERATIONS] += 1
        verdict = judge_correction(iteration, size, w.numbers[NEWTON_BOUND], w.numbers)
    w.numbers[ITERATIONS] = iteration
    if iteration > 1:
        w.numbers[LAST_RATE] = w.numbers[RATE]
    return RUNNING if verdict == CONVERGED else NEWTON_FAILED


@jitted
def evaluate_stage(s, method, h, addresses, sizes, p, counters, t0, y, w):
    """Evaluate the rhs row of stage `s`; returns whether its derivatives are finite."""
    for i in range(2 * sizes[NV]):
        w.states[Y_STAGE, i] = y[i] + w.states[s, i]
    return evaluate(addresses, sizes, p, counters, t0 + method.c[s] * h, w.states[Y_STAGE], w.rows[s])


@jitted
def correct_stages(method, h, nv, w):
    """Correct the transformed increments of v; returns the size of the correction in tolerances."""
    t = method.from_stages
    g, g_complex = method.mu / h, complex(method.nu_real / h, method.nu_imag / h)
    for i in range(nv):
        a0, a1, a2 = w.rows[0, nv + i], w.rows[1, nv + i], w.rows[2, nv + i]
        w.real_vectors[DX, i] = t[0, 0] * a0 + t[0, 1] * a1 + t[0, 2] * a2 - g * w.real_vectors[X, i]
        transformed = complex(
            t[1, 0] * a0 + t[1, 1] * a1 + t[1, 2] * a2, t[2, 0] * a0 + t[2, 1] * a1 + t[2, 2] * a2
        )
        w.complex_vectors[DX, i] = transformed - g_complex * w.complex_vectors[X, i]
    lu_solve(w.real, w.pivots[0], w.real_vectors[DX])
    lu_solve(w.complex, w.pivots[1], w.complex_vectors[DX])
    total = 0.0
    squared, squared_complex = 1.0 / g**2, 1.0 / (g_complex.real**2 + g_complex.imag**2)
    for i in range(nv):
        w.real_vectors[X, i] += w.real_vectors[DX, i]
        w.complex_vectors[X, i] += w.complex_vectors[DX, i]
        real = w.real_vectors[DX, i] ** 2
        other = w.complex_vectors[DX, i].real ** 2 + w.complex_vectors[DX, i].imag ** 2
        total += (real + other) / w.pairs[SCALE, nv + i] ** 2
        total += (squared * real + squared_complex * other) / w.pairs[SCALE, i] ** 2
    return math.sqrt(total / (6 * nv))


@jitted
def move_stages(method, h, nv, y, w):
    """Set the stages from the transformed increments of v."""
    t = method.to_stages
    for s in range(3):
        for i in range(nv):
            x = w.complex_vectors[X, i]
            w.states[s, nv + i] = t[s, 0] * w.real_vectors[X, i] + t[s, 1] * x.real + t[s, 2] * x.imag
    move_positions(method, h, nv, y, w.states)


@jitted
def integrate_work(method, h, addresses, sizes, p, counters, t0, y, w):
    """Set the stages' increments of work by the method's quadrature; returns whether power is finite.

    Newton's last rows belong to the iterate before the last correction: too crude for an energy balance.
    """
    if sizes[NW] == 0:
        return True
    n = 2 * sizes[NV]
    for s in range(3):
        if not evaluate_stage(s, method, h, addresses, sizes, p, counters, t0, y, w):
            return False
    for s in range(3):
        w.states[s, n] = h * (
            method.a[s, 0] * w.rows[0, n] + method.a[s, 1] * w.rows[1, n] + method.a[s, 2] * w.rows[2, n]
        )
    return True

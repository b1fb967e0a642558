"""The equations of a step of bdf: simplified Newton, reduced to the size of v."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.jacobian import acceleration_jacobian, jacobian_work_size
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.loop import copy, evaluate
from symgen.runtime.integrate.nested_basis import rows_of
from symgen.runtime.integrate.newton import (
    CONVERGED,
    ITERATING,
    N_MONITOR,
    forget_rate,
    judge_correction,
    start_newton,
)
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, quaternion_rate
from symgen.runtime.integrate.radau.stages import factor_rotations

MAX_ORDER = 5


class Formulas(NamedTuple):
    """Numerical differentiation formulas of orders 1 to 5; index k of an array belongs to order k, 0 is not used.

    With backward differences ∇ⁱ and y_p = Σ ∇ⁱ y_n, i = 0..k, a step solves for d = y_{n+1} - y_p

        α_k d + Σ γ_i ∇ⁱ y_n = h f(t_{n+1}, y_p + d),   i = 1..k.

    Attributes
    ----------
    gamma : ndarray, shape (6,)
        γ_k = 1 + 1/2 + … + 1/k.
    alpha : ndarray, shape (6,)
        (1 - κ_k) γ_k.
    error : ndarray, shape (6,)
        The local error is about error_k d, as d is about ∇ᵏ⁺¹ y_{n+1}.
    rows : ndarray, shape (6, 6)
        From backward differences at the end of a step to the rows of its dense output.
    """

    gamma: np.ndarray
    alpha: np.ndarray
    error: np.ndarray
    rows: np.ndarray


def ndf() -> Formulas:
    """Return the numerical differentiation formulas.

    Shampine, Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput. 18 (1997) 1, section 2.1 and table 1, with the
    κ of their ode15s: 0 at order 5, which is the backward differentiation formula itself.
    """
    kappa = np.array([0.0, -0.1850, -1.0 / 9.0, -0.0823, -0.0415, 0.0])
    gamma = np.concatenate([[0.0], np.cumsum(1.0 / np.arange(1, MAX_ORDER + 1))])
    error = kappa * gamma + 1.0 / np.arange(1, MAX_ORDER + 2)
    return Formulas(gamma, (1.0 - kappa) * gamma, error, rows_of(newton_basis(), MAX_ORDER + 1))


def newton_basis() -> list[Polynomial]:
    """Return the polynomials s (s+1) … (s+j-1) / j!, s = θ - 1: Newton's, backwards from θ = 1."""
    basis = [Polynomial([1.0])]
    for j in range(MAX_ORDER):
        basis.append(basis[-1] * Polynomial([j - 1.0, 1.0]) / (j + 1.0))
    return basis


# Counters of this family: the order; steps of equal length and order; failures in a row; whether work holds a history
# (that of an event: up to KEPT), a Jacobian, one of the present state, factors.
ORDER, N_EQUAL, FAILURES, HAVE_HISTORY, HAVE_JACOBIAN, JACOBIAN_IS_FRESH, HAVE_FACTORS = range(16, 23)

# `numbers` of the work arrays, behind Newton's monitor: the distance of the points of the history, the time of its
# newest one, the γ = h / α that factors are for, iterations of the last Newton, its bound; of
# configurations where constraints lose rank (see `singular.py`) the last pivot ratio that was not zero, which part of
# the rates is left open, the step far from them.
SPACING, NEWEST, FACTORED_FOR, ITERATIONS, NEWTON_BOUND = range(N_MONITOR, N_MONITOR + 5)
PIVOT_RATIO, LEFT_OPEN, FAR_STEP = range(N_MONITOR + 5, N_MONITOR + 8)
# Power [W] at the newest point, and at the one before it.
POWER, POWER_BEFORE = range(N_MONITOR + 8, N_MONITOR + 10)
N_NUMBERS = N_MONITOR + 10

N_DIFFERENCES = MAX_ORDER + 3
# Rows of `states`.
PREDICTED, PAST, CHANGE, Y_NEW, SCALE, KEPT = range(6)
N_STATES = 6
N_COLUMNS = MAX_ORDER + 1


class BdfWork(NamedTuple):
    """Work arrays of bdf.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    differences : ndarray, shape (8, NY)
        Backward differences ∇ⁱ of the state at the newest point; rows order + 1 and order + 2 are those of the last
        step, for choosing the order.
    states : ndarray, shape (6, NY)
        The predicted state; Σ γ_i ∇ⁱ y / α; the new state minus the predicted; the new state; the tolerance of every
        component; the state at which an event has stopped the last call.
    weights : ndarray, shape (2, 6, 6)
        See `resample`.
    jacobian : ndarray, shape (nv, 2 nv)
        [A, B] = [∂a/∂q, ∂a/∂v], see `acceleration_jacobian`.
    matrix, pivots : ndarray, shapes (nv, nv), (nv,)
        Factors of g - B - A/g, with g = α/h; see `factor` for quaternions.
    correction : ndarray, shape (nv,)
    row : ndarray, shape (N_ROW,)
    implicit, scratch : ndarray
        See `acceleration_jacobian` and `finish_step`.
    """

    numbers: np.ndarray
    differences: np.ndarray
    states: np.ndarray
    weights: np.ndarray
    jacobian: np.ndarray
    matrix: np.ndarray
    pivots: np.ndarray
    correction: np.ndarray
    row: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def bdf_work_size(sizes):
    """Length of `work` for `advance_bdf`."""
    nv, ny = sizes[at.NV], sizes[at.NY]
    own = (
        N_NUMBERS
        + (N_DIFFERENCES + N_STATES) * ny
        + 2 * N_COLUMNS**2
        + 3 * nv * nv
        + 2 * nv
        + sizes[at.N_ROW]
    )
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def bdf_work(sizes, work):
    """Divide `work`, of length `bdf_work_size(sizes)`, into a `BdfWork`."""
    nv, ny = sizes[at.NV], sizes[at.NY]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    n = N_DIFFERENCES * ny
    differences, rest = rest[:n].reshape((N_DIFFERENCES, ny)), rest[n:]
    states, rest = rest[: N_STATES * ny].reshape((N_STATES, ny)), rest[N_STATES * ny :]
    n = 2 * N_COLUMNS * N_COLUMNS
    weights, rest = rest[:n].reshape((2, N_COLUMNS, N_COLUMNS)), rest[n:]
    jacobian, rest = rest[: 2 * nv * nv].reshape((nv, 2 * nv)), rest[2 * nv * nv :]
    matrix, rest = rest[: nv * nv].reshape((nv, nv)), rest[nv * nv :]
    pivots, rest = rest[:nv].view(np.int64), rest[nv:]
    correction, rest = rest[:nv], rest[nv:]
    row, rest = rest[: sizes[at.N_ROW]], rest[sizes[at.N_ROW] :]
    n = jacobian_work_size(sizes)
    return BdfWork(
        numbers, differences, states, weights, jacobian, matrix, pivots, correction, row, rest[:n], rest[n:]
    )


@jitted
def solve_step(iterate, g, loop, t1, w):
    """Solve g (d + past) = f(t1, predicted + d) for d, g = α/h; where that fails, once more with a fresh Jacobian.

    `iterate` (g, loop, t1, w) is Newton's iteration for these equations. Writes `w.states[Y_NEW]` and, but for work,
    `w.states[CHANGE]`. Returns RUNNING, or why there is no solution.
    """
    if loop.counters[HAVE_JACOBIAN]:
        if iterate(g, loop, t1, w) == at.RUNNING:
            return at.RUNNING
        if loop.counters[JACOBIAN_IS_FRESH]:
            return at.NEWTON_FAILED
        loop.counters[HAVE_JACOBIAN] = 0
    return iterate(g, loop, t1, w)


@jitted
def iterate(g, loop, t1, w):
    """Improve the new state from the predicted one by simplified Newton; returns RUNNING, or why not."""
    nq = loop.sizes[at.NQ]
    copy(w.states[PREDICTED], w.states[Y_NEW])
    for i in range(loop.sizes[at.NV]):
        w.states[CHANGE, nq + i] = 0.0
    retract_positions(1.0 / g, loop.sizes, w.states[Y_NEW], nq, w)
    start_newton(w.numbers)
    verdict = ITERATING
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        if not evaluate(loop, t1, w.states[Y_NEW], w.row):
            return at.NOT_FINITE
        if iteration == 1:
            status = prepare_matrix(g, loop, t1, w)
            if status != at.RUNNING:
                return status
        size = correct(g, loop.sizes, w)
        loop.counters[at.NEWTON_ITERATIONS] += 1
        verdict = judge_correction(iteration, size, w.numbers[NEWTON_BOUND], w.numbers)
    w.numbers[ITERATIONS] = iteration
    return at.RUNNING if verdict == CONVERGED else at.NEWTON_FAILED


@jitted
def retract_positions(step, sizes, rates, first, w):
    """Set the positions of `w.states[Y_NEW]` by `rates[first:]`, as their equations are linear; `step` is h/α.

    q = b + step q'(q, v), with b the predicted value less the past; so a quaternion is b, multiplied by the inverse of
    1 - step (0, ω)/2.
    """
    nq = sizes[at.NQ]
    predicted, past, change, y = w.states[PREDICTED], w.states[PAST], w.states[CHANGE], w.states[Y_NEW]
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            change[i] = step * rates[first + i - k] - past[i]
            y[i] = predicted[i] + change[i]
        if end < nq:
            for i in range(end, end + 4):
                y[i] = predicted[i] - past[i]
            j = first + end - k
            a, b, c = step * rates[j], step * rates[j + 1], step * rates[j + 2]
            turned = quaternion_rate(y, end, a, b, c)
            below = 1.0 + 0.25 * (a * a + b * b + c * c)
            for i in range(4):
                y[end + i] = (y[end + i] + turned[i]) / below
                change[end + i] = y[end + i] - predicted[end + i]
        start = end + 4


@jitted
def prepare_matrix(g, loop, t1, w):
    """Renew the Jacobian where there is none, and the factors where they are for another γ; returns a status."""
    if not loop.counters[HAVE_JACOBIAN]:
        status = acceleration_jacobian(loop, t1, w.states[Y_NEW], w.row, w.implicit, w.jacobian)
        if status != at.RUNNING:
            return status
        loop.counters[HAVE_JACOBIAN], loop.counters[JACOBIAN_IS_FRESH], loop.counters[HAVE_FACTORS] = 1, 1, 0
    # Lengths of equal steps differ by round-off of time, which is nothing to Newton.
    if loop.counters[HAVE_FACTORS] and abs(g - w.numbers[FACTORED_FOR]) <= 1e-6 * g:
        return at.RUNNING
    loop.counters[HAVE_FACTORS] = 0
    status = factor(g, loop, w)
    if status == at.RUNNING:
        loop.counters[HAVE_FACTORS] = 1
    return status


@jitted
def factor(g, loop, w):
    """Factor g - B - A/g; returns a status.

    With J = [0 I; A B], (g - J) (Δq, Δv) = (0, r) is Δq = Δv / g and (g - B - A/g) Δv = r: the positions satisfy
    their equations whatever the rates. For the rotation vector of a quaternion, 1/g becomes the inverse of g + ω× / 2.
    """
    nv = w.matrix.shape[0]
    for i in range(nv):
        for j in range(nv):
            w.matrix[i, j] = -w.jacobian[i, nv + j] - w.jacobian[i, j] / g
        w.matrix[i, i] += g
    for k in range(n_quaternions(loop.sizes)):
        j = quaternion_at(loop.sizes, k) - k
        factor_rotations(g, j, w.states[Y_NEW], loop.sizes[at.NQ] + j, w.jacobian, w.matrix)
    loop.counters[at.FACTORISATIONS] += 1
    w.numbers[FACTORED_FOR] = g
    forget_rate(w.numbers)
    return lu_factor(w.matrix, w.pivots)


@jitted
def correct(g, sizes, w):
    """Correct the new state, whose derivative is `w.row`; returns the size of the correction in tolerances."""
    nq, nv = sizes[at.NQ], sizes[at.NV]
    for i in range(nv):
        j = nq + i
        w.correction[i] = w.row[j] - g * (w.states[PAST, j] + w.states[CHANGE, j])
    lu_solve(w.matrix, w.pivots, w.correction)
    total = 0.0
    for i in range(nv):
        dv, j = w.correction[i], nq + i
        w.states[CHANGE, j] += dv
        w.states[Y_NEW, j] = w.states[PREDICTED, j] + w.states[CHANGE, j]
        total += (dv / w.states[SCALE, j]) ** 2
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, min(end + 3, nq)):
            total += (w.correction[i - k] / (g * w.states[SCALE, i])) ** 2
        start = end + 4
    retract_positions(1.0 / g, sizes, w.states[Y_NEW], nq, w)
    return math.sqrt(total / (2 * nv))

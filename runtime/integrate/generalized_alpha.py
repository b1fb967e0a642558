"""The generalised-α method and HHT with a fixed step; their Newton systems have the size of v."""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size, finish_step, needs_dense
from symgen.runtime.integrate.dense import hermite_dense
from symgen.runtime.integrate.jacobian import acceleration_jacobian, jacobian_work_size
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.loop import all_finite, copy, evaluate, take_steps
from symgen.runtime.integrate.newton import (
    DIVERGED,
    ITERATING,
    N_MONITOR,
    RATE,
    forget_rate,
    judge_correction,
    start_newton,
)
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, rotate
from symgen.runtime.integrate.step_control import error_scale, grid_end


class GeneralizedAlpha(NamedTuple):
    """Parameters of the generalised-α method for q'' = a(t, q, v).

    A runs behind a as an average, (1 - α_m) A₁ + α_m A₀ = (1 - α_f) a₁ + α_f a₀, and Newmark's formulas take A:
    v₁ = v₀ + h ((1-γ) A₀ + γ A₁), q₁ = q₀ + h v₀ + h² ((1/2-β) A₀ + β A₁).

    Attributes
    ----------
    alpha_m, alpha_f, beta, gamma : float
    """

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float


class ConstrainedAlpha(NamedTuple):
    """Parameters as those of `GeneralizedAlpha`, for constraints on positions.

    Attributes
    ----------
    alpha_m, alpha_f, beta, gamma : float
    stabilised : int
        1 where constraints hold for velocities as well (stabilised index 2), 0 in index-3 form.
    """

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    stabilised: int


def generalized_alpha(spectral_radius: float = 0.9) -> GeneralizedAlpha:
    """Return the method that damps the fastest motions by `spectral_radius`, 0 to 1, a step, and slow ones least.

    Chung, Hulbert, J. Appl. Mech. 60 (1993) 371, (14), (20) and (25).
    """
    rho = spectral_radius
    return _newmark((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0))


def hht(alpha: float = 0.1) -> GeneralizedAlpha:
    """Return the method of Hilber, Hughes and Taylor with α, 0 to 1/3; damping grows with it.

    Hilber, Hughes, Taylor, Earthq. Eng. Struct. Dyn. 5 (1977) 283, whose α is negative.
    """
    return _newmark(0.0, alpha)


def _newmark(alpha_m: float, alpha_f: float) -> GeneralizedAlpha:
    if not alpha_m <= alpha_f <= 0.5:
        raise ValueError(
            f"the method is unstable with α_m = {alpha_m}, α_f = {alpha_f}: α_m <= α_f <= 1/2 is needed"
        )
    lag = alpha_f - alpha_m
    return GeneralizedAlpha(alpha_m, alpha_f, 0.25 * (1.0 + lag) ** 2, 0.5 + lag)


# Counters of this family: whether work holds a Jacobian, and factors (for steps of length FACTORED_FOR).
HAVE_JACOBIAN, HAVE_FACTORS = range(16, 18)

FACTORED_FOR = N_MONITOR  # in `numbers`, behind Newton's monitor
N_NUMBERS = N_MONITOR + 1

# Rows of `vectors`.
AVERAGE, NEW_AVERAGE, ACCELERATION, CORRECTION = range(4)


class AlphaWork(NamedTuple):
    """Work arrays of `advance_generalized_alpha`.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    jacobian : ndarray, shape (nv, 2 nv)
        [∂a/∂q, ∂a/∂v].
    matrix, pivots : ndarray, shapes (nv, nv), (nv,)
        Factors of the Newton matrix.
    vectors : ndarray, shape (4, nv)
        A at the start and at the end of the step, a at its end, a correction of that.
    y_new : ndarray, shape (NY,)
    row : ndarray, shape (N_ROW,)
        The rhs row of the new state.
    implicit, scratch : ndarray
        See `acceleration_jacobian` and `finish_step`.
    """

    numbers: np.ndarray
    jacobian: np.ndarray
    matrix: np.ndarray
    pivots: np.ndarray
    vectors: np.ndarray
    y_new: np.ndarray
    row: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def alpha_work_size(sizes):
    """Length of `work` for `advance_generalized_alpha`."""
    nv = sizes[at.NV]
    own = N_NUMBERS + 3 * nv * nv + 5 * nv + sizes[at.NY] + sizes[at.N_ROW]
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def alpha_work(sizes, work):
    """Divide `work`, of length `alpha_work_size(sizes)`, into an `AlphaWork`."""
    nv, ny, n_row = sizes[at.NV], sizes[at.NY], sizes[at.N_ROW]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    jacobian, rest = rest[: 2 * nv * nv].reshape((nv, 2 * nv)), rest[2 * nv * nv :]
    matrix, rest = rest[: nv * nv].reshape((nv, nv)), rest[nv * nv :]
    pivots, rest = rest[:nv].view(np.int64), rest[nv:]
    vectors, rest = rest[: 4 * nv].reshape((4, nv)), rest[4 * nv :]
    y_new, rest = rest[:ny], rest[ny:]
    row, rest = rest[:n_row], rest[n_row:]
    n = jacobian_work_size(sizes)
    return AlphaWork(numbers, jacobian, matrix, pivots, vectors, y_new, row, rest[:n], rest[n:])


# Of the tolerance; an error that Newton leaves is not seen by anything else here, and adds up over the steps.
DEFAULT_NEWTON_TOL = 1e-3
KEEP_JACOBIAN_RATE = 0.2
N_DENSE_TERMS = 4


@jitted
def advance_generalized_alpha(method, loop):
    """Advance with a `GeneralizedAlpha` method until something is for Python to do.

    In the form of Arnold and Brüls, Multibody Syst. Dyn. 18 (2007) 185, the equations of motion hold at the ends of
    steps, so a mass matrix that changes costs no order. Quaternions are turned by what Newmark's formula makes of their
    rates (Brüls, Cardona, Arnold, Mech. Mach. Theory 48 (2012) 121). Constrained models are integrated in their
    accelerations and projected after every step. `control[NEWTON_TOL]` is in units of the error tolerance; 0 means
    DEFAULT_NEWTON_TOL. Arguments and result are those of all step loops, see docs/step-loops.md.
    """
    w = alpha_work(loop.sizes, loop.work)
    if not loop.counters[at.F_VALID]:
        if not evaluate(loop, loop.control[at.T], loop.y, loop.f):
            return at.NOT_FINITE
        loop.counters[at.F_VALID] = 1
        for i in range(loop.sizes[at.NV]):
            w.vectors[AVERAGE, i] = loop.f[loop.sizes[at.NQ] + i]
    return take_steps(alpha_step, method, loop, w)


@jitted
def alpha_step(method, loop, w):
    """Take one step of the grid and record it; returns a status."""
    t0 = loop.control[at.T]
    t1 = grid_end(loop)
    status = solve_step(method, t1 - t0, loop, t1, w)
    if status == at.RUNNING:
        status = reach_end(t1 - t0, loop, t1, w)
    if status != at.RUNNING:
        return status
    if needs_dense(loop, t1):
        hermite_dense(loop.y, w.y_new, loop.f, w.row, t1 - t0, loop.sizes[at.NY], loop.dense)
    copy(w.y_new, loop.y)
    copy(w.row, loop.f)
    copy(w.vectors[NEW_AVERAGE], w.vectors[AVERAGE])
    return finish_step(loop, t0, t1, loop.dense, N_DENSE_TERMS, w.scratch)


@jitted
def solve_step(method, h, loop, t1, w):
    """Solve for the accelerations at `t1`; where that fails, once more with a fresh Jacobian."""
    if loop.counters[HAVE_JACOBIAN]:
        if iterate(method, h, loop, t1, w) == at.RUNNING:
            return at.RUNNING
    status = acceleration_jacobian(loop, loop.control[at.T], loop.y, loop.f, w.implicit, w.jacobian)
    if status != at.RUNNING:
        return status
    loop.counters[HAVE_JACOBIAN], loop.counters[HAVE_FACTORS] = 1, 0
    return iterate(method, h, loop, t1, w)


@jitted
def iterate(method, h, loop, t1, w):
    """Improve the accelerations at `t1` by simplified Newton from those at the start; returns a status."""
    # Lengths of steps on the grid differ by round-off of time, which is nothing to Newton.
    if not loop.counters[HAVE_FACTORS] or abs(h - w.numbers[FACTORED_FOR]) > 1e-6 * h:
        status = factor_step(method, h, loop.counters, w)
        if status != at.RUNNING:
            return status
    for i in range(loop.sizes[at.NV]):
        w.vectors[ACCELERATION, i] = loop.f[loop.sizes[at.NQ] + i]
    tolerance = loop.control[at.NEWTON_TOL] if loop.control[at.NEWTON_TOL] > 0.0 else DEFAULT_NEWTON_TOL
    start_newton(w.numbers)
    verdict = ITERATING
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        place_end(method, h, loop.sizes, loop.y, loop.f, w)
        if not evaluate(loop, t1, w.y_new, w.row):
            return at.NOT_FINITE
        size = correct_end(method, h, loop, w)
        loop.counters[at.NEWTON_ITERATIONS] += 1
        verdict = judge_correction(iteration, size, tolerance, w.numbers)
    if verdict == DIVERGED:
        return at.NEWTON_FAILED
    place_end(method, h, loop.sizes, loop.y, loop.f, w)
    if w.numbers[RATE] > KEEP_JACOBIAN_RATE:
        loop.counters[HAVE_JACOBIAN] = 0
    return at.RUNNING


@jitted
def leverage(method, h):
    """Return by how much q and v at the end of the step change with a there."""
    share = (1.0 - method.alpha_f) / (1.0 - method.alpha_m)
    return h * h * method.beta * share, h * method.gamma * share


@jitted
def factor_step(method, h, counters, w):
    """Factor 1 - (∂v/∂a) ∂a/∂v - (∂q/∂a) ∂a/∂q; returns a status."""
    nv = w.matrix.shape[0]
    by_q, by_v = leverage(method, h)
    for i in range(nv):
        for j in range(nv):
            w.matrix[i, j] = -by_v * w.jacobian[i, nv + j] - by_q * w.jacobian[i, j]
        w.matrix[i, i] += 1.0
    counters[at.FACTORISATIONS] += 1
    counters[HAVE_FACTORS] = 1
    w.numbers[FACTORED_FOR] = h
    forget_rate(w.numbers)
    return lu_factor(w.matrix, w.pivots)


@jitted
def place_end(method, h, sizes, y, f, w):
    """Write the averaged accelerations, rates and positions at the end of the step that belong to a there."""
    nq, nv, start = sizes[at.NQ], sizes[at.NV], 0
    if nq == nv:  # loops from 0 need no checks of their indexes
        for i in range(nv):
            w.y_new[i] = y[i] + place_rate(i, method, h, nv, y, f, w)
        return
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            w.y_new[i] = y[i] + place_rate(i - k, method, h, nq, y, f, w)
        if end < nq:
            j = end - k
            a, b = place_rate(j, method, h, nq, y, f, w), place_rate(j + 1, method, h, nq, y, f, w)
            rotate(y, end, a, b, place_rate(j + 2, method, h, nq, y, f, w), w.y_new)
        start = end + 4


@jitted
def place_rate(i, method, h, nq, y, f, w):
    """Write one averaged acceleration and rate at the end of the step; returns how far it moves in the step."""
    beta, gamma = method.beta, method.gamma
    a0, old = f[nq + i], w.vectors[AVERAGE, i]
    mixed = (1.0 - method.alpha_f) * w.vectors[ACCELERATION, i] + method.alpha_f * a0
    new = (mixed - method.alpha_m * old) / (1.0 - method.alpha_m)
    w.vectors[NEW_AVERAGE, i] = new
    w.y_new[nq + i] = y[nq + i] + h * ((1.0 - gamma) * old + gamma * new)
    return h * (y[nq + i] + h * ((0.5 - beta) * old + beta * new))


@jitted
def correct_end(method, h, loop, w):
    """Correct the accelerations, for which `w.row` gives others, by Newton; returns the size of the correction."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    for i in range(nv):
        w.vectors[CORRECTION, i] = w.row[nq + i] - w.vectors[ACCELERATION, i]
    lu_solve(w.matrix, w.pivots, w.vectors[CORRECTION])
    by_q, by_v = leverage(method, h)
    total, start = 0.0, 0
    if nq == nv:
        for i in range(nv):
            total += (by_q * w.vectors[CORRECTION, i] / error_scale(loop.control, loop.y[i], w.y_new[i])) ** 2
            total += correct_rate(i, by_v, nv, loop.control, loop.y, w)
        return math.sqrt(total / (2 * nv))
    for k in range(n_quaternions(loop.sizes) + 1):
        end = quaternion_at(loop.sizes, k)
        for i in range(start, end):
            total += (
                by_q * w.vectors[CORRECTION, i - k] / error_scale(loop.control, loop.y[i], w.y_new[i])
            ) ** 2
            total += correct_rate(i - k, by_v, nq, loop.control, loop.y, w)
        if end < nq:
            tolerance = error_scale(loop.control, 1.0, 1.0)
            for i in range(end - k, end - k + 3):
                total += (by_q * w.vectors[CORRECTION, i] / tolerance) ** 2
                total += correct_rate(i, by_v, nq, loop.control, loop.y, w)
        start = end + 4
    return math.sqrt(total / (2 * nv))


@jitted
def correct_rate(i, by_v, nq, control, y, w):
    """Correct an acceleration; returns the square of what that makes of its rate, in tolerances."""
    change = w.vectors[CORRECTION, i]
    w.vectors[ACCELERATION, i] += change
    return (by_v * change / error_scale(control, y[nq + i], w.y_new[nq + i])) ** 2


@jitted
def reach_end(h, loop, t1, w):
    """Project the new state, evaluate its rhs row, add the work (trapezoidal rule); returns a status."""
    if loop.sizes[at.NM] > 0:
        loop.control[at.MIN_PIVOT_RATIO] = min(
            loop.control[at.MIN_PIVOT_RATIO], w.row[loop.sizes[at.N_ROW] - 1]
        )
    status = project_state(loop, t1, w.y_new, w.scratch[: projection_size(loop.sizes)])
    if status != at.RUNNING:
        return status
    if not evaluate(loop, t1, w.y_new, w.row):
        return at.NOT_FINITE
    n = loop.sizes[at.NQ] + loop.sizes[at.NV]
    for i in range(n, n + loop.sizes[at.NW]):
        w.y_new[i] = loop.y[i] + 0.5 * h * (loop.f[i] + w.row[i])
    return at.RUNNING if all_finite(w.y_new, loop.sizes[at.NY]) else at.NOT_FINITE

"""The equations of a step of bdf: simplified Newton, reduced to the size of v."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.bdf.work import (
    CHANGE,
    FACTORED_FOR,
    HAVE_FACTORS,
    HAVE_JACOBIAN,
    ITERATIONS,
    JACOBIAN_IS_FRESH,
    NEWTON_BOUND,
    PAST,
    PREDICTED,
    SCALE,
    Y_NEW,
)
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.evaluation import evaluate
from symgen.runtime.integrate.jacobian import acceleration_jacobian
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.newton import CONVERGED, ITERATING, forget_rate, judge_correction, start_newton
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, quaternion_rate
from symgen.runtime.integrate.radau.rotation_increments import factor_rotations


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

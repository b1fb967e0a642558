"""The equations of a step of bdf on index-2 equations: simplified Newton, reduced to the size of v and λ."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.bdf.newton import retract_positions
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
from symgen.runtime.integrate.ggl import (
    divide_blocks,
    equation_residuals,
    set_blocks,
    set_shifted,
    solve_shifted,
)
from symgen.runtime.integrate.linear import lu_factor
from symgen.runtime.integrate.newton import CONVERGED, ITERATING, forget_rate, judge_correction, start_newton
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at


@jitted
def iterate_index2(g, loop, t1, w):
    """Improve the new state from the predicted one by simplified Newton; returns RUNNING, or why not."""
    nq, nv, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NM]
    copy(w.states[PREDICTED], w.states[Y_NEW])
    for i in range(nv):
        w.states[CHANGE, nq + i] = 0.0
    for k in range(loop.sizes[at.NH]):
        w.multipliers[m + k] = 0.0
    retract_index2(g, loop.sizes, w)
    # Multipliers of the predicted motion: see `predict_index2` of the Radau methods.
    if not evaluate(loop, t1, w.states[Y_NEW], w.row):
        return at.NOT_FINITE
    for k in range(m):
        w.multipliers[k] = w.row[nq + nv + loop.sizes[at.NW] + k]
    status = prepare_matrix(g, loop, t1, w)
    if status != at.RUNNING:
        return status
    start_newton(w.numbers)
    verdict = ITERATING
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        size = correct(g, loop, t1, w)
        if not math.isfinite(size):
            return at.NOT_FINITE
        loop.counters[at.NEWTON_ITERATIONS] += 1
        verdict = judge_correction(iteration, size, w.numbers[NEWTON_BOUND], w.numbers)
    w.numbers[ITERATIONS] = iteration
    return at.RUNNING if verdict == CONVERGED else at.NEWTON_FAILED


@jitted
def retract_index2(g, sizes, w):
    """Set the positions of `w.states[Y_NEW]` by its rates and μ: g (d + past) = v + C μ."""
    add_steered(w.states[Y_NEW], sizes[at.NQ], w.multipliers, sizes[at.NM], sizes, w)
    retract_positions(1.0 / g, sizes, w.rates, 0, w)


@jitted
def add_steered(rates, first, multipliers, first_multiplier, sizes, w):
    """Write `rates[first:]` plus C `multipliers[first_multiplier:]` to `w.rates`."""
    nh, b = sizes[at.NH], divide_blocks(sizes, w.blocks)
    for i in range(sizes[at.NV]):
        total = rates[first + i]
        for k in range(nh):
            total += b.steer[i, k] * multipliers[first_multiplier + k]
        w.rates[i] = total


@jitted
def prepare_matrix(g, loop, t1, w):
    """Renew the Jacobian where there is none, and the factors where they are for another γ; returns a status."""
    b = divide_blocks(loop.sizes, w.blocks)
    if not loop.counters[HAVE_JACOBIAN]:
        status = set_blocks(loop, t1, w.states[Y_NEW], w.row, w.implicit, b)
        if status != at.RUNNING:
            return status
        loop.counters[HAVE_JACOBIAN], loop.counters[JACOBIAN_IS_FRESH], loop.counters[HAVE_FACTORS] = 1, 1, 0
    # Lengths of equal steps differ by round-off of time, which is nothing to Newton.
    if loop.counters[HAVE_FACTORS] and abs(g - w.numbers[FACTORED_FOR]) <= 1e-6 * g:
        return at.RUNNING
    set_shifted(g, loop.sizes[at.NH], b, w.matrix)
    loop.counters[at.FACTORISATIONS] += 1
    w.numbers[FACTORED_FOR] = g
    forget_rate(w.numbers)
    status = lu_factor(w.matrix, w.pivots)
    loop.counters[HAVE_FACTORS] = 1 if status == at.RUNNING else 0
    return status


@jitted
def correct(g, loop, t1, w):
    """Correct the new state and its multipliers; returns the size of the correction of the state in tolerances."""
    nq, nv, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NM]
    b = divide_blocks(loop.sizes, w.blocks)
    change, y = w.states[CHANGE], w.states[Y_NEW]
    for i in range(nv):
        w.arguments[nq + nv + i] = g * (w.states[PAST, nq + i] + change[nq + i])
    for k in range(m):
        w.arguments[nq + 2 * nv + k] = w.multipliers[k]
    equation_residuals(loop, t1, y, w.arguments, w.equations, w.correction)
    solve_shifted(g, loop.sizes, b, w.matrix, w.pivots, w.correction)
    for k in range(m + loop.sizes[at.NH]):
        w.multipliers[k] += w.correction[nv + k]
    total = 0.0
    for i in range(nv):
        change[nq + i] += w.correction[i]
        y[nq + i] = w.states[PREDICTED, nq + i] + change[nq + i]
        total += (w.correction[i] / w.states[SCALE, nq + i]) ** 2
    add_steered(w.correction, 0, w.correction, nv + m, loop.sizes, w)
    start = 0
    for k in range(n_quaternions(loop.sizes) + 1):
        end = quaternion_at(loop.sizes, k)
        for i in range(start, min(end + 3, nq)):
            total += (w.rates[i - k] / (g * w.states[SCALE, i])) ** 2
        start = end + 4
    retract_index2(g, loop.sizes, w)
    return math.sqrt(total / (2 * nv))

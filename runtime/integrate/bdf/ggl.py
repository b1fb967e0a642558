"""The equations of a step of bdf on index-2 equations: simplified Newton, reduced to the size of v and λ."""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.bdf.newton import (
    CHANGE,
    FACTORED_FOR,
    HAVE_FACTORS,
    HAVE_JACOBIAN,
    ITERATIONS,
    JACOBIAN_IS_FRESH,
    N_COLUMNS,
    N_DIFFERENCES,
    N_NUMBERS,
    N_STATES,
    NEWTON_BOUND,
    PAST,
    PREDICTED,
    SCALE,
    Y_NEW,
    retract_positions,
)
from symgen.runtime.integrate.ggl import (
    blocks_size,
    divide_blocks,
    equation_residuals,
    equations_size,
    set_blocks,
    set_shifted,
    solve_shifted,
)
from symgen.runtime.integrate.jacobian import jacobian_work_size
from symgen.runtime.integrate.linear import lu_factor
from symgen.runtime.integrate.loop import copy, evaluate
from symgen.runtime.integrate.newton import CONVERGED, ITERATING, forget_rate, judge_correction, start_newton
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at


class BdfGglWork(NamedTuple):
    """Work arrays; those not described here are as in `BdfWork`.

    Attributes
    ----------
    numbers, differences, states, weights, row, implicit, scratch : ndarray
    blocks : ndarray
        See `ggl.divide_blocks`.
    matrix, pivots : ndarray, shapes (nv + m, nv + m), (nv + m)
        Factors of `ggl.set_shifted`'s matrix for g = α/h.
    multipliers : ndarray, shape (m + nh,)
        λ and μ.
    correction : ndarray, shape (nv + m + nh,)
    rates : ndarray, shape (nv,)
        v + C μ, or what a correction adds to that.
    arguments, equations : ndarray
        See `ggl.equation_residuals`.
    """

    numbers: np.ndarray
    differences: np.ndarray
    states: np.ndarray
    weights: np.ndarray
    row: np.ndarray
    blocks: np.ndarray
    matrix: np.ndarray
    pivots: np.ndarray
    multipliers: np.ndarray
    correction: np.ndarray
    rates: np.ndarray
    arguments: np.ndarray
    equations: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def bdf_ggl_work_size(sizes):
    """Length of `work` for `advance_bdf_ggl`."""
    nv, ny, m, nh = sizes[at.NV], sizes[at.NY], sizes[at.NM], sizes[at.NH]
    n = nv + m
    own = (
        N_NUMBERS + (N_DIFFERENCES + N_STATES) * ny + 2 * N_COLUMNS**2 + sizes[at.N_ROW] + blocks_size(sizes)
    )
    own += n * n + n + m + nh + n + nh + nv + sizes[at.NQ] + nv + n + equations_size(sizes)
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def bdf_ggl_work(sizes, work):
    """Divide `work`, of length `bdf_ggl_work_size(sizes)`, into a `BdfGglWork`."""
    nv, ny, m, nh = sizes[at.NV], sizes[at.NY], sizes[at.NM], sizes[at.NH]
    n = nv + m
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    size = N_DIFFERENCES * ny
    differences, rest = rest[:size].reshape((N_DIFFERENCES, ny)), rest[size:]
    states, rest = rest[: N_STATES * ny].reshape((N_STATES, ny)), rest[N_STATES * ny :]
    size = 2 * N_COLUMNS * N_COLUMNS
    weights, rest = rest[:size].reshape((2, N_COLUMNS, N_COLUMNS)), rest[size:]
    row, rest = rest[: sizes[at.N_ROW]], rest[sizes[at.N_ROW] :]
    size = blocks_size(sizes)
    blocks, rest = rest[:size], rest[size:]
    matrix, rest = rest[: n * n].reshape((n, n)), rest[n * n :]
    pivots, rest = rest[:n].view(np.int64), rest[n:]
    multipliers, rest = rest[: m + nh], rest[m + nh :]
    correction, rest = rest[: n + nh], rest[n + nh :]
    rates, rest = rest[:nv], rest[nv:]
    size = sizes[at.NQ] + nv + n
    arguments, rest = rest[:size], rest[size:]
    size = equations_size(sizes)
    equations, rest = rest[:size], rest[size:]
    size = jacobian_work_size(sizes)
    return BdfGglWork(
        numbers, differences, states, weights, row, blocks, matrix, pivots, multipliers, correction,
        rates, arguments, equations, rest[:size], rest[size:],
    )  # fmt: skip


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

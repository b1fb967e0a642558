"""Symmetric compositions of velocity Verlet with a fixed step, for accelerations that depend on positions only."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size, finish_step, needs_dense
from symgen.runtime.integrate.compensated import add_compensated
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.loop import take_steps
from symgen.runtime.integrate.step_control import grid_end, grid_length
from symgen.runtime.integrate.symplectic.composition_coefficients import PLACES

N_DENSE_TERMS = 8

# Rows of `states` and of `rows`.
Y_NEW, REST, Y_BETWEEN = range(3)
F_NEW, F_BETWEEN = 0, 1


class CompositionWork(NamedTuple):
    """Work arrays of `advance_composition`.

    Attributes
    ----------
    states : ndarray, shape (3, NY)
        The new state, what rounding dropped from it, a state within the step.
    rows : ndarray, shape (3, N_ROW)
        The rhs rows of the new state and of two states within the step.
    data : ndarray, shape (6,)
        What dense output of one component is fitted to.
    scratch : ndarray
        See `finish_step`.
    """

    states: np.ndarray
    rows: np.ndarray
    data: np.ndarray
    scratch: np.ndarray


@jitted
def composition_work_size(sizes):
    """Length of `work` for `advance_composition`."""
    return 3 * sizes[at.NY] + 3 * sizes[at.N_ROW] + 6 + finish_scratch_size(sizes)


@jitted
def composition_work(sizes, work):
    """Divide `work`, of length `composition_work_size(sizes)`, into a `CompositionWork`."""
    ny, n_row = sizes[at.NY], sizes[at.N_ROW]
    states, rest = work[: 3 * ny].reshape((3, ny)), work[3 * ny :]
    rows, rest = rest[: 3 * n_row].reshape((3, n_row)), rest[3 * n_row :]
    return CompositionWork(states, rows, rest[:6], rest[6:])


@jitted
def advance_composition(method, loop):
    """Advance with a `Composition` until something is for Python to do.

    Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), V.3.2, with the compensated summation of VIII.5.
    Time moves with the positions, so forces may depend on it. Arguments and result are those of all step loops, see
    docs/step-loops.md.
    """
    w = composition_work(loop.sizes, loop.work)
    if not loop.counters[at.F_VALID]:
        if not evaluate(loop, loop.control[at.T], loop.y, loop.f):
            return at.NOT_FINITE
        loop.counters[at.F_VALID] = 1
        for i in range(loop.sizes[at.NY]):
            w.states[REST, i] = 0.0
    return take_steps(composition_step, method, loop, w)


@jitted
def composition_step(method, loop, w):
    """Take one step of the grid and record it; returns a status."""
    t0 = loop.control[at.T]
    t1 = grid_end(loop)
    h = grid_length(loop.control, t0, t1)
    status = compose_step(method, loop, t0, t1, h, w)
    if status != at.RUNNING:
        return status
    if needs_dense(loop, t1):
        composition_dense(method, loop, t0, h, w)
    copy(w.states[Y_NEW], loop.y)
    copy(w.rows[F_NEW], loop.f)
    return finish_step(loop, t0, t1, loop.dense, N_DENSE_TERMS, w.scratch)


@jitted
def compose_step(method, loop, t0, t1, h, w):
    """Write the new state to `w.states[Y_NEW]` and its rhs row to `w.rows[F_NEW]`; returns a status."""
    nq, nv, n_steps = loop.sizes[at.NQ], loop.sizes[at.NV], method.drifts.shape[0]
    y_new, rest, row = w.states[Y_NEW], w.states[REST], w.rows[F_NEW]
    copy(loop.y, y_new)
    copy(loop.f, row)
    for s in range(n_steps):
        kick(h * method.kicks[s], loop, t0 + h * method.times[s], w)
        for i in range(nq):
            add_compensated(h * method.drifts[s] * y_new[nq + i], i, y_new, rest)
        t = t1 if s == n_steps - 1 else t0 + h * method.times[s + 1]
        evaluate(loop, t, y_new, row)
    kick(h * method.kicks[n_steps], loop, t1, w)
    if loop.sizes[at.NW] > 0:
        evaluate(loop, t1, y_new, row)
    else:
        for i in range(nv):
            row[i] = y_new[nq + i]
    return (
        at.RUNNING
        if all_finite(y_new, loop.sizes[at.NY]) and all_finite(row, loop.sizes[at.NY])
        else at.NOT_FINITE
    )


@jitted
def kick(length, loop, t, w):
    """Move the velocities by `length` [s] with the accelerations in `w.rows[F_NEW]`, and work with its power.

    Positions and forces stay, so power is linear in v: its value at the mean velocity is its mean.
    """
    nq, n = loop.sizes[at.NQ], loop.sizes[at.NQ] + loop.sizes[at.NV]
    y_new, rest, row = w.states[Y_NEW], w.states[REST], w.rows[F_NEW]
    if loop.sizes[at.NW] > 0:
        copy(y_new, w.states[Y_BETWEEN])
        for i in range(nq, n):
            w.states[Y_BETWEEN, i] += 0.5 * length * row[i]
        evaluate(loop, t, w.states[Y_BETWEEN], w.rows[F_BETWEEN])
        add_compensated(length * w.rows[F_BETWEEN, n], n, y_new, rest)
    for i in range(nq, n):
        add_compensated(length * row[i], i, y_new, rest)


@jitted
def composition_dense(method, loop, t0, h, w):
    """Fill `dense`: positions of degree 7 with the accelerations at both ends and at two places between.

    The accelerations between are taken on the quintic through q, v and a of both ends, as dense output of dop853
    takes further stages; so this costs two evaluations, and only steps that need it pay them.
    """
    nq, ny = loop.sizes[at.NQ], loop.sizes[at.NY]
    y_new = w.states[Y_NEW]
    for i in range(ny):
        loop.dense[0, i] = loop.y[i]
        loop.dense[1, i] = y_new[i] - loop.y[i]
    for k in range(2):
        copy(loop.y, w.states[Y_BETWEEN])
        for i in range(nq):
            end_data(h, i, nq, loop.y, loop.f, w, loop.dense)
            bump, slope = 0.0, 0.0
            for j in range(4):
                bump += method.between[k, j] * w.data[j]
                slope += method.between[2 + k, j] * w.data[j]
            w.states[Y_BETWEEN, i] = loop.y[i] + PLACES[k] * loop.dense[1, i] + bump
            w.states[Y_BETWEEN, nq + i] = (loop.dense[1, i] + slope) / h
        evaluate(loop, t0 + PLACES[k] * h, w.states[Y_BETWEEN], w.rows[F_BETWEEN + k])
    for i in range(nq):
        end_data(h, i, nq, loop.y, loop.f, w, loop.dense)
        for k in range(2):
            w.data[4 + k] = h * h * w.rows[F_BETWEEN + k, nq + i]
        combine(method.bends, w.data, i, loop.dense)
        for r in range(5):
            total = 0.0
            for j in range(6):
                total += method.rates[r, j] * loop.dense[2 + j, i]
            loop.dense[2 + r, nq + i] = total / h
        loop.dense[7, nq + i] = 0.0
    if loop.sizes[at.NW] > 0:
        n = ny - 1
        w.data[0], w.data[1] = h * loop.f[n] - loop.dense[1, n], h * w.rows[F_NEW, n] - loop.dense[1, n]
        for k in range(2):
            w.data[2 + k] = h * w.rows[F_BETWEEN + k, n] - loop.dense[1, n]
        combine(method.work, w.data, n, loop.dense)
        loop.dense[6, n] = 0.0
        loop.dense[7, n] = 0.0


@jitted
def end_data(h, i, nq, y, f, w, dense):
    """Write what both ends say about position `i` to the first four of `w.data`."""
    w.data[0] = h * y[nq + i] - dense[1, i]
    w.data[1] = h * w.states[Y_NEW, nq + i] - dense[1, i]
    w.data[2] = h * h * f[nq + i]
    w.data[3] = h * h * w.rows[F_NEW, nq + i]


@jitted
def combine(matrix, data, i, dense):
    """Write `matrix` times `data` to the rows of component `i` from the third on."""
    for r in range(matrix.shape[0]):
        total = 0.0
        for j in range(matrix.shape[1]):
            total += matrix[r, j] * data[j]
        dense[2 + r, i] = total

"""Symmetric compositions of velocity Verlet with a fixed step, for accelerations that depend on positions only."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.after_step import finish_scratch_size, finish_step, needs_dense
from symgen.runtime.integrate.compensated import add_compensated
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.layout import (
    F_VALID,
    MAX_STEPS_PER_CALL,
    N_LOGGED_STEPS,
    N_ROW,
    NEAR_WATCH,
    NOT_FINITE,
    NQ,
    NV,
    NW,
    NY,
    RUNNING,
    T,
)
from symgen.runtime.integrate.step_control import grid_end, grid_length, watch_is_near
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
    return 3 * sizes[NY] + 3 * sizes[N_ROW] + 6 + finish_scratch_size(sizes)


@jitted
def composition_work(sizes, work):
    """Divide `work`, of length `composition_work_size(sizes)`, into a `CompositionWork`."""
    ny, n_row = sizes[NY], sizes[N_ROW]
    states, rest = work[: 3 * ny].reshape((3, ny)), work[3 * ny :]
    rows, rest = rest[: 3 * n_row].reshape((3, n_row)), rest[3 * n_row :]
    return CompositionWork(states, rows, rest[:6], rest[6:])


@jitted
def advance_composition(
    method, addresses, sizes, p, control, counters, y, f, work, frame_times, frames, step_log, dense
):
    """Advance with a `Composition` until something is for Python to do.

    Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), V.3.2, with the compensated summation of VIII.5.
    Time moves with the positions, so forces may depend on it. Arguments and result are those of all step loops, see
    docs/architecture.md.
    """
    w = composition_work(sizes, work)
    if not counters[F_VALID]:
        if not evaluate(addresses, sizes, p, counters, control[T], y, f):
            return NOT_FINITE
        counters[F_VALID] = 1
        for i in range(sizes[NY]):
            w.states[REST, i] = 0.0
    done = 0
    while done < counters[MAX_STEPS_PER_CALL] and counters[N_LOGGED_STEPS] < step_log.shape[0]:
        if watch_is_near(control):
            return NEAR_WATCH
        t0 = control[T]
        t1 = grid_end(control, counters)
        h = grid_length(control, t0, t1)
        status = compose_step(method, addresses, sizes, p, counters, t0, t1, h, y, f, w)
        if status != RUNNING:
            return status
        if needs_dense(sizes, counters, frame_times, t1):
            composition_dense(method, addresses, sizes, p, counters, t0, h, y, f, w, dense)
        copy(w.states[Y_NEW], y)
        copy(w.rows[F_NEW], f)
        status = finish_step(
            addresses, sizes, p, control, counters, t0, t1, y, dense, N_DENSE_TERMS, w.scratch,
            frame_times, frames, step_log,
        )  # fmt: skip
        if status != RUNNING:
            return status
        done += 1
    return RUNNING


@jitted
def compose_step(method, addresses, sizes, p, counters, t0, t1, h, y, f, w):
    """Write the new state to `w.states[Y_NEW]` and its rhs row to `w.rows[F_NEW]`; returns a status."""
    nq, nv, n_steps = sizes[NQ], sizes[NV], method.drifts.shape[0]
    y_new, rest, row = w.states[Y_NEW], w.states[REST], w.rows[F_NEW]
    copy(y, y_new)
    copy(f, row)
    for s in range(n_steps):
        kick(h * method.kicks[s], addresses, sizes, p, counters, t0 + h * method.times[s], w)
        for i in range(nq):
            add_compensated(h * method.drifts[s] * y_new[nq + i], i, y_new, rest)
        t = t1 if s == n_steps - 1 else t0 + h * method.times[s + 1]
        evaluate(addresses, sizes, p, counters, t, y_new, row)
    kick(h * method.kicks[n_steps], addresses, sizes, p, counters, t1, w)
    if sizes[NW] > 0:
        evaluate(addresses, sizes, p, counters, t1, y_new, row)
    else:
        for i in range(nv):
            row[i] = y_new[nq + i]
    return RUNNING if all_finite(y_new, sizes[NY]) and all_finite(row, sizes[NY]) else NOT_FINITE


@jitted
def kick(length, addresses, sizes, p, counters, t, w):
    """Move the velocities by `length` [s] with the accelerations in `w.rows[F_NEW]`, and work with its power.

    Positions and forces stay, so power is linear in v: its value at the mean velocity is its mean.
    """
    nq, n = sizes[NQ], sizes[NQ] + sizes[NV]
    y_new, rest, row = w.states[Y_NEW], w.states[REST], w.rows[F_NEW]
    if sizes[NW] > 0:
        copy(y_new, w.states[Y_BETWEEN])
        for i in range(nq, n):
            w.states[Y_BETWEEN, i] += 0.5 * length * row[i]
        evaluate(addresses, sizes, p, counters, t, w.states[Y_BETWEEN], w.rows[F_BETWEEN])
        add_compensated(length * w.rows[F_BETWEEN, n], n, y_new, rest)
    for i in range(nq, n):
        add_compensated(length * row[i], i, y_new, rest)


@jitted
def composition_dense(method, addresses, sizes, p, counters, t0, h, y, f, w, dense):
    """Fill `dense`: positions of degree 7 with the accelerations at both ends and at two places between.

    The accelerations between are taken on the quintic through q, v and a of both ends, as dense output of dop853
    takes further stages; so this costs two evaluations, and only steps that need it pay them.
    """
    nq, ny = sizes[NQ], sizes[NY]
    y_new = w.states[Y_NEW]
    for i in range(ny):
        dense[0, i] = y[i]
        dense[1, i] = y_new[i] - y[i]
    for k in range(2):
        copy(y, w.states[Y_BETWEEN])
        for i in range(nq):
            end_data(h, i, nq, y, f, w, dense)
            bump, slope = 0.0, 0.0
            for j in range(4):
                bump += method.between[k, j] * w.data[j]
                slope += method.between[2 + k, j] * w.data[j]
            w.states[Y_BETWEEN, i] = y[i] + PLACES[k] * dense[1, i] + bump
            w.states[Y_BETWEEN, nq + i] = (dense[1, i] + slope) / h
        evaluate(
            addresses, sizes, p, counters, t0 + PLACES[k] * h, w.states[Y_BETWEEN], w.rows[F_BETWEEN + k]
        )
    for i in range(nq):
        end_data(h, i, nq, y, f, w, dense)
        for k in range(2):
            w.data[4 + k] = h * h * w.rows[F_BETWEEN + k, nq + i]
        combine(method.bends, w.data, i, dense)
        for r in range(5):
            total = 0.0
            for j in range(6):
                total += method.rates[r, j] * dense[2 + j, i]
            dense[2 + r, nq + i] = total / h
        dense[7, nq + i] = 0.0
    if sizes[NW] > 0:
        n = ny - 1
        w.data[0], w.data[1] = h * f[n] - dense[1, n], h * w.rows[F_NEW, n] - dense[1, n]
        for k in range(2):
            w.data[2 + k] = h * w.rows[F_BETWEEN + k, n] - dense[1, n]
        combine(method.work, w.data, n, dense)
        dense[6, n] = 0.0
        dense[7, n] = 0.0


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

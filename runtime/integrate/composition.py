"""Symmetric compositions of velocity Verlet with a fixed step, for accelerations that depend on positions only."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size, finish_step, needs_dense
from symgen.runtime.integrate.loop import add_compensated, all_finite, copy, evaluate, take_steps
from symgen.runtime.integrate.nested_basis import fit_rows, rows_of_derivative, values
from symgen.runtime.integrate.step_control import grid_end, grid_length

# The first half of each palindrome and its middle: steps of Verlet, in units of the whole step.
# Order 4, 5 stages: Suzuki, Phys. Lett. A 146 (1990) 319. Orders 6 and 8, 9 and 17 stages: Kahan, Li, Math. Comp. 66
# (1997) 1089, with the digits of Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), V.3.2, (3.12), (3.14).
_SUZUKI = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))
HALVES = {
    4: (_SUZUKI, _SUZUKI, 1.0 - 4.0 * _SUZUKI),
    6: (
        0.39216144400731413927925056,
        0.33259913678935943859974864,
        -0.70624617255763935980996482,
        0.08221359629355080023149045,
        0.79854399093482996339895035,
    ),
    8: (
        0.13020248308889008087881763,
        0.56116298177510838456196441,
        -0.38947496264484728640807860,
        0.15884190655515560089621075,
        -0.39590389413323757733623154,
        0.18453964097831570709183254,
        0.25837438768632204729397911,
        0.29501172360931029887096624,
        -0.60550853383003451169892108,
    ),
}

# Where dense output takes two more accelerations.
PLACES = (1.0 / 3.0, 2.0 / 3.0)
_ENDS = [(1, 0.0), (1, 1.0)]
_POSITIONS = [*_ENDS, (2, 0.0), (2, 1.0)]
_BETWEEN = [(0, place) for place in PLACES] + [(1, place) for place in PLACES]


class Composition(NamedTuple):
    """A symmetric composition of velocity Verlet steps.

    Attributes
    ----------
    drifts : ndarray, shape (s,)
        Lengths of the Verlet steps, in units of h; positions and time move with these.
    kicks : ndarray, shape (s + 1,)
        Velocities move with these, before, between and after the drifts.
    times : ndarray, shape (s + 1,)
        Of the kicks, from 0 to 1.
    bends : ndarray, shape (6, 6)
        From (h v0 - Δq, h v1 - Δq, h² a0, h² a1, h² a(1/3), h² a(2/3)) to rows 2 to 7 of the positions' dense output.
    between : ndarray, shape (4, 4)
        From the first four of these to q - q0 - θ Δq at 1/3 and 2/3, then its derivatives by θ there.
    rates : ndarray, shape (5, 6)
        From rows 2 to 7 of the positions to rows 2 to 6 of h times the velocities.
    work : ndarray, shape (4, 4)
        From h P - Δw at 0, 1, 1/3 and 2/3 to rows 2 to 5 of the work.
    """

    drifts: np.ndarray
    kicks: np.ndarray
    times: np.ndarray
    bends: np.ndarray
    between: np.ndarray
    rates: np.ndarray
    work: np.ndarray


def composition(order: int) -> Composition:
    """Return the composition of order 4, 6 or 8.

    Raises
    ------
    ValueError
        Where the coefficients do not sum to 1.
    """
    drifts = np.array(parts(order))
    if abs(drifts.sum() - 1.0) > 1e-14:
        raise ValueError(f"the steps of a composition must sum to 1, not to {drifts.sum()!r}")
    kicks = 0.5 * (np.append(0.0, drifts) + np.append(drifts, 0.0))
    times = np.append(0.0, np.cumsum(drifts))
    times[-1] = 1.0
    between = values(_BETWEEN, 6)[:, 2:] @ fit_rows(_POSITIONS)
    return Composition(
        drifts,
        kicks,
        times,
        bends=fit_rows([*_POSITIONS, (2, PLACES[0]), (2, PLACES[1])]),
        between=between,
        rates=np.ascontiguousarray(rows_of_derivative()[2:7, 2:]),
        work=fit_rows([*_ENDS, (1, PLACES[0]), (1, PLACES[1])]),
    )


def parts(order: int) -> tuple[float, ...]:
    """Return the lengths of the Verlet steps that one step of order 2, 4, 6 or 8 is made of, in parts of it."""
    if order == 2:
        return (1.0,)
    return (*HALVES[order], *HALVES[order][-2::-1])


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

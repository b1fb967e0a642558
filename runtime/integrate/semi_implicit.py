"""Semi-implicit Euler and velocity Verlet with a fixed step."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size, finish_step, needs_dense
from symgen.runtime.integrate.baumgarte import hold_stabilisation, release_stabilisation
from symgen.runtime.integrate.dense import hermite_dense
from symgen.runtime.integrate.loop import all_finite, copy, evaluate, take_steps
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.quaternions import retract
from symgen.runtime.integrate.step_control import grid_end

N_DENSE_TERMS = 4


class SymplecticScheme(NamedTuple):
    """Which scheme a loop advances with.

    Attributes
    ----------
    verlet : int
        1 for velocity Verlet, 0 for semi-implicit Euler.
    reuse : int
        1 where the rates are dq/dt, the acceleration depends on neither v nor constraints and no work is carried:
        that of the new positions serves the new velocities as it is, and a Verlet step costs one evaluation,
        otherwise two.
    """

    verlet: int
    reuse: int


class SymplecticWork(NamedTuple):
    """Work arrays of `advance_semi_implicit`.

    Attributes
    ----------
    y_new, row : ndarray, shapes (NY,), (N_ROW,)
        The new state and its rhs row.
    scratch : ndarray
        See `finish_step`.
    """

    y_new: np.ndarray
    row: np.ndarray
    scratch: np.ndarray


@jitted
def symplectic_work_size(sizes):
    """Length of `work`."""
    return sizes[at.NY] + sizes[at.N_ROW] + finish_scratch_size(sizes)


@jitted
def symplectic_work(sizes, work):
    """Divide `work`, of length `symplectic_work_size(sizes)`, into a `SymplecticWork`."""
    ny, n_row = sizes[at.NY], sizes[at.N_ROW]
    return SymplecticWork(work[:ny], work[ny : ny + n_row], work[ny + n_row :])


@jitted
def advance_semi_implicit(method, loop):
    """Advance with a `SymplecticScheme` until something is for Python to do; see docs/step-loops.md."""
    w = symplectic_work(loop.sizes, loop.work)
    if not loop.counters[at.F_VALID]:
        if not evaluate(loop, loop.control[at.T], loop.y, loop.f):
            return at.NOT_FINITE
        loop.counters[at.F_VALID] = 1
    return take_steps(scheme_step, method, loop, w)


@jitted
def scheme_step(method, loop, w):
    """Take one step of the grid and record it; returns a status."""
    t0, t1 = loop.control[at.T], grid_end(loop)
    hold_stabilisation(loop, t0, t1 - t0, loop.f, w.scratch[: projection_size(loop.sizes)])
    if method.verlet:
        verlet_step(method.reuse, loop, t1, t1 - t0, w.y_new, w.row)
    else:
        semi_implicit_step(loop.sizes, t1 - t0, loop.y, loop.f, w.y_new)
    status = complete_step(method, loop, t1, t1 - t0, w)
    if status != at.RUNNING:
        return status
    if needs_dense(loop, t1):
        hermite_dense(loop.y, w.y_new, loop.f, w.row, t1 - t0, loop.sizes[at.NY], loop.dense)
    copy(w.y_new, loop.y)
    copy(w.row, loop.f)
    return finish_step(loop, t0, t1, loop.dense, N_DENSE_TERMS, w.scratch)


@jitted
def semi_implicit_step(sizes, h, y, f, y_new):
    """Write the new velocities, then the new positions moved with them (order 1)."""
    nq, nv = sizes[at.NQ], sizes[at.NV]
    for i in range(nv):
        y_new[nq + i] = y[nq + i] + h * f[nq + i]
    retract(sizes, y, h, y_new, nq, y_new)


@jitted
def verlet_step(reuse, loop, t1, h, y_new, row):
    """Write the new positions and velocities of a velocity Verlet step (order 2).

    Hairer, Lubich, Wanner, Acta Numerica 12 (2003) 399, (1.7). Where the acceleration depends on v, the new one is
    taken at predicted velocities v + h a: their error h^2 enters the new velocities as h^3, as the method's own does.
    Quaternions are turned by h (v + h a / 2), which misses the turn of a step by h^3 (w x w') / 12.
    """
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    for i in range(nv):
        y_new[nq + i] = loop.y[nq + i] + 0.5 * h * loop.f[nq + i]
    retract(loop.sizes, loop.y, h, y_new, nq, y_new)
    for i in range(nv):
        y_new[nq + i] = loop.y[nq + i] + h * loop.f[nq + i]
    for i in range(nq + nv, loop.sizes[at.NY]):
        y_new[i] = loop.y[i]
    evaluate(loop, t1, y_new, row)
    for i in range(nv):
        y_new[nq + i] = loop.y[nq + i] + 0.5 * h * (loop.f[nq + i] + row[nq + i])
        if reuse:
            row[i] = y_new[nq + i]


@jitted
def complete_step(method, loop, t1, h, w):
    """Project the new state, evaluate its derivative, add the work (trapezoidal rule); returns a status."""
    nq, nv, y_new, row = loop.sizes[at.NQ], loop.sizes[at.NV], w.y_new, w.row
    release_stabilisation(loop)
    if loop.addresses[at.PROJECT] != 0:
        if project_state(loop, t1, y_new, w.scratch[: projection_size(loop.sizes)]):
            return at.PROJECTION_FAILED
    if not (method.verlet and method.reuse):
        evaluate(loop, t1, y_new, row)
    if loop.sizes[at.NM] > 0:
        loop.control[at.MIN_PIVOT_RATIO] = min(
            loop.control[at.MIN_PIVOT_RATIO], row[loop.sizes[at.N_ROW] - 1]
        )
    for i in range(nq + nv, nq + nv + loop.sizes[at.NW]):
        y_new[i] = loop.y[i] + 0.5 * h * (loop.f[i] + row[i])
    return (
        at.RUNNING
        if all_finite(y_new, loop.sizes[at.NY]) and all_finite(row, loop.sizes[at.NY])
        else at.NOT_FINITE
    )

"""Semi-implicit Euler and velocity Verlet with a fixed step."""

from typing import NamedTuple

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size, finish_step, needs_dense
from symgen.runtime.integrate.baumgarte import hold_stabilisation, release_stabilisation
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.dense import hermite_dense
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.quaternions import retract
from symgen.runtime.integrate.step_control import grid_end, watch_is_near

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


@jitted
def symplectic_work_size(sizes):
    """Length of `work`."""
    return sizes[at.NY] + sizes[at.N_ROW] + finish_scratch_size(sizes)


@jitted
def advance_semi_implicit(method, loop):
    """Advance with a `SymplecticScheme` until something is for Python to do; see docs/architecture.md."""
    ny, n_row = loop.sizes[at.NY], loop.sizes[at.N_ROW]
    y_new, row, scratch = loop.work[:ny], loop.work[ny : ny + n_row], loop.work[ny + n_row :]
    if not loop.counters[at.F_VALID]:
        if not evaluate(loop, loop.control[at.T], loop.y, loop.f):
            return at.NOT_FINITE
        loop.counters[at.F_VALID] = 1
    done = 0
    while (
        done < loop.counters[at.MAX_STEPS_PER_CALL]
        and loop.counters[at.N_LOGGED_STEPS] < loop.step_log.shape[0]
    ):
        if watch_is_near(loop.control):
            return at.NEAR_WATCH
        t0, t1 = loop.control[at.T], grid_end(loop)
        hold_stabilisation(loop, t0, t1 - t0, loop.f, scratch[: projection_size(loop.sizes)])
        if method.verlet:
            verlet_step(method.reuse, loop, t1, t1 - t0, y_new, row)
        else:
            semi_implicit_step(loop.sizes, t1 - t0, loop.y, loop.f, y_new)
        status = complete_step(method, loop, t1, t1 - t0, y_new, row, scratch)
        if status != at.RUNNING:
            return status
        if needs_dense(loop, t1):
            hermite_dense(loop.y, y_new, loop.f, row, t1 - t0, ny, loop.dense)
        copy(y_new, loop.y)
        copy(row, loop.f)
        status = finish_step(loop, t0, t1, loop.dense, N_DENSE_TERMS, scratch)
        if status != at.RUNNING:
            return status
        done += 1
    return at.RUNNING


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
def complete_step(method, loop, t1, h, y_new, row, scratch):
    """Project the new state, evaluate its derivative, add the work (trapezoidal rule); returns a status."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    release_stabilisation(loop)
    if loop.addresses[at.PROJECT] != 0:
        if project_state(loop, t1, y_new, scratch[: projection_size(loop.sizes)]):
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
